//! How well a source is proven among others of the same utility.

use crate::knowledge::{KnowledgeBase, VariableId};
use crate::monitor::Figures;
use crate::reason::{Amount, Proof};
use core::cmp::{Ordering, Reverse};

/// What a share of comparisons counts as while nothing is known of it: better than what was wrong more often than right.
const UNKNOWN_SHARE: f64 = 0.5;

/// Errors below this share of the narrowest width are all as good.
const FINEST_ERROR: f64 = 0.1;

/// A source with its worth when the sources were last ranked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ranked {
    /// Where it stands in the sources.
    pub(super) at: usize,
    /// Its utility with how it ran, where the model rates that.
    pub(super) utility: f64,
    figures: Figures,
    goes_on: bool,
    pub(super) standing: Standing,
}

impl Ranked {
    pub(super) fn new(at: usize, utility: f64, figures: Figures, goes_on: bool) -> Ranked {
        Ranked { at, utility, figures, goes_on, standing: Standing::NONE }
    }

    /// Better sources come first: what does not only go on from its own last value, by utility, the best proven of equals,
    /// then in the order of the search.
    pub(super) fn order(&self, other: &Ranked) -> Ordering {
        let by_utility = self.goes_on.cmp(&other.goes_on).then(other.utility.total_cmp(&self.utility));
        by_utility.then(self.standing.cmp(&other.standing)).then(self.at.cmp(&other.at))
    }

    /// What is known of it from how it ran.
    pub(super) fn proof(&self, knowledge: &KnowledgeBase, variable: VariableId) -> Proof {
        let Figures { agreement, error, availability, .. } = self.figures;
        Proof { agreement, error: error.map(|error| Amount::of(knowledge, variable, error)), availability }
    }
}

/// How well a source is proven among others of the same utility; less is better.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Standing {
    /// Per cent of the time in which it was there and right.
    share: Reverse<u32>,
    /// How much further from the others it was than the nearest, in steps of the root of two; unknown is the last.
    distance: u32,
}

impl Standing {
    /// That of all where proof does not count.
    const NONE: Standing = Standing { share: Reverse(0), distance: 0 };

    pub(super) fn among(all: &[Ranked], ranked: &Ranked) -> Standing {
        let equals = || {
            let is_equal = |other: &&Ranked| other.utility.total_cmp(&ranked.utility) == Ordering::Equal;
            all.iter().filter(is_equal).map(|other| other.figures)
        };
        let least_error = equals().filter_map(|figures| figures.error).reduce(f64::min);
        let least_width = equals().filter_map(|figures| figures.width).reduce(f64::min);
        let finest = (FINEST_ERROR * least_width.unwrap_or(0.0)).max(least_error.unwrap_or(0.0));
        let Figures { agreement, error, availability, .. } = ranked.figures;
        // What is not watched is not known to have been absent.
        let share = agreement.unwrap_or(UNKNOWN_SHARE) * availability.unwrap_or(1.0);
        let steps = |error: f64| match error <= finest {
            true => 0,
            false => libm::floor(2.0 * libm::log2(error / finest.max(f64::MIN_POSITIVE))) as u32,
        };
        Standing {
            share: Reverse(libm::round(100.0 * share) as u32),
            distance: error.map_or(u32::MAX, steps),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;
    use proptest::prelude::*;

    fn ranked(agreement: Option<f64>, error: Option<f64>, availability: Option<f64>) -> Ranked {
        let figures = Figures { agreement, error, width: error.map(|_| 1.0), availability };
        Ranked { at: 0, utility: 1.0, figures, goes_on: false, standing: Standing::NONE }
    }

    /// Each of the list is better than the next.
    #[track_caller]
    fn check(list: &[Ranked]) {
        let standings: Vec<Standing> = list.iter().map(|one| Standing::among(list, one)).collect();
        assert!(standings.is_sorted_by(|one, other| one < other), "{standings:?}");
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
        let standings = list.map(|one| Standing::among(&list, &one));
        assert_eq!(standings[0], standings[1]);
        assert_eq!(standings[0], standings[2]);
    }

    fn share() -> impl Strategy<Value = Option<f64>> {
        prop::option::of(0.0..=1.0_f64)
    }

    proptest! {
        /// A source that is nowhere worse stands nowhere behind.
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
            let standing = |back: usize| Standing::among(&all, &all[all.len() - back]);
            prop_assert!(standing(1) <= standing(2));
        }
    }
}
