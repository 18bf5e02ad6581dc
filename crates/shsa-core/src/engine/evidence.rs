//! What speaks against a signal, what speaks for it, and what has nothing to say, at a moment.

use super::{Engine, NeedStatus};
use crate::diagnosis::{Component, Verdict};
use crate::interval::Interval;
use crate::knowledge::{KnowledgeBase, NeedId, SignalId, SignalSet, VariableId};
use crate::monitor::{Absence, Residual, ResidualState, Tendency, WatchedWay, WayIndex};
use crate::substitution::Way;
use crate::time::{Span, Time};
use alloc::vec::Vec;

/// All that the engine knows about the trust in one signal; ids are those of the engine's knowledge base.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// The signal that it is about.
    pub signal: SignalId,
    /// When it was taken.
    pub time: Time,
    /// What is thought of the signal.
    pub verdict: Verdict,
    /// Why it gives no usable value; `None` when it does.
    pub absence: Option<Absence>,
    /// Since when all evidence has spoken for it although it is accused.
    pub clean_since: Option<Time>,
    /// How long all evidence must speak for it before it is trusted again.
    pub probation: Span,
    /// Whether it still says exactly what it said when it was accused: as long as it does, nothing clears it.
    pub stands_still: bool,
    /// Every comparison that it is part of, in the monitor's order.
    pub comparisons: Vec<Comparison>,
    /// Every other signal that is part of a [conflict](Comparison::is_conflict) with it, in file order.
    pub rivals: Vec<Rival>,
    /// For every set of signals which is the part of a conflict that is not the signal: without it, each of these sets
    /// holds another faulty signal.
    pub otherwise: Vec<SignalSet>,
}

/// Two ways of knowing a variable, as they compare at a moment.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Which pair of the monitor it is.
    pub pair: usize,
    /// What both know.
    pub variable: VariableId,
    /// The way that rests on the signal.
    pub own: Side,
    /// The way that it is compared with; it rests on the signal, too, when the comparison [is](Self::bears_witness)
    /// none with an independent witness.
    pub other: Side,
    /// The signals that the two rest on.
    pub signals: SignalSet,
    /// What the recent comparisons say.
    pub relationship: ResidualState,
    /// How many of the recent comparisons disagree, and how many there are.
    pub counts: (u32, u32),
    /// What the comparisons say together where they agree one by one, and how much more, SI, the way that rests on the
    /// signal has said on average.
    pub together: Option<(Tendency, f64)>,
    /// When the present disagreement began; `None` when there is none.
    pub onset: Option<Time>,
    /// The values that last disagreed, SI: of the way that rests on the signal, and of the other one.
    pub disagreed: Option<(Interval, Interval)>,
    /// What was last compared, as far as it is still known, SI: of the way that rests on the signal, and of the other one;
    /// and when it was true.
    pub compared: Option<(Interval, Interval, Time)>,
    /// Whether only one of the ways rests on the signal or what it comes from, and is computed from it.
    pub bears_witness: bool,
    /// Signals in it that have failed or are forbidden, the signal itself apart: they explain what it says.
    pub explained_by: SignalSet,
}

impl Comparison {
    /// Whether it speaks against the signal: the two disagree, and no other signal that has failed explains it.
    #[must_use]
    pub fn is_conflict(&self) -> bool {
        self.relationship == ResidualState::Conflict && self.explained_by.is_empty()
    }

    /// Whether it speaks for the signal.
    #[must_use]
    pub fn is_support(&self) -> bool {
        self.relationship == ResidualState::Agree && self.bears_witness && self.explained_by.is_empty()
    }
}

/// One of the two ways of a comparison.
#[derive(Clone, Debug)]
pub struct Side {
    /// Which way of the monitor it is.
    pub index: WayIndex,
    /// The way.
    pub way: Way,
    /// Its signals with those that they are derived from.
    pub rests_on: SignalSet,
    /// Its newest value, SI, and when it was true.
    pub newest: Option<(Time, Interval)>,
    /// Why it says nothing, as far as a signal is the reason.
    pub mute: Option<(SignalId, Mute)>,
}

/// Why a signal has nothing to say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mute {
    /// It has never given a possible value.
    Never,
    /// It has given one, but not of late.
    Absent(Absence),
}

/// Another signal that may be to blame instead.
#[derive(Clone, Debug)]
pub struct Rival {
    /// The signal.
    pub signal: SignalId,
    /// What is thought of it.
    pub verdict: Verdict,
    /// Conflicts of the accused that it is no part of, as places in [`Evidence::comparisons`]: it explains none of them.
    pub not_in: Vec<usize>,
    /// Comparisons without the accused in which an independent witness agrees with it.
    pub supported: Vec<Comparison>,
    /// Comparisons without the accused that have nothing to say about it: they could have told the two apart.
    pub unheard: Vec<Comparison>,
}

impl Engine {
    /// What speaks about a signal at a moment, which is the present one or the one before the latest input.
    ///
    /// Complexity: O(pairs x rivals). Allocates; for explanations, not for the loop.
    #[must_use]
    pub fn evidence(&self, signal: SignalId, at: Time) -> Evidence {
        let comparisons = self.comparisons(signal, at);
        let conflicts = || comparisons.iter().filter(|comparison| comparison.is_conflict());
        let mut others = SignalSet::new();
        conflicts().for_each(|comparison| others.extend(&comparison.signals));
        others.remove(signal);
        let rivals = others.iter().map(|rival| self.rival(rival, signal, &comparisons, at)).collect();
        let without = |comparison: &Comparison| {
            comparison.signals.iter().filter(|other| *other != signal).collect::<SignalSet>()
        };
        Evidence {
            signal,
            time: at,
            verdict: self.judge.verdict(signal, &self.monitor, at),
            absence: self.absence(signal),
            clean_since: self.judge.clean_since(signal),
            probation: self.judge.probation_of(signal),
            stands_still: self.judge.stands_still(Component::Signal(signal), &self.monitor, at),
            otherwise: conflicts().map(without).collect(),
            rivals,
            comparisons,
        }
    }

    /// How every need is served now.
    pub fn need_statuses(&self) -> impl Iterator<Item = (NeedId, NeedStatus)> + '_ {
        self.providers.enumerate().map(|(id, provider)| (id, provider.status(&self.knowledge)))
    }

    fn comparisons(&self, signal: SignalId, at: Time) -> Vec<Comparison> {
        let pairs = self.monitor.residuals().iter().enumerate();
        pairs
            .filter(|(_, pair)| pair.signals.contains(signal))
            .filter_map(|(number, pair)| self.comparison(number, pair, signal, at))
            .collect()
    }

    fn comparison(&self, number: usize, pair: &Residual, signal: SignalId, at: Time) -> Option<Comparison> {
        let (slow, fast) = (self.monitor.way(pair.way)?, self.monitor.way(pair.other)?);
        let is_slow = slow.rests_on.contains(signal);
        let disagreed = pair.disagreement.map(|last| match is_slow {
            true => (last.value, last.other),
            false => (last.other, last.value),
        });
        let compared = compared(slow, fast).map(|(value, known, time)| match is_slow {
            true => (value, known, time),
            false => (known, value, time),
        });
        let (slow_side, fast_side) = (self.side(pair.way, slow), self.side(pair.other, fast));
        let (own, other) = if is_slow { (slow_side, fast_side) } else { (fast_side, slow_side) };
        let is_sized = if is_slow { slow } else { fast }.is_sized_by(signal);
        let failed = |other: &SignalId| *other != signal && self.judge.is_discounted(*other);
        let relationship = pair.relationship(at);
        let counts = pair.window.counts();
        let disagrees = counts.0 > 0 && relationship != ResidualState::Unknown;
        let is_together = pair.window.relationship(at) != relationship;
        let ahead = if is_slow { pair.trend.mean() } else { -pair.trend.mean() };
        Some(Comparison {
            pair: number,
            variable: slow.variable(),
            bears_witness: is_sized && !other.rests_on.meets(&self.knowledge.origins(signal)),
            own,
            other,
            signals: pair.signals.clone(),
            relationship,
            counts,
            together: is_together.then(|| (pair.trend.tendency(), ahead)),
            onset: (disagrees || is_together).then(|| pair.onset(at)),
            disagreed: disagreed.filter(|_| disagrees),
            compared,
            explained_by: pair.signals.iter().filter(failed).collect(),
        })
    }

    fn side(&self, index: WayIndex, way: &WatchedWay) -> Side {
        let mute = way.rests_on.iter().find_map(|signal| Some((signal, self.mute(signal)?)));
        let newest = way.outputs.newest(0).map(|sample| (sample.validity.to, sample.value));
        Side { index, way: way.computation.way().clone(), rests_on: way.rests_on.clone(), newest, mute }
    }

    fn mute(&self, signal: SignalId) -> Option<Mute> {
        match (self.monitor.timeouts().has_spoken(signal), self.absence(signal)) {
            (false, _) => Some(Mute::Never),
            (true, absence) => absence.map(Mute::Absent),
        }
    }

    fn rival(&self, rival: SignalId, accused: SignalId, comparisons: &[Comparison], at: Time) -> Rival {
        let mut others = self.comparisons(rival, at);
        others.retain(|comparison| !comparison.signals.contains(accused));
        let not_in = |(_, comparison): &(usize, &Comparison)| {
            comparison.is_conflict() && !comparison.signals.contains(rival)
        };
        let (supported, others): (Vec<_>, Vec<_>) = others.into_iter().partition(Comparison::is_support);
        let is_unheard = |comparison: &Comparison| comparison.relationship == ResidualState::Unknown;
        Rival {
            signal: rival,
            verdict: self.judge.verdict(rival, &self.monitor, at),
            not_in: comparisons.iter().enumerate().filter(not_in).map(|(number, _)| number).collect(),
            supported,
            unheard: others.into_iter().filter(is_unheard).collect(),
        }
    }
}

/// The newest value of the slower of two ways, and the other one brought to its moment.
fn compared(slow: &WatchedWay, fast: &WatchedWay) -> Option<(Interval, Interval, Time)> {
    let newest = slow.outputs.newest(0)?;
    let known = fast.beside(slow, newest.validity).value()?;
    Some((newest.value, known, newest.validity.to))
}

impl Rival {
    /// Whether nothing tells it from the accused: it is part of all that speaks against the accused.
    #[must_use]
    pub fn explains_all(&self) -> bool {
        self.not_in.is_empty()
    }
}

impl Evidence {
    /// The variable in which most speaks against the signal, its own one first; the signal's own when nothing does.
    #[must_use]
    pub fn variable(&self, knowledge: &KnowledgeBase) -> VariableId {
        let own = knowledge.signals()[self.signal].variable;
        let weight = |variable: VariableId, is: fn(&Comparison) -> bool| {
            self.comparisons.iter().filter(|each| each.variable == variable && is(each)).count()
        };
        let rank = |variable: VariableId| {
            (weight(variable, Comparison::is_conflict), variable == own, weight(variable, |_| true))
        };
        let variables = self.comparisons.iter().map(|comparison| comparison.variable);
        let best = variables.reduce(|best, next| if rank(next) > rank(best) { next } else { best });
        best.unwrap_or(own)
    }
}
