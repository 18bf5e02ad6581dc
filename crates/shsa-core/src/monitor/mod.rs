//! Compares all ways of knowing a variable as observations come, and watches each signal for silence and impossible values.
//!
//! Each output of the slower of two ways is compared with the faster way's value for the same moment, as soon as that is known:
//! the hull of its samples on both sides, or its nearest sample where the model bounds how fast the plant changes. A slower way
//! that is a difference quotient over a window is the mean of the derivative, and is compared with the mean of the other way over
//! the window. Disjoint intervals disagree. A residual is in conflict when enough of its recent comparisons disagree
//! ([`Debounce`]).
//!
//! Observations of one moment of reception are compared together ([`Monitor::settle`]), so that their order does not matter. An
//! observation costs what its ways and their pairs cost; nothing is allocated and nothing grows with history.

mod symptom;
mod trend;
mod frozen;
mod window;
mod residual;
mod detector;
mod timeouts;
mod reliability;
mod consensus;
mod one_sided;
mod way;
mod index;
mod support;
mod ranges;
mod comparison;
mod votes;
pub mod thesis;
mod past;
mod build;
mod inherit;
mod amend;
mod coverage;

pub use build::{ALL_PAIRS, PARTNERS, SupportedWay, are_compared, compared};
pub use coverage::Coverage;
pub use detector::{Detectors, Evidence, Fault, Finding, Shown};
pub use frozen::Frozen;
pub use inherit::Inheritance;
pub use ranges::may_leave_range;
pub use reliability::{Figures, Memory, Reliability};
pub use residual::{Disagreement, Residual, WayIndex};
pub use support::{rests_on, sized_by};
pub use symptom::Symptom;
pub use timeouts::{Absence, Change, Timeouts};
pub use trend::{Measured, Noise, Note, Tendency, Trend, TrendOptions, TrendRecord};
pub use votes::{Outlier, Votes};
pub use way::WatchedWay;
pub use window::{Debounce, ResidualState, Window};

use crate::alignment::{Acceptance, Clocks, Misdated, Port, Sample};
use crate::computation::Settled;
use crate::interval::Interval;
use crate::knowledge::{IdVec, KnowledgeBase, Signal, SignalId, SignalSet};
use crate::observation::Observation;
use crate::substitution::Way;
use crate::time::{Span, Time, Validity};
use alloc::vec::Vec;
use comparison::Round;
use consensus::Consensus;
use index::Index;
use votes::Told;

/// Settings of the comparisons; the defaults are safe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// How many single disagreements make a conflict, and how many bad readings of a signal a fault.
    pub debounce: Debounce,
    /// The settings of the trend detectors.
    pub trends: TrendOptions,
    /// How long the records of ways count.
    pub memory: Memory,
}

/// Compares all ways of knowing each variable.
#[derive(Debug)]
pub struct Monitor {
    ports: IdVec<SignalId, Port>,
    clocks: Clocks,
    detectors: Detectors,
    timeouts: Timeouts,
    frozen: IdVec<SignalId, Frozen>,
    outliers: IdVec<SignalId, Told>,
    ways: Vec<WatchedWay>,
    pairs: Vec<Residual>,
    /// The record of each way.
    consensus: Consensus,
    index: Index,
    /// For each signal, the ways that its observation completes.
    completes: IdVec<SignalId, Vec<WayIndex>>,
    /// For each signal, the ways that read it beside their trigger.
    joins: IdVec<SignalId, Vec<WayIndex>>,
    /// The ways that observations of this moment complete, with their moments.
    pending: Vec<(WayIndex, Validity)>,
    /// Ways that have waited for an observation of this moment, and the number of waiting ways.
    resumed: Vec<WayIndex>,
    waiting: usize,
    /// For each way, the pairs that wait for an output of this way.
    awaited: Vec<Vec<u32>>,
    /// The outputs of this moment.
    fresh: Vec<Fresh>,
    /// The signals with which a comparison had agreed before a restart or a change of the model.
    confirmed: SignalSet,
}

/// An output of this moment.
#[derive(Clone, Copy, Debug)]
struct Fresh {
    way: WayIndex,
    validity: Validity,
    measured: Measured,
}

impl Monitor {
    /// Takes in an observation; [`Monitor::settle`] makes the comparisons that it completes.
    pub fn observe(&mut self, knowledge: &KnowledgeBase, observation: &Observation, now: Time) -> Observed {
        let signal = observation.signal;
        let description = &knowledge.signals()[signal];
        if let Some(misdated) = self.clocks.observe(observation, now) {
            return self.drop_misdated(description, observation, misdated, now);
        }
        let port = &mut self.ports[signal];
        let reception = port.accept(description, observation, now);
        self.detectors.observe(signal, &reception, now);
        let wrong = match reception.acceptance {
            Acceptance::Invalid(_) => Some(Absence::Invalid),
            Acceptance::OutOfRange(_) => Some(Absence::OutOfRange),
            _ => None,
        };
        let change = self.timeouts.observe_message(signal, wrong, now);
        let (kept, repeated) = (reception.acceptance.is_kept(), reception.acceptance == Acceptance::Repeated);
        let began = began_anew(reception.acceptance);
        if kept {
            if let Some(newest) = port.newest() {
                self.frozen[signal].record(newest.value, now);
            }
            for &way in &self.completes[signal] {
                self.pending.push((way, reception.validity));
            }
            if self.waiting > 0 {
                self.resume(signal);
            }
        }
        if began.is_some() {
            self.begin_anew(signal);
        }
        Observed { kept, repeated, began, change }
    }

    /// Drops an observation whose stamp is wrong.
    #[inline(never)]
    fn drop_misdated(
        &mut self,
        description: &Signal,
        observation: &Observation,
        misdated: Misdated,
        now: Time,
    ) -> Observed {
        let signal = observation.signal;
        let reception = self.ports[signal].drop_misdated(description, observation, misdated, now);
        self.detectors.observe(signal, &reception, now);
        Observed {
            kept: false,
            repeated: false,
            began: None,
            change: self.timeouts.observe_message(signal, None, now),
        }
    }

    /// Looks for signals that have become silent.
    pub fn pass(&mut self, now: Time, report: impl FnMut(Change)) {
        self.timeouts.pass(now, report);
    }

    /// Whether observations of this moment are not settled yet.
    #[must_use]
    pub fn is_pending(&self) -> bool {
        !self.pending.is_empty() || self.detectors.is_pending()
    }

    /// Makes the comparisons that the observations of this moment complete. Returns whether a relationship has changed.
    pub fn settle(&mut self, now: Time) -> bool {
        self.detectors.settle(&mut self.ports, now);
        self.consensus.begin(now);
        self.evaluate();
        let Monitor { fresh, ways, pairs, consensus, index, awaited, .. } = self;
        let mut round = Round { ways, pairs, consensus, index, awaited, now, changed: false };
        fresh.iter().for_each(|fresh| round.compare(fresh));
        fresh.iter().for_each(|fresh| round.catch_up(fresh.way));
        round.changed
    }

    /// Resumes the ways that wait for an observation of this signal.
    fn resume(&mut self, signal: SignalId) {
        let waits = |way: &&WayIndex| self.ways.get(way.0 as usize).is_some_and(|way| !way.late.is_empty());
        self.resumed.extend(self.joins[signal].iter().filter(waits));
    }

    fn evaluate(&mut self) {
        self.fresh.clear();
        // Observations of one moment come in any order; results go by file order, in which most observations come.
        if !self.pending.is_sorted_by(|one, other| one.0 < other.0) {
            self.pending.sort_unstable_by_key(|(way, validity)| (*way, validity.to, validity.from));
        }
        let Monitor { pending, resumed, fresh, ways, ports, waiting, .. } = self;
        for (index, validity) in pending.drain(..) {
            let Some(way) = ways.get_mut(index.0 as usize) else { continue };
            if way.late.is_empty() {
                match way.evaluate(ports, validity) {
                    Settled::Value(sample) => way.take(index, sample, fresh),
                    Settled::Later(_) if way.late.capacity() > 0 => {
                        way.late.push_back(validity);
                        *waiting += 1;
                    }
                    Settled::Later(_) | Settled::Nothing => {}
                }
                continue;
            }
            if way.late.len() == way.late.capacity() {
                // The oldest waiting moment is given up.
                way.late.pop_front();
            }
            way.late.push_back(validity);
            resumed.push(index);
        }
        if !resumed.is_empty() {
            self.evaluate_late();
        }
    }

    /// Evaluates ways at their waiting moments, oldest first.
    fn evaluate_late(&mut self) {
        let Monitor { resumed, fresh, ways, ports, waiting, .. } = self;
        resumed.sort_unstable();
        resumed.dedup();
        for index in resumed.drain(..) {
            let Some(way) = ways.get_mut(index.0 as usize) else { continue };
            while let Some(&moment) = way.late.front() {
                match way.evaluate(ports, moment) {
                    Settled::Value(sample) => way.take(index, sample, fresh),
                    Settled::Later(_) => break,
                    Settled::Nothing => {}
                }
                way.late.pop_front();
            }
            if way.late.is_empty() {
                *waiting = waiting.saturating_sub(1);
            }
        }
    }

    /// The symptom of an accused signal: frozen, or the most frequent character of its pairs in conflict that `counts` accepts.
    #[must_use]
    pub fn symptom(&self, signal: SignalId, now: Time, counts: impl Fn(&Residual) -> bool) -> Symptom {
        let against = |pair: &&Residual| pair.residual_state(now) == ResidualState::Conflict && counts(pair);
        let conflicts = || self.pairs_of(signal).filter(against);
        let Some(onset) = conflicts().map(|pair| pair.onset(now)).min() else { return Symptom::Inconsistent };
        if self.frozen[signal].is_still_since(onset, now) {
            return Symptom::Frozen;
        }
        let count = |tendency| conflicts().filter(|pair| pair.trend.character() == tendency).count();
        let seen = [
            (Tendency::Calm, Symptom::Inconsistent),
            (Tendency::Noise, Symptom::Noisy),
            (Tendency::Skew, Symptom::Skewed),
            (Tendency::Drift, Symptom::Drifting),
        ];
        let most = seen.into_iter().max_by_key(|(tendency, _)| count(*tendency));
        most.map_or(Symptom::Inconsistent, |(_, symptom)| symptom)
    }

    /// How late a signal is beside its time stamps, from its first pair in conflict that a shift in time explains.
    #[must_use]
    pub fn skew(&self, signal: SignalId, now: Time) -> Option<Span> {
        let skew = |pair: &Residual| {
            let late = pair.trend.skew()?;
            let is_own = self.way(pair.way)?.rests_on.contains(signal);
            Some(if is_own { late } else { Span::ZERO - late })
        };
        let against =
            self.pairs_of(signal).filter(|pair| pair.residual_state(now) == ResidualState::Conflict);
        against.into_iter().find_map(skew)
    }

    /// All watched ways.
    #[must_use]
    pub fn ways(&self) -> &[WatchedWay] {
        &self.ways
    }

    /// The way of an index.
    #[must_use]
    pub fn way(&self, index: WayIndex) -> Option<&WatchedWay> {
        self.ways.get(index.0 as usize)
    }

    /// The record of a way while it was watched: its running agreement, error and availability.
    #[must_use]
    pub fn figures(&self, way: WayIndex, now: Time) -> Figures {
        self.consensus.figures(way, now)
    }

    /// The index of a way, where it is watched. O(log n) in all ways, and linear in those of the same variable.
    #[must_use]
    pub fn find(&self, way: &Way) -> Option<WayIndex> {
        let is_it =
            |index: &WayIndex| self.way(*index).is_some_and(|watched| watched.computation.way() == way);
        self.consensus.knowing(way.substitution.sink).find(is_it)
    }

    /// All watched pairs.
    #[must_use]
    pub fn residuals(&self) -> &[Residual] {
        &self.pairs
    }

    /// The pairs that rest on a signal, in their order. O(of these).
    pub fn pairs_of(&self, signal: SignalId) -> impl Iterator<Item = &Residual> {
        self.index.of_signal(signal).iter().filter_map(|&at| self.pairs.get(at as usize))
    }

    /// The pairs with a recent disagreement or a trend, in their order: all pairs that are undecided or in conflict, or may
    /// become so without another disagreement. O(of these).
    pub fn restless(&self) -> impl Iterator<Item = &Residual> {
        self.index.restless().iter().filter_map(|&at| self.pairs.get(at as usize))
    }

    /// The outputs of this moment, by way.
    pub fn fresh(&self) -> impl Iterator<Item = (WayIndex, Sample)> + '_ {
        let sample = |fresh: &Fresh| Sample { validity: fresh.validity, value: fresh.measured.value };
        self.fresh.iter().map(move |fresh| (fresh.way, sample(fresh)))
    }

    /// The ports of all signals.
    #[must_use]
    pub fn ports(&self) -> &IdVec<SignalId, Port> {
        &self.ports
    }

    /// The last change of a signal's value.
    #[must_use]
    pub fn frozen(&self, signal: SignalId) -> Frozen {
        self.frozen[signal]
    }

    /// The detectors of each signal's own readings.
    #[must_use]
    pub fn detectors(&self) -> &Detectors {
        &self.detectors
    }

    /// The timeouts of all signals.
    #[must_use]
    pub fn timeouts(&self) -> &Timeouts {
        &self.timeouts
    }
}

/// How the monitor has handled an observation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observed {
    /// Whether the observation was accepted.
    pub kept: bool,
    /// Whether the observation repeats the standing value.
    pub repeated: bool,
    /// Where a counter has begun anew: the last value before, and the first one after.
    pub began: Option<(Interval, Interval)>,
    /// The signal had been absent until now.
    pub change: Option<Change>,
}

/// The last value before a counter began anew, and the first one after.
#[inline]
fn began_anew(acceptance: Acceptance) -> Option<(Interval, Interval)> {
    match acceptance {
        Acceptance::Anew { last, first } => Some((last, first)),
        _ => None,
    }
}
