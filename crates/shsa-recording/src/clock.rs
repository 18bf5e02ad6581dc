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

mod division;
mod receptions;
mod times;

use shsa_core::time::{Span, Time};

pub(super) use division::{Division, divide};
pub(super) use receptions::{Receptions, Stored};

/// The least distance of a leap from the expected time, in nanoseconds: longer than most silences, and equal to the change from
/// summer time.
pub(super) const LEAP: Span = Span::from_millis(3_600_000);

/// The largest distance of messages that overtake each other.
pub(super) const BACK: Span = Span::from_millis(5_000);

/// A step of a clock that was set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Step {
    /// The time before the step.
    pub(super) from: Time,
    /// The time after the step.
    pub(super) to: Time,
}

/// Whether the clock of a file may have been set, by the receptions of each signal; otherwise [`divide`] finds one piece, and nothing
/// to leave out.
#[derive(Clone, Debug, Default)]
pub(super) struct Suspicion {
    /// By signal, the last and the latest reception; `None` before the first.
    of_signal: Vec<Option<(Time, Time)>>,
    /// The signals that show it.
    pub(super) signals: Vec<usize>,
}

impl Suspicion {
    /// Takes in the next reception of a signal.
    #[inline]
    pub(super) fn see(&mut self, wanted: usize, received: Time) {
        match self.of_signal.get_mut(wanted) {
            // As nearly all are: later than all before, and by little.
            Some(Some((last, latest))) if last == latest && received >= *last && received - *last <= LEAP => {
                (*last, *latest) = (received, received);
            }
            Some(Some((last, latest))) => {
                let is_odd =
                    (received - *last).abs() > LEAP || received - *latest > LEAP || *latest - received > BACK;
                (*last, *latest) = (received, received.max(*latest));
                if is_odd && !self.signals.contains(&wanted) {
                    self.signals.push(wanted);
                }
            }
            _ => self.begin(wanted, received),
        }
    }

    #[cold]
    fn begin(&mut self, wanted: usize, received: Time) {
        if self.of_signal.len() <= wanted {
            self.of_signal.resize(wanted + 1, None);
        }
        self.of_signal.get_mut(wanted).into_iter().for_each(|it| *it = Some((received, received)));
    }
}

#[cfg(test)]
#[expect(clippy::single_range_in_vec_init, reason = "one stretch of several that a list may have")]
mod tests {
    use super::super::Sample;
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
        let division = divide(&samples[..]);
        let of: Vec<Option<usize>> = (0..samples.len()).map(|place| division.piece_of(place)).collect();
        assert_eq!(division.strays.len(), of.iter().filter(|of| of.is_none()).count());
        let of_piece = |piece: usize| -> Vec<i64> {
            let own = samples.iter().zip(&of).filter(|(_, of)| **of == Some(piece));
            own.map(|(sample, _)| sample.received.0 / 1_000_000_000).collect()
        };
        let found: Vec<Vec<i64>> = (0..division.steps.len()).map(of_piece).collect();
        assert_eq!(found, expected);
        let mut stored = Stored::new().unwrap();
        samples.iter().for_each(|sample| stored.push(sample.wanted, sample.received));
        assert_eq!(divide(&stored), division);
        assert!(stored.failure().is_none());
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
