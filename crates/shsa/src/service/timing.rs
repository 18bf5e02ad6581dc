//! When a service computes, and its execution times.

use hdrhistogram::Histogram;
use shsa_core::time::{Span, Time};
use shsa_runtime::execution_bound;
use std::fmt;
use std::time::Duration;

/// When a service computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pace {
    /// With each new value of any input, once all are known.
    Any,
    /// With each set of new values of all inputs.
    All,
    /// Periodically.
    Every(Span),
}

/// The periods of a service. Overdue periods are left out, so that the service never lags behind.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beat {
    period: Span,
    next: Time,
}

impl Beat {
    pub(super) fn new(period: Span, now: Time) -> Beat {
        Beat { period, next: now }
    }

    /// When the next period is due.
    pub(super) fn next(&self) -> Time {
        self.next
    }

    /// If a period is due, advances to the next one; returns how many periods were left out.
    pub(super) fn take(&mut self, now: Time) -> Option<u64> {
        if now < self.next {
            return None;
        }
        let missed = (now - self.next).0 / self.period.0.max(1);
        self.next = self.next + self.period.times(missed.saturating_add(1));
        Some(u64::try_from(missed).unwrap_or(0))
    }
}

/// The counts of a service.
#[derive(Clone, Debug)]
pub(super) struct Figures {
    /// Evaluations, and published messages.
    pub(super) evaluated: u64,
    pub(super) published: u64,
    /// Outputs without a value.
    pub(super) without: u64,
    /// Periods left out because the one before took too long.
    pub(super) shed: u64,
    /// Execution times in nanoseconds: from the values to the last published output.
    times: Histogram<u64>,
}

/// A longer execution counts as this, nanoseconds: a minute.
const LONGEST: u64 = 60_000_000_000;

impl Figures {
    /// # Errors
    /// When the bounds of the histogram are invalid.
    pub(super) fn new() -> anyhow::Result<Figures> {
        let times = Histogram::new_with_bounds(1, LONGEST, 2)?;
        Ok(Figures { evaluated: 0, published: 0, without: 0, shed: 0, times })
    }

    pub(super) fn took(&mut self, time: Duration) {
        self.evaluated += 1;
        self.times.saturating_record(u64::try_from(time.as_nanos()).unwrap_or(LONGEST).clamp(1, LONGEST));
    }

    /// The bound of execution times by measurement.
    pub(super) fn bound(&self) -> Option<Span> {
        execution_bound(&self.times).map(|bound| Span(i64::try_from(bound).unwrap_or(i64::MAX)))
    }

    /// The worst observed execution time.
    pub(super) fn worst(&self) -> Span {
        Span(i64::try_from(self.times.max()).unwrap_or(i64::MAX))
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Figures { evaluated, published, without, shed, times } = self;
        let bound = self
            .bound()
            .map(|bound| format!(", 99.9 % at most {:.1} us (95 % confidence)", bound.seconds() * 1e6));
        let us = |nanoseconds: u64| nanoseconds as f64 / 1e3;
        write!(
            f,
            "evaluated {evaluated}, published {published}, without a value {without}, shed {shed}; execution time \
             median {:.1} us, worst observed {:.1} us{}",
            us(times.value_at_quantile(0.5)),
            us(times.max()),
            bound.unwrap_or_default()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_overdue_is_left_out() {
        let mut beat = Beat::new(Span(10), Time(0));
        assert_eq!(beat.take(Time(0)), Some(0));
        assert_eq!((beat.take(Time(9)), beat.next()), (None, Time(10)));
        assert_eq!((beat.take(Time(12)), beat.next()), (Some(0), Time(20)));
        assert_eq!((beat.take(Time(55)), beat.next()), (Some(3), Time(60)));
        assert_eq!((beat.take(Time(60)), beat.next()), (Some(0), Time(70)));
    }

    #[test]
    fn the_worst_is_kept() {
        let mut figures = Figures::new().unwrap();
        [5, 1_000, 20].into_iter().for_each(|us| figures.took(Duration::from_micros(us)));
        assert!((figures.worst().seconds() - 1e-3).abs() < 2e-5, "{:?}", figures.worst());
        assert_eq!(figures.evaluated, 3);
    }
}
