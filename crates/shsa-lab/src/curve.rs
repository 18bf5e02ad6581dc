//! The values at some moments, interpolated at any other.

use crate::order::median;

/// Straight lines between values.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    times: Vec<f64>,
    values: Vec<f64>,
    /// The integral up to each time.
    sums: Vec<f64>,
    /// The median time between two values.
    period_s: f64,
    /// Where sessions meet, in order: nothing is known between the last value before and the first one after such a time.
    joints: Vec<f64>,
}

impl Curve {
    /// Of times in seconds, in any order, and values.
    pub(crate) fn new(mut points: Vec<(f64, f64)>) -> Curve {
        points.sort_by(|one, other| one.0.total_cmp(&other.0));
        points.dedup_by_key(|point| point.0);
        let mut sum = 0.0;
        let mut sums = vec![0.0];
        for pair in points.windows(2) {
            sum += 0.5 * (pair[0].1 + pair[1].1) * (pair[1].0 - pair[0].0);
            sums.push(sum);
        }
        let period_s = median(points.windows(2).map(|pair| pair[1].0 - pair[0].0));
        let (times, values) = points.into_iter().unzip();
        Curve { times, values, sums, period_s, joints: Vec::new() }
    }

    /// Of sessions that meet at these times, in order.
    pub(crate) fn of_sessions(points: Vec<(f64, f64)>, joints: &[f64]) -> Curve {
        Curve { joints: joints.to_vec(), ..Curve::new(points) }
    }

    /// Whether both times are in one session. Time: O(log sessions).
    fn is_whole(&self, from: f64, to: f64) -> bool {
        self.joints.is_empty() || self.session(from) == self.session(to)
    }

    fn session(&self, time: f64) -> usize {
        self.joints.partition_point(|joint| *joint <= time)
    }

    /// What follows it with a time constant above 0, in seconds, from rest in each session. Time: O(n).
    pub(crate) fn followed(&self, tau_s: f64) -> Curve {
        let (mut last, mut before) = (self.values.first().copied().unwrap_or(0.0), None::<(f64, f64)>);
        let mut follow = |(time, value): (f64, f64)| {
            let earlier = before.replace((time, value));
            if earlier.is_some_and(|(start, _)| !self.is_whole(start, time)) {
                last = value;
            } else if let Some((start, earlier)) = earlier {
                let kept = (-(time - start) / tau_s).exp();
                // The exact answer to a line from one value to the next.
                let slope = (value - earlier) / (time - start);
                last = kept * (last - earlier + slope * tau_s) + value - slope * tau_s;
            }
            (time, last)
        };
        let points = self.times.iter().copied().zip(self.values.iter().copied()).map(&mut follow).collect();
        Curve::of_sessions(points, &self.joints)
    }

    /// The median time between two values, in seconds.
    pub(crate) fn period_s(&self) -> f64 {
        self.period_s
    }

    /// When values are known, in the order of time.
    pub(crate) fn times(&self) -> &[f64] {
        &self.times
    }

    /// The values at these times.
    pub(crate) fn values(&self) -> &[f64] {
        &self.values
    }

    /// The place of the first value that is not before a time. Time: O(log n); constant where values come evenly.
    fn first_from(&self, time: f64) -> usize {
        let is_before = |place: usize| self.times.get(place).is_some_and(|it| *it < time);
        let guess = self.times.first().map_or(0.0, |start| ((time - start) / self.period_s).ceil());
        // As an integer, a guess that is not a number is 0, and one below 0, too.
        let guess = guess as usize;
        let near = guess.saturating_sub(1)..guess.saturating_add(2).min(self.times.len());
        let is_it = |place: &usize| !is_before(*place) && (*place == 0 || is_before(place - 1));
        near.into_iter().find(is_it).unwrap_or_else(|| self.times.partition_point(|it| *it < time))
    }

    /// The value, and the integral up to there; `None` outside of what is known. Time: O(log n).
    pub(crate) fn read(&self, time: f64) -> Option<(f64, f64)> {
        let after = self.first_from(time);
        let end = *self.times.get(after)?;
        let before = if end == time { after } else { after.checked_sub(1)? };
        let (start, value) = (self.times[before], self.values[before]);
        if !self.is_whole(start, end) {
            return None;
        }
        let share = if end > start { (time - start) / (end - start) } else { 0.0 };
        let here = value + share * (self.values[after] - value);
        Some((here, self.sums[before] + 0.5 * (value + here) * (time - start)))
    }

    /// The value at this time before a moment, or after it where it is below 0; `None` also where that is in another session.
    pub(crate) fn before(&self, time: f64, lag_s: f64) -> Option<f64> {
        self.is_whole(time - lag_s, time).then(|| self.read(time - lag_s))?.map(|it| it.0)
    }

    /// The time between the values around a moment; `None` outside of what is known.
    pub(crate) fn gap_s(&self, time: f64) -> Option<f64> {
        let after = self.first_from(time);
        let end = *self.times.get(after)?;
        if end == time { Some(0.0) } else { Some(end - self.times[after.checked_sub(1)?]) }
    }

    /// The value of the nearest moment, for what takes steps.
    pub(crate) fn nearest(&self, time: f64) -> Option<f64> {
        let after = self.first_from(time);
        let end = *self.times.get(after)?;
        let before = if end == time { after } else { after.checked_sub(1)? };
        let is_after = end - time < time - self.times[before];
        Some(self.values[if is_after { after } else { before }])
    }

    /// The value at a moment, or its mean where the moment is long.
    pub(crate) fn at(&self, from: f64, to: f64) -> Option<f64> {
        let (value, end) = self.read(to).filter(|_| self.is_whole(from, to))?;
        if to - from < 1e-9 {
            return Some(value);
        }
        Some((end - self.read(from)?.1) / (to - from))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_place_is_found_by_its_rhythm_as_by_halving(
            steps in prop::collection::vec(prop_oneof![4 => Just(0.1), 1 => 0.01..3.0_f64], 0..40),
            time in -1.0..12.0_f64, place in 0_usize..40,
        ) {
            let mut at = 0.0;
            let points = steps.iter().map(|step| { at += step; (at, at) }).collect();
            let curve = Curve::new(points);
            for time in [time, curve.times.get(place).copied().unwrap_or(time), f64::NAN] {
                prop_assert_eq!(curve.first_from(time), curve.times.partition_point(|it| *it < time));
            }
        }
    }
}
