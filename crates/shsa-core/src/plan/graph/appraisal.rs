//! The utility of a way: its substitution, rated with the signals that it reads instead of the best ones.

use super::{Graph, Options, Status, View};
use crate::knowledge::{RelationId, SignalId, VariableId};
use crate::plan::utility::Weight;
use crate::substitution::Way;
use alloc::collections::BTreeMap;
use alloc::vec::Vec;

/// Rates ways while some signals are lost.
pub struct Appraisal<'a> {
    view: View<'a>,
    lost: Vec<SignalId>,
}

impl<'a> Appraisal<'a> {
    /// The appraisal with all available signals of the graph but the lost ones (ascending).
    #[must_use]
    pub fn new(graph: &'a Graph, lost: &[SignalId]) -> Appraisal<'a> {
        let options = Options { forbidden_signals: lost.to_vec(), ..Options::default() };
        Appraisal { view: View::new(graph, &options), lost: lost.to_vec() }
    }

    /// The utility of a way: that of its substitution if no other signals carried its sources.
    ///
    /// A signal without a given accuracy counts as exact as the least exact usable signal beside it: an unknown accuracy is not
    /// good. So the best way of a substitution has the substitution's own utility (where one signal is the best in every
    /// respect), and no way a higher one, unless a formula prefers less exact inputs.
    ///
    /// Complexity: O(inputs of its relations, each times the signals of a variable).
    #[must_use]
    pub fn utility(&self, way: &Way) -> f64 {
        let graph = self.view.graph();
        let scale = graph.scale();
        // A relation that is used for several outputs counts once, with its worst rating.
        let mut weights: BTreeMap<RelationId, Weight> = BTreeMap::new();
        for step in &way.substitution.steps {
            let weight = graph.weight(step.relation, step.output, |input| self.status(way, input));
            let counted = weights.entry(step.relation).or_default();
            *counted = weight.max(*counted);
        }
        let sources = way.substitution.sources.iter().map(|&source| self.status(way, source).weight);
        scale.utility(scale.join_all(weights.into_values().chain(sources)))
    }

    /// The status of a variable as the way reads it.
    fn status(&self, way: &Way, variable: VariableId) -> Status {
        let best = self.view.status(variable);
        let place = way.substitution.sources.binary_search(&variable).ok();
        let Some(signal) = place.and_then(|at| way.signals.get(at).copied().flatten()) else { return best };
        let graph = self.view.graph();
        let usable = || {
            let carriers = graph.carriers.row(variable).iter();
            carriers.filter(|carrier| carrier.available && self.lost.binary_search(&carrier.signal).is_err())
        };
        let Some(chosen) = graph.carriers.row(variable).iter().find(|carrier| carrier.signal == signal)
        else {
            return best;
        };
        let least = || usable().filter_map(|carrier| carrier.accuracy).reduce(f64::min);
        let accuracy = graph.variables[variable].own_accuracy.or(chosen.accuracy).or_else(least);
        Status { accuracy, weight: chosen.weight, ..best }
    }
}
