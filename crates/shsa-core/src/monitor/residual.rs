//! Two ways of knowing the same variable, and how they have compared lately.

use super::trend::{Measured, Tendency, Trend};
use super::window::{ResidualState, Window};
use crate::interval::Interval;
use crate::knowledge::SignalSet;
use crate::time::{Span, Time, Validity};

/// Which way of knowing: an index into the monitor's ways.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WayIndex(pub u32);

/// The comparison in which two ways last disagreed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disagreement {
    /// When it was.
    pub time: Time,
    /// The value of the way that was compared, SI.
    pub value: Interval,
    /// The value of the other way at the same moment, SI.
    pub other: Interval,
}

/// An agreement at this share of the tolerance, or beyond it, may soon be none.
const CLOSE: f64 = 0.75;

/// Two ways of knowing one variable.
#[derive(Clone, Debug)]
pub struct Residual {
    /// The slower way: a comparison is made when it delivers.
    pub way: WayIndex,
    /// The faster way, brought to the moment of the slower one.
    pub other: WayIndex,
    /// The signals that both rest on: one of these is faulty when the two disagree.
    pub signals: SignalSet,
    /// The recent comparisons.
    pub window: Window,
    /// What many comparisons say together.
    pub trend: Trend,
    /// The last disagreement.
    pub disagreement: Option<Disagreement>,
    /// The first moment at which the slower way has said something that the faster one has not yet.
    pub(super) due: Option<Time>,
    /// What the faster way was known to have said about a moment of the slower one, where that may be asked again.
    pub(super) known: Option<(Validity, Measured)>,
    /// How many comparisons were made.
    pub made: u64,
    /// How many could have been made before the pair was watched.
    pub(super) before: u64,
}

/// What a comparison has changed.
#[derive(Clone, Copy, Debug)]
pub(super) struct ResidualRecord {
    /// Whether the relationship is another one, or is sure now.
    pub(super) changed: bool,
    /// Whether the pair [is restless](Pair::is_restless) now, where it was the other way before.
    pub(super) restless: Option<bool>,
}

impl Residual {
    /// Takes a comparison in.
    // Once for every observation or comparison, from two places: by a hint alone it would be called.
    #[inline(always)]
    pub(super) fn record(
        &mut self,
        value: &Measured,
        other: &Measured,
        validity: Validity,
        now: Time,
    ) -> ResidualRecord {
        self.made += 1;
        let disagrees = !value.value.overlaps(other.value);
        let was_restless = self.is_restless();
        let (before, is_surer) = if disagrees || was_restless {
            self.look_closely(disagrees, value, other, now)
        } else {
            // As most often: nothing has disagreed of late, and nothing does now.
            self.trend.relax();
            (self.window.record(false, false, now), false)
        };
        self.trend.record(value, other, validity, now);
        let tendency = self.trend.tendency();
        let is_restless = self.window.is_restless() || tendency != Tendency::Calm;
        ResidualRecord {
            changed: is_surer || before != together(self.window.said(), tendency),
            restless: (was_restless != is_restless).then_some(is_restless),
        }
    }

    /// Takes in whether two values disagree where one does, or did of late; what the comparisons said before, and whether they
    /// have become [sure](Residual::is_sure).
    #[inline(never)]
    fn look_closely(
        &mut self,
        disagrees: bool,
        value: &Measured,
        other: &Measured,
        now: Time,
    ) -> (ResidualState, bool) {
        let was_sure = self.is_sure();
        let is_above = value.value.lo() > other.value.lo();
        let before = together(self.window.record(disagrees, is_above, now), self.trend.tendency());
        if disagrees {
            self.disagreement = Some(Disagreement { time: now, value: value.value, other: other.value });
        }
        match self.window.said() {
            ResidualState::Agree => self.trend.relax(),
            ResidualState::Conflict => {
                self.window.note_conflict(now, self.trend.span());
                self.trend.engage();
            }
            ResidualState::Undecided | ResidualState::Unknown => {}
        }
        (before, !was_sure && self.is_sure())
    }

    /// Whether what its comparisons say against each other is no chance: a bound that is left is a proof, but of noise two outliers
    /// may come together.
    pub(crate) fn is_sure(&self) -> bool {
        self.window.is_sure() || self.trend.tendency().is_alarm()
    }

    /// What its comparisons say now, each on its own and together.
    #[must_use]
    pub fn relationship(&self, now: Time) -> ResidualState {
        together(self.window.relationship(now), self.trend.tendency())
    }

    /// Whether one of its recent comparisons disagrees, or something comes together over many: without that it is neither
    /// undecided nor in conflict.
    pub(super) fn is_restless(&self) -> bool {
        self.window.is_restless() || self.trend.tendency() != Tendency::Calm
    }

    /// When what they say against each other began, or together was enough to count.
    #[must_use]
    pub fn onset(&self, now: Time) -> Time {
        let single = self.window.relationship(now);
        if single == self.relationship(now) { self.window.onset() } else { self.trend.raised() }
    }

    /// The same of the first of the conflicts that have come and gone since then, where there were such.
    #[must_use]
    pub fn recurs_since(&self, now: Time) -> Time {
        match self.window.relationship(now) {
            ResidualState::Conflict => self.window.recurs_since(),
            _ => self.onset(now),
        }
    }

    /// Whether something comes together that may become a conflict.
    #[must_use]
    pub fn is_building(&self) -> bool {
        self.trend.tendency() == Tendency::Building
    }

    /// Whether the last comparison agrees with so little to spare that the next ones may disagree.
    #[must_use]
    pub fn is_close(&self) -> bool {
        self.trend.last_share() > CLOSE
    }

    /// How long a conflict takes to show after a fault has begun.
    #[must_use]
    pub fn latency(&self) -> Span {
        match self.trend.tendency() {
            Tendency::Building => self.trend.latency(self.window.period()).max(self.window.latency()),
            _ => self.window.latency(),
        }
    }
}

/// What single comparisons say, and what comes together over many.
#[inline]
fn together(single: ResidualState, tendency: Tendency) -> ResidualState {
    match (single, tendency) {
        (ResidualState::Unknown, _) => ResidualState::Unknown,
        (_, Tendency::Drift | Tendency::Noise | Tendency::Skew) => ResidualState::Conflict,
        (single, Tendency::Calm | Tendency::Building) => single,
    }
}
