//! The recent comparisons of two ways, or the recent readings of a signal: how many of them disagree, and since when.

mod recurring;

use crate::numbers::{DEBOUNCE, FEWEST, HALF, IN_A_ROW, STALE_PERIODS};
use crate::time::{Span, Time};
pub(super) use recurring::Recurring;

/// How many comparisons are kept, and how many of them must disagree.
///
/// The window lasts at least [`Debounce::span`] and holds at least [`Debounce::least`] comparisons, so that a bump of a few
/// milliseconds does not accuse a fast pair, and a slow pair is not accused only after minutes. At least two of the disagreements
/// must follow each other to the same side: a fault lasts, while outliers of a noise with long tails are single.
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
        Debounce { span: DEBOUNCE, least: IN_A_ROW, share: HALF }
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

/// The state of a pair by its recent comparisons, or of a signal by its recent readings.
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
    /// The disagreements that follow another one to the same side, as bits.
    lasting: u64,
    /// The side of the last disagreement: whether the slower way has the larger value.
    is_above: bool,
    compared: u32,
    n: u32,
    k: u32,
    /// From this number on, disagreements are no chance.
    surely: u32,
    /// Time of the first disagreement in the present window.
    onset: Time,
    /// The time of the first disagreement in a series of conflicts that follow each other closely, and the time of the last one.
    recurs_since: Time,
    last_conflict: Option<Time>,
    last: Option<Time>,
    /// The time between comparisons: as declared, else that of the last two.
    period: Span,
    declared: bool,
    span: Span,
    /// How long a comparison counts as evidence, by the period and the span.
    lifetime: Span,
    /// How long after an event its full effect is in the slower way.
    lag: Span,
    /// The single disagreements, and whether they recur: a conflict, too, although most comparisons agree.
    singles: Recurring,
    recurs: bool,
}

impl Window {
    /// A window for comparisons every `period` (learnt where it is not declared), in which the full effect of an event shows
    /// after `lag`.
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
            singles: Recurring::new(period),
            recurs: false,
        }
    }

    /// The window for values with noise. A disagreement is no proof then, as two outliers may follow each other.
    #[must_use]
    pub fn of_noise(self) -> Window {
        Window { surely: self.k.max(FEWEST.min(self.n)), ..self }
    }

    /// Takes over the comparisons of the same pair before a change, if both windows have the same length; returns whether they
    /// have.
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

    /// Adds a comparison: whether it disagrees, and whether the slower way has the larger value. Returns the state before, now.
    // Once for every observation or comparison, from two places: by a hint alone it would be called.
    #[inline(always)]
    pub fn record(&mut self, disagrees: bool, is_above: bool, now: Time) -> ResidualState {
        let mut before = ResidualState::Unknown;
        if let Some(last) = self.last {
            let since = now - last;
            let is_stale = since > self.lifetime;
            if !is_stale {
                before = self.latest_state();
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
        if disagrees || self.singles.is_any() {
            self.count(disagrees);
        }
        before
    }

    /// Counts single disagreements over many comparisons. A lasting disagreement counts once: the window shows it.
    #[cold]
    fn count(&mut self, disagrees: bool) {
        self.singles.fade();
        if disagrees && self.bits & 0b10 == 0 {
            self.singles.add();
        }
        self.recurs = self.singles.are_too_many(self.recurs);
    }

    /// Whether a recent comparison disagrees, or disagreements recur.
    pub(super) fn is_restless(&self) -> bool {
        self.bits != 0 || self.recurs
    }

    /// Drops all comparisons.
    pub fn forget(&mut self) {
        (self.bits, self.lasting) = (0, 0);
        self.compared = 0;
        self.last = None;
        self.last_conflict = None;
        self.singles.forget();
        self.recurs = false;
    }

    /// Notes that the comparisons are in conflict; a conflict that follows within `memory` continues the series.
    pub(super) fn note_conflict(&mut self, now: Time, memory: Span) {
        if self.last_conflict.is_none_or(|last| now - last > memory) {
            self.recurs_since = self.onset;
        }
        self.last_conflict = Some(now);
    }

    /// The state now.
    #[must_use]
    pub fn residual_state(&self, now: Time) -> ResidualState {
        match self.last {
            None => ResidualState::Unknown,
            Some(last) if now - last > self.lifetime => ResidualState::Unknown,
            Some(_) => self.latest_state(),
        }
    }

    /// The state at the last comparison.
    pub(super) fn latest_state(&self) -> ResidualState {
        match self.bits {
            // The most frequent case, without counting bits.
            0 if !self.recurs => ResidualState::Agree,
            bits if self.recurs || bits.count_ones() > self.k => ResidualState::Conflict,
            bits if bits.count_ones() == self.k && (self.lasting != 0 || self.k == 1) => {
                ResidualState::Conflict
            }
            _ => ResidualState::Undecided,
        }
    }

    /// Whether the newest comparison disagrees.
    pub(super) fn disagrees_now(&self) -> bool {
        self.bits & 1 != 0
    }

    /// Whether the newest comparison disagrees, no other one in the window does, and a disagreement is no chance.
    pub(super) fn is_first(&self) -> bool {
        self.bits == 1 && !self.recurs && self.surely == self.k
    }

    /// Whether single disagreements come again and again.
    pub(super) fn recurs(&self) -> bool {
        self.recurs
    }

    /// Whether the disagreements are no chance.
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

    /// When the first conflict of the present series began.
    pub(super) fn recurs_since(&self) -> Time {
        self.recurs_since
    }

    /// The time between comparisons: as declared, else that of the last two.
    pub(super) fn period(&self) -> Span {
        self.period
    }

    /// How long a comparison counts as evidence.
    #[must_use]
    pub fn lifetime(&self) -> Span {
        self.lifetime
    }

    /// How far back the oldest comparison in the window may lie.
    #[must_use]
    pub fn reach(&self) -> Span {
        self.period.times(i64::from(self.n))
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

    /// The state of a window of 2 of 4 after these comparisons, one a second: `+` and `-` are disagreements to either side.
    fn latest_state(comparisons: &str) -> ResidualState {
        let mut window = Window::new(Debounce::default(), Some(Span::from_millis(1_000)), Span::ZERO);
        for (second, it) in comparisons.chars().enumerate() {
            window.record(it != '.', it == '+', Time::from_seconds(second as f64));
        }
        window.latest_state()
    }

    #[test]
    fn two_outliers_of_noise_may_come_together() {
        let window = |comparisons: &str| {
            let mut window =
                Window::new(Debounce::default(), Some(Span::from_millis(1_000)), Span::ZERO).of_noise();
            for (second, it) in comparisons.chars().enumerate() {
                window.record(it != '.', it == '+', Time::from_seconds(second as f64));
            }
            (window.latest_state(), window.is_sure())
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
        let latest_state = |window: &mut Window, second: i32, disagrees: bool| {
            window.record(disagrees, false, Time::from_seconds(f64::from(second)));
            window.latest_state()
        };
        for second in 0..400 {
            latest_state(&mut window, second, second % 3 == 0);
        }
        let over =
            (400..1000).find(|&second| latest_state(&mut window, second, false) == ResidualState::Agree);
        assert!(over.is_some_and(|second| (460..480).contains(&second)), "{over:?}");
    }

    #[test]
    fn as_many_disagreements_as_must_be_last() {
        for lasting in ["++", "..--", "++..", ".+.++"] {
            assert_eq!(latest_state(lasting), ResidualState::Conflict, "{lasting}");
        }
        for outliers in ["+", "+.+", "-..-", "+-", ".+-."] {
            assert_eq!(latest_state(outliers), ResidualState::Undecided, "{outliers}");
        }
        for more in ["+-+", "+.-+", "-+.-"] {
            assert_eq!(latest_state(more), ResidualState::Conflict, "{more}");
        }
        assert_eq!(latest_state("++...."), ResidualState::Agree);
    }
}
