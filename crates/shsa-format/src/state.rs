//! The state of a run that survives a restart of the process, as JSON.
//!
//! `{"state": "shsa-state-2", "time_ns": 5, "verdicts": [..], "absences": [..], "trends": [..], "orders": [..], "needs": [..]}`;
//! everything by name, times in nanoseconds, values in SI; reasons by their codes. An unknown key or version is an error.

mod because;

use crate::journal::Number;
use crate::order::{OrderError, OrderForm};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use shsa_core::diagnosis::{Record, Verdict};
use shsa_core::engine::{
    Accusation, Compared, Missing, Published, Remembered, Served, Snapshot, Subject, Trending,
};
use shsa_core::interval::Interval;
use shsa_core::monitor::{Absence, Symptom, Tendency, TrendRecord};
use shsa_core::time::{Time, Validity};

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
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct VerdictForm {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    signal: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    relation: Option<String>,
    /// `suspect` or `failed`; `None` when the signal is trusted again.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    verdict: Option<String>,
    /// Whether the signal was the only accused one.
    alone: bool,
    /// Whether its own readings have shown the fault.
    convicted: bool,
    /// Whether only comparisons can clear it, and whether it may serve where nothing else is left. Not in earlier versions.
    #[serde(default)]
    contradicted: bool,
    #[serde(default)]
    unproven: bool,
    relapses: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    cleared_ns: Option<i64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    said: Option<Bounds>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    charge: Option<AccusationForm>,
    /// The comparisons that have disagreed with it. Not in earlier versions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    grounds: Vec<GroundForm>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct GroundForm {
    variable: String,
    way: String,
    other: String,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct AccusationForm {
    since_ns: i64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    symptom: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    cause: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    probability: Option<f64>,
    because: Value,
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

/// The verdicts that accuse.
const ACCUSING: [(&str, Verdict); 2] = [("suspect", Verdict::Suspect), ("failed", Verdict::Failed)];

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
        })
    }
}

impl From<&Remembered> for VerdictForm {
    fn from(remembered: &Remembered) -> VerdictForm {
        let Remembered { subject, record, accusation, grounds } = remembered;
        let (signal, relation) = match subject {
            Subject::Signal(name) => (Some(name.clone()), None),
            Subject::Relation(name) => (None, Some(name.clone())),
            Subject::Cause(_) => (None, None),
        };
        VerdictForm {
            signal,
            relation,
            verdict: record.verdict.map(|verdict| name_of(&verdict, &ACCUSING)),
            alone: record.alone,
            convicted: record.failed_by_detector,
            contradicted: record.contradicted,
            unproven: record.unproven,
            relapses: record.relapses,
            cleared_ns: record.cleared.map(|time| time.0),
            said: record.said.map(bounds),
            charge: accusation.as_ref().map(AccusationForm::from),
            grounds: grounds.iter().cloned().map(GroundForm::from).collect(),
        }
    }
}

impl VerdictForm {
    fn remembered(self) -> Result<Remembered, StateError> {
        let subject = match (self.signal, self.relation) {
            (Some(name), None) => Subject::Signal(name),
            (None, Some(name)) => Subject::Relation(name),
            (None, None) => return Err(StateError::Subject("neither")),
            (Some(_), Some(_)) => return Err(StateError::Subject("both")),
        };
        let verdict = self.verdict.map(|verdict| named("`verdict`", &verdict, &ACCUSING)).transpose()?;
        let record = Record {
            verdict,
            alone: self.alone,
            failed_by_detector: self.convicted,
            contradicted: self.contradicted,
            unproven: self.unproven,
            cleared: self.cleared_ns.map(Time),
            relapses: self.relapses,
            said: self.said.map(|said| interval(said.lo, said.hi)),
        };
        let accusation = self.charge.map(AccusationForm::accusation).transpose()?;
        let grounds = self.grounds.into_iter().map(GroundForm::compared).collect();
        Ok(Remembered { subject, record, accusation, grounds })
    }
}

impl From<Compared> for GroundForm {
    fn from(Compared { variable, way, other }: Compared) -> GroundForm {
        GroundForm { variable, way, other }
    }
}

impl GroundForm {
    fn compared(self) -> Compared {
        let GroundForm { variable, way, other } = self;
        Compared { variable, way, other }
    }
}

impl From<&Accusation> for AccusationForm {
    fn from(charge: &Accusation) -> AccusationForm {
        AccusationForm {
            since_ns: charge.since.0,
            symptom: charge.symptom.map(|symptom| symptom.name().to_owned()),
            cause: charge.cause.clone(),
            probability: charge.probability,
            because: because::written(&charge.because),
        }
    }
}

impl AccusationForm {
    fn accusation(self) -> Result<Accusation, StateError> {
        let known = Symptom::ALL.map(|symptom| (symptom.name(), symptom));
        Ok(Accusation {
            since: Time(self.since_ns),
            symptom: self.symptom.map(|symptom| named("`symptom`", &symptom, &known)).transpose()?,
            cause: self.cause,
            probability: self.probability,
            because: because::read(self.because)?,
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
        let Trending { compared: Compared { variable, way, other }, record } = trending.clone();
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
        }
    }
}

impl TrendForm {
    fn trending(self) -> Result<Trending, StateError> {
        let TrendForm { variable, way, other, usual, sums, means, weight, tendency } = self;
        let tendency = named("`tendency`", &tendency, &TENDENCIES)?;
        let record = TrendRecord { usual, sums, means, weight, tendency };
        Ok(Trending { compared: Compared { variable, way, other }, record })
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
