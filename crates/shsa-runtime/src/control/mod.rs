//! Requests to a run, over HTTP and over the bus: to view everything, and with a token to change something.

pub(super) mod bus;
mod connections;
pub(super) mod http;
mod token;
mod web;

pub use token::Token;
pub(super) use token::{Guard, Tokens, is_open_to_all};

use crate::bands::BandsOf;
use crate::view::Look;
use serde::Deserialize;
use serde_json::{Map, Value};
use shsa_bridge::Inbox;
use shsa_core::engine;
use shsa_core::knowledge::KnowledgeBase;
use shsa_format::order::OrderForm;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use tokio::sync::oneshot;

/// The longest name of who gives an order, bytes.
const LONGEST_NAME: usize = 100;
/// The number of requests that may wait; further ones are refused.
const WAITING: usize = 64;

/// A request to the run.
#[derive(Debug)]
pub(super) enum Request {
    /// The state of needs, signals and the run.
    State,
    /// Whether every need is served.
    Health,
    /// What the live page draws, as far as it has changed.
    Look(Look),
    /// The new values of the ways of knowing a variable.
    Bands(BandsOf),
    /// The last minutes of the needs of the model of this name.
    Past(String),
    /// To hand over the knowledge base of the model of this name, where there is one.
    Model(String, oneshot::Sender<Box<KnowledgeBase>>),
    /// The evidence for the decision of this number.
    Evidence(u64),
    /// The decisions from this number on.
    Events(u64),
    /// Figures in the text format of Prometheus.
    Metrics,
    /// An order; the caller's token has been checked.
    Order {
        order: Order,
        /// Who gives the order.
        caller: String,
    },
    /// A caller has shown a wrong token; the text tells which.
    Denied(String),
}

impl Request {
    /// An order from parsed JSON, which may name in `by` who gives it: nobody checks that name, so it stands before the caller.
    ///
    /// # Errors
    /// As [`Order::read`].
    fn order(mut fields: Map<String, Value>, caller: &str) -> Result<Request, String> {
        let caller = match fields.remove("by") {
            None | Some(Value::Null) => caller.to_owned(),
            Some(Value::String(name)) if name.len() <= LONGEST_NAME => format!("{name}, {caller}"),
            Some(_) => return Err(format!("`by` is a name of at most {LONGEST_NAME} bytes")),
        };
        Ok(Request::Order { order: Order::from_fields(fields)?, caller })
    }
}

/// An order of an operator.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// Reads the files of the models again.
    Reload {
        /// Whether the new models may lack needs that are served now.
        force: bool,
    },
    /// Changes a model by a text: its entries are added, or replace those of the same name, and null removes.
    Change {
        /// The name of the model; may be left out where there is only one.
        model: Option<String>,
        /// YAML or JSON, as in a file given to `replay --reload`.
        text: String,
    },
    /// An order to the engine of a model.
    Engine {
        /// The name of the model; may be left out where there is only one.
        model: Option<String>,
        /// The order.
        order: engine::Order,
    },
}

/// The fields of [`Order::Change`].
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Change {
    text: String,
}

/// The fields of [`Order::Reload`].
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Reload {
    #[serde(default)]
    force: bool,
}

impl Order {
    /// Reads `{"order": "reload"}`, which may have `"force": true`, `{"order": "change", "text": ".."}`, or an order to the engine such as
    /// `{"order": "forbid", "signal": "/a"}`; the two last may have `"model": ".."`.
    ///
    /// # Errors
    /// Tells which field is missing or wrong.
    pub fn read(text: &str) -> Result<Order, String> {
        Order::from_fields(serde_json::from_str(text).map_err(|error| error.to_string())?)
    }

    /// As [`Order::read`], from parsed JSON.
    ///
    /// # Errors
    /// As [`Order::read`].
    fn from_fields(mut fields: Map<String, Value>) -> Result<Order, String> {
        let model = match fields.remove("model") {
            None | Some(Value::Null) => None,
            Some(Value::String(model)) => Some(model),
            Some(other) => return Err(format!("`model` is the name of a model, not {other}")),
        };
        match fields.get("order").and_then(Value::as_str) {
            Some("reload") if model.is_none() => {
                fields.remove("order");
                let Reload { force } = from_fields(fields)?;
                Ok(Order::Reload { force })
            }
            Some("reload") => Err("`reload` is for all models".into()),
            Some("change") => {
                fields.remove("order");
                let Change { text } = from_fields(fields)?;
                Ok(Order::Change { model, text })
            }
            _ => {
                let form: OrderForm = from_fields(fields)?;
                let order =
                    form.order().map_err(|error| format!("{error}; and here also: reload, change"))?;
                Ok(Order::Engine { model, order })
            }
        }
    }
}

fn from_fields<T: for<'de> Deserialize<'de>>(fields: Map<String, Value>) -> Result<T, String> {
    serde_json::from_value(Value::Object(fields)).map_err(|error| error.to_string())
}

/// The reply to a request.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Reply {
    /// The state that was asked for, or the effect of an order.
    Json(Value),
    /// A reply in plain text.
    Text(String),
    /// The reason why the request cannot be carried out; nothing has changed.
    Refused(String),
}

/// A request on its way to the run.
pub(super) struct Call {
    pub(super) request: Request,
    /// Passes the reply to the caller.
    pub(super) reply: Box<dyn FnOnce(Reply) + Send>,
}

/// Takes requests for the run, from any thread.
#[derive(Clone)]
pub(super) struct Desk {
    calls: SyncSender<Call>,
    inbox: Inbox,
}

impl Desk {
    /// A desk, and the receiver from which the run takes calls. A call wakes the run.
    pub(super) fn new(inbox: Inbox) -> (Desk, Receiver<Call>) {
        let (calls, taken) = sync_channel(WAITING);
        (Desk { calls, inbox }, taken)
    }

    /// Sends a request; `false` when too many wait, or the run has ended.
    pub(super) fn call(&self, request: Request, reply: impl FnOnce(Reply) + Send + 'static) -> bool {
        match self.calls.try_send(Call { request, reply: Box::new(reply) }) {
            Ok(()) => {
                self.inbox.wake();
                true
            }
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => false,
        }
    }

    /// Wakes the run without a request.
    pub(super) fn wake(&self) {
        self.inbox.wake();
    }

    /// Sends a request and waits for the reply; `None` when there will be none.
    pub(super) fn ask(&self, request: Request) -> Option<Reply> {
        let (sender, replies) = sync_channel(1);
        let is_taken = self.call(request, move |reply| drop(sender.send(reply)));
        if is_taken { replies.recv().ok() } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_read_strictly() {
        for (text, force) in
            [(r#"{"order": "reload"}"#, false), (r#"{"order": "reload", "force": true}"#, true)]
        {
            assert_eq!(Order::read(text).unwrap(), Order::Reload { force });
        }
        let change = Order::Change { model: Some("car".into()), text: "relations: {}".into() };
        let text = r#"{"order": "change", "model": "car", "text": "relations: {}"}"#;
        assert_eq!(Order::read(text).unwrap(), change);
        let order = engine::Order::Forbid(engine::Subject::Signal("/a".into()));
        let forbid = Order::read(r#"{"order": "forbid", "signal": "/a"}"#).unwrap();
        assert_eq!(forbid, Order::Engine { model: None, order });
        for wrong in [
            r#"{"order": "explode"}"#,
            r#"{"order": "change"}"#,
            r#"{"order": "change", "txt": ""}"#,
            r#"{"order": "reload", "signal": "/a"}"#,
            r#"{"order": "reload", "model": "car"}"#,
            r#"{"order": "forbid"}"#,
            r#"{"order": "forbid", "signal": "/a", "model": 7}"#,
            "[]",
            "{}",
        ] {
            assert!(Order::read(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn who_gives_an_order_may_be_named() {
        let caller = |text: &str| match Request::order(serde_json::from_str(text).unwrap(), "10.0.0.7") {
            Ok(Request::Order { order: Order::Reload { .. }, caller }) => caller,
            other => format!("{other:?}"),
        };
        assert_eq!(caller(r#"{"order": "reload"}"#), "10.0.0.7");
        assert_eq!(caller(r#"{"order": "reload", "by": "Ada"}"#), "Ada, 10.0.0.7");
        for wrong in [r#""by": 7"#.to_owned(), format!(r#""by": "{}""#, "a".repeat(LONGEST_NAME + 1))] {
            let refused = caller(&format!(r#"{{"order": "reload", {wrong}}}"#));
            assert!(refused.contains("`by` is a name of at most"), "{refused}");
        }
    }

    #[test]
    fn a_desk_does_not_take_more_than_it_can_hold() {
        let inbox = Inbox::new(1, shsa_bridge::Clock::manual());
        let (desk, calls) = Desk::new(inbox);
        let taken = (0..WAITING + 3).filter(|_| desk.call(Request::State, |_| ())).count();
        assert_eq!((taken, calls.try_iter().count()), (WAITING, WAITING));
        drop(calls);
        assert!(!desk.call(Request::State, |_| ()));
    }
}
