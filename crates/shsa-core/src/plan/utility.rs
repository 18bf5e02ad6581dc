//! The utility of a substitution: a weight for each relation and signal, joined exactly.

use crate::knowledge::Aggregate;

/// The number of bits of a weight that count relations.
const COUNT_BITS: u32 = 32;
/// Steps per neper: weights are whole steps, so that sums are exact in any order.
const STEPS_PER_NEPER: f64 = (1_u64 << 50) as f64;
/// The reciprocal, which is exact, too.
const NEPERS_PER_STEP: f64 = 1.0 / STEPS_PER_NEPER;
/// Steps per unit of cost: a decimal number, as costs are written.
const STEPS_PER_COST: f64 = 1e9;
/// The badness of a rating of 0: practically infinite, but sums of it do not overflow.
const HEAVIEST: f64 = (1_u128 << 62) as f64;

/// The badness, and below it the number of relations; smaller is better.
///
/// The negative logarithm of a product or minimum, or a sum of costs. It is a whole number: sums of floating-point logarithms (or
/// products of ratings) depend on their order, and rounding would tell equally good substitutions apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Weight(u128);

impl Weight {
    /// The weight of nothing.
    pub(super) const ZERO: Weight = Weight(0);
    /// The weight of the impossible: heavier than any sum, and so is every sum with it.
    pub(super) const MAX: Weight = Weight(u128::MAX);

    /// Whether it is the weight of something impossible.
    pub(super) fn is_impossible(self) -> bool {
        self.steps() == Weight::MAX.steps()
    }

    /// The sum of two additive weights; saturates at the heaviest.
    pub(super) fn plus(self, other: Weight) -> Weight {
        Weight(self.0.saturating_add(other.0))
    }

    fn new(steps: u128, relations: u32) -> Weight {
        Weight((steps << COUNT_BITS) | u128::from(relations))
    }

    fn steps(self) -> u128 {
        self.0 >> COUNT_BITS
    }

    fn relations(self) -> u32 {
        (self.0 & u128::from(u32::MAX)) as u32
    }
}

/// How weights are joined, and turned into a utility.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Scale(pub(super) Aggregate);

impl Scale {
    /// Whether the best parts make the best whole.
    pub(super) fn is_additive(self) -> bool {
        self.0 != Aggregate::Minimum
    }

    /// The weight of a relation; rounded by at most 2^-51 of a neper, or of a unit of cost. A rating without a value is
    /// the worst.
    pub(super) fn relation(self, rating: f64) -> Weight {
        Weight::new(self.steps(rating), 1)
    }

    /// The weight of a signal.
    pub(super) fn signal(self, rating: f64) -> Weight {
        Weight::new(self.steps(rating), 0)
    }

    fn steps(self, rating: f64) -> u128 {
        if rating.is_nan() {
            return HEAVIEST as u128;
        }
        let bad = if self.0 == Aggregate::Sum { rating } else { -libm::log(rating) };
        libm::round(bad * self.unit()).clamp(0.0, HEAVIEST) as u128
    }

    fn unit(self) -> f64 {
        if self.0 == Aggregate::Sum { STEPS_PER_COST } else { STEPS_PER_NEPER }
    }

    /// The weight of two parts of a substitution together; associative and commutative.
    pub(super) fn join(self, one: Weight, other: Weight) -> Weight {
        match self.0 {
            Aggregate::Product | Aggregate::Sum => one.plus(other),
            Aggregate::Minimum => {
                Weight::new(one.steps().max(other.steps()), one.relations().saturating_add(other.relations()))
            }
        }
    }

    /// The weight of all parts together.
    pub(super) fn join_all(self, weights: impl Iterator<Item = Weight>) -> Weight {
        weights.fold(Weight::ZERO, |all, weight| self.join(all, weight))
    }

    /// The bound of a whole after the bound of a part is removed, to be replaced by a better one.
    ///
    /// A maximum cannot be taken apart; keeping it is right, as a better bound of a part is never lighter.
    pub(super) fn without(self, whole: Weight, part: Weight) -> Weight {
        match self.0 {
            Aggregate::Product | Aggregate::Sum => Weight(whole.0.saturating_sub(part.0)),
            Aggregate::Minimum => {
                Weight::new(whole.steps(), whole.relations().saturating_sub(part.relations()))
            }
        }
    }

    /// A lower bound of several bounds: for a maximum, badness and relations are bounded separately, as the whole may be as bad
    /// as its worst part anyway.
    pub(super) fn least(self, one: Weight, other: Weight) -> Weight {
        match self.0 {
            Aggregate::Product | Aggregate::Sum => one.min(other),
            Aggregate::Minimum => {
                Weight::new(one.steps().min(other.steps()), one.relations().min(other.relations()))
            }
        }
    }

    /// The additional weight of a relation at a second output, once it has been counted with `charged`.
    pub(super) fn extra(self, weight: Weight, charged: Weight) -> Weight {
        if charged == Weight::ZERO {
            return weight;
        }
        let steps = match self.0 {
            Aggregate::Product | Aggregate::Sum => weight.steps().saturating_sub(charged.steps()),
            Aggregate::Minimum => weight.steps(),
        };
        Weight::new(steps, 0)
    }

    /// The utility, rounded to 12 significant digits; monotone in the weight.
    pub(super) fn utility(self, weight: Weight) -> f64 {
        let steps = match weight.0 >> (COUNT_BITS + u64::BITS) {
            // The same value, computed faster.
            0 => (weight.0 >> COUNT_BITS) as u64 as f64,
            _ => large(weight.steps()),
        };
        let bad = if self.0 == Aggregate::Sum { steps / STEPS_PER_COST } else { steps * NEPERS_PER_STEP };
        match self.0 {
            Aggregate::Product | Aggregate::Minimum => rounded(libm::exp(-bad)),
            Aggregate::Sum => 0.0 - rounded(bad),
        }
    }

    /// The highest utility of any substitution.
    pub(super) fn best(self) -> f64 {
        self.utility(Weight::ZERO)
    }

    /// The bound when nothing is left.
    pub(super) fn worst(self) -> f64 {
        match self.0 {
            Aggregate::Product | Aggregate::Minimum => 0.0,
            Aggregate::Sum => f64::NEG_INFINITY,
        }
    }
}

/// A function of its own, so that it is not computed and thrown away.
#[cold]
#[inline(never)]
fn large(steps: u128) -> f64 {
    steps as f64
}

/// Rounds a non-negative number to 12 significant digits, so that 0.9 is shown as 0.9.
fn rounded(value: f64) -> f64 {
    let mut scale = 1e12;
    while value * scale >= 1e12 && scale > 1e-3 {
        scale /= 10.0;
    }
    while value * scale < 1e11 && scale < 1e300 {
        scale *= 10.0;
    }
    libm::round(value * scale) / scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PRODUCT: Scale = Scale(Aggregate::Product);
    const MINIMUM: Scale = Scale(Aggregate::Minimum);
    const SUM: Scale = Scale(Aggregate::Sum);

    #[test]
    fn a_utility_is_shown_as_people_write_it() {
        for scale in [PRODUCT, MINIMUM] {
            assert_eq!(scale.best(), 1.0);
            for rating in [1.0, 0.9, 0.85, 0.3, 0.001, 1e-9, 0.0] {
                assert_eq!(scale.utility(scale.relation(rating)), rating);
            }
        }
        assert_eq!(SUM.best(), 0.0);
        for cost in [1.0, 0.1, 12.5, 1e6 + 0.25, 1e9] {
            assert_eq!(SUM.utility(SUM.relation(cost)), -cost);
        }
    }

    #[test]
    fn a_rating_that_rounding_put_out_of_range_is_the_best() {
        assert_eq!(PRODUCT.relation(1.0 + f64::EPSILON), PRODUCT.relation(1.0));
        assert_eq!(SUM.relation(-1e-300), SUM.relation(0.0));
    }

    #[test]
    fn a_rating_without_a_value_is_the_worst() {
        for scale in [PRODUCT, MINIMUM, SUM] {
            assert!(scale.relation(f64::NAN) >= scale.relation(scale.0.range().lo()));
            assert!(scale.relation(f64::NAN) >= scale.relation(scale.0.range().hi()));
        }
    }

    #[test]
    fn more_relations_are_heavier_at_the_same_utility() {
        for scale in [PRODUCT, MINIMUM, SUM] {
            let one = scale.relation(scale.0.best());
            let two = scale.join(one, one);
            assert!(two > one && scale.utility(two) == scale.best());
            assert_eq!(scale.join(one, scale.signal(scale.0.best())), one);
        }
    }

    #[test]
    fn what_cannot_be_had_stays_so() {
        for scale in [PRODUCT, MINIMUM, SUM] {
            let heavy = scale.join_all((0..1000).map(|_| scale.relation(scale.0.range().lo())));
            assert!(!heavy.is_impossible() && scale.join(heavy, Weight::MAX).is_impossible());
        }
    }

    proptest! {
        #[test]
        fn weights_join_to_the_aggregate(ratings in prop::collection::vec(0.05..=1.0_f64, 0..40)) {
            let joined = |scale: Scale| scale.utility(scale.join_all(ratings.iter().map(|&r| scale.relation(r))));
            let product: f64 = ratings.iter().product();
            prop_assert!((joined(PRODUCT) - product).abs() <= 6e-12 * product, "{} {product}", joined(PRODUCT));
            let least = ratings.iter().copied().fold(1.0, f64::min);
            prop_assert!((joined(MINIMUM) - least).abs() <= 6e-12, "{} {least}", joined(MINIMUM));
            let sum: f64 = ratings.iter().sum();
            prop_assert!((joined(SUM) + sum).abs() <= 40e-9, "{} {sum}", joined(SUM));
        }

        #[test]
        fn a_heavier_weight_has_no_higher_utility(a in 0.0..=1.0_f64, step in 0..100_u32) {
            for scale in [PRODUCT, MINIMUM, SUM] {
                let heavy = scale.relation(a.max(1e-300));
                let heavier = Weight::new(heavy.steps() + u128::from(step), 1);
                prop_assert!(scale.utility(heavier) <= scale.utility(heavy));
            }
        }
    }
}
