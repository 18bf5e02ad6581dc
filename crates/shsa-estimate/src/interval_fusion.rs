//! Fusion of intervals of which at most `f` are faulty.
//!
//! | rule | answer | |
//! |---|---|---|
//! | [`marzullo`] | from the least to the greatest point in n - f intervals | holds the truth; jumps when an interval moves a little |
//! | [`schmid`] | from the (f+1)-th greatest lower end to the (f+1)-th least upper one | wider; moves no farther than its intervals do |
//! | [`brooks_iyengar`] | the mean of the regions in n - f intervals or more, by how many hold them | a value, and the regions |

use shsa_core::interval::{Interval, tolerant};

/// The fault-tolerant interval: K. Marzullo, "Tolerating failures of continuous-valued sensors", 1990, doi:10.1145/128733.128735.
/// `None` where no point is in enough intervals, or no interval is left. Time: n^2; no allocation.
#[must_use]
pub fn marzullo(intervals: &[Interval], faulty: usize) -> Option<Interval> {
    tolerant(intervals, intervals.len().saturating_sub(faulty))
}

/// The continuous fusion: U. Schmid, K. Schossmaier, "How to reconcile fault-tolerant interval intersection with the Lipschitz
/// condition", 2001, doi:10.1007/PL00008931. `None` where it is empty. Time: n^2; no allocation.
#[must_use]
pub fn schmid(intervals: &[Interval], faulty: usize) -> Option<Interval> {
    if faulty >= intervals.len() {
        return None;
    }
    let lo = ranked(intervals, faulty, |it| -it.lo())?;
    let hi = ranked(intervals, faulty, |it| it.hi())?;
    (-lo <= hi).then(|| Interval::new(-lo, hi))
}

/// The number of a rank, 0 for the smallest.
fn ranked(intervals: &[Interval], rank: usize, key: impl Fn(&Interval) -> f64) -> Option<f64> {
    let is_of_rank = |value: &f64| {
        let below = intervals.iter().filter(|it| key(it) < *value).count();
        let up_to = intervals.iter().filter(|it| key(it) <= *value).count();
        below <= rank && rank < up_to
    };
    intervals.iter().map(&key).find(is_of_rank)
}

/// A region, and the number of intervals that hold all of it.
pub type Region = (Interval, usize);

/// Memory for [`brooks_iyengar`].
#[derive(Clone, Debug, Default)]
pub struct Regions {
    ends: Vec<f64>,
    regions: Vec<Region>,
}

impl Regions {
    /// Memory for up to `n` intervals.
    #[must_use]
    pub fn new(n: usize) -> Regions {
        Regions { ends: Vec::with_capacity(2 * n), regions: Vec::with_capacity(4 * n) }
    }

    /// The regions found, from left to right.
    #[must_use]
    pub fn regions(&self) -> &[Region] {
        &self.regions
    }

    /// The estimate: the mean of the regions' middles, weighted by the number of intervals of each.
    #[must_use]
    pub fn estimate(&self) -> Option<f64> {
        let total: f64 = self.regions.iter().map(|(_, count)| *count as f64).sum();
        let sum: f64 = self.regions.iter().map(|(region, count)| region.midpoint() * *count as f64).sum();
        (total > 0.0).then(|| sum / total)
    }

    /// The hull of all regions, which is Marzullo's interval.
    #[must_use]
    pub fn hull(&self) -> Option<Interval> {
        let (first, last) = (self.regions.first()?, self.regions.last()?);
        Some(first.0.hull(last.0))
    }
}

/// The regions between neighbouring ends that at least n - f intervals hold: R. Brooks, S. Iyengar, "Robust distributed computing
/// and sensing algorithm", 1996, doi:10.1109/2.507632. A point where intervals only touch is a region of no width. Time: n^2; no
/// allocation for up to as many intervals as `found` was made for.
pub fn brooks_iyengar(intervals: &[Interval], faulty: usize, found: &mut Regions) {
    let Regions { ends, regions } = found;
    regions.clear();
    ends.clear();
    let Some(wanted) = intervals.len().checked_sub(faulty).filter(|wanted| *wanted > 0) else { return };
    ends.extend(intervals.iter().flat_map(|it| [it.lo(), it.hi()]));
    ends.sort_unstable_by(f64::total_cmp);
    ends.dedup();
    let count = |lo: f64, hi: f64| intervals.iter().filter(|it| it.lo() <= lo && hi <= it.hi()).count();
    let next = ends.iter().skip(1).map(Some).chain([None]);
    let mut is_touched = false;
    for (lo, hi) in ends.iter().zip(next) {
        let beside = hi.map(|hi| (*hi, count(*lo, *hi))).filter(|(_, count)| *count >= wanted);
        let here = count(*lo, *lo);
        if !is_touched && beside.is_none() && here >= wanted {
            regions.push((Interval::point(*lo), here));
        }
        is_touched = beside.is_some();
        regions.extend(beside.map(|(hi, count)| (Interval::new(*lo, hi), count)));
    }
}

/// The largest number of intervals with a common point; puts all regions in that many intervals into `found`.
pub fn best(intervals: &[Interval], found: &mut Regions) -> usize {
    let most = intervals.iter().map(|it| shsa_core::interval::holding(intervals, it.lo())).max().unwrap_or(0);
    brooks_iyengar(intervals, intervals.len() - most, found);
    most
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn intervals(ends: &[(f64, f64)]) -> Vec<Interval> {
        ends.iter().map(|(lo, width)| Interval::new(*lo, lo + width)).collect()
    }

    proptest! {
        /// Moving each interval by a little moves Schmid's interval by no more.
        #[test]
        fn schmid_is_continuous(
            ends in prop::collection::vec((-5.0..5.0_f64, 0.0..6.0_f64), 3..8),
            shift in -0.1..0.1_f64,
            moved in 0_usize..3,
        ) {
            let before = intervals(&ends);
            let mut after = before.clone();
            after[moved] = Interval::new(before[moved].lo() + shift, before[moved].hi() + shift);
            if let (Some(before), Some(after)) = (schmid(&before, 1), schmid(&after, 1)) {
                prop_assert!((before.lo() - after.lo()).abs() <= shift.abs() + 1e-12);
                prop_assert!((before.hi() - after.hi()).abs() <= shift.abs() + 1e-12);
            }
        }

        /// Schmid's interval contains Marzullo's, and the regions begin and end where Marzullo's does.
        #[test]
        fn the_rules_agree(ends in prop::collection::vec((-5.0..5.0_f64, 0.0..6.0_f64), 1..8), faulty in 0_usize..4) {
            let all = intervals(&ends);
            let mut regions = Regions::new(all.len());
            brooks_iyengar(&all, faulty, &mut regions);
            let inner = marzullo(&all, faulty);
            prop_assert_eq!(regions.hull(), inner);
            prop_assert_eq!(regions.estimate().is_some(), inner.is_some());
            if let Some(inner) = inner {
                let outer = schmid(&all, faulty);
                prop_assert!(outer.is_some_and(|outer| outer.encloses(inner)), "{outer:?} {inner:?}");
            }
        }
    }
}
