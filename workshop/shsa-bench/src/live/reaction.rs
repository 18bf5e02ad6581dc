//! How long it takes from the observation that reveals a fault to the first substitute on the wire.

use super::middleware::{Kind, Middleware};
use super::model::{LIE, Plan, name, need, topic, value};
use super::subject::{EVENTS, Manner, Subject};
use super::times::Times;
use super::traffic::{Beat, Publisher, Subscriber};
use serde_json::{Value, json};
use shsa_bridge::{Message, Payload, Quality};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use std::collections::BTreeMap;
use std::time::Duration;

/// The signals of a variable publish in turn, each 50 times a second.
const PERIOD_MS: u64 = 20;
/// The number of variables; their sources break one after the other.
const VARIABLES: usize = 20;
const SIGNALS: usize = 3;
/// Time between two faults of one variable. The source must be trusted for four times its probation, else the probation grows.
const CYCLE_MS: u64 = 2_000;
/// How long a fault lasts.
const FAULT_MS: u64 = 300;

/// The timeout expires before the source is late by its own pace, where a stand-in would serve: half a period later.
const PLAN: Plan =
    Plan { variables: VARIABLES, signals: SIGNALS, timeout_ms: 28, age_ms: 1_000, probation_ms: 200 };

/// How the source of a need breaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Break {
    /// Its values are wrong.
    Lies,
    /// It publishes nothing.
    Silent,
}

/// The results for one kind of fault.
pub(super) struct Reaction {
    pub(super) kind: Kind,
    /// `lies` or `silent`.
    pub(super) fault: &'static str,
    pub(super) faults: u64,
    /// Faults after which no substitute came.
    pub(super) unhealed: u64,
    /// Wrong values that the consumer has received.
    pub(super) wrong: u64,
    /// From the revealing observation (for a silent source: from its deadline) until the consumer received the first substitute.
    pub(super) times: Times,
    /// From the beginning of the fault until the first substitute.
    pub(super) since_beginning: Times,
}

impl Reaction {
    pub(super) fn to_json(&self) -> Value {
        json!({
            "part": "reaction",
            "bus": self.kind.name(),
            "fault": self.fault,
            "faults": self.faults,
            "unhealed": self.unhealed,
            "wrong": self.wrong,
            "reaction": self.times.quantiles().to_json(),
            "since_beginning": self.since_beginning.quantiles().to_json(),
        })
    }
}

/// A fault in the run.
struct Fault {
    how: Break,
    variable: usize,
    from: Time,
    to: Time,
}

/// All decisions and the values received.
#[derive(Default)]
struct Log {
    /// Times of the decisions, by signal.
    decided: BTreeMap<String, Vec<Time>>,
    /// For each need: time, quality and value of each message.
    served: BTreeMap<String, Vec<(Time, Option<Quality>, f64)>>,
}

impl Log {
    fn take(&mut self, message: &Message, now: Time) {
        if &*message.topic == EVENTS {
            self.decided(message);
        } else if let Some(served) = self.served.get_mut(&*message.topic) {
            served.push((now, message.quality, number(&message.payload)));
        }
    }

    fn decided(&mut self, message: &Message) {
        let Payload::Bytes(bytes) = &message.payload else { return };
        let Ok(event) = serde_json::from_slice::<Value>(bytes) else { return };
        let is_accusation = event
            .get("kind")
            .and_then(Value::as_str)
            .is_some_and(|kind| kind == "failed" || kind == "silent");
        let signal = event.get("signal").and_then(Value::as_str);
        let time = event.get("time_ns").and_then(Value::as_i64);
        if let (true, Some(signal), Some(time)) = (is_accusation, signal, time) {
            self.decided.entry(signal.to_owned()).or_default().push(Time(time));
        }
    }
}

fn number(payload: &Payload) -> f64 {
    match payload {
        Payload::Value(RawValue::Number(number)) => *number,
        Payload::Value(RawValue::Interval { lo, hi }) => lo.midpoint(*hi),
        Payload::Value(_) => f64::NAN,
        Payload::Bytes(bytes) => {
            std::str::from_utf8(bytes).ok().and_then(|text| text.parse().ok()).unwrap_or(f64::NAN)
        }
    }
}

/// Makes this many faults of each kind.
///
/// # Errors
/// When the middleware or a process does not work.
pub(super) fn measure(middleware: &Middleware, faults: usize) -> anyhow::Result<[Reaction; 2]> {
    let cycles = 2 * faults.div_ceil(VARIABLES) as u64;
    let length = Duration::from_millis(CYCLE_MS * (cycles + 2));
    let manner =
        Manner { at_most_once: false, on_one_core: false, at_most: length * 2 + Duration::from_secs(30) };
    let _subject = Subject::start(middleware, &PLAN, manner)?;
    let log = Log { served: PLAN.needs().map(|need| (need, Vec::new())).collect(), ..Log::default() };
    let topics = PLAN.needs().chain([EVENTS.to_owned()]);
    let subscriber = Subscriber::new(middleware, "bench-consumer", false, topics, log, Log::take)?;
    let publisher = Publisher::new(middleware, "bench-publisher", false)?;
    let mut stage = Stage { publisher, broken: vec![None; VARIABLES], faults: Vec::new() };
    stage.play(cycles)?;
    std::thread::sleep(Duration::from_millis(500));
    let log = subscriber.end()?;
    Ok([
        stage.judged(middleware.kind, Break::Lies, &log)?,
        stage.judged(middleware.kind, Break::Silent, &log)?,
    ])
}

/// The fault of a variable's source at a millisecond. The first cycle has none; then wrong values and silence alternate by cycle.
fn broken(ms: u64, cycles: u64, variable: usize) -> Option<Break> {
    let offset = CYCLE_MS + variable as u64 * CYCLE_MS / VARIABLES as u64;
    let since =
        ms.checked_sub(offset).filter(|since| since / CYCLE_MS < cycles && since % CYCLE_MS < FAULT_MS)?;
    Some(if (since / CYCLE_MS).is_multiple_of(2) { Break::Lies } else { Break::Silent })
}

/// The sensors and their present faults.
struct Stage {
    publisher: Publisher,
    broken: Vec<Option<(Break, Time)>>,
    faults: Vec<Fault>,
}

impl Stage {
    /// Publishes all signals, each at its own millisecond of the period, and breaks the sources of the variables one after the
    /// other.
    fn play(&mut self, cycles: u64) -> anyhow::Result<()> {
        let mut beat = Beat::new(Duration::from_millis(1));
        for ms in 0..CYCLE_MS * (cycles + 2) {
            beat.wait();
            for (variable, signal) in PLAN.all() {
                // The three of a variable are a third of a period apart.
                let at = (variable as u64 * 7 + signal as u64 * PERIOD_MS / SIGNALS as u64) % PERIOD_MS;
                if ms % PERIOD_MS == at {
                    self.turn(broken(ms, cycles, variable).filter(|_| signal == 0), variable, signal)?;
                }
            }
        }
        Ok(())
    }

    /// Publishes one signal's value, with its present fault.
    fn turn(&mut self, wrong: Option<Break>, variable: usize, signal: usize) -> anyhow::Result<()> {
        let now = self.publisher.now();
        if signal == 0 {
            match (wrong, self.broken[variable]) {
                (Some(how), None) => self.broken[variable] = Some((how, now)),
                (None, Some((how, from))) => {
                    self.faults.push(Fault { how, variable, from, to: now });
                    self.broken[variable] = None;
                }
                _ => {}
            }
        }
        let lie = match wrong {
            Some(Break::Silent) => return Ok(()),
            Some(Break::Lies) => LIE,
            None => 0.0,
        };
        self.publisher.publish_next(&topic(variable, signal), value(now) + lie)?;
        Ok(())
    }

    fn judged(&self, kind: Kind, how: Break, log: &Log) -> anyhow::Result<Reaction> {
        let fault = match how {
            Break::Lies => "lies",
            Break::Silent => "silent",
        };
        let (times, since_beginning) = (Times::new()?, Times::new()?);
        let mut reaction = Reaction { kind, fault, faults: 0, unhealed: 0, wrong: 0, times, since_beginning };
        for fault in self.faults.iter().filter(|fault| fault.how == how) {
            reaction.faults += 1;
            let served = log.served.get(&need(fault.variable)).map_or(&[][..], Vec::as_slice);
            let during = || served.iter().filter(|(at, ..)| (fault.from..fault.to + SLACK).contains(at));
            reaction.wrong += during().filter(|(.., value)| (value - 10.0).abs() > 1.0).count() as u64;
            let first = during().find(|(_, quality, _)| *quality == Some(Quality::Substitute));
            let Some((healed, revealed)) = first.zip(Stage::revealed(fault, log)) else {
                reaction.unhealed += 1;
                continue;
            };
            reaction.times.record(healed.0 - revealed);
            reaction.since_beginning.record(healed.0 - fault.from);
        }
        Ok(reaction)
    }

    /// The moment that reveals a fault: for wrong values the first one; for silence the deadline, which is the time of the
    /// decision.
    fn revealed(fault: &Fault, log: &Log) -> Option<Time> {
        match fault.how {
            Break::Lies => Some(fault.from),
            Break::Silent => {
                let decided = log.decided.get(&name(fault.variable, 0))?;
                decided.iter().copied().find(|at| (fault.from..fault.to + SLACK).contains(at))
            }
        }
    }
}

/// A decision up to this long after a fault belongs to the fault.
const SLACK: Span = Span::from_millis(100);
