//! Checks whether the standards allow a level that a contract claims for two redundant sources.
//!
//! This only checks a claim. No level follows from redundancy by itself: each of the two must suffice on its own, they must be
//! compared, and they must be shown independent. The mean of two sources is no decomposition.

use super::contract::{ContractId, Contracts, Subject};
use super::{Cause, CauseId, KnowledgeBase, SignalId, SignalSet};
use crate::statement::{Level, Scales};
use alloc::vec::Vec;

/// A level that is claimed for two parts together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Claim {
    /// The level claimed for both together.
    pub original: Level,
    /// The level of each on its own.
    pub parts: [Level; 2],
}

/// The facts about the two parts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Redundancy {
    /// Whether each part meets the requirement on its own.
    pub each_suffices: bool,
    /// Whether the parts are compared, and a difference has a consequence.
    pub are_compared: bool,
    /// The common causes of both parts.
    pub in_common: Vec<Common>,
}

/// A dependence of two sources, because of which they can fail together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Common {
    /// A signal.
    Signal(SignalId),
    /// A common cause: a device, a supply, a clock.
    Cause(CauseId),
    /// The platform that both run on.
    Platform(ContractId),
}

/// An objection to a claim.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Objection {
    /// The levels are of different scales.
    OtherScale,
    /// The scale has no rule of decomposition.
    NoRule,
    /// The parts reach only this level, or none of the scale.
    TooLow(Level),
    /// A part does not suffice on its own.
    Insufficient,
    /// The parts are not compared.
    NotCompared,
    /// The parts are not independent.
    Dependent(Vec<Common>),
}

impl Claim {
    /// All objections to the claim; empty for a valid claim.
    #[must_use]
    pub fn objections(&self, scales: &Scales, redundancy: &Redundancy) -> Vec<Objection> {
        let [one, other] = self.parts;
        let level = if one.scale != other.scale || one.scale != self.original.scale {
            Some(Objection::OtherScale)
        } else {
            match level_of_pair(scales, one, other) {
                None => Some(Objection::NoRule),
                Some(reached) if !reached.reaches(self.original) => Some(Objection::TooLow(reached)),
                Some(_) => None,
            }
        };
        let insufficient = (!redundancy.each_suffices).then_some(Objection::Insufficient);
        let apart = (!redundancy.are_compared).then_some(Objection::NotCompared);
        let shared = &redundancy.in_common;
        let dependent = (!shared.is_empty()).then(|| Objection::Dependent(shared.clone()));
        [level, insufficient, apart, dependent].into_iter().flatten().collect()
    }
}

/// The highest level that two independent parts may claim together; `None` where no standard has a rule.
///
/// ASIL (ISO 26262-9:2018, 5): QM 0, A 1, B 2, C 3, D 4 add up. SIL (IEC 61508-2:2010, 7.4.3): two of capability N count as
/// N + 1, once. PL (ISO 13849-1) and DAL have rules about architectures, not about pairs.
#[must_use]
pub fn level_of_pair(scales: &Scales, one: Level, other: Level) -> Option<Level> {
    if one.scale != other.scale {
        return None;
    }
    let scale = scales.get(one.scale)?;
    let top = u32::try_from(scale.levels.len()).ok()?.checked_sub(1)?;
    let (low, high) = (one.rank.min(other.rank), one.rank.max(other.rank));
    let rank = match scale.name.as_str() {
        "asil" => low.saturating_add(high),
        "sil" => high.max(low.saturating_add(1)),
        _ => return None,
    };
    Some(Level { scale: one.scale, rank: rank.min(top) })
}

/// The common elements of two sets of signals in the knowledge base: signals, including origins, and common causes.
///
/// Time: linear in the signals of all causes.
#[must_use]
pub fn in_common(knowledge: &KnowledgeBase, one: &SignalSet, other: &SignalSet) -> Vec<Common> {
    let (one, other) = (signals_and_origins(knowledge, one), signals_and_origins(knowledge, other));
    let shares = |cause: &Cause, set: &SignalSet| cause.signals.iter().any(|&signal| set.contains(signal));
    let signals = one.iter().filter(|&signal| other.contains(signal)).map(Common::Signal);
    let causes = knowledge.causes().enumerate();
    let causes = causes.filter(|(_, cause)| shares(cause, &one) && shares(cause, &other));
    signals.chain(causes.map(|(id, _)| Common::Cause(id))).collect()
}

/// The common elements of two sets of signals, including the platforms of their producers.
#[must_use]
pub fn dependence(
    knowledge: &KnowledgeBase,
    contracts: &Contracts,
    [one, other]: &[SignalSet; 2],
) -> Vec<Common> {
    let platforms = |set: &SignalSet| -> Vec<ContractId> {
        let below = |signal| {
            let first = contracts.of(Subject::Signal(signal)).and_then(|id| contracts.rows()[id].runs_on);
            core::iter::successors(first, |&id| contracts.rows()[id].runs_on)
        };
        set.iter().flat_map(below).collect()
    };
    let others = platforms(other);
    let mut same: Vec<ContractId> = platforms(one).into_iter().filter(|id| others.contains(id)).collect();
    same.sort_unstable();
    same.dedup();
    let mut common = in_common(knowledge, one, other);
    common.extend(same.into_iter().map(Common::Platform));
    common
}

/// The signals and all their origins, one signal for each measurement.
fn signals_and_origins(knowledge: &KnowledgeBase, signals: &SignalSet) -> SignalSet {
    let mut all = signals.clone();
    signals.iter().for_each(|signal| all.extend(&knowledge.origins(signal)));
    knowledge.as_witnesses(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec;

    #[track_caller]
    fn check(scale: &str, [original, one, other]: [&str; 3], expected: bool) {
        let scales = Scales::standard();
        let level = |name| scales.level(scale, name).unwrap();
        let claim = Claim { original: level(original), parts: [level(one), level(other)] };
        let redundancy = Redundancy { each_suffices: true, are_compared: true, in_common: vec![] };
        assert_eq!(claim.objections(&scales, &redundancy).is_empty(), expected);
    }

    #[test]
    fn pairs_of_the_standards_stand() {
        for pair in [["D", "C", "A"], ["D", "B", "B"], ["D", "D", "QM"], ["C", "B", "A"], ["B", "A", "A"]] {
            check("asil", pair, true);
        }
        check("asil", ["D", "B", "A"], false);
        check("asil", ["C", "A", "A"], false);
        check("sil", ["2", "1", "1"], true);
        check("sil", ["3", "1", "2"], false);
        check("sil", ["4", "3", "3"], true);
        check("pl", ["d", "c", "c"], false);
    }

    #[test]
    fn what_is_not_redundant_is_no_decomposition() {
        let scales = Scales::standard();
        let level = |name| scales.level("asil", name).unwrap();
        let claim = Claim { original: level("D"), parts: [level("B"), level("B")] };
        let common = vec![Common::Signal(crate::knowledge::Id::from_index(0))];
        let mean = Redundancy { each_suffices: false, are_compared: false, in_common: common.clone() };
        let expected = vec![Objection::Insufficient, Objection::NotCompared, Objection::Dependent(common)];
        assert_eq!(claim.objections(&scales, &mean), expected);
        let mixed = Claim { original: scales.level("sil", "2").unwrap(), ..claim };
        assert_eq!(mixed.objections(&scales, &Redundancy::default()).first(), Some(&Objection::OtherScale));
    }
}
