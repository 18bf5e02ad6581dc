//! The model under measurement, and the values of its sensors.

use shsa_core::time::{Span, Time};
use std::fmt::Write;

/// The period of the wave.
const WAVE: Span = Span::from_millis(2_000);
/// The size of a wrong value's error; the declared errors are 0.1.
pub(super) const LIE: f64 = 50.0;

/// Variables that are each carried by the same number of signals; each is needed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plan {
    pub(super) variables: usize,
    /// Signals of each variable; the first one serves the need while it is trusted.
    pub(super) signals: usize,
    /// The timeout of each signal, milliseconds.
    pub(super) timeout_ms: u32,
    /// How old a value may be, milliseconds.
    pub(super) age_ms: u32,
    /// The probation of a signal, milliseconds.
    pub(super) probation_ms: u32,
}

impl Plan {
    /// For measurements without faults: no timeout expires while they last.
    pub(super) fn calm(variables: usize, signals: usize) -> Plan {
        Plan { variables, signals, timeout_ms: 60_000, age_ms: 60_000, probation_ms: 5_000 }
    }

    /// The model as text.
    pub(super) fn text(&self) -> String {
        let mut text = "shsa: 1\nvariables:\n".to_owned();
        // Writing to a string cannot fail.
        for variable in 0..self.variables {
            let _ = writeln!(text, "  v{variable}: {{}}");
        }
        text.push_str("signals:\n");
        for (variable, signal) in self.all() {
            let (source, timeout) = (topic(variable, signal), self.timeout_ms);
            let _ = writeln!(
                text,
                "  {}: {{ variable: v{variable}, source: {source}, value_error: 0.1, timeout: {timeout} ms, \
                 properties: {{ accuracy: {} }} }}",
                name(variable, signal),
                1.0 - 0.1 * signal as f64
            );
        }
        text.push_str("needs:\n");
        for variable in 0..self.variables {
            let (age, probation) = (self.age_ms, self.probation_ms);
            let need = need(variable);
            let _ = writeln!(
                text,
                "  v{variable}: {{ signal: {need}, max_age: {age} ms, hold: {probation} ms, probation: {probation} ms }}"
            );
        }
        text
    }

    /// Each signal as the number of its variable and its number among that variable's signals.
    pub(super) fn all(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let Plan { variables, signals, .. } = *self;
        (0..variables).flat_map(move |variable| (0..signals).map(move |signal| (variable, signal)))
    }

    /// The topics of all needs.
    pub(super) fn needs(&self) -> impl Iterator<Item = String> + use<> {
        (0..self.variables).map(need)
    }
}

/// The name of a signal.
pub(super) fn name(variable: usize, signal: usize) -> String {
    format!("v{variable}s{signal}")
}

/// The topic of a signal.
pub(super) fn topic(variable: usize, signal: usize) -> String {
    format!("bench/v{variable}/s{signal}")
}

/// The topic of a need.
pub(super) fn need(variable: usize) -> String {
    format!("healed/v{variable}")
}

/// The value of every signal of a variable: a triangular wave between 10 and 10.05, which moves far less than the errors.
pub(super) fn value(now: Time) -> f64 {
    let phase = now.0.rem_euclid(WAVE.0) as f64 / WAVE.0 as f64;
    10.0 + 0.1 * (phase - 0.5).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_is_one() {
        let loaded = shsa_model::load(&Plan::calm(3, 2).text(), "m.yaml");
        assert_eq!(loaded.report.render(false), "");
        let known = loaded.knowledge;
        assert_eq!((known.variables().len(), known.signals().len(), known.needs().len()), (3, 6, 3));
    }

    #[test]
    fn the_wave_is_small_and_moves() {
        let values: Vec<f64> = (0..200).map(|at| value(Time(at * 10_000_000))).collect();
        assert!(values.iter().all(|value| (10.0..=10.05).contains(value)));
        assert!(values.windows(2).all(|pair| pair[0] != pair[1]));
    }
}
