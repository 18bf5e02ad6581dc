//! What open pages cost the gate: the delay of one signal at 1 kHz with and without readers of the page's stream, in turns within one run.

use super::gate::TURN;
use super::middleware::{Kind, Middleware};
use super::model::{Plan, need, topic, value};
use super::subject::{Manner, Subject};
use super::times::{Quantiles, Times};
use super::traffic::{Beat, Publisher, Subscriber};
use anyhow::Context;
use serde_json::{Value, json};
use shsa_bridge::{Message, Quality};
use shsa_core::time::Time;
use shsa_format::text::seconds;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// How many pages are open in every second turn.
const PAGES: usize = 5;
/// Between two messages.
const PERIOD: Duration = Duration::from_millis(1);
/// Messages at the beginning of a turn that are not counted: pages have just been opened or closed.
const SETTLING: u32 = 100;

/// The columns of the table.
pub(super) const HEAD: [&str; 6] = ["bus", "pages", "without a page", "with them", "ratio", "read by them"];

/// The results.
pub(super) struct Pages {
    kind: Kind,
    /// Without a page, and with [`PAGES`].
    delays: [Quantiles; 2],
    /// Messages counted in each.
    counts: [u64; 2],
    /// What the pages have received, bytes a second.
    read_bytes_per_s: f64,
}

impl Pages {
    /// How many times the delay without a page: median and 99th percentile.
    fn ratios(&self) -> [f64; 2] {
        let [without, with] = self.delays;
        [with.p50 / without.p50, with.p99 / without.p99]
    }

    /// A row of the table.
    pub(super) fn row(&self) -> Vec<String> {
        let [p50, p99] = self.ratios();
        let both = |of: Quantiles| format!("{} / {}", seconds(of.p50), seconds(of.p99));
        let [without, with] = self.delays;
        vec![
            self.kind.name().to_owned(),
            PAGES.to_string(),
            both(without),
            both(with),
            format!("{p50:.2} / {p99:.2}"),
            format!("{:.0} kB/s", self.read_bytes_per_s / 1e3),
        ]
    }

    pub(super) fn to_json(&self) -> Value {
        let [p50, p99] = self.ratios();
        json!({
            "part": "pages",
            "bus": self.kind.name(),
            "pages": PAGES,
            "without": { "count": self.counts[0], "all": self.delays[0].to_json() },
            "with": { "count": self.counts[1], "all": self.delays[1].to_json() },
            "ratio_p50": p50,
            "ratio_p99": p99,
            "read_bytes_per_s": self.read_bytes_per_s,
        })
    }
}

/// A reader of the page's stream; it ends with this value.
struct Reader {
    stream: TcpStream,
    thread: Option<JoinHandle<u64>>,
}

impl Reader {
    fn open(http: &str) -> anyhow::Result<Reader> {
        let mut stream = TcpStream::connect(http).context("opening a page")?;
        write!(stream, "GET /changes HTTP/1.1\r\nHost: {http}\r\n\r\n")?;
        let mut reading = stream.try_clone()?;
        let thread = thread::spawn(move || {
            let (mut buffer, mut bytes) = (vec![0; 1 << 16], 0);
            while let Ok(count @ 1..) = reading.read(&mut buffer) {
                bytes += count as u64;
            }
            bytes
        });
        Ok(Reader { stream, thread: Some(thread) })
    }

    /// Closes the page; returns the bytes that it has received.
    fn close(mut self) -> u64 {
        let _closed = self.stream.shutdown(Shutdown::Both);
        self.thread.take().and_then(|thread| thread.join().ok()).unwrap_or(0)
    }
}

/// The delays of messages: when each was published, and how long it took.
type Delays = Vec<(Time, Time)>;

/// Measures for so many seconds.
///
/// # Errors
/// When the middleware or a process does not work.
pub(super) fn measure(middleware: &Middleware, seconds: f64) -> anyhow::Result<Pages> {
    let plan = Plan::calm(1, 3);
    let at_most = Duration::from_secs_f64(seconds * 2.0 + 60.0);
    let subject =
        Subject::start(middleware, &plan, Manner { at_most_once: false, on_one_core: false, at_most })?;
    let http = subject.http().context("pages are measured over MQTT or Zenoh")?.to_owned();
    let take = |delays: &mut Delays, message: &Message, now: Time| {
        if message.quality != Some(Quality::Substitute) {
            delays.extend(message.stamp.map(|stamp| (stamp, now)));
        }
    };
    let subscriber = Subscriber::new(middleware, "bench-consumer", false, [need(0)], Delays::new(), take)?;
    let mut publisher = Publisher::new(middleware, "bench-publisher", false)?;
    // Until the instance has found that its signals agree.
    turn(&mut publisher, 2 * TURN)?;
    let (mut begins, mut bytes) = (Vec::new(), 0);
    let rounds = (seconds / (2.0 * f64::from(TURN) * PERIOD.as_secs_f64())).ceil().max(1.0) as u32;
    for _ in 0..rounds {
        for pages in [0, PAGES] {
            let readers = (0..pages).map(|_| Reader::open(&http)).collect::<anyhow::Result<Vec<_>>>()?;
            turn(&mut publisher, SETTLING)?;
            begins.push((publisher.now(), pages > 0));
            turn(&mut publisher, TURN)?;
            begins.push((publisher.now(), false));
            bytes += readers.into_iter().map(Reader::close).sum::<u64>();
        }
    }
    thread::sleep(Duration::from_millis(500));
    let times = sorted(&subscriber.end()?, &begins)?;
    let open_s = f64::from(rounds) * f64::from(TURN + SETTLING) * PERIOD.as_secs_f64();
    Ok(Pages {
        kind: middleware.kind,
        delays: [times[0].quantiles(), times[1].quantiles()],
        counts: [times[0].count(), times[1].count()],
        read_bytes_per_s: bytes as f64 / open_s,
    })
}

/// Publishes so many messages of the gate's signal, and of the others a tenth.
fn turn(publisher: &mut Publisher, count: u32) -> anyhow::Result<()> {
    let mut beat = Beat::new(PERIOD);
    for at in 0..count {
        beat.wait();
        for signal in 0..3 {
            if signal == 0 || at.is_multiple_of(10) {
                let now = publisher.now();
                publisher.publish_next(&topic(0, signal), value(now))?;
            }
        }
    }
    Ok(())
}

/// The delays in turns without and with pages. `begins` are the turns and the pauses between them, in pairs.
fn sorted(delays: &Delays, begins: &[(Time, bool)]) -> anyhow::Result<[Times; 2]> {
    let mut times = [Times::new()?, Times::new()?];
    for (sent, arrived) in delays {
        let at = begins.partition_point(|(begin, _)| begin <= sent);
        let is_turn = at % 2 == 1;
        let Some((_, is_open)) = at.checked_sub(1).and_then(|at| begins.get(at)).filter(|_| is_turn) else {
            continue;
        };
        times[usize::from(*is_open)].record(*arrived - *sent);
    }
    Ok(times)
}
