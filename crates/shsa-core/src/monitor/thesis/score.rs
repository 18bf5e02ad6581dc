//! The published score: the disagreements of every two substitutions, summed and filtered.
//!
//! Of every two substitutions, every two outputs that overlap in time are compared; the error of a pair, `max(0, max(lows) -
//! min(highs))`, is added to both substitutions. The sums pass an average, then a median filter; the substitution with the
//! highest error above zero has failed. Source: D. Ratasich, M. Platzer, R. Grosu, E. Bartocci, "Adaptive Fault Detection
//! exploiting Redundancy with Uncertainties in Space and Time", SASO 2019, arXiv:1903.04326; D. Ratasich, "Self-Healing
//! Cyber-Physical Systems", TU Wien 2019, chapter 5.
//!
//! The method is kept exactly, except for errors of the public program: a tie names no substitution, and an output without a
//! value never agrees with anything (its own error is infinite, and no other substitution is blamed for it). Variables that wrap,
//! which the publications do not mention, are compared the shorter way round.

use crate::circle;
use crate::interval::Interval;
use crate::time::{Time, Validity};
use alloc::vec::Vec;

/// One output of a substitution in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThesisOutput {
    /// The index of the substitution.
    pub substitution: usize,
    /// The value; empty when an input has none.
    pub value: Interval,
    /// The intersection of the inputs' times; `None` for inputs without times, which overlap everything.
    pub validity: Option<Validity>,
}

/// The lengths of buffer and filters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ThesisOptions {
    /// Steps whose observations are combined; 1 takes only the new ones.
    pub buffer: usize,
    /// Errors over which the average is taken; 1 for no average.
    pub average: usize,
    /// Averages over which the median is taken; 1 for no median.
    pub median: usize,
}

impl Default for ThesisOptions {
    fn default() -> ThesisOptions {
        ThesisOptions { buffer: 1, average: 1, median: 1 }
    }
}

/// The result of a step.
#[derive(Clone, Debug, PartialEq)]
pub struct ThesisStep {
    /// The end of the step.
    pub time: Time,
    /// The outputs of the substitutions.
    pub outputs: Vec<ThesisOutput>,
    /// Filtered error of each substitution.
    pub errors: Vec<f64>,
    /// The substitution with the highest error, where that is above zero and unique.
    pub failed: Option<usize>,
    /// Whether the step left out combinations of inputs: the errors are from a part of them.
    pub truncated: bool,
}

/// The errors of the substitutions over time.
#[derive(Clone, Debug)]
pub struct ThesisMonitor {
    filters: Vec<Filter>,
    turn: Option<f64>,
}

impl ThesisMonitor {
    /// The monitor of this many substitutions of a variable that wraps after a `turn`, SI; `None` if it does not wrap.
    #[must_use]
    pub fn new(substitutions: usize, turn: Option<f64>, options: ThesisOptions) -> ThesisMonitor {
        ThesisMonitor { filters: (0..substitutions).map(|_| Filter::new(options)).collect(), turn }
    }

    /// Compares the outputs of one step. Complexity: O(o^2) for o outputs.
    pub fn step(&mut self, time: Time, outputs: Vec<ThesisOutput>) -> ThesisStep {
        let sums = summed_errors(&outputs, self.filters.len(), self.turn);
        let errors: Vec<f64> =
            self.filters.iter_mut().zip(sums).map(|(filter, sum)| filter.pass(sum)).collect();
        let failed = sole_highest(&errors);
        ThesisStep { time, outputs, errors, failed, truncated: false }
    }
}

fn summed_errors(outputs: &[ThesisOutput], substitutions: usize, turn: Option<f64>) -> Vec<f64> {
    let mut sums = Vec::new();
    sums.resize(substitutions, 0.0);
    let mut add = |to: usize, error: f64| {
        if let Some(sum) = sums.get_mut(to) {
            *sum += error;
        }
    };
    for (at, one) in outputs.iter().enumerate() {
        if one.value.is_empty() {
            add(one.substitution, f64::INFINITY);
            continue;
        }
        for other in outputs.iter().skip(at + 1).filter(|other| comparable(one, other)) {
            let beside = turn.map_or(other.value, |turn| circle::nearest(other.value, one.value, turn));
            let error = one.value.distance(beside);
            add(one.substitution, error);
            add(other.substitution, error);
        }
    }
    sums
}

fn comparable(one: &ThesisOutput, other: &ThesisOutput) -> bool {
    let overlap = match (one.validity, other.validity) {
        (Some(one), Some(other)) => one.intersection(other).is_some(),
        _ => true,
    };
    overlap && one.substitution != other.substitution && !other.value.is_empty()
}

fn sole_highest(errors: &[f64]) -> Option<usize> {
    let highest = errors.iter().copied().fold(0.0, f64::max);
    let mut at_top = errors.iter().enumerate().filter(|(_, error)| **error == highest);
    match (at_top.next(), at_top.next()) {
        (Some((at, _)), None) if highest > 0.0 => Some(at),
        _ => None,
    }
}

/// An average, then a median, over the last few errors (fewer at the start).
#[derive(Clone, Debug)]
struct Filter {
    errors: Recent,
    averages: Recent,
}

impl Filter {
    fn new(options: ThesisOptions) -> Filter {
        Filter { errors: Recent::new(options.average), averages: Recent::new(options.median) }
    }

    fn pass(&mut self, error: f64) -> f64 {
        self.errors.push(error);
        self.averages.push(self.errors.mean());
        self.averages.median()
    }
}

/// The last few numbers, oldest first.
#[derive(Clone, Debug)]
struct Recent {
    numbers: Vec<f64>,
    most: usize,
}

impl Recent {
    fn new(most: usize) -> Recent {
        Recent { numbers: Vec::new(), most: most.max(1) }
    }

    fn push(&mut self, number: f64) {
        if self.numbers.len() == self.most {
            self.numbers.remove(0);
        }
        self.numbers.push(number);
    }

    fn mean(&self) -> f64 {
        self.numbers.iter().sum::<f64>() / self.numbers.len() as f64
    }

    fn median(&self) -> f64 {
        let mut sorted = self.numbers.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let at = |index: usize| sorted.get(index).copied().unwrap_or(0.0);
        let middle = sorted.len() / 2;
        if sorted.len() % 2 == 1 { at(middle) } else { (at(middle.wrapping_sub(1)) + at(middle)) / 2.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    fn outputs(values: &[Interval]) -> Vec<ThesisOutput> {
        let output = |(substitution, &value)| ThesisOutput { substitution, value, validity: None };
        values.iter().enumerate().map(output).collect()
    }

    #[test]
    fn the_highest_error_has_failed() {
        let mut monitor = ThesisMonitor::new(3, None, ThesisOptions::default());
        let values = [Interval::new(9.0, 11.0), Interval::new(9.8, 10.2), Interval::new(11.5, 12.5)];
        let step = monitor.step(Time(0), outputs(&values));
        assert_eq!(step.failed, Some(2));
        assert_eq!(step.errors[0], 0.5);
    }

    #[test]
    fn what_wraps_is_compared_the_shorter_way_round() {
        let mut monitor = ThesisMonitor::new(3, Some(360.0), ThesisOptions::default());
        let values = [359.0, 1.0, 11.0].map(Interval::point);
        assert_eq!(monitor.step(Time(0), outputs(&values)).errors, [14.0, 12.0, 22.0]);
    }

    #[test]
    fn a_tie_names_nobody() {
        let mut monitor = ThesisMonitor::new(2, None, ThesisOptions::default());
        let step = monitor.step(Time(0), outputs(&[Interval::point(1.0), Interval::point(2.0)]));
        assert_eq!((step.errors, step.failed), (vec![1.0, 1.0], None));
    }

    #[test]
    fn not_a_number_agrees_with_nothing() {
        let mut monitor = ThesisMonitor::new(3, None, ThesisOptions::default());
        let values = [Interval::point(1.0), Interval::point(f64::NAN), Interval::point(1.0)];
        let step = monitor.step(Time(0), outputs(&values));
        assert_eq!((step.errors, step.failed), (vec![0.0, f64::INFINITY, 0.0], Some(1)));
    }

    #[test]
    fn filters_average_then_take_the_median() {
        let options = ThesisOptions { average: 2, median: 3, ..ThesisOptions::default() };
        let mut monitor = ThesisMonitor::new(2, None, options);
        let mut second = |other: f64| {
            let step = monitor.step(Time(0), outputs(&[Interval::point(0.0), Interval::point(other)]));
            step.errors[1]
        };
        assert_eq!([0.0, 0.0, 1.0, 0.0, 1.0].map(&mut second), [0.0, 0.0, 0.0, 0.5, 0.5]);
    }
}
