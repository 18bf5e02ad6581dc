//! The sessions of a series: each has parts of its own, so none is one alone that a part has seen, and their order does not matter.

use crate::curve::Curve;

/// The durations of windows and delays are shares of the whole duration, of at most so many times the longest session: they lie within
/// a session.
const MOST_SESSIONS: f64 = 5.0;

/// A moment within its session.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) session: usize,
    /// The share of the session that has passed.
    pub(crate) share: f64,
}

/// The sessions of some signals.
#[derive(Debug)]
pub(crate) struct Sessions {
    /// A time between each two sessions, in order.
    joints: Vec<f64>,
    /// The first and the last moment of each.
    extents: Vec<(f64, f64)>,
}

impl Sessions {
    /// Time: O(curves * sessions * log n).
    pub(crate) fn new(curves: &[Curve], joints: &[f64]) -> Sessions {
        let mut extents = vec![(f64::INFINITY, f64::NEG_INFINITY); joints.len() + 1];
        for times in curves.iter().map(Curve::times) {
            let ends = joints.iter().map(|joint| times.partition_point(|it| it < joint));
            let mut from = 0;
            for (to, extent) in ends.chain([times.len()]).zip(&mut extents) {
                if let [first, .., last] | [first @ last] = &times[from..to] {
                    *extent = (extent.0.min(*first), extent.1.max(*last));
                }
                from = to;
            }
        }
        Sessions { joints: joints.to_vec(), extents }
    }

    /// The time of all sessions in seconds, without what lies between them.
    pub(crate) fn duration_s(&self) -> f64 {
        let each = || self.extents.iter().map(|it| (it.1 - it.0).max(0.0));
        each().sum::<f64>().min(MOST_SESSIONS * each().fold(0.0, f64::max))
    }

    pub(crate) fn place(&self, time: f64) -> Place {
        let session = self.joints.partition_point(|joint| *joint <= time);
        let (first, last) = self.extents[session];
        let share = if last > first { (time - first) / (last - first) } else { 0.0 };
        Place { session, share }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_lies_between_sessions_is_of_no_share(
            lengths in prop::collection::vec(1.0..500.0_f64, 1..5), gap in 0.5..50.0_f64, at in 0.0..1.0_f64, of in 0_usize..5,
        ) {
            let (mut begin, mut begins, mut joints, mut points) = (0.0, Vec::new(), Vec::new(), Vec::new());
            for length in &lengths {
                points.extend([(begin, 0.0), (begin + 0.4 * length, 1.0), (begin + length, 0.0)]);
                begins.push(begin);
                joints.push(begin + length + 0.5 * gap);
                begin += length + gap;
            }
            joints.pop();
            let sessions = Sessions::new(&[Curve::new(points)], &joints);
            let of = of % lengths.len();
            let place = sessions.place(begins[of] + at * lengths[of]);
            prop_assert_eq!(place.session, of);
            prop_assert!((place.share - at).abs() < 1e-6, "{place:?}");
            let longest = lengths.iter().copied().fold(0.0, f64::max);
            prop_assert!((sessions.duration_s() - lengths.iter().sum::<f64>().min(5.0 * longest)).abs() < 1e-6);
        }
    }
}
