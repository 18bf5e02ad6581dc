//! How many objects each sensor sees, as a mean over a time.

use shsa_core::time::{Span, Time};
use std::collections::VecDeque;

/// The most counts that are kept: a mean over a longer time than that of so many is a mean over these.
const KEPT_MAX: usize = 1_024;

/// The latest counts of all sensors.
#[derive(Clone, Debug, Default)]
pub(super) struct Counts {
    kept: VecDeque<(Time, Vec<Option<u32>>)>,
}

impl Counts {
    /// Takes the counts of a moment in, `None` for a silent sensor; returns the means over the latest moments, with none for a sensor that
    /// is silent now.
    pub(super) fn take(&mut self, at: Time, now: Vec<Option<u32>>, over: Span) -> Vec<Option<f64>> {
        let is_silent: Vec<bool> = now.iter().map(Option::is_none).collect();
        self.kept.push_back((at, now));
        while self.kept.len() > KEPT_MAX
            || self.kept.front().is_some_and(|(first, _)| at - *first >= over && *first < at)
        {
            self.kept.pop_front();
        }
        is_silent
            .into_iter()
            .enumerate()
            .map(|(sensor, is_silent)| if is_silent { None } else { self.mean(sensor) })
            .collect()
    }

    fn mean(&self, sensor: usize) -> Option<f64> {
        let known = || self.kept.iter().filter_map(|(_, counts)| counts.get(sensor).copied().flatten());
        let sum: f64 = known().map(f64::from).sum();
        let count = known().count();
        (count > 0).then(|| sum / count as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_is_a_mean_over_the_latest_time() {
        let mut counts = Counts::default();
        let mut take = |at_ms: i64, one: Option<u32>| {
            let means = counts.take(Time(at_ms * 1_000_000), vec![one, Some(1)], Span::from_millis(200));
            assert_eq!(means[1], Some(1.0));
            means[0]
        };
        assert_eq!(take(0, Some(2)), Some(2.0));
        assert_eq!(take(100, Some(4)), Some(3.0));
        assert_eq!(take(200, Some(8)), Some(6.0));
        assert_eq!(take(300, None), None);
        assert_eq!(take(400, Some(1)), Some(1.0));
    }
}
