//! Contracts inside the search for substitutions: branches that contracts cannot admit are pruned, and each answer is admitted.

use super::assessments::Read;
use super::{Assurance, Verdict};
use crate::knowledge::{IdVec, KnowledgeBase, NeedId, RelationSet, SignalId, SignalSet, VariableId, Watched};
use crate::plan::Admission;
use crate::substitution::{Step, Substitution, Way};
use alloc::vec::Vec;
use core::fmt;

/// How many choices of signals are tried for one substitution.
const MOST_CHOICES: usize = 256;

/// The ways that contracts admit for a need under the current evidence.
pub struct Search<'a> {
    knowledge: &'a KnowledgeBase,
    assurance: &'a Assurance,
    need: NeedId,
    read: Read<'a>,
    /// Signals that may not be used, ascending.
    lost: &'a [SignalId],
    /// Signals and relations on which no admissible way rests.
    barred: (SignalSet, RelationSet),
    /// Variables that no admissible way gives.
    unobtainable: IdVec<VariableId, bool>,
}

impl<'a> Search<'a> {
    /// Prepares a search; `lost` signals (ascending) are not used.
    ///
    /// Complexity: that of [`Assurance::barred`], and O(model) for each step on the longest way to a variable that no admissible
    /// way gives.
    #[must_use]
    pub fn new(
        knowledge: &'a KnowledgeBase,
        assurance: &'a Assurance,
        need: NeedId,
        read: Read<'a>,
        lost: &'a [SignalId],
    ) -> Search<'a> {
        let sink = knowledge.needs()[need].variable;
        let nothing = Substitution { sink, steps: Vec::new(), sources: Vec::new() };
        let nothing = Way { substitution: nothing, signals: Vec::new() };
        let truth = |contract, watched: &Watched| read(contract, watched, &nothing).truth;
        let barred = assurance.barred(knowledge, need, truth);
        let unobtainable = IdVec::filled(knowledge.variables().len(), |_| true);
        let mut search = Search { knowledge, assurance, need, read, lost, barred, unobtainable };
        search.find_obtainable();
        search
    }

    /// Finds the variables that can be obtained at all: by a signal that is not barred, or by a relation whose inputs can all be
    /// obtained.
    fn find_obtainable(&mut self) {
        let mut has_changed = true;
        while core::mem::take(&mut has_changed) {
            for variable in self.knowledge.variables().ids() {
                if self.unobtainable[variable] && self.gives(variable) {
                    self.unobtainable[variable] = false;
                    has_changed = true;
                }
            }
        }
    }

    fn gives(&self, variable: VariableId) -> bool {
        let by_signal = self.knowledge.carriers(variable).iter().any(|&signal| self.may_use(signal));
        let steps = self.knowledge.producers(variable).iter();
        let mut steps = steps.map(|&relation| Step { relation, output: variable });
        self.knowledge.variables()[variable].constant.is_some()
            || by_signal
            || steps.any(|step| self.may_take(&step))
    }

    fn is_usable(&self, signal: SignalId) -> bool {
        self.knowledge.is_available(signal) && self.lost.binary_search(&signal).is_err()
    }

    fn may_use(&self, signal: SignalId) -> bool {
        self.is_usable(signal) && !self.barred.0.contains(signal)
    }

    fn may_take(&self, step: &Step) -> bool {
        let relation = &self.knowledge.relations()[step.relation];
        !self.barred.1.contains(step.relation) && relation.needs(step.output).all(|it| !self.unobtainable[it])
    }

    /// Whether a way is admitted: its certificates hold under the current evidence.
    #[must_use]
    pub fn admits_way(&self, way: &Way) -> bool {
        if way.inputs().any(|signal| self.barred.0.contains(signal)) {
            return false;
        }
        let composition = self.assurance.compose(self.knowledge, self.need, way);
        let mut evaluation = composition.evaluation();
        let known = composition.evidence(self.knowledge);
        let known = known.map(|(id, contract, watched)| (id, (self.read)(contract, watched, way).truth));
        evaluation.set_all(composition.system(), known);
        composition.assess(&evaluation).verdict == Verdict::Holds
    }
}

impl Admission for Search<'_> {
    fn may_admit(&self, steps: &[Step]) -> bool {
        steps.iter().all(|step| self.may_take(step))
    }

    fn admits(&self, substitution: &Substitution) -> bool {
        let ways = Way::choices(self.knowledge, substitution, |signal| self.may_use(signal), MOST_CHOICES);
        self.may_admit(&substitution.steps) && ways.iter().any(|way| self.admits_way(way))
    }
}

impl fmt::Debug for Search<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("Search")
            .field("need", &self.need)
            .field("barred", &self.barred)
            .finish_non_exhaustive()
    }
}
