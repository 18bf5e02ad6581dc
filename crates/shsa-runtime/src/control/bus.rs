//! The control interface on the bus: the same questions and orders as over HTTP, by messages and queries.
//!
//! `shsa/NAME/request` takes one JSON object:
//!
//! ```json
//! {"id": 7, "ask": "events", "since": 12}
//! {"id": 8, "order": {"order": "forbid", "signal": "/gnss"}, "token": ".."}
//! ```
//!
//! and `shsa/NAME/answer` gives `{"id": 7, "done": ..}` or `{"id": 8, "refused": ".."}`: a topic below it with the correlation
//! data that an MQTT 5 client has chosen, and to a Zenoh query by its reply. Queries of `shsa/NAME/state`, `/health`,
//! `/events?since=12` and `/metrics` are answered as over HTTP. Where looking needs a token, `ask` has a `token` as well, and a
//! query the parameter `token=..`.
//!
//! One thread takes one request after the other. A flood of requests costs the run little, and delays the requesters only.

use super::token::{Asker, Role};
use super::{Desk, Guard, Reply, Request};
use crate::error::{Context, RuntimeError};
use serde_json::{Map, Value, json};
use shsa_bridge::{Bridge, Question};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, TrySendError, sync_channel};
use std::thread;
use std::time::Duration;

/// The largest request in bytes; larger ones are not parsed.
const LARGEST: usize = 1024 * 1024;
/// The number of requests that may wait; further ones are dropped and counted.
const WAITING: usize = 64;
/// The pause between two requests: at most 200 a second are answered.
const PAUSE: Duration = Duration::from_millis(5);
/// The longest `id`, bytes of JSON.
const LONGEST_ID: usize = 256;

/// The names below `shsa/NAME` that are answered.
#[derive(Clone, Copy, Debug)]
enum Place {
    /// The request is in the message.
    Request,
    State,
    Health,
    Events,
    Metrics,
}

const PLACES: [(&str, Place); 5] = [
    ("request", Place::Request),
    ("state", Place::State),
    ("health", Place::Health),
    ("events", Place::Events),
    ("metrics", Place::Metrics),
];

/// The number of requests over the bus, by outcome.
#[derive(Debug, Default)]
pub(in super::super) struct Tally {
    done: AtomicU64,
    refused: AtomicU64,
    /// Invalid or too large, and without an `id` for an answer.
    unreadable: AtomicU64,
    /// Dropped because too many were waiting.
    crowded: AtomicU64,
}

impl Tally {
    /// Each count with its name.
    pub(in super::super) fn counts(&self) -> [(&'static str, u64); 4] {
        let Tally { done, refused, unreadable, crowded } = self;
        [("done", done), ("refused", refused), ("unreadable", unreadable), ("crowded", crowded)]
            .map(|(name, count)| (name, count.load(Ordering::Relaxed)))
    }
}

fn count(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}

/// Answers requests on the bus in a thread of its own until the bridge ends.
///
/// # Errors
/// When the name of the instance cannot be part of a topic.
pub(in super::super) fn serve(
    name: &str,
    bridge: &mut dyn Bridge,
    desk: Desk,
    guard: Guard,
) -> Result<Arc<Tally>, RuntimeError> {
    let clerk = Clerk { desk, guard, tally: Arc::default() };
    let tally = clerk.tally.clone();
    let (waiting, questions) = sync_channel(WAITING);
    for (below, place) in PLACES {
        let (waiting, tally) = (waiting.clone(), tally.clone());
        let hand_in = move |question: Question| {
            if question.payload.len() > LARGEST {
                return count(&tally.unreadable);
            }
            if let Err(TrySendError::Full(_)) = waiting.try_send((place, question)) {
                count(&tally.crowded);
            }
        };
        let (name, answers) = (format!("shsa/{name}/{below}"), format!("shsa/{name}/answer"));
        let served = bridge.serve(&name, &answers, Arc::new(hand_in));
        served.with_context(|| format!("answering requests under {name}"))?;
    }
    thread::Builder::new().name("requests".into()).spawn(move || clerk.work(&questions))?;
    Ok(tally)
}

struct Clerk {
    desk: Desk,
    guard: Guard,
    tally: Arc<Tally>,
}

impl Clerk {
    fn work(&self, questions: &Receiver<(Place, Question)>) {
        for (place, question) in questions {
            match self.answer_to(place, &question) {
                Some(words) => question.answer(words.into()),
                None => count(&self.tally.unreadable),
            }
            thread::sleep(PAUSE);
        }
    }

    /// `None`: there is nothing to answer.
    fn answer_to(&self, place: Place, question: &Question) -> Option<String> {
        let request = match place {
            Place::Request => return self.answer_letter(question),
            Place::State => Request::State,
            Place::Health => Request::Health,
            Place::Events => Request::Events(since(&question.parameters)),
            Place::Metrics => Request::Metrics,
        };
        let token = parameter(&question.parameters, "token");
        let answer = match self.look(request, token, &question.caller) {
            Ok(Reply::Json(value)) => value.to_string(),
            Ok(Reply::Text(text)) => text,
            Ok(Reply::Refused(why)) | Err(why) => json!({ "refused": why }).to_string(),
        };
        count(&self.tally.done);
        Some(answer)
    }

    fn answer_letter(&self, question: &Question) -> Option<String> {
        let envelope = Envelope::read(&question.payload);
        let (id, content) = match envelope {
            Ok(envelope) => (envelope.id, envelope.content),
            // An answer without an address or `id` would reach everybody, and nobody could assign it.
            Err(_) if !question.is_addressed => return None,
            Err(why) => (Value::Null, Err(why)),
        };
        let done = match &question.problem {
            None => content.and_then(|content| self.carry_out(content, &question.caller)),
            Some(problem) => Err(problem.clone()),
        };
        let answer = match done {
            Ok(done) => {
                count(&self.tally.done);
                json!({ "id": id, "done": done })
            }
            Err(why) => {
                count(&self.tally.refused);
                json!({ "id": id, "refused": why })
            }
        };
        Some(answer.to_string())
    }

    fn carry_out(&self, content: BusRequest, caller: &str) -> Result<Value, String> {
        let reply = match content {
            BusRequest::Ask { request, token } => self.look(request, token.as_deref(), caller)?,
            BusRequest::Order { order, token } => {
                // The token is checked first: a caller without it learns nothing about possible orders.
                let seen = self.guard.look(Role::Order, token.as_deref(), Asker::Unknown(caller));
                if let Some(why) = seen.refusal("the right `token`") {
                    return Err(why);
                }
                let order = Request::order(order, caller).map_err(|why| format!("no order: {why}"))?;
                self.ask(order)?
            }
        };
        match reply {
            Reply::Json(Value::Object(mut fields)) if fields.len() == 1 && fields.contains_key("done") => {
                Ok(fields.remove("done").unwrap_or_default())
            }
            Reply::Json(value) => Ok(value),
            Reply::Text(text) => Ok(Value::String(text)),
            Reply::Refused(why) => Err(why),
        }
    }

    /// Asks the run if the caller may view; everyone may ask for the health.
    fn look(&self, request: Request, token: Option<&str>, caller: &str) -> Result<Reply, String> {
        if matches!(request, Request::Health) {
            return self.ask(request);
        }
        match self.guard.look(Role::View, token, Asker::Unknown(caller)).refusal("the right `token`") {
            Some(why) => Err(why),
            None => self.ask(request),
        }
    }

    /// Asks the run, and waits for the reply.
    fn ask(&self, request: Request) -> Result<Reply, String> {
        let (sender, receiver) = sync_channel(1);
        if !self.desk.call(request, move |reply| drop(sender.send(reply))) {
            return Err("too many requests wait".to_owned());
        }
        receiver.recv().map_err(|_| "the run is ending".to_owned())
    }
}

/// The value of `since=3` among a selector's parameters; else 0, which means everything.
fn since(parameters: &str) -> u64 {
    parameter(parameters, "since").and_then(|number| number.parse().ok()).unwrap_or(0)
}

/// One of a selector's parameters by its name.
fn parameter<'p>(parameters: &'p str, name: &str) -> Option<&'p str> {
    parameters.split(';').find_map(|given| given.strip_prefix(name)?.strip_prefix('='))
}

/// A request and its `id`, if it has one. It has no `Debug`: it may hold a token.
struct Envelope {
    id: Value,
    /// The content of the request, or what is wrong with it. The error does not repeat the request's text.
    content: Result<BusRequest, String>,
}

enum BusRequest {
    Ask { request: Request, token: Option<String> },
    Order { order: Map<String, Value>, token: Option<String> },
}

impl Envelope {
    /// # Errors
    /// When the text is no JSON object with a valid `id`; the error does not repeat the text.
    fn read(words: &[u8]) -> Result<Envelope, String> {
        let fields: Map<String, Value> =
            serde_json::from_slice(words).map_err(|_| "a request is a JSON object".to_owned())?;
        let id = fields.get("id").cloned().unwrap_or_default();
        if id.is_object() || id.is_array() || id.to_string().len() > LONGEST_ID {
            return Err(format!("`id` is a number or a text of at most {LONGEST_ID} bytes"));
        }
        let is_lost = id.is_null() && !fields.contains_key("ask") && !fields.contains_key("order");
        if is_lost {
            return Err("neither `ask` nor `order`".to_owned());
        }
        Ok(Envelope { id, content: BusRequest::read(fields) })
    }
}

impl BusRequest {
    fn read(mut fields: Map<String, Value>) -> Result<BusRequest, String> {
        fields.remove("id");
        let token = match fields.remove("token") {
            None => None,
            Some(Value::String(token)) => Some(token),
            Some(_) => return Err("`token` is a text".to_owned()),
        };
        match (fields.remove("ask"), fields.remove("order")) {
            (Some(ask), None) => Ok(BusRequest::Ask { request: BusRequest::ask(&ask, fields)?, token }),
            (None, Some(Value::Object(order))) => {
                nothing_else(&fields)?;
                Ok(BusRequest::Order { order, token })
            }
            (None, Some(_)) => Err("`order` is an object, as {\"order\": \"reload\"}".to_owned()),
            _ => Err("either `ask` or `order`".to_owned()),
        }
    }

    fn ask(ask: &Value, mut fields: Map<String, Value>) -> Result<Request, String> {
        let since = fields.remove("since");
        nothing_else(&fields)?;
        match (ask.as_str(), since) {
            (Some("events"), None) => Ok(Request::Events(0)),
            (Some("events"), Some(since)) => {
                Ok(Request::Events(since.as_u64().ok_or("`since` is a number of an event")?))
            }
            (_, Some(_)) => Err("`since` is for events".to_owned()),
            (Some("state"), None) => Ok(Request::State),
            (Some("health"), None) => Ok(Request::Health),
            (Some("metrics"), None) => Ok(Request::Metrics),
            _ => Err("`ask` is state, health, events or metrics".to_owned()),
        }
    }
}

/// An unknown field is an error: the caller may rely on it.
fn nothing_else(fields: &Map<String, Value>) -> Result<(), String> {
    if fields.is_empty() {
        Ok(())
    } else {
        Err("takes `id`, `ask`, `since`, `order`, `token` only".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks how a request is understood.
    #[track_caller]
    fn check(words: &str, expected: &str) {
        let shown = match Envelope::read(words.as_bytes()) {
            Err(why) => format!("unreadable: {why}"),
            Ok(Envelope { id, content }) => match content {
                Err(why) => format!("{id} refused: {why}"),
                Ok(BusRequest::Ask { request, .. }) => format!("{id} {request:?}"),
                Ok(BusRequest::Order { order, token }) => {
                    format!("{id} {} with {}", Value::Object(order), token.unwrap_or_default())
                }
            },
        };
        assert!(shown.contains(expected), "{shown}");
    }

    #[test]
    fn requests_are_read_strictly() {
        check(r#"{"id": 7, "ask": "state"}"#, "7 State");
        check(r#"{"ask": "health"}"#, "null Health");
        check(r#"{"id": "x", "ask": "events", "since": 3}"#, "\"x\" Events(3)");
        check(r#"{"id": 1, "order": {"order": "reload"}, "token": "t"}"#, r#"1 {"order":"reload"} with t"#);
        check(r#"{"id": 1, "order": {"order": "reload"}}"#, r#"1 {"order":"reload"} with"#);
        check(r#"{"id": 1, "ask": "state", "since": 3}"#, "1 refused: `since` is for events");
        check(r#"{"id": 1, "ask": "state", "tokn": "secret"}"#, "1 refused: takes");
        check(r#"{"id": 1, "ask": "state", "order": {}}"#, "1 refused: either");
        check(r#"{"id": 1}"#, "1 refused: either");
        for words in ["", "7", "[]", "{}", r#"{"id": []}"#, "{\"id\": 7", "\u{0}"] {
            check(words, "unreadable: ");
        }
        check(&format!(r#"{{"id": "{}", "ask": "state"}}"#, "x".repeat(300)), "unreadable: `id`");
    }

    #[test]
    fn what_is_wrong_is_reported_without_the_words_of_the_request() {
        for words in [
            r#"{"id": 1, "ask": "the-secret"}"#,
            r#"{"id": 1, "ask": "events", "since": "the-secret"}"#,
            r#"{"id": 1, "order": "the-secret"}"#,
            r#"{"id": 1, "order": {}, "token": ["the-secret"]}"#,
            r#"{"id": 1, "ask": "state", "the-secret": 1}"#,
        ] {
            let Ok(Envelope { content: Err(why), .. }) = Envelope::read(words.as_bytes()) else {
                panic!("{words}")
            };
            assert!(!why.contains("the-secret"), "{why}");
        }
    }

    #[test]
    fn where_events_begin_is_a_parameter() {
        for (parameters, number) in [("", 0), ("since=12", 12), ("a=1;since=3", 3), ("since=x", 0)] {
            assert_eq!(since(parameters), number);
        }
    }
}
