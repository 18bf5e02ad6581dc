//! Errors that hold single values, too: the loop forgives a value now and then, but a published one should hold the truth.

use super::exact::Gains;
use super::scales::Compared;
use super::{PairFit, Trial};
use crate::calibration::comparison::Comparison;
use crate::calibration::poisson::most_expected;
use crate::calibration::widening::{Demand, least_widening};
use crate::order::{quantile, sorted};

/// The largest share of the comparisons of a pair that its errors may leave out, with 95 % confidence.
const LEFT_OUT: f64 = 0.001;
/// How much differences come in clusters shows in those beyond this quantile.
const LARGE: f64 = 0.95;

/// Errors with which each pair that holds leaves out no more than [`LEFT_OUT`] of its comparisons, or none where these are too few to
/// tell. Errors that do so already stay as they are, and wide ones grow more than narrow ones. Time: O(n log n) for n comparisons.
pub(super) fn widened(pairs: &[PairFit], trial: &Trial, compared: &Compared, gains: &Gains) -> Trial {
    let errors = &trial.errors;
    let all = pairs.iter().zip(compared).zip(gains).filter(|((pair, _), _)| pair.holds);
    let demands = all.filter_map(|((_, compared), gains)| demand(errors, compared, gains));
    let scale = |error: &Option<f64>| error.filter(|it| *it > 0.0).map_or(1.0, f64::recip);
    let scales: Vec<f64> = errors.iter().map(scale).collect();
    let wider = least_widening(&scales, &demands.collect::<Vec<_>>());
    let errors = errors.iter().zip(wider).map(|(error, wider)| error.map(|it| it + wider)).collect();
    Trial { errors, ..trial.clone() }
}

/// By how much a pair must become wider; `None` where its errors are wide enough.
fn demand(errors: &[Option<f64>], compared: &[Vec<Comparison>], gains: &[(usize, f64)]) -> Option<Demand> {
    let error = |at: usize| errors[at].filter(|it| *it > 0.0);
    let given: f64 = gains.iter().filter_map(|(at, gain)| Some(gain * error(*at)?)).sum();
    let gains: Vec<(usize, f64)> = gains.iter().copied().filter(|it| error(it.0).is_some()).collect();
    let least = largest(compared) - given;
    (least > 0.0 && !gains.is_empty()).then_some(Demand { gains, least })
}

/// The difference beyond what a pair leaves open without errors that no more than [`LEFT_OUT`] of its comparisons exceed.
fn largest(compared: &[Vec<Comparison>]) -> f64 {
    let beyond = |it: &Comparison| it.beyond().abs();
    let all = sorted(compared.iter().flatten().map(beyond));
    let large = quantile(&all, LARGE).unwrap_or(0.0);
    let apart = apart(compared, |it| beyond(it) > large);
    let clusters = LEFT_OUT * all.len() as f64 * apart;
    // So many clusters beyond a difference show that it is exceeded no more often.
    let shown = (0..).take_while(|count| most_expected(*count) <= clusters).last().unwrap_or(0);
    let exceeding = (shown as f64 / apart) as usize;
    all.iter().rev().nth(exceeding).copied().unwrap_or(0.0)
}

/// How far from one another large differences come: the share of them that begin a cluster (the extremal index, by the times
/// between them: C. Ferro, J. Segers 2003, doi:10.1111/1467-9868.00401).
fn apart(compared: &[Vec<Comparison>], is_large: impl Fn(&Comparison) -> bool) -> f64 {
    let waits = compared.iter().flat_map(|session| {
        let large = session.iter().enumerate().filter(|it| is_large(it.1)).map(|it| it.0);
        let large: Vec<usize> = large.collect();
        large.windows(2).map(|two| (two[1] - two[0]) as f64).collect::<Vec<_>>()
    });
    let waits: Vec<f64> = waits.collect();
    let count = waits.len().max(1) as f64;
    let sum: f64 = waits.iter().map(|it| it - 1.0).sum();
    let squares: f64 = waits.iter().map(|it| (it - 1.0) * (it - 2.0)).sum();
    // Where none are further apart than 2, all are one cluster.
    if squares > 0.0 {
        (2.0 * sum * sum / (count * squares)).clamp(count.recip(), 1.0)
    } else {
        count.recip()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::comparison::Watched;
    use crate::calibration::fit::{Options, calibrate};
    use crate::calibration::{Chance, Session};
    use shsa_core::engine::{self, WatchBudget};
    use shsa_core::knowledge::{Id, KnowledgeBase, SignalId, build};
    use shsa_core::observation::{Observation, RawValue};
    use shsa_core::plan::Graph;
    use shsa_core::time::{Time, Validity};
    use shsa_model::live::{Live, Written};

    /// Differences whose size lasts for some comparisons, with heavy tails.
    fn differences(chance: &mut Chance, count: usize, lasts: usize) -> Vec<Comparison> {
        let mut large = 0.0;
        let one = |number: usize| {
            if number.is_multiple_of(lasts) {
                large = chance.exponential().powi(2) * if chance.below(2) == 0 { 1.0 } else { -1.0 };
            }
            let at = Time::from_seconds(number as f64);
            Comparison {
                received: at,
                validity: Validity { from: at, to: at },
                value: large,
                known: 0.0,
                width: 0.1,
            }
        };
        (0..count).map(one).collect()
    }

    #[test]
    fn differences_of_other_hours_are_covered() {
        let (mut missed, mut shares, count) = (0, 0.0, 100);
        for seed in 0..count {
            let mut chance = Chance::new(seed);
            let lasts = 1 + chance.below(8);
            let found = largest(&[differences(&mut chance, 60_000, lasts)]);
            let other = differences(&mut chance, 400_000, lasts);
            let left_out = other.iter().filter(|it| it.beyond().abs() > found).count() as f64 / 4e5;
            missed += usize::from(left_out > LEFT_OUT);
            shares += left_out / LEFT_OUT;
        }
        // With 95 % confidence, and not much more than is asked.
        assert!(missed <= 10, "{missed} of {count}");
        assert!(shares > 0.25 * count as f64, "{shares}");
    }

    const MODEL: &str = "
shsa: 1
variables: { x: { unit: m } }
signals:
  a: { variable: x, rate: 20 Hz }
  b: { variable: x, rate: 20 Hz }
  c: { variable: x, rate: 20 Hz }
needs: { x: { signal: /x } }
";

    /// Three sensors, each of which is jolted for a value now and then.
    fn jolted(chance: &mut Chance, seconds: f64) -> Session {
        let mut all = Vec::new();
        for number in 0..(20.0 * seconds) as i64 {
            for signal in 0..3 {
                let jolt = if chance.share() < 0.002 { 20.0 * chance.exponential() } else { 0.0 };
                let at = Time::from_seconds(number as f64 / 20.0);
                let value = (number as f64 / 200.0).sin() + 0.01 * (chance.normal() + jolt);
                all.push(Observation {
                    signal: SignalId::from_index(signal),
                    stamp: at,
                    received: at,
                    value: RawValue::Number(value),
                });
            }
        }
        Session::new(all, &[])
    }

    fn left_out(knowledge: &KnowledgeBase, session: &Session) -> (usize, usize) {
        let ways = engine::to_watch(knowledge, &Graph::new(knowledge), WatchBudget::default());
        let watched = Watched::over(knowledge, &ways, session.stretches().iter().map(Vec::as_slice));
        let all: Vec<&Comparison> = watched.comparisons.iter().flatten().collect();
        (all.iter().filter(|it| it.beyond() != 0.0).count(), all.len())
    }

    #[test]
    fn a_calibrated_model_holds_single_values_that_are_not_fitted() {
        let (live, _) = Live::load(Written { name: "jolted.yaml", text: MODEL }).unwrap();
        let (mut out, mut of) = (0, 0);
        for seed in 0..4 {
            let mut chance = Chance::new(seed);
            let fitted = jolted(&mut chance, 300.0);
            let unseen = jolted(&mut chance, 300.0);
            let options =
                Options { finds_steps: false, seed, most_observations: 60_000, ..Options::default() };
            let found = calibrate(live.draft(), &[fitted], std::slice::from_ref(&unseen), &options).unwrap();
            let (knowledge, _) = build(&found.draft);
            let (own_out, own_of) = left_out(&knowledge, &unseen);
            (out, of) = (out + own_out, of + own_of);
        }
        assert!(out as f64 <= LEFT_OUT * of as f64, "{out} of {of}");
    }
}
