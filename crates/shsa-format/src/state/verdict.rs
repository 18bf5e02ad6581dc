//! The written form of the verdicts, with the accusations and the comparisons behind them.

use super::because;
use super::{Bounds, StateError, bounds, interval, name_of, named};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use shsa_core::engine::{Compared, Remembered, Subject};
use shsa_core::monitor::Symptom;
use shsa_core::time::Time;
use shsa_core::trust::{Accusation, Record, Verdict};

/// The verdicts that accuse.
const ACCUSING: [(&str, Verdict); 2] = [("suspect", Verdict::Suspect), ("failed", Verdict::Failed)];

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct VerdictForm {
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
    #[serde(rename = "convicted")]
    failed_by_detector: bool,
    /// Whether only comparisons can clear it, and whether it may serve where nothing else is left. Not in earlier versions.
    #[serde(default)]
    contradicted: bool,
    #[serde(default)]
    unproven: bool,
    relapses: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    cleared_ns: Option<i64>,
    #[serde(default, rename = "said", skip_serializing_if = "Option::is_none")]
    latest_value: Option<Bounds>,
    #[serde(default, rename = "charge", skip_serializing_if = "Option::is_none")]
    accusation: Option<AccusationForm>,
    /// The comparisons that have disagreed with it. Not in earlier versions.
    #[serde(default, alias = "grounds", skip_serializing_if = "Vec::is_empty")]
    conflicts: Vec<ConflictForm>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ConflictForm {
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

impl From<&Remembered> for VerdictForm {
    fn from(remembered: &Remembered) -> VerdictForm {
        let Remembered { subject, record, accusation, conflicts } = remembered;
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
            failed_by_detector: record.failed_by_detector,
            contradicted: record.contradicted,
            unproven: record.unproven,
            relapses: record.relapses,
            cleared_ns: record.cleared.map(|time| time.0),
            latest_value: record.latest_value.map(bounds),
            accusation: accusation.as_ref().map(AccusationForm::from),
            conflicts: conflicts.iter().cloned().map(ConflictForm::from).collect(),
        }
    }
}

impl VerdictForm {
    pub(super) fn remembered(self) -> Result<Remembered, StateError> {
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
            failed_by_detector: self.failed_by_detector,
            contradicted: self.contradicted,
            unproven: self.unproven,
            cleared: self.cleared_ns.map(Time),
            relapses: self.relapses,
            latest_value: self.latest_value.map(|latest_value| interval(latest_value.lo, latest_value.hi)),
        };
        let accusation = self.accusation.map(AccusationForm::accusation).transpose()?;
        let conflicts = self.conflicts.into_iter().map(ConflictForm::compared).collect();
        Ok(Remembered { subject, record, accusation, conflicts })
    }
}

impl From<Compared> for ConflictForm {
    fn from(Compared { variable, way, other }: Compared) -> ConflictForm {
        ConflictForm { variable, way, other }
    }
}

impl ConflictForm {
    fn compared(self) -> Compared {
        let ConflictForm { variable, way, other } = self;
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
