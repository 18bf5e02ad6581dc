//! How many signals may be lost while a variable can still be known.
//!
//! A variable is lost when the lost signals meet every way of knowing it, so the fewest such signals are a smallest hitting set
//! of all ways. The ways are too many to list and are generated on demand. A smallest hitting set of the ways found so far is
//! taken as lost, and the planner searches a way that survives. When there is none, the set is the answer (implicit hitting sets:
//! Moreno-Centeno and Karp 2013, doi:10.1287/opre.1120.1139).

use super::basis::Basis;
use super::budget::Budget;
use super::hitting::smallest_hitting_set;
use crate::knowledge::{IdVec, KnowledgeBase, NeedId, SignalId, SignalSet, VariableId};
use crate::monitor::rests_on;
use crate::plan::{BestFirst, Graph, Limits, Options, Requirements, Scratch, StopReason};
use crate::substitution::{Substitution, Way};
use crate::time::Span;
use alloc::vec::Vec;

/// At most this many substitutions are tested for a young and runnable one.
const MOST_TRIED: usize = 32;
/// At most this many choices of signals are tested for each substitution.
const MOST_CHOICES: usize = 32;
/// The limits of one search.
const LIMITS: Limits = Limits { expansions: 20_000, states: 20_000 };
/// The additional cost of a search for each lost signal: it has to look further.
const STEPS_A_LOSS: u64 = 1;
/// At most this many smallest hitting sets are computed.
const MOST_ROUNDS: usize = 32;
/// The cost limit of one hitting set.
const MOST_STEPS: u64 = 20_000;

/// The losses that a variable or need survives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tolerance {
    /// Whether it can be known with nothing lost.
    pub known: bool,
    /// It stays known after any this many simultaneous losses of signals; `None` when it rests on no signal.
    pub survives: Option<usize>,
    /// Whether one more loss is too many; otherwise a limit was reached, and it may survive more.
    pub exact: bool,
    /// Signals whose common loss makes it unknown, as few as were found; empty when none were.
    pub cut: SignalSet,
    /// Signals whose single loss makes it unknown.
    pub single_points: SignalSet,
}

impl Default for Tolerance {
    /// The tolerance of an unknown variable.
    fn default() -> Tolerance {
        Tolerance {
            known: false,
            survives: Some(0),
            exact: true,
            cut: SignalSet::new(),
            single_points: SignalSet::new(),
        }
    }
}

impl Tolerance {
    /// The number of losses that make it unknown; 0 when it is unknown already, the maximum when no loss does.
    pub(super) fn level(&self) -> usize {
        match self.survives {
            _ if !self.known => 0,
            Some(survives) => survives + 1,
            None => usize::MAX,
        }
    }
}

/// A variable that must stay known, and the demands on its sources.
#[derive(Clone, Debug)]
pub(super) struct Target {
    pub(super) variable: VariableId,
    pub(super) demands: Requirements,
}

impl Target {
    pub(super) fn of_need(knowledge: &KnowledgeBase, need: NeedId) -> Target {
        let need = &knowledge.needs()[need];
        Target { variable: need.variable, demands: Requirements::of(need) }
    }

    /// A variable, whatever its sources.
    pub(super) fn of_variable(variable: VariableId) -> Target {
        Target { variable, demands: Requirements::default() }
    }
}

/// A way that survives the losses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Survivor {
    /// The signals whose loss breaks the way.
    rests_on: SignalSet,
    /// Whether it is a way while all other signals are present, too: no variable that it computes in between has signals itself.
    lasting: bool,
}

/// The remaining ways of knowing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Left {
    Way(Survivor),
    Nothing,
    /// A limit was reached first.
    Unclear,
}

/// Asks the planner for ways that survive losses.
pub(super) struct Losses<'a> {
    knowledge: &'a KnowledgeBase,
    graph: &'a Graph,
    basis: &'a Basis,
    scratch: Scratch,
    /// The signals that are lost with each signal: itself, those derived from it, and those of the same source; then the same of each
    /// common cause.
    followers: IdVec<SignalId, SignalSet>,
    /// What is lost with a signal instead of it: its common causes.
    instead: Option<IdVec<SignalId, SignalSet>>,
}

impl<'a> Losses<'a> {
    pub(super) fn new(knowledge: &'a KnowledgeBase, graph: &'a Graph, basis: &'a Basis) -> Losses<'a> {
        let mut followers = IdVec::filled(knowledge.signals().len(), |_| SignalSet::new());
        for signal in knowledge.signals().ids() {
            for origin in knowledge.origins(signal).iter() {
                followers[origin].insert(signal);
            }
        }
        for signal in knowledge.signals().ids().filter(|&signal| knowledge.witness(signal) != signal) {
            let same = followers[knowledge.witness(signal)].clone();
            followers[signal].extend(&same);
        }
        Losses { knowledge, graph, basis, scratch: Scratch::default(), followers, instead: None }
    }

    /// The same where a common cause is lost as one, with all of its signals; its number comes after those of the signals.
    pub(super) fn of_causes(knowledge: &'a KnowledgeBase, graph: &'a Graph, basis: &'a Basis) -> Losses<'a> {
        let mut losses = Losses::new(knowledge, graph, basis);
        let mut instead = IdVec::filled(knowledge.signals().len(), |_| SignalSet::new());
        for cause in knowledge.causes().iter() {
            let lost = losses.with_followers(&cause.signals.iter().copied().collect());
            let number = losses.followers.push(lost);
            cause.signals.iter().for_each(|signal| _ = instead[*signal].insert(number));
        }
        for (signal, causes) in knowledge.signals().ids().zip(instead.iter_mut()) {
            if causes.is_empty() {
                causes.insert(signal);
            }
        }
        Losses { instead: Some(instead), ..losses }
    }

    /// What has to be lost to lose these signals: one of these.
    fn lost_with(&self, signals: SignalSet) -> SignalSet {
        let Some(instead) = &self.instead else { return signals };
        let mut all = SignalSet::new();
        signals.iter().for_each(|signal| all.extend(&instead[signal]));
        all
    }

    /// A way of knowing the target without these signals and the signals derived from them.
    pub(super) fn left(&mut self, target: &Target, lost: &SignalSet, budget: &mut Budget) -> Left {
        let lost = self.with_followers(lost);
        let options = Options {
            forbidden_signals: lost.iter().collect(),
            forbidden_relations: self.basis.forbidden().to_vec(),
            ..Options::default()
        };
        let options = target.demands.narrowed(self.knowledge, &options);
        let limits = Limits { expansions: budget.at_most(LIMITS.expansions), ..LIMITS };
        let Losses { knowledge, graph, basis, scratch, .. } = self;
        let judge = Judge { knowledge, basis, target, lost: &lost };
        let mut search = BestFirst::with_scratch(scratch, graph, target.variable, &options, limits);
        budget.spend(1 + STEPS_A_LOSS * lost.len() as u64);
        // A way found greedily, without a search, survives as well as the best one.
        let Some((any, _)) = search.any() else {
            let refused = search.stop() == StopReason::NotMonotone;
            return if refused { Left::Unclear } else { Left::Nothing };
        };
        let mut found = judge.survivor(&any);
        for _ in 0..MOST_TRIED {
            if found.is_some() {
                break;
            }
            let Some((substitution, _)) = search.next() else { break };
            found = judge.survivor(&substitution);
        }
        budget.spend(search.reach() as u64 + search.expanded());
        match found {
            Some(survivor) => Left::Way(survivor),
            None if search.stop() == StopReason::Complete => Left::Nothing,
            None => Left::Unclear,
        }
    }

    fn with_followers(&self, lost: &SignalSet) -> SignalSet {
        let mut all = SignalSet::new();
        lost.iter().for_each(|signal| all.extend(&self.followers[signal]));
        all
    }

    /// The losses that a target survives.
    ///
    /// Complexity: one search for each way in the proof, within the budget.
    pub(super) fn tolerance(&mut self, target: &Target, budget: &mut Budget) -> Tolerance {
        let mut proof = Proof::default();
        proof.extend(self, target, SignalSet::new(), budget);
        let Some(first) = proof.ways.first().cloned() else {
            let unclear = proof.unclear;
            return Tolerance { exact: !unclear, ..Tolerance::default() };
        };
        if proof.ways.iter().any(SignalSet::is_empty) {
            return Tolerance { known: true, survives: None, exact: true, ..Tolerance::default() };
        }
        let (at_least, exact, cut) = self.cut(target, &mut proof, budget);
        let single_points = match at_least {
            0 | 1 if self.instead.is_none() => self.single_points(target, &first, budget),
            _ => SignalSet::new(),
        };
        let exact = exact && (proof.lasting || !self.may_fall_short(target));
        Tolerance { known: true, survives: Some(at_least.saturating_sub(1)), exact, cut, single_points }
    }

    /// The fewest signals whose loss makes the target unknown: a lower bound, whether it is exact, and the signals.
    fn cut(&mut self, target: &Target, proof: &mut Proof, budget: &mut Budget) -> (usize, bool, SignalSet) {
        // The ways found so far share no signal, so each needs a loss of its own.
        let mut at_least = proof.ways.len();
        for _ in 0..MOST_ROUNDS {
            if budget.is_spent() {
                break;
            }
            let granted = budget.at_most(MOST_STEPS);
            let mut share = Budget::new(granted);
            let hitting = smallest_hitting_set(&proof.ways, &mut share);
            budget.spend(granted - share.at_most(granted));
            at_least = at_least.max(hitting.at_least);
            let is_smallest = hitting.is_smallest();
            let before = proof.ways.len();
            proof.extend(self, target, hitting.set.clone(), budget);
            if proof.unclear {
                break;
            }
            if proof.ways.len() == before {
                return (at_least, is_smallest, hitting.set);
            }
        }
        (at_least, false, core::mem::take(&mut proof.taken))
    }

    /// Only signals that the best way rests on can be single points of failure.
    fn single_points(&mut self, target: &Target, best: &SignalSet, budget: &mut Budget) -> SignalSet {
        let mut alone = |signal| self.left(target, &SignalSet::from_iter([signal]), budget) == Left::Nothing;
        let points: SignalSet = best.iter().filter(|&signal| alone(signal)).collect();
        self.knowledge.with_same(points)
    }

    /// Whether some signals can be too old, too rare or too wide for the target: a way that computes with them in place of better
    /// ones may be refused, so that fewer losses could be worse.
    fn may_fall_short(&self, target: &Target) -> bool {
        let Requirements { max_latency, max_period, max_width, .. } = target.demands;
        self.knowledge.signals().iter().any(|signal| {
            let period = signal.rate_hz.map_or(Span::ZERO, |rate| Span::from_seconds(1.0 / rate));
            let width = signal.value_error.hi - signal.value_error.lo;
            max_latency.is_some_and(|most| signal.delay > most)
                || max_period.is_some_and(|most| period > most)
                || max_width.is_some_and(|most| width > most)
        })
    }
}

/// The conditions that a surviving way must meet.
struct Judge<'a> {
    knowledge: &'a KnowledgeBase,
    basis: &'a Basis,
    target: &'a Target,
    lost: &'a SignalSet,
}

impl Judge<'_> {
    /// A way of a substitution that survives.
    fn survivor(&self, substitution: &Substitution) -> Option<Survivor> {
        let Judge { knowledge, basis, target, lost } = *self;
        let usable = |signal| knowledge.is_available(signal) && !lost.contains(signal);
        let ways = Way::choices(knowledge, substitution, usable, MOST_CHOICES);
        let serves = |way: &&Way| {
            target.demands.shortfalls_of_way(knowledge, way).is_empty() && basis.admits(knowledge, way)
        };
        let way = ways.iter().find(serves)?;
        let passed = || way.substitution.steps.iter().filter(|step| step.output != target.variable);
        let lasting = passed().all(|step| knowledge.carriers(step.output).is_empty());
        Some(Survivor { rests_on: rests_on(knowledge, way), lasting })
    }
}

/// The ways found so far, with the signals whose loss breaks them.
struct Proof {
    ways: Vec<SignalSet>,
    /// Whether all of them are ways whatever else is present.
    lasting: bool,
    unclear: bool,
    /// The last set of lost signals that left no way.
    taken: SignalSet,
}

impl Default for Proof {
    fn default() -> Proof {
        Proof { ways: Vec::new(), lasting: true, unclear: false, taken: SignalSet::new() }
    }
}

impl Proof {
    /// Adds ways that survive these losses, each without the signals of those before, until there are none.
    fn extend(&mut self, losses: &mut Losses<'_>, target: &Target, mut lost: SignalSet, budget: &mut Budget) {
        self.unclear = false;
        loop {
            if budget.is_spent() && !self.ways.is_empty() {
                self.unclear = true;
                return;
            }
            match losses.left(target, &lost, budget) {
                Left::Way(survivor) => {
                    let rests_on = losses.lost_with(survivor.rests_on);
                    lost.extend(&rests_on);
                    self.lasting &= survivor.lasting;
                    let endless = rests_on.is_empty();
                    self.ways.push(rests_on);
                    if endless {
                        return;
                    }
                }
                Left::Nothing => {
                    self.taken = lost;
                    return;
                }
                Left::Unclear => {
                    self.unclear = true;
                    return;
                }
            }
        }
    }
}
