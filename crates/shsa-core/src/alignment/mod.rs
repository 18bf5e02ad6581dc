//! Observations of different moments brought to one moment.
//!
//! A [`History`] keeps the recent past of one input, bounded. It answers two questions: which values overlap a validity
//! ([`History::overlapping`], for combinations), and what is the value at a validity ([`History::at`]): the hull of the
//! overlapping samples, else the nearest value, grown by the largest rate of change over the gap; [`History::ahead`] estimates what
//! comes after the newest one. A [`Port`] keeps the past of
//! one signal, scalar or vector, tests each observation by itself (late, out of order, invalid, out of range, too fast, the same
//! for too long), and counts the results. [`Clocks`] find wrong time stamps.

mod clock;
mod reception;
mod history;
mod line;
mod about;
mod ahead;
mod gate;
mod port;

pub use about::Known;
pub use clock::{Clocks, Misdated};
pub use history::{History, Reach, Reading, Sample};
pub use line::Line;
pub use port::{LONGEST_VECTOR, Port};
pub use reception::{Acceptance, Counts, Defect, Jump, Reception, Still};
