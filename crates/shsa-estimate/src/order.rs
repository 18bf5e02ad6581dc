//! Order statistics: quantiles, and bounds that are exceeded rarely enough, with what supports them.

/// How certain the slope of a tail is an upper bound where it is followed to what is a few times as rare as what was seen.
/// Where it is followed further than that, what is asked for is asked for of the slope, too.
const NEAR_CONFIDENCE: f64 = 0.7;
/// A tail is followed far when fewer of the values than this are expected there.
const FAR: f64 = 0.1;

/// What a bound rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Support {
    /// On an order statistic alone, whatever the distribution: with the wanted confidence.
    Counted {
        /// Which of the largest, from 1.
        rank: usize,
        /// Of so many.
        of: usize,
    },
    /// There are too few for that: the tail above the upper quarter is taken to fall off exponentially.
    Extrapolated {
        /// The largest that was seen.
        largest: f64,
        /// Of so many.
        of: usize,
    },
}

/// The smallest of sorted values that at least this share of them does not exceed; `None` of nothing.
pub(crate) fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.clamp(1, sorted.len().max(1)) - 1).copied()
}

/// The values in ascending order.
pub(crate) fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    values
}

/// The middle value; 0 of nothing.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    quantile(&sorted(values), 0.5).unwrap_or(0.0)
}

/// The mean distance from the median; 0 of nothing. A few wild values count less than in a standard deviation.
pub(crate) fn spread(values: &[f64]) -> f64 {
    let middle = median(values.iter().copied());
    values.iter().map(|value| (value - middle).abs()).sum::<f64>() / values.len().max(1) as f64
}

/// A value that the next of the same kind exceeds with no more than this probability; `None` of nothing.
///
/// `maxima` are the largest values of blocks, which are far enough apart to count as independent. The bound is the order
/// statistic that is above the wanted quantile with `confidence` (H. A. David, H. N. Nagaraja, Order Statistics,
/// DOI 10.1002/0471722162, section 7.1). Where there are too few blocks for that, the excesses over the upper quarter are
/// taken to be exponential, the usual limit of a light tail (J. Pickands, DOI 10.1214/aos/1176343003), with the mean that
/// they have at most with that confidence, or less of it near by; the largest that was seen is a lower limit unless one of so many may exceed the
/// bound. Time: O(n log n).
pub(crate) fn rarely_exceeded(maxima: &[f64], probability: f64, confidence: f64) -> Option<(f64, Support)> {
    let sorted = sorted(maxima.iter().copied());
    let largest = *sorted.last()?;
    let of = sorted.len();
    if let Some(rank) = highest_rank(of, probability, confidence) {
        return Some((*sorted.get(of - rank)?, Support::Counted { rank, of }));
    }
    let above = (of / 4).max(1);
    let from = sorted.get(of.saturating_sub(above + 1)).copied().unwrap_or(largest);
    let sum = sorted.iter().rev().take(above).map(|value| value - from).sum::<f64>();
    let confidence = if of as f64 * probability < FAR { confidence } else { NEAR_CONFIDENCE };
    let excess = sum / fewest_expected(above, confidence);
    let times = above as f64 / (of as f64 * probability.max(f64::MIN_POSITIVE));
    let bound = from + excess * times.ln().max(0.0);
    // None of so many may lie above it, unless one is expected to.
    let least = if of as f64 * probability < 1.0 { largest } else { from };
    Some((bound.max(least), Support::Extrapolated { largest, of }))
}

/// How many are expected at least when `seen` came about with no less than `1 - confidence`: half the quantile of the
/// chi-square distribution with twice as many degrees of freedom, by which the sum of as many exponential values over
/// their mean is distributed.
fn fewest_expected(seen: usize, confidence: f64) -> f64 {
    let as_many_or_more = |expected: f64| {
        let mut term = (-expected).exp();
        let mut fewer = 0.0;
        for count in 0..seen {
            fewer += term;
            term *= expected / (count + 1) as f64;
        }
        1.0 - fewer
    };
    let (mut low, mut high) = (0.0, seen as f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if as_many_or_more(middle) < 1.0 - confidence { &mut low } else { &mut high }) = middle;
    }
    high
}

/// The lowest of the largest values that still lies above the quantile with the wanted confidence: so many or more
/// exceed the quantile with that probability.
fn highest_rank(of: usize, probability: f64, confidence: f64) -> Option<usize> {
    let mut term = (1.0 - probability).powi(i32::try_from(of).unwrap_or(i32::MAX));
    let (mut fewer, mut rank) = (0.0, 0);
    while rank < of {
        fewer += term;
        if 1.0 - fewer < confidence {
            break;
        }
        rank += 1;
        term *= (of + 1 - rank) as f64 / rank as f64 * probability / (1.0 - probability);
    }
    (rank > 0).then_some(rank)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn quantiles_are_values_that_were_seen() {
        let values = [1.0, 2.0, 3.0, 4.0];
        let at = |share| quantile(&values, share);
        assert_eq!([at(0.0), at(0.5), at(0.51), at(1.0)], [Some(1.0), Some(2.0), Some(3.0), Some(4.0)]);
        assert_eq!(quantile(&[], 0.5), None);
        assert_eq!(spread(&[1.0, 1.0, 4.0]), 1.0);
    }

    #[test]
    fn ranks_are_those_of_the_tables() {
        // 59 values are needed for a 95 % bound on the 95 % quantile, 93 for the second largest (Wilks).
        assert_eq!(highest_rank(58, 0.05, 0.95), None);
        assert_eq!(highest_rank(59, 0.05, 0.95), Some(1));
        assert_eq!(highest_rank(92, 0.05, 0.95), Some(1));
        assert_eq!(highest_rank(93, 0.05, 0.95), Some(2));
    }

    #[test]
    fn too_few_are_extrapolated_beyond_the_largest() {
        let maxima: Vec<f64> = (1..=20).map(f64::from).collect();
        let (bound, support) = rarely_exceeded(&maxima, 1e-3, 0.95).unwrap();
        assert_eq!(support, Support::Extrapolated { largest: 20.0, of: 20 });
        // Excesses over 15 are 1 to 5, their sum is 15; ten degrees of freedom have the 5 % quantile 3.940 (tables).
        assert!((bound - (15.0 + 15.0 / (0.5 * 3.940_3) * 250.0_f64.ln())).abs() < 1e-2, "{bound}");
        assert_eq!(rarely_exceeded(&[2.0], 1e-9, 0.95).unwrap().0, 2.0);
        assert_eq!(rarely_exceeded(&[], 0.1, 0.95), None);
    }

    proptest! {
        #[test]
        fn rarer_is_never_lower(maxima in prop::collection::vec(-10.0..10.0_f64, 1..200), one in 1e-6..0.9_f64, other in 1e-6..0.9_f64) {
            let at = |probability| rarely_exceeded(&maxima, probability, 0.95);
            let (rare, often) = (at(one.min(other)).unwrap(), at(one.max(other)).unwrap());
            let counted = |support| matches!(support, Support::Counted { .. });
            // Where one is counted and the other extrapolated, both lie at or above an order statistic.
            prop_assert!(rare.0 >= often.0 || (counted(often.1) != counted(rare.1)));
        }
    }
}
