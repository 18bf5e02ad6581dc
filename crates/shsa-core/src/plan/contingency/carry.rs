//! Carries plans of a table over to the successor of its knowledge base.
//!
//! The preparation of a variable depends only on the elements that its searches have read, on their order, and on the derivations
//! of the signals among them. Where all of this is unchanged, a new preparation would be the old one with other ids, to the last
//! number.

use super::super::Requirements;
use super::super::graph::{Graph, Options};
use super::derivation::Derivations;
use super::prepare::{Preparation, Prepared};
use crate::knowledge::{IdVec, Lineage, SignalId, VariableId};
use crate::substitution::{Step, Substitution};

impl Preparation {
    /// The preparation with the new ids; removed elements need not be forbidden any more.
    pub(super) fn succeeded(self, lineage: &Lineage) -> Preparation {
        let signals = self.options.forbidden_signals.iter().filter_map(|&signal| lineage.namesake(signal));
        let relations =
            self.options.forbidden_relations.iter().filter_map(|&relation| lineage.relation(relation));
        let suspects =
            self.requirements.independent_of.iter().filter_map(|&suspect| lineage.namesake(suspect));
        Preparation {
            requirements: Requirements { independent_of: suspects.collect(), ..self.requirements },
            options: Options {
                forbidden_signals: signals.collect(),
                forbidden_relations: relations.collect(),
                ..self.options
            },
            ..self
        }
    }
}

/// The change from one knowledge base to the next.
pub(super) struct Succession<'a> {
    lineage: &'a Lineage,
    /// The variables about which searches read the same.
    lasting: IdVec<VariableId, bool>,
    keeps_ids: bool,
}

impl<'a> Succession<'a> {
    /// Compares both knowledge bases. Complexity: O(model).
    pub(super) fn new(
        before: (&Graph, &Derivations),
        after: (&Graph, &Derivations),
        lineage: &'a Lineage,
    ) -> Succession<'a> {
        let ((old, derivations), (new, new_derivations)) = (before, after);
        let mut lasting = old.lasting(new, lineage);
        for signal in derivations.changed(new_derivations, lineage, old.signals()) {
            old.carried(signal).into_iter().for_each(|variable| lasting[variable] = false);
        }
        Succession { lineage, lasting, keeps_ids: lineage.keeps_ids() }
    }

    /// The successor of a complete preparation; `None` when it must be made again.
    pub(super) fn carried(&self, prepared: Prepared) -> Option<Prepared> {
        let lasts = prepared.complete && prepared.reads.iter().all(|&read| self.lasting[read]);
        if !lasts || self.keeps_ids {
            return lasts.then_some(prepared);
        }
        self.renamed(prepared)
    }

    fn renamed(&self, mut prepared: Prepared) -> Option<Prepared> {
        for read in &mut prepared.reads {
            *read = self.lineage.variable(*read)?;
        }
        self.rename_signals(&mut prepared.events)?;
        for entry in &mut prepared.entries {
            self.rename_signals(&mut entry.lost)?;
            self.rename_signals(&mut entry.matters)?;
        }
        for plan in &mut prepared.plans {
            for (substitution, _) in &mut plan.substitutions {
                self.rename_substitution(substitution)?;
            }
        }
        let keeps_order = prepared.reads.is_sorted_by(|a, b| a < b)
            && prepared.entries.is_sorted_by(|a, b| a.lost < b.lost);
        keeps_order.then_some(prepared)
    }

    /// Returns `None` where the order is not kept.
    fn rename_signals(&self, signals: &mut [SignalId]) -> Option<()> {
        for signal in &mut *signals {
            *signal = self.lineage.namesake(*signal)?;
        }
        signals.is_sorted_by(|a, b| a < b).then_some(())
    }

    /// The variables of a substitution are among those read.
    fn rename_substitution(&self, substitution: &mut Substitution) -> Option<()> {
        substitution.sink = self.lineage.variable(substitution.sink)?;
        for step in &mut substitution.steps {
            let (relation, output) =
                (self.lineage.relation(step.relation)?, self.lineage.variable(step.output)?);
            *step = Step { relation, output };
        }
        for source in &mut substitution.sources {
            *source = self.lineage.variable(*source)?;
        }
        Some(())
    }
}
