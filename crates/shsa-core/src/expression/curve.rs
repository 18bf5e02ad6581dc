//! Piecewise linear curves through given points: the tables of characteristic curves.

use super::operation::Constant;
use crate::interval::Interval;
use core::ops::Range;

/// A point of a table, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// The argument.
    pub at: Constant,
    /// The value there.
    pub value: Constant,
}

/// A line between two neighbouring points of a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    start: Point,
    end: Point,
}

/// The points of a table in ascending order of their arguments. Where two points have one argument, the table jumps: the value
/// there is any between both.
#[derive(Clone, Copy, Debug)]
pub struct Curve<'p> {
    points: &'p [Point],
}

impl<'p> Curve<'p> {
    pub(super) fn new(points: &'p [Point]) -> Curve<'p> {
        Curve { points }
    }

    /// The line that a number lies on; at a point the line that begins there. `None` outside of the table, and where the table
    /// jumps. Complexity: O(log of the points).
    #[must_use]
    pub fn segment(&self, at: f64) -> Option<Segment> {
        let below = self.points.partition_point(|point| point.at.value < at);
        let through = below + self.points.get(below..)?.partition_point(|point| point.at.value <= at);
        let place = match through - below {
            0 => below.checked_sub(1)?,
            1 if through == self.points.len() => below.checked_sub(1)?,
            1 => below,
            _ => return None,
        };
        let [start, end] = self.points.get(place..place + 2)? else { return None };
        Some(Segment { start: *start, end: *end })
    }

    /// All values over an interval of arguments; empty outside of the table. Complexity: O(log of the points, and those in the
    /// interval).
    #[must_use]
    pub fn over(&self, at: Interval) -> Interval {
        let Range { start, end } = self.reached(at);
        let pairs = self.points.get(start..end).unwrap_or(&[]).windows(2);
        let values = pairs.map(|pair| match pair {
            [start, end] => Segment { start: *start, end: *end }.over(at),
            _ => Interval::EMPTY,
        });
        values.fold(Interval::EMPTY, Interval::hull)
    }

    /// The arguments from the first to the last point.
    pub(super) fn domain(&self) -> Interval {
        let (first, last) = (self.points.first(), self.points.last());
        first
            .zip(last)
            .map_or(Interval::EMPTY, |(first, last)| Interval::hull(first.at.bounds, last.at.bounds))
    }

    /// The points of the lines that an interval reaches.
    fn reached(&self, at: Interval) -> Range<usize> {
        if at.is_empty() {
            return 0..0;
        }
        let first = self.points.partition_point(|point| point.at.bounds.hi() < at.lo());
        let last = self.points.partition_point(|point| point.at.bounds.lo() <= at.hi());
        first.saturating_sub(1)..(last + 1).min(self.points.len())
    }
}

impl Segment {
    /// The value at a number on the line.
    #[must_use]
    pub fn value(&self, at: f64) -> f64 {
        let (from, to) = (self.start.value.value, self.end.value.value);
        let share = (at - self.start.at.value) / (self.end.at.value - self.start.at.value);
        (from + share * (to - from)).clamp(from.min(to), from.max(to))
    }

    /// The derivative of the value.
    #[must_use]
    pub fn slope(&self) -> f64 {
        (self.end.value.value - self.start.value.value) / (self.end.at.value - self.start.at.value)
    }

    /// All values over the part of an interval on the line; empty without such a part.
    fn over(&self, at: Interval) -> Interval {
        let (left, right) = (self.start.at.bounds, self.end.at.bounds);
        let (from, to) = (self.start.value.bounds, self.end.value.bounds);
        let all = Interval::hull(from, to);
        let part = at.intersection(Interval::hull(left, right));
        if part.is_empty() || part == Interval::hull(left, right) {
            return if part.is_empty() { part } else { all };
        }
        let share = ((part - left) / (right - left)).intersection(Interval::new(0.0, 1.0));
        (from + share * (to - from)).intersection(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn points(pairs: &[(f64, f64)]) -> Vec<Point> {
        let exact = Constant::exact;
        pairs.iter().map(|(at, value)| Point { at: exact(*at), value: exact(*value) }).collect()
    }

    fn value(pairs: &[(f64, f64)], at: f64) -> Option<f64> {
        Curve::new(&points(pairs)).segment(at).map(|segment| segment.value(at))
    }

    #[test]
    fn lines_join_the_points_and_nothing_lies_outside() {
        let pairs = [(0.0, 1.0), (2.0, 5.0), (4.0, 4.0)];
        let values = [-0.1, 0.0, 1.0, 2.0, 3.0, 4.0, 4.1].map(|at| value(&pairs, at));
        assert_eq!(values, [None, Some(1.0), Some(3.0), Some(5.0), Some(4.5), Some(4.0), None]);
    }

    #[test]
    fn a_jump_has_no_number_and_the_interval_between_its_ends() {
        let pairs = [(0.0, 0.0), (1.0, 1.0), (1.0, 3.0), (2.0, 3.0)];
        assert_eq!(value(&pairs, 1.0), None);
        assert_eq!(Curve::new(&points(&pairs)).over(Interval::point(1.0)), Interval::new(1.0, 3.0));
        assert_eq!(value(&pairs, 1.5), Some(3.0));
    }

    #[test]
    fn an_interval_beyond_the_end_counts_where_the_table_is() {
        let pairs = [(0.0, 0.0), (1.0, 2.0)];
        let over = |lo, hi| Curve::new(&points(&pairs)).over(Interval::new(lo, hi));
        assert!(over(0.5, 9.0).contains(1.0) && over(0.5, 9.0).hi() == 2.0 && over(0.5, 9.0).lo() > 0.99);
        assert!(over(1.5, 9.0).is_empty() && over(-2.0, -1.0).is_empty());
        assert_eq!(over(-5.0, 5.0), Interval::new(0.0, 2.0));
    }

    proptest! {
        #[test]
        fn an_interval_holds_the_values_of_its_points(
            steps in prop::collection::vec((0_i32..4, -8_i32..8), 2..8),
            lo in -4.0..20.0_f64, width in 0.0..6.0_f64, place in 0.0..1.0_f64,
        ) {
            let mut at = 0.0;
            let pairs: Vec<(f64, f64)> = steps.iter().map(|(step, value)| {
                at += f64::from(*step) * 0.7;
                (at, f64::from(*value) * 0.3)
            }).collect();
            let inside = lo + place * width;
            let over = Curve::new(&points(&pairs)).over(Interval::new(lo, lo + width));
            if let Some(value) = value(&pairs, inside) {
                prop_assert!(over.contains(value), "{value} outside of {over:?}");
            }
            for (at, value) in &pairs {
                prop_assert!(!(lo..=lo + width).contains(at) || over.contains(*value));
            }
        }
    }
}
