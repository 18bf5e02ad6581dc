//! What became of measurements, one by one and counted.

/// What became of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It counts.
    Used,
    /// The same sensor has been heard of that moment.
    Duplicate,
    /// It is older than can be gone back to.
    TooLate,
    /// It is too far off, or no number.
    Rejected,
    /// Its sensor is not trusted: it is a witness, and does not count.
    Masked,
}

/// How many of each there were, as they arrived.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Those that count.
    pub used: u64,
    /// Those heard before.
    pub duplicate: u64,
    /// Those too old.
    pub too_late: u64,
    /// Those too far off.
    pub rejected: u64,
    /// Those of a sensor that is not trusted.
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
