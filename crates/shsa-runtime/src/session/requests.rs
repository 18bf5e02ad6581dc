//! The answers of a run: its state, its figures, and the results of orders.

use super::Session;
use crate::bands::{self, BandsOf};
use crate::control::{Call, Order, Reply, Request};
use crate::error::RuntimeError;
use crate::federation::Federation;
use crate::healer::Healer;
use crate::metrics;
use crate::neighbours::Neighbours;
use crate::ownership::Ownership;
use crate::view::{self, Look};
use serde_json::{Map, Value, json};
use shsa_bridge::{Link, Quality};
use shsa_core::time::{Span, Time};
use std::collections::BTreeMap;
use std::sync::mpsc::Receiver;

/// The most decisions for a reader that has followed none.
const MOST_NEWS: u64 = 200;

/// What a request costs: 200 a second are answered, as over the bus, and the rest of the time is that of the needs.
const COST: Span = Span::from_millis(5);

/// Requests that are answered at once, as those of a page that is opened.
const AT_ONCE: i64 = 32;

/// The requests that wait, and when those answered so far will have been paid for.
pub(in super::super) struct Questions {
    calls: Receiver<Call>,
    paid: Time,
}

impl Questions {
    pub(in super::super) fn new(calls: Receiver<Call>) -> Questions {
        Questions { calls, paid: Time::MIN }
    }

    /// The next one, unless too many have been answered lately.
    fn next(&mut self, now: Time) -> Option<Call> {
        if self.due(now).is_some() {
            return None;
        }
        let call = self.calls.try_recv().ok()?;
        self.paid = self.paid.max(now) + COST;
        Some(call)
    }

    /// When the next one may be answered, where that is not now.
    pub(super) fn due(&self, now: Time) -> Option<Time> {
        let due = self.paid - COST.times(AT_ONCE);
        (due > now).then_some(due)
    }
}

impl Session {
    /// Answers requests. What comes from the bus meanwhile goes first: no request costs a need its age.
    pub(super) fn answer(&mut self) -> Result<(), RuntimeError> {
        while let Some(Call { request, reply }) = self.requests.next(self.now()) {
            reply(match request {
                Request::State => Reply::Json(self.state()),
                Request::Health => Reply::Json(self.health()),
                Request::Look(look) => Reply::Json(self.seen(look)),
                Request::Bands(wanted) => self.bands(&wanted).map_or_else(Reply::Refused, Reply::Json),
                Request::Past(model) => self.past(&model).map_or_else(Reply::Refused, Reply::Json),
                Request::Model(name, taker) => {
                    let healer = self.healers.iter().find(|healer| healer.name() == name);
                    // The reader may have gone.
                    healer.map(|healer| taker.send(Box::new(healer.engine().knowledge().clone())).ok());
                    Reply::Json(Value::Null)
                }
                Request::Evidence(number) => {
                    Reply::Json(self.explained.of(number).cloned().unwrap_or_default())
                }
                Request::Events(since) => Reply::Json(Value::Array(self.log.since(since))),
                Request::Metrics => Reply::Text(self.metrics()?),
                Request::Order { order, caller } => self.order(&order, &caller)?,
                Request::Denied(news) => {
                    let now = self.now();
                    self.log.noted(now, "denied", &news, self.bridge.as_mut());
                    Reply::Json(Value::Null)
                }
            });
            self.heed()?;
        }
        Ok(())
    }

    fn metrics(&self) -> Result<String, RuntimeError> {
        let now = self.now();
        metrics::text(
            &self.figures,
            &self.tally,
            &self.guard,
            &self.log,
            &self.healers,
            self.bridge.as_ref(),
            now,
        )
    }

    /// Carries out an order and reports it; or returns the reason of a refusal.
    fn order(&mut self, order: &Order, caller: &str) -> Result<Reply, RuntimeError> {
        let now = self.now();
        let done = match order {
            Order::Reload { force } => self.reload(*force),
            Order::Change { model, text } => self.change(model.as_deref(), text),
            Order::Engine { model, order } => {
                let healer = find(&mut self.healers, model.as_deref());
                healer.and_then(|healer| healer.order(order, now)).map(|()| order.to_string())
            }
        };
        let reply = match done {
            Ok(done) => {
                self.write_down(order, caller, &done);
                let reported_model = format!("{done} (from {caller})");
                self.log.noted(now, "ordered", &reported_model, self.bridge.as_mut());
                Reply::Json(json!({ "done": done }))
            }
            Err(why) => Reply::Refused(why),
        };
        self.deliver()?;
        self.reported.doubt = Time::MIN;
        Ok(reply)
    }

    /// Has the journals of those models that an order was for say who gave it.
    fn write_down(&mut self, order: &Order, caller: &str, done: &str) {
        let now = self.now();
        let model = match order {
            Order::Reload { .. } => None,
            Order::Change { model, .. } | Order::Engine { model, .. } => model.as_deref(),
        };
        let ordered = self.healers.iter_mut().filter(|healer| model.is_none_or(|name| name == healer.name()));
        ordered.for_each(|healer| healer.ordered(now, caller, done));
    }

    /// Reads the files of all models again. The first invalid file ends the reload; the models before it have changed.
    fn reload(&mut self, force: bool) -> Result<String, String> {
        let now = self.now();
        let mut lost = Vec::new();
        for healer in &mut self.healers {
            lost.extend(healer.reload(force, now)?);
        }
        Ok(format!("the models were read again by order of the operator{}", without(&lost)))
    }

    fn change(&mut self, model: Option<&str>, text: &str) -> Result<String, String> {
        let now = self.now();
        let healer = find(&mut self.healers, model)?;
        let lost = healer.change("order", text, true, now)?;
        Ok(format!("the model {} was changed by order of the operator{}", healer.name(), without(&lost)))
    }

    fn health(&self) -> Value {
        let now = self.now();
        let outlets = || self.healers.iter().flat_map(Healer::outlets);
        let needs =
            outlets().map(|(_, outlet)| (outlet.topic().to_owned(), json!(outlet.quality(now).name())));
        let all_served = outlets().all(|(_, outlet)| outlet.quality(now) != Quality::Bad);
        let taken = || self.healers.iter().flat_map(|healer| healer.takeovers(now));
        let all_served = all_served && taken().all(|(_, quality)| quality != Quality::Bad);
        let taken = taken().map(|(takeover, quality)| (takeover.topic().to_owned(), json!(quality.name())));
        let connected = self.bridge.link() == Link::Up;
        json!({
            "ok": all_served && connected,
            "connected": connected,
            "degraded": self.healers.iter().flat_map(|healer| healer.files().degraded()).collect::<Vec<_>>(),
            "needs": Value::Object(needs.chain(taken).collect()),
        })
    }

    /// The changes for the live page since a reader's last look.
    fn seen(&self, look: Look) -> Value {
        let (now, clock, next) = (self.now(), self.clock(), self.log.next());
        let news = self.log.since(look.since.unwrap_or(next.saturating_sub(MOST_NEWS)));
        let models = self.healers.iter();
        let models = models.map(|it| (it.name().to_owned(), view::of(it, look, &news, now, &clock)));
        json!({
            "name": self.name,
            "version": env!("CARGO_PKG_VERSION"),
            "time_ns": clock.by_wall(now).0,
            "link": match self.bridge.link() {
                Link::Up => Value::Null,
                Link::Down(why) => json!(why),
            },
            "others": self.others(),
            "models": Value::Object(models.collect()),
            "next_event": next,
            "events": news,
        })
    }

    /// The other instances with their pages: those that the options name, and those on the bus.
    fn others(&self) -> Vec<Value> {
        let named = self.other_pages.iter().map(|page| json!(page));
        named.chain(self.neighbours.iter().flat_map(Neighbours::json)).collect()
    }

    fn bands(&self, wanted: &BandsOf) -> Result<Value, String> {
        let healer = self.healers.iter().find(|healer| healer.name() == wanted.model);
        let healer = healer.ok_or_else(|| format!("no model '{}'", wanted.model))?;
        bands::of(healer, wanted, self.now(), &self.clock())
    }

    fn past(&self, model: &str) -> Result<Value, String> {
        let healer = self.healers.iter().find(|healer| healer.name() == model);
        let healer = healer.ok_or_else(|| format!("no model '{model}'"))?;
        Ok(view::past(healer, &self.clock()))
    }

    fn state(&self) -> Value {
        let (now, clock) = (self.now(), self.clock());
        let models = self.healers.iter().map(|healer| (healer.name().to_owned(), healer.state(now, &clock)));
        let needs = self.healers.iter().flat_map(Healer::outlets).map(|(_, outlet)| outlet.topic());
        let able = |ownership: &Ownership| -> Value {
            needs.map(|need| (need.to_owned(), json!(ownership.able(need)))).collect::<Map<_, _>>().into()
        };
        let losses = self.bridge.inbox().losses();
        let losses = losses.iter().map(|loss| (loss.topic.to_string(), json!(loss.dropped)));
        json!({
            "name": self.name,
            "version": env!("CARGO_PKG_VERSION"),
            "time_ns": clock.by_wall(now).0,
            "link": match self.bridge.link() {
                Link::Up => json!({ "up": true, "last_outage": self.connection.json(&clock) }),
                Link::Down(why) => {
                    json!({ "up": false, "because": why, "last_outage": self.connection.json(&clock) })
                }
            },
            "models": Value::Object(models.collect()),
            "instances": self.ownership.as_ref().map(able),
            "parts": self.federation.as_ref().map(Federation::state),
            "dropped": Value::Object(losses.collect()),
            "unwritten_lines": self.log.unwritten(),
            "undelivered": self.log.not_taken().json(),
            "strangers": self.strangers.json(),
            "requests": self.tally.counts().into_iter().collect::<BTreeMap<_, _>>(),
            "figures": self.figures.json(),
        })
    }
}

/// Tells which needs a change has taken away.
fn without(lost: &[String]) -> String {
    if lost.is_empty() { String::new() } else { format!("; nothing serves {} any more", lost.join(", ")) }
}

/// The healer of this model; without a name, the only healer.
fn find<'h>(healers: &'h mut [Healer], model: Option<&str>) -> Result<&'h mut Healer, String> {
    let names: Vec<&str> = healers.iter().map(Healer::name).collect();
    let known = names.join(", ");
    let at = match model {
        Some(model) => names
            .iter()
            .position(|name| *name == model)
            .ok_or_else(|| format!("no model '{model}'; there are: {known}"))?,
        None if names.len() == 1 => 0,
        None => return Err(format!("say which model: {known}")),
    };
    healers.get_mut(at).ok_or_else(|| "no model".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    #[test]
    fn a_flood_of_requests_is_answered_at_a_steady_pace() {
        let (calls, waiting) = channel();
        let mut questions = Questions::new(waiting);
        for _ in 0..1_000 {
            calls.send(Call { request: Request::State, reply: Box::new(|_| ()) }).unwrap();
        }
        let mut answered = |ms: i64| {
            let now = Time(ms * 1_000_000);
            std::iter::from_fn(|| questions.next(now)).count()
        };
        assert_eq!([0, 0, 4, 5, 10, 1_000].map(&mut answered), [33, 0, 0, 1, 1, 33]);
        let now = Time(1_000_000_000);
        assert_eq!(questions.due(now), Some(Time(1_005_000_000)));
        assert_eq!(questions.due(Time(1_005_000_000)), None);
    }
}
