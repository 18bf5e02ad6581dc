//! How wide two ways must be so that what their comparisons say together is no alarm.

use crate::comparison::Comparison;
use shsa_core::interval::Interval;
use shsa_core::monitor::{Measured, Tendency, Trend, TrendOptions};
use shsa_core::time::Span;

/// What is tested later may be livelier than what was fitted.
const RESERVE: f64 = 1.1;
/// Steps of bisection: the width is found to a thousandth of the range that is searched.
const STEPS: usize = 10;
/// From so many times the largest difference on, nothing that comparisons say together is an alarm.
const MOST: f64 = 8.0;

/// The least width, and a reserve, with which the engine's monitor sees neither a drift nor noise nor a shift in time
/// among comparisons, each of which tells about so long a window; at least `least`. Time: O(comparisons).
pub(super) fn calm_width(comparisons: &[Comparison], window: Span, least: f64) -> f64 {
    let is_calm = |width: f64| is_calm(comparisons, window, width / RESERVE);
    if is_calm(least) {
        return least;
    }
    let largest = comparisons.iter().map(|it| (it.value - it.known).abs()).fold(0.0, f64::max);
    let (mut low, mut high) = (least, least.max(MOST * largest));
    for _ in 0..STEPS {
        let middle = 0.5 * (low + high);
        *(if is_calm(middle) { &mut high } else { &mut low }) = middle;
    }
    high
}

fn is_calm(comparisons: &[Comparison], window: Span, width: f64) -> bool {
    let mut trend = Trend::new(TrendOptions::default(), window, shsa_core::monitor::Noise::Declared);
    comparisons.iter().all(|it| {
        let reach = 0.5 * it.width + width;
        let value = Interval::new(it.value - reach, it.value + reach);
        let (value, known) = (Measured::of(value), Measured::of(Interval::point(it.known)));
        trend.record(&value, &known, it.validity, it.received);
        matches!(trend.tendency(), Tendency::Calm | Tendency::Building)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_core::time::{Time, Validity};

    fn comparisons(difference: impl Fn(usize) -> f64) -> Vec<Comparison> {
        let comparison = |at: usize| {
            let received = Time::from_seconds(0.1 * at as f64);
            let apart = difference(at);
            let validity = Validity::at(received);
            Comparison {
                received,
                validity,
                value: apart,
                known: 0.0,
                above: apart,
                below: -apart,
                width: 0.0,
            }
        };
        (0..4000).map(comparison).collect()
    }

    #[test]
    fn scatter_and_slow_changes_ask_for_width_and_a_constant_does_not() {
        assert_eq!(calm_width(&comparisons(|_| 0.9), Span::ZERO, 1.0), 1.0);
        let scattered = calm_width(&comparisons(|at| if at % 2 == 0 { 0.9 } else { -0.9 }), Span::ZERO, 1.0);
        assert!((1.8..4.0).contains(&scattered), "{scattered}");
        let slow = calm_width(&comparisons(|at| 0.9 * (at as f64 * 0.002).sin()), Span::ZERO, 1.0);
        assert!((1.2..3.0).contains(&slow), "{slow}");
    }
}
