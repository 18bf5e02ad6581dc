//! The evidence about a signal at a moment: what accuses the signal, what supports it, and what is silent.

use super::{Engine, NeedStatus};
use crate::diagnosis::stands_still;
use crate::interval::Interval;
use crate::knowledge::{KnowledgeBase, NeedId, SignalId, SignalSet, VariableId};
use crate::monitor::{Absence, Residual, ResidualState, Tendency, WatchedWay, WayIndex};
use crate::substitution::Way;
use crate::time::{Span, Time};
use crate::trust::{Component, Verdict};
use alloc::vec::Vec;

/// All that the engine knows about the trust in one signal; ids are those of the engine's knowledge base.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// The signal under examination.
    pub signal: SignalId,
    /// When the evidence was taken.
    pub time: Time,
    /// The verdict on the signal.
    pub verdict: Verdict,
    /// Why the signal gives no usable value; `None` when the signal gives one.
    pub absence: Option<Absence>,
    /// Since when all evidence has supported the accused signal.
    pub clean_since: Option<Time>,
    /// How long all evidence must support the signal before it is trusted again.
    pub probation: Span,
    /// Whether the signal has repeated its value since the accusation: a frozen signal is not cleared.
    pub stands_still: bool,
    /// Every comparison that the signal is part of, in the monitor's order.
    pub comparisons: Vec<Comparison>,
    /// Every other signal that is part of a [conflict](Comparison::is_conflict) with it, in file order.
    pub rivals: Vec<Rival>,
    /// For each conflict, its signals without the accused: if the accused is sound, each of these sets holds a faulty signal.
    pub otherwise: Vec<SignalSet>,
}

/// Two ways of knowing a variable, as they compare at a moment.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The index of the pair in the monitor.
    pub pair: usize,
    /// The variable that both ways know.
    pub variable: VariableId,
    /// The way that rests on the signal.
    pub own: Side,
    /// The way compared with `own`; where it rests on the signal, too, the comparison [is](Self::bears_witness) no independent
    /// witness.
    pub other: Side,
    /// The signals that the two rest on.
    pub signals: SignalSet,
    /// What the recent comparisons say.
    pub residual_state: ResidualState,
    /// How many of the recent comparisons disagree, and how many there are.
    pub counts: (u32, u32),
    /// The tendency of the comparisons where each of them agrees, and the mean excess of `own`, SI.
    pub together: Option<(Tendency, f64)>,
    /// When the present disagreement began; `None` when there is none.
    pub onset: Option<Time>,
    /// The values that last disagreed, SI: of the way that rests on the signal, and of the other one.
    pub disagreed: Option<(Interval, Interval)>,
    /// The last compared values while they are kept, SI, `own` first; and when they were true.
    pub compared: Option<(Interval, Interval, Time)>,
    /// Whether only `own` rests on the signal or its origins, and `own` is computed from the signal.
    pub bears_witness: bool,
    /// Other signals of the comparison that have failed or are forbidden: they explain a disagreement.
    pub explained_by: SignalSet,
}

impl Comparison {
    /// Whether the comparison accuses the signal: its ways disagree, and no other failed signal explains that.
    #[must_use]
    pub fn is_conflict(&self) -> bool {
        self.residual_state == ResidualState::Conflict && self.explained_by.is_empty()
    }

    /// Whether the comparison supports the signal.
    #[must_use]
    pub fn is_support(&self) -> bool {
        self.residual_state == ResidualState::Agree && self.bears_witness && self.explained_by.is_empty()
    }
}

/// One of the two ways of a comparison.
#[derive(Clone, Debug)]
pub struct Side {
    /// The index of the way in the monitor.
    pub index: WayIndex,
    /// The way.
    pub way: Way,
    /// The signals of the way, and the origins of these signals.
    pub rests_on: SignalSet,
    /// Its newest value, SI, and when it was true.
    pub newest: Option<(Time, Interval)>,
    /// The signal because of which the way has no value, and why.
    pub without_value: Option<(SignalId, NoValue)>,
}

/// Why a signal has no value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoValue {
    /// The signal has never given a possible value.
    Never,
    /// The signal has given a value, but not of late.
    Absent(Absence),
}

/// Another signal that may be to blame instead.
#[derive(Clone, Debug)]
pub struct Rival {
    /// The signal.
    pub signal: SignalId,
    /// The verdict on this rival.
    pub verdict: Verdict,
    /// Conflicts of the accused that do not contain this rival, as places in [`Evidence::comparisons`]: it explains none of them.
    pub not_in: Vec<usize>,
    /// Comparisons without the accused in which an independent witness supports this rival.
    pub supported: Vec<Comparison>,
    /// Comparisons without the accused that could tell the two apart, but are silent about this rival.
    pub without_result: Vec<Comparison>,
}

impl Engine {
    /// The evidence about a signal at a moment, which is the present one or the one before the latest input.
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
        let about = Component::Signal(signal);
        Evidence {
            signal,
            time: at,
            verdict: self.judge.verdict(&self.ledger, signal, &self.monitor, at),
            absence: self.absence(signal),
            clean_since: self.ledger.accused(about).and_then(|it| it.support.clean_since()),
            probation: self.ledger.probation_of(about),
            stands_still: stands_still(&self.ledger, about, &self.monitor, at),
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
        let failed = |other: &SignalId| {
            *other != signal && self.ledger.discounted().contains(&Component::Signal(*other))
        };
        let residual_state = pair.residual_state(at);
        let counts = pair.window.counts();
        let disagrees = counts.0 > 0 && residual_state != ResidualState::Unknown;
        let is_together = pair.window.residual_state(at) != residual_state;
        let ahead = if is_slow { pair.trend.mean() } else { -pair.trend.mean() };
        Some(Comparison {
            pair: number,
            variable: slow.variable(),
            bears_witness: is_sized
                && !fast.is_range()
                && !other.rests_on.meets(&self.knowledge.origins(signal)),
            own,
            other,
            signals: pair.signals.clone(),
            residual_state,
            counts,
            together: is_together.then(|| (pair.trend.tendency(), ahead)),
            onset: (disagrees || is_together).then(|| pair.onset(at)),
            disagreed: disagreed.filter(|_| disagrees),
            compared,
            explained_by: pair.signals.iter().filter(failed).collect(),
        })
    }

    fn side(&self, index: WayIndex, way: &WatchedWay) -> Side {
        let without_value = way.rests_on.iter().find_map(|signal| Some((signal, self.no_value(signal)?)));
        let newest = way.outputs.newest(0).map(|sample| (sample.validity.to, sample.value));
        Side {
            index,
            way: way.computation.way().clone(),
            rests_on: way.rests_on.clone(),
            newest,
            without_value,
        }
    }

    fn no_value(&self, signal: SignalId) -> Option<NoValue> {
        match (self.monitor.timeouts().has_given_value(signal), self.absence(signal)) {
            (false, _) => Some(NoValue::Never),
            (true, absence) => absence.map(NoValue::Absent),
        }
    }

    fn rival(&self, rival: SignalId, accused: SignalId, comparisons: &[Comparison], at: Time) -> Rival {
        let mut others = self.comparisons(rival, at);
        others.retain(|comparison| !comparison.signals.contains(accused));
        let not_in = |(_, comparison): &(usize, &Comparison)| {
            comparison.is_conflict() && !comparison.signals.contains(rival)
        };
        let (supported, others): (Vec<_>, Vec<_>) = others.into_iter().partition(Comparison::is_support);
        let is_without_result = |comparison: &Comparison| comparison.residual_state == ResidualState::Unknown;
        Rival {
            signal: rival,
            verdict: self.judge.verdict(&self.ledger, rival, &self.monitor, at),
            not_in: comparisons.iter().enumerate().filter(not_in).map(|(number, _)| number).collect(),
            supported,
            without_result: others.into_iter().filter(is_without_result).collect(),
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
    /// Whether this rival is part of every conflict of the accused, so that nothing distinguishes the two.
    #[must_use]
    pub fn explains_all(&self) -> bool {
        self.not_in.is_empty()
    }
}

impl Evidence {
    /// The variable with the most conflicts of the signal, its own one first; the signal's own when nothing does.
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
