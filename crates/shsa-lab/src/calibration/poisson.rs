//! Confidence bounds for the expected number of rare events, by their count.

/// The lower bound of the expected number of events when `seen` were counted, with 95 % confidence: half the 5 % quantile of the
/// chi-square distribution with twice as many degrees of freedom (F. Garwood 1936, doi:10.1093/biomet/28.3-4.437).
#[must_use]
pub fn fewest_expected(seen: usize) -> f64 {
    bisected(seen as f64, |expected| 1.0 - fewer_than(seen, expected) < 0.05)
}

/// The upper bound of the expected number of events when `seen` were counted, with 95 % confidence: 3.00 for none, 4.74 for one.
#[must_use]
pub fn most_expected(seen: usize) -> f64 {
    bisected(seen as f64 + 10.0 + 6.0 * (seen as f64).sqrt(), |expected| {
        fewer_than(seen + 1, expected) > 0.05
    })
}

/// The probability of fewer than `count` events when `expected` are expected.
fn fewer_than(count: usize, expected: f64) -> f64 {
    let mut term = (-expected).exp();
    let mut sum = 0.0;
    for number in 0..count {
        sum += term;
        term *= expected / (number + 1) as f64;
    }
    sum
}

/// The highest number up to `most` for which `is_below` holds.
fn bisected(most: f64, is_below: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if is_below(middle) { &mut low } else { &mut high }) = middle;
    }
    high
}
