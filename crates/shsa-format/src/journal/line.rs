//! The lines of a journal in JSON, and their meaning.

use crate::order::OrderForm;
use crate::state::StateForm;
use serde::{Deserialize, Serialize};
use shsa_core::engine::{Input, PublishedValue, Report};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Id, NeedId, SignalId};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Time, Validity};

#[derive(Serialize, Deserialize)]
pub(super) struct Head {
    pub(super) journal: String,
    pub(super) signals: Vec<String>,
    /// The number of the file in a sealed journal, and the seal of the last record of the file before it.
    #[serde(default, skip_serializing)]
    pub(super) file: Option<u64>,
    #[serde(default, skip_serializing)]
    pub(super) after: Option<String>,
}

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum Line {
    Tick {
        tick_ns: i64,
    },
    Order {
        order_ns: i64,
        given: OrderForm,
    },
    Restore {
        restore_ns: i64,
        known: Box<StateForm>,
    },
    Observation {
        signal: usize,
        time_ns: i64,
        received_ns: i64,
        value: Value,
    },
    Reload {
        reload_ns: i64,
        file: String,
        text: String,
        signals: Vec<String>,
    },
    Report {
        report_ns: i64,
        need: usize,
        #[serde(flatten)]
        report_form: ReportForm,
    },
    /// Who has given the orders that the lines before carry out; only in sealed journals.
    Ordered {
        ordered_ns: i64,
        by: String,
        done: String,
    },
    /// A signature of all that comes before.
    Signature {
        signature: String,
    },
}

/// The report of a process.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum ReportForm {
    Value { answer: u64, from_ns: i64, to_ns: i64, value: Computed },
    Nothing { answer: u64 },
    Ready { ready: u64 },
    Gone { gone: bool },
}

/// A computed value.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum Computed {
    Scalar(Bounds),
    Vector(Vec<Bounds>),
}

#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct Bounds {
    lo: Number,
    hi: Number,
}

impl From<&Interval> for Bounds {
    fn from(value: &Interval) -> Bounds {
        Bounds { lo: value.lo().into(), hi: value.hi().into() }
    }
}

impl From<Bounds> for Interval {
    fn from(Bounds { lo, hi }: Bounds) -> Interval {
        Interval::new(lo.into(), hi.into())
    }
}

impl From<&Report> for ReportForm {
    fn from(report: &Report) -> ReportForm {
        match report {
            Report::Ready { era } => ReportForm::Ready { ready: *era },
            Report::Gone => ReportForm::Gone { gone: true },
            Report::Answer { number, result: None } => ReportForm::Nothing { answer: *number },
            Report::Answer { number, result: Some((value, validity)) } => ReportForm::Value {
                answer: *number,
                from_ns: validity.from.0,
                to_ns: validity.to.0,
                value: match value {
                    PublishedValue::Scalar(value) => Computed::Scalar(value.into()),
                    PublishedValue::Vector(elements) => {
                        Computed::Vector(elements.iter().map(Into::into).collect())
                    }
                },
            },
        }
    }
}

impl From<ReportForm> for Report {
    fn from(report_form: ReportForm) -> Report {
        match report_form {
            ReportForm::Ready { ready } => Report::Ready { era: ready },
            ReportForm::Gone { .. } => Report::Gone,
            ReportForm::Nothing { answer } => Report::Answer { number: answer, result: None },
            ReportForm::Value { answer, from_ns, to_ns, value } => {
                let value = match value {
                    Computed::Scalar(value) => PublishedValue::Scalar(value.into()),
                    Computed::Vector(elements) => {
                        PublishedValue::Vector(elements.into_iter().map(Into::into).collect())
                    }
                };
                let validity = Validity { from: Time(from_ns), to: Time(to_ns) };
                Report::Answer { number: answer, result: Some((value, validity)) }
            }
        }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum Value {
    Number(Number),
    Interval { lo: Number, hi: Number },
    Vector(Vec<Number>),
}

/// A number that JSON may not be able to write.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(untagged)]
pub(crate) enum Number {
    Finite(f64),
    Other(Other),
}

/// A number that JSON cannot write.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) enum Other {
    #[serde(rename = "nan")]
    Nan,
    #[serde(rename = "inf")]
    Infinite,
    #[serde(rename = "-inf")]
    MinusInfinite,
}

impl From<f64> for Number {
    fn from(value: f64) -> Number {
        match value {
            value if value.is_finite() => Number::Finite(value),
            value if value.is_nan() => Number::Other(Other::Nan),
            value if value > 0.0 => Number::Other(Other::Infinite),
            _ => Number::Other(Other::MinusInfinite),
        }
    }
}

impl From<Number> for f64 {
    fn from(number: Number) -> f64 {
        match number {
            Number::Finite(value) => value,
            Number::Other(Other::Nan) => f64::NAN,
            Number::Other(Other::Infinite) => f64::INFINITY,
            Number::Other(Other::MinusInfinite) => f64::NEG_INFINITY,
        }
    }
}

impl From<&RawValue> for Value {
    fn from(value: &RawValue) -> Value {
        match value {
            &RawValue::Number(number) => Value::Number(number.into()),
            &RawValue::Interval { lo, hi } => Value::Interval { lo: lo.into(), hi: hi.into() },
            RawValue::Vector(elements) => {
                Value::Vector(elements.iter().map(|&element| element.into()).collect())
            }
        }
    }
}

impl From<Value> for RawValue {
    fn from(value: Value) -> RawValue {
        match value {
            Value::Number(number) => RawValue::Number(number.into()),
            Value::Interval { lo, hi } => RawValue::Interval { lo: lo.into(), hi: hi.into() },
            Value::Vector(elements) => RawValue::Vector(elements.into_iter().map(f64::from).collect()),
        }
    }
}

impl Line {
    /// The input in the line; `None` for a change of the model, and for what is no input.
    ///
    /// # Errors
    /// The problem of the line.
    pub(super) fn input(self, signals: &[SignalId]) -> Result<Option<Input>, String> {
        Ok(Some(match self {
            Line::Reload { .. } | Line::Ordered { .. } | Line::Signature { .. } => return Ok(None),
            Line::Tick { tick_ns } => Input::Tick(Time(tick_ns)),
            Line::Order { order_ns, given } => {
                let order = given.order().map_err(|error| error.to_string())?;
                Input::Order { time: Time(order_ns), order }
            }
            Line::Restore { restore_ns, known } => {
                let snapshot = known.snapshot().map_err(|error| error.to_string())?;
                Input::Restore { time: Time(restore_ns), snapshot: Box::new(snapshot) }
            }
            // The engine ignores a need that the model does not have.
            Line::Report { report_ns, need, report_form } => {
                let need = NeedId::from_index(need);
                Input::Report { time: Time(report_ns), need, report: report_form.into() }
            }
            Line::Observation { signal, time_ns, received_ns, value } => {
                let known = signals.get(signal);
                let signal = *known.ok_or_else(|| format!("there is no signal number {signal}"))?;
                let (stamp, received) = (Time(time_ns), Time(received_ns));
                Input::Observation(Observation { signal, stamp, received, value: value.into() })
            }
        }))
    }
}
