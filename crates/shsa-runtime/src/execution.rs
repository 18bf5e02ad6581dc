//! The observed execution times of each need's source.

use super::execution_bound::execution_bound;
use super::figures::{LONGEST, histogram, times};
use crate::error::RuntimeError;
use hdrhistogram::Histogram;
use serde_json::Value;
use std::time::Duration;

/// A histogram of the execution times of one need's source.
#[derive(Clone, Debug)]
pub(super) struct Execution(Histogram<u64>);

impl Execution {
    /// # Errors
    /// Never: the bounds of the histogram are valid.
    pub(super) fn new() -> Result<Execution, RuntimeError> {
        Ok(Execution(histogram()?))
    }

    /// Adds an execution time.
    pub(super) fn took(&mut self, time: Duration) {
        let nanoseconds = u64::try_from(time.as_nanos()).unwrap_or(LONGEST);
        self.0.saturating_record(nanoseconds.max(1));
    }

    /// The histogram, nanoseconds.
    pub(super) fn times(&self) -> &Histogram<u64> {
        &self.0
    }

    /// The quantiles for the state, and the bound once there are enough times.
    pub(super) fn json(&self) -> Value {
        let mut quantiles = times(&self.0);
        if let Value::Object(quantiles) = &mut quantiles {
            let bound = execution_bound(&self.0).map(|nanoseconds| nanoseconds as f64 / 1e3);
            quantiles.insert("bound".to_owned(), bound.into());
        }
        quantiles
    }
}
