//! How large an error of a sensor can be without any comparison showing it.

use super::world::{Relation, Signal, World};

/// At so many times a world is looked at.
const TIMES: i32 = 40;

impl World {
    /// The largest offset of a signal that some comparison may hide, SI: of another sensor of its variable, or of an equation of
    /// values of one moment whose variables all have sensors. `None` where there is no such comparison, or one that may hide any.
    pub(super) fn hidden(&self, liar: usize) -> Option<f64> {
        let signal = &self.signals[liar];
        let is_witness = |(at, it): &(usize, &Signal)| {
            *at != liar
                && it.variable == signal.variable
                && it.copies != Some(liar)
                && signal.copies != Some(*at)
        };
        let direct = self.signals.iter().enumerate().filter(is_witness);
        let direct = direct.map(|(at, _)| self.width(liar) + self.width(at)).reduce(f64::max);
        let by_relations = self.relations.iter().filter_map(|it| self.hidden_by(it, signal)).reduce(f64::max);
        let largest = direct.into_iter().chain(by_relations).reduce(f64::max)?;
        largest.is_finite().then_some(largest)
    }

    /// How far a value of a signal may be from the truth of a moment about which it is asked: its errors of value and time, and
    /// what the truth may do until its next value.
    fn width(&self, at: usize) -> f64 {
        let signal = &self.signals[at];
        let (lo, hi) = self.extremes(signal.variable);
        let share = 2.0 * signal.share * lo.abs().max(hi.abs());
        let steepest =
            self.variables[signal.variable].max_rate.unwrap_or_else(|| self.steepest(signal.variable));
        let times = signal.time_error.1 - signal.time_error.0 + 2.0 / signal.rate_hz + signal.mean_over;
        signal.error.1 - signal.error.0 + share + steepest * times
    }

    /// The widest sensor of a variable; `None` where it has none.
    fn widest(&self, variable: usize) -> Option<f64> {
        let of_variable = (0..self.signals.len()).filter(|it| self.signals[*it].variable == variable);
        of_variable.map(|it| self.width(it)).reduce(f64::max)
    }

    /// What an equation hides of a signal; `None` where it does not compare it.
    fn hidden_by(&self, relation: &Relation, signal: &Signal) -> Option<f64> {
        let (inputs, compute) = relation.computed.as_ref()?;
        let own = inputs.iter().position(|it| *it == signal.variable);
        if own.is_none() && relation.left != signal.variable {
            return None;
        }
        let widths: Vec<f64> = inputs.iter().map(|it| self.widest(*it)).collect::<Option<_>>()?;
        let left = self.widest(relation.left)?;
        let times = (0..=TIMES).map(|at| self.seconds * f64::from(at) / f64::from(TIMES));
        let hidden_at = |time: f64| {
            let truth: Vec<f64> = inputs.iter().map(|it| self.course(*it)(time)).collect();
            let hides = 2.0 * (spread(&truth, &widths, *compute) + left + relation.error);
            match own {
                Some(own) => smallest(&truth, own, *compute, hides),
                None => hides,
            }
        };
        Some(times.map(hidden_at).fold(0.0, f64::max))
    }
}

/// How far a computation moves when each of its inputs does by its width.
fn spread(truth: &[f64], widths: &[f64], compute: fn(&[f64]) -> f64) -> f64 {
    let corners = 0..1_u32 << truth.len();
    let at = |corner: u32| {
        let side = |at: usize| if corner >> at & 1 == 1 { widths[at] } else { -widths[at] };
        let values: Vec<f64> = truth.iter().enumerate().map(|(at, it)| it + side(at)).collect();
        compute(&values)
    };
    let middle = compute(truth);
    corners
        .map(|it| (at(it) - middle).abs())
        .fold(0.0, |most, it| if it.is_nan() { f64::INFINITY } else { it.max(most) })
}

/// The smallest change of an input, of either sign, from which on a computation moves by more than this; infinite where none does.
fn smallest(truth: &[f64], own: usize, compute: fn(&[f64]) -> f64, by: f64) -> f64 {
    let middle = compute(truth);
    let moves = |change: f64| {
        [change, -change].into_iter().all(|change| {
            let mut values = truth.to_vec();
            values[own] += change;
            let moved = (compute(&values) - middle).abs();
            moved.is_nan() || moved > by
        })
    };
    let scale = truth[own].abs().max(1e-3);
    (-20..20).map(|power| scale * 2.0_f64.powi(power)).find(|it| moves(*it)).unwrap_or(f64::INFINITY)
}
