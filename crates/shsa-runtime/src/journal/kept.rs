//! Chunks kept in memory while the disk refuses, up to a bound.

use super::Chunk;
use super::missing::{Missing, lose};
use std::collections::VecDeque;
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Instant;

/// The most bytes kept while the disk refuses; a disk that is full for a moment causes no hole.
const KEPT: usize = 8 << 20;
/// The chunks that wait for the disk.
#[derive(Default)]
pub(super) struct Kept {
    pub(super) chunks: VecDeque<Chunk>,
    bytes: usize,
    /// The time of the next attempt; `None`: the disk accepts writes.
    pub(super) again: Option<Instant>,
    /// The reason of the last refusal.
    pub(super) because: String,
    /// Whether inputs after the last kept chunk are lost.
    pub(super) has_hole: bool,
}

impl Kept {
    /// The next chunk; returns without one when the next attempt is due.
    pub(super) fn next(&self, chunks: &Receiver<Chunk>) -> Result<Chunk, RecvTimeoutError> {
        match self.again {
            Some(again) => chunks.recv_timeout(again.saturating_duration_since(Instant::now())),
            None => chunks.recv().map_err(|_| RecvTimeoutError::Disconnected),
        }
    }

    /// Keeps a chunk if there is room. After a first loss, all chunks are lost until the kept ones have been written.
    pub(super) fn keep(&mut self, chunk: Chunk, missing: &Mutex<Missing>) {
        if self.has_hole || self.bytes + chunk.lines.len() > KEPT && !self.chunks.is_empty() {
            self.has_hole = true;
            return lose(missing, chunk.inputs, &self.because);
        }
        self.bytes += chunk.lines.len();
        self.chunks.push_back(chunk);
    }

    /// Removes the first chunk, which is written.
    pub(super) fn take(&mut self) {
        self.bytes -= self.chunks.pop_front().map_or(0, |chunk| chunk.lines.len());
    }

    /// Counts all kept chunks as lost.
    pub(super) fn give_up(self, missing: &Mutex<Missing>) {
        let inputs = self.chunks.iter().map(|chunk| chunk.inputs).sum();
        if inputs > 0 {
            lose(missing, inputs, &self.because);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk(lines: &str) -> Chunk {
        Chunk { head: (*b"head\n").into(), lines: lines.into(), inputs: 1 }
    }

    #[test]
    fn what_a_disk_refuses_is_kept_up_to_a_bound() {
        let (mut kept, missing) = (Kept::default(), Mutex::default());
        let large = "x".repeat(1 << 20);
        for _ in 0..10 {
            kept.keep(chunk(&large), &missing);
        }
        assert_eq!((kept.chunks.len(), missing.lock().unwrap().inputs), (8, 2));
        // The kept chunks have no hole.
        kept.take();
        kept.keep(chunk("small\n"), &missing);
        assert_eq!((kept.chunks.len(), missing.lock().unwrap().inputs), (7, 3));
        kept.give_up(&missing);
        assert_eq!(missing.lock().unwrap().inputs, 10);
    }
}
