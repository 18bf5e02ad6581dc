//! Independent sensors and an independent consumer, and the consumer's values.

use crate::real::Script;
use serde_json::{Value, json};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

/// A time limit that no step reaches.
const PATIENCE: Duration = Duration::from_secs(30);

/// A value received by the consumer.
#[derive(Clone, Debug)]
pub(crate) struct Seen {
    /// The time of reception by a clock that never steps, seconds.
    pub(crate) at: f64,
    pub(crate) value: f64,
    pub(crate) quality: String,
    pub(crate) publisher: String,
    /// The wall-clock time at which the value was true.
    pub(crate) stamp_s: f64,
    /// The consumer's wall clock at reception.
    pub(crate) wall_s: f64,
}

impl Seen {
    fn read(row: &Value) -> Seen {
        let number = |at: usize| row[at].as_f64().unwrap();
        let text = |at: usize| row[at].as_str().unwrap_or_default().to_owned();
        Seen {
            at: number(0),
            value: number(1),
            quality: text(2),
            publisher: text(3),
            stamp_s: number(4) / 1e9,
            wall_s: number(5) / 1e9,
        }
    }

    pub(crate) fn is_good(&self) -> bool {
        self.quality == "Good"
    }

    pub(crate) fn is_substitute(&self) -> bool {
        self.quality == "UncertainSubstituteValue"
    }

    /// The difference to the speed that the sensors measure.
    pub(crate) fn error(&self) -> f64 {
        (self.value - (10.0 + 0.3 * (self.at / 3.0).sin())).abs()
    }
}

/// The longest time without a value between two times.
pub(crate) fn longest_gap(seen: &[Seen], from: f64, to: f64) -> f64 {
    let inside = seen.iter().map(|seen| seen.at).filter(|at| (from..to).contains(at));
    let times: Vec<f64> = [from].into_iter().chain(inside).chain([to]).collect();
    times.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max)
}

/// The running sensors and the consumer.
pub(crate) struct Plant {
    script: Script,
    seen: Vec<Seen>,
}

impl Plant {
    /// Starts sensors of these signals on a bus: `mqtt` or `zenoh` on this port of the loopback interface.
    #[track_caller]
    pub(crate) fn start(python: &Path, bus: &str, port: u16, signals: &[&str]) -> Plant {
        let order = json!({
            "bus": bus, "address": "127.0.0.1", "port": port, "signals": signals, "topic": "chaos",
            "rate": 50, "need": "chaos/speed",
        });
        Plant { script: Script::start(python, "plant.py", &order), seen: Vec::new() }
    }

    /// The time of the clock that never steps.
    #[track_caller]
    pub(crate) fn now(&mut self) -> f64 {
        self.at(&json!({ "now": true }))
    }

    /// Breaks a sensor by `stop` or `bias`, or repairs it by `none`; returns the time of the first visible effect.
    #[track_caller]
    pub(crate) fn fault(&mut self, signal: &str, kind: &str, amount: f64) -> f64 {
        self.at(&json!({ "fault": signal, "kind": kind, "amount": amount }))
    }

    fn at(&mut self, order: &Value) -> f64 {
        self.script.answer(order, "at")["at"].as_f64().unwrap()
    }

    /// Gives an order without an answer.
    #[track_caller]
    pub(crate) fn order(&mut self, order: &Value) {
        self.script.order(order);
    }

    /// Gives an order, and returns the answer.
    #[track_caller]
    pub(crate) fn answer(&mut self, order: &Value, key: &str) -> Value {
        self.script.answer(order, key)
    }

    /// All values received by the consumer so far.
    #[track_caller]
    pub(crate) fn seen(&mut self) -> &[Seen] {
        let answer = self.script.answer(&json!({ "values": true }), "values");
        self.seen.extend(answer["values"].as_array().unwrap().iter().map(Seen::read));
        &self.seen
    }

    /// Waits for the first value since a time that meets a condition.
    #[track_caller]
    pub(crate) fn first(&mut self, from: f64, what: &str, is_so: impl Fn(&Seen) -> bool) -> Seen {
        let end = Instant::now() + PATIENCE;
        loop {
            let found = self.seen().iter().find(|seen| seen.at >= from && is_so(seen));
            if let Some(found) = found {
                return found.clone();
            }
            assert!(Instant::now() < end, "the consumer never saw {what}; last {:?}", self.seen.last());
            thread::sleep(Duration::from_millis(50));
        }
    }
}
