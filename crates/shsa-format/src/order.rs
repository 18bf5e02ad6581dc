//! Operators' orders in files and messages: `{"order": "forbid", "signal": "/a"}`.
//!
//! | `order` | with |
//! |---|---|
//! | `forbid`, `allow` | `signal` or `relation` |
//! | `force` | `need` and `source` |
//! | `release` | `need` |
//! | `clear` | `signal`, `relation` or `cause` |

use serde::{Deserialize, Serialize};
use shsa_core::engine::{Order, Subject};

/// The names of all orders.
pub const ORDERS: [&str; 5] = ["forbid", "allow", "force", "release", "clear"];

/// An order as it is written: a name, and what it is about. Not every form is an order: see [`OrderForm::order`].
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
    /// What signals share, by name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cause: Option<String>,
    /// The name under which a need is published, or its variable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub need: Option<String>,
    /// A signal of the need's variable, or a way as events tell it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
}

/// Why a form is no order.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OrderError {
    /// No order has this name.
    #[error("there is no order `{name}`: known are {}", ORDERS.join(", "))]
    Unknown {
        /// What it is called.
        name: String,
    },
    /// Something is missing, or too much.
    #[error("`{order}` takes {takes}; here is {found}")]
    Fields {
        /// The order.
        order: String,
        /// What it takes.
        takes: &'static str,
        /// What was there.
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
        }
    }
}

impl OrderForm {
    /// The order that is written here.
    ///
    /// # Errors
    /// When there is none of this name, or it takes something else.
    pub fn order(&self) -> Result<Order, OrderError> {
        let OrderForm { order, signal, relation, cause, need, source } = self;
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

    fn wrong(&self, name: &str) -> OrderError {
        let takes = match name {
            "forbid" | "allow" => "a `signal` or a `relation`",
            "clear" => "a `signal`, a `relation` or a `cause`",
            "force" => "a `need` and a `source`",
            "release" => "a `need`",
            _ => return OrderError::Unknown { name: name.to_owned() },
        };
        let fields = [
            ("signal", &self.signal),
            ("relation", &self.relation),
            ("cause", &self.cause),
            ("need", &self.need),
            ("source", &self.source),
        ];
        let named = fields.iter().filter(|(_, value)| value.is_some()).map(|(name, _)| format!("`{name}`"));
        let named: Vec<String> = named.collect();
        let found = if named.is_empty() { "nothing".to_owned() } else { named.join(" and ") };
        OrderError::Fields { order: name.to_owned(), takes, found }
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
    }

    #[test]
    fn what_is_no_order_says_why() {
        check(
            r#"{"order": "frobid", "signal": "/a"}"#,
            "there is no order `frobid`: known are forbid, allow, force, release, clear",
        );
        check(r#"{"order": "forbid"}"#, "`forbid` takes a `signal` or a `relation`; here is nothing");
        check(
            r#"{"order": "force", "need": "/n", "signal": "/a"}"#,
            "`force` takes a `need` and a `source`; here is `signal` and `need`",
        );
        check(
            r#"{"order": "clear", "signal": "/a", "relation": "r"}"#,
            "`clear` takes a `signal`, a `relation` or a `cause`; here is `signal` and `relation`",
        );
        check(
            r#"{"order": "release", "topic": "/n"}"#,
            "unknown field `topic`, expected one of `order`, `signal`, `relation`, `cause`, `need`, `source` at line 1 column 28",
        );
    }
}
