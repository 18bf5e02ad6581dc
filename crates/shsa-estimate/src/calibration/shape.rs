//! Errors that grow: with how fast a value changes (an error of time), and with the value (a share of it).
//!
//! An error that is there all the time must be as large as the worst moment needs. Where the worst moments are those in which
//! the value changes fast, or is large, an error of time or a share leaves the quiet moments sharp.

use super::edit::Trial;
use super::{PairFit, Parameter, Problem, Work};
use crate::comparison::Watched;
use crate::widening::Demand;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::time::Span;

/// Errors of time that are tried, in periods of the signal: with longer ones, every value is enclosed together with so many
/// others that noise and spikes are no longer seen.
const PERIODS: [f64; 2] = [0.5, 1.0];

/// Shares of the value that are tried, in percent.
const PERCENT: [f64; 4] = [0.5, 1.0, 2.0, 5.0];

/// A growing error is believed when a bias that is smaller by this is seen, on average over the ways that it touches.
const WORTH: f64 = 0.9;

/// With a bias that is larger by this, larger errors are no longer tried.
const HARMFUL: f64 = 1.25;

/// No way may be seen worse than by this, both alone and with the errors that all need together: errors that are shared
/// otherwise are no harm, nor is what a pair loses alone while another makes it blunt.
const NO_WORSE: f64 = 1.05;

/// A way whose smallest bias changes by less, as a share, is not touched.
const TOUCHED: f64 = 1e-3;

/// The smallest bias that is seen of a way, through the pair that sees it best.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// With no more than that pair needs.
    alone: f64,
    /// With the errors that all pairs need.
    together: f64,
}

impl Work<'_> {
    /// Gives signals errors of time, and errors shares, where smaller biases are seen with them before the split.
    ///
    /// One after the other, in file order; each keeps what helps the most. Time: a run of the monitor over the earlier part
    /// for each that is tried.
    pub(super) fn shaped(
        &self,
        knowledge: &KnowledgeBase,
        trial: Trial,
        watched: Watched,
    ) -> Result<(Trial, Watched), Problem> {
        let mut best = trial;
        let gains = self.gains(&best, knowledge)?;
        let mut seen = self.seen(&self.watch(&best, self.early)?, &gains);
        let compared =
            |signal: SignalId| watched.monitor.pairs().iter().any(|pair| pair.signals.contains(signal));
        let plain = best.clone();
        for signal in knowledge.signals().ids().filter(|signal| compared(*signal)) {
            let declared = knowledge.signals()[signal].time_error != (Span::ZERO, Span::ZERO);
            let Some(rate) = knowledge.signals()[signal].rate_hz.filter(|_| !declared) else { continue };
            let times = PERIODS.iter().map(|periods| {
                let mut tried = best.clone();
                // To a tenth of a millisecond, so that it is short to write.
                tried.time_errors[signal] = Span((periods / rate * 1e4).round() as i64 * 100_000);
                tried
            });
            let times = times.collect();
            self.keep_best(&mut best, &mut seen, &gains, times)?;
        }
        for number in 0..self.parameters.len() {
            let is_alone = match self.parameters[number] {
                Parameter::Signal(signal) => best.time_errors[signal] == Span::ZERO,
                Parameter::Relation(_) => true,
            };
            if best.offsets[number] == 0.0 && is_alone {
                let shares = PERCENT.iter().map(|percent| {
                    let mut tried = best.clone();
                    tried.shares[number] = *percent;
                    tried
                });
                let shares = shares.collect();
                self.keep_best(&mut best, &mut seen, &gains, shares)?;
            }
        }
        if best.time_errors == plain.time_errors && best.shares == plain.shares {
            return Ok((best, watched));
        }
        let watched = self.watch(&best, self.observations)?;
        Ok((best, watched))
    }

    /// Goes over to the one of these with which the smallest biases are seen, when it is worth it.
    fn keep_best(
        &self,
        best: &mut Trial,
        seen: &mut Vec<Option<Seen>>,
        gains: &[Vec<(usize, f64)>],
        all: Vec<Trial>,
    ) -> Result<(), Problem> {
        let mut smallest = WORTH.ln();
        let before = seen.clone();
        for tried in all {
            let now = self.seen(&self.watch(&tried, self.early)?, gains);
            // More of what harms does not help.
            let Some(change) = change(&before, &now).filter(|change| *change < HARMFUL.ln()) else { break };
            if change < smallest {
                smallest = change;
                *best = tried;
                *seen = now;
            }
        }
        Ok(())
    }

    /// What is seen of each way. A pair that needs much makes the others of its signals blunt, and one that sees little decides
    /// nothing.
    ///
    /// What a pair gains by an error is taken as it is without growing errors.
    fn seen(&self, watched: &Watched, gains: &[Vec<(usize, f64)>]) -> Vec<Option<Seen>> {
        let fits = self.fits(watched);
        let demand =
            |(fit, gains): (&PairFit, &Vec<(usize, f64)>)| Demand { gains: gains.clone(), least: fit.needed };
        let demands: Vec<Demand> = fits.iter().zip(gains).map(demand).collect();
        let errors = self.solve(&demands);
        let mut seen: Vec<Option<Seen>> = vec![None; watched.monitor.ways().len()];
        let pairs = watched.monitor.pairs().iter().zip(fits.iter().zip(&demands));
        for (pair, (fit, demand)) in pairs.filter(|(_, (fit, _))| fit.shows > 0.0) {
            let together = fit.shows - fit.needed + demand.reached(&errors).max(fit.needed);
            for way in [pair.way, pair.other] {
                let best = seen[way.0 as usize].get_or_insert(Seen { alone: fit.shows, together });
                best.alone = best.alone.min(fit.shows);
                best.together = best.together.min(together);
            }
        }
        seen
    }
}

/// The mean logarithm of how much larger the smallest biases are than before, over the ways for which they are others;
/// `None` when there is none, or one of them is worse off.
fn change(before: &[Option<Seen>], now: &[Option<Seen>]) -> Option<f64> {
    let both = || before.iter().zip(now).filter_map(|(before, now)| Some(((*before)?, (*now)?)));
    let is_worse = |(before, now): (Seen, Seen)| {
        now.alone > NO_WORSE * before.alone && now.together > NO_WORSE * before.together
    };
    let ratios = both().map(|(before, now)| now.together / before.together);
    let touched: Vec<f64> = ratios.filter(|ratio| (ratio - 1.0).abs() > TOUCHED).collect();
    let is_fine = !touched.is_empty() && !both().any(is_worse);
    is_fine.then(|| touched.iter().map(|ratio| ratio.ln()).sum::<f64>() / touched.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(now: [(f64, f64); 2], expected: Option<f64>) {
        let seen = |(alone, together): (f64, f64)| Some(Seen { alone, together });
        let found = change(
            &[seen((1.0, 1.0)), seen((1.0, 2.0)), None],
            &[seen(now[0]), seen(now[1]), seen((1.0, 1.0))],
        );
        let is_right = match (found.map(f64::exp), expected) {
            (Some(found), Some(expected)) => (found - expected).abs() < 1e-9,
            (found, expected) => found == expected,
        };
        assert!(is_right, "{found:?} is not {expected:?}");
    }

    #[test]
    fn ways_that_are_touched_decide_and_none_may_be_worse_off() {
        check([(1.0, 0.25), (1.0, 2.0001)], Some(0.25));
        check([(1.0, 0.25), (1.0, 0.5)], Some(0.25));
        check([(1.0, 0.25), (1.2, 2.2)], None);
        check([(1.0, 1.0), (1.0, 2.0)], None);
        // Worse only alone, or only because errors are shared otherwise.
        check([(4.0, 0.25), (1.0, 2.0)], Some(0.25));
        check([(1.0, 0.5), (1.0, 4.0)], Some(1.0));
    }
}
