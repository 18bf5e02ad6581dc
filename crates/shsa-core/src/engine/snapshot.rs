//! What must outlast the process: names, so that a changed knowledge base can go on with what is still the same.

use crate::diagnosis::Record;
use crate::interval::Interval;
use crate::monitor::{Absence, Symptom, TrendRecord};
use crate::order::{Order, Subject};
use crate::reason::Reasons;
use crate::time::{Time, Validity};
use alloc::string::String;
use alloc::vec::Vec;

/// What an engine knows that evidence alone would not bring back: [`Engine::snapshot`](super::Engine::snapshot) takes it,
/// [`Engine::restore`](super::Engine::restore) goes on from it. The recent comparisons are not part of it: they come again.
/// What takes minutes to come together is: a drift would begin anew, and its culprit would pass for sound meanwhile.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Snapshot {
    /// When it was taken.
    pub time: Time,
    /// Everything that was ever accused.
    pub verdicts: Vec<Remembered>,
    /// Signals that give no usable value, or have only just come back.
    pub absences: Vec<Missing>,
    /// What has come together over many comparisons.
    pub trends: Vec<Trending>,
    /// The orders in force.
    pub orders: Vec<Order>,
    /// How each need is served.
    pub needs: Vec<Served>,
}

/// What was thought of a signal or a relation.
#[derive(Clone, Debug, PartialEq)]
pub struct Remembered {
    /// What it is about.
    pub subject: Subject,
    /// The verdict with what decides how it ends.
    pub record: Record,
    /// The accusation as it was told, while it stands.
    pub accusation: Option<Accusation>,
}

/// An accusation that stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Accusation {
    /// When it was told.
    pub since: Time,
    /// How the signal misbehaves, as far as it shows.
    pub symptom: Option<Symptom>,
    /// What the signal shares with others that is blamed, by name.
    pub cause: Option<String>,
    /// How probable it is, where that could be computed.
    pub probability: Option<f64>,
    /// The evidence.
    pub because: Reasons,
}

/// A signal that gives no usable value, or did not until shortly before.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Missing {
    /// Its name.
    pub signal: String,
    /// What is wrong; `None` when it speaks again and is not trusted yet.
    pub absence: Option<Absence>,
}

/// What many comparisons of two ways of knowing a variable have shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Trending {
    /// The variable.
    pub variable: String,
    /// The way that was compared, in words.
    pub way: String,
    /// The way that it was compared with.
    pub other: String,
    /// The numbers.
    pub record: TrendRecord,
}

/// How a need is served.
#[derive(Clone, Debug, PartialEq)]
pub struct Served {
    /// The name under which it is published.
    pub need: String,
    /// The source in words, as events tell it; `None` while nothing serves it.
    pub source: Option<String>,
    /// When the last switch was.
    pub switched: Option<Time>,
    /// Whether it has been told that nothing serves it.
    pub unserved: bool,
    /// The last published number; `None` for a vector.
    pub last: Option<Published>,
}

/// A number that was published.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Published {
    /// When.
    pub time: Time,
    /// When it was true.
    pub validity: Validity,
    /// What it was, SI.
    pub value: Interval,
}
