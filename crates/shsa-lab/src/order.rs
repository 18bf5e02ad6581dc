//! Order statistics and moments of values.

/// Values further from the median than this many deviations are clipped: outliers are a matter of tails.
const WINSOR: f64 = 5.0;

/// The smallest of sorted values that this share of them does not exceed; `None` without values.
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

/// The median; 0 without values.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    quantile(&sorted(values), 0.5).unwrap_or(0.0)
}

/// The mean distance from the median; 0 without values. Outliers count less than in a standard deviation.
pub(crate) fn spread(values: &[f64]) -> f64 {
    let middle = median(values.iter().copied());
    values.iter().map(|value| (value - middle).abs()).sum::<f64>() / values.len().max(1) as f64
}

/// The mean; 0 without values.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// The mean square distance from the mean; 0 without values.
pub(crate) fn variance(values: &[f64]) -> f64 {
    let middle = mean(values);
    values.iter().map(|value| (value - middle).powi(2)).sum::<f64>() / values.len().max(1) as f64
}

/// The variance of values clipped to five deviations, which are estimated from the middle half.
pub(crate) fn winsorised(values: &[f64]) -> f64 {
    let middle = median(values.iter().copied());
    let deviation = 1.4826 * median(values.iter().map(|it| (it - middle).abs()));
    if deviation <= 0.0 {
        return variance(values);
    }
    let most = WINSOR * deviation;
    variance(&values.iter().map(|it| it.clamp(middle - most, middle + most)).collect::<Vec<f64>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values_that_were_seen() {
        let values = [1.0, 2.0, 3.0, 4.0];
        let at = |share| quantile(&values, share);
        assert_eq!([at(0.0), at(0.5), at(0.51), at(1.0)], [Some(1.0), Some(2.0), Some(3.0), Some(4.0)]);
        assert_eq!(quantile(&[], 0.5), None);
        assert_eq!(spread(&[1.0, 1.0, 4.0]), 1.0);
    }

    #[test]
    fn moments_are_those_of_the_values() {
        assert_eq!((mean(&[1.0, 2.0, 6.0]), variance(&[1.0, 3.0]), variance(&[])), (3.0, 1.0, 0.0));
    }
}
