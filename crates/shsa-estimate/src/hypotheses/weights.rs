//! Which copies go on: a fault that is taken for true, and copies that end.

use super::{Hypotheses, MOST};

/// A fault with all but this share of the weight is taken for true, which cannot be taken back; until then the estimate is the mixture
/// already, but no second fault is considered. Chosen among eight values by failures of docs/charge.md: 1 in 3,000 and 1 in 10,000 are
/// alike there, with 1 in 100 a current of the wrong sign costs 9 % of the capacity of the first recording instead of 0.5 %, and with 1 in
/// 30,000 six of the seven failures that were tried cost 5 to 21 % of that of the second one.
const DOUBT: f64 = 0.0003;
/// A copy with a smaller share of the weight, as a logarithm, ends.
const LEAST: f64 = -60.0;

impl Hypotheses {
    /// Sets the largest weight to 1, and takes a fault for true that has nearly all of the weight.
    pub(super) fn weigh(&mut self) {
        let weights = self.copies.iter_mut().take(self.count).map(|copy| &mut copy.weight);
        weights.filter(|weight| weight.is_nan()).for_each(|weight| *weight = f64::NEG_INFINITY);
        let greatest = self.used().iter().map(|copy| copy.weight).fold(f64::NEG_INFINITY, f64::max);
        if !greatest.is_finite() {
            return self.take_for_true(0);
        }
        self.copies.iter_mut().take(self.count).for_each(|copy| copy.weight -= greatest);
        let all: f64 = self.used().iter().map(|copy| libm::exp(copy.weight)).sum();
        for fault in 0..self.faults.len() {
            let of_fault = || self.used().iter().filter(|copy| copy.fault == Some(fault));
            let sum: f64 = of_fault().map(|copy| libm::exp(copy.weight)).sum();
            if sum > (1.0 - DOUBT) * all {
                let best = (0..self.count)
                    .filter(|at| self.copies.get(*at).is_some_and(|copy| copy.fault == Some(fault)))
                    .max_by(|one, other| self.weight(*one).total_cmp(&self.weight(*other)));
                self.take_for_true(best.unwrap_or(0));
                return;
            }
        }
    }

    fn weight(&self, place: usize) -> f64 {
        self.copies.get(place).map_or(f64::NEG_INFINITY, |copy| copy.weight)
    }

    fn take_for_true(&mut self, place: usize) {
        self.copies.swap(0, place);
        self.count = 1;
        if let Some(copy) = self.copies.first_mut() {
            (copy.weight, copy.fault, copy.age) = (0.0, None, 0.0);
        }
    }

    /// Ends copies without weight, and of too many of a fault those that are closest in age.
    pub(super) fn thin_out(&mut self) {
        let mut place = 1;
        while place < self.count {
            match self.weight(place) < LEAST {
                true => self.end(place),
                false => place += 1,
            }
        }
        for fault in 0..self.faults.len() {
            while let Some((older, newer)) = self.closest(fault) {
                self.join(older, newer);
            }
        }
    }

    /// Of two copies of a fault, the one with less weight ends, and the other one gets its weight: that of a fault since then is kept.
    fn join(&mut self, older: usize, newer: usize) {
        let (one, other) = (self.weight(older), self.weight(newer));
        let (kept, ended) = if one >= other { (older, newer) } else { (newer, older) };
        if let Some(copy) = self.copies.get_mut(kept) {
            copy.weight += libm::log1p(libm::exp(one.min(other) - copy.weight));
        }
        self.end(ended);
    }

    /// Of more than [`MOST`] copies of a fault, which are in the order of their ages, the two whose ages are the closest.
    fn closest(&self, fault: usize) -> Option<(usize, usize)> {
        let of_fault =
            || (0..self.count).filter(|at| self.copies.get(*at).is_some_and(|it| it.fault == Some(fault)));
        if of_fault().count() <= MOST {
            return None;
        }
        let age = |place: usize| self.copies.get(place).map_or(0.0, |copy| copy.age);
        let ratio = |older: usize, newer: usize| age(older) / age(newer).max(f64::MIN_POSITIVE);
        let pairs = of_fault().zip(of_fault().skip(1));
        pairs.min_by(|one, other| ratio(one.0, one.1).total_cmp(&ratio(other.0, other.1)))
    }

    /// Ends a copy; the order of the others stays.
    fn end(&mut self, place: usize) {
        if let Some(rest) = self.copies.get_mut(place..self.count) {
            rest.rotate_left(1);
            self.count -= 1;
        }
    }
}
