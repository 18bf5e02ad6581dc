//! Numbers from recordings: tolerances, offsets, delays and rhythms that healthy observations need.
//!
//! `observations -> rhythm (each signal) -> comparison (each pair of ways) -> delay -> order (bounds on the tail) -> widening
//! (errors that explain all bounds) -> calibration (the changed model, tested on what came later)`

mod order;
mod rhythm;
mod comparison;
mod delay;
mod widening;
mod calibration;

pub use calibration::{
    Calibration, Fitted, Options, PairFit, Parameter, Problem, Stretch, Verdicts, calibrate,
};
pub use order::Support;
pub use rhythm::Rhythm;
