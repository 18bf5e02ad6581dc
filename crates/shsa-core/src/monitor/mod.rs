//! What disagrees, what is silent, what cannot be: all ways of knowing a variable compared, as observations come.
//!
//! A comparison is made when the slower of two ways delivers; the faster one is brought to its moment by its
//! history. Where the slower one is a difference quotient over a window, it is the mean of the derivative, and
//! is compared with the mean of the other over the window. Disjoint intervals disagree. A pair is in conflict
//! when enough of its recent comparisons disagree ([`Debounce`]).
//!
//! Observations of one moment of reception are compared together ([`Monitor::settle`]), so that their order does
//! not matter. The cost of an observation is that of the ways that it completes and their pairs; nothing is
//! allocated and nothing grows with history.

mod symptom;
mod trend;
mod stillness;
mod pair;
mod detector;
mod watch;
mod record;
mod panel;
pub mod thesis;
mod index;
mod build;
mod inherit;
mod amend;

pub use build::{compared, rests_on};
pub use detector::{Detectors, Evidence, Fault, Finding};
pub use inherit::Inheritance;
pub use pair::{Debounce, Disagreement, Pair, Relationship, WayIndex, Window};
pub use record::{Figures, Memory, Record};
pub use stillness::Stillness;
pub use symptom::Symptom;
pub use trend::{Measured, Tendency, Trend, TrendOptions, TrendRecord};
pub use watch::{Absence, Change, Watch};

use crate::alignment::{Acceptance, History, Port, Reach, Sample};
use crate::computation::Computation;
use crate::interval::Interval;
use crate::knowledge::{IdVec, KnowledgeBase, SignalId, SignalSet, VariableId};
use crate::observation::Observation;
use crate::substitution::Way;
use crate::time::{Span, Time, Validity};
use alloc::vec::Vec;
use index::Index;
use panel::Panel;

/// Settings of the comparisons; the defaults are sound.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// How many single disagreements make a conflict, and how many bad readings of a signal a fault.
    pub debounce: Debounce,
    /// What makes one of many comparisons that agree.
    pub trends: TrendOptions,
    /// How long it is remembered how ways have run.
    pub memory: Memory,
}

/// A way of knowing under watch, with its recent outputs.
#[derive(Debug)]
pub struct WatchedWay {
    /// What computes it.
    pub computation: Computation,
    /// The signals that it rests on, with those that they are derived from.
    pub rests_on: SignalSet,
    /// Its recent outputs.
    pub outputs: History,
    /// The output that was taken in last.
    measured: Option<Measured>,
    reach: Reach,
    /// Pairs that compare when this way delivers.
    triggers: Vec<u32>,
}

impl WatchedWay {
    /// The variable that it knows.
    #[must_use]
    pub fn variable(&self) -> VariableId {
        self.computation.way().substitution.sink
    }

    /// The outputs brought to a moment: within two periods, grown by the variable's rate of change.
    #[inline]
    #[must_use]
    pub fn at(&self, moment: Validity) -> Option<Interval> {
        self.outputs.alone_at(moment).or_else(|| self.near(moment))
    }

    /// What it says about an output of the slower way that it is compared with: where that one is a mean over a time, the mean
    /// over that, else its outputs brought to that moment.
    #[inline]
    #[must_use]
    pub fn beside(&self, slower: &WatchedWay, moment: Validity) -> Option<Interval> {
        if slower.mean_over() == Span::ZERO { self.at(moment) } else { self.mean_beside(slower, moment) }
    }

    /// The mean over the time of an output of the slower way, or that of as long a time around the same moment: no mean of means.
    /// Three quarters of a time count as all of it, and an eighth as next to it.
    fn mean_beside(&self, slower: &WatchedWay, moment: Validity) -> Option<Interval> {
        let (stretch, usual) = (slower.stretch(moment), slower.mean_over());
        let most = Span(usual.0 / 4 * 3);
        if self.mean_over() > most {
            let max_gap = self.max_gap().max(Span(usual.0 / 8));
            // Where the slower one's window has only begun there is none as short.
            let is_whole = stretch.length() > most;
            return is_whole.then(|| self.outputs.centred_at(moment, self.time_error(), max_gap)).flatten();
        }
        let is_rare =
            self.computation.timing().period.is_none_or(|period| period.times(2) > stretch.length());
        // Of what comes too rarely for a mean, the value there is.
        self.outputs.mean_over(stretch).or_else(|| is_rare.then(|| self.at(moment)).flatten())
    }

    /// The time over which an output of this validity is the mean.
    fn stretch(&self, validity: Validity) -> Validity {
        if self.computation.is_rate() {
            return validity;
        }
        let half = Span(self.mean_over().0 / 2);
        Validity { from: validity.from - half, to: validity.to + half }
    }

    /// How wrong the time of an output may be, to either side of its middle.
    fn time_error(&self) -> Span {
        match self.outputs.newest(0) {
            Some(newest) if !self.computation.is_rate() => Span(newest.validity.length().0 / 2),
            _ => Span::ZERO,
        }
    }

    #[inline]
    fn mean_over(&self) -> Span {
        self.computation.timing().mean_over
    }

    /// The same with its middle and width, which are not found again for each way that compares with it.
    #[inline]
    fn measured_beside(&self, slower: &WatchedWay, moment: Validity) -> Option<Measured> {
        let value = self.beside(slower, moment)?;
        let known = self.measured.filter(|last| last.value == value);
        Some(known.unwrap_or_else(|| Measured::of(value)))
    }

    #[inline(never)]
    fn near(&self, moment: Validity) -> Option<Interval> {
        let reach = Reach { max_gap: self.max_gap(), ..self.reach };
        self.outputs.at(moment, reach).map(|reading| reading.value)
    }

    /// How far away an output still tells something: two periods, as declared or else as the last two came.
    fn max_gap(&self) -> Span {
        match (self.reach.max_gap, self.outputs.newest(0), self.outputs.newest(1)) {
            (Span::MAX, Some(newest), Some(before)) => (newest.validity.to - before.validity.to).times(2),
            (declared, ..) => declared,
        }
    }
}

/// Compares all ways of knowing each variable.
#[derive(Debug)]
pub struct Monitor {
    ports: IdVec<SignalId, Port>,
    detectors: Detectors,
    watch: Watch,
    stillness: IdVec<SignalId, Stillness>,
    ways: Vec<WatchedWay>,
    pairs: Vec<Pair>,
    /// How each way has done.
    panel: Panel,
    index: Index,
    /// Ways that a signal completes.
    completes: IdVec<SignalId, Vec<WayIndex>>,
    /// Observations of this moment that complete a way.
    pending: Vec<(WayIndex, Validity)>,
    /// Outputs of this moment.
    fresh: Vec<Fresh>,
}

/// An output of this moment.
#[derive(Clone, Copy, Debug)]
struct Fresh {
    way: WayIndex,
    validity: Validity,
    measured: Measured,
}

impl Monitor {
    /// Takes an observation in; what it completes is compared by [`Monitor::settle`].
    pub fn observe(&mut self, knowledge: &KnowledgeBase, observation: &Observation, now: Time) -> Observed {
        let signal = observation.signal;
        let description = &knowledge.signals()[signal];
        let port = &mut self.ports[signal];
        let reception = port.accept(description, observation, now);
        self.detectors.observe(signal, &reception, now);
        let wrong = match reception.acceptance {
            Acceptance::Invalid(_) => Some(Absence::Invalid),
            Acceptance::OutOfRange(_) => Some(Absence::OutOfRange),
            _ => None,
        };
        let change = self.watch.hear(signal, wrong, now);
        let kept = reception.acceptance.is_kept();
        if kept {
            if let Some(newest) = port.newest() {
                self.stillness[signal].record(newest.value, now);
            }
            for &way in &self.completes[signal] {
                self.pending.push((way, reception.validity));
            }
        }
        Observed { kept, change }
    }

    /// Looks for signals that have become silent.
    pub fn pass(&mut self, now: Time, report: impl FnMut(Change)) {
        self.watch.pass(now, report);
    }

    /// Whether observations wait to be taken together.
    #[must_use]
    pub fn is_pending(&self) -> bool {
        !self.pending.is_empty() || self.detectors.is_pending()
    }

    /// Compares what the observations of this moment complete. Returns whether a relationship has changed.
    pub fn settle(&mut self, now: Time) -> bool {
        self.detectors.settle(&mut self.ports, now);
        self.panel.begin(now);
        self.evaluate();
        let mut changed = false;
        let Monitor { fresh, ways, pairs, panel, index, .. } = self;
        for fresh in fresh.iter() {
            changed |= compare((ways, pairs), (panel, index), fresh, now);
        }
        changed
    }

    fn evaluate(&mut self) {
        let Monitor { pending, fresh, ways, ports, .. } = self;
        fresh.clear();
        // Observations of one moment may have come in any order; what comes of them goes by file order, as they mostly did.
        if !pending.is_sorted_by(|one, other| one.0 < other.0) {
            pending.sort_unstable_by_key(|(way, validity)| (*way, validity.to, validity.from));
        }
        for (index, validity) in pending.drain(..) {
            let Some(way) = ways.get_mut(index.0 as usize) else { continue };
            let Some(sample) = way.computation.evaluate_scalar(ports, validity) else { continue };
            if way.outputs.push(sample).is_kept() {
                let measured = Measured::of(sample.value);
                way.measured = Some(measured);
                fresh.push(Fresh { way: index, validity: sample.validity, measured });
            }
        }
    }

    /// How a signal misbehaves that comparisons speak against: what most of those in conflict look like.
    #[must_use]
    pub fn symptom(&self, signal: SignalId, now: Time) -> Symptom {
        let against = |pair: &&Pair| pair.relationship(now) == Relationship::Conflict;
        let conflicts = || self.pairs_of(signal).filter(against);
        let Some(onset) = conflicts().map(|pair| pair.onset(now)).min() else { return Symptom::Inconsistent };
        if self.stillness[signal].is_still_since(onset, now) {
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

    /// How much later than its time stamps say a signal tells things, by the comparisons in conflict that it explains.
    #[must_use]
    pub fn skew(&self, signal: SignalId, now: Time) -> Option<Span> {
        let skew = |pair: &Pair| {
            let late = pair.trend.skew()?;
            let is_own = self.way(pair.way)?.rests_on.contains(signal);
            Some(if is_own { late } else { Span::ZERO - late })
        };
        let against = self.pairs_of(signal).filter(|pair| pair.relationship(now) == Relationship::Conflict);
        against.into_iter().find_map(skew)
    }

    /// All ways of knowing under watch.
    #[must_use]
    pub fn ways(&self) -> &[WatchedWay] {
        &self.ways
    }

    /// A way of an index that this monitor gave.
    #[must_use]
    pub fn way(&self, index: WayIndex) -> Option<&WatchedWay> {
        self.ways.get(index.0 as usize)
    }

    /// How a way has done, as far as it was watched: its running agreement, error and availability.
    #[must_use]
    pub fn figures(&self, way: WayIndex, now: Time) -> Figures {
        self.panel.figures(way, now)
    }

    /// The index of a way, when it is watched. O(log n) in all ways, and linear in those of the same variable.
    #[must_use]
    pub fn find(&self, way: &Way) -> Option<WayIndex> {
        let is_it =
            |index: &WayIndex| self.way(*index).is_some_and(|watched| watched.computation.way() == way);
        self.panel.knowing(way.substitution.sink).find(is_it)
    }

    /// All pairs under watch.
    #[must_use]
    pub fn pairs(&self) -> &[Pair] {
        &self.pairs
    }

    /// The pairs that rest on a signal, in their order: those in which it is compared. O(of these).
    pub fn pairs_of(&self, signal: SignalId) -> impl Iterator<Item = &Pair> {
        self.index.of_signal(signal).iter().filter_map(|&at| self.pairs.get(at as usize))
    }

    /// The pairs in which something has disagreed of late, in their order: all that are undecided or in conflict, or may
    /// become so without another disagreement. O(of these).
    pub fn restless(&self) -> impl Iterator<Item = &Pair> {
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

    /// Since when a signal says the same.
    #[must_use]
    pub fn stillness(&self, signal: SignalId) -> Stillness {
        self.stillness[signal]
    }

    /// What is wrong with the readings of each signal in themselves.
    #[must_use]
    pub fn detectors(&self) -> &Detectors {
        &self.detectors
    }

    /// Who is silent.
    #[must_use]
    pub fn watch(&self) -> &Watch {
        &self.watch
    }

    /// How many ways contradict and support a value of a variable right now, without debouncing; ways that rest
    /// on the same signals as the value have no vote.
    #[must_use]
    pub fn votes(
        &self,
        variable: VariableId,
        rests_on: &SignalSet,
        sample: Sample,
        trusted: impl Fn(&WatchedWay) -> bool,
    ) -> Votes {
        let mut votes = Votes::default();
        let of_variable = self.index.of_variable(variable).iter().filter_map(|&index| self.way(index));
        for way in of_variable.filter(|way| way.rests_on != *rests_on) {
            if !trusted(way) {
                continue;
            }
            match way.at(sample.validity).map(|known| known.overlaps(sample.value)) {
                Some(true) => votes.supporting += 1,
                Some(false) => votes.contradicting += 1,
                None => {}
            }
        }
        votes
    }
}

/// Compares an output with all that its way is compared with; whether a relationship has changed.
#[inline]
fn compare(
    (ways, pairs): (&[WatchedWay], &mut [Pair]),
    (panel, index): (&mut Panel, &mut Index),
    fresh: &Fresh,
    now: Time,
) -> bool {
    let Fresh { way, validity, ref measured } = *fresh;
    let Some(watched) = ways.get(way.0 as usize) else { return false };
    let mut changed = false;
    for &number in &watched.triggers {
        let Some(pair) = pairs.get_mut(number as usize) else { continue };
        let Some(other) = ways.get(pair.other.0 as usize) else { continue };
        let Some(known) = other.measured_beside(watched, validity) else { continue };
        panel.hear(number as usize, &known);
        let recorded = pair.record(measured, &known, validity, now);
        changed |= recorded.changed;
        if let Some(restless) = recorded.restless {
            index.note(number, restless);
        }
    }
    panel.settle(way, measured, now);
    changed
}

/// What became of an observation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Observed {
    /// Whether it was taken in.
    pub kept: bool,
    /// The signal had been absent until now.
    pub change: Option<Change>,
}

/// What the other ways say about a value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Votes {
    /// Ways whose value overlaps.
    pub supporting: u32,
    /// Ways whose value does not.
    pub contradicting: u32,
}

impl Votes {
    /// Whether more ways contradict than support.
    #[must_use]
    pub fn is_contradicted(self) -> bool {
        self.contradicting > self.supporting
    }
}
