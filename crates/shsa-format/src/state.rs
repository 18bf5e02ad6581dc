//! The state of a run that survives a restart of the process, as JSON.
//!
//! `{"state": "shsa-state-2", "time_ns": 5, "verdicts": [..], "absences": [..], "trends": [..], "orders": [..], "needs": [..]}`;
//! everything by name, times in nanoseconds, values in SI; reasons by their codes. An unknown key or version is an error.

mod because;
mod learned;
mod verdict;

use crate::journal::Number;
use crate::order::{OrderError, OrderForm};
use learned::LearnedForm;
use serde::{Deserialize, Serialize};
use shsa_core::engine::{Compared, Missing, Published, Served, Snapshot, Trending};
use shsa_core::interval::Interval;
use shsa_core::monitor::{Absence, Tendency, TrendRecord};
use shsa_core::time::{Time, Validity};
use verdict::VerdictForm;

/// The value of the field `state`.
const FORMAT: &str = "shsa-state-2";

/// The value of that field in the version that wrote reasons in words.
const WITH_WORDS: &str = "shsa-state-1";

/// Why a state cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum StateError {
    /// The text is no JSON of a state; the message says where.
    #[error("{0}")]
    Json(#[from] serde_json::Error),
    /// The state has another version, or the text is no state.
    #[error("this says it is `{0}`, and only `{FORMAT}` and `{WITH_WORDS}` can be read here")]
    Version(String),
    /// A field has an invalid value.
    #[error("{what} cannot be `{value}`: known are {known}")]
    Value {
        /// The key.
        what: &'static str,
        /// The value.
        value: String,
        /// The valid values.
        known: String,
    },
    /// An accusation has no subject, or two.
    #[error("an accusation is about one `signal` or one `relation`; here it is about {0}")]
    Subject(&'static str),
    /// An invalid reason.
    #[error("`because`: reason `{code}`: {why}")]
    Reason {
        /// The code.
        code: String,
        /// The problem.
        why: String,
    },
    /// An invalid order.
    #[error("{0}")]
    Order(#[from] OrderError),
}

/// Writes a state; ends with a line break.
#[must_use]
pub fn write_state(snapshot: &Snapshot) -> String {
    let mut text = serde_json::to_string_pretty(&StateForm::from(snapshot)).unwrap_or_default();
    text.push('\n');
    text
}

/// Reads a state.
///
/// # Errors
/// When the text is no state of a known version; the message gives the problem and its place.
pub fn read_state(text: &str) -> Result<Snapshot, StateError> {
    #[derive(Deserialize)]
    struct Head {
        state: String,
    }
    let head: Head = serde_json::from_str(text)?;
    if head.state != FORMAT && head.state != WITH_WORDS {
        return Err(StateError::Version(head.state));
    }
    serde_json::from_str::<StateForm>(text)?.snapshot()
}

/// The written form of a state.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StateForm {
    state: String,
    time_ns: i64,
    verdicts: Vec<VerdictForm>,
    absences: Vec<AbsenceForm>,
    trends: Vec<TrendForm>,
    orders: Vec<OrderForm>,
    needs: Vec<NeedForm>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    learned: Vec<LearnedForm>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    confirmed: Vec<String>,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Bounds {
    lo: Number,
    hi: Number,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct AbsenceForm {
    signal: String,
    /// `silent`, `invalid`, `out of range`, or `returning`.
    absence: String,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TrendForm {
    variable: String,
    way: String,
    other: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    usual: Option<f64>,
    sums: [f64; 2],
    means: [f64; 6],
    weight: f64,
    tendency: String,
    #[serde(default, skip_serializing_if = "is_zero")]
    moved: [f64; 2],
}

fn is_zero(moved: &[f64; 2]) -> bool {
    *moved == [0.0; 2]
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct NeedForm {
    need: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    source: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    switched_ns: Option<i64>,
    unserved: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    last: Option<PublishedForm>,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PublishedForm {
    time_ns: i64,
    from_ns: i64,
    to_ns: i64,
    lo: Number,
    hi: Number,
}

/// The absences of a signal by name; `returning` means that the signal sends again.
const ABSENCES: [(&str, Option<Absence>); 4] = [
    ("silent", Some(Absence::Silent)),
    ("invalid", Some(Absence::Invalid)),
    ("out of range", Some(Absence::OutOfRange)),
    ("returning", None),
];

/// What comes together over many comparisons.
const TENDENCIES: [(&str, Tendency); 5] = [
    ("calm", Tendency::Calm),
    ("building", Tendency::Building),
    ("drift", Tendency::Drift),
    ("noise", Tendency::Noise),
    ("skew", Tendency::Skew),
];

fn named<T: Copy>(what: &'static str, value: &str, known: &[(&str, T)]) -> Result<T, StateError> {
    let found = known.iter().find(|(name, _)| *name == value).map(|(_, found)| *found);
    found.ok_or_else(|| {
        let known = known.iter().map(|(name, _)| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        StateError::Value { what, value: value.to_owned(), known }
    })
}

fn name_of<T: PartialEq>(value: &T, known: &[(&'static str, T)]) -> String {
    known.iter().find(|(_, it)| it == value).map_or("", |(name, _)| *name).to_owned()
}

fn bounds(value: Interval) -> Bounds {
    Bounds { lo: value.lo().into(), hi: value.hi().into() }
}

/// The interval; empty when a bound is no number, or the lower bound is above the upper one.
fn interval(lo: Number, hi: Number) -> Interval {
    Interval::new(lo.into(), hi.into())
}

impl From<&Snapshot> for StateForm {
    fn from(snapshot: &Snapshot) -> StateForm {
        StateForm {
            state: FORMAT.to_owned(),
            time_ns: snapshot.time.0,
            verdicts: snapshot.verdicts.iter().map(VerdictForm::from).collect(),
            absences: snapshot.absences.iter().map(AbsenceForm::from).collect(),
            trends: snapshot.trends.iter().map(TrendForm::from).collect(),
            orders: snapshot.orders.iter().map(OrderForm::from).collect(),
            needs: snapshot.needs.iter().map(NeedForm::from).collect(),
            learned: snapshot.learned.iter().map(LearnedForm::from).collect(),
            confirmed: snapshot.confirmed.clone(),
        }
    }
}

impl StateForm {
    pub(crate) fn snapshot(self) -> Result<Snapshot, StateError> {
        Ok(Snapshot {
            time: Time(self.time_ns),
            verdicts: self.verdicts.into_iter().map(VerdictForm::remembered).collect::<Result<_, _>>()?,
            absences: self.absences.into_iter().map(AbsenceForm::missing).collect::<Result<_, _>>()?,
            trends: self.trends.into_iter().map(TrendForm::trending).collect::<Result<_, _>>()?,
            orders: self.orders.iter().map(OrderForm::order).collect::<Result<_, _>>()?,
            needs: self.needs.into_iter().map(NeedForm::served).collect(),
            learned: self.learned.into_iter().map(LearnedForm::recollection).collect(),
            confirmed: self.confirmed,
        })
    }
}

impl From<&Missing> for AbsenceForm {
    fn from(missing: &Missing) -> AbsenceForm {
        AbsenceForm { signal: missing.signal.clone(), absence: name_of(&missing.absence, &ABSENCES) }
    }
}

impl AbsenceForm {
    fn missing(self) -> Result<Missing, StateError> {
        Ok(Missing { absence: named("`absence`", &self.absence, &ABSENCES)?, signal: self.signal })
    }
}

impl From<&Trending> for TrendForm {
    fn from(trending: &Trending) -> TrendForm {
        let Trending { compared: Compared { variable, way, other }, record, moved } = trending.clone();
        let TrendRecord { usual, sums, means, weight, tendency } = record;
        TrendForm {
            variable,
            way,
            other,
            usual,
            sums,
            means,
            weight,
            tendency: name_of(&tendency, &TENDENCIES),
            moved,
        }
    }
}

impl TrendForm {
    fn trending(self) -> Result<Trending, StateError> {
        let TrendForm { variable, way, other, usual, sums, means, weight, tendency, moved } = self;
        let tendency = named("`tendency`", &tendency, &TENDENCIES)?;
        let record = TrendRecord { usual, sums, means, weight, tendency };
        Ok(Trending { compared: Compared { variable, way, other }, record, moved })
    }
}

impl From<&Served> for NeedForm {
    fn from(served: &Served) -> NeedForm {
        let published = |published: Published| {
            let Published { time, validity, value } = published;
            let Bounds { lo, hi } = bounds(value);
            PublishedForm { time_ns: time.0, from_ns: validity.from.0, to_ns: validity.to.0, lo, hi }
        };
        NeedForm {
            need: served.need.clone(),
            source: served.source.clone(),
            switched_ns: served.switched.map(|time| time.0),
            unserved: served.unserved,
            last: served.last.map(published),
        }
    }
}

impl NeedForm {
    fn served(self) -> Served {
        let published = |last: PublishedForm| Published {
            time: Time(last.time_ns),
            validity: Validity { from: Time(last.from_ns), to: Time(last.to_ns.max(last.from_ns)) },
            value: interval(last.lo, last.hi),
        };
        Served {
            need: self.need,
            source: self.source,
            switched: self.switched_ns.map(Time),
            unserved: self.unserved,
            last: self.last.map(published),
        }
    }
}
