//! The data for the drawings of a report, recorded during a replay; their size does not depend on its length.

mod thinned;
mod case;
mod recorder;

pub(super) use case::{Admissions, Course, NeedCase, WayCase};
pub use recorder::Recorder;
pub(super) use recorder::{NeedRecord, VariableRecord, WayRecord};
pub(super) use thinned::Stretches;
