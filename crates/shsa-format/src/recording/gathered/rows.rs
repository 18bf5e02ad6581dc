//! Rows of a table that are added together.

use super::{Destination, Gathered};
use crate::recording::{RawValue, Sample};
use shsa_core::time::Time;

impl Gathered {
    /// Adds rows, each at its time, in which every one of these signals has a number: as [`Gathered::sample`] does row by row.
    pub(in crate::recording) fn rows<'n>(
        &mut self,
        times: &[Time],
        columns: impl Iterator<Item = (usize, &'n [Option<f64>])> + Clone,
    ) {
        let each = || {
            let row = |at: usize| columns.clone().filter_map(move |(of, numbers)| Some((of, (*numbers.get(at)?)?)));
            times.iter().enumerate().flat_map(move |(at, time)| row(at).map(|(of, number)| (of, *time, number)))
        };
        if !self.are_kept(columns.clone().map(|(wanted, _)| wanted), times.len()) {
            return each().for_each(|(of, time, number)| self.sample(of, time, time, RawValue::Number(number)));
        }
        for (wanted, _) in columns.clone() {
            if let (Some(stream), Some(found)) =
                (self.streams.get_mut(wanted), self.recording.found.get_mut(wanted))
            {
                found.samples += times.len();
                stream.stamps.see_received(times);
            }
        }
        self.recording.samples.reserve(times.len() * columns.clone().count());
        each().for_each(|(wanted, time, number)| {
            self.recording.samples.push(Sample { wanted, time, received: time, value: RawValue::Number(number) });
        });
    }

    /// Whether all samples of these rows are kept; then there is room for them.
    fn are_kept(&mut self, mut wanted: impl Iterator<Item = usize> + Clone, rows: usize) -> bool {
        let is_kept = |wanted: usize| self.streams.get(wanted).is_some_and(|stream| !stream.only_changes);
        let count = wanted.clone().count();
        matches!(self.destination, Destination::Kept) && wanted.all(is_kept) && self.room.take_all(count * rows)
    }
}
