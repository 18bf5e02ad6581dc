//! What the gate costs: publisher -> instance -> consumer, beside publisher -> relay -> consumer and publisher -> consumer, in
//! turns within one run.

use super::middleware::{Kind, Middleware, Process};
use super::model::{Plan, need, topic, value};
use super::plain;
use super::subject::{Manner, Subject};
use super::times::{Quantiles, Times};
use super::traffic::{Beat, Publisher, Subscriber};
use serde_json::{Value, json};
use shsa_bridge::{Message, Outgoing, Quality};
use shsa_core::time::Time;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Between two messages: 1 kHz.
const PERIOD: Duration = Duration::from_millis(1);
/// Messages in one turn of one path.
pub(super) const TURN: u32 = 500;
/// Messages at the beginning of a turn that are not counted: the other path has just stopped.
const SETTLING: u32 = 20;
/// The signals that are compared with the need's source publish once in this many messages.
const OTHERS: u32 = 10;
/// The names of the paths.
const PATHS: [&str; 3] = ["direct", "relay", "gate"];

/// The results on one middleware.
pub(super) struct Gate {
    pub(super) kind: Kind,
    /// Whether the processors were kept awake.
    pub(super) is_awake: bool,
    /// Messages published on each path.
    pub(super) sent: u64,
    /// Transport alone, one hop; with a plain relay, two hops; with the gate, two hops.
    pub(super) paths: [Path; 3],
    /// What the instance itself measures: from the reception of a message until the value that comes of it is handed to the
    /// client library.
    pub(super) inside: Quantiles,
}

/// One path.
pub(super) struct Path {
    pub(super) times: Times,
    /// The smallest median and the smallest 99th percentile of all turns: other work on the machine only adds.
    pub(super) best: Quantiles,
}

impl Gate {
    pub(super) fn all(&self) -> [Quantiles; 3] {
        [0, 1, 2].map(|path| self.paths[path].times.quantiles())
    }

    pub(super) fn best(&self) -> [Quantiles; 3] {
        [0, 1, 2].map(|path| self.paths[path].best)
    }

    pub(super) fn lost(&self) -> u64 {
        let received = |path: &Path| path.times.count();
        self.paths.iter().map(|path| self.sent.saturating_sub(received(path))).sum()
    }

    pub(super) fn to_json(&self) -> Value {
        let path = |path: usize| {
            let Path { times, best } = &self.paths[path];
            json!({ "count": times.count(), "all": times.quantiles().to_json(), "best_turn": best.to_json() })
        };
        let [_, relay, gate] = self.all();
        let [_, best_relay, best_gate] = self.best();
        json!({
            "part": "gate",
            "bus": self.kind.name(),
            "awake": self.is_awake,
            "direct": path(0),
            "relay": path(1),
            "gate": path(2),
            "inside": self.inside.to_json(),
            "beyond_relay": gate.beyond(relay).to_json(),
            "beyond_relay_best_turns": best_gate.beyond(best_relay).to_json(),
            "lost": self.lost(),
        })
    }
}

/// The first and the last topic of each path.
fn ends() -> [(String, String); 3] {
    [
        ("bench/direct".to_owned(), "bench/direct".to_owned()),
        ("bench/to".to_owned(), "bench/fro".to_owned()),
        (topic(0, 0), need(0)),
    ]
}

/// Measures for so many seconds; `is_awake`: the caller keeps the processors awake.
///
/// # Errors
/// When the middleware or a process does not work.
pub(super) fn measure(middleware: &Middleware, seconds: f64, is_awake: bool) -> anyhow::Result<Gate> {
    let rounds = (seconds / (3.0 * f64::from(TURN) * PERIOD.as_secs_f64())).ceil().max(1.0) as u32;
    let plan = Plan::calm(1, 3);
    let at_most = Duration::from_secs_f64(seconds * 2.0 + 60.0);
    let manner = Manner { at_most_once: false, on_one_core: false, at_most };
    let subject = Subject::start(middleware, &plan, manner)?;
    let ends = ends();
    let _relay = Relay::start(middleware, &ends[1])?;
    let turns = Turns::new(ends.clone().map(|(_, to)| to))?;
    let topics = ends.clone().map(|(_, to)| to);
    let subscriber = Subscriber::new(middleware, "bench-consumer", false, topics, turns, Turns::take)?;
    let mut publisher = Publisher::new(middleware, "bench-publisher", false)?;
    let mut beat = Beat::new(PERIOD);
    // Waits until everything is connected and the instance has found that its signals agree.
    for at in 0..1_000 {
        beat.wait();
        publish_next(&mut publisher, &ends, at % 3, at as u32)?;
    }
    let begin = middleware.clock.now();
    let mut count = 0;
    for _ in 0..rounds {
        for path in 0..PATHS.len() {
            for at in 0..TURN {
                beat.wait();
                publish_next(&mut publisher, &ends, path, at)?;
            }
            // The last messages arrive before the next path begins.
            thread::sleep(Duration::from_millis(20));
            beat = Beat::new(PERIOD);
        }
        count += u64::from(TURN - SETTLING);
    }
    thread::sleep(Duration::from_millis(500));
    let inside = Quantiles::from_state(&subject.state()?["figures"]["latency_us"]);
    let turns = subscriber.end()?;
    Ok(Gate { kind: middleware.kind, is_awake, sent: count, paths: turns.paths(begin)?, inside })
}

/// Publishes the next message of a path; on every path, the instance's other signals publish now and then.
fn publish_next(
    publisher: &mut Publisher,
    ends: &[(String, String); 3],
    path: usize,
    at: u32,
) -> anyhow::Result<()> {
    if at.is_multiple_of(OTHERS) {
        for other in [1, 2] {
            let now = publisher.now();
            publisher.publish_next(&topic(0, other), value(now))?;
        }
        thread::sleep(Duration::from_micros(300));
    }
    let now = publisher.now();
    publisher.publish_next(&ends[path].0, value(now))?;
    Ok(())
}

/// The messages that the consumer has received: path, time of publishing, time of reception.
struct Turns {
    topics: [String; 3],
    received: Vec<(usize, Time, Time)>,
}

impl Turns {
    fn new(topics: [String; 3]) -> anyhow::Result<Turns> {
        Ok(Turns { topics, received: Vec::with_capacity(1 << 17) })
    }

    /// Takes a message in, unless it is a substitute: while other paths have their turn, the need's source is silent, and a
    /// substitute has not passed the gate.
    fn take(&mut self, message: &Message, now: Time) {
        if message.quality == Some(Quality::Substitute) {
            return;
        }
        let path = self.topics.iter().position(|topic| **topic == *message.topic);
        self.received.extend(path.zip(message.stamp).map(|(path, stamp)| (path, stamp, now)));
    }

    /// The times of the messages published from `begin` on, turn by turn.
    fn paths(self, begin: Time) -> anyhow::Result<[Path; 3]> {
        let one = |path: usize| -> anyhow::Result<Path> {
            let received: Vec<_> =
                self.received.iter().filter(|(of, sent_at, _)| *of == path && *sent_at >= begin).collect();
            let mut times = Times::new()?;
            let mut best = Quantiles { p50: f64::INFINITY, p99: f64::INFINITY, worst: f64::INFINITY };
            for turn in received.chunks(TURN as usize) {
                let mut of_turn = Times::new()?;
                turn.iter()
                    .skip(SETTLING as usize)
                    .for_each(|(_, sent_at, at)| of_turn.record(*at - *sent_at));
                best = best.least(of_turn.quantiles());
                times.add(&of_turn);
            }
            Ok(Path { times, best })
        };
        Ok([one(0)?, one(1)?, one(2)?])
    }
}

/// Publishes received messages again, by the transport alone.
enum Relay {
    Process { _process: Process },
    Thread { stop: Arc<AtomicBool>, inbox: shsa_bridge::Inbox, thread: Option<JoinHandle<()>> },
}

impl Relay {
    fn start(middleware: &Middleware, (from, to): &(String, String)) -> anyhow::Result<Relay> {
        let which = match middleware.kind {
            Kind::Memory => return Relay::in_memory(middleware, from, to.clone()),
            Kind::Mqtt => "mqtt",
            Kind::Zenoh => "zenoh",
        };
        let process = plain::command("relay", &[which, &middleware.port.to_string(), from, to])?;
        Ok(Relay::Process { _process: Process(process) })
    }

    fn in_memory(middleware: &Middleware, from: &str, to: String) -> anyhow::Result<Relay> {
        let mut bridge = middleware.join("bench-relay", 1024, false)?;
        bridge.subscribe(from, None)?;
        let (stop, inbox) = (Arc::new(AtomicBool::new(false)), bridge.inbox().clone());
        let ends = stop.clone();
        let thread = thread::Builder::new().name("relay".into()).spawn(move || {
            while !ends.load(Ordering::Acquire) {
                while let Some(message) = bridge.receive() {
                    // The bus in memory refuses nothing.
                    let _ = bridge.publish(Outgoing::new(&to, message.stamped(), message.payload));
                }
                bridge.inbox().wait(Duration::from_secs(1));
            }
        })?;
        Ok(Relay::Thread { stop, inbox, thread: Some(thread) })
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        if let Relay::Thread { stop, inbox, thread } = self {
            stop.store(true, Ordering::Release);
            inbox.wake();
            let _ = thread.take().map(JoinHandle::join);
        }
    }
}
