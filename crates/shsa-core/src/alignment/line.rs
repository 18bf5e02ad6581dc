//! The straight line between two samples, and how far the value may be from it.

use super::history::Sample;
use crate::numbers::BENDS_MORE;
use crate::time::Span;

/// The straight line between two samples, at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// The value on the line, SI.
    pub value: f64,
    /// The change in a second, SI.
    pub slope: f64,
    /// How far the curve through these two samples and the one before may be from the line, SI.
    pub bulge: f64,
    /// The time between the two samples.
    pub gap: Span,
    /// The time since the earlier of them.
    pub since: Span,
}

impl Line {
    /// The time until the later of the two samples.
    #[must_use]
    pub fn until(&self) -> Span {
        self.gap - self.since
    }

    /// How far below and above the line a value may be that changes by no more than this rate (SI a second), at a moment that is known
    /// up to `late`.
    pub(crate) fn room(&self, max_rate: f64, late: Span) -> (f64, f64) {
        let (since, until) = ((self.since + late).seconds(), (self.until() + late).seconds());
        // A slope beyond the rate is one of noise.
        let (rises, falls) = ((max_rate - self.slope).max(0.0), (max_rate + self.slope).max(0.0));
        ((falls * since).min(rises * until), (rises * since).min(falls * until))
    }
}

/// How far a value may turn beyond two samples between them, as those before show it, newest first. Without a bound of its rate,
/// nothing proves how far.
pub(super) fn turn<'h>(mut before: impl Iterator<Item = &'h Sample>, sample: &Sample, later: &Sample) -> f64 {
    let Some(older) = before.next() else { return 0.0 };
    let earlier = before.next().map_or(0.0, |oldest| bulge(oldest, older, sample));
    BENDS_MORE * bulge(older, sample, later).max(earlier)
}

/// How far the parabola through three samples, in the order of time, rises above the higher of the last two between them.
///
/// For samples `h` apart it is at most `c h^2 / 8` for the curvature `c`.
pub(super) fn bulge(older: &Sample, sample: &Sample, later: &Sample) -> f64 {
    let middle = |sample: &Sample| (sample.value.midpoint(), sample.validity.centre());
    let ((first, start), (second, turn), (third, end)) = (middle(older), middle(sample), middle(later));
    let (before, after) = ((turn - start).seconds(), (end - turn).seconds());
    // A sample that is much farther away than the other does not show the present curvature.
    if before <= 0.0 || after <= 0.0 || before > 3.0 * after || after > 3.0 * before {
        return 0.0;
    }
    let curvature = 2.0 * ((third - second) / after - (second - first) / before) / (before + after);
    let bulge = curvature.abs() * after * after / 8.0;
    if bulge.is_finite() { bulge } else { 0.0 }
}
