//! The times of one signal: which are wrong, and where its clock was set.

use super::receptions::Signal;
use super::{BACK, LEAP, Step};
use shsa_core::time::{Span, Time};
use std::ops::Range;

/// A leap is longer than this number of periods of the signal.
const PERIODS: i64 = 100;

/// The most samples in a row that may be strays.
const STRAYS: usize = 3;

/// A clock that is set back passes more samples of the signal than this.
const PASSED: usize = 3;

/// The times of a stretch of samples.
fn within(times: &impl Signal, stretch: Range<usize>) -> impl DoubleEndedIterator<Item = Time> + Clone {
    stretch.filter_map(|at| times.time(at))
}

/// Each two times in a row.
fn pairs(times: &impl Signal) -> impl Iterator<Item = (Time, Time)> {
    (1..times.count()).filter_map(|at| Some((times.time(at - 1)?, times.time(at)?)))
}

/// The most distances of which the median is found in a list.
const LISTED_MAX: usize = 1 << 15;

/// The usual distance between two samples: the median of those above zero. Of many, it is found digit by digit, in memory that does
/// not grow with the samples (radix selection); time: O(samples).
fn period(times: &impl Signal) -> Span {
    let between = || {
        let distances = pairs(times).map(|(one, next)| (next - one).0);
        distances.filter_map(|distance| u64::try_from(distance).ok()).filter(|distance| *distance > 0)
    };
    let count = between().count();
    if count <= LISTED_MAX {
        let mut listed: Vec<u64> = between().collect();
        let median = if count > 0 { *listed.select_nth_unstable(count / 2).1 } else { 0 };
        return Span(i64::try_from(median).unwrap_or(0));
    }
    let mut rank = count / 2;
    let mut median = 0_u64;
    for shift in [48, 32, 16, 0] {
        let mut counts = vec![0_usize; 1 << 16];
        let known = |distance: u64| distance.checked_shr(shift + 16).unwrap_or(0);
        for distance in between().filter(|distance| known(*distance) == median) {
            let digit = usize::try_from(distance >> shift & 0xffff).unwrap_or(0);
            counts.get_mut(digit).into_iter().for_each(|count| *count += 1);
        }
        let mut digit = 0;
        for count in counts {
            if rank < count {
                break;
            }
            (rank, digit) = (rank - count, digit + 1);
        }
        median = median << 16 | digit & 0xffff;
    }
    Span(i64::try_from(median).unwrap_or(0))
}

fn leap(times: &impl Signal) -> Span {
    LEAP.max(period(times).times(PERIODS))
}

/// Samples of a signal whose times are a leap away from those before and after.
pub(super) fn wrong(times: &impl Signal) -> Vec<usize> {
    let is_off = |one: Time, next: Time, leap: Span| (next - one).abs() > leap;
    // Most files need only this test.
    if !pairs(times).any(|(one, next)| is_off(one, next, LEAP)) {
        return Vec::new();
    }
    let leap = leap(times);
    let mut wrong = Vec::new();
    let Some(mut last) = times.time(0) else { return wrong };
    let mut at = 1;
    while let Some(time) = times.time(at) {
        let is_near = |next: &usize| times.time(*next).is_some_and(|next| !is_off(last, next, leap));
        match (at + 1..=at + STRAYS).find(is_near) {
            Some(next) if is_off(last, time, leap) => {
                wrong.extend(at..next);
                at = next;
            }
            _ => {
                last = time;
                at += 1;
            }
        }
    }
    wrong
}

/// Where the clock of a signal was set: the first samples after the steps.
pub(super) fn steps(times: &impl Signal) -> Vec<(usize, Step)> {
    if pairs(times).all(|(one, next)| one <= next && next - one <= LEAP) {
        return Vec::new();
    }
    let leap = leap(times);
    let mut found = Vec::new();
    let Some(mut latest) = times.time(0) else { return found };
    let (mut begin, mut at) = (0, 1);
    while let Some(time) = times.time(at) {
        let is_back = latest - time > BACK;
        if is_back && !went_back(times, begin..at, latest, leap) {
            let late = within(times, at..times.count()).take_while(|time| *time < latest);
            at += late.count().max(1);
            continue;
        }
        if is_back || time - latest > leap {
            let from = times.time(at - 1).unwrap_or(latest);
            found.push((at, Step { from, to: time }));
            (begin, latest) = (at, time);
        }
        latest = latest.max(time);
        at += 1;
    }
    found
}

/// Whether the clock was set back between a piece, whose latest time is `latest`, and the rest; false when samples came late.
fn went_back(times: &impl Signal, piece: Range<usize>, latest: Time, leap: Span) -> bool {
    let rest = piece.end..times.count();
    let Some(first) = times.time(rest.start) else { return false };
    let run = within(times, rest.clone()).take_while(|time| *time < latest);
    let (again, reached) = run.fold((0, first), |(count, reached), time| (count + 1, reached.max(time)));
    let is_at_end = again == rest.len();
    // After a short step back, only a part as dense as the run decides, so that files with many late samples are read in one
    // pass.
    let is_short = !is_at_end && latest - first <= leap;
    let looked_at = if is_short { 4 * again + 64 } else { piece.len() };
    let passed = within(times, piece.clone()).rev().take(looked_at).filter(|time| *time > first);
    let within_run = passed.clone().filter(|time| *time <= reached).count();
    let passed = passed.count();
    // The recording has no samples of that time: stored samples arrive after new ones.
    let fills_a_gap = 2 * within_run < again && within(times, piece).any(|time| time < first);
    if latest - first > leap {
        return !fills_a_gap;
    }
    let is_dense = if is_at_end { 2 * again >= within_run } else { 2 * again >= passed };
    passed > PASSED && again > PASSED && !fills_a_gap && is_dense
}
