//! Series and stretches of bounded size. They keep the extremes, and every gap that a drawing shows.

use crate::bands::joined;
use shsa_core::interval::Interval;
use shsa_core::time::{Span, Time, Validity};
use shsa_drawing::Slice;

/// The most buckets of a series: more than a drawing has pixels.
const BUCKETS: usize = 1_024;
/// The first width of a bucket.
const FINEST: Span = Span::from_millis(1);
/// The most stretches that are kept.
const STRETCHES: usize = 1_024;

/// Intervals over time. When there are too many, every two neighbours are merged into one that contains both, so no extreme is
/// lost.
pub(in crate::replay) struct Thinned {
    from: Option<Time>,
    width: Span,
    /// The values in each width of time from the first one on; `None` if there is none.
    buckets: Vec<Option<Bucket>>,
}

/// The values in a stretch of time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bucket {
    first: Time,
    last: Time,
    low: f64,
    high: f64,
}

impl Bucket {
    fn and(self, other: Bucket) -> Bucket {
        Bucket {
            first: self.first.min(other.first),
            last: self.last.max(other.last),
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }
}

impl Thinned {
    pub(in crate::replay) fn new() -> Thinned {
        Thinned { from: None, width: FINEST, buckets: Vec::new() }
    }

    /// Takes in a value at a time. Amortised O(1).
    pub(in crate::replay) fn push(&mut self, at: Time, value: Interval) {
        let from = *self.from.get_or_insert(at);
        // A value from before the first bucket is counted in it.
        let since = (at - from).max(Span::ZERO);
        while since.0 / self.width.0 >= BUCKETS as i64 {
            self.halve();
        }
        let place = usize::try_from(since.0 / self.width.0).unwrap_or(0);
        if self.buckets.len() <= place {
            self.buckets.resize(place + 1, None);
        }
        let new = Bucket { first: at, last: at, low: value.lo(), high: value.hi() };
        if let Some(bucket) = self.buckets.get_mut(place) {
            *bucket = Some(bucket.map_or(new, |old| old.and(new)));
        }
    }

    fn halve(&mut self) {
        let pair = |pair: &[Option<Bucket>]| pair.iter().flatten().copied().reduce(Bucket::and);
        self.buckets = self.buckets.chunks(2).map(pair).collect();
        self.width = Span(self.width.0.saturating_mul(2));
    }

    pub(in crate::replay) fn is_empty(&self) -> bool {
        self.buckets.is_empty()
    }

    /// As slices of a drawing, at seconds since `origin`.
    pub(in crate::replay) fn slices(&self, origin: Time, shown: impl Fn(f64) -> f64) -> Vec<Slice> {
        let slice = |bucket: &Bucket| {
            let (low, high) = (shown(bucket.low), shown(bucket.high));
            let at = f64::midpoint((bucket.first - origin).seconds(), (bucket.last - origin).seconds());
            Slice { at, low: low.min(high), high: low.max(high) }
        };
        self.buckets.iter().flatten().map(slice).collect()
    }
}

/// Stretches of time. When there are too many, close ones are joined.
pub(in crate::replay) struct Stretches {
    all: Vec<Validity>,
    slack: Span,
}

impl Stretches {
    pub(in crate::replay) fn new() -> Stretches {
        Stretches { all: Vec::new(), slack: Span::ZERO }
    }

    pub(in crate::replay) fn push(&mut self, new: Validity) {
        match self.all.last_mut().filter(|last| last.from <= new.from && new.from <= last.to + self.slack) {
            Some(last) => last.to = last.to.max(new.to),
            None => self.all.push(new),
        }
        while self.all.len() > STRETCHES {
            let before = self.all.len();
            self.all = joined(std::mem::take(&mut self.all), self.slack);
            if self.all.len() > STRETCHES / 2 && before > STRETCHES {
                self.slack = Span(self.slack.0.saturating_mul(2).max(FINEST.0));
            }
        }
    }

    /// The stretches, disjoint and ascending.
    pub(in crate::replay) fn get(&self) -> Vec<Validity> {
        joined(self.all.clone(), self.slack)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(milliseconds: i64) -> Time {
        Time(milliseconds * 1_000_000)
    }

    #[test]
    fn a_long_series_stays_small_and_keeps_its_extremes() {
        let mut thinned = Thinned::new();
        for step in 0..300_000_i64 {
            let value = if step == 123_456 { 1e3 } else { (step % 7) as f64 };
            thinned.push(at(step * 10), Interval::point(value));
        }
        let slices = thinned.slices(at(0), |value| value);
        assert!(slices.len() > BUCKETS / 2 && slices.len() <= BUCKETS, "{}", slices.len());
        let peak: Vec<&Slice> = slices.iter().filter(|slice| slice.high == 1e3).collect();
        let [peak] = peak.as_slice() else { panic!("{peak:?}") };
        assert!((peak.at - 1_234.56).abs() < 3.0 && peak.low == 0.0, "{peak:?}");
        assert!(slices.iter().all(|slice| slice.low == 0.0 && slice.high >= 6.0));
    }

    #[test]
    fn a_gap_of_a_series_stays_one() {
        let mut thinned = Thinned::new();
        for step in (0..50_000).chain(100_000..150_000) {
            thinned.push(at(step), Interval::point(1.0));
        }
        let slices = thinned.slices(at(0), |value| value);
        assert!(slices.iter().all(|slice| slice.at < 50.1 || slice.at > 99.9));
    }

    #[test]
    fn many_stretches_become_few_that_cover_them_all() {
        let mut stretches = Stretches::new();
        let all: Vec<Validity> =
            (0..20_000).map(|n| Validity { from: at(n * 20), to: at(n * 20 + 5) }).collect();
        all.iter().for_each(|each| stretches.push(*each));
        let joined = stretches.get();
        assert!(joined.len() <= STRETCHES, "{}", joined.len());
        let is_covered = |each: &Validity| joined.iter().any(|it| it.from <= each.from && each.to <= it.to);
        assert!(all.iter().all(is_covered));
    }
}
