//! Rows of a table that are added together.

use super::{Destination, Gathered};
use crate::{RawValue, Sample};
use shsa_core::time::Time;

/// A signal, and what the rows have for it.
pub(crate) type Numbers<'n> = (usize, &'n [Option<f64>]);

impl Gathered {
    /// Adds rows, each at its time, in which every one of these signals has a number: as [`Gathered::sample`] does row by row.
    pub(crate) fn rows(&mut self, times: &[Time], columns: &[Numbers<'_>]) {
        if !self.are_kept(columns, times.len()) {
            return each(times, columns, |wanted, time, value| self.sample(wanted, time, time, value));
        }
        for (wanted, _) in columns {
            if let (Some(stream), Some(found)) =
                (self.streams.get_mut(*wanted), self.recording.found.get_mut(*wanted))
            {
                found.samples += times.len();
                stream.stamps.see_received(times);
            }
        }
        let samples = &mut self.recording.samples;
        samples.reserve(times.len() * columns.len());
        each(times, columns, |wanted, time, value| {
            samples.push(Sample { wanted, time, received: time, value })
        });
    }

    /// Whether all samples of these rows are kept; then there is room for them.
    fn are_kept(&mut self, columns: &[Numbers<'_>], rows: usize) -> bool {
        let is_kept = |wanted: usize| self.streams.get(wanted).is_some_and(|stream| !stream.only_changes);
        matches!(self.destination, Destination::Kept)
            && columns.iter().all(|(wanted, _)| is_kept(*wanted))
            && self.room.take_all(columns.len() * rows)
    }
}

/// Passes on the numbers, row by row.
#[inline]
fn each(times: &[Time], columns: &[Numbers<'_>], mut pass: impl FnMut(usize, Time, RawValue)) {
    for (at, time) in times.iter().enumerate() {
        for (wanted, numbers) in columns {
            if let Some(Some(number)) = numbers.get(at) {
                pass(*wanted, *time, RawValue::Number(*number));
            }
        }
    }
}
