//! State estimation and sensor fusion: measurements in, estimates with their uncertainty out.
//!
//! The modules are listed in reading order. All methods implement one trait, [`method::Method`]; those with a model use a
//! [`system::System`], which is matrices ([`system::Linear`]) or formulas ([`formulas::Formulas`]).
//!
//! [`node`] runs the fusions of a model beside the engine.
//!
//! Nothing here reads a clock, a file or a socket, starts a thread, or allocates after construction. The same inputs give the
//! same bytes.

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
mod mixture;
pub mod alternatives;
pub mod hypotheses;
pub mod bounded;
pub mod kinematic;
pub mod fusion;
pub mod extrapolation;
pub mod association;
pub mod node;
mod error;

pub use error::Error;
