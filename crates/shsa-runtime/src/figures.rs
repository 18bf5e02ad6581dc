//! Counts and times of a run.

use crate::error::{RuntimeError, unfit};
use hdrhistogram::Histogram;
use serde_json::{Value, json};
use shsa_core::engine::EventKind;
use shsa_core::time::Span;

/// The longest time that the histograms resolve, nanoseconds: a minute.
pub(super) const LONGEST: u64 = 60_000_000_000;

/// Counts and times since the start.
#[derive(Debug)]
pub(super) struct Figures {
    /// Messages received.
    pub(super) messages: u64,
    /// Values published.
    pub(super) publications: u64,
    /// Decisions, by [`EventKind::ALL`].
    pub(super) events: [u64; EventKind::ALL.len()],
    /// From the reception of the message that caused a value until the value was handed to the middleware, nanoseconds.
    pub(super) latency: Histogram<u64>,
    /// The time to handle one message and all that follows from it, nanoseconds.
    pub(super) work: Histogram<u64>,
    /// How often the connection was lost.
    pub(super) disconnections: u64,
    /// The total time without connection.
    pub(super) disconnected: Span,
}

impl Figures {
    /// # Errors
    /// Never: the bounds of the histograms are valid.
    pub(super) fn new() -> Result<Figures, RuntimeError> {
        Ok(Figures {
            messages: 0,
            publications: 0,
            events: [0; EventKind::ALL.len()],
            latency: histogram()?,
            work: histogram()?,
            disconnections: 0,
            disconnected: Span::ZERO,
        })
    }

    /// Counts a decision of this kind.
    pub(super) fn decided(&mut self, kind: EventKind) {
        let known = EventKind::ALL.iter().zip(&mut self.events).filter(|(other, _)| **other == kind);
        known.for_each(|(_, count)| *count += 1);
    }

    /// Counts a value, published this long after the message that caused it.
    pub(super) fn served(&mut self, after: Span) {
        self.publications += 1;
        record(&mut self.latency, after);
    }

    /// Counts a message and its handling time.
    pub(super) fn count_message(&mut self, took: Span) {
        self.messages += 1;
        record(&mut self.work, took);
    }

    /// The figures for the state.
    pub(super) fn json(&self) -> Value {
        let events = EventKind::ALL
            .iter()
            .zip(self.events)
            .map(|(kind, count)| (kind.name().to_owned(), json!(count)));
        json!({
            "messages": self.messages,
            "publications": self.publications,
            "events": Value::Object(events.collect()),
            "disconnections": self.disconnections,
            "disconnected_s": self.disconnected.seconds(),
            "latency_us": times(&self.latency),
            "work_us": times(&self.work),
        })
    }
}

/// A histogram of times up to a minute, in nanoseconds, to two digits.
///
/// # Errors
/// Never: the bounds are valid.
pub(super) fn histogram() -> Result<Histogram<u64>, RuntimeError> {
    Histogram::new_with_bounds(1, LONGEST, 2).map_err(unfit)
}

fn record(histogram: &mut Histogram<u64>, span: Span) {
    histogram.saturating_record(u64::try_from(span.0).unwrap_or(0).max(1));
}

/// Median, 99th percentile and worst of a histogram in nanoseconds, as microseconds.
pub(super) fn times(histogram: &Histogram<u64>) -> Value {
    let microseconds = |nanoseconds: u64| nanoseconds as f64 / 1e3;
    json!({
        "p50": microseconds(histogram.value_at_quantile(0.5)),
        "p99": microseconds(histogram.value_at_quantile(0.99)),
        "worst": microseconds(histogram.max()),
    })
}
