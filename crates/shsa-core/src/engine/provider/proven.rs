//! Which source is the best proven one, at the moment at which one has to be chosen.
//!
//! Sources are ranked when the trust in a signal has changed, never in between: how ways run makes no source flap.

use super::super::reason;
use super::super::ways::Source;
use super::Provider;
use crate::knowledge::KnowledgeBase;
use crate::monitor::{Figures, Monitor};
use crate::time::Time;
use alloc::format;
use alloc::string::String;
use core::cmp::{Ordering, Reverse};

/// What a share of comparisons counts as while nothing is known of it: better than what was wrong more often than right.
const UNKNOWN_SHARE: f64 = 0.5;

/// Errors below this share of the narrowest width are all as good.
const FINEST_ERROR: f64 = 0.1;

/// A source with its worth when the sources were last ranked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ranked {
    /// Where it stands in the sources.
    at: usize,
    /// Its utility with how it ran, where the model rates that.
    pub(super) utility: f64,
    figures: Figures,
    goes_on: bool,
    standing: Standing,
}

impl Provider {
    /// Ranks the sources by utility, of equals the best proven first: by the share of time in which they gave a value that
    /// others confirmed, then by their distance from the others, then in the order of the search.
    ///
    /// Complexity: O(n²) for the at most 32 sources, whatever the model holds.
    pub(super) fn rank(&mut self, knowledge: &KnowledgeBase, monitor: &Monitor, now: Option<Time>) {
        let rates_ways = knowledge.utility().rates_ways();
        let prefers_proven = self.prefers_proven;
        let ranked = |(at, source): (usize, &Source)| {
            let watched = now.and_then(|now| Some(monitor.figures(monitor.find(&source.way)?, now)));
            let figures = watched.filter(|_| prefers_proven || rates_ways).unwrap_or_default();
            let rating = knowledge.utility().of_way(|figure| figures.get(figure));
            let utility = match rates_ways {
                true => knowledge.utility().aggregate().with(source.utility, rating),
                false => source.utility,
            };
            let goes_on = source.way.substitution.continues_itself(knowledge);
            Ranked { at, utility, figures, goes_on, standing: Standing::NONE }
        };
        // In the place of the last ones: where nothing serves the need, this is done with every value.
        self.ranked.clear();
        self.ranked.extend(self.sources.iter().enumerate().map(ranked));
        if prefers_proven {
            self.compare();
        }
        self.ranked.sort_unstable_by(|one, other| {
            let by_utility = one.goes_on.cmp(&other.goes_on).then(other.utility.total_cmp(&one.utility));
            by_utility.then(one.standing.cmp(&other.standing)).then(one.at.cmp(&other.at))
        });
    }

    /// Sees how well each source is proven among the others.
    fn compare(&mut self) {
        for at in 0..self.ranked.len() {
            let standing = self.ranked.get(at).map(|ranked| Standing::among(&self.ranked, ranked));
            if let (Some(ranked), Some(standing)) = (self.ranked.get_mut(at), standing) {
                ranked.standing = standing;
            }
        }
    }

    /// The sources as they were last ranked, best first.
    pub(super) fn ranked(&self) -> impl Iterator<Item = (&Source, &Ranked)> {
        self.ranked.iter().filter_map(|ranked| Some((self.sources.get(ranked.at)?, ranked)))
    }

    /// What is known of a source from how it ran, in words: empty unless that has made the choice.
    pub(super) fn proof(&self, knowledge: &KnowledgeBase, ranked: &Ranked) -> String {
        let in_order = self.ranked.iter().map(|ranked| ranked.at).is_sorted();
        if in_order && !knowledge.utility().rates_ways() {
            return String::new();
        }
        let Figures { agreement, error, availability, .. } = ranked.figures;
        let percent = |share: Option<f64>| {
            share.map_or(String::from("an unknown share"), |share| format!("{:.1} %", 100.0 * share))
        };
        let distance = error.map_or(String::new(), |error| {
            format!(", {} off", reason::difference(knowledge, self.variable, error))
        });
        match (agreement, availability) {
            (None, None) => String::from(", not proven"),
            _ => format!(
                ", agreed in {}{distance}, there {} of the time",
                percent(agreement),
                percent(availability)
            ),
        }
    }
}

/// How well a source is proven among others of the same utility; less is better.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Standing {
    /// Per cent of the time in which it was there and right.
    share: Reverse<u32>,
    /// How much further from the others it was than the nearest, in steps of the root of two; unknown is the last.
    distance: u32,
}

impl Standing {
    /// That of all where proof does not count.
    const NONE: Standing = Standing { share: Reverse(0), distance: 0 };

    fn among(all: &[Ranked], ranked: &Ranked) -> Standing {
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
