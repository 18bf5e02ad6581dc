//! The error of a need while a sensor lies, beside the median of what the need could be served from.

use serde_json::json;

/// Sizes of faults, as shares of what comparisons may hide.
pub(crate) const SHARES: [f64; 5] = [0.1, 0.3, 1.0, 2.0, 5.0];
/// How often the errors are looked at while a fault lasts.
const MOMENTS: u32 = 200;
/// A voter uses values that are no older than so many periods of their source.
pub(crate) const PERIODS: f64 = 3.0;
/// The error of needs may be so many times a voter's.
pub(crate) const MOST: f64 = 1.2;

/// Errors of needs and voters, in shares of what may be hidden.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Errors {
    moments: usize,
    served: usize,
    need: f64,
    voter: f64,
}

impl Errors {
    /// Takes a moment with a voter's value: how far the need, where it is served, and the voter are off.
    pub(crate) fn take(&mut self, need: Option<f64>, voter: f64) {
        self.moments += 1;
        let Some(need) = need else { return };
        self.served += 1;
        self.need += need.powi(2);
        self.voter += voter.powi(2);
    }

    pub(crate) fn add(&mut self, other: Errors) {
        self.moments += other.moments;
        self.served += other.served;
        self.need += other.need;
        self.voter += other.voter;
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.moments == 0
    }

    /// The share of the moments in which the need was served.
    pub(crate) fn served(&self) -> f64 {
        self.served as f64 / self.moments.max(1) as f64
    }

    /// The root mean squares of the need and of the voter.
    pub(crate) fn roots(&self) -> (f64, f64) {
        let root = |sum: f64| (sum / self.served.max(1) as f64).sqrt();
        (root(self.need), root(self.voter))
    }

    /// Whether needs err no more than [`MOST`] times as far as voters.
    pub(crate) fn is_right(&self) -> bool {
        let (need, voter) = self.roots();
        need <= MOST * voter
    }

    /// One line about them.
    pub(crate) fn line(&self, name: &str, as_json: bool) -> String {
        let ((need, voter), served) = (self.roots(), self.served());
        match as_json {
            true => json!({ "fault": name, "served": served, "need": need, "median": voter }).to_string(),
            false => format!(
                "{name:<12} served {:>5.1} %, error of the need {need:.3}, of the median {voter:.3}: {:.2} times",
                100.0 * served,
                need / voter
            ),
        }
    }
}

/// The moments of a fault at which errors are looked at.
pub(crate) fn moments(from: f64, to: f64) -> impl Iterator<Item = f64> {
    (0..MOMENTS).map(move |number| from + (to - from) * (f64::from(number) + 0.5) / f64::from(MOMENTS))
}

/// The median of three values or more; of an even number, the middle of the two in the middle.
pub(crate) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0..=2 => None,
        count if count % 2 == 1 => Some(values[middle]),
        _ => Some(0.5 * (values[middle - 1] + values[middle])),
    }
}
