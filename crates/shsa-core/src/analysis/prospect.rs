//! Assesses contracts before a run: the ways that may serve each need, their levels and conditions, and the effect of each loss.

use crate::assurance::{Admitted, Assessment, Assurance, Composition, EvidenceId, Ground, Sets, Verdict};
use crate::interval::Truth;
use crate::knowledge::{
    ContractId, EvidenceSource, KnowledgeBase, NeedId, Policy, SignalId, SignalSet, Watched,
};
use crate::plan::{self, Graph, Limits, Options, Requirements, StopReason};
use crate::substitution::Way;
use alloc::vec::Vec;

/// At most this many ways are assessed, the best first.
const MOST_WAYS: usize = 32;
/// At most this many choices of signals for one substitution.
const MOST_CHOICES: usize = 8;
/// At most this many evaluations for each question about minimal sets.
const MOST_EVALUATIONS: usize = 2_000;

/// The ways that may serve a need under its contract.
#[derive(Clone, Debug)]
pub struct Prospect {
    /// The need.
    pub need: NeedId,
    /// The ways, the best first.
    pub ways: Vec<Candidacy>,
    /// For each loss of a signal: the place of the best way that is admissible then.
    pub losses: Vec<(SignalId, Option<usize>)>,
    /// Whether these are all ways.
    pub is_complete: bool,
}

/// What serves a need: the place of the way, on which ground, and at which level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Serving {
    /// The way's place.
    pub way: usize,
    /// As contracts and the need's policy admit it.
    pub admitted: Admitted,
}

/// A piece of evidence, and what serves a need once it fails while all else is as it should be.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// Who observes it.
    pub contract: ContractId,
    /// What is observed.
    pub watched: Watched,
    /// What serves the need then; `None` where nothing does.
    pub then: Option<Serving>,
}

/// A way that may serve a need, with its contracts.
#[derive(Clone, Debug)]
pub struct Candidacy {
    /// The way.
    pub way: Way,
    /// Its utility.
    pub utility: f64,
    /// The composed contracts of all participants.
    pub composition: Composition,
    /// The assessment while all evidence is good.
    pub at_best: Assessment,
    /// Minimal sets of evidence for the best guarantee: each of them suffices.
    pub conditions: Sets<EvidenceId>,
    /// Evidence without which no guarantee holds: the certificate's weak points, ascending.
    pub weak: Vec<EvidenceId>,
}

impl Prospect {
    /// The prospect of a need with a contract. Time: that of a search for the best 32 substitutions, and of composing and
    /// questioning the contracts of each.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase, assurance: &Assurance, graph: &Graph, need: NeedId) -> Prospect {
        let row = &knowledge.needs()[need];
        let requirements = Requirements::of(row);
        let options = requirements.narrowed(knowledge, &Options::default());
        let limits = Limits::default();
        let found =
            plan::best_meeting(knowledge, graph, row.variable, &options, &requirements, MOST_WAYS, limits);
        let is_complete = found.stop == StopReason::Complete && found.substitutions.len() < MOST_WAYS;
        let mut ways = Vec::new();
        for (substitution, utility) in &found.substitutions {
            let usable =
                |signal| !options.forbidden_signals.contains(&signal) && knowledge.is_available(signal);
            for way in Way::choices(knowledge, substitution, usable, MOST_CHOICES) {
                ways.push(Candidacy::new(knowledge, assurance, need, way, *utility));
            }
        }
        let losses = losses(knowledge, &ways);
        Prospect { need, ways, losses, is_complete }
    }

    /// The place of the best way that is admissible by the assessments, such as those at best.
    #[must_use]
    pub fn best(&self, assess: impl Fn(&Candidacy) -> Assessment) -> Option<usize> {
        self.ways.iter().position(|candidacy| assess(candidacy).verdict == Verdict::Holds)
    }
}

impl Prospect {
    /// What serves the need under an assessment of each way, as the need's policy has it. Nobody overrides anything.
    #[must_use]
    pub fn serving(
        &self,
        knowledge: &KnowledgeBase,
        assess: impl Fn(&Candidacy) -> Assessment,
    ) -> Option<Serving> {
        self.served_by(knowledge, &self.ways.iter().map(assess).enumerate().collect::<Vec<_>>())
    }

    /// What serves the need without some signals, as the need's policy has it. All other evidence is as it should be.
    #[must_use]
    pub fn serving_without(&self, knowledge: &KnowledgeBase, lost: &[SignalId]) -> Option<Serving> {
        let left = self.ways.iter().enumerate().filter(|(_, it)| !it.reads(knowledge, lost));
        let assessed = left.map(|(way, it)| (way, it.without(knowledge, lost)));
        self.served_by(knowledge, &assessed.collect::<Vec<_>>())
    }

    /// What serves the need of the ways with these places and assessments.
    fn served_by(&self, knowledge: &KnowledgeBase, assessed: &[(usize, Assessment)]) -> Option<Serving> {
        let policy = Assurance::policy(knowledge, self.need);
        let holds = |(_, it): &&(usize, Assessment)| it.verdict == Verdict::Holds;
        // Of those that hold the best; the policy `degrade` goes by levels.
        let highest = |among: &mut dyn Iterator<Item = &(usize, Assessment)>| {
            let among: Vec<_> = among.collect();
            let level = among.iter().filter_map(|(_, it)| it.level).max();
            among.into_iter().find(|(_, it)| it.level == level).copied()
        };
        let mut all = assessed.iter();
        let found = match (policy, all.clone().find(holds)) {
            (Policy::Degrade, Some(_)) => highest(&mut all.filter(holds)).map(|it| (it, Ground::Met)),
            (_, Some(first)) => Some((*first, Ground::Met)),
            (Policy::Stop, None) => None,
            (Policy::Degrade, None) => {
                let given = highest(&mut all).filter(|(_, it)| it.level.is_some());
                given.map(|it| (it, Ground::Degraded))
            }
            (Policy::Warn, None) => all.next().map(|it| (*it, Ground::Warned)),
        };
        found.map(|((way, it), ground)| Serving { way, admitted: Admitted { ground, level: it.level } })
    }

    /// What becomes of the need when each piece of evidence fails alone, in the order of contracts. What is observed of the
    /// source in use fails of the way that serves while nothing does.
    #[must_use]
    pub fn failures(&self, knowledge: &KnowledgeBase) -> Vec<Failure> {
        let serving = self.serving(knowledge, |candidacy| candidacy.at_best).map(|it| it.way);
        let mut pieces: Vec<(ContractId, &Watched)> = Vec::new();
        for candidacy in &self.ways {
            for (_, contract, watched) in candidacy.composition.evidence(knowledge) {
                if !pieces.iter().any(|(known, it)| (*known, &it.name) == (contract, &watched.name)) {
                    pieces.push((contract, watched));
                }
            }
        }
        pieces.sort_by_key(|(contract, _)| *contract);
        let then = |(contract, watched): (ContractId, &Watched)| {
            let is_of_source = matches!(watched.source, EvidenceSource::Source(_));
            let of = self.ways.get(serving.unwrap_or(0)).filter(|_| is_of_source);
            let then = self.serving(knowledge, |candidacy| {
                if of.is_some_and(|way| way.way != candidacy.way) {
                    return candidacy.at_best;
                }
                candidacy.while_fails(knowledge, contract, watched)
            });
            Failure { contract, watched: watched.clone(), then }
        };
        pieces.into_iter().map(then).collect()
    }
}

impl Candidacy {
    fn new(
        knowledge: &KnowledgeBase,
        assurance: &Assurance,
        need: NeedId,
        way: Way,
        utility: f64,
    ) -> Candidacy {
        let composition = assurance.compose(knowledge, need, &way);
        let at_best = composition.assess(&composition.supposing(|_| Truth::True));
        let nothing = composition.evaluation();
        let (mut conditions, mut weak) = (Sets { sets: Vec::new(), is_complete: true }, Vec::new());
        if let Some(best) = at_best.guarantee {
            (conditions, _) = nothing.why_no_guarantee(composition.system(), best, MOST_EVALUATIONS);
            let all = composition.roots().iter().map(|&root| {
                let (_, causes) = nothing.why_no_guarantee(composition.system(), root, MOST_EVALUATIONS);
                causes.sets.into_iter().filter(|set| set.len() == 1).flatten().collect::<Vec<_>>()
            });
            weak = all
                .reduce(|common, own| common.into_iter().filter(|it| own.contains(it)).collect())
                .unwrap_or_default();
        }
        Candidacy { way, utility, composition, at_best, conditions, weak }
    }

    /// What it gives while a piece of evidence is not so, and with it what is measured alike.
    fn while_fails(&self, knowledge: &KnowledgeBase, contract: ContractId, watched: &Watched) -> Assessment {
        let composition = &self.composition;
        let is_it = |of: ContractId, it: &Watched| {
            let is_attested = it.source == EvidenceSource::Attested;
            let is_alike =
                (it.source, it.within, it.max_age) == (watched.source, watched.within, watched.max_age);
            is_alike && (!is_attested || (of, &it.name) == (contract, &watched.name))
        };
        let failing: Vec<EvidenceId> =
            composition.evidence(knowledge).filter(|(_, of, it)| is_it(*of, it)).map(|(id, ..)| id).collect();
        let truth = |id| if failing.contains(&id) { Truth::False } else { Truth::True };
        composition.assess(&composition.supposing(truth))
    }

    /// Whether it reads one of these signals, or what is derived from one.
    fn reads(&self, knowledge: &KnowledgeBase, lost: &[SignalId]) -> bool {
        let mut origins = self.way.inputs().map(|signal| knowledge.origins(signal));
        origins.any(|origins| lost.iter().any(|lost| origins.contains(*lost)))
    }

    /// What is left of it when signals are lost: nothing where it reads one of them, else what holds without what is observed of
    /// them.
    #[must_use]
    pub fn without(&self, knowledge: &KnowledgeBase, lost: &[SignalId]) -> Assessment {
        if self.reads(knowledge, lost) {
            return Assessment { verdict: Verdict::Refused, guarantee: None, level: None };
        }
        let composition = &self.composition;
        let is_of_lost = |id: EvidenceId| {
            let mut of = composition.evidence(knowledge).filter(|(own, ..)| *own == id);
            of.any(|(_, _, watched)| matches!(watched.source, EvidenceSource::Signal(signal, _) if lost.contains(&signal)))
        };
        let truth = |id| if is_of_lost(id) { Truth::Unknown } else { Truth::True };
        composition.assess(&composition.supposing(truth))
    }
}

/// For each signal that a way or its evidence reads: the best remaining way without it.
fn losses(knowledge: &KnowledgeBase, ways: &[Candidacy]) -> Vec<(SignalId, Option<usize>)> {
    let mut signals = SignalSet::new();
    for candidacy in ways {
        candidacy.way.inputs().for_each(|signal| signals.extend(&knowledge.origins(signal)));
        for (_, _, watched) in candidacy.composition.evidence(knowledge) {
            if let EvidenceSource::Signal(signal, _) = watched.source {
                _ = signals.insert(signal);
            }
        }
    }
    let left = |lost: SignalId| {
        let place = ways.iter().position(|way| way.without(knowledge, &[lost]).verdict == Verdict::Holds);
        (lost, place)
    };
    signals.iter().map(left).collect()
}
