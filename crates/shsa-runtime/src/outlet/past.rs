//! The last minutes of a need, for pages that are opened later: a page that is opened after a fault shows the fault.

use super::Outlet;
use shsa_core::interval::Interval;
use shsa_core::reason::ServedBy;
use shsa_core::time::{Span, Time};
use std::collections::VecDeque;
use std::sync::Arc;

/// How much of the past is kept, in points of this length: 180 points of 40 bytes, 7.2 kB a need. A drawing of three minutes has
/// three pixels for a point.
const EACH: Span = Span::from_millis(1_000);
const POINTS: usize = 180;

/// What went out in one stretch of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Point {
    /// When the stretch began, and the time of the last value in it.
    since: Time,
    pub(crate) last: Time,
    /// The hull of the values, SI.
    pub(crate) value: Interval,
    /// Whether another source than that of the value before has given one of the values.
    pub(crate) is_switch: bool,
    /// Whether the need was not served before.
    pub(crate) is_gap: bool,
}

/// The last values of a need, as points.
#[derive(Clone, Debug, Default)]
pub(super) struct Past {
    points: VecDeque<Point>,
    source: Option<Arc<ServedBy>>,
}

impl Past {
    /// Takes in a value. O(1).
    pub(super) fn note(&mut self, value: Interval, source: &Arc<ServedBy>, max_age: Span, now: Time) {
        let before = self.source.as_ref();
        let is_switch = before.is_some_and(|before| !Arc::ptr_eq(before, source) && before != source);
        if before.is_none_or(|before| !Arc::ptr_eq(before, source)) {
            self.source = Some(source.clone());
        }
        let is_gap = self.points.back().is_some_and(|point| now - point.last > max_age);
        match self.points.back_mut().filter(|point| now - point.since < EACH && !is_gap) {
            Some(point) => {
                (point.last, point.value) = (now, point.value.hull(value));
                point.is_switch |= is_switch;
            }
            None => {
                if self.points.len() == POINTS {
                    self.points.pop_front();
                }
                self.points.push_back(Point { since: now, last: now, value, is_switch, is_gap });
            }
        }
    }
}

impl Outlet {
    /// The last minutes of a scalar, the oldest point first.
    pub(crate) fn past(&self) -> impl Iterator<Item = &Point> {
        self.past.points.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_past_is_bounded_and_has_the_switches_and_gaps() {
        let named = |name: &str| Arc::new(ServedBy::Way(name.to_owned()));
        let (one, other) = (named("one"), named("other"));
        let mut past = Past::default();
        for tenth in 0..3_000_i64 {
            let source = if tenth < 2_900 { &one } else { &other };
            let now = Time(tenth * 100_000_000);
            if !(2_950..2_970).contains(&tenth) {
                past.note(Interval::point(tenth as f64), source, Span::from_millis(500), now);
            }
        }
        let points: Vec<&Point> = past.points.iter().collect();
        assert_eq!(points.len(), POINTS);
        let at = |is: &dyn Fn(&Point) -> bool| {
            points.iter().filter(|it| is(it)).map(|it| it.since.0 / 100_000_000).collect::<Vec<_>>()
        };
        assert_eq!(at(&|it| it.is_switch), [2_900]);
        assert_eq!(at(&|it| it.is_gap), [2_970]);
        assert_eq!((points[179].value.lo(), points[179].value.hi()), (2_990.0, 2_999.0));
    }
}
