//! The state that outlasts the process, by names, so that a changed knowledge base can go on with unchanged elements.

use crate::interval::Interval;
use crate::monitor::{Absence, TrendRecord};
use crate::order::{Order, Subject};
use crate::parameter::Memory;
use crate::time::{Time, Validity};
use crate::trust::{Accusation, Record};
use alloc::string::String;
use alloc::vec::Vec;

/// The state of an engine that new evidence would not bring back at once: [`Engine::snapshot`](super::Engine::snapshot) takes it,
/// [`Engine::restore`](super::Engine::restore) restores it. Recent comparisons are left out: they come again. Trends of minutes
/// are included: otherwise a drift would begin anew, and its culprit would pass for sound meanwhile.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Snapshot {
    /// When the snapshot was taken.
    pub time: Time,
    /// Every component that was ever accused.
    pub verdicts: Vec<Remembered>,
    /// Signals that give no usable value, or have only just come back.
    pub absences: Vec<Missing>,
    /// The trends of pairs over many comparisons.
    pub trends: Vec<Trending>,
    /// The orders in force.
    pub orders: Vec<Order>,
    /// How each need is served.
    pub needs: Vec<Served>,
    /// What was learned.
    pub learned: Vec<Recollection>,
    /// The names of the signals with which a comparison has agreed since the first start.
    pub confirmed: Vec<String>,
}

/// The record of a signal or a relation.
#[derive(Clone, Debug, PartialEq)]
pub struct Remembered {
    /// The component.
    pub subject: Subject,
    /// The verdict, and the facts that decide how the verdict ends.
    pub record: Record,
    /// The accusation as it was reported, while the component is accused.
    pub accusation: Option<Accusation>,
    /// The comparisons that have disagreed with the component while it is accused: their agreement clears it.
    pub conflicts: Vec<Compared>,
}

/// A comparison of two ways of knowing a variable, by names.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Compared {
    /// The variable.
    pub variable: String,
    /// The compared way, in words.
    pub way: String,
    /// The other way, in words.
    pub other: String,
}

/// A signal without a usable value, or with one only since shortly before.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Missing {
    /// The signal's name.
    pub signal: String,
    /// What is wrong; `None` when the signal gives values again and is not trusted yet.
    pub absence: Option<Absence>,
}

/// What many comparisons of two ways of knowing a variable have shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Trending {
    /// The comparison.
    pub compared: Compared,
    /// The sums of the trend.
    pub record: TrendRecord,
    /// The sum over time of the differences that disagreed, and of their tolerances: SI times seconds.
    pub moved: [f64; 2],
}

/// How a need is served.
#[derive(Clone, Debug, PartialEq)]
pub struct Served {
    /// The name under which the need is published.
    pub need: String,
    /// The source in words, as events report it; `None` while nothing serves the need.
    pub source: Option<String>,
    /// When the last switch happened.
    pub switched: Option<Time>,
    /// Whether an event has reported that nothing serves the need.
    pub unserved: bool,
    /// The last published number; `None` for a vector.
    pub last: Option<Published>,
}

/// A number that was published.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Published {
    /// When the number was published.
    pub time: Time,
    /// When the number was true.
    pub validity: Validity,
    /// The number, SI.
    pub value: Interval,
}

/// A learned variable before a restart.
#[derive(Clone, Debug, PartialEq)]
pub struct Recollection {
    /// The variable's name.
    pub variable: String,
    /// What was learned.
    pub memory: Memory,
}
