//! A simulated robot that breaks and heals, for the demonstration of the README, and for programs and tests without sensors of their own.
//!
//! The robot drives about a room and stops before obstacles. Its lidar falls silent, and later lies. [`rover`] is the robot on a bus:
//! [`rover::simulate`] runs it in real time beside other programs, [`rover::Trial`] in simulated time together with the engine, measured against the
//! true distances. The engine over a compiled-in model is a [`Healer`]; a [`terminal`], the picture of a [`scan`] and the [`verdict`] on a
//! signal show what happens. A trial repeats byte for byte from its seed.
//!
//! # Example
//!
//! ```
//! use shsa_demo::Provision;
//! use shsa_demo::rover::{Happening, Trial};
//!
//! let mut trial = Trial::new(7, Provision::Healed)?;
//! let mut decisions = Vec::new();
//! while trial.now().seconds() < 13.0 {
//!     decisions.extend(trial.step()?.into_iter().filter(|it| matches!(it, Happening::Decided(_))));
//! }
//! assert!(!decisions.is_empty()); // the lidar has been silent since second 12
//! # Ok::<(), shsa_demo::DemoError>(())
//! ```

mod error;
mod healer;
mod trial;
pub mod rover;
pub mod terminal;
pub mod verdict;
pub mod scan;

pub use error::DemoError;
pub use healer::{Decision, Healed, Healer, middle, scalar};
pub use trial::{Happening, Provision};
