//! Sets the monitor up: chooses which ways are compared with each other, and how often.

use super::consensus::Consensus;
use super::index::Index;
use super::one_sided::OneSided;
use super::past::{capacity, lookback, port, reach_of_inputs};
use super::ranges::left_ranges;
use super::support::{reads, rests_on, sized_by};
use super::votes::Told;
use super::way::allowed_gap;
use super::{
    Detectors, Frozen, Monitor, Noise, Options, Residual, Timeouts, Trend, WatchedWay, WayIndex, Window,
};
use crate::alignment::{Clocks, History, Reach};
use crate::computation::Computation;
use crate::expression::{Formula, Symbol};
use crate::interval::Course;
use crate::knowledge::{
    Id, IdVec, KnowledgeBase, NEGLIGIBLE, RelationId, Shape, Signal, SignalId, SignalSet, VariableId,
};
use crate::substitution::{Step, Way};
use crate::time::{Span, Time};
use alloc::collections::{BTreeMap, BTreeSet, VecDeque};
use alloc::vec::Vec;

/// At most this many moments of a way wait until all its inputs are known there.
const MOST_LATE: usize = 64;

impl Monitor {
    /// Watches these ways of knowing. Ways that cannot be run (structure only), or give vectors, are left out.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase, ways: Vec<Way>, options: Options) -> Monitor {
        let watched = |way: &Way| knowledge.variables()[way.substitution.sink].shape == Shape::Scalar;
        let computations: Vec<Computation> = ways
            .into_iter()
            .filter(|way| watched(way) && !way.substitution.continues_itself(knowledge))
            .filter_map(|way| Computation::new(knowledge, way, Computation::slowest_input))
            .collect();
        let lookback = lookback(&computations);
        let reach = reach_of_inputs(knowledge, &computations, lookback);
        let ports = IdVec::filled(knowledge.signals().len(), |signal| port(knowledge, signal, reach[signal]));
        let mut completes = IdVec::filled(knowledge.signals().len(), |_| Vec::new());
        for (at, computation) in computations.iter().enumerate() {
            if let Some(trigger) = computation.trigger() {
                completes[trigger].push(way_index(at));
            }
        }
        let ranges = left_ranges(knowledge, &computations);
        let ways: Vec<WatchedWay> = computations
            .into_iter()
            .chain(ranges)
            .map(|computation| watched_way(knowledge, computation, lookback))
            .collect();
        let mut joins = IdVec::filled(knowledge.signals().len(), |_| Vec::new());
        for (at, way) in ways.iter().enumerate() {
            way.computation.joined().for_each(|signal| joins[signal].push(way_index(at)));
        }
        let count = ways.len();
        let mut monitor = Monitor {
            ports,
            clocks: Clocks::new(knowledge),
            detectors: Detectors::new(knowledge, options.debounce),
            timeouts: Timeouts::new(knowledge),
            frozen: IdVec::filled(knowledge.signals().len(), |_| Frozen::default()),
            outliers: IdVec::filled(knowledge.signals().len(), |_| Told::default()),
            ways,
            pairs: Vec::new(),
            consensus: Consensus::new(&[], &[], options.memory),
            index: Index::default(),
            completes,
            joins,
            resumed: Vec::with_capacity(4 * count),
            waiting: 0,
            awaited: Vec::new(),
            pending: Vec::with_capacity(4 * count),
            fresh: Vec::with_capacity(4 * count),
            confirmed: SignalSet::new(),
        };
        monitor.add_pairs(knowledge, options);
        monitor.keep_areas();
        monitor.consensus = Consensus::new(&monitor.ways, &monitor.pairs, options.memory);
        monitor.index = Index::new(knowledge, &monitor.ways, &monitor.pairs);
        monitor
    }

    /// Outputs beside means keep the integrals between them, where their rate of change is bounded.
    pub(super) fn keep_areas(&mut self) {
        for pair in &self.pairs {
            for (index, other) in [(pair.way, pair.other), (pair.other, pair.way)] {
                let is_beside_mean = self.way(other).is_some_and(|other| other.mean_over() > Span::ZERO);
                if let Some(way) = self.ways.get_mut(index.0 as usize)
                    && is_beside_mean
                    && way.course.is_rated()
                {
                    way.outputs.keep_areas(way.course);
                }
            }
        }
    }

    fn add_pairs(&mut self, knowledge: &KnowledgeBase, options: Options) {
        let beside_ranges = self.beside_ranges(knowledge);
        let ways = self
            .ways
            .iter()
            .filter(|watched| !watched.is_range)
            .map(|watched| SupportedWay { way: watched.computation.way(), rests_on: &watched.rests_on });
        let ways: Vec<SupportedWay<'_>> = ways.collect();
        let compared = compared(knowledge, &ways);
        for (at, after) in compared {
            if let (Some(one), Some(other)) = (self.ways.get(at), self.ways.get(after)) {
                let (slow, fast) = by_slowness((at, one), (after, other));
                self.pairs.push(pair(knowledge, slow, fast, options));
                if hides_in_time(knowledge, slow.1, fast.1) {
                    // Time errors of one way may hide a single bad value: then the moments of the other way are compared, too.
                    self.pairs.push(pair(knowledge, fast, slow, options));
                }
            }
        }
        for (at, range) in beside_ranges {
            if let (Some(one), Some(other)) = (self.ways.get(at), self.ways.get(range)) {
                self.pairs.push(pair(knowledge, (at, one), (range, other), options));
            }
        }
        let mut waiting = alloc::vec![0; self.ways.len()];
        for pair in &self.pairs {
            waiting.get_mut(pair.other.0 as usize).into_iter().for_each(|count| *count += 1);
        }
        self.awaited = waiting.into_iter().map(Vec::with_capacity).collect();
        for (number, pair) in self.pairs.iter().enumerate() {
            if let Some(way) = self.ways.get_mut(pair.way.0 as usize) {
                way.triggers.push(u32::try_from(number).unwrap_or(u32::MAX));
            }
        }
    }
}

/// A way with its support.
#[derive(Clone, Copy, Debug)]
pub struct SupportedWay<'a> {
    /// The way.
    pub way: &'a Way,
    /// The signals that it [rests on](rests_on).
    pub rests_on: &'a SignalSet,
}

/// Up to this many ways of one variable are all compared with each other.
pub const ALL_PAIRS: usize = 32;

/// Of more ways, each is compared with those at these distances in the list, taken as a ring. So every way has twelve others,
/// enough to outvote it, and no two faults share many of them.
pub const PARTNERS: [usize; 6] = [1, 2, 3, 5, 8, 13];

/// The pairs to compare: all pairs of each variable with few ways; some pairs where there are [many](ALL_PAIRS). The same
/// signals and relations are compared only once: in the first variable with the tightest bounds. No way is left out. Two ways
/// that rest on the same signals are compared only where one of them has a relation with a declared prior probability of a
/// fault: the comparison is about that relation.
///
/// Returns places in `ways`, the smaller one first,
/// ascending. Complexity: O(p log p) for p pairs, which are at most `16 n` for n ways.
#[must_use]
pub fn compared(knowledge: &KnowledgeBase, ways: &[SupportedWay<'_>]) -> Vec<(usize, usize)> {
    let mut of_variable: BTreeMap<VariableId, Vec<usize>> = BTreeMap::new();
    for (at, supported) in ways.iter().enumerate() {
        of_variable.entry(supported.way.substitution.sink).or_default().push(at);
    }
    let mut pairs = Vec::new();
    for same in of_variable.values() {
        for (number, &at) in same.iter().enumerate() {
            if same.len() <= ALL_PAIRS {
                pairs.extend(same.iter().skip(number + 1).map(|&after| (at, after)));
                continue;
            }
            let partner = |offset: &usize| same.get((number + offset) % same.len());
            let partners = PARTNERS.iter().filter_map(partner);
            pairs.extend(partners.map(|&other| (at.min(other), at.max(other))));
        }
    }
    pairs.sort_unstable();
    let openness: Vec<usize> = ways.iter().map(|supported| openness(knowledge, supported.way)).collect();
    let of = |at: usize| openness.get(at).copied().unwrap_or(0);
    // In `z = v^2`, a comparison of two `v` overlooks every `z` that is too large; one of two `z` does not.
    pairs.sort_by_key(|&(at, after)| of(at) + of(after));
    let mut seen = BTreeSet::new();
    pairs.retain(|&(at, after)| match (ways.get(at), ways.get(after)) {
        (Some(&one), Some(&other)) => {
            are_compared(knowledge, one, other) && seen.insert(evidence(one.way, other.way))
        }
        _ => false,
    });
    pairs.sort_unstable();
    pairs
}

/// In how many places the formulas of a way leave its value open, although its signals were exact.
fn openness(knowledge: &KnowledgeBase, way: &Way) -> usize {
    let range = |symbol: Symbol| {
        let variable = knowledge.variables().find(VariableId::from_index(symbol.0 as usize));
        variable.and_then(|variable| variable.constant.or(variable.range))
    };
    formulas(knowledge, way).map(|formula| formula.open_places(&range)).sum()
}

/// Whether a formula of a way has several inverses.
fn has_branches(knowledge: &KnowledgeBase, way: &Way) -> bool {
    formulas(knowledge, way).any(Formula::has_branches)
}

fn formulas<'k>(knowledge: &'k KnowledgeBase, way: &'k Way) -> impl Iterator<Item = &'k Formula> {
    let of_step = |step: &Step| knowledge.relations()[step.relation].formula(step.output);
    way.substitution.steps.iter().filter_map(of_step)
}

/// Whether two ways of one variable can contradict each other.
#[must_use]
pub fn are_compared(knowledge: &KnowledgeBase, one: SupportedWay<'_>, other: SupportedWay<'_>) -> bool {
    let may_fail = |relation: &RelationId| {
        knowledge.relations()[*relation].properties.prior().is_some_and(|prior| prior >= NEGLIGIBLE)
    };
    let fallible =
        |way: &Way| way.substitution.relations().into_iter().filter(may_fail).collect::<Vec<RelationId>>();
    // The output of a fusion agrees with its own inputs by construction, or leaves them out.
    let is_fused = |way: &Way| way.inputs().any(|signal| knowledge.is_fused(signal));
    let is_made_of_it = (is_fused(one.way) || is_fused(other.way)) && one.rests_on.meets(other.rests_on);
    !is_made_of_it && (one.rests_on != other.rests_on || fallible(one.way) != fallible(other.way))
}

fn watched_way(knowledge: &KnowledgeBase, mut computation: Computation, lookback: Span) -> WatchedWay {
    let rests_on = rests_on(knowledge, computation.way());
    let reads = reads(knowledge, computation.way());
    let conditions = rests_on.difference(&sized_by(knowledge, computation.way()));
    let sink = computation.way().substitution.sink;
    let variable = &knowledge.variables()[sink];
    let timing = computation.timing();
    let rate_hz = timing.period.map(|period| 1.0 / period.seconds());
    let has_condition = |step: &Step| knowledge.relations()[step.relation].condition.is_some();
    let is_conditional = computation.way().substitution.steps.iter().any(has_condition);
    // What is sent again as soon as it has changed is no further off for being old.
    let is_ageless = computation.stands(knowledge)
        && computation.way().inputs().all(|signal| knowledge.signals()[signal].is_ageless());
    let course = match is_ageless {
        true => Course { max_rate: f64::INFINITY, ..variable.course() },
        false => variable.course(),
    };
    let max_rate = variable.max_rate.filter(|_| !is_ageless).unwrap_or(0.0);
    let reach = Reach {
        max_rate,
        max_gap: timing.period.map_or(Span::MAX, |period| allowed_gap(period, is_conditional)),
        stands: computation.stands(knowledge),
    };
    let outputs = History::new(capacity(rate_hz, lookback));
    let constant = computation.constant();
    let has_noise = |signal: SignalId| knowledge.signals()[signal].noise.is_some();
    let is_joined_of_noise =
        computation.joined().next().is_some() && computation.way().inputs().all(has_noise);
    let late = VecDeque::with_capacity(if computation.joined().next().is_some() { MOST_LATE } else { 0 });
    let is_of_moments = !computation.is_windowed() && constant.is_none();
    WatchedWay {
        is_of_moments,
        is_range: computation.is_range(),
        one_sided: OneSided::of(knowledge, computation.way()),
        computation,
        rests_on,
        reads,
        conditions,
        outputs,
        measured: None,
        reach,
        course,
        blur: if is_of_moments { max_rate * timing.mean_over.seconds() / 4.0 } else { 0.0 },
        is_conditional,
        turn: variable.wraps,
        range: variable.range,
        is_verdict: knowledge.specifications().iter().any(|it| it.variable == sink),
        constant,
        observed: is_joined_of_noise.then_some(0),
        triggers: Vec::new(),
        late,
    }
}

/// What a comparison is about: the same relations and signals, compared in another variable, add nothing.
fn evidence(one: &Way, other: &Way) -> (Vec<RelationId>, Vec<SignalId>) {
    let mut relations = one.substitution.relations();
    relations.extend(other.substitution.relations());
    relations.sort_unstable();
    relations.dedup();
    let mut signals: Vec<SignalId> = one.inputs().chain(other.inputs()).collect();
    signals.sort_unstable();
    signals.dedup();
    (relations, signals)
}

/// Sorts two ways, the slower one first: comparisons are made at its moments.
///
/// The slower way is the one whose outputs are means over a longer time, or are rarer. Of ways with equal rates, it is the way
/// with the larger lag, because the other way has delivered by then; else the later way in file order, because the other value
/// of its row is known then.
fn by_slowness<'w>(
    one: (usize, &'w WatchedWay),
    other: (usize, &'w WatchedWay),
) -> ((usize, &'w WatchedWay), (usize, &'w WatchedWay)) {
    let slowness = |way: &WatchedWay| {
        let timing = way.computation.timing();
        (timing.mean_over + timing.period.unwrap_or(Span::ZERO), timing.lag)
    };
    // A way that rests on constants alone has no moments.
    let is_slow = other.1.constant.is_some() || slowness(one.1) > slowness(other.1);
    if is_slow && one.1.constant.is_none() { (one, other) } else { (other, one) }
}

/// Whether a time error spans several periods of the slower way: a single bad value is hidden by its neighbours then, and shows
/// only at the moments of the other way.
fn hides_in_time(knowledge: &KnowledgeBase, slow: &WatchedWay, fast: &WatchedWay) -> bool {
    let uncertainty = |way: &WatchedWay| {
        let error = |signal: SignalId| knowledge.signals()[signal].time_error;
        let lengths = way.computation.way().inputs().map(|signal| error(signal).1 - error(signal).0);
        lengths.max().unwrap_or(Span::ZERO)
    };
    let period = slow.computation.timing().period;
    let is_of_a_moment = |way: &WatchedWay| way.mean_over() == Span::ZERO && way.constant.is_none();
    is_of_a_moment(slow)
        && is_of_a_moment(fast)
        && period.is_some_and(|period| period.times(2) <= uncertainty(slow).max(uncertainty(fast)))
}

fn pair(
    knowledge: &KnowledgeBase,
    slow: (usize, &WatchedWay),
    fast: (usize, &WatchedWay),
    options: Options,
) -> Residual {
    let timing = slow.1.computation.timing();
    let other = fast.1.computation.timing();
    let mut signals = slow.1.rests_on.clone();
    signals.extend(&fast.1.rests_on);
    let noise = noise(knowledge, slow.1, fast.1);
    let is_of_lines = noise != Noise::Unknown && slow.1.is_of_lines() && fast.1.is_of_lines();
    // The time for which a comparison waits for the faster way.
    let waits = is_of_lines || fast.1.reach.max_rate == 0.0;
    let wait = if waits { other.period.unwrap_or(Span::ZERO) } else { Span::ZERO };
    let lag = timing.complete_after().max(other.complete_after()) + wait;
    let window = Window::new(options.debounce, timing.period, lag);
    let has_branches = [slow.1, fast.1].iter().any(|way| has_branches(knowledge, way.computation.way()));
    Residual {
        way: way_index(slow.0),
        other: way_index(fast.0),
        signals,
        has_branches,
        may_be_of_bounds: slow.1.may_be_a_bound() || fast.1.may_be_a_bound(),
        is_of_lines,
        line_ends: Time::MIN,
        repeats: false,
        bends: Default::default(),
        window: if is_noisy(knowledge, slow.1, fast.1) { window.of_noise() } else { window },
        trend: Trend::new(options.trends, timing.mean_over, noise),
        disagreement: None,
        moved: (0.0, 0.0),
        due: None,
        known: None,
        made: 0,
        has_agreed: false,
        before: 0,
    }
}

/// The declared noise of all signals that two ways read.
fn noise(knowledge: &KnowledgeBase, one: &WatchedWay, other: &WatchedWay) -> Noise {
    let (one, other) = (one.computation.way(), other.computation.way());
    // What drifts as declared is no trend.
    let drifts = |it: &Signal| it.change_error.is_some_and(|error| error.drift > 0.0);
    let of = |signal: SignalId| {
        knowledge.signals()[signal].noise.filter(|_| !drifts(&knowledge.signals()[signal]))
    };
    if one.inputs().chain(other.inputs()).any(|signal| of(signal).is_none()) {
        return Noise::Unknown;
    }
    let direct = one.direct().zip(other.direct());
    let both = direct.and_then(|(one, other)| Some(libm::hypot(of(one)?, of(other)?)));
    let shares =
        one.inputs().chain(other.inputs()).map(|signal| share_of_noise(&knowledge.signals()[signal]));
    both.map_or_else(|| Noise::Declared(shares.fold(0.0, f64::max)), Noise::Known)
}

/// The deviation of a signal's noise as a share of its error; 0 where the error depends on the value.
fn share_of_noise(signal: &Signal) -> f64 {
    let error = 0.5 * (signal.value_error.hi - signal.value_error.lo);
    signal.noise.filter(|_| error > 0.0).map_or(0.0, |noise| noise / error)
}

/// Whether one of two ways reads a signal whose noise is declared: then one value beyond the errors proves no fault.
fn is_noisy(knowledge: &KnowledgeBase, one: &WatchedWay, other: &WatchedWay) -> bool {
    let (one, other) = (one.computation.way(), other.computation.way());
    one.inputs().chain(other.inputs()).any(|signal| knowledge.signals()[signal].noise.is_some())
}

fn way_index(at: usize) -> WayIndex {
    WayIndex(u32::try_from(at).unwrap_or(u32::MAX))
}
