//! Signals whose values are exact: set points, commands and states, which take few values or stand, and which their witnesses follow
//! far more closely than from one of these values to the next.

use super::parts::Parts;
use super::scales::{Compared, Scale};
use super::surrogate::quantum;
use super::{Fit, PairFit, Parameter, Problem, Trial};
use crate::order::winsorised;
use shsa_core::knowledge::{IdVec, KnowledgeBase, SignalId};

/// A signal with more values is no choice of modes.
const MOST_LEVELS: usize = 8;

/// The error of rounding to a step is this share of it.
const ROUNDING: f64 = 0.288_675;

/// Below this share of the error that rounding would have, a difference shows that nothing is rounded.
const SHOWN: f64 = 0.5;

/// The least number of comparisons that show a spread.
const LEAST: usize = 30;

/// Whether each signal is exact. `gains` are the widenings of each pair by each parameter. Where two exact signals are compared and
/// differ, neither is: an error of one of them must explain that.
fn all(
    fit: &Fit<'_>,
    parts: &Parts<'_>,
    compared: &Compared,
    gains: &[Vec<(usize, f64)>],
) -> IdVec<SignalId, bool> {
    let signals = fit.knowledge.signals();
    let mut exact = IdVec::filled(signals.len(), |signal: SignalId| {
        let levels = levels(parts, signal);
        let is_discrete = signals[signal].holds || levels <= MOST_LEVELS;
        let rounding = ROUNDING * quantum(parts, signal);
        // One that stands shows no error of its own.
        let is_shown = |apart: f64| levels == 1 || apart < SHOWN * rounding;
        is_discrete && least_apart(fit, signal, compared, gains).is_some_and(is_shown)
    });
    let differ = fit.pairs.iter().filter(|pair| pair.holds && pair.spread > 0.0);
    for (one, other) in differ.filter_map(PairFit::direct) {
        if exact[one] && exact[other] {
            (exact[one], exact[other]) = (false, false);
        }
    }
    exact
}

/// How much wider each parameter makes each pair, by the number of the parameter.
pub(super) type Gains = Vec<Vec<(usize, f64)>>;

/// The parts of all readings, the scales of the signals and the gains, once it is known which signals are exact.
pub(super) fn scaled<'a>(
    fit: &Fit<'a>,
    trial: &Trial,
    delayed: &KnowledgeBase,
    compared: &Compared,
) -> Result<(Parts<'a>, IdVec<SignalId, Scale>, Gains), Problem> {
    let none = IdVec::filled(fit.knowledge.signals().len(), |_: SignalId| false);
    let parts = Parts::of(delayed, fit.sessions, &none);
    let scales = fit.scales(&parts, compared, &none);
    let gains = fit.gains(trial, &|signal| scales[signal].deviation)?;
    let exact = all(fit, &parts, compared, &gains);
    if !exact.iter().any(|it| *it) {
        return Ok((parts, scales, gains));
    }
    let parts = Parts::of(delayed, fit.sessions, &exact);
    let scales = fit.scales(&parts, compared, &exact);
    Ok((parts, scales, gains))
}

/// The least deviation of a difference that a signal is in, in the signal's unit; `None` where nothing is compared with it.
fn least_apart(
    fit: &Fit<'_>,
    signal: SignalId,
    compared: &Compared,
    gains: &[Vec<(usize, f64)>],
) -> Option<f64> {
    let number = fit.parameters.iter().position(|it| *it == Parameter::Signal(signal))?;
    let pairs = fit.pairs.iter().zip(compared).zip(gains);
    let deviations = pairs.filter_map(|((pair, compared), gains)| {
        let (_, gain) = gains.iter().find(|(at, _)| *at == number).filter(|_| pair.holds)?;
        let apart = super::scales::apart(compared);
        (apart.len() >= LEAST).then(|| winsorised(&apart).sqrt() / gain)
    });
    deviations.reduce(f64::min)
}

/// The number of different values of a signal.
fn levels(parts: &Parts<'_>, signal: SignalId) -> usize {
    let mut values: Vec<f64> =
        parts.pieces.iter().flat_map(|it| it.tracks[signal].values.iter().copied()).collect();
    values.sort_unstable_by(f64::total_cmp);
    values.dedup();
    values.len()
}
