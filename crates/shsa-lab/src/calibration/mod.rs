//! Calibration: the tolerances, delays and rhythms that healthy recordings need.
//!
//! `sessions -> rhythm (each signal) -> comparison (each pair of ways) -> delay -> calibration (scales, tails, surrogate
//! recordings through the engine; the changed model, tested on what it has not seen)`

mod chance;
mod poisson;
mod session;
mod parted;
mod frozen;
mod rhythm;
mod comparison;
mod delay;
mod widening;
mod fit;

pub(crate) use parted::observations;

pub use chance::Chance;
pub use comparison::{Comparison, Watched};
pub use fit::{
    Calibration, Fitted, Open, Options, PairFit, Parameter, Problem, Promise, STEPS, Stretch, Unfaulted,
    Verdicts, calibrate,
};
pub use parted::Parted;
pub use poisson::{fewest_expected, most_expected};
pub use rhythm::Rhythm;
pub use session::Session;
