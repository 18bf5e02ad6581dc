//! Fault-tolerant combination of several intervals, some of which are wrong.
//!
//! If f of n candidates are faulty, the truth lies in at least n - f intervals. The range from the smallest to the largest such
//! value is the fault-tolerant interval (K. Marzullo, "Tolerating failures of continuous-valued sensors", 1990,
//! doi:10.1145/128733.128735); of two candidates it is the hull of both.

use super::Interval;

/// How many intervals hold a value. Time: linear.
#[must_use]
pub fn holding(all: &[Interval], value: f64) -> usize {
    all.iter().filter(|it| it.lo() <= value && value <= it.hi()).count()
}

/// From the smallest to the largest value that lies in at least `count` of the intervals; `None` for none, or for a `count` of 0.
///
/// Time: the square of the number of intervals; allocates nothing.
#[must_use]
pub fn tolerant(all: &[Interval], count: usize) -> Option<Interval> {
    if count == 0 {
        return None;
    }
    // The number of intervals around a value grows only where one begins, and falls only where one ends.
    let is_held = |value: &f64| holding(all, *value) >= count;
    let lo = all.iter().map(|it| it.lo()).filter(is_held).reduce(f64::min)?;
    let hi = all.iter().map(|it| it.hi()).filter(is_held).reduce(f64::max)?;
    let value = Interval::new(lo, hi);
    value.is_bounded().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;
    use proptest::prelude::*;

    fn check(all: &[(f64, f64)], count: usize, expected: Option<(f64, f64)>) {
        let all: Vec<Interval> = all.iter().map(|(lo, hi)| Interval::new(*lo, *hi)).collect();
        assert_eq!(tolerant(&all, count).map(|value| (value.lo(), value.hi())), expected);
    }

    #[test]
    fn the_published_examples() {
        check(&[(8.0, 12.0), (11.0, 13.0), (14.0, 15.0)], 2, Some((11.0, 12.0)));
        check(&[(8.0, 12.0), (11.0, 13.0), (10.0, 12.0)], 2, Some((10.0, 12.0)));
        check(&[(0.0, 1.0), (5.0, 6.0)], 1, Some((0.0, 6.0)));
        check(&[(0.0, 1.0), (5.0, 6.0)], 2, None);
        check(&[(0.0, 1.0)], 0, None);
    }

    proptest! {
        /// The interval holds the truth while `count` intervals do, and is never wider than the hull of all.
        #[test]
        fn it_holds_the_truth_while_so_many_do(
            sound in prop::collection::vec((0.0..2.0_f64, 0.0..2.0_f64), 1..6),
            lies in prop::collection::vec((-9.0..9.0_f64, 0.0..2.0_f64), 0..6),
        ) {
            let sound = sound.iter().map(|(below, above)| Interval::new(-below, *above));
            let lies = lies.iter().map(|(lo, width)| Interval::new(*lo, lo + width));
            let count = sound.len();
            let all: Vec<Interval> = sound.chain(lies).collect();
            let value = tolerant(&all, count);
            prop_assert!(value.is_some_and(|value| value.contains(0.0)), "{value:?}");
            let hull = all.iter().fold(Interval::EMPTY, |hull, it| hull.hull(*it));
            prop_assert!(value.is_some_and(|value| hull.lo() <= value.lo() && value.hi() <= hull.hi()));
        }
    }
}
