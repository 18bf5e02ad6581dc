//! Explanations: minimal hitting sets of the conflicts, ranked.
//!
//! Two ways of knowing that disagree are a conflict over the signals that both rest on: at least one of these is
//! faulty. A set of signals that meets every conflict explains them all; the smallest such sets are the
//! candidates (Reiter 1987, DOI 10.1016/0004-3702(87)90062-2). One clear answer names the culprit; several say
//! that it cannot be told.

use crate::knowledge::{SignalId, SignalSet};
use alloc::vec::Vec;

/// Signals that together explain every conflict, when all of them are faulty.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The signals that would be faulty.
    pub signals: SignalSet,
    /// Product of the prior fault probabilities of its signals.
    pub prior: f64,
    /// How many agreements speak for its signals, so against it.
    pub support: usize,
}

/// What the conflicts say.
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// Nothing disagrees.
    Consistent,
    /// One explanation is smaller, or by its prior far likelier, than all others: these signals are faulty.
    Clear(Candidate),
    /// Several explanations are as good: ranked, best first.
    Ambiguous(Vec<Candidate>),
}

/// How many times likelier than the next an explanation of the same size must be to be clear.
const CLEAR_RATIO: f64 = 100.0;

/// Largest number of faults at once that is looked for, and of partial explanations kept while searching.
const LARGEST: usize = 6;
const MOST_PARTIAL: usize = 4_096;

/// Explains conflicts by the fewest faulty signals.
///
/// Arguments: the conflicts; for each signal its prior fault probability; for each signal how many agreements
/// speak for it. Returns all hitting sets of the smallest size, ranked by prior, then by support, then by file
/// order. Beyond six simultaneous faults or 4,096 partial sets the conflicts are told to be ambiguous between all
/// their signals. Complexity: O(w^s) for s faults and conflicts of at most w signals, cut off as said.
#[must_use]
pub fn explain(
    conflicts: &[SignalSet],
    prior: impl Fn(SignalId) -> f64,
    support: impl Fn(SignalId) -> usize,
) -> Finding {
    if conflicts.is_empty() {
        return Finding::Consistent;
    }
    let mut candidates: Vec<Candidate> = smallest_hitting_sets(conflicts)
        .into_iter()
        .map(|signals| Candidate {
            prior: signals.iter().map(&prior).product(),
            support: signals.iter().map(&support).sum(),
            signals,
        })
        .collect();
    candidates.sort_by(|a, b| {
        b.prior
            .total_cmp(&a.prior)
            .then(a.support.cmp(&b.support))
            .then_with(|| a.signals.iter().cmp(b.signals.iter()))
    });
    match candidates.as_slice() {
        [only] => Finding::Clear(only.clone()),
        [first, second, ..] if first.prior >= CLEAR_RATIO * second.prior => Finding::Clear(first.clone()),
        _ => Finding::Ambiguous(candidates),
    }
}

/// All sets of the smallest size that meet every conflict, by breadth: every partial set is extended by each
/// signal of the first conflict that it does not meet.
fn smallest_hitting_sets(conflicts: &[SignalSet]) -> Vec<SignalSet> {
    let mut partial = Vec::from([SignalSet::new()]);
    for _ in 0..=LARGEST {
        let complete: Vec<SignalSet> =
            partial.iter().filter(|set| first_unmet(set, conflicts).is_none()).cloned().collect();
        if !complete.is_empty() {
            return complete;
        }
        partial = partial.iter().flat_map(|set| extended(set, conflicts)).collect();
        partial.sort_unstable();
        partial.dedup();
        if partial.len() > MOST_PARTIAL {
            break;
        }
    }
    everyone(conflicts)
}

fn first_unmet<'a>(set: &SignalSet, conflicts: &'a [SignalSet]) -> Option<&'a SignalSet> {
    conflicts.iter().find(|conflict| !conflict.meets(set))
}

fn extended<'a>(set: &'a SignalSet, conflicts: &'a [SignalSet]) -> impl Iterator<Item = SignalSet> + 'a {
    first_unmet(set, conflicts).into_iter().flat_map(SignalSet::iter).map(move |signal| {
        let mut larger = set.clone();
        larger.insert(signal);
        larger
    })
}

/// Each signal of the conflicts as an explanation of its own: too much is wrong to tell.
fn everyone(conflicts: &[SignalSet]) -> Vec<SignalSet> {
    let mut all = SignalSet::new();
    conflicts.iter().for_each(|conflict| all.extend(conflict));
    all.iter().map(|signal| SignalSet::from_iter([signal])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::knowledge::Id;
    use proptest::prelude::*;
    use std::format;
    use std::string::String;
    use std::vec;

    fn set(indices: &[usize]) -> SignalSet {
        indices.iter().map(|&index| SignalId::from_index(index)).collect()
    }

    fn text(candidate: &Candidate) -> String {
        let names: Vec<String> =
            candidate.signals.iter().map(|signal| format!("{}", signal.index())).collect();
        names.join("+")
    }

    #[track_caller]
    fn check(conflicts: &[&[usize]], expected: &str) {
        let conflicts: Vec<SignalSet> = conflicts.iter().map(|conflict| set(conflict)).collect();
        let found = match explain(&conflicts, |_| 0.01, |_| 0) {
            Finding::Consistent => String::from("consistent"),
            Finding::Clear(candidate) => format!("clear {}", text(&candidate)),
            Finding::Ambiguous(all) => {
                format!("ambiguous {}", all.iter().map(text).collect::<Vec<_>>().join(" "))
            }
        };
        assert_eq!(found, expected);
    }

    #[test]
    fn one_liar_among_five_is_clear() {
        check(&[&[0, 1], &[0, 2], &[0, 3], &[0, 4]], "clear 0");
    }

    #[test]
    fn two_that_disagree_cannot_tell() {
        check(&[&[0, 1]], "ambiguous 0 1");
    }

    #[test]
    fn two_liars_that_agree_with_each_other_among_five() {
        check(&[&[0, 2], &[0, 3], &[0, 4], &[1, 2], &[1, 3], &[1, 4]], "clear 0+1");
    }

    #[test]
    fn two_liars_among_four_cannot_be_told_from_the_other_two() {
        check(&[&[0, 2], &[0, 3], &[1, 2], &[1, 3]], "ambiguous 0+1 2+3");
    }

    #[test]
    fn nothing_disagrees() {
        check(&[], "consistent");
    }

    #[test]
    fn too_many_faults_are_told_as_ambiguous() {
        let pairs: Vec<[usize; 2]> = (0..8).map(|n| [2 * n, 2 * n + 1]).collect();
        let conflicts: Vec<SignalSet> = pairs.iter().map(|pair| set(pair)).collect();
        let Finding::Ambiguous(all) = explain(&conflicts, |_| 0.01, |_| 0) else { panic!("not ambiguous") };
        assert_eq!(all.len(), 16);
    }

    #[test]
    fn a_prior_or_the_support_ranks() {
        let conflicts = [set(&[0, 1])];
        let Finding::Clear(candidate) =
            explain(&conflicts, |signal| if signal.index() == 1 { 0.5 } else { 0.001 }, |_| 0)
        else {
            panic!("not clear")
        };
        assert_eq!(candidate.signals, set(&[1]));
        let Finding::Ambiguous(all) = explain(&conflicts, |_| 0.01, |signal| 1 - signal.index()) else {
            panic!("not ambiguous")
        };
        assert_eq!(all.iter().map(text).collect::<Vec<_>>(), vec!["1", "0"]);
    }

    proptest! {
        #[test]
        fn every_candidate_meets_every_conflict_and_the_true_faults_are_never_larger(
            faulty in proptest::collection::btree_set(0usize..8, 1..4),
            others in proptest::collection::vec((0usize..8, 0usize..8, 0usize..8), 1..12),
        ) {
            let conflicts: Vec<SignalSet> = others
                .iter()
                .map(|&(a, b, pick)| {
                    let liar = *faulty.iter().nth(pick % faulty.len()).unwrap();
                    set(&[a, b, liar])
                })
                .collect();
            let candidates = match explain(&conflicts, |_| 0.01, |_| 0) {
                Finding::Consistent => vec![],
                Finding::Clear(one) => vec![one],
                Finding::Ambiguous(all) => all,
            };
            prop_assert!(!candidates.is_empty());
            for candidate in candidates {
                prop_assert!(conflicts.iter().all(|conflict| conflict.meets(&candidate.signals)));
                prop_assert!(candidate.signals.len() <= faulty.len());
            }
        }
    }
}
