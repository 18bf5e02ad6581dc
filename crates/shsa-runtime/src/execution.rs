//! How long it takes to compute what serves each need, as observed.

use super::figures::{LONGEST, histogram, times};
use crate::error::RuntimeError;
use hdrhistogram::Histogram;
use serde_json::Value;
use std::time::Duration;

/// The execution times of one service.
#[derive(Clone, Debug)]
pub(super) struct Execution(Histogram<u64>);

impl Execution {
    /// # Errors
    /// Never: the bounds are right.
    pub(super) fn new() -> Result<Execution, RuntimeError> {
        Ok(Execution(histogram()?))
    }

    /// It took so long this time.
    pub(super) fn took(&mut self, time: Duration) {
        let nanoseconds = u64::try_from(time.as_nanos()).unwrap_or(LONGEST);
        self.0.saturating_record(nanoseconds.max(1));
    }

    /// All of them, nanoseconds.
    pub(super) fn times(&self) -> &Histogram<u64> {
        &self.0
    }

    /// As part of the state.
    pub(super) fn json(&self) -> Value {
        times(&self.0)
    }
}
