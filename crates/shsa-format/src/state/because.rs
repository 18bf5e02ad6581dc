//! The reasons of an accusation: codes with arguments. Earlier versions wrote words; these are read as they are.
//!
//! `[{"code": "disagree", "arguments": {"one": "/a", ..}}, {"code": "probability", "joint": "namely", ..}]`, spans in
//! nanoseconds.

use super::StateError;
use crate::journal::Number;
use crate::order::OrderForm;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use shsa_core::engine::{Order, Subject};
use shsa_core::reason::{
    Amount, Argument, Candidate, Clause, Joint, Kind, Probability, Proof, Range, Reason, Reasons, ServedBy,
};
use shsa_core::time::Span;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ClauseForm {
    code: String,
    /// How it follows the one before; `next` where the field is missing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    joint: Option<String>,
    #[serde(default, skip_serializing_if = "Map::is_empty")]
    arguments: Map<String, Value>,
}

/// The reasons as JSON.
pub(super) fn written(because: &Reasons) -> Value {
    because.clauses().iter().map(|clause| json!(ClauseForm::from(clause))).collect()
}

/// Reads reasons, or the words of an earlier version.
pub(super) fn read(because: Value) -> Result<Reasons, StateError> {
    match because {
        Value::String(words) => Ok(Reasons::in_words(words)),
        clauses => {
            let clauses: Vec<ClauseForm> = serde_json::from_value(clauses)?;
            clauses.into_iter().map(ClauseForm::clause).collect()
        }
    }
}

impl From<&Clause> for ClauseForm {
    fn from(Clause { joint, reason }: &Clause) -> ClauseForm {
        let arguments = reason.arguments().into_iter();
        ClauseForm {
            code: reason.code().to_owned(),
            joint: (*joint != Joint::default()).then(|| joint.name().to_owned()),
            arguments: arguments
                .map(|(name, argument)| (name.to_owned(), argument_written(argument)))
                .collect(),
        }
    }
}

impl ClauseForm {
    fn clause(self) -> Result<Clause, StateError> {
        let ClauseForm { code, joint, mut arguments } = self;
        let known = Joint::ALL.map(|joint| (joint.name(), joint));
        let joint = joint.map(|joint| super::named("`joint`", &joint, &known)).transpose()?;
        let mut failed = None;
        let reason = Reason::read(&code, |name, kind| {
            let given = arguments.remove(name).unwrap_or_default();
            argument_read(kind, given).map_err(|error| failed = Some(format!("`{name}`: {error}"))).ok()
        });
        let left = arguments.keys().next().map(|name| format!("it has no argument `{name}`"));
        match (reason, failed.or(left)) {
            (Some(reason), None) => Ok(Clause { joint: joint.unwrap_or_default(), reason }),
            (_, why) => {
                let why = why.unwrap_or_else(|| "there is no such reason".to_owned());
                Err(StateError::Reason { code, why })
            }
        }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RangeForm {
    lo: Number,
    hi: Number,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    unit: Option<String>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct AmountForm {
    value: Number,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    unit: Option<String>,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum SubjectForm {
    Signal(String),
    Relation(String),
    Cause(String),
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum ServedByForm {
    Way(String),
    Hull(Vec<String>),
    Agreeing { count: u64, ways: Vec<String> },
    LastTrusted,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CandidateForm {
    source: String,
    utility: Number,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    proof: Option<ProofForm>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ProofForm {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    agreement: Option<Number>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    error: Option<AmountForm>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    availability: Option<Number>,
}

impl From<Range> for RangeForm {
    fn from(Range { lo, hi, unit }: Range) -> RangeForm {
        RangeForm { lo: lo.into(), hi: hi.into(), unit }
    }
}

impl From<RangeForm> for Range {
    fn from(RangeForm { lo, hi, unit }: RangeForm) -> Range {
        Range { lo: lo.into(), hi: hi.into(), unit }
    }
}

impl From<Amount> for AmountForm {
    fn from(Amount { value, unit }: Amount) -> AmountForm {
        AmountForm { value: value.into(), unit }
    }
}

impl From<AmountForm> for Amount {
    fn from(AmountForm { value, unit }: AmountForm) -> Amount {
        Amount { value: value.into(), unit }
    }
}

impl From<Subject> for SubjectForm {
    fn from(subject: Subject) -> SubjectForm {
        match subject {
            Subject::Signal(name) => SubjectForm::Signal(name),
            Subject::Relation(name) => SubjectForm::Relation(name),
            Subject::Cause(name) => SubjectForm::Cause(name),
        }
    }
}

impl From<SubjectForm> for Subject {
    fn from(form: SubjectForm) -> Subject {
        match form {
            SubjectForm::Signal(name) => Subject::Signal(name),
            SubjectForm::Relation(name) => Subject::Relation(name),
            SubjectForm::Cause(name) => Subject::Cause(name),
        }
    }
}

impl From<ServedBy> for ServedByForm {
    fn from(served_by: ServedBy) -> ServedByForm {
        match served_by {
            ServedBy::Way(name) => ServedByForm::Way(name),
            ServedBy::Hull(ways) => ServedByForm::Hull(ways),
            ServedBy::Agreeing { count, ways } => ServedByForm::Agreeing { count, ways },
            ServedBy::LastTrusted => ServedByForm::LastTrusted,
        }
    }
}

impl From<ServedByForm> for ServedBy {
    fn from(form: ServedByForm) -> ServedBy {
        match form {
            ServedByForm::Way(name) => ServedBy::Way(name),
            ServedByForm::Hull(ways) => ServedBy::Hull(ways),
            ServedByForm::Agreeing { count, ways } => ServedBy::Agreeing { count, ways },
            ServedByForm::LastTrusted => ServedBy::LastTrusted,
        }
    }
}

impl From<Candidate> for CandidateForm {
    fn from(Candidate { source, utility, proof }: Candidate) -> CandidateForm {
        let proof = proof.map(|Proof { agreement, error, availability }| ProofForm {
            agreement: agreement.map(Number::from),
            error: error.map(AmountForm::from),
            availability: availability.map(Number::from),
        });
        CandidateForm { source, utility: utility.into(), proof }
    }
}

impl From<CandidateForm> for Candidate {
    fn from(CandidateForm { source, utility, proof }: CandidateForm) -> Candidate {
        let proof = proof.map(|ProofForm { agreement, error, availability }| Proof {
            agreement: agreement.map(f64::from),
            error: error.map(Amount::from),
            availability: availability.map(f64::from),
        });
        Candidate { source, utility: utility.into(), proof }
    }
}

fn all<From, Into: std::convert::From<From>>(items: Vec<From>) -> Vec<Into> {
    items.into_iter().map(Into::from).collect()
}

fn argument_written(argument: Argument) -> Value {
    match argument {
        Argument::Name(name) => json!(name),
        Argument::Names(names) => json!(names),
        Argument::Span(Span(nanoseconds)) => json!(nanoseconds),
        Argument::Count(count) => json!(count),
        Argument::Number(number) | Argument::Probability(Probability(number)) => json!(Number::from(number)),
        Argument::Range(range) => json!(RangeForm::from(range)),
        Argument::Amount(amount) => json!(AmountForm::from(amount)),
        Argument::Subject(subject) => json!(SubjectForm::from(subject)),
        Argument::Subjects(subjects) => json!(all::<Subject, SubjectForm>(subjects)),
        Argument::Order(order) => json!(OrderForm::from(&order)),
        Argument::Orders(orders) => json!(orders.iter().map(OrderForm::from).collect::<Vec<_>>()),
        Argument::ServedBy(served_by) => json!(ServedByForm::from(served_by)),
        Argument::Candidate(candidate) => json!(CandidateForm::from(candidate)),
        Argument::Candidates(candidates) => json!(all::<Candidate, CandidateForm>(candidates)),
    }
}

fn argument_read(kind: Kind, value: Value) -> Result<Argument, StateError> {
    fn form<T: DeserializeOwned>(value: Value) -> Result<T, StateError> {
        Ok(serde_json::from_value(value)?)
    }
    fn number(value: Value) -> Result<f64, StateError> {
        form::<Number>(value).map(f64::from)
    }
    Ok(match kind {
        Kind::Name => Argument::Name(form(value)?),
        Kind::Names => Argument::Names(form(value)?),
        Kind::Span => Argument::Span(Span(form(value)?)),
        Kind::Count => Argument::Count(form(value)?),
        Kind::Number => Argument::Number(number(value)?),
        Kind::Probability => Argument::Probability(Probability(number(value)?)),
        Kind::Range => Argument::Range(form::<RangeForm>(value)?.into()),
        Kind::Amount => Argument::Amount(form::<AmountForm>(value)?.into()),
        Kind::Subject => Argument::Subject(form::<SubjectForm>(value)?.into()),
        Kind::Subjects => Argument::Subjects(all(form::<Vec<SubjectForm>>(value)?)),
        Kind::Order => Argument::Order(form::<OrderForm>(value)?.order()?),
        Kind::Orders => {
            let orders: Vec<OrderForm> = form(value)?;
            let orders: Result<Vec<Order>, _> = orders.iter().map(OrderForm::order).collect();
            Argument::Orders(orders?)
        }
        Kind::ServedBy => Argument::ServedBy(form::<ServedByForm>(value)?.into()),
        Kind::Candidate => Argument::Candidate(form::<CandidateForm>(value)?.into()),
        Kind::Candidates => Argument::Candidates(all(form::<Vec<CandidateForm>>(value)?)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::words::tests::all;

    #[test]
    fn every_reason_is_read_as_it_was_written() {
        for (number, joint) in Joint::ALL.into_iter().enumerate() {
            let because: Reasons = all(number).map(|reason| Clause { joint, reason }).collect();
            let text = written(&because).to_string();
            assert_eq!(read(serde_json::from_str(&text).unwrap()).unwrap(), because, "{text}");
        }
    }

    #[test]
    fn numbers_that_json_does_not_know_are_kept() {
        let because = Reasons::from(Reason::Limits { age: Span(1), width: f64::INFINITY });
        assert_eq!(read(written(&because)).unwrap(), because);
        let range = Range { lo: f64::NEG_INFINITY, hi: f64::INFINITY, unit: None };
        let because = Reasons::from(Reason::OnlyOutOfRange { range, within: Span(-1) });
        assert_eq!(read(written(&because)).unwrap(), because);
    }

    #[test]
    fn words_are_read_as_they_are() {
        assert_eq!(read(json!("its cable is cut")).unwrap(), Reasons::in_words("its cable is cut"));
        assert!(read(json!({ "code": "told" })).is_err());
        assert!(read(Value::Null).is_err());
    }
}
