//! Values that wrap, such as headings and phases: they repeat after a whole turn.
//!
//! A value on the circle is stored as a number on the line, unwrapped: shifted by whole turns to be nearest to a reference value.
//! Then histories, rates and means are those of numbers.

use crate::interval::Interval;

/// A value, shifted by whole turns so that its middle is nearest to that of another.
///
/// Two values overlap afterwards if their widths together are two turns or more, or if one is a whole turn wide. `turn` is above
/// 0. Rounded outward; empty values stay empty. O(1).
#[must_use]
pub fn nearest(value: Interval, beside: Interval, turn: f64) -> Interval {
    shifted(value, libm::round((beside.midpoint() - value.midpoint()) / turn), turn)
}

/// A value, shifted by whole turns so that its middle lies in the turn from `from` on.
#[must_use]
pub fn brought_back(value: Interval, from: f64, turn: f64) -> Interval {
    shifted(value, -libm::floor((value.midpoint() - from) / turn), turn)
}

fn shifted(value: Interval, turns: f64, turn: f64) -> Interval {
    if turns == 0.0 || !turns.is_finite() || value.is_empty() {
        return value;
    }
    value + Interval::point(turns) * Interval::point(turn)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn shifts_are_by_whole_turns() {
        let near = |value: f64, beside: f64| nearest(Interval::point(value), Interval::point(beside), 360.0);
        assert_eq!(near(1.0, 359.0), Interval::point(361.0));
        assert_eq!(near(359.0, 1.0), Interval::point(-1.0));
        assert_eq!(near(10.0, 20.0), Interval::point(10.0));
        assert_eq!(near(10.0, 3610.0), Interval::point(3610.0));
        let back = |value: f64, from: f64| brought_back(Interval::point(value), from, 360.0);
        assert_eq!(back(361.0, 0.0), Interval::point(1.0));
        assert_eq!(back(-1.0, 0.0), Interval::point(359.0));
        assert_eq!(back(181.0, -180.0), Interval::point(-179.0));
        assert_eq!(back(180.0, -180.0), Interval::point(-180.0));
        assert!(nearest(Interval::EMPTY, Interval::point(0.0), 360.0).is_empty());
    }

    proptest! {
        #[test]
        fn no_other_shift_is_nearer(value in -1e4..1e4_f64, beside in -1e4..1e4_f64, turn in 0.1..1e3_f64) {
            let found = nearest(Interval::point(value), Interval::point(beside), turn);
            prop_assert!((found.midpoint() - beside).abs() <= turn / 2.0 * (1.0 + 1e-9) + 1e-9);
            let turns = (found.midpoint() - value) / turn;
            prop_assert!((turns - libm::round(turns)).abs() < 1e-6);
        }

        #[test]
        fn what_is_a_turn_wide_overlaps_all(value in -1e4..1e4_f64, beside in -1e4..1e4_f64, turn in 0.1..1e3_f64) {
            let all = Interval::new(beside - 0.51 * turn, beside + 0.51 * turn);
            prop_assert!(nearest(Interval::point(value), all, turn).overlaps(all));
        }
    }
}
