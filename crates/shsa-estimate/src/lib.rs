//! State estimation and sensor fusion: measurements in, estimates with their uncertainty out.
//!
//! The engine of `shsa-core` compares sensors; this crate combines them. A `fusion` of a model becomes a new signal that is better than each
//! of its inputs, and predictions of each input by the others, which accuse or clear it.
//!
//! The modules are listed in reading order: the methods from averages ([`average`]) and fault-tolerant intervals ([`interval_fusion`]) to
//! filters ([`kalman`], [`unscented`], [`particle`]), then what surrounds a method. All methods implement one trait, [`method::Method`]; those
//! with a model use a [`system::System`], which is matrices ([`system::Linear`]) or formulas ([`formulas::Formulas`]). [`fusion`] takes
//! measurements in at their own times, also late ones. [`node`] runs the fusions of a model beside the engine.
//!
//! Nothing here reads a clock, a file or a socket, starts a thread, or allocates after construction. The same inputs give the
//! same bytes.
//!
//! # Example
//!
//! Three intervals for one level, of which at most one is wrong:
//!
//! ```
//! use shsa_core::interval::Interval;
//! use shsa_estimate::interval_fusion::marzullo;
//!
//! let levels = [Interval::new(1.9, 2.1), Interval::new(2.0, 2.2), Interval::new(5.0, 5.2)];
//! assert_eq!(marzullo(&levels, 1), Some(Interval::new(2.0, 2.1)));
//! assert_eq!(marzullo(&levels, 0), None); // they cannot all be right
//! ```

mod exponential;
mod kernel;
pub mod matrix;
pub mod random;
pub mod normal;
pub mod dual;
mod lanes;
pub mod average;
pub mod interval_fusion;
pub mod system;
mod compiled;
mod degree;
pub mod formulas;
pub mod continuous;
pub mod method;
pub mod direct;
pub mod kalman;
pub mod unscented;
pub mod particle;
pub mod bounded;
pub mod kinematic;
pub mod fusion;
pub mod extrapolation;
pub mod association;
pub mod node;
mod error;

pub use error::Error;
