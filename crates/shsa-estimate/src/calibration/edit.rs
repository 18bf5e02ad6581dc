//! Models changed to try something, and the model with what was found.

use super::{Bounds, Fitted, Parameter, Problem};
use crate::rhythm::Rhythm;
use shsa_core::knowledge::{Draft, Id, IdVec, KnowledgeBase, Severity, SignalId, Text, build};
use shsa_core::time::Span;

/// The error, in the unit of a parameter, with which its effect is tried.
pub(super) const PROBE: f64 = 1e-3;

/// A signal that was away for longer than its time-out although all was well gets this many times that gap.
const TIMEOUT_FACTOR: f64 = 2.0;

/// The model without the errors that are fitted, and with what is tried instead.
#[derive(Clone)]
pub(super) struct Trial {
    pub(super) parameters: Vec<Parameter>,
    /// How much each signal shows too much, and how much more the right side of a relation gives than the left, by
    /// parameter in its unit.
    pub(super) offsets: Vec<f64>,
    /// How much later each tells than the model says.
    pub(super) delays: IdVec<SignalId, Span>,
    /// What the model says.
    pub(super) known: IdVec<SignalId, Span>,
    /// Plus-minus on the time of each signal; zero leaves what the model says.
    pub(super) time_errors: IdVec<SignalId, Span>,
    /// What part of the value each error has besides, by parameter, in percent; only without an offset.
    pub(super) shares: Vec<f64>,
    /// The parameter that has an error of [`PROBE`].
    pub(super) probe: Option<Parameter>,
    /// The errors that are tried, by parameter; `None` leaves one as the model has it; 0 at first.
    pub(super) errors: Vec<Option<f64>>,
}

impl Trial {
    pub(super) fn new(parameters: &[Parameter], knowledge: &KnowledgeBase) -> Trial {
        let count = knowledge.signals().len();
        Trial {
            parameters: parameters.to_vec(),
            offsets: vec![0.0; parameters.len()],
            delays: IdVec::filled(count, |_| Span::ZERO),
            known: IdVec::filled(count, |signal| knowledge.signals()[signal].delay),
            time_errors: IdVec::filled(count, |_| Span::ZERO),
            shares: vec![0.0; parameters.len()],
            probe: None,
            errors: vec![Some(0.0); parameters.len()],
        }
    }

    pub(super) fn applied(&self, draft: &Draft) -> Draft {
        let mut draft = draft.clone();
        for (number, parameter) in self.parameters.iter().enumerate() {
            let Some(error) = self.errors[number] else { continue };
            let error = if self.probe == Some(*parameter) { PROBE } else { error };
            set_error(&mut draft, *parameter, around(-self.offsets[number], error, self.shares[number]));
        }
        for (signal, error) in self.time_errors.enumerate().filter(|(_, error)| **error > Span::ZERO) {
            set_time_error(&mut draft, signal, *error);
        }
        for (signal, delay) in self.delays.enumerate().filter(|(_, delay)| **delay > Span::ZERO) {
            set_delay(&mut draft, signal, self.known[signal] + *delay);
        }
        draft
    }
}

/// Builds a draft that should be right.
pub(super) fn built(draft: &Draft) -> Result<KnowledgeBase, Problem> {
    let (knowledge, found) = build(draft);
    match found.into_iter().find(|it| it.severity == Severity::Error) {
        Some(error) => Err(Problem::Model(error.message)),
        None => Ok(knowledge),
    }
}

/// SI for one of a signal's unit, as a difference.
pub(super) fn scale(knowledge: &KnowledgeBase, signal: SignalId) -> f64 {
    knowledge.signals()[signal].unit.as_ref().map_or(1.0, |unit| unit.to_si_difference(1.0).abs())
}

fn text(text: String) -> Text {
    Text { text, ..Text::default() }
}

fn around(middle: f64, error: f64, percent: f64) -> Bounds {
    if middle == 0.0 {
        let share = if percent > 0.0 { format!(" + {percent} %") } else { String::new() };
        return Bounds::One(text(format!("{error}{share}")));
    }
    // Twelve digits: the last bits of a difference say nothing.
    let plain = |value: f64| format!("{value:.11e}").parse().unwrap_or(value).to_string();
    Bounds::Two(text(plain(middle - error)), text(plain(middle + error)))
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

/// Sets how old a signal's content is, in milliseconds.
fn set_delay(draft: &mut Draft, signal: SignalId, delay: Span) {
    let written = text(format!("{} ms", delay.seconds() * 1e3));
    draft.signals.iter_mut().skip(signal.index()).take(1).for_each(|it| it.delay = Some(written.clone()));
}

/// Sets how wrong the time of a signal may be, to either side.
fn set_time_error(draft: &mut Draft, signal: SignalId, error: Span) {
    let written = Bounds::One(text(format!("{} ms", error.seconds() * 1e3)));
    draft
        .signals
        .iter_mut()
        .skip(signal.index())
        .take(1)
        .for_each(|it| it.time_error = Some(written.clone()));
}

/// The model with what was found: errors rounded up to three digits, offsets to a thousandth of the errors.
///
/// A rate is written where there was none, a time-out only where it is shorter than a gap that was seen.
pub(super) fn patched(
    draft: &Draft,
    fitted: &[Fitted],
    time_errors: &IdVec<SignalId, Span>,
    rhythms: &[Rhythm],
    knowledge: &KnowledgeBase,
) -> Draft {
    let mut draft = draft.clone();
    for one in fitted.iter().filter(|it| it.error.is_some() || it.offset != 0.0) {
        let error = rounded_up(one.error.unwrap_or(0.0));
        let step = if error > 0.0 { 10.0_f64.powf(error.log10().floor() - 3.0) } else { 1e-12 };
        let middle = -(one.offset / step).round() * step;
        set_error(&mut draft, one.parameter, around(middle, error, one.percent));
    }
    for (signal, error) in time_errors.enumerate().filter(|(_, error)| **error > Span::ZERO) {
        set_time_error(&mut draft, signal, *error);
    }
    for one in fitted.iter().filter(|it| it.delay > Span::ZERO) {
        if let Parameter::Signal(signal) = one.parameter {
            set_delay(&mut draft, signal, knowledge.signals()[signal].delay + one.delay);
        }
    }
    let signals = draft.signals.iter_mut().zip(knowledge.signals().iter());
    for ((written, signal), rhythm) in signals.zip(rhythms) {
        if let (None, Some(rate)) = (&written.rate, rhythm.rate_hz) {
            written.rate = Some(text(format!("{} Hz", to_digits(rate, 3, f64::round))));
        }
        let gap = rhythm.longest_gap_s.unwrap_or(0.0);
        if signal.timeout.is_some_and(|timeout| timeout.seconds() < gap) {
            written.timeout = Some(text(format!("{} s", rounded_up(TIMEOUT_FACTOR * gap))));
        }
    }
    draft
}

/// A positive number with three digits, no smaller than it was.
fn rounded_up(value: f64) -> f64 {
    // What is a little above for no other reason than its last bits need not go up by a whole digit.
    to_digits(value * (1.0 - 1e-9), 3, f64::ceil)
}

fn to_digits(value: f64, digits: i32, round: fn(f64) -> f64) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    let below = digits - 1 - value.log10().floor() as i32;
    // Through its decimal form, so that it is written with these digits and no more.
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
