//! The consensus of the ways that have a value at one moment, and how far each way agrees with it.
//!
//! The consensus of a moment is the interval from the upper median of the lower bounds to the lower median of the upper bounds:
//! for two ways their intersection; for more, an interval that a faulty minority cannot move out of the others' reach (after K.
//! Marzullo, "Tolerating failures of continuous-valued sensors", 1990, DOI 10.1145/128733.128735). It holds when more than half
//! of the ways overlap it. Ways that rest on the same signals have one vote. Two votes do not tell which way is off, so a way
//! that is often compared with two others is rated only there.

use super::reliability::{Figures, Memory, Reliability};
use super::trend::Measured;
use super::{Residual, WatchedWay, WayIndex};
use crate::interval::Interval;
use crate::knowledge::{SignalSet, VariableId};
use crate::numbers::OFTEN;
use crate::time::Time;
use alloc::vec::Vec;

/// Most votes about a moment.
const MOST_VOTES: usize = 64;

/// The role of a way in the comparisons of a moment.
#[derive(Clone, Copy, Debug)]
struct Seat {
    way: WayIndex,
    /// The way's vote, as a bit; 0 without a vote.
    vote: u64,
    /// The votes of ways that share no signal with this way, as bits: without one of them this way is not rated.
    independent: u64,
    /// Whether three or more votes are often compared with this way.
    has_majorities: bool,
}

/// The value of a way at the present moment.
#[derive(Clone, Copy, Debug)]
struct PresentValue {
    seat: Seat,
    measured: Measured,
    /// Whether the value agrees with the consensus, once there is one.
    agrees: bool,
}

/// The records of all ways, and the values of the present moment.
#[derive(Debug)]
pub(super) struct Consensus {
    records: Vec<Reliability>,
    /// All ways by their variables.
    of_variable: Vec<(VariableId, WayIndex)>,
    /// The seat of each way in the comparisons of its own outputs.
    own: Vec<Seat>,
    /// For each pair, the seat of the other way in the comparisons of the pair's way; `None` where no rating follows.
    others: Vec<Option<Seat>>,
    present_values: Vec<PresentValue>,
    /// The present votes, as bits, and their bounds.
    present: u64,
    lows: Vec<f64>,
    highs: Vec<f64>,
    is_started: bool,
}

impl Consensus {
    /// The consensus before the first value. Complexity: O(pairs times the ways that each way is compared with).
    pub(super) fn new(ways: &[WatchedWay], pairs: &[Residual], memory: Memory) -> Consensus {
        let record = |way: &WatchedWay| Reliability::new(way.computation.timing().period, memory);
        let nobody = Seat { way: WayIndex(u32::MAX), vote: 0, independent: 0, has_majorities: false };
        let mut others = alloc::vec![None; pairs.len()];
        let mut own = Vec::with_capacity(ways.len());
        let mut has_majorities = alloc::vec![false; ways.len()];
        let mut most = 0;
        for (index, way) in (0..).map(WayIndex).zip(ways) {
            let compared = way.triggers.iter().filter_map(|&pair| pairs.get(pair as usize));
            let is_way =
                |pair: &&Residual| !ways.get(pair.other.0 as usize).is_some_and(WatchedWay::is_range);
            let members: Vec<WayIndex> =
                core::iter::once(index).chain(compared.filter(is_way).map(|pair| pair.other)).collect();
            let seats = seats(ways, &members);
            let is_often =
                way.computation.timing().period.is_none_or(|period| period.times(OFTEN) <= memory.0);
            if is_often && seats.iter().filter(|seat| seat.vote != 0).count() > 2 {
                for way in &members {
                    has_majorities.get_mut(way.0 as usize).into_iter().for_each(|has| *has = true);
                }
            }
            let mut seats = seats.into_iter();
            own.push(seats.next().unwrap_or(nobody));
            for (&pair, seat) in way.triggers.iter().zip(seats) {
                others.get_mut(pair as usize).into_iter().for_each(|place| *place = Some(seat));
            }
            most = most.max(members.len());
        }
        let computed = (0..).map(WayIndex).zip(ways).filter(|(_, way)| !way.is_range());
        let mut of_variable: Vec<_> = computed.map(|(index, way)| (way.variable(), index)).collect();
        of_variable.sort_unstable();
        for seat in own.iter_mut().chain(others.iter_mut().flatten()) {
            seat.has_majorities = has_majorities.get(seat.way.0 as usize).copied().unwrap_or_default();
        }
        leave_out_idle(ways, &own, &mut others);
        Consensus {
            of_variable,
            records: ways.iter().map(record).collect(),
            own,
            others,
            present_values: Vec::with_capacity(most),
            present: 0,
            lows: Vec::with_capacity(most.min(MOST_VOTES)),
            highs: Vec::with_capacity(most.min(MOST_VOTES)),
            is_started: false,
        }
    }

    /// Begins the records at the first moment, from which on every way could give values.
    pub(super) fn begin(&mut self, now: Time) {
        if !core::mem::replace(&mut self.is_started, true) {
            self.records.iter_mut().for_each(|record| record.begin(now));
        }
    }

    /// Takes the value of the other way of a pair.
    #[inline]
    pub(super) fn add_value(&mut self, pair: usize, known: &Measured) {
        if let Some(&Some(seat)) = self.others.get(pair)
            && known.value.is_bounded()
        {
            self.take(seat, known);
        }
    }

    #[inline]
    fn take(&mut self, seat: Seat, measured: &Measured) {
        self.present_values.push(PresentValue { seat, measured: *measured, agrees: false });
        if seat.vote != 0 {
            self.present |= seat.vote;
            self.lows.push(measured.value.lo());
            self.highs.push(measured.value.hi());
        }
    }

    /// Clears the values of the moment.
    #[inline]
    fn clear(&mut self) {
        self.present_values.clear();
        self.lows.clear();
        self.highs.clear();
        self.present = 0;
    }

    /// Rates an output for which all other values are known. O(k log k) for k values.
    #[inline]
    pub(super) fn settle(&mut self, way: WayIndex, value: &Measured, now: Time) {
        if let Some(record) = self.records.get_mut(way.0 as usize) {
            record.deliver(now);
        }
        if !self.present_values.is_empty() {
            self.settle_values(way, value, now);
        }
    }

    /// Notes an output for which some other values are not known yet.
    #[inline]
    pub(super) fn postpone(&mut self, way: WayIndex, now: Time) {
        if let Some(record) = self.records.get_mut(way.0 as usize) {
            record.deliver(now);
        }
        self.clear();
    }

    /// Rates an earlier output for which all other values are known now.
    pub(super) fn rate_values(&mut self, way: WayIndex, value: &Measured, now: Time) {
        if !self.present_values.is_empty() {
            self.settle_values(way, value, now);
        }
    }

    fn settle_values(&mut self, way: WayIndex, value: &Measured, now: Time) {
        if let Some(&seat) = self.own.get(way.0 as usize).filter(|_| value.value.is_bounded()) {
            self.take(seat, value);
            self.rate(now);
        }
        self.clear();
    }

    /// Rates the values of the moment by their consensus.
    fn rate(&mut self, now: Time) {
        let Consensus { present_values, present, lows, highs, records, .. } = self;
        let has_majority = present.count_ones() > 2;
        let counts = |seat: &Seat| seat.independent & *present != 0 && (has_majority || !seat.has_majorities);
        if !present_values.iter().any(|present_values| counts(&present_values.seat)) {
            return;
        }
        let votes = lows.len();
        let consensus =
            consensus(lows, highs).filter(|(agreed, _)| 2 * supporters(present_values, *agreed) > votes);
        for PresentValue { seat, measured, agrees } in
            present_values.iter().filter(|present_values| counts(&present_values.seat))
        {
            let Some(record) = records.get_mut(seat.way.0 as usize) else { continue };
            let distance = consensus.map(|(_, middle)| (measured.middle() - middle).abs());
            record.compare(*agrees && distance.is_some(), distance, measured.width(), now);
        }
    }

    /// The ways of knowing a variable. O(log n) for all ways.
    pub(super) fn knowing(&self, variable: VariableId) -> impl Iterator<Item = WayIndex> + '_ {
        let first = self.of_variable.partition_point(|(known, _)| *known < variable);
        let from_first = self.of_variable.get(first..).unwrap_or_default().iter();
        from_first.take_while(move |(known, _)| *known == variable).map(|(_, way)| *way)
    }

    /// The record of a way; empty for a way of another monitor.
    pub(super) fn figures(&self, way: WayIndex, now: Time) -> Figures {
        self.records.get(way.0 as usize).map_or(Figures::default(), |record| record.figures(now))
    }

    /// Takes over the records before a change of the model; `same` maps the old ways to the new ones.
    pub(super) fn inherit(&mut self, old: &Consensus, same: &[Option<WayIndex>], now: Time) {
        for (before, way) in old.records.iter().zip(same) {
            let record = way.and_then(|way| self.records.get_mut(way.0 as usize));
            record.into_iter().for_each(|record| record.inherit(*before));
        }
        self.is_started = false;
        if old.is_started {
            self.begin(now);
        }
    }
}

/// The seats of ways that are compared at one moment: ways with the fewest signals vote first, so that there are many votes;
/// equals go by order.
fn seats(ways: &[WatchedWay], members: &[WayIndex]) -> Vec<Seat> {
    let nothing = SignalSet::new();
    let rests_on = |way: WayIndex| ways.get(way.0 as usize).map_or(&nothing, |way| &way.rests_on);
    let mut order: Vec<WayIndex> = members.to_vec();
    order.sort_by_key(|&way| (rests_on(way).len(), way));
    let mut voters: Vec<WayIndex> = Vec::new();
    let mut taken = SignalSet::new();
    for way in order {
        if voters.len() < MOST_VOTES && !taken.meets(rests_on(way)) {
            voters.push(way);
            taken.extend(rests_on(way));
        }
    }
    let seat = |&way: &WayIndex| {
        let votes = (0_u32..).zip(&voters);
        let independent = votes.clone().filter(|(_, voter)| !rests_on(**voter).meets(rests_on(way)));
        Seat {
            way,
            vote: votes.clone().find(|(_, voter)| **voter == way).map_or(0, |(vote, _)| 1 << vote),
            independent: independent.fold(0, |all, (vote, _)| all | 1 << vote),
            has_majorities: false,
        }
    };
    members.iter().map(seat).collect()
}

/// Removes the seats of moments with at most two votes where every way is rated at other moments.
fn leave_out_idle(ways: &[WatchedWay], own: &[Seat], others: &mut [Option<Seat>]) {
    for (way, own) in ways.iter().zip(own) {
        let places = || way.triggers.iter().map(|&pair| pair as usize);
        let present_values =
            || core::iter::once(*own).chain(places().filter_map(|at| others.get(at).copied().flatten()));
        let votes = present_values().filter(|seat| seat.vote != 0).count();
        if votes <= 2 && present_values().all(|seat| seat.has_majorities) {
            for at in places() {
                others.get_mut(at).into_iter().for_each(|seat| *seat = None);
            }
        }
    }
}

/// Notes which values overlap a possible consensus; returns how many votes they are.
fn supporters(present_values: &mut [PresentValue], agreed: Interval) -> usize {
    let mut count = 0;
    for PresentValue { seat, measured, agrees } in present_values {
        *agrees = measured.value.overlaps(agreed);
        count += usize::from(*agrees && seat.vote != 0);
    }
    count
}

/// The consensus of values with these bounds, and its middle; `None` where the medians leave no interval.
fn consensus(lows: &mut [f64], highs: &mut [f64]) -> Option<(Interval, f64)> {
    let lo = ranked(lows, lows.len() / 2)?;
    let hi = ranked(highs, highs.len().checked_sub(1)? / 2)?;
    let agreed = Interval::new(lo, hi);
    (!agreed.is_empty()).then(|| (agreed, agreed.midpoint()))
}

/// The number of a rank among finite numbers, 0 for the smallest. A few numbers, the usual case, are ranked without a sort.
fn ranked(numbers: &mut [f64], rank: usize) -> Option<f64> {
    match (&*numbers, rank) {
        (&[one, other], 0) => Some(ordered(one, other).0),
        (&[one, other], 1) => Some(ordered(one, other).1),
        (&[one, other, third], 1) => Some(median(one, other, third)),
        (&[a, b, c, d], 1) => Some(ordered_inner(a, b, c, d).0),
        (&[a, b, c, d], 2) => Some(ordered_inner(a, b, c, d).1),
        (&[a, b, c, d, fifth], 2) => {
            let (one, other) = ordered_inner(a, b, c, d);
            Some(median(one, other, fifth))
        }
        _ if rank < numbers.len() => Some(*numbers.select_nth_unstable_by(rank, f64::total_cmp).1),
        _ => None,
    }
}

/// The median of three numbers.
#[inline]
fn median(one: f64, other: f64, third: f64) -> f64 {
    let (small, large) = ordered(one, other);
    ordered(small, ordered(large, third).0).1
}

/// The two middle ones of four numbers, the smaller first.
#[inline]
fn ordered_inner(a: f64, b: f64, c: f64, d: f64) -> (f64, f64) {
    let ((a, b), (c, d)) = (ordered(a, b), ordered(c, d));
    ordered(ordered(a, c).1, ordered(b, d).0)
}

/// Sorts two numbers.
#[inline]
fn ordered(one: f64, other: f64) -> (f64, f64) {
    if one < other { (one, other) } else { (other, one) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check(values: &[(f64, f64)], expected: Option<(f64, f64)>) {
        let mut lows: Vec<f64> = values.iter().map(|value| value.0).collect();
        let mut highs: Vec<f64> = values.iter().map(|value| value.1).collect();
        let found = consensus(&mut lows, &mut highs).map(|(agreed, _)| (agreed.lo(), agreed.hi()));
        assert_eq!(found, expected);
    }

    #[test]
    fn the_consensus_is_what_most_have_in_common() {
        check(&[], None);
        check(&[(1.0, 2.0)], Some((1.0, 2.0)));
        check(&[(0.0, 2.0), (1.0, 3.0)], Some((1.0, 2.0)));
        check(&[(0.0, 1.0), (2.0, 3.0)], None);
        check(&[(0.0, 1.0), (0.2, 1.2), (50.0, 51.0)], Some((0.2, 1.2)));
        check(&[(0.0, 1.0), (0.0, 1.0), (2.0, 3.0), (2.0, 3.0)], None);
    }

    proptest! {
        /// Whatever a minority gives, the consensus lies among the values of the others.
        #[test]
        fn a_minority_cannot_move_the_consensus_away(
            right in prop::collection::vec((-1.0..0.0_f64, 0.0..1.0_f64), 2..9),
            wrong in prop::collection::vec((-1e3..1e3_f64, 0.0..9.0_f64), 0..8),
        ) {
            let wrong: Vec<(f64, f64)> =
                wrong.into_iter().take(right.len() - 1).map(|(lo, width)| (lo, lo + width)).collect();
            let mut lows: Vec<f64> = right.iter().chain(&wrong).map(|value| value.0).collect();
            let mut highs: Vec<f64> = right.iter().chain(&wrong).map(|value| value.1).collect();
            let Some((agreed, _)) = consensus(&mut lows, &mut highs) else { return Ok(()) };
            let hull = (
                right.iter().map(|value| value.0).fold(f64::INFINITY, f64::min),
                right.iter().map(|value| value.1).fold(f64::NEG_INFINITY, f64::max),
            );
            prop_assert!(hull.0 <= agreed.hi() && agreed.lo() <= hull.1, "{agreed:?} {hull:?}");
            // All right intervals contain 0, so the right ones alone always agree.
            if wrong.is_empty() {
                prop_assert!(agreed.contains(0.0));
            }
        }
    }
}
