//! The state that needs choose their sources by: at a moment, over a change of the model, and after a restart.

use super::super::instruments::{Attested, Instruments};
use super::super::ready_sources::ReadySources;
use super::super::ways::{Lost, MOST, Source};
use crate::alignment::Sample;
use crate::assurance::{Assessments, Assurance, Ground, Search};
use crate::diagnosis::Judge;
use crate::knowledge::{KnowledgeBase, Lineage, NeedId, SignalId, Watched};
use crate::monitor::{Inheritance, Monitor};
use crate::plan::Graph;
use crate::reason::Reason;
use crate::substitution::Way;
use crate::time::Time;
use crate::trust::{Ledger, Trust};
use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;

/// The state that the sources of a need are chosen by.
pub(in super::super) struct Situation<'a> {
    pub(in super::super) knowledge: &'a KnowledgeBase,
    pub(in super::super) graph: &'a Graph,
    pub(in super::super) ready_sources: &'a ReadySources,
    pub(in super::super) monitor: &'a Monitor,
    pub(in super::super) judge: &'a Judge,
    pub(in super::super) ledger: &'a Ledger,
    /// What may not be used on each rung of trust, the strictest first: the first rung on which a need has a source counts. The
    /// last rung serves uncertain values only.
    pub(in super::super) lost: [Lost; Trust::RUNGS.len()],
    pub(in super::super) now: Time,
    /// The composition of contracts and the evidence from operators, where there are contracts.
    pub(in super::super) contracts: Option<(&'a Assurance, &'a Attested)>,
    /// Whether changed evidence of contracts is the occasion.
    pub(in super::super) is_about_contracts: bool,
    /// The order that is the occasion; `None` when the occasion is a change of trust.
    pub(in super::super) order: Option<Reason>,
}

impl Situation<'_> {
    /// What even uncertain values may not rest on.
    pub(super) fn possible(&self) -> &Lost {
        let [.., last] = &self.lost;
        last
    }

    /// The sources of a need without the excluded elements, whatever contracts say, best first.
    pub(super) fn sources(&self, need: NeedId, lost: &Lost) -> Arc<[Source]> {
        self.ready_sources.sources(self.knowledge, self.graph, need, lost)
    }

    /// The sources of a need with a contract, for each rung: the best that contracts admit now.
    ///
    /// Where the list of ready sources may be incomplete and some are refused, a search with the contracts inside finds more.
    pub(super) fn assess(
        &self,
        need: NeedId,
        contracts: &mut Assessments,
    ) -> [Arc<[Source]>; Trust::RUNGS.len()] {
        let Situation { knowledge, now, .. } = *self;
        let instruments = self.instruments();
        let read = |contract, watched: &Watched, way: &Way| instruments.read(contract, watched, way);
        let mut lists = self.lost.each_ref().map(|lost| self.sources(need, lost));
        self.consider(contracts, &lists);
        contracts.forget();
        contracts.settle(knowledge, &read, now);
        let is_met = |contracts: &Assessments, source: &Source| {
            contracts.admit(&source.way).is_some_and(|assured| assured.admitted().ground == Ground::Met)
        };
        let preferred: Vec<Way> = match lists.first() {
            Some(first) => first.iter().map(|it| it.way.clone()).collect(),
            None => Vec::new(),
        };
        let mut is_searched = false;
        for (list, lost) in lists.iter_mut().zip(&self.lost).take(Trust::RUNGS.len() - 1) {
            let is_full = list.len() >= MOST && !list.iter().all(|source| is_met(contracts, source));
            if let Some((assurance, _)) = self.contracts.filter(|_| is_full)
                && let Some(bounds) = contracts.bounds(knowledge, assurance, &read)
            {
                let search = Search::new(knowledge, assurance, need, &read, &lost.signals).within(bounds);
                let found = self.ready_sources.admitted(knowledge, self.graph, need, lost, &search);
                if !found.is_empty() {
                    (*list, is_searched) = (found, true);
                }
            }
        }
        if is_searched {
            self.consider(contracts, &lists);
            contracts.settle(knowledge, &read, now);
        }
        contracts.prefer(&preferred);
        lists.map(|list| {
            let is_admitted = |source: &&Source| contracts.admit(&source.way).is_some();
            list.iter().filter(is_admitted).cloned().collect()
        })
    }

    fn consider(&self, contracts: &mut Assessments, lists: &[Arc<[Source]>]) {
        for (list, trust) in lists.iter().zip(Trust::RUNGS) {
            contracts.consider(self.knowledge, self.assurance(), list.iter().map(|it| (&it.way, trust)));
        }
    }

    /// Assesses one more way, which may serve by order only.
    pub(super) fn assess_one(&self, contracts: &mut Assessments, way: &Way) {
        let instruments = self.instruments();
        let read = |contract, watched: &Watched, way: &Way| instruments.read(contract, watched, way);
        contracts.consider(self.knowledge, self.assurance(), core::iter::once((way, Trust::Suspect)));
        contracts.run(Some(way));
        contracts.settle(self.knowledge, &read, self.now);
    }

    /// The composition of contracts, where there are any.
    pub(in super::super) fn assurance(&self) -> Option<&Assurance> {
        self.contracts.map(|(assurance, _)| assurance)
    }

    /// The instruments that read evidence.
    pub(in super::super) fn instruments(&self) -> Instruments<'_> {
        let Situation { knowledge, monitor, judge, ledger, now, .. } = *self;
        let attested = self.contracts.map(|(_, attested)| attested);
        Instruments { knowledge, monitor, judge, ledger, attested, now }
    }
}

/// A change of the knowledge base, as the needs see it.
pub(in super::super) struct Succession<'a> {
    pub(in super::super) old: &'a KnowledgeBase,
    pub(in super::super) lineage: &'a Lineage,
    pub(in super::super) inheritance: &'a Inheritance,
    /// The situation in the changed model.
    pub(in super::super) situation: Situation<'a>,
}

impl Succession<'_> {
    /// Why the change takes a source away: elements that are gone, described anew or withdrawn, or else that it no longer serves.
    pub(super) fn lost_by(&self, way: &Way) -> Reason {
        let Succession { old, lineage, .. } = *self;
        let new = self.situation.knowledge;
        let name = |signal: SignalId| old.signals()[signal].name.clone();
        let signals =
            |is: &dyn Fn(SignalId) -> bool| way.inputs().filter(|&id| is(id)).map(name).collect::<Vec<_>>();
        let steps = way.substitution.steps.iter().filter(|step| lineage.relation(step.relation).is_none());
        let relations = steps.map(|step| old.relations()[step.relation].name.clone());
        let gone = signals(&|id| lineage.namesake(id).is_none());
        let names: Vec<String> = gone.into_iter().chain(relations).collect();
        let anew = signals(&|id| lineage.signal(id).is_none());
        let withdrawn = signals(&|id| lineage.signal(id).is_some_and(|signal| !new.is_available(signal)));
        match (names.is_empty(), anew.is_empty(), withdrawn.is_empty()) {
            (false, ..) => Reason::Gone { names },
            (_, false, _) => Reason::SignalsDescribedAnew { signals: anew },
            (.., false) => Reason::SignalsWithdrawn { signals: withdrawn },
            _ => Reason::ServesNoMore { source: way.describe(old) },
        }
    }
}

/// How a need was served before a restart; its times are not in the future.
#[derive(Clone, Debug, PartialEq)]
pub(in super::super) struct Resumption<'a> {
    /// The source, in words.
    pub(in super::super) source: Option<&'a str>,
    /// When the last switch happened.
    pub(in super::super) switched: Option<Time>,
    /// Whether an event has reported that nothing serves the need.
    pub(in super::super) unserved: bool,
    /// The last published value, and when it was published.
    pub(in super::super) last: Option<(Time, Sample)>,
}
