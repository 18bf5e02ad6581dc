//! Two ways of knowing the same variable, and how they have compared lately.

use super::trend::{Measured, Tendency, Trend};
use crate::interval::Interval;
use crate::knowledge::SignalSet;
use crate::time::{Span, Time, Validity};

/// How many comparisons are remembered, and how many of them must disagree.
///
/// The window lasts at least [`Debounce::span`] and holds at least [`Debounce::least`] comparisons, so that a fast
/// pair is not condemned by a bump of a few milliseconds and a slow one not after minutes. Of just as many as must
/// disagree, two come one after the other and to the same side: what is wrong lasts, while outliers of a noise with long
/// tails come whenever they do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Debounce {
    /// The shortest window in time.
    pub span: Span,
    /// The fewest comparisons in a window, at most 64.
    pub least: u32,
    /// The share of a window that must disagree.
    pub share: f64,
}

impl Default for Debounce {
    /// 2 of 4, or half of 250 ms.
    fn default() -> Debounce {
        Debounce { span: Span::from_millis(250), least: 4, share: 0.5 }
    }
}

impl Debounce {
    /// The window (`n` comparisons) and the disagreements that make a conflict (`k`) for comparisons every `period`.
    #[must_use]
    pub fn window(&self, period: Span) -> (u32, u32) {
        let in_span = self.span.0 / period.0.max(1);
        let n = u32::try_from(in_span).unwrap_or(64).clamp(self.least, 64).clamp(1, 64);
        let k = libm::ceil(f64::from(n) * self.share) as u32;
        (n, k.clamp(1, n))
    }
}

/// What the recent comparisons of a pair, or the recent values of a signal, say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResidualState {
    /// Nothing to compare, or nothing recent: no evidence.
    Unknown,
    /// All recent comparisons agree.
    Agree,
    /// Some recent comparisons disagree, too few to count.
    Undecided,
    /// Enough recent comparisons disagree.
    Conflict,
}

/// The recent comparisons of two ways of knowing, as bits.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    bits: u64,
    /// Of the disagreements, those to the same side as one right before them.
    lasting: u64,
    /// To which side the last one was: whether the slower way says more.
    is_above: bool,
    compared: u32,
    n: u32,
    k: u32,
    /// Time of the first disagreement in the present window.
    onset: Time,
    /// The same of the first of the conflicts that have followed each other closely, and when the last one was.
    recurs_since: Time,
    last_conflict: Option<Time>,
    last: Option<Time>,
    /// Time between comparisons: as declared, else as last seen.
    period: Span,
    declared: bool,
    span: Span,
    /// How long a comparison counts as evidence: by the period and the span.
    lifetime: Span,
    /// How long after an event the slower way tells all of it.
    lag: Span,
    /// How many disagreements there were of late, among so many comparisons; whether they come again and again.
    outliers: f64,
    memory: f64,
    recurs: bool,
}

/// Single disagreements that come again and again are a conflict, too, although most comparisons agree: when they are this
/// share of them, and as many as this, within so many comparisons, over at least so long: a bad road is over then.
const RECURRING: f64 = 0.04;
const FEWEST_RECURRING: f64 = 4.5;
const RECURS_AMONG: f64 = 64.0;
const RECURS_OVER: Span = Span::from_millis(5_000);
/// until they are half as many. Less than this is none.
const FEW: f64 = 0.01;

/// Evidence is stale after this many periods without a comparison.
const STALE_PERIODS: i64 = 6;

impl Window {
    /// For comparisons that come about every `period` (learnt where it is not declared) and tell of an event after
    /// `lag`.
    #[must_use]
    pub fn new(debounce: Debounce, period: Option<Span>, lag: Span) -> Window {
        let (n, k) = debounce.window(period.unwrap_or(debounce.span));
        let lifetime = lifetime(period.unwrap_or(debounce.span), debounce.span);
        Window {
            bits: 0,
            lasting: 0,
            is_above: false,
            compared: 0,
            n,
            k,
            onset: Time::MIN,
            recurs_since: Time::MIN,
            last_conflict: None,
            last: None,
            period: period.unwrap_or(debounce.span),
            declared: period.is_some(),
            span: debounce.span,
            lifetime,
            lag,
            outliers: 0.0,
            memory: period.map_or(0.0, |period| RECURS_OVER.seconds() / period.seconds()).max(RECURS_AMONG),
            recurs: false,
        }
    }

    /// Goes on with the comparisons of the same pair before a change; whether it does: only when both windows are as long.
    pub fn inherit(&mut self, old: &Window) -> bool {
        let (own, other) = ((self.n, self.k, self.declared), (old.n, old.k, old.declared));
        let is_same = own == other
            && (self.span, self.lag) == (old.span, old.lag)
            && (!self.declared || self.period == old.period);
        if is_same {
            *self = *old;
        }
        is_same
    }

    /// Takes a comparison in: whether it disagrees, and whether the slower way says more. What the window said before, now.
    // Once for every observation or comparison, from two places: by a hint alone it would be called.
    #[inline(always)]
    pub fn record(&mut self, disagrees: bool, is_above: bool, now: Time) -> ResidualState {
        let mut before = ResidualState::Unknown;
        if let Some(last) = self.last {
            let since = now - last;
            let is_stale = since > self.lifetime;
            if !is_stale {
                before = self.said();
            }
            if !self.declared {
                self.period = since.max(Span(1));
                self.lifetime = lifetime(self.period, self.span);
            } else if is_stale {
                self.forget();
            }
        }
        if disagrees && self.bits == 0 {
            self.onset = now;
        }
        if disagrees || self.bits != 0 {
            let mask = u64::MAX >> (64 - self.n);
            let lasts = disagrees && self.bits & 1 != 0 && self.is_above == is_above;
            self.bits = (self.bits << 1 | u64::from(disagrees)) & mask;
            self.lasting = (self.lasting << 1 | u64::from(lasts)) & mask;
            self.is_above = is_above;
        }
        self.compared = (self.compared + 1).min(self.n);
        self.last = Some(now);
        if disagrees || self.outliers > 0.0 {
            self.count(disagrees);
        }
        before
    }

    /// Counts single disagreements over many comparisons. One that lasts is one: the window tells of it.
    #[cold]
    fn count(&mut self, disagrees: bool) {
        self.outliers -= self.outliers / self.memory;
        let is_single = disagrees && self.bits & 0b10 == 0;
        self.outliers += if is_single { 1.0 } else { 0.0 };
        if self.outliers < FEW {
            self.outliers = 0.0;
        }
        let enough = FEWEST_RECURRING.max(RECURRING * self.memory);
        self.recurs = self.outliers >= if self.recurs { 0.5 * enough } else { enough };
    }

    /// Whether something in it has disagreed of late, or has done so again and again.
    pub(super) fn is_restless(&self) -> bool {
        self.bits != 0 || self.recurs
    }

    /// Forgets all comparisons.
    pub fn forget(&mut self) {
        (self.bits, self.lasting) = (0, 0);
        self.compared = 0;
        self.last = None;
        self.last_conflict = None;
        (self.outliers, self.recurs) = (0.0, false);
    }

    /// Its comparisons are in conflict; one that comes again within `memory` is the same.
    fn note_conflict(&mut self, now: Time, memory: Span) {
        if self.last_conflict.is_none_or(|last| now - last > memory) {
            self.recurs_since = self.onset;
        }
        self.last_conflict = Some(now);
    }

    /// What the window says now.
    #[must_use]
    pub fn relationship(&self, now: Time) -> ResidualState {
        match self.last {
            None => ResidualState::Unknown,
            Some(last) if now - last > self.lifetime => ResidualState::Unknown,
            Some(_) => self.said(),
        }
    }

    /// What the window says at the moment of its last comparison.
    fn said(&self) -> ResidualState {
        match self.bits {
            // Most often, and without a count.
            0 if !self.recurs => ResidualState::Agree,
            bits if self.recurs || bits.count_ones() > self.k => ResidualState::Conflict,
            bits if bits.count_ones() == self.k && (self.lasting != 0 || self.k == 1) => {
                ResidualState::Conflict
            }
            _ => ResidualState::Undecided,
        }
    }

    /// Disagreements and comparisons in the window: k of n.
    #[must_use]
    pub fn counts(&self) -> (u32, u32) {
        (self.bits.count_ones(), self.compared)
    }

    /// When the disagreement in the present window began.
    #[must_use]
    pub fn onset(&self) -> Time {
        self.onset
    }

    /// How long a comparison counts as evidence.
    #[must_use]
    pub fn lifetime(&self) -> Span {
        self.lifetime
    }

    /// When the last comparison stops to count as evidence.
    #[must_use]
    pub fn stale_at(&self) -> Option<Time> {
        self.last.map(|last| last + self.lifetime + Span(1))
    }

    /// How long a conflict takes to show after a fault has begun.
    #[must_use]
    pub fn latency(&self) -> Span {
        self.period.times(i64::from(self.k)) + self.lag
    }

    /// Whether there have been enough comparisons since `moment` for a conflict to show.
    #[must_use]
    pub fn confirmed_since(&self, moment: Time) -> bool {
        self.last.is_some_and(|last| last - moment >= self.confirms_after())
    }

    /// When there will have been enough, if comparisons go on.
    #[must_use]
    pub fn confirms_by(&self, moment: Time) -> Time {
        moment + self.confirms_after() + self.period
    }

    fn confirms_after(&self) -> Span {
        self.period.times(i64::from(self.k) - 1) + self.lag
    }
}

fn lifetime(period: Span, span: Span) -> Span {
    period.times(STALE_PERIODS).max(span)
}

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
    /// Whether the relationship is another one.
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
        let before = if disagrees || was_restless {
            self.look_closely(disagrees, (value, other), now)
        } else {
            // As most often: nothing has disagreed of late, and nothing does now.
            self.trend.relax();
            self.window.record(false, false, now)
        };
        self.trend.record(value, other, validity, now);
        let tendency = self.trend.tendency();
        let is_restless = self.window.is_restless() || tendency != Tendency::Calm;
        ResidualRecord {
            changed: before != together(self.window.said(), tendency),
            restless: (was_restless != is_restless).then_some(is_restless),
        }
    }

    /// Takes in whether two values disagree where one does, or did of late; what the comparisons said before.
    #[inline(never)]
    fn look_closely(
        &mut self,
        disagrees: bool,
        (value, other): (&Measured, &Measured),
        now: Time,
    ) -> ResidualState {
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
        before
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
            ResidualState::Conflict => self.window.recurs_since,
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
            Tendency::Building => self.trend.latency(self.window.period).max(self.window.latency()),
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

#[cfg(test)]
mod tests {
    use super::*;

    /// What a window of 2 of 4 says after these comparisons, one a second: `+` and `-` disagree, to either side.
    fn said(comparisons: &str) -> ResidualState {
        let mut window = Window::new(Debounce::default(), Some(Span::from_millis(1_000)), Span::ZERO);
        for (second, it) in comparisons.chars().enumerate() {
            window.record(it != '.', it == '+', Time::from_seconds(second as f64));
        }
        window.said()
    }

    #[test]
    fn as_many_disagreements_as_must_be_last() {
        for lasting in ["++", "..--", "++..", ".+.++"] {
            assert_eq!(said(lasting), ResidualState::Conflict, "{lasting}");
        }
        for outliers in ["+", "+.+", "-..-", "+-", ".+-."] {
            assert_eq!(said(outliers), ResidualState::Undecided, "{outliers}");
        }
        for more in ["+-+", "+.-+", "-+.-"] {
            assert_eq!(said(more), ResidualState::Conflict, "{more}");
        }
        assert_eq!(said("++...."), ResidualState::Agree);
    }
}
