//! Which ways of knowing each variable are watched, within a budget.

mod greedy;

use super::fault_signature::{Cost, FaultSignature};
use crate::computation::Computation;
use crate::knowledge::{KnowledgeBase, Shape, SignalId, SignalSet, VariableId};
use crate::monitor::{ALL_PAIRS, PARTNERS, rests_on};
use crate::plan::{self, Graph, Limits, Options, StopReason};
use crate::substitution::{Substitution, Way};
use alloc::collections::BTreeSet;
use alloc::vec::Vec;
use greedy::{Choice, chosen};

/// How many substitutions of one variable, and ways, are looked at.
const MOST_SEARCHED: usize = 256;

/// Expansions after which a search for the next best substitution ends; counted, so that runs repeat.
const LIMITS: Limits = Limits { expansions: 20_000, states: 20_000 };

/// How much is watched at the most.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WatchBudget {
    /// Computed ways of knowing each variable; its signals are all watched. One way alone compares nothing.
    pub ways: usize,
    /// Operations a second of all variables together, by the declared rates: those of the formulas, and ten for each
    /// comparison. A signal without a rate counts as one of 100 Hz, a vector as 256 numbers.
    pub cost: u64,
}

impl Default for WatchBudget {
    /// 32 ways a variable; 10 million operations a second, about what one core does.
    fn default() -> WatchBudget {
        WatchBudget { ways: 32, cost: 10_000_000 }
    }
}

/// The ways of knowing a variable that are watched.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Witnesses {
    /// Best utility first, then in file order; last those that look behind a measured number.
    pub ways: Vec<Way>,
    /// How many ways there are; at least so many unless it is [`exact`](Witnesses::exact).
    pub possible: usize,
    /// Whether `possible` counts all: no limit has ended the search.
    pub exact: bool,
    /// How many decisions the search has taken, and how many comparisons were looked at to choose.
    pub expanded: u64,
    /// All ways that were looked at, where more than `ways` were.
    candidates: Vec<Way>,
}

impl Witnesses {
    /// Whether all ways that there are are watched.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.exact && self.ways.len() >= self.possible
    }

    /// What the comparisons of all ways that were looked at would tell, where not all are watched: each signal whose
    /// fault would show, with the signals that it would be taken for.
    ///
    /// Complexity: O(w^2 s) for w ways (at most 256) and s signals.
    #[must_use]
    pub fn reach(&self, knowledge: &KnowledgeBase) -> Vec<(SignalId, SignalSet)> {
        greedy::suspects(&fault_signature(knowledge, &self.candidates))
    }

    /// Operations a second of watching them, as [`WatchBudget::cost`] counts.
    #[must_use]
    pub fn cost(&self, knowledge: &KnowledgeBase) -> f64 {
        let costs: Vec<Cost> = self.ways.iter().map(|way| Cost::of(knowledge, way)).collect();
        (0..costs.len()).map(|count| added_cost(&costs, 0..=count)).sum()
    }

    /// Watches one more.
    pub(super) fn add(&mut self, way: Way) {
        if !self.candidates.is_empty() {
            self.candidates.push(way.clone());
        }
        self.ways.push(way);
        self.possible = self.possible.saturating_add(1);
    }

    /// Watches these only, by their places; fewer than two compare nothing.
    fn keep(&mut self, kept: &BTreeSet<usize>) {
        if kept.len() == self.ways.len() {
            return;
        }
        if self.candidates.is_empty() {
            self.candidates.clone_from(&self.ways);
        }
        let mut at = 0;
        self.ways.retain(|_| {
            at += 1;
            kept.contains(&(at - 1))
        });
    }
}

/// What the last of some ways adds to the cost of the others.
fn added_cost(costs: &[Cost], places: impl DoubleEndedIterator<Item = usize>) -> f64 {
    let partners = if costs.len() > ALL_PAIRS { PARTNERS.len() } else { costs.len() };
    let mut costs = places.rev().filter_map(|at| costs.get(at));
    let Some(last) = costs.next() else { return 0.0 };
    last.alone() + costs.take(partners).map(|other| last.compared(*other)).sum::<f64>()
}

fn fault_signature(knowledge: &KnowledgeBase, ways: &[Way]) -> Vec<FaultSignature> {
    ways.iter().map(|way| FaultSignature::of(knowledge, way)).collect()
}

/// Whether a way can be evaluated for comparisons: it has formulas, and does not go on from its own last value.
#[must_use]
pub fn can_be_watched(knowledge: &KnowledgeBase, way: &Way) -> bool {
    !way.substitution.continues_itself(knowledge) && Computation::can_run(knowledge, way)
}

/// The ways of knowing a variable that say something which its other comparisons do not: at most `most`, those that
/// [tell most faults apart](super::choice).
///
/// `admits` says of a way whether it counts; it is asked once for ways that differ in their signals only. A provided number
/// is not looked behind: it is compared in its own right ([`isolate`](super::isolate) adds what that leaves untold). A provided vector is, as vectors are compared only in the numbers
/// that follow from them. Of ways that read the same measurement, one counts.
///
/// Complexity: a search for 256 substitutions, and, where there are more than `most` ways, O(w k s^2 / 64) for w of them (at
/// most 256), k = `most`, over s signals.
#[must_use]
pub fn witnesses(
    knowledge: &KnowledgeBase,
    graph: &Graph,
    variable: VariableId,
    most: usize,
    admits: impl Fn(&Way) -> bool,
) -> Witnesses {
    let is_vector = |variable: VariableId| knowledge.variables()[variable].shape == Shape::Vector;
    let is_looked_behind = |variable: VariableId| {
        is_vector(variable) && knowledge.is_provided(variable) && !knowledge.producers(variable).is_empty()
    };
    // The search looks behind all that is provided or behind nothing, and all takes much longer in a large model.
    let substitute_provided = knowledge.variables().ids().any(is_looked_behind);
    let options = Options { substitute_provided, ..Options::default() };
    let found = plan::best(graph, variable, &options, MOST_SEARCHED, LIMITS);
    let compared_itself = |substitution: &Substitution| {
        let mut behind =
            substitution.steps.iter().map(|step| step.output).filter(|&output| output != variable);
        behind.any(|output| knowledge.is_provided(output) && !is_vector(output))
    };
    let counts = |substitution: &&Substitution| {
        let any = || Way::choices(knowledge, substitution, |_| true, 1);
        !compared_itself(substitution) && any().first().is_some_and(&admits)
    };
    let substitutions: Vec<&Substitution> =
        found.substitutions.iter().map(|(substitution, _)| substitution).filter(counts).collect();
    let (candidates, possible) = candidates(knowledge, &substitutions);
    let exact = found.stop == StopReason::Complete;
    let mut witnesses =
        Witnesses { ways: candidates, possible, exact, expanded: found.expanded, candidates: Vec::new() };
    if witnesses.ways.len() > most {
        witnesses.expanded += (witnesses.ways.len().min(MOST_SEARCHED) * most) as u64;
        let kept = told_apart(knowledge, &witnesses.ways, most);
        witnesses.keep(&kept);
    } else if witnesses.ways.len() < possible {
        witnesses.candidates.clone_from(&witnesses.ways);
    }
    witnesses
}

/// The places of the ways that are watched: all signals of the variable, and of the others those that tell most apart beside
/// the first of these.
fn told_apart(knowledge: &KnowledgeBase, ways: &[Way], most: usize) -> BTreeSet<usize> {
    let is_direct = |at: &usize| ways.get(*at).is_some_and(|way| way.direct().is_some());
    let (direct, computed): (Vec<usize>, Vec<usize>) = (0..ways.len()).partition(is_direct);
    let mut looked_at: Vec<usize> = direct.iter().copied().take(most).chain(computed).collect();
    looked_at.sort_unstable();
    let some: Vec<Way> = looked_at.iter().filter_map(|&at| ways.get(at).cloned()).collect();
    let chosen = chosen(&fault_signature(knowledge, &some), most);
    let chosen = chosen.iter().filter_map(|choice| looked_at.get(choice.at).copied());
    chosen.chain(direct).collect()
}

/// The ways of some substitutions, as many as are looked at, and how many there are.
fn candidates(knowledge: &KnowledgeBase, substitutions: &[&Substitution]) -> (Vec<Way>, usize) {
    let counts = |substitution: &&Substitution| choices(knowledge, substitution);
    let counts: Vec<usize> = substitutions.iter().map(counts).collect();
    let possible = counts.iter().fold(0_usize, |sum, count| sum.saturating_add(*count));
    let mut ways: Vec<Way> = Vec::new();
    let mut left = MOST_SEARCHED;
    for (number, (substitution, count)) in substitutions.iter().zip(&counts).enumerate() {
        if substitution.steps.is_empty() {
            // No signal is left out, however many there are.
            ways.extend(spread(knowledge, substitution, *count));
            continue;
        }
        // Everyone gets its share, and what others leave of theirs.
        let share = (left / (substitutions.len() - number)).max(1).min(*count);
        left = left.saturating_sub(share);
        ways.extend(spread(knowledge, substitution, share));
    }
    let all = ways.len() == possible;
    let ways = one_each(knowledge, ways);
    let possible = if all { ways.len() } else { possible };
    (ways, possible)
}

/// How many choices of a signal for each source there are.
fn choices(knowledge: &KnowledgeBase, substitution: &Substitution) -> usize {
    let options = |source: &VariableId| match knowledge.variables()[*source].constant {
        Some(_) => 1,
        None => knowledge.carriers(*source).iter().filter(|&&signal| stands(knowledge, signal)).count(),
    };
    substitution.sources.iter().map(options).fold(1_usize, usize::saturating_mul)
}

/// Whether a signal is the first of its variable from its source.
pub(super) fn stands(knowledge: &KnowledgeBase, signal: SignalId) -> bool {
    let variable = knowledge.signals()[signal].variable;
    let mut carriers = knowledge.carriers(variable).iter();
    let witness = knowledge.witness(signal);
    carriers.find(|&&other| knowledge.witness(other) == witness) == Some(&signal)
}

/// So many choices of a substitution: all of them, or half of those that come first, half so that every signal has its
/// turn and those of one choice are in no other, as far as they last.
fn spread(knowledge: &KnowledgeBase, substitution: &Substitution, count: usize) -> Vec<Way> {
    let usable = |signal| stands(knowledge, signal);
    if choices(knowledge, substitution) <= count {
        let mut ways = Way::choices(knowledge, substitution, usable, count);
        // Rows of a table come in the order of the file: so do comparisons.
        ways.sort_by(|one, other| one.signals.cmp(&other.signals));
        return ways;
    }
    let columns: Vec<Vec<Option<SignalId>>> =
        substitution.sources.iter().map(|&source| column(knowledge, source)).collect();
    let turn = |turn: usize| -> Vec<Option<SignalId>> {
        columns.iter().filter_map(|column| column.iter().cycle().nth(turn).copied()).collect()
    };
    let mut seen: BTreeSet<Vec<Option<SignalId>>> = BTreeSet::new();
    let mut ways = Way::choices(knowledge, substitution, usable, count / 2);
    ways.iter().for_each(|way| _ = seen.insert(way.signals.clone()));
    let way = |signals| Way { substitution: substitution.clone(), signals };
    ways.extend((0..count.div_ceil(2)).map(turn).filter(|signals| seen.insert(signals.clone())).map(way));
    ways
}

/// The signals of a source, the best rated first; none for a constant.
fn column(knowledge: &KnowledgeBase, source: VariableId) -> Vec<Option<SignalId>> {
    if knowledge.variables()[source].constant.is_some() {
        return Vec::from([None]);
    }
    let carriers = knowledge.carriers(source).iter().copied();
    let mut carriers: Vec<SignalId> = carriers.filter(|&signal| stands(knowledge, signal)).collect();
    knowledge.utility().sort_signals(knowledge, &mut carriers);
    carriers.into_iter().map(Some).collect()
}

/// Leaves out a way that reads a measurement under another name when a way before it rests on the same.
fn one_each(knowledge: &KnowledgeBase, ways: Vec<Way>) -> Vec<Way> {
    let other_name = |way: &Way| way.inputs().any(|signal| knowledge.witness(signal) != signal);
    if !ways.iter().any(other_name) {
        return ways;
    }
    let mut seen: BTreeSet<SignalSet> = BTreeSet::new();
    let mut own: BTreeSet<SignalSet> = BTreeSet::new();
    ways.iter().filter(|way| !other_name(way)).for_each(|way| _ = own.insert(rests_on(knowledge, way)));
    let mut is_new = |way: &Way| {
        let rests_on = rests_on(knowledge, way);
        !own.contains(&rests_on) && seen.insert(rests_on)
    };
    ways.into_iter().filter(|way| !other_name(way) || is_new(way)).collect()
}

/// One or two ways that are taken or left together.
struct Unit {
    variable: usize,
    places: Vec<usize>,
    /// How many of the same variable come before it.
    number: usize,
    gain: usize,
    round: usize,
    cost: f64,
}

/// Lets go of ways until the rest costs no more operations a second.
///
/// Every variable is first given two ways, then one more after the other, in the order in which they tell most apart; at
/// each turn, what tells most apart for its cost goes first, and a variable whose next way is too much gets no more.
/// Complexity: O(n log n) in all ways, when they cost too much also that of choosing among the ways of each variable.
pub fn afford<'w>(knowledge: &KnowledgeBase, all: impl Iterator<Item = &'w mut Witnesses>, cost: u64) {
    let mut all: Vec<&mut Witnesses> = all.filter(|witnesses| witnesses.ways.len() > 1).collect();
    let sum: f64 = all.iter().map(|witnesses| witnesses.cost(knowledge)).sum();
    if sum <= cost as f64 {
        return;
    }
    let units = all.iter().enumerate().flat_map(|(at, witnesses)| units(knowledge, at, &witnesses.ways));
    let mut units: Vec<Unit> = units.collect();
    let worth = |unit: &Unit| unit.gain as f64 / unit.cost.max(f64::MIN_POSITIVE);
    units.sort_by(|one, other| {
        let turn = |unit: &Unit| (unit.round, unit.number);
        turn(one).cmp(&turn(other)).then(worth(other).total_cmp(&worth(one)))
    });
    let mut kept: Vec<BTreeSet<usize>> = all.iter().map(|_| BTreeSet::new()).collect();
    let mut is_open: Vec<bool> = all.iter().map(|_| true).collect();
    let mut left = cost as f64;
    for unit in units {
        let (Some(kept), Some(is_open)) = (kept.get_mut(unit.variable), is_open.get_mut(unit.variable))
        else {
            continue;
        };
        *is_open &= unit.cost <= left;
        if *is_open {
            left -= unit.cost;
            kept.extend(unit.places);
        }
    }
    all.iter_mut().zip(&kept).for_each(|(witnesses, kept)| witnesses.keep(kept));
}

/// The ways of a variable in the order in which they tell most apart; the first two together.
fn units(knowledge: &KnowledgeBase, variable: usize, ways: &[Way]) -> Vec<Unit> {
    let choices = match ways.len() <= MOST_SEARCHED {
        true => chosen(&fault_signature(knowledge, ways), ways.len()),
        // Too many to see what each adds: in their order.
        false => (0..ways.len()).map(|at| Choice { at, gain: 1, round: 0 }).collect(),
    };
    let costs: Vec<Cost> = ways.iter().map(|way| Cost::of(knowledge, way)).collect();
    let places: Vec<usize> = choices.iter().map(|choice| choice.at).collect();
    let mut units: Vec<Unit> = Vec::new();
    for (number, &Choice { at, gain, round }) in choices.iter().enumerate() {
        let cost = added_cost(&costs, places.iter().copied().take(number + 1));
        match units.last_mut() {
            Some(first) if number == 1 => {
                first.places.push(at);
                first.gain += gain;
                first.cost += cost;
            }
            _ => units.push(Unit { variable, places: Vec::from([at]), number, gain, round, cost }),
        }
    }
    units
}
