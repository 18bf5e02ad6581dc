//! The recent comparisons of two ways, or moments of a signal: how many of how many disagree, and since when.

use crate::time::{Span, Time};

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
    /// So many disagreements are no chance.
    surely: u32,
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
/// No more are counted than this multiple of what is enough.
const MOST_REMEMBERED: f64 = 1.5;

/// Fewer disagreements of noisy values may be chance: noises with long tails have two outliers one after the other once in some
/// hundred hours, but hardly three.
const FEWEST_OF_NOISE: u32 = 3;

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
            surely: k,
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

    /// The same where values are noise: a disagreement is no proof then, so two outliers may come together.
    #[must_use]
    pub fn of_noise(self) -> Window {
        Window { surely: self.k.max(FEWEST_OF_NOISE.min(self.n)), ..self }
    }

    /// Goes on with the comparisons of the same pair before a change; whether it does: only when both windows are as long.
    pub fn inherit(&mut self, old: &Window) -> bool {
        let (own, other) = ((self.n, self.k, self.declared), (old.n, old.k, old.declared));
        let is_same = own == other
            && (self.span, self.lag, self.surely) == (old.span, old.lag, old.surely)
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
        // However often it was, it is over when it has not come again for some time.
        self.outliers = self.outliers.min(MOST_REMEMBERED * enough);
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
    pub(super) fn note_conflict(&mut self, now: Time, memory: Span) {
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
    pub(super) fn said(&self) -> ResidualState {
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

    /// Whether its disagreements are no chance.
    pub(super) fn is_sure(&self) -> bool {
        self.recurs || self.bits.count_ones() >= self.surely
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

    /// When the first of the conflicts began that have followed each other closely.
    pub(super) fn recurs_since(&self) -> Time {
        self.recurs_since
    }

    /// The time between comparisons: as declared, else as last seen.
    pub(super) fn period(&self) -> Span {
        self.period
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
        let enough = self.period.times(i64::from(self.k) - 1) + self.lag;
        self.last.is_some_and(|last| last - moment >= enough)
    }
}

fn lifetime(period: Span, span: Span) -> Span {
    period.times(STALE_PERIODS).max(span)
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
    fn two_outliers_of_noise_may_come_together() {
        let window = |comparisons: &str| {
            let mut window =
                Window::new(Debounce::default(), Some(Span::from_millis(1_000)), Span::ZERO).of_noise();
            for (second, it) in comparisons.chars().enumerate() {
                window.record(it != '.', it == '+', Time::from_seconds(second as f64));
            }
            (window.said(), window.is_sure())
        };
        assert_eq!(window("++"), (ResidualState::Conflict, false));
        assert_eq!(window("++."), (ResidualState::Conflict, false));
        assert_eq!(window("+++"), (ResidualState::Conflict, true));
        assert_eq!(window("+.-+"), (ResidualState::Conflict, true));
        assert_eq!(window("+++..."), (ResidualState::Undecided, false));
    }

    #[test]
    fn what_came_again_and_again_is_over_when_it_comes_no_more() {
        let mut window = Window::new(Debounce::default(), Some(Span::from_millis(1_000)), Span::ZERO);
        let said = |window: &mut Window, second: i32, disagrees: bool| {
            window.record(disagrees, false, Time::from_seconds(f64::from(second)));
            window.said()
        };
        for second in 0..400 {
            said(&mut window, second, second % 3 == 0);
        }
        let over = (400..1000).find(|&second| said(&mut window, second, false) == ResidualState::Agree);
        assert!(over.is_some_and(|second| (460..480).contains(&second)), "{over:?}");
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
