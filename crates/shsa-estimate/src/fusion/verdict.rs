//! How measurements were handled, one by one and counted.

/// How a measurement was handled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The measurement counts.
    Used,
    /// Another measurement of the same sensor and moment was there already.
    Duplicate,
    /// The measurement is older than the fusion can go back.
    TooLate,
    /// The measurement is too far off, or not a number.
    Rejected,
    /// The sensor is not trusted: the measurement is compared, and does not count.
    Masked,
}

/// The number of measurements by how they were handled on arrival.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Measurements that count.
    pub used: u64,
    /// Repeated measurements.
    pub duplicate: u64,
    /// Measurements that are too old.
    pub too_late: u64,
    /// Measurements that are too far off.
    pub rejected: u64,
    /// Measurements of a sensor that is not trusted.
    pub masked: u64,
}

impl Counts {
    pub(super) fn count(&mut self, verdict: Verdict) {
        let counter = match verdict {
            Verdict::Used => &mut self.used,
            Verdict::Duplicate => &mut self.duplicate,
            Verdict::TooLate => &mut self.too_late,
            Verdict::Rejected => &mut self.rejected,
            Verdict::Masked => &mut self.masked,
        };
        *counter = counter.saturating_add(1);
    }
}
