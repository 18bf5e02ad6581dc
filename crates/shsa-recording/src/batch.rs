//! Samples that one thread hands to another together.

use super::{RecordingError, Sample};

/// The samples, or why there are no more.
pub(super) type Batch = Result<Vec<Sample>, RecordingError>;

/// The most samples of a batch.
pub(super) const BATCH: usize = 4_096;

/// The numbers of a batch, those of lists counted one by one, with which it is full.
const NUMBERS: usize = 1 << 16;

/// Whether a batch, which has so many numbers, is handed over.
pub(super) fn is_full(samples: &[Sample], numbers: usize) -> bool {
    samples.len() >= BATCH || numbers >= NUMBERS
}
