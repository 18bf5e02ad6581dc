//! A long run at an even rate: measures whether memory grows, messages are lost, or latency drifts.

use super::browser::{Browser, PageMemory};
use super::middleware::{Kind, Middleware};
use super::model::Plan;
use super::subject::{Manner, Subject};
use super::throughput::{PLAN, Publishers, Tally, connected, settled};
use super::times::{Quantiles, Times};
use super::traffic::{Publisher, Subscriber};
use anyhow::Context;
use serde_json::{Value, json};
use shsa_bridge::Message;
use shsa_core::time::Time;
use std::path::Path;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// A run is divided into this many windows: minutes of an hour.
const WINDOWS: usize = 60;
/// The variables, and the signals of each, of a run with the page open: 200 signals.
const WITH_A_PAGE: (usize, usize) = (20, 10);
/// The share of the run in which memory still grows to its working size.
const WARM_UP: f64 = 0.1;

/// The results of a run.
pub(super) struct Soak {
    pub(super) kind: Kind,
    pub(super) seconds: f64,
    pub(super) rate: f64,
    pub(super) tally: Tally,
    pub(super) decisions: u64,
    /// Cores that the instance kept busy.
    pub(super) cores: f64,
    pub(super) windows: Vec<Window>,
    /// The memory of the page, where one was open.
    pub(super) page: Option<PageMemory>,
}

/// A part of the run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// The middle of the window, seconds from the beginning of the run.
    pub(super) at: f64,
    /// Mean memory of its own, bytes.
    pub(super) memory: f64,
    /// From the publisher through the instance to the consumer.
    pub(super) latency: Quantiles,
}

/// A straight line through points, by least squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slope {
    /// Per second.
    pub(super) slope: f64,
    /// Half the width of its 95 % confidence interval.
    pub(super) half: f64,
}

impl Soak {
    /// The windows after the warm-up.
    pub(super) fn warm(&self) -> impl Iterator<Item = &Window> + Clone {
        self.windows.iter().filter(|window| window.at >= WARM_UP * self.seconds)
    }

    /// The trend of a figure over the windows after the warm-up.
    pub(super) fn slope(&self, figure: impl Fn(&Window) -> f64) -> Slope {
        let points: Vec<(f64, f64)> = self.warm().map(|window| (window.at, figure(window))).collect();
        Slope::through(&points)
    }

    /// Whether a figure grows: significantly, and over the whole run by more than 2 % of its mean.
    pub(super) fn grows(&self, figure: impl Fn(&Window) -> f64) -> bool {
        let warm: Vec<f64> = self.warm().map(&figure).collect();
        let mean = warm.iter().sum::<f64>() / warm.len() as f64;
        let slope = self.slope(figure);
        !slope.may_be_flat() && slope.slope * self.seconds > mean / 50.0
    }

    pub(super) fn to_json(&self) -> Value {
        let slope = |Slope { slope, half }: Slope| json!({ "per_hour": slope * 3_600.0, "confidence_95": half * 3_600.0 });
        let window = |window: &Window| json!({ "at_s": window.at, "memory_bytes": window.memory, "latency": window.latency.to_json() });
        json!({
            "part": "soak",
            "bus": self.kind.name(),
            "seconds": self.seconds,
            "rate_per_s": self.rate,
            "messages": self.tally.to_json(),
            "decisions": self.decisions,
            "cores": self.cores,
            "memory_slope_bytes": slope(self.slope(|window| window.memory)),
            "p50_slope_s": slope(self.slope(|window| window.latency.p50)),
            "p99_slope_s": slope(self.slope(|window| window.latency.p99)),
            "page": self.page.as_ref().map(PageMemory::to_json),
            "windows": self.windows.iter().map(window).collect::<Vec<_>>(),
        })
    }
}

impl Slope {
    /// Least squares; the interval assumes independent points with normal errors (two standard errors).
    pub(super) fn through(points: &[(f64, f64)]) -> Slope {
        let count = points.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
        let (x, y) = (mean(|point| point.0), mean(|point| point.1));
        let spread: f64 = points.iter().map(|point| (point.0 - x).powi(2)).sum();
        let slope = points.iter().map(|point| (point.0 - x) * (point.1 - y)).sum::<f64>() / spread;
        let left: f64 = points.iter().map(|point| (point.1 - y - slope * (point.0 - x)).powi(2)).sum();
        Slope { slope, half: 2.0 * (left / (count - 2.0).max(1.0) / spread).sqrt() }
    }

    /// Whether the slope may be zero or negative.
    pub(super) fn may_be_flat(self) -> bool {
        self.slope - self.half <= 0.0
    }
}

/// The latencies seen by the consumer, by window.
struct Arrivals {
    /// The time at which the run began; messages stamped before it only test the connection.
    began: Arc<OnceLock<Time>>,
    /// The length of a window in seconds.
    width: f64,
    times: Vec<Times>,
}

impl Arrivals {
    fn take(&mut self, message: &Message, now: Time) {
        let Some(stamp) = message.stamp else { return };
        let Some(since) =
            self.began.get().map(|began| (stamp - *began).seconds()).filter(|since| *since >= 0.0)
        else {
            return;
        };
        if let Some(times) = self.times.get_mut((since / self.width) as usize) {
            times.record(now - stamp);
        }
    }
}

/// Runs for `seconds` at this rate; with `python`, the page is open in a browser, and there are 200 signals.
///
/// # Errors
/// When the middleware or a process does not work.
pub(super) fn measure(
    middleware: &Middleware,
    seconds: f64,
    rate: f64,
    python: Option<&Path>,
) -> anyhow::Result<Soak> {
    let (variables, signals) = if python.is_some() { WITH_A_PAGE } else { PLAN };
    let plan = Plan::calm(variables, signals);
    let at_most = Duration::from_secs_f64(seconds * 1.2 + 120.0);
    let subject =
        Subject::start(middleware, &plan, Manner { at_most_once: false, on_one_core: false, at_most })?;
    let windows = (seconds as usize).clamp(2, WINDOWS);
    let width = seconds / windows as f64;
    let times = (0..windows).map(|_| Times::new()).collect::<anyhow::Result<Vec<_>>>()?;
    let begin = Arc::new(OnceLock::new());
    let arrivals = Arrivals { began: begin.clone(), width, times };
    let subscriber =
        Subscriber::new(middleware, "bench-consumer", false, plan.needs(), arrivals, Arrivals::take)?;
    let mut publishers = Publishers::new(Publisher::new(middleware, "bench-publisher", false)?, plan);
    connected(&mut publishers, &subject, &subscriber)?;
    let before = settled(&publishers, &subject, &subscriber)?;
    let browser = python.map(|python| {
        let http = subject.http().context("an instance in memory has no page")?;
        Browser::open(python, middleware, http)
    });
    let browser = browser.transpose()?;
    let processor_began = subject.processor_seconds();
    let began = *begin.get_or_init(|| middleware.clock.now());
    let mut memory = Vec::with_capacity(windows);
    for window in 0..windows {
        // A few readings of the memory in each window.
        let looks = (width.ceil() as u32).clamp(1, 10);
        let mut sum = 0.0;
        for _ in 0..looks {
            publishers.publish_for(rate, Duration::from_secs_f64(width / f64::from(looks)))?;
            sum += subject.memory_bytes();
        }
        memory.push(sum / f64::from(looks));
        if window % (windows / 10).max(1) == 0 {
            crate::notice(&format!("{:.0} of {seconds:.0} s ...", width * (window + 1) as f64));
        }
    }
    let cores = (subject.processor_seconds() - processor_began) / (middleware.clock.now() - began).seconds();
    let page = browser.map(Browser::close).transpose()?;
    let tally = settled(&publishers, &subject, &subscriber)?.since(before);
    let state = subject.state()?;
    let arrivals = subscriber.end()?;
    let decisions = state.pointer("/figures/events").and_then(Value::as_object);
    let window = |(at, (memory, times)): (usize, (&f64, &Times))| Window {
        at: (at as f64 + 0.5) * width,
        memory: *memory,
        latency: times.quantiles(),
    };
    Ok(Soak {
        kind: middleware.kind,
        seconds,
        rate,
        tally,
        decisions: decisions.map_or(0, |kinds| kinds.values().filter_map(Value::as_u64).sum()),
        cores,
        windows: memory.iter().zip(&arrivals.times).enumerate().map(window).collect(),
        page,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_its_slope_and_no_doubt() {
        let points: Vec<(f64, f64)> = (0..10).map(|at| (f64::from(at), 3.0 * f64::from(at) + 1.0)).collect();
        let Slope { slope, half } = Slope::through(&points);
        assert!((slope - 3.0).abs() < 1e-9 && half < 1e-6);
        assert!(!Slope { slope, half }.may_be_flat());
    }

    #[test]
    fn what_only_scatters_may_be_flat() {
        let points: Vec<(f64, f64)> = (0..20).map(|at| (f64::from(at), f64::from(at * 7 % 5))).collect();
        let found = Slope::through(&points);
        assert!(found.may_be_flat() && found.slope + found.half >= 0.0, "{found:?}");
    }
}
