//! What of a table lives on when another knowledge base takes the place of its own.
//!
//! The preparation of a variable depends on nothing but what its searches have read, on the order in which that
//! stands, and on what is derived from the signals there. Where all this lasts, a preparation that were made anew would
//! be the old one with other ids, to the last number.

use super::super::Requirements;
use super::super::graph::{Graph, Options};
use super::derivation::Derivations;
use super::prepare::{Preparation, Prepared};
use crate::knowledge::{IdVec, Lineage, SignalId, VariableId};
use crate::substitution::{Step, Substitution};

impl Preparation {
    /// The same by other ids; what is gone need not be forbidden any more.
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

/// From one knowledge base to the next.
pub(super) struct Succession<'a> {
    lineage: &'a Lineage,
    /// About which variables searches read the same.
    lasting: IdVec<VariableId, bool>,
    keeps_ids: bool,
}

impl<'a> Succession<'a> {
    /// Compares. Complexity: O(model).
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

    /// What takes the place of a complete preparation; `None` when it must be made anew.
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

    /// `None` where the order is not kept.
    fn rename_signals(&self, signals: &mut [SignalId]) -> Option<()> {
        for signal in &mut *signals {
            *signal = self.lineage.namesake(*signal)?;
        }
        signals.is_sorted_by(|a, b| a < b).then_some(())
    }

    /// Its variables are among those that are read.
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
