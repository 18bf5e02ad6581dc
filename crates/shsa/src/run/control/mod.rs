//! What may be asked of a run, over HTTP and over the bus: to see everything, and with a token to change something.

pub(super) mod http;
mod token;

pub(super) use token::{Guard, Token};

use serde::Deserialize;
use serde_json::Value;
use shsa_bridge::Inbox;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

/// Requests that may wait; more are refused.
const WAITING: usize = 64;

/// What is asked.
#[derive(Debug)]
pub(super) enum Request {
    /// How everything stands.
    State,
    /// Whether every need is served.
    Health,
    /// The decisions from this number on.
    Events(u64),
    /// Figures in the text format of Prometheus.
    Metrics,
    /// To change something; whoever passes it on has seen the token.
    Order(Order),
}

/// What an operator may order.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum Order {
    /// Reads the files of the models again.
    Reload,
    /// Changes a model by a text: its entries are added, or replace those of the same name, and null removes.
    Change {
        /// The name of the model; may be left out where there is only one.
        model: Option<String>,
        /// YAML or JSON, as in a file given to `replay --reload`.
        text: String,
    },
}

/// What comes back.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Reply {
    /// What was asked for, or what was done.
    Json(Value),
    /// The same as plain text.
    Text(String),
    /// It cannot be done, for this reason; nothing has changed.
    Refused(String),
}

/// A request on its way to the run.
pub(super) struct Call {
    pub(super) request: Request,
    /// Takes the reply where it belongs.
    pub(super) reply: Box<dyn FnOnce(Reply) + Send>,
}

/// Where requests are handed in, from any thread.
#[derive(Clone)]
pub(super) struct Desk {
    calls: SyncSender<Call>,
    inbox: Inbox,
}

impl Desk {
    /// A desk, and the end at which the run takes the calls; each ends the wait for the inbox.
    pub(super) fn new(inbox: Inbox) -> (Desk, Receiver<Call>) {
        let (calls, taken) = sync_channel(WAITING);
        (Desk { calls, inbox }, taken)
    }

    /// Hands a request in; `false` when too many wait, or the run has ended.
    pub(super) fn call(&self, request: Request, reply: impl FnOnce(Reply) + Send + 'static) -> bool {
        match self.calls.try_send(Call { request, reply: Box::new(reply) }) {
            Ok(()) => {
                self.inbox.wake();
                true
            }
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_read_strictly() {
        let order = |text: &str| serde_json::from_str::<Order>(text);
        assert_eq!(order(r#"{"do": "reload"}"#).unwrap(), Order::Reload);
        let change = Order::Change { model: None, text: "relations: {}".into() };
        assert_eq!(order(r#"{"do": "change", "text": "relations: {}"}"#).unwrap(), change);
        for wrong in
            [r#"{"do": "explode"}"#, r#"{"do": "change"}"#, r#"{"do": "change", "txt": ""}"#, "[]", "{}"]
        {
            assert!(order(wrong).is_err(), "{wrong}");
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
