//! Exponential fading of past evidence.

use crate::time::Span;

/// A step up to this share of the memory is short.
const SHORT: f64 = 1.0 / 64.0;

/// The fading of a sum: what is `memory` old has 1/e of its weight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fading {
    pub(super) memory_s: f64,
    /// The span of the last call and its factor: values mostly come at a steady rate.
    span: Span,
    factor: f64,
}

impl Fading {
    pub(super) fn new(memory: Span) -> Fading {
        Fading { memory_s: memory.seconds().max(1e-9), span: Span::ZERO, factor: 1.0 }
    }

    pub(super) fn at(&self, span: Span) -> f64 {
        if span == self.span { self.factor } else { faded(span.seconds().max(0.0) / self.memory_s) }
    }

    #[inline]
    pub(super) fn over(&mut self, span: Span) -> f64 {
        if span == Span::ZERO {
            // Several values at one moment do not change the usual step.
            return 1.0;
        }
        if span != self.span {
            self.factor = self.at(span);
            self.span = span;
        }
        self.factor
    }
}

/// `exp(-x)` for `x >= 0`. Most steps are short beside the memory: there five terms of the series are within 1e-13, at a fifth of
/// the cost.
#[inline(never)]
fn faded(x: f64) -> f64 {
    if x > SHORT {
        return libm::exp(-x);
    }
    let fifth = 1.0 - x * (1.0 / 5.0);
    let fourth = 1.0 - x * (1.0 / 4.0) * fifth;
    let third = 1.0 - x * (1.0 / 3.0) * fourth;
    1.0 - x * (1.0 - x * 0.5 * third)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_steps_fade_as_the_exponential_function() {
        for step in 0..=4_000 {
            let x = f64::from(step) / 1e5;
            assert!((faded(x) - (-x).exp()).abs() < 1e-13, "{x}");
        }
    }
}
