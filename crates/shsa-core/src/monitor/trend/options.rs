//! Settings of the trend detectors, and what the model says about the noise of the compared values.

use crate::time::Span;

/// Settings of the detectors that go by many comparisons; the defaults are sound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrendOptions {
    /// A difference, and its change since the beginning, up to this share of the tolerance is no drift.
    pub allowance: f64,
    /// How long a difference of twice the allowance must last to be a drift (at least two windows of a difference
    /// quotient, as it says the same for as long as one), and
    pub span: Span,
    /// how many comparisons it must take at least.
    pub least: u32,
    /// The scatter from one comparison to the next, as a standard deviation, that is noise beyond the declared errors.
    pub scatter: f64,
    /// The root mean square difference that must be explained by a shift in time to be one.
    pub skew: f64,
}

impl Default for TrendOptions {
    fn default() -> TrendOptions {
        TrendOptions { allowance: 0.5, span: Span::from_millis(5_000), least: 64, scatter: 0.4, skew: 0.4 }
    }
}

/// What the model says of the noise of two ways that are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Noise {
    /// Nothing, of one signal at least: all patterns within the bounds are sound, and what shows in them is a note.
    #[default]
    Unknown,
    /// It is declared of every signal, but what becomes of it depends on the values: the limits are shares of the tolerance. Its
    /// deviation is at most this share, as errors add up in a formula at least as much as deviations do.
    Declared(f64),
    /// The standard deviation of the difference of both, SI.
    Known(f64),
}
