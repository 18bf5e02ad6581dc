//! The recent record of a way of knowing: how often it agreed with the others, how far it was from them, and how much of the time
//! it gave a value.

mod fading;
mod presence;

use crate::knowledge::Figure;
use crate::numbers::{FEWEST, OFTEN, RECENT};
use crate::time::{Span, Time};
use fading::Fading;
use presence::Presence;

/// The time constant of the memory of records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Memory(
    /// The time after which evidence has 1/e of its weight.
    pub Span,
);

impl Default for Memory {
    /// The default: a minute.
    fn default() -> Memory {
        Memory(RECENT)
    }
}

/// The record of a way in figures. A figure without evidence is `None`: neither good nor bad.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figures {
    /// The share of comparisons, 0 to 1, in which the way agreed with the consensus of independent ways.
    pub agreement: Option<f64>,
    /// The mean distance of the value's middle from the middle of that consensus, SI.
    pub error: Option<f64>,
    /// The mean width of the values, SI.
    pub width: Option<f64>,
    /// The share of time, 0 to 1, in which the way gave a value.
    pub availability: Option<f64>,
}

impl Figures {
    /// The figure of a kind.
    #[must_use]
    pub fn get(&self, figure: Figure) -> Option<f64> {
        match figure {
            Figure::Agreement => self.agreement,
            Figure::Error => self.error,
            Figure::Width => self.width,
            Figure::Availability => self.availability,
        }
    }
}

/// The running figures of one way: sums that each comparison and each value update in O(1).
///
/// Exponentially weighted in time without initial bias: a share is of the observed time only (like the bias correction of Adam,
/// Kingma and Ba, "Adam: A Method for Stochastic Optimization", 2015, arXiv:1412.6980).
#[derive(Clone, Copy, Debug)]
pub struct Reliability {
    comparisons: Fading,
    /// Weights of all comparisons, of those that agreed, and of those with a consensus to measure from.
    compared: f64,
    agreed: f64,
    measured: f64,
    /// Weighted sums of distances and of widths.
    distance: f64,
    width: f64,
    last_compared: Option<Time>,
    presence: Presence,
}

impl Reliability {
    /// The record of a way that gives a value every `period`, if that is declared.
    #[must_use]
    pub fn new(period: Option<Span>, memory: Memory) -> Reliability {
        let memory = memory.0.max(period.unwrap_or(Span::ZERO).times(OFTEN));
        Reliability {
            comparisons: Fading::new(memory),
            compared: 0.0,
            agreed: 0.0,
            measured: 0.0,
            distance: 0.0,
            width: 0.0,
            last_compared: None,
            presence: Presence::new(period, memory),
        }
    }

    /// Takes over the record of the same way before a change of the model.
    pub(super) fn inherit(&mut self, old: Reliability) {
        let new = *self;
        *self = old;
        self.comparisons = new.comparisons;
        self.presence.adopt(&new.presence);
    }

    /// Begins the record: from this moment on the way could give values.
    pub fn begin(&mut self, now: Time) {
        self.presence.begin(now);
    }

    /// Notes that the way has given a value.
    #[inline]
    pub fn deliver(&mut self, now: Time) {
        self.presence.deliver(now);
    }

    /// Notes a comparison: whether the value agreed with the consensus, how far it was from the consensus if there was one (SI),
    /// and how wide it was (SI).
    #[inline]
    pub fn compare(&mut self, agrees: bool, distance: Option<f64>, width: f64, now: Time) {
        let factor = self.last_compared.map_or(1.0, |last| self.comparisons.over(now - last));
        let add = |sum: &mut f64, amount: f64| *sum = *sum * factor + amount;
        let (measured, distance) = distance.map_or((0.0, 0.0), |distance| (1.0, distance));
        add(&mut self.compared, 1.0);
        add(&mut self.agreed, if agrees { 1.0 } else { 0.0 });
        add(&mut self.measured, measured);
        add(&mut self.distance, distance);
        add(&mut self.width, width);
        self.last_compared = Some(now);
    }

    /// The figures at a moment that is not before the last comparison or value.
    #[must_use]
    pub fn figures(&self, now: Time) -> Figures {
        let factor = self.last_compared.map_or(0.0, |last| self.comparisons.at(now - last));
        let known = |weight: f64| weight * factor >= f64::from(FEWEST);
        let share = |sum: f64, weight: f64| known(weight).then(|| sum / weight);
        Figures {
            agreement: share(self.agreed, self.compared).map(|share| share.clamp(0.0, 1.0)),
            error: share(self.distance, self.measured),
            width: share(self.width, self.compared),
            availability: self.presence.share(now),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;
    use proptest::prelude::*;

    const TENTH: Span = Span(100_000_000);

    fn at(tenths: i64) -> Time {
        Time::default() + TENTH.times(tenths)
    }

    fn close(found: Option<f64>, expected: f64) -> bool {
        found.is_some_and(|found| (found - expected).abs() < 1e-9)
    }

    #[test]
    fn nothing_is_known_without_evidence() {
        let mut record = Reliability::new(Some(TENTH), Memory::default());
        assert_eq!(record.figures(at(100)), Figures::default());
        record.begin(at(0));
        let silent = record.figures(at(1_000));
        assert!(silent.availability.is_some_and(|share| share < 0.01), "{silent:?}");
        assert_eq!((silent.agreement, silent.error), (None, None));
        record.compare(true, Some(0.0), 1.0, at(1));
        record.compare(true, Some(0.0), 1.0, at(2));
        assert_eq!(record.figures(at(2)).agreement, None, "two comparisons prove nothing");
    }

    #[test]
    fn what_is_proven_is_forgotten_in_the_end() {
        let mut record = Reliability::new(Some(TENTH), Memory(Span::from_millis(1_000)));
        (0..100).for_each(|n| record.compare(true, Some(0.5), 1.0, at(n)));
        assert!(close(record.figures(at(100)).agreement, 1.0) && close(record.figures(at(100)).error, 0.5));
        assert_eq!(record.figures(at(200)).agreement, None);
    }

    #[test]
    fn a_slow_way_is_remembered_longer() {
        let minute = Span(60_000_000_000);
        let mut record = Reliability::new(Some(minute), Memory::default());
        (0..30).for_each(|n| record.compare(n % 2 == 0, None, 1.0, Time::default() + minute.times(n)));
        let figures = record.figures(Time::default() + minute.times(30));
        assert!(figures.agreement.is_some_and(|share| (share - 0.5).abs() < 0.05), "{figures:?}");
        assert_eq!(figures.error, None, "there was no consensus to measure from");
    }

    #[test]
    fn outages_count_by_their_time() {
        for period in [Some(TENTH), None] {
            let mut record = Reliability::new(period, Memory(Span(1_000_000_000_000)));
            record.begin(at(0));
            // One second with values, one without; a value holds for two periods.
            (0..400).filter(|n| n / 10 % 2 == 0).for_each(|n| record.deliver(at(n)));
            let share = record.figures(at(400)).availability.unwrap();
            assert!((share - 11.0 / 20.0).abs() < 0.02, "{period:?}: {share}");
        }
    }

    proptest! {
        /// The sums equal the weighted means of the whole past.
        #[test]
        fn running_figures_are_weighted_means(
            past in prop::collection::vec((1..50_i64, any::<bool>(), prop::option::of(0.0..9.0_f64)), 40..80),
            memory in 20..100_i64,
        ) {
            let mut record = Reliability::new(None, Memory(TENTH.times(memory)));
            let mut now = at(0);
            let mut ratings = Vec::new();
            for &(wait, agrees, distance) in &past {
                now = now + TENTH.times(wait);
                record.compare(agrees, distance, 2.0, now);
                ratings.push((now, agrees, distance));
            }
            let weight = |time: Time| (-(now - time).seconds() / TENTH.times(memory).seconds()).exp();
            let all: f64 = ratings.iter().map(|ratings| weight(ratings.0)).sum();
            let agreed: f64 = ratings.iter().filter(|ratings| ratings.1).map(|ratings| weight(ratings.0)).sum();
            let measured: f64 = ratings.iter().filter(|ratings| ratings.2.is_some()).map(|ratings| weight(ratings.0)).sum();
            let distance: f64 = ratings.iter().map(|ratings| weight(ratings.0) * ratings.2.unwrap_or(0.0)).sum();
            let figures = record.figures(now);
            match figures.agreement {
                Some(share) => prop_assert!((share - agreed / all).abs() < 1e-9 && close(figures.width, 2.0)),
                None => prop_assert!(all < f64::from(FEWEST) + 1e-9),
            }
            match figures.error {
                Some(error) => prop_assert!((error - distance / measured).abs() < 1e-9),
                None => prop_assert!(measured < f64::from(FEWEST) + 1e-9),
            }
        }

        /// A query changes nothing, and a query between two values is right for its time.
        #[test]
        fn availability_is_the_weighted_share_of_time(
            gaps in prop::collection::vec(1..40_i64, 1..60), memory in 20..200_i64,
        ) {
            let mut record = Reliability::new(Some(TENTH), Memory(TENTH.times(memory)));
            record.begin(at(0));
            let mut there = alloc::vec![true, true];
            let mut now = 0;
            for &gap in &gaps {
                now += gap;
                there.resize(usize::try_from(now).unwrap(), false);
                record.deliver(at(now));
                there.extend([true, true]);
            }
            there.truncate(usize::try_from(now).unwrap());
            let weight = |n: usize| (-((now as usize - n) as f64) / memory as f64).exp();
            let all: f64 = (0..there.len()).map(weight).sum();
            let given: f64 = (0..there.len()).filter(|&n| there[n]).map(weight).sum();
            let share = record.figures(at(now)).availability;
            prop_assert!(close(share, given / all), "{share:?} {}", given / all);
            prop_assert_eq!(share, record.figures(at(now)).availability);
        }
    }
}
