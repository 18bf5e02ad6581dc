//! How small a step is seen when it lasts: not by single comparisons, but by what they say together.

use crate::comparison::Comparison;
use shsa_core::interval::Interval;
use shsa_core::monitor::{Measured, Tendency, Trend, TrendOptions};
use shsa_core::time::{Span, Time};

/// Steps that are tried, as parts of the step that single comparisons see.
const STEPS: usize = 40;

/// The smallest step at the split, smaller than `at_once`, after which the engine's monitor gives an alarm about comparisons
/// together, whichever way it points, and how long that takes at most. Each comparison tells about so long a window, and
/// both ways are wider by `given`. Time: O(comparisons).
pub(super) fn lasting_step(
    comparisons: &[Comparison],
    split: Time,
    window: Span,
    given: f64,
    at_once: f64,
) -> Option<(f64, Span)> {
    let (early, late) = comparisons.split_at(comparisons.partition_point(|it| it.received < split));
    let mut usual = Trend::new(TrendOptions::default(), window, shsa_core::monitor::Noise::Declared);
    early.iter().for_each(|it| record(&mut usual, it, given, 0.0));
    let after = |step: f64| Some(alarm(usual, late, given, step)?.max(alarm(usual, late, given, -step)?));
    // From below: a step that single comparisons see here and there adds nothing there.
    let steps = (1..STEPS).map(|number| at_once * number as f64 / STEPS as f64);
    steps.filter(|step| *step > 0.0).find_map(|step| Some((step, after(step)? - split)))
}

/// When a step that lasts is an alarm; `None` where one was before it, as without the step.
fn alarm(mut trend: Trend, late: &[Comparison], given: f64, step: f64) -> Option<Time> {
    if is_alarm(&trend) {
        return None;
    }
    let raises = |it: &&Comparison| {
        record(&mut trend, it, given, step);
        is_alarm(&trend)
    };
    late.iter().find(raises).map(|it| it.received)
}

fn is_alarm(trend: &Trend) -> bool {
    !matches!(trend.tendency(), Tendency::Calm | Tendency::Building)
}

fn record(trend: &mut Trend, it: &Comparison, given: f64, step: f64) {
    let (value, reach) = (it.value + step, 0.5 * it.width + given);
    let value = Measured::of(Interval::new(value - reach, value + reach));
    trend.record(&value, &Measured::of(Interval::point(it.known)), it.validity, it.received);
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_core::time::Validity;

    fn comparison(at: usize) -> Comparison {
        let received = Time::from_seconds(0.1 * at as f64);
        let validity = Validity::at(received);
        Comparison { received, validity, value: 0.0, known: 0.0, above: 0.0, below: 0.0, width: 0.0 }
    }

    #[test]
    fn a_step_beyond_the_allowance_is_seen_in_the_end() {
        let all: Vec<Comparison> = (0..2000).map(comparison).collect();
        let (step, after) = lasting_step(&all, Time::from_seconds(100.0), Span::ZERO, 1.0, 1.0).unwrap();
        // Half of the tolerance is allowed; a step beyond it takes the longer the smaller it is, and there are 100 s.
        assert!((0.5..0.6).contains(&step), "{step}");
        assert!((20.0..100.0).contains(&after.seconds()), "{after:?}");
    }

    #[test]
    fn what_ends_too_soon_or_has_always_been_there_is_no_lasting_step() {
        let all: Vec<Comparison> = (0..1010).map(comparison).collect();
        assert_eq!(lasting_step(&all, Time::from_seconds(100.0), Span::ZERO, 1.0, 1.0), None);
        assert_eq!(lasting_step(&[], Time::MIN, Span::ZERO, 1.0, 1.0), None);
    }
}
