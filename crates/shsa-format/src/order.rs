//! Orders of operators in files and messages: `{"order": "forbid", "signal": "/a"}`.
//!
//! | `order` | with |
//! |---|---|
//! | `forbid`, `allow` | `signal` or `relation` |
//! | `force` | `need` and `source` |
//! | `release` | `need` |
//! | `clear` | `signal`, `relation` or `cause` |
//! | `override` | `need`, `lasts` (`10 min`) and `because` |
//! | `attest`, `deny` | `evidence` (`contract/evidence`) |

use serde::{Deserialize, Serialize};
use shsa_core::engine::{Order, Subject};
use shsa_core::time::Span;
use shsa_message::span::parse_span;

/// The names of all orders.
pub const ORDERS: [&str; 8] = ["forbid", "allow", "force", "release", "clear", "override", "attest", "deny"];

/// The written form of an order: its name and its fields. Not every form is a valid order: see [`OrderForm::order`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OrderForm {
    /// One of [`ORDERS`].
    pub order: String,
    /// The name of a signal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<String>,
    /// The name of a relation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relation: Option<String>,
    /// The name of a common cause.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cause: Option<String>,
    /// The name under which a need is published, or its variable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub need: Option<String>,
    /// A signal of the variable of the need, or a way as named in events.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// The duration, written as in models.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lasts: Option<String>,
    /// The reason.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub because: Option<String>,
    /// The contract and the evidence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub evidence: Option<String>,
}

/// Why a form is no order.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OrderError {
    /// No order has this name.
    #[error("there is no order `{name}`: known are {}", ORDERS.join(", "))]
    Unknown {
        /// The name as given.
        name: String,
    },
    /// The duration cannot be read.
    #[error("`lasts`: {0}")]
    Lasts(String),
    /// A field is missing, or there are too many.
    #[error("`{order}` takes {takes}; here is {found}")]
    Fields {
        /// The order.
        order: String,
        /// The fields that it takes.
        takes: &'static str,
        /// The given fields.
        found: String,
    },
}

impl From<&Order> for OrderForm {
    fn from(order: &Order) -> OrderForm {
        let about = |order: &str, subject: &Subject| {
            let mut form = OrderForm { order: order.to_owned(), ..OrderForm::default() };
            let (field, name) = match subject {
                Subject::Signal(name) => (&mut form.signal, name),
                Subject::Relation(name) => (&mut form.relation, name),
                Subject::Cause(name) => (&mut form.cause, name),
            };
            *field = Some(name.clone());
            form
        };
        match order {
            Order::Forbid(subject) => about("forbid", subject),
            Order::Allow(subject) => about("allow", subject),
            Order::Clear(subject) => about("clear", subject),
            Order::Force { need, source } => OrderForm {
                order: "force".to_owned(),
                need: Some(need.clone()),
                source: Some(source.clone()),
                ..OrderForm::default()
            },
            Order::Release(need) => {
                OrderForm { order: "release".to_owned(), need: Some(need.clone()), ..OrderForm::default() }
            }
            Order::Override { need, lasts, because } => OrderForm {
                order: "override".to_owned(),
                need: Some(need.clone()),
                lasts: Some(written(*lasts)),
                because: Some(because.clone()),
                ..OrderForm::default()
            },
            Order::Attest { evidence, holds } => OrderForm {
                order: if *holds { "attest" } else { "deny" }.to_owned(),
                evidence: Some(evidence.clone()),
                ..OrderForm::default()
            },
        }
    }
}

impl OrderForm {
    /// The order of this form.
    ///
    /// # Errors
    /// When the name is unknown, or the fields do not fit it.
    pub fn order(&self) -> Result<Order, OrderError> {
        let OrderForm { order, signal, relation, cause, need, source, .. } = self;
        match order.as_str() {
            "override" | "attest" | "deny" => return self.about_contracts(),
            name if self.lasts.is_some() || self.because.is_some() || self.evidence.is_some() => {
                return Err(self.wrong(name));
            }
            _ => {}
        }
        let subject = match (signal, relation, cause) {
            (Some(name), None, None) => Some(Subject::Signal(name.clone())),
            (None, Some(name), None) => Some(Subject::Relation(name.clone())),
            (None, None, Some(name)) => Some(Subject::Cause(name.clone())),
            _ => None,
        };
        let is_plain = signal.is_none() && relation.is_none() && cause.is_none();
        match (order.as_str(), subject, need, source) {
            ("forbid", Some(subject), None, None) => Ok(Order::Forbid(subject)),
            ("allow", Some(subject), None, None) => Ok(Order::Allow(subject)),
            ("clear", Some(subject), None, None) => Ok(Order::Clear(subject)),
            ("force", None, Some(need), Some(source)) if is_plain => {
                Ok(Order::Force { need: need.clone(), source: source.clone() })
            }
            ("release", None, Some(need), None) if is_plain => Ok(Order::Release(need.clone())),
            (name, ..) => Err(self.wrong(name)),
        }
    }

    fn about_contracts(&self) -> Result<Order, OrderError> {
        let OrderForm { order, need, lasts, because, evidence, .. } = self;
        let is_plain =
            [&self.signal, &self.relation, &self.cause, &self.source].iter().all(|field| field.is_none());
        match (order.as_str(), need, lasts, because, evidence) {
            ("override", Some(need), Some(lasts), Some(because), None) if is_plain => {
                let lasts = parse_span(lasts).map_err(OrderError::Lasts)?;
                Ok(Order::Override { need: need.clone(), lasts, because: because.clone() })
            }
            ("attest" | "deny", None, None, None, Some(evidence)) if is_plain => {
                Ok(Order::Attest { evidence: evidence.clone(), holds: order == "attest" })
            }
            (name, ..) => Err(self.wrong(name)),
        }
    }

    fn wrong(&self, name: &str) -> OrderError {
        let takes = match name {
            "forbid" | "allow" => "a `signal` or a `relation`",
            "clear" => "a `signal`, a `relation` or a `cause`",
            "force" => "a `need` and a `source`",
            "release" => "a `need`",
            "override" => "a `need`, `lasts` and `because`",
            "attest" | "deny" => "an `evidence`",
            _ => return OrderError::Unknown { name: name.to_owned() },
        };
        let fields = [
            ("signal", &self.signal),
            ("relation", &self.relation),
            ("cause", &self.cause),
            ("need", &self.need),
            ("source", &self.source),
            ("lasts", &self.lasts),
            ("because", &self.because),
            ("evidence", &self.evidence),
        ];
        let named = fields.iter().filter(|(_, value)| value.is_some()).map(|(name, _)| format!("`{name}`"));
        let named: Vec<String> = named.collect();
        let found = if named.is_empty() { "nothing".to_owned() } else { named.join(" and ") };
        OrderError::Fields { order: name.to_owned(), takes, found }
    }
}

/// A duration in the largest unit that gives a whole number.
fn written(Span(length): Span) -> String {
    match (length % 1_000_000_000, length % 1_000_000) {
        (0, _) => format!("{} s", length / 1_000_000_000),
        (_, 0) => format!("{} ms", length / 1_000_000),
        _ => format!("{length} ns"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, expected: &str) {
        let form: Result<OrderForm, _> = serde_json::from_str(text);
        let found = match form {
            Ok(form) => match form.order() {
                Ok(order) => {
                    assert_eq!(OrderForm::from(&order), form);
                    order.to_string()
                }
                Err(error) => error.to_string(),
            },
            Err(error) => error.to_string(),
        };
        assert_eq!(found, expected);
    }

    #[test]
    fn orders_are_read_and_written() {
        check(r#"{"order": "forbid", "signal": "/a"}"#, "forbid /a");
        check(r#"{"order": "allow", "relation": "r"}"#, "allow relation r");
        check(r#"{"order": "clear", "cause": "imu"}"#, "clear imu");
        check(r#"{"order": "force", "need": "/n", "source": "/a, /b by r"}"#, "serve /n from /a, /b by r");
        check(r#"{"order": "release", "need": "/n"}"#, "release /n");
        check(
            r#"{"order": "override", "need": "/n", "lasts": "90 s", "because": "towed"}"#,
            "override the contract of /n for 90 s: towed",
        );
        check(r#"{"order": "attest", "evidence": "lidar/installed"}"#, "attest lidar/installed");
        check(r#"{"order": "deny", "evidence": "lidar/installed"}"#, "deny lidar/installed");
    }

    #[test]
    fn what_is_no_order_says_why() {
        check(
            r#"{"order": "frobid", "signal": "/a"}"#,
            "there is no order `frobid`: known are forbid, allow, force, release, clear, override, attest, deny",
        );
        check(r#"{"order": "forbid"}"#, "`forbid` takes a `signal` or a `relation`; here is nothing");
        check(
            r#"{"order": "force", "need": "/n", "signal": "/a"}"#,
            "`force` takes a `need` and a `source`; here is `signal` and `need`",
        );
        check(
            r#"{"order": "override", "need": "/n", "because": "towed"}"#,
            "`override` takes a `need`, `lasts` and `because`; here is `need` and `because`",
        );
        check(
            r#"{"order": "override", "need": "/n", "lasts": "long", "because": "towed"}"#,
            "`lasts`: 'long' has no unit of time; write it like 5s, 20 ms, us",
        );
        check(r#"{"order": "attest", "need": "/n"}"#, "`attest` takes an `evidence`; here is `need`");
        check(
            r#"{"order": "clear", "signal": "/a", "relation": "r"}"#,
            "`clear` takes a `signal`, a `relation` or a `cause`; here is `signal` and `relation`",
        );
        check(
            r#"{"order": "release", "topic": "/n"}"#,
            "unknown field `topic`, expected one of `order`, `signal`, `relation`, `cause`, `need`, `source`, `lasts`, `because`, `evidence` at line 1 column 28",
        );
    }
}
