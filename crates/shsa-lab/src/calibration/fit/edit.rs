//! Changes of a model: for trials, and for the result.

use super::{Bounds, Parameter, Problem};
use crate::calibration::rhythm::Rhythm;
use shsa_core::knowledge::{Draft, Id, IdVec, KnowledgeBase, Severity, SignalId, Text, build};
use shsa_core::time::Span;

/// If a healthy signal was absent for longer than its timeout, the new timeout is the gap times this.
const TIMEOUT_FACTOR: f64 = 2.0;

/// If a healthy signal was constant for longer than permitted, the new limit is that time times this.
const HOLD_FACTOR: f64 = 2.0;

/// If the declared rate of change is too small, the new one is the fastest observed change times this.
const RATE_FACTOR: f64 = 1.5;

/// A model with trial errors.
#[derive(Clone)]
pub(super) struct Trial {
    pub(super) parameters: Vec<Parameter>,
    /// The errors by parameter, in its unit; `None` keeps the model's error.
    pub(super) errors: Vec<Option<f64>>,
    /// The delay of each signal beyond that of the model.
    pub(super) delays: IdVec<SignalId, Span>,
    /// The delays of the model.
    pub(super) known: IdVec<SignalId, Span>,
}

impl Trial {
    /// A trial without errors.
    pub(super) fn new(parameters: &[Parameter], knowledge: &KnowledgeBase) -> Trial {
        let count = knowledge.signals().len();
        Trial {
            parameters: parameters.to_vec(),
            errors: vec![Some(0.0); parameters.len()],
            delays: IdVec::filled(count, |_| Span::ZERO),
            known: IdVec::filled(count, |signal| knowledge.signals()[signal].delay),
        }
    }

    /// The model with these errors and delays, and without limits on the rate of change: without errors, noise would exceed them.
    pub(super) fn ungated(&self, draft: &Draft) -> Draft {
        ungated(self.applied(draft))
    }

    pub(super) fn applied(&self, draft: &Draft) -> Draft {
        let mut draft = draft.clone();
        for (parameter, error) in self.parameters.iter().zip(&self.errors) {
            let Some(error) = error else { continue };
            set_error(&mut draft, *parameter, Bounds::One(text(rounded_up(*error).to_string())));
        }
        for (signal, delay) in self.delays.enumerate().filter(|(_, delay)| **delay > Span::ZERO) {
            set_delay(&mut draft, signal, self.known[signal] + *delay);
        }
        draft
    }
}

/// A model without limits on the rate of change.
pub(super) fn ungated(mut draft: Draft) -> Draft {
    draft.signals.iter_mut().for_each(|it| it.max_rate = Some(text("none".to_owned())));
    draft
}

/// Builds a draft that should be valid.
pub(super) fn built(draft: &Draft) -> Result<KnowledgeBase, Problem> {
    let (knowledge, found) = build(draft);
    match found.into_iter().find(|it| it.severity == Severity::Error) {
        Some(error) => Err(Problem::Model(error.message)),
        None => Ok(knowledge),
    }
}

/// The SI difference of one unit of a signal.
pub(super) fn scale(knowledge: &KnowledgeBase, signal: SignalId) -> f64 {
    knowledge.signals()[signal].unit.as_ref().map_or(1.0, |unit| unit.to_si_difference(1.0).abs())
}

fn text(text: String) -> Text {
    Text { text, ..Text::default() }
}

fn set_error(draft: &mut Draft, parameter: Parameter, error: Bounds) {
    match parameter {
        Parameter::Signal(signal) => {
            draft
                .signals
                .iter_mut()
                .skip(signal.index())
                .take(1)
                .for_each(|it| it.value_error = Some(error.clone()));
        }
        Parameter::Relation(relation) => {
            draft
                .relations
                .iter_mut()
                .skip(relation.index())
                .take(1)
                .for_each(|it| it.error = Some(error.clone()));
        }
    }
}

/// Sets the delay of a signal, in milliseconds.
fn set_delay(draft: &mut Draft, signal: SignalId, delay: Span) {
    let written = text(format!("{} ms", delay.seconds() * 1e3));
    draft.signals.iter_mut().skip(signal.index()).take(1).for_each(|it| it.delay = Some(written.clone()));
}

/// The model with the limits that healthy signals need: rates and frozen times where none are declared; timeouts and rates of
/// change only where they are exceeded.
pub(super) fn limited(draft: &Draft, rhythms: &[Rhythm], knowledge: &KnowledgeBase) -> Draft {
    let mut draft = draft.clone();
    let signals = draft.signals.iter_mut().zip(knowledge.signals().iter());
    for ((written, signal), rhythm) in signals.zip(rhythms) {
        // How often a value is repeated that stands is not how often it is asked for.
        if let (None, Some(rate), false) = (&written.rate, rhythm.rate_hz, signal.holds) {
            written.rate = Some(text(format!("{} Hz", to_digits(rate, 3, f64::round))));
        }
        let gap = rhythm.longest_gap_s.unwrap_or(0.0);
        if signal.timeout.is_some_and(|timeout| timeout.seconds() < gap) {
            written.timeout = Some(text(format!("{} s", rounded_up(TIMEOUT_FACTOR * gap))));
        }
        let hold = rhythm.longest_hold_s.unwrap_or(0.0);
        let frozen_after = match signal.limits.frozen_after {
            Some(most) => (most.seconds() <= hold).then_some(HOLD_FACTOR * hold),
            None if written.frozen_after.is_none() && !signal.holds => rhythm.frozen_after_s,
            None => None,
        };
        if let Some(seconds) = frozen_after {
            written.frozen_after = Some(text(format!("{} s", rounded_up(seconds))));
        }
    }
    for (id, variable) in knowledge.variables().enumerate() {
        let fastest = knowledge
            .carriers(id)
            .iter()
            .filter_map(|&signal| Some(rhythms.get(signal.index())?.fastest? * scale(knowledge, signal)));
        let fastest = fastest.fold(0.0, f64::max);
        let is_exceeded = variable.max_rate.is_some_and(|most| most < fastest);
        let unit = variable.unit.as_ref().map_or(1.0, |unit| unit.to_si_difference(1.0).abs());
        let written = draft.variables.iter_mut().find(|it| it.name.text == variable.name);
        for written in written.into_iter().filter(|_| is_exceeded) {
            written.max_rate = Some(text(rounded_up(RATE_FACTOR * fastest / unit).to_string()));
        }
    }
    draft
}

/// The model with the noise of signals where none is declared: their standard deviations, by the number of the parameter.
pub(super) fn with_noise(
    mut draft: Draft,
    parameters: &[Parameter],
    deviation: impl Fn(usize) -> Option<f64>,
) -> Draft {
    for (number, parameter) in parameters.iter().enumerate() {
        let Parameter::Signal(signal) = *parameter else { continue };
        let Some(noise) = deviation(number).filter(|it| *it > 0.0) else { continue };
        let written = draft.signals.iter_mut().skip(signal.index()).take(1);
        written
            .filter(|it| it.noise.is_none())
            .for_each(|it| it.noise = Some(text(rounded_up(noise).to_string())));
    }
    draft
}

/// A positive number, rounded up to three digits.
pub(super) fn rounded_up(value: f64) -> f64 {
    // A tiny excess in the last bits must not round up by a whole digit.
    to_digits(value * (1.0 - 1e-9), 3, f64::ceil)
}

fn to_digits(value: f64, digits: i32, round: fn(f64) -> f64) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    let below = digits - 1 - value.log10().floor() as i32;
    // The decimal form guarantees that only these digits are written.
    let whole = round(value * 10.0_f64.powi(below));
    format!("{whole}e{}", -below).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_rounded_up_to_three_digits() {
        let check = |value: f64, expected: &str| assert_eq!(rounded_up(value).to_string(), expected);
        check(0.123_41, "0.124");
        check(0.123, "0.123");
        check(1.0 / 3.0, "0.334");
        check(98_760.0, "98800");
        check(1.234e-7, "0.000000124");
        check(0.0, "0");
    }
}
