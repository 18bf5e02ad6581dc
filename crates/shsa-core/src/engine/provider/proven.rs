//! How well proven a source is, among sources of the same utility.

use crate::knowledge::{KnowledgeBase, VariableId};
use crate::monitor::Figures;
use crate::numbers::{EVEN, FINEST_ERROR};
use crate::reason::{Amount, Proof};
use core::cmp::{Ordering, Reverse};

/// A source with its rank when the sources were last ranked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ranked {
    /// The place of the source in the list.
    pub(super) at: usize,
    /// The utility of the source with its record, where the model rates records.
    pub(super) utility: f64,
    figures: Figures,
    goes_on: bool,
    pub(super) rank: Rank,
}

impl Ranked {
    pub(super) fn new(at: usize, utility: f64, figures: Figures, goes_on: bool) -> Ranked {
        Ranked { at, utility, figures, goes_on, rank: Rank::NONE }
    }

    /// Better sources come first: not relying on the need's own last value, then by utility, by record, and by the order of the
    /// search.
    pub(super) fn order(&self, other: &Ranked) -> Ordering {
        let by_utility = self.goes_on.cmp(&other.goes_on).then(other.utility.total_cmp(&self.utility));
        by_utility.then(self.rank.cmp(&other.rank)).then(self.at.cmp(&other.at))
    }

    /// The source's record, as events report it.
    pub(super) fn proof(&self, knowledge: &KnowledgeBase, variable: VariableId) -> Proof {
        let Figures { agreement, error, availability, .. } = self.figures;
        Proof { agreement, error: error.map(|error| Amount::of(knowledge, variable, error)), availability }
    }
}

/// The record of a source compared with others of the same utility; less is better.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Rank {
    /// Per cent of the time in which the source was present and right.
    share: Reverse<u32>,
    /// The source's error beyond the smallest one, in steps of the root of two; an unknown error ranks last.
    distance: u32,
}

impl Rank {
    /// The rank of every source where records do not count.
    const NONE: Rank = Rank { share: Reverse(0), distance: 0 };

    pub(super) fn among(all: &[Ranked], ranked: &Ranked) -> Rank {
        let equals = || {
            let is_equal = |other: &&Ranked| other.utility.total_cmp(&ranked.utility) == Ordering::Equal;
            all.iter().filter(is_equal).map(|other| other.figures)
        };
        let least_error = equals().filter_map(|figures| figures.error).reduce(f64::min);
        let least_width = equals().filter_map(|figures| figures.width).reduce(f64::min);
        let finest = (FINEST_ERROR * least_width.unwrap_or(0.0)).max(least_error.unwrap_or(0.0));
        let Figures { agreement, error, availability, .. } = ranked.figures;
        // A way that is not watched is not known to have been absent.
        let share = agreement.unwrap_or(EVEN) * availability.unwrap_or(1.0);
        let steps = |error: f64| match error <= finest {
            true => 0,
            false => libm::floor(2.0 * libm::log2(error / finest.max(f64::MIN_POSITIVE))) as u32,
        };
        Rank { share: Reverse(libm::round(100.0 * share) as u32), distance: error.map_or(u32::MAX, steps) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;
    use proptest::prelude::*;

    fn ranked(agreement: Option<f64>, error: Option<f64>, availability: Option<f64>) -> Ranked {
        let figures = Figures { agreement, error, width: error.map(|_| 1.0), availability };
        Ranked { at: 0, utility: 1.0, figures, goes_on: false, rank: Rank::NONE }
    }

    /// Checks that each source of the list is better than the next.
    #[track_caller]
    fn check(list: &[Ranked]) {
        let ranks: Vec<Rank> = list.iter().map(|one| Rank::among(list, one)).collect();
        assert!(ranks.is_sorted_by(|one, other| one < other), "{ranks:?}");
    }

    #[test]
    fn unknown_stands_between_right_and_wrong() {
        check(&[
            ranked(Some(1.0), Some(0.1), Some(1.0)),
            ranked(Some(1.0), Some(0.2), Some(1.0)),
            ranked(Some(0.9), Some(0.1), Some(1.0)),
            ranked(None, None, None),
            ranked(Some(0.4), Some(0.1), Some(1.0)),
            ranked(None, None, Some(0.1)),
        ]);
    }

    #[test]
    fn small_differences_prove_nothing() {
        let list = [
            ranked(Some(1.0), Some(0.001), Some(1.0)),
            ranked(Some(0.999), Some(0.04), Some(0.998)),
            ranked(Some(1.0), Some(0.0), Some(1.0)),
        ];
        let ranks = list.map(|one| Rank::among(&list, &one));
        assert_eq!(ranks[0], ranks[1]);
        assert_eq!(ranks[0], ranks[2]);
    }

    fn share() -> impl Strategy<Value = Option<f64>> {
        prop::option::of(0.0..=1.0_f64)
    }

    proptest! {
        /// A source that is worse in no respect never ranks lower.
        #[test]
        fn what_is_better_in_all_respects_is_not_behind(
            others in prop::collection::vec((share(), prop::option::of(0.0..9.0_f64), share()), 0..6),
            one in (0.0..=1.0_f64, 0.0..9.0_f64, 0.0..=1.0_f64),
            better in (0.0..=1.0_f64, 0.0..=1.0_f64, 0.0..=1.0_f64),
        ) {
            let mut all: Vec<Ranked> = others.into_iter().map(|(a, e, v)| ranked(a, e, v)).collect();
            let raised = |share: f64, by: f64| Some(share + (1.0 - share) * by);
            all.push(ranked(Some(one.0), Some(one.1), Some(one.2)));
            all.push(ranked(raised(one.0, better.0), Some(one.1 * better.1), raised(one.2, better.2)));
            let rank = |back: usize| Rank::among(&all, &all[all.len() - back]);
            prop_assert!(rank(1) <= rank(2));
        }
    }
}
