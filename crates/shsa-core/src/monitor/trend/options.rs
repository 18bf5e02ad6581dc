//! Settings of the trend detectors, and the declared noise of the compared values.

use crate::numbers::{HALF, LASTING, MANY, OFF_SHARE};
use crate::time::Span;

/// Settings of the trend detectors; the defaults are safe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrendOptions {
    /// A difference, and its change since the beginning, up to this share of the tolerance is no drift.
    pub allowance: f64,
    /// How long a difference of twice the allowance must last to be a drift: at least two windows of a difference quotient, as
    /// one window repeats itself.
    pub span: Span,
    /// The least number of comparisons of a drift.
    pub least: u32,
    /// The scatter from one comparison to the next, as a standard deviation, that is beyond the declared errors.
    pub scatter: f64,
    /// The root mean square difference from which on a shift in time counts, where it explains the differences.
    pub skew: f64,
}

impl Default for TrendOptions {
    fn default() -> TrendOptions {
        TrendOptions { allowance: HALF, span: LASTING, least: MANY, scatter: OFF_SHARE, skew: OFF_SHARE }
    }
}

/// The declared noise of the two compared ways.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Noise {
    /// A signal declares no noise: every pattern within the bounds is sound, and a trend is a note only.
    #[default]
    Unknown,
    /// All signals declare noise, but its propagation depends on the values: limits are shares of the tolerance. The deviation is
    /// at most this share, as errors add up in a formula at least as much as deviations.
    Declared(f64),
    /// The standard deviation of the difference of both, SI.
    Known(f64),
}
