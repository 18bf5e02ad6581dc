//! Errors that grow: with how fast a value changes (an error of time), and with the value (a share of it).
//!
//! An error that is there all the time must be as large as the worst moment needs. Where the worst moments are those in which
//! the value changes fast, or is large, an error of time or a share leaves the quiet moments sharp.

use super::edit::Trial;
use super::{PairFit, Parameter, Problem, Work};
use crate::comparison::Watched;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::time::Span;

/// Errors of time that are tried, in periods of the signal: with longer ones, every value is enclosed together with so many
/// others that noise and spikes are no longer seen.
const PERIODS: [f64; 2] = [0.5, 1.0];

/// Shares of the value that are tried, in percent.
const PERCENT: [f64; 4] = [0.5, 1.0, 2.0, 5.0];

/// A growing error is believed when a bias that is smaller by this is seen, on average over the pairs that it touches.
const WORTH: f64 = 0.9;

/// With a bias that is larger by this, larger errors are no longer tried.
const HARMFUL: f64 = 1.25;

/// No pair may see worse than by this.
const NO_WORSE: f64 = 1.05;

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
        let mut fits = self.fits(&self.watch(&best, self.early)?);
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
            self.keep_best(&mut best, &mut fits, times)?;
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
                self.keep_best(&mut best, &mut fits, shares)?;
            }
        }
        if best.time_errors == plain.time_errors && best.shares == plain.shares {
            return Ok((best, watched));
        }
        let watched = self.watch(&best, self.observations)?;
        Ok((best, watched))
    }

    /// Goes over to the one of these with which the smallest biases are seen, when it is worth it.
    fn keep_best(&self, best: &mut Trial, fits: &mut Vec<PairFit>, all: Vec<Trial>) -> Result<(), Problem> {
        let mut smallest = WORTH.ln();
        let before = fits.clone();
        for tried in all {
            let now = self.fits(&self.watch(&tried, self.early)?);
            // More of what harms does not help.
            let Some(change) = change(&before, &now).filter(|change| *change < HARMFUL.ln()) else { break };
            if change < smallest {
                smallest = change;
                *best = tried;
                *fits = now;
            }
        }
        Ok(())
    }
}

/// The mean logarithm of how much larger the smallest biases are than before, over the pairs for which they are others;
/// `None` when there is none, or one of them is worse off.
fn change(before: &[PairFit], now: &[PairFit]) -> Option<f64> {
    let ratios = before.iter().zip(now).filter(|(before, now)| before.shows > 0.0 && now.shows > 0.0);
    let ratios: Vec<f64> = ratios.map(|(before, now)| now.shows / before.shows).collect();
    let touched: Vec<f64> = ratios.into_iter().filter(|ratio| (ratio - 1.0).abs() > 1e-9).collect();
    let is_fine = !touched.is_empty() && touched.iter().all(|ratio| *ratio <= NO_WORSE);
    is_fine.then(|| touched.iter().map(|ratio| ratio.ln()).sum::<f64>() / touched.len() as f64)
}
