//! The rhythm of a signal: its rate, jitter and gaps, its range and its fastest change.

use crate::calibration::frozen::frozen_after;
use crate::calibration::session::Session;
use crate::order::{quantile, sorted};
use shsa_core::knowledge::{KnowledgeBase, Scaling, Signal, SignalId};
use shsa_core::observation::{Observation, RawValue};

/// A change is measured over at least this many seconds, and over ten observations: shorter changes are noise.
const SHORTEST_CHANGE_S: f64 = 0.2;

/// The rhythm of one signal's observations. Values are in the signal's own unit, times in seconds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rhythm {
    /// The number of observations.
    pub count: usize,
    /// Observations a second, by the median time between two.
    pub rate_hz: Option<f64>,
    /// The 99 % quantile of the difference between the times between two observations and their median.
    pub jitter_s: Option<f64>,
    /// The longest time between two receptions.
    pub longest_gap_s: Option<f64>,
    /// The lowest and highest finite value.
    pub range: Option<(f64, f64)>,
    /// The largest change a second, over at least ten observations and 0.2 s.
    pub fastest: Option<f64>,
    /// The longest time with exactly the same value.
    pub longest_hold_s: Option<f64>,
    /// The time after which a constant signal is frozen; `None` if healthy readings do not tell it.
    pub frozen_after_s: Option<f64>,
}

impl Rhythm {
    /// The rhythms of all signals of a model, in order. Time: O(n log n) in the observations.
    pub(crate) fn of_all(knowledge: &KnowledgeBase, sessions: &[Session]) -> Vec<Rhythm> {
        let signals = knowledge.signals().ids();
        let rhythm = |signal: SignalId| {
            let found = Rhythm::of(sessions, signal);
            let Signal { scaling, limits, .. } = &knowledge.signals()[signal];
            // For readings that wrap, range and changes mean nothing.
            let is_line = limits.turn.is_none();
            let fastest = found.fastest.filter(|_| is_line);
            let range = found.range.filter(|_| is_line);
            Rhythm { fastest, range, ..found }.scaled(*scaling)
        };
        signals.map(rhythm).collect()
    }

    /// The rhythm of scaled readings, from that of the raw ones.
    fn scaled(self, scaling: Option<Scaling>) -> Rhythm {
        let Some(scaling) = scaling else { return self };
        let ordered = |(one, other): (f64, f64)| (one.min(other), one.max(other));
        let range = self.range.map(|(lo, hi)| ordered((scaling.value(lo), scaling.value(hi))));
        Rhythm { range, fastest: self.fastest.map(|fastest| fastest * scaling.scale.abs()), ..self }
    }

    fn of(sessions: &[Session], signal: SignalId) -> Rhythm {
        let stretches = sessions.iter().flat_map(Session::stretches);
        let own: Vec<Vec<&Observation>> =
            stretches.map(|it| it.iter().filter(|it| it.signal == signal).collect()).collect();
        let gaps = |time: fn(&Observation) -> f64| {
            let together = own.iter().flat_map(|own| own.windows(2));
            sorted(together.map(|pair| time(pair[1]) - time(pair[0])).filter(|gap| *gap > 0.0))
        };
        let stamped = gaps(|it| it.stamp.seconds());
        let usual = quantile(&stamped, 0.5);
        let jitter =
            usual.and_then(|usual| quantile(&sorted(stamped.iter().map(|gap| (gap - usual).abs())), 0.99));
        let points: Vec<Vec<(f64, f64)>> =
            own.iter().map(|own| own.iter().filter_map(|it| point(it)).collect()).collect();
        let values = sorted(points.iter().flatten().map(|(_, value)| *value));
        let fastest = usual.and_then(|usual| {
            let least_s = (10.0 * usual).max(SHORTEST_CHANGE_S);
            points.iter().filter_map(|points| fastest(points, least_s)).reduce(f64::max)
        });
        Rhythm {
            count: own.iter().map(Vec::len).sum(),
            rate_hz: usual.map(|usual| 1.0 / usual),
            jitter_s: jitter,
            longest_gap_s: gaps(|it| it.received.seconds()).last().copied(),
            range: values.first().copied().zip(values.last().copied()),
            fastest,
            longest_hold_s: longest_hold(&points),
            frozen_after_s: usual.and_then(|usual| frozen_after(&points, usual)),
        }
    }
}

/// The longest time with the same value, in seconds; `None` for fewer than two values.
fn longest_hold(points: &[Vec<(f64, f64)>]) -> Option<f64> {
    let runs = points.iter().flat_map(|points| points.chunk_by(|one, next| one.1 == next.1));
    let lasts =
        |run: &[(f64, f64)]| run.first().zip(run.last()).map_or(0.0, |(first, last)| last.0 - first.0);
    runs.map(lasts).reduce(f64::max)
}

/// Stamp and value, if the value is a number.
fn point(observation: &Observation) -> Option<(f64, f64)> {
    match observation.value {
        RawValue::Number(value) if value.is_finite() => Some((observation.stamp.seconds(), value)),
        RawValue::Interval { lo, hi } => Some((observation.stamp.seconds(), 0.5 * (lo + hi))),
        _ => None,
    }
}

/// The largest change a second between points that are `least_s` apart or slightly more.
fn fastest(points: &[(f64, f64)], least_s: f64) -> Option<f64> {
    let mut later = 0;
    let mut largest = None;
    for (time, value) in points {
        later += points[later..].iter().take_while(|(other, _)| other - time < least_s).count();
        let Some((other, changed)) = points.get(later) else { break };
        let rate = (changed - value).abs() / (other - time);
        // After a gap, the change may not have been steady.
        if other - time <= 2.0 * least_s {
            largest = Some(rate.max(largest.unwrap_or(0.0)));
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_core::knowledge::Id;
    use shsa_core::time::Time;

    #[test]
    fn a_late_observation_is_a_gap_and_no_rate() {
        let times = [0.0, 0.1, 0.2, 0.3, 0.8, 0.9, 1.0, 1.1];
        let observation = |time: f64| Observation {
            signal: SignalId::from_index(0),
            stamp: Time::from_seconds(time),
            received: Time::from_seconds(time),
            value: RawValue::Number(3.0 * time),
        };
        let observations: Vec<Observation> = times.into_iter().map(observation).collect();
        let of = |signal: usize, left_out: &[(Time, Time)]| {
            Rhythm::of(&[Session::new(observations.clone(), left_out)], SignalId::from_index(signal))
        };
        let rhythm = of(0, &[]);
        let near = |found: Option<f64>, expected: f64| (found.unwrap() - expected).abs() < 1e-6;
        assert!(near(rhythm.rate_hz, 10.0) && near(rhythm.longest_gap_s, 0.5), "{rhythm:?}");
        assert!(near(rhythm.jitter_s, 0.4) && near(rhythm.fastest, 3.0), "{rhythm:?}");
        assert_eq!(rhythm.range.map(|(lo, hi)| (lo, (hi * 10.0).round())), Some((0.0, 33.0)));
        let left_out = [(Time::from_seconds(0.4), Time::from_seconds(0.6))];
        let without = of(0, &left_out);
        assert!(near(without.longest_gap_s, 0.1), "{without:?}");
        assert_eq!(of(1, &[]), Rhythm::default());
    }
}
