//! An upper bound of execution times by measurement, with its confidence.
//!
//! Nothing is assumed of the distribution of the times: the bound is an order statistic (G. Hahn, W. Meeker, "Statistical
//! Intervals", 1991, ch. 5, doi:10.1002/9780470316771). It is one for the conditions under which the times were measured: the same
//! machine, load and inputs. It is no worst case that an analysis of the program would give.

use hdrhistogram::Histogram;

/// The share of executions that the bound is about.
const SHARE: f64 = 0.999;
/// The risk that a larger share takes longer.
const RISK: f64 = 0.05;
/// The deviations of a normal distribution that leave the risk on one side.
const DEVIATIONS: f64 = 1.645;
/// Above so many expected executions beyond the share, a normal distribution stands for the binomial one.
const MANY: f64 = 500.0;

/// The fewest executions that give a bound.
pub const FEWEST_EXECUTIONS: u64 = 2_995;

/// The time that 99.9 % of all executions do not exceed, with a confidence of 95 %, in the unit of the histogram; `None` for fewer than
/// [`FEWEST_EXECUTIONS`]. Complexity: O(buckets), and at most 500 steps.
///
/// # Example
/// ```
/// use hdrhistogram::Histogram;
/// use shsa_runtime::{FEWEST_EXECUTIONS, execution_bound};
///
/// let mut times = Histogram::<u64>::new_with_bounds(1, 60_000_000_000, 2).unwrap();
/// times.record_n(5_000, FEWEST_EXECUTIONS - 1).unwrap();
/// assert_eq!(execution_bound(&times), None);
/// times.record(9_000).unwrap();
/// assert!(execution_bound(&times).unwrap() >= 9_000);
/// ```
#[must_use]
pub fn execution_bound(times: &Histogram<u64>) -> Option<u64> {
    let count = times.len();
    let beyond = exceeding(count)?;
    Some(times.value_at_quantile((count - beyond) as f64 / count as f64))
}

/// The most executions of so many that may be left above the bound.
fn exceeding(count: u64) -> Option<u64> {
    let (n, p) = (count as f64, 1.0 - SHARE);
    if n * p > MANY {
        return Some((n * p - DEVIATIONS * (n * p * SHARE).sqrt() - 1.0) as u64);
    }
    let mut probability = (n * SHARE.ln()).exp();
    let mut sum = probability;
    if sum > RISK {
        return None;
    }
    let mut left = 0_u64;
    loop {
        probability *= (n - left as f64) / (left as f64 + 1.0) * p / SHARE;
        sum += probability;
        if sum > RISK {
            return Some(left);
        }
        left += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn so_many_may_be_left_above() {
        assert_eq!(exceeding(FEWEST_EXECUTIONS - 1), None);
        assert_eq!(exceeding(FEWEST_EXECUTIONS), Some(0));
        // Where both ways of counting meet, they differ by the one that the approximation leaves as a margin.
        let (exact, normal) = (exceeding(500_000).unwrap(), exceeding(500_001).unwrap());
        assert!(normal <= exact && exact - normal <= 2, "{exact} and {normal}");
    }

    /// Of many series of measurements, at most the stated share has a bound below the true quantile.
    #[test]
    fn the_confidence_is_kept() {
        // A sequence of pseudo-random numbers (D. Knuth's multiplier), evenly distributed: the quantile is known.
        let mut seed = 1_u64;
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / f64::from(1_u32 << 31)
        };
        let mut missed = 0;
        for _ in 0..400 {
            let mut times = Histogram::<u64>::new_with_bounds(1, 10_000_000, 4).unwrap();
            (0..5_000).for_each(|_| times.record(1 + (uniform() * 1e6) as u64).unwrap());
            missed += usize::from(execution_bound(&times).unwrap() < 999_000);
        }
        // 5 % of 400 are 20; three deviations more are 33.
        assert!(missed <= 33, "{missed}");
    }
}
