//! Contracts inside the search for substitutions: each answer is admitted, and what contracts cannot admit is pruned.

use super::composition::{Along, Certified, Given};
use super::reading::Read;
use super::{Assurance, Bounds, Verdict};
use crate::interval::Truth;
use crate::knowledge::{KnowledgeBase, NeedId, SignalId, VariableId};
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
    bounds: Option<&'a Bounds>,
    /// A way of nothing, for evidence that is not about the way.
    nothing: Way,
}

impl<'a> Search<'a> {
    /// Prepares a search; `lost` signals (ascending) are not used. It reads only the evidence of the answers that it is asked
    /// about. O(1).
    #[must_use]
    pub fn new(
        knowledge: &'a KnowledgeBase,
        assurance: &'a Assurance,
        need: NeedId,
        read: Read<'a>,
        lost: &'a [SignalId],
    ) -> Search<'a> {
        let nothing =
            Substitution { sink: knowledge.needs()[need].variable, steps: Vec::new(), sources: Vec::new() };
        let nothing = Way { substitution: nothing, signals: Vec::new() };
        Search { knowledge, assurance, need, read, lost, bounds: None, nothing }
    }

    /// Prunes what these bounds, of the same need under the same evidence, bar: for a search in which contracts refuse the first
    /// answers.
    #[must_use]
    pub fn within(self, bounds: &'a Bounds) -> Search<'a> {
        Search { bounds: Some(bounds), ..self }
    }

    fn may_use(&self, signal: SignalId) -> bool {
        self.knowledge.is_available(signal)
            && self.lost.binary_search(&signal).is_err()
            && self.bounds.is_none_or(|bounds| bounds.may_use(signal))
    }

    /// Whether a way is admitted: its certificates hold under the current evidence.
    #[must_use]
    pub fn admits_way(&self, way: &Way) -> bool {
        if let Some(bounds) = self.bounds
            && !way.inputs().all(|signal| bounds.may_use(signal))
        {
            return false;
        }
        let along = Along::new(self.assurance, self.knowledge, way, self.read);
        match along.admits(self.need) {
            Truth::True => true,
            Truth::False => false,
            Truth::Unknown => self.is_met(way),
        }
    }

    /// The levels of a signal whose contract does not depend on the flow.
    fn levels(&self, signal: SignalId) -> Given {
        match self.assurance.sets.signals[signal] {
            Certified::Plain(levels) => Given::surely(levels),
            Certified::Flowing(_) => Given::UNKNOWN,
            Certified::Alone(id) => {
                Along::new(self.assurance, self.knowledge, &self.nothing, self.read).own_levels(id)
            }
        }
    }

    /// Whether a substitution by relations without contracts is admitted for sure: the need demands levels alone, which some
    /// signal of each source gives and each relation passes on.
    fn passes_on(&self, substitution: &Substitution) -> bool {
        let sets = &self.assurance.sets;
        let Some(demanded) = sets.needs[self.need].filter(|_| sets.healer.is_none()) else { return false };
        let passes = |step: &Step| matches!(sets.relations[step.relation], Certified::Plain(levels) if levels.has(demanded));
        let gives = |&signal: &SignalId| self.may_use(signal) && self.levels(signal).sure.has(demanded);
        let is_given = |&source: &VariableId| {
            self.knowledge.carriers(source).iter().any(gives)
                || self.knowledge.variables()[source].constant.is_some()
        };
        substitution.steps.iter().all(passes) && substitution.sources.iter().all(is_given)
    }

    /// As [`Search::admits_way`], by the composed certificates.
    fn is_met(&self, way: &Way) -> bool {
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
        self.bounds.is_none_or(|bounds| steps.iter().all(|step| bounds.may_take(self.knowledge, step)))
    }

    fn prunes(&self) -> bool {
        self.bounds.is_some_and(Bounds::prune)
    }

    fn admits(&self, substitution: &Substitution) -> bool {
        if self.passes_on(substitution) {
            return true;
        }
        let may_use = |signal| self.may_use(signal);
        let mut ways = Way::each_choice(self.knowledge, substitution, may_use).take(MOST_CHOICES);
        self.may_admit(&substitution.steps) && ways.any(|way| self.admits_way(&way))
    }
}

impl fmt::Debug for Search<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("Search")
            .field("need", &self.need)
            .field("lost", &self.lost)
            .field("bounds", &self.bounds.map(Bounds::barred))
            .finish_non_exhaustive()
    }
}
