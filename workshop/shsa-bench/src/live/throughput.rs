//! How many messages a second pass through one instance on one core, and the processor time of each.

use super::middleware::{Kind, Middleware, PATIENCE};
use super::model::{Plan, topic, value};
use super::subject::{Manner, Subject};
use super::traffic::{Beat, Publisher, Subscriber};
use crate::processor::seconds_of;
use anyhow::bail;
use serde_json::{Value, json};
use std::thread;
use std::time::{Duration, Instant};

/// Variables, and signals of each; every signal has a topic of its own. The first signal of a variable serves its need.
pub(super) const PLAN: (usize, usize) = (25, 2);
/// Messages go out in bundles this far apart.
const PERIOD: Duration = Duration::from_millis(1);
/// Messages before the counting begins: the instance connects and its memory grows to its working size.
const WARM_UP: Duration = Duration::from_millis(1_000);
/// The longest time that messages may be on their way.
const ON_THE_WAY: Duration = Duration::from_secs(15);
/// After this long without a message, none is on its way.
const STILL: Duration = Duration::from_millis(250);
/// Rates that are tried, messages a second.
const LADDER: [u32; 9] = [10_000, 20_000, 30_000, 40_000, 50_000, 70_000, 100_000, 140_000, 200_000];

/// Counts of messages at each station of their way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Tally {
    pub(super) published_inputs: u64,
    pub(super) received: u64,
    pub(super) published: u64,
    pub(super) consumed: u64,
}

impl Tally {
    fn now<S>(
        publishers: &Publishers,
        subject: &Subject,
        subscriber: &Subscriber<S>,
    ) -> anyhow::Result<Tally> {
        let state = subject.state()?;
        let figure = |name: &str| state.pointer(name).and_then(Value::as_u64).unwrap_or(0);
        Ok(Tally {
            published_inputs: publishers.published_inputs,
            received: figure("/figures/messages"),
            published: figure("/figures/publications"),
            consumed: subscriber.taken(),
        })
    }

    pub(super) fn since(self, before: Tally) -> Tally {
        Tally {
            published_inputs: self.published_inputs - before.published_inputs,
            received: self.received - before.received,
            published: self.published - before.published,
            consumed: self.consumed - before.consumed,
        }
    }

    /// Messages lost before the instance, and after it.
    pub(super) fn lost(self) -> u64 {
        self.published_inputs.saturating_sub(self.received) + self.published.saturating_sub(self.consumed)
    }

    pub(super) fn to_json(self) -> Value {
        let Tally { published_inputs, received, published, consumed } = self;
        json!({
            "said": published_inputs,
            "heard": received,
            "published": published,
            "consumed": consumed,
            "lost": self.lost(),
        })
    }
}

/// The results at one rate.
#[derive(Clone, Debug)]
pub(super) struct Throughput {
    pub(super) kind: Kind,
    /// The rate asked for, and the rate reached, messages a second.
    pub(super) wanted: f64,
    pub(super) input_rate: f64,
    pub(super) tally: Tally,
    /// Duration of publishing; processor time of the instance and of the middleware's server meanwhile; seconds.
    pub(super) seconds: f64,
    pub(super) instance_seconds: f64,
    pub(super) server_seconds: f64,
}

impl Throughput {
    /// Whether the publisher has kept its pace.
    pub(super) fn is_reached(&self) -> bool {
        self.input_rate > 0.97 * self.wanted
    }

    /// Cores that the instance keeps busy.
    pub(super) fn cores(&self) -> f64 {
        self.instance_seconds / self.seconds
    }

    /// Processor time for one message and all that follows from it, seconds.
    pub(super) fn each_s(&self) -> f64 {
        self.instance_seconds / self.tally.received as f64
    }

    pub(super) fn to_json(&self) -> Value {
        json!({
            "part": "throughput",
            "bus": self.kind.name(),
            "wanted_per_s": self.wanted,
            "said_per_s": self.input_rate,
            "messages": self.tally.to_json(),
            "cores": self.cores(),
            "each_s": self.each_s(),
            "server_cores": self.server_seconds / self.seconds,
        })
    }
}

/// Raises the rate until messages are lost or the publisher cannot keep its pace.
///
/// # Errors
/// When the middleware or a process does not work.
pub(super) fn climb(middleware: &Middleware, seconds: f64) -> anyhow::Result<Vec<Throughput>> {
    let mut steps = Vec::new();
    for rate in LADDER {
        let step = measure(middleware, f64::from(rate), seconds)?;
        let is_last = step.tally.lost() > 0 || !step.is_reached();
        steps.push(step);
        if is_last {
            break;
        }
    }
    Ok(steps)
}

/// One rate for so many seconds.
///
/// # Errors
/// As [`climb`].
pub(super) fn measure(middleware: &Middleware, rate: f64, seconds: f64) -> anyhow::Result<Throughput> {
    let plan = Plan::calm(PLAN.0, PLAN.1);
    let at_most = Duration::from_secs_f64(seconds + 60.0);
    let subject =
        Subject::start(middleware, &plan, Manner { at_most_once: true, on_one_core: true, at_most })?;
    let subscriber = Subscriber::new(middleware, "bench-consumer", true, plan.needs(), (), |(), _, _| ())?;
    let mut publishers = Publishers::new(Publisher::new(middleware, "bench-publisher", true)?, plan);
    connected(&mut publishers, &subject, &subscriber)?;
    publishers.publish_for(rate.min(10_000.0), WARM_UP)?;
    let before = settled(&publishers, &subject, &subscriber)?;
    let server = || middleware.server().map_or(0.0, |id| seconds_of(&id.to_string()));
    let (began, instance_began, server_began) = (Instant::now(), subject.processor_seconds(), server());
    publishers.publish_for(rate, Duration::from_secs_f64(seconds))?;
    let seconds = began.elapsed().as_secs_f64();
    let tally = settled(&publishers, &subject, &subscriber)?.since(before);
    let instance_seconds = subject.processor_seconds() - instance_began;
    let server_seconds = server() - server_began;
    subscriber.end()?;
    if let Some(trouble) = publishers.publisher.troubles().first() {
        crate::notice(&format!("warning: the publisher: {trouble}"));
    }
    Ok(Throughput {
        kind: middleware.kind,
        wanted: rate,
        input_rate: tally.published_inputs as f64 / seconds,
        tally,
        seconds,
        instance_seconds,
        server_seconds,
    })
}

/// Waits until messages of every signal reach the consumer.
///
/// # Errors
/// When they do not arrive in time.
pub(super) fn connected<S>(
    publishers: &mut Publishers,
    subject: &Subject,
    subscriber: &Subscriber<S>,
) -> anyhow::Result<()> {
    let end = Instant::now() + PATIENCE;
    while Instant::now() < end {
        let before = settled(publishers, subject, subscriber)?;
        publishers.once()?;
        thread::sleep(Duration::from_millis(100));
        let round = settled(publishers, subject, subscriber)?.since(before);
        if round.lost() == 0 && round.consumed > 0 {
            return Ok(());
        }
    }
    bail!("the instance does not hear everything")
}

/// The counts once no message is on its way any more.
pub(super) fn settled<S>(
    publishers: &Publishers,
    subject: &Subject,
    subscriber: &Subscriber<S>,
) -> anyhow::Result<Tally> {
    let end = Instant::now() + ON_THE_WAY;
    let mut before = Tally::now(publishers, subject, subscriber)?;
    loop {
        thread::sleep(STILL);
        let now = Tally::now(publishers, subject, subscriber)?;
        if now == before || Instant::now() > end {
            return Ok(now);
        }
        before = now;
    }
}

/// Publishers of all signals of a plan, which publish in turn.
pub(super) struct Publishers {
    pub(super) publisher: Publisher,
    topics: Vec<String>,
    /// The signal whose turn it is.
    next: usize,
    pub(super) published_inputs: u64,
}

impl Publishers {
    pub(super) fn new(publisher: Publisher, plan: Plan) -> Publishers {
        let topics = plan.all().map(|(variable, signal)| topic(variable, signal)).collect();
        Publishers { publisher, topics, next: 0, published_inputs: 0 }
    }

    /// Publishes at this rate for this long. Late messages are published later, not left out.
    ///
    /// # Errors
    /// When a message cannot be sent.
    pub(super) fn publish_for(&mut self, rate: f64, for_so_long: Duration) -> anyhow::Result<()> {
        let mut beat = Beat::new(PERIOD);
        let (mut owed, each) = (0.0, rate * PERIOD.as_secs_f64());
        for _ in 0..for_so_long.as_millis() {
            beat.wait();
            owed += each;
            while owed >= 1.0 {
                owed -= 1.0;
                self.publish_next()?;
            }
        }
        Ok(())
    }

    /// Publishes one value of every signal.
    fn once(&mut self) -> anyhow::Result<()> {
        (0..self.topics.len()).try_for_each(|_| self.publish_next())
    }

    fn publish_next(&mut self) -> anyhow::Result<()> {
        let now = self.publisher.now();
        if let Some(topic) = self.topics.get(self.next) {
            self.publisher.publish_next(topic, value(now))?;
            self.published_inputs += 1;
        }
        self.next = (self.next + 1) % self.topics.len().max(1);
        Ok(())
    }
}
