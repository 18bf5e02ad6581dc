//! Clocks that are set during a recording: times of reception leap by hours, or repeat recorded times.
//!
//! | in the file | is taken for |
//! |---|---|
//! | a leap forwards by more than [`LEAP`] and than 100 periods of the signal | the clock was set |
//! | back by more than [`BACK`] and three samples, and on from there over times that are recorded already | the clock was set |
//! | back into a time of which nothing is recorded yet | samples that were stored and came late: sorted in |
//! | back, and after fewer samples than were passed to where it was | samples that came late: sorted in |
//! | off by more than a leap, and after at most three samples to where it was | times that are wrong: left out |
//!
//! The signals of a file share its clock. When only one signal leaps and the others continue, that signal has a clock of its own,
//! and the clock of the file was not set.

use super::Sample;
use shsa_core::time::{Span, Time};
use std::collections::BTreeMap;

/// The least distance of a leap from the expected time, in nanoseconds: longer than most silences, and equal to the change from
/// summer time.
pub(super) const LEAP: Span = Span::from_millis(3_600_000);

/// The largest distance of messages that overtake each other.
pub(super) const BACK: Span = Span::from_millis(5_000);

/// A leap is longer than this number of periods of the signal.
const PERIODS: i64 = 100;

/// The most samples in a row that may be strays.
const STRAYS: usize = 3;

/// A clock that is set back passes more samples of the signal than this.
const PASSED: usize = 3;

/// The number of samples after a step of one signal that show whether the others stepped, too.
const NEIGHBOURS: usize = 8;

/// A step of a clock that was set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Step {
    /// The time before the step.
    pub(super) from: Time,
    /// The time after the step.
    pub(super) to: Time,
}

/// A file split where its clock was set.
#[derive(Debug, Default)]
pub(super) struct Pieces {
    /// The step before each piece; `None` before the first.
    pub(super) steps: Vec<Option<Step>>,
    /// The piece of each sample; `None` when its time is wrong.
    pub(super) of: Vec<Option<usize>>,
    /// The number of samples with a wrong time.
    pub(super) strays: usize,
}

/// A step of one signal.
#[derive(Clone, Copy, Debug)]
struct Found {
    /// The index of the first sample after the step, among the samples of the signal.
    own: usize,
    step: Step,
}

/// Splits the samples of a file, which are in the order of the file.
///
/// Time: O(samples log samples); each time that goes back adds the samples that it passes.
pub(super) fn pieces(samples: &[Sample]) -> Pieces {
    let mut places: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (place, sample) in samples.iter().enumerate() {
        places.entry(sample.wanted).or_default().push(place);
    }
    let mut of = vec![Some(0); samples.len()];
    let mut strays = 0;
    let mut found: Vec<(usize, usize, Found)> = Vec::new();
    for (&wanted, own) in &mut places {
        let times = |own: &[usize]| -> Vec<Time> {
            own.iter().filter_map(|&place| Some(samples.get(place)?.received)).collect()
        };
        let wrong = wrong(&times(own));
        for place in wrong.iter().filter_map(|&at| own.get(at)) {
            of.get_mut(*place).into_iter().for_each(|it| *it = None);
        }
        strays += wrong.len();
        own.retain(|place| of.get(*place).is_some_and(Option::is_some));
        let place = |at: Found| Some((*own.get(at.own)?, wanted, at));
        found.extend(steps(&times(own)).into_iter().filter_map(place));
    }
    found.sort_by_key(|(place, wanted, _)| (*place, *wanted));
    let mut pieces = Pieces { steps: vec![None], of, strays };
    let mut cuts = Vec::new();
    let mut last: Option<(usize, usize, usize)> = None;
    for (place, wanted, at) in found {
        let Some(own) = places.get(&wanted) else { continue };
        let before = at.own.checked_sub(1).and_then(|before| own.get(before)).copied().unwrap_or(0);
        // A step that another signal has shown already.
        let is_reported =
            |(set, by, until): (usize, usize, usize)| before < if by == wanted { set } else { until };
        if last.is_some_and(is_reported) {
            continue;
        }
        let until = own.get(at.own + NEIGHBOURS).map_or(samples.len(), |place| place + 1);
        if let Some(late) = neighbours(samples, (place, until), at.step) {
            pieces.steps.push(Some(at.step));
            cuts.push((place, late));
            last = Some((place, wanted, until));
        }
    }
    pieces.cut(&cuts);
    pieces
}

impl Pieces {
    /// Begins a piece at each of these places, except for late samples of the old clock.
    fn cut(&mut self, cuts: &[(usize, Vec<usize>)]) {
        let mut next = cuts.iter().peekable();
        let (mut piece, mut late): (usize, &[usize]) = (0, &[]);
        for (place, of) in self.of.iter_mut().enumerate() {
            while let Some((_, its)) = next.next_if(|(begin, _)| *begin <= place) {
                (piece, late) = (piece + 1, its);
            }
            *of = of.map(|_| piece - usize::from(late.binary_search(&place).is_ok()));
        }
    }
}

/// The places within a stretch whose times continue those before the step; `None` when most do, as then the clock of the file did
/// not step.
fn neighbours(samples: &[Sample], (from, until): (usize, usize), step: Step) -> Option<Vec<usize>> {
    let wanted = samples.get(from)?.wanted;
    let half = Span((step.to - step.from).abs().0 / 2);
    let (mut now, mut others, mut late) = (step.to, 0_usize, Vec::new());
    for (place, sample) in samples.iter().enumerate().take(until).skip(from) {
        if sample.wanted == wanted {
            now = sample.received;
            continue;
        }
        others += 1;
        if (sample.received - now).abs() > half {
            late.push(place);
        }
    }
    (2 * late.len() <= others).then_some(late)
}

/// The usual distance between two samples.
fn period(times: &[Time]) -> Span {
    let pairs = times.iter().zip(times.iter().skip(1));
    let mut between: Vec<i64> = pairs.map(|(one, next)| (*next - *one).0).filter(|it| *it > 0).collect();
    let middle = between.len() / 2;
    if between.is_empty() { Span::ZERO } else { Span(*between.select_nth_unstable(middle).1) }
}

fn leap(times: &[Time]) -> Span {
    LEAP.max(period(times).times(PERIODS))
}

/// Samples of a signal whose times are a leap away from those before and after.
fn wrong(times: &[Time]) -> Vec<usize> {
    let is_off = |one: Time, next: Time, leap: Span| (next - one).abs() > leap;
    // Most files need only this test.
    if !times.iter().zip(times.iter().skip(1)).any(|(one, next)| is_off(*one, *next, LEAP)) {
        return Vec::new();
    }
    let leap = leap(times);
    let mut wrong = Vec::new();
    let Some(mut last) = times.first().copied() else { return wrong };
    let mut at = 1;
    while let Some(&time) = times.get(at) {
        let next = times.iter().enumerate().skip(at + 1).take(STRAYS);
        match next.filter(|(_, next)| !is_off(last, **next, leap)).map(|(next, _)| next).next() {
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

/// Where the clock of a signal was set.
fn steps(times: &[Time]) -> Vec<Found> {
    if times.iter().zip(times.iter().skip(1)).all(|(one, next)| *one <= *next && *next - *one <= LEAP) {
        return Vec::new();
    }
    let leap = leap(times);
    let mut found = Vec::new();
    let Some(mut latest) = times.first().copied() else { return found };
    let (mut begin, mut at) = (0, 1);
    while let Some(&time) = times.get(at) {
        let is_set = if time - latest > leap {
            true
        } else if latest - time > BACK {
            let piece = times.get(begin..at).unwrap_or_default();
            let rest = times.get(at..).unwrap_or_default();
            match went_back(piece, rest, latest, leap) {
                true => true,
                false => {
                    at += rest.iter().take_while(|time| **time < latest).count().max(1);
                    continue;
                }
            }
        } else {
            false
        };
        if is_set {
            let from = at.checked_sub(1).and_then(|before| times.get(before)).copied().unwrap_or(latest);
            found.push(Found { own: at, step: Step { from, to: time } });
            (begin, latest) = (at, time);
        }
        latest = latest.max(time);
        at += 1;
    }
    found
}

/// Whether the clock was set back between a piece, whose latest time is `latest`, and the rest; false when samples came late.
fn went_back(piece: &[Time], rest: &[Time], latest: Time, leap: Span) -> bool {
    let Some(&first) = rest.first() else { return false };
    let run = rest.iter().take_while(|time| **time < latest);
    let again = run.clone().count();
    let reached = run.max().copied().unwrap_or(first);
    let is_at_end = again == rest.len();
    // After a short step back, only a part as dense as the run decides, so that files with many late samples are read in one
    // pass.
    let is_short = !is_at_end && latest - first <= leap;
    let looked_at = if is_short { 4 * again + 64 } else { piece.len() };
    let passed = piece.iter().rev().take(looked_at).filter(|time| **time > first);
    let within = passed.clone().filter(|time| **time <= reached).count();
    let passed = passed.count();
    // The recording has no samples of that time: stored samples arrive after new ones.
    let fills_a_gap = 2 * within < again && piece.iter().any(|time| *time < first);
    if latest - first > leap {
        return !fills_a_gap;
    }
    let is_dense = if is_at_end { 2 * again >= within } else { 2 * again >= passed };
    passed > PASSED && again > PASSED && !fills_a_gap && is_dense
}

#[cfg(test)]
#[expect(clippy::single_range_in_vec_init, reason = "one stretch of several that a list may have")]
mod tests {
    use super::*;
    use shsa_core::observation::RawValue;

    const HOUR: i64 = 3_600;

    /// Compares the pieces of samples, each a signal and a time in seconds, with the expected times of each piece.
    #[track_caller]
    fn check(samples: &[(usize, i64)], expected: &[&[i64]]) {
        let sample = |&(wanted, second): &(usize, i64)| {
            let time = Time(second * 1_000_000_000);
            Sample { wanted, time, received: time, value: RawValue::Number(0.0) }
        };
        let samples: Vec<Sample> = samples.iter().map(sample).collect();
        let pieces = pieces(&samples);
        assert_eq!(pieces.of.len(), samples.len());
        assert_eq!(pieces.strays, pieces.of.iter().filter(|of| of.is_none()).count());
        let of_piece = |piece: usize| -> Vec<i64> {
            let own = samples.iter().zip(&pieces.of).filter(|(_, of)| **of == Some(piece));
            own.map(|(sample, _)| sample.received.0 / 1_000_000_000).collect()
        };
        let found: Vec<Vec<i64>> = (0..pieces.steps.len()).map(of_piece).collect();
        assert_eq!(found, expected);
    }

    fn of_one(seconds: impl IntoIterator<Item = i64>) -> Vec<(usize, i64)> {
        seconds.into_iter().map(|second| (0, second)).collect()
    }

    fn list(ranges: impl IntoIterator<Item = std::ops::Range<i64>>) -> Vec<i64> {
        ranges.into_iter().flatten().collect()
    }

    #[test]
    fn a_clock_that_is_set_forwards_begins_a_piece() {
        let epoch = 1_760_000_000;
        let (boot, set) = (list([0..12]), list([epoch..epoch + 40]));
        check(&of_one(boot.iter().chain(&set).copied()), &[&boot, &set]);
        // Two rows before the time is known.
        check(&of_one(list([0..2, epoch..epoch + 40])), &[&[0, 1], &set]);
        // One after.
        check(&of_one(list([0..12, epoch..epoch + 1])), &[&boot, &[epoch]]);
    }

    #[test]
    fn a_silence_is_no_step() {
        let times = list([0..20, 900..920, 920 + HOUR - 10..920 + HOUR]);
        check(&of_one(times.clone()), &[&times]);
        // When values are an hour apart, half a day of silence is not much.
        let slow = [0, HOUR, 2 * HOUR, 14 * HOUR, 15 * HOUR, 16 * HOUR];
        check(&of_one(slow), &[&slow]);
    }

    #[test]
    fn a_clock_that_is_set_back_begins_a_piece() {
        for back in [10, 60, HOUR] {
            let (before, after) = (list([0..2 * HOUR]), list([2 * HOUR - back..3 * HOUR]));
            check(&of_one(before.iter().chain(&after).copied()), &[&before, &after]);
        }
        // Set to a time before all samples.
        let (before, after) = (list([9 * HOUR..9 * HOUR + 50]), list([0..50]));
        check(&of_one(before.iter().chain(&after).copied()), &[&before, &after]);
        // Up to the end of the file, without reaching the earlier time.
        let (before, after) = (list([0..100]), list([50..70]));
        check(&of_one(before.iter().chain(&after).copied()), &[&before, &after]);
    }

    #[test]
    fn what_comes_late_is_no_step() {
        for late in [vec![3], vec![8, 9], vec![0, 1, 2, 3], (0..7).rev().collect()] {
            let times: Vec<i64> = (0..20).chain(late).chain(20..40).collect();
            check(&of_one(times.clone()), &[&times]);
        }
        // Samples that were stored while the connection was lost, and sent afterwards.
        let times = list([0..100, 400..430, 100..400, 430..500]);
        check(&of_one(times.clone()), &[&times]);
    }

    #[test]
    fn times_that_are_wrong_are_left_out() {
        let sound = list([100_000..100_050]);
        for wrong in [0, 900_000_000] {
            let times: Vec<i64> =
                sound.iter().take(20).chain(&[wrong]).chain(sound.iter().skip(20)).copied().collect();
            check(&of_one(times), &[&sound]);
        }
    }

    #[test]
    fn signals_step_together() {
        let epoch = 1_760_000_000;
        let rows = |seconds: &[i64]| -> Vec<(usize, i64)> {
            seconds.iter().flat_map(|&it| [(0, it), (1, it)]).collect()
        };
        let twice = |seconds: &[i64]| -> Vec<i64> { seconds.iter().flat_map(|&it| [it, it]).collect() };
        let (boot, set) = (list([0..12]), list([epoch..epoch + 40]));
        check(&rows(&list([0..12, epoch..epoch + 40])), &[&twice(&boot), &twice(&set)]);
        // The message of the other signal that was on its way belongs to the time before.
        let mut late = rows(&list([0..12, epoch..epoch + 40]));
        late.swap(23, 24);
        check(&late, &[&twice(&boot), &twice(&set)]);
        // A slow signal does not show a step back that is shorter than its period, and follows the others.
        let slow = |from: i64, to: i64| {
            (from..to).flat_map(|it| [(0, it)].into_iter().chain((it % 60 == 0).then_some((1, it))))
        };
        let both: Vec<(usize, i64)> = slow(0, 300).chain(slow(270, 500)).collect();
        let seconds = |from, to| -> Vec<i64> { slow(from, to).map(|(_, it)| it).collect() };
        check(&both, &[&seconds(0, 300), &seconds(270, 500)]);
    }

    #[test]
    fn a_clock_of_its_own_is_no_step_of_all() {
        let rows = (0..100).flat_map(|it| [(0, it), (1, if it < 50 { it } else { it + 9 * HOUR })]);
        let rows: Vec<(usize, i64)> = rows.collect();
        let seconds: Vec<i64> = rows.iter().map(|(_, it)| *it).collect();
        check(&rows, &[&seconds]);
        // Signals one after the other.
        let rows: Vec<(usize, i64)> =
            (0..3).flat_map(|signal| (0..5 * HOUR).step_by(60).map(move |it| (signal, it))).collect();
        let seconds: Vec<i64> = rows.iter().map(|(_, it)| *it).collect();
        check(&rows, &[&seconds]);
    }
}
