//! A battery of 96 cells in series, of which a car takes the last quarter; half-way one of its sensors is lost or lies.
//!
//! The data flow: `car -> battery -> sensors with a fault -> engine -> limit of the power -> car`. What the engine serves is
//! measured against the truth, and so is what the sensors would say without it.

mod model;
mod battery;
mod car;
mod sensors;
mod values;
mod faults;
mod drive;
mod providers;
mod score;
mod trial;

pub use faults::Fault;
pub use model::{CELLS, MODULES, model};
pub use score::Score;
pub use trial::Trial;
pub use values::Values;
