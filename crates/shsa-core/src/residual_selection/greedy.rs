//! Chooses the watched ways of a variable among many: those that isolate most faults.
//!
//! A comparison of two ways shows a fault of `s` and isolates it from one of `t` when the ways depend on `s` differently and
//! neither rests on `t`. So a choice of ways isolates, for each ordered pair `(s, t)`, if among its ways without `t` there are
//! two kinds with regard to `s`. Counting 1 for the first kind and 1 for the second gives the rank of a matroid for each pair. So
//! their sum, the [gain](Choice) to maximise here, is monotone and submodular. The greedy choice of `k` ways reaches at
//! least `1 - (1 - 1/k)^k`, over 63 %, of the highest sum of any `k` ways (Nemhauser, Wolsey and Fisher 1978, doi:10.1007/BF01588971). It
//! isolates all that can be isolated with at most `1 + ln(largest gain)` times the smallest number of ways (Wolsey 1982,
//! doi:10.1007/BF02579435). One exception: where signals also reach ways through different relations, kinds may not be
//! transitive, and the bounds are not proven. "No fault" counts as one more `t`, so that detectability counts, too.

use super::fault_signature::{BySignal, FaultSignature, compacted};
use crate::knowledge::{IdVec, SignalId, SignalSet};
use alloc::vec::Vec;
use core::cmp::Reverse;

/// A chosen way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Choice {
    /// The way's place among the candidates.
    pub(super) at: usize,
    /// The additional gain: pairs of isolated signals, and signals that some way does without.
    pub(super) gain: usize,
    /// The number of complete rounds before: the ways of each round alone isolate all that can be isolated.
    pub(super) round: usize,
}

/// The signals that a fault of each signal is not isolable from; `None` where it is not detectable.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Suspects(BySignal<Option<SignalSet>>);

impl Suspects {
    fn none(signals: usize) -> Suspects {
        Suspects(IdVec::filled(signals, |_| None))
    }

    /// The suspects by all comparisons of some ways, in their own numbering of the signals. Complexity: O(w^2 s) for w ways and s
    /// signals.
    fn of<'e>(ways: impl Iterator<Item = &'e FaultSignature> + Clone, signals: usize) -> Suspects {
        let mut suspects = Suspects::none(signals);
        for (number, one) in ways.clone().enumerate() {
            ways.clone().skip(number + 1).for_each(|other| suspects.compare(one, other));
        }
        suspects
    }

    /// Takes in a comparison; ways that rest on the same signals are not compared.
    fn compare(&mut self, one: &FaultSignature, other: &FaultSignature) {
        if one.rests_on() == other.rests_on() {
            return;
        }
        let signals = one.signals(other);
        for shown in one.shows(other).iter() {
            match &mut self.0[shown] {
                Some(suspects) => suspects.intersect(&signals),
                hidden => *hidden = Some(signals.clone()),
            }
        }
    }

    fn extend(&mut self, others: &Suspects) {
        for (own, others) in self.0.iter_mut().zip(others.0.iter()) {
            match (own, others) {
                (Some(own), Some(others)) => own.intersect(others),
                (own, Some(others)) => *own = Some(others.clone()),
                (_, None) => {}
            }
        }
    }

    /// The number of additional pairs that others isolate together with these.
    fn gained_by(&self, others: &Suspects) -> usize {
        let all = self.0.len() + 1;
        let gained = |(own, others): (&Option<SignalSet>, &Option<SignalSet>)| match (own, others) {
            (_, None) => 0,
            (None, Some(others)) => all - others.len(),
            (Some(own), Some(others)) => own.count_outside(others),
        };
        self.0.iter().zip(others.0.iter()).map(gained).sum()
    }

    /// The number of ordered pairs of a detectable signal and one that its fault is isolable from, including "no fault".
    fn isolated_pairs(&self) -> usize {
        Suspects::none(self.0.len()).gained_by(self)
    }
}

/// For each detectable signal, the signals that its fault is not isolable from by all comparisons of some ways.
///
/// Complexity: O(w^2 s) for w ways and s signals.
pub(super) fn suspects(ways: &[FaultSignature]) -> Vec<(SignalId, SignalSet)> {
    let (compact, signals) = compacted(ways);
    let found = Suspects::of(compact.iter(), signals.len());
    let named = |set: &SignalSet| {
        set.iter().filter_map(|at| signals.get(crate::knowledge::Id::index(at)).copied()).collect()
    };
    let distinguished = signals.iter().zip(found.0.iter());
    distinguished.filter_map(|(signal, found)| Some((*signal, named(found.as_ref()?)))).collect()
}

/// Up to `most` of these ways, which are ordered by utility, in the order of the choice. Each is the way with the largest
/// additional gain, then the one that shares the fewest signals with earlier ones, then the first. When no gain is left, the
/// choice starts again with the remaining ways, so that faults are isolated twice. It never isolates less than the first `most`
/// ways.
///
/// Complexity: O(w k s^2 / 64) for w ways, k of which are chosen, over s signals.
pub(super) fn chosen(ways: &[FaultSignature], most: usize) -> Vec<Choice> {
    let (compact, signals) = compacted(ways);
    let mut greedy = Greedy::new(&compact, signals.len());
    while greedy.choices.len() < most && greedy.step() {}
    let choices = greedy.choices;
    let distinguished = |ways: &mut dyn Iterator<Item = &FaultSignature>| {
        let ways: Vec<&FaultSignature> = ways.collect();
        Suspects::of(ways.into_iter(), signals.len()).isolated_pairs()
    };
    let own = distinguished(&mut choices.iter().filter_map(|choice| compact.get(choice.at)));
    match own < distinguished(&mut compact.iter().take(most)) {
        true => (0..most.min(ways.len())).map(|at| Choice { at, gain: 0, round: 0 }).collect(),
        false => choices,
    }
}

/// The state of the choice.
struct Greedy<'e> {
    signals: usize,
    open: Vec<Candidate<'e>>,
    choices: Vec<Choice>,
    /// The signals of all chosen ways.
    used: SignalSet,
    round: Round,
}

/// The state of a round.
struct Round {
    number: usize,
    suspects: Suspects,
    /// The signals that all ways of the round rest on; `None` without a way.
    common: Option<SignalSet>,
}

struct Candidate<'e> {
    at: usize,
    fault_signature: &'e FaultSignature,
    /// The suspects by its comparisons with the ways of this round.
    distinguished: Suspects,
}

impl<'e> Greedy<'e> {
    fn new(ways: &'e [FaultSignature], signals: usize) -> Greedy<'e> {
        let candidate =
            |(at, fault_signature)| Candidate { at, fault_signature, distinguished: Suspects::none(signals) };
        Greedy {
            signals,
            open: ways.iter().enumerate().map(candidate).collect(),
            choices: Vec::new(),
            used: SignalSet::new(),
            round: Round { number: 0, suspects: Suspects::none(signals), common: None },
        }
    }

    /// Chooses one more way; returns whether one was left.
    fn step(&mut self) -> bool {
        let Some((mut place, mut gain)) = self.best() else { return false };
        if gain == 0 && self.round.common.is_some() {
            self.begin_anew();
            (place, gain) = self.best().unwrap_or((place, gain));
        }
        let taken = self.open.remove(place);
        self.round.suspects.extend(&taken.distinguished);
        match &mut self.round.common {
            Some(common) => common.intersect(taken.fault_signature.rests_on()),
            none => *none = Some(taken.fault_signature.rests_on().clone()),
        }
        self.used.extend(taken.fault_signature.rests_on());
        self.open
            .iter_mut()
            .for_each(|other| other.distinguished.compare(taken.fault_signature, other.fault_signature));
        self.choices.push(Choice { at: taken.at, gain, round: self.round.number });
        true
    }

    fn begin_anew(&mut self) {
        let nothing = Suspects::none(self.signals);
        self.open.iter_mut().for_each(|candidate| candidate.distinguished = nothing.clone());
        self.round = Round { number: self.round.number + 1, suspects: nothing, common: None };
    }

    /// The place of the best remaining way, and its gain.
    fn best(&self) -> Option<(usize, usize)> {
        let rated = self.open.iter().enumerate().map(|(place, candidate)| {
            let shared = candidate.fault_signature.rests_on().len()
                - candidate.fault_signature.rests_on().count_outside(&self.used);
            (self.gain(candidate), Reverse(shared), Reverse(place))
        });
        rated.max().map(|(gain, _, Reverse(place))| (place, gain))
    }

    fn gain(&self, candidate: &Candidate<'_>) -> usize {
        let rests_on = candidate.fault_signature.rests_on();
        let done_without = match &self.round.common {
            Some(common) => common.count_outside(rests_on),
            None => 1 + self.signals - rests_on.len(),
        };
        // Isolating a faulty signal from another signal needs the ways without the other one.
        self.signals * done_without + self.round.suspects.gained_by(&candidate.distinguished)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::knowledge::Id;
    use proptest::prelude::*;

    /// Ways by the bits of the signals that they rest on.
    fn ways(bits: &[u8]) -> Vec<FaultSignature> {
        let signals = |bits: u8| (0..8).filter(move |at| bits >> at & 1 == 1).map(SignalId::from_index);
        bits.iter().map(|&bits| FaultSignature::resting_on(signals(bits))).collect()
    }

    /// For each pair of a faulty signal and another, the number of kinds of ways without the latter, by the definition; "no
    /// fault" is signal 8, which no way rests on.
    fn ranks(bits: &[u8], signals: u8) -> impl Iterator<Item = usize> {
        let ids = move || (0..8_u32).filter(move |at| u32::from(signals) >> at & 1 == 1);
        let has = |way: u8, signal: u32| signal < 8 && way >> signal & 1 == 1;
        let rank = move |(fault, other): (u32, u32)| {
            let without = || bits.iter().copied().filter(|&way| !has(way, other));
            usize::from(without().any(|way| has(way, fault)))
                + usize::from(without().any(|way| !has(way, fault)))
        };
        ids().flat_map(move |fault| ids().chain([8]).map(move |other| (fault, other))).map(rank)
    }

    fn sum(bits: &[u8], signals: u8) -> usize {
        ranks(bits, signals).sum()
    }

    fn distinguished(bits: &[u8], signals: u8) -> usize {
        ranks(bits, signals).filter(|&rank| rank == 2).count()
    }

    fn some_of(bits: &[u8], set: u32) -> Vec<u8> {
        bits.iter().enumerate().filter(|(at, _)| set >> at & 1 == 1).map(|(_, &way)| way).collect()
    }

    fn picked(bits: &[u8], most: usize) -> Vec<u8> {
        chosen(&ways(bits), most).iter().map(|choice| bits[choice.at]).collect()
    }

    fn union(bits: &[u8]) -> u8 {
        bits.iter().fold(0, |all, way| all | way)
    }

    fn families() -> impl Strategy<Value = Vec<u8>> {
        prop_oneof![
            prop::collection::vec(1_u8..64, 2..11),
            // Few signals for each way, as in most models.
            prop::collection::vec((0..8_u8, 0..8_u8).prop_map(|(one, other)| 1 << one | 1 << other), 2..11),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        /// Compares the choice with all choices of as many ways.
        #[test]
        fn the_choice_is_as_good_as_proven(bits in families()) {
            let signals = union(&bits);
            let largest = bits.iter().map(|&way| sum(&[way], signals)).max().unwrap_or(1) as f64;
            let all = distinguished(&bits, signals);
            let mut fewest = None;
            for most in 2..=bits.len() {
                let sets = (0..1_u32 << bits.len()).filter(|set| set.count_ones() as usize == most);
                let choices: Vec<Vec<u8>> = sets.map(|set| some_of(&bits, set)).collect();
                let own = picked(&bits, most);
                prop_assert_eq!(own.len(), most);
                prop_assert!(distinguished(&own, signals) >= distinguished(&bits[..most], signals));
                let best = choices.iter().map(|choice| sum(choice, signals)).max().unwrap_or(0) as f64;
                let share = 1.0 - (1.0 - 1.0 / most as f64).powi(most as i32);
                // Either the greedy choice, or the first ways where these isolate more.
                prop_assert!(sum(&own, signals) as f64 >= share * best || distinguished(&own, signals) == distinguished(&bits[..most], signals));
                if fewest.is_none() && choices.iter().any(|choice| distinguished(choice, signals) == all) {
                    fewest = Some(most);
                }
                let enough = fewest.is_some_and(|fewest| most as f64 >= fewest as f64 * (1.0 + largest.ln()));
                prop_assert!(!enough || distinguished(&own, signals) == all);
            }
        }

        /// The gain of each step is the growth of the sum of ranks in its round.
        #[test]
        fn a_gain_is_what_the_sum_grows_by(bits in families()) {
            let signals = union(&bits);
            let choices = chosen(&ways(&bits), bits.len());
            let mut of_round: Vec<u8> = Vec::new();
            let mut round = 0;
            for choice in choices.iter().filter(|choice| choice.gain > 0) {
                if choice.round != round {
                    of_round.clear();
                    round = choice.round;
                }
                let before = sum(&of_round, signals);
                of_round.push(bits[choice.at]);
                let grown = sum(&of_round, signals) - before;
                prop_assert_eq!(choice.gain, grown);
                // No other remaining way would have a larger gain.
                let taken: Vec<usize> = choices.iter().take_while(|other| other.at != choice.at).map(|c| c.at).collect();
                let left = (0..bits.len()).filter(|at| !taken.contains(at));
                let without = &of_round[..of_round.len() - 1];
                let grows = |at: usize| sum(&[without, &[bits[at]]].concat(), signals) - before;
                prop_assert!(left.map(grows).all(|other| other <= grown));
            }
        }
    }

    /// The distance from the best choice of as many ways, over all small budgets of many families.
    #[test]
    fn the_choice_is_close_to_the_best() {
        let mut state = 1_u64;
        let mut below = move |end: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % end
        };
        let (mut own, mut best, mut first) = (0, 0, 0);
        for _ in 0..300 {
            let bits: Vec<u8> = (0..10).map(|_| 1_u8 << below(8) | 1 << below(8)).collect();
            let signals = union(&bits);
            for most in 2..8 {
                let sets = (0..1_u32 << 10).filter(|set| set.count_ones() == most);
                let highest = sets.map(|set| distinguished(&some_of(&bits, set), signals)).max().unwrap();
                let reached = distinguished(&picked(&bits, most as usize), signals);
                own += reached;
                best += highest;
                first += distinguished(&bits[..most as usize], signals);
            }
        }
        let (share, of_first) = (own as f64 / best as f64, first as f64 / best as f64);
        assert!(share > 0.95 && of_first < 0.80, "{share} of the best, the first ways {of_first}");
    }

    #[test]
    fn each_witness_is_taken_before_a_second_way_from_the_same() {
        // Four ways from signal 0, one each from 1 and 2.
        let places: Vec<usize> =
            chosen(&ways(&[1, 1, 1, 1, 2, 4]), 3).iter().map(|choice| choice.at).collect();
        assert_eq!(places, [0, 4, 5]);
    }
}
