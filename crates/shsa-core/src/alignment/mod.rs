//! Observations of different moments brought to one moment.
//!
//! A [`History`] keeps the recent past of one input, bounded. It answers two questions: which values overlap a
//! validity ([`History::overlapping`], for combinations), and what is known at a validity ([`History::at`]): the
//! hull of what overlaps, else the nearest value, grown by the largest rate of change over the gap. A [`Port`]
//! keeps the past of one signal, scalar or vector, says of each observation what is wrong with it in itself (late, out of
//! order, invalid, out of range, too fast, the same for too long), and counts. [`Clocks`] know which stamps are wrong.

mod clock;
mod reception;
mod history;
mod about;
mod gate;
mod port;

pub use about::Known;
pub use clock::{Clocks, Misdated};
pub use history::{History, Reach, Reading, Sample};
pub use port::{LONGEST_VECTOR, Port};
pub use reception::{Acceptance, Counts, Defect, Jump, Reception};
