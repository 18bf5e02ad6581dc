//! Values that are bounds only: of signals that [saturate](crate::knowledge::Saturation), and what is computed from them.
//!
//! Such a value contradicts another one, or it does not. Its middle says nothing, so no trend is seen in it.

use super::trend::Measured;
use super::{Residual, WatchedWay};
use crate::interval::Interval;
use crate::knowledge::{KnowledgeBase, Saturation};
use crate::substitution::Way;

/// Which values of a way are bounds only.
#[derive(Clone, Copy, Debug)]
pub(super) enum OneSided {
    Never,
    /// Those of readings at the ends of what can be shown.
    AtEnds(Saturation),
    /// Any may be.
    Perhaps,
}

impl OneSided {
    pub(super) fn of(knowledge: &KnowledgeBase, way: &Way) -> OneSided {
        let saturation = |signal| knowledge.signals()[signal].limits.saturation;
        match way.direct() {
            Some(signal) => saturation(signal).map_or(OneSided::Never, OneSided::AtEnds),
            None if way.inputs().any(|signal| saturation(signal).is_some()) => OneSided::Perhaps,
            None => OneSided::Never,
        }
    }

    /// Whether a value certainly is a bound only.
    fn is_at_end(&self, value: Interval) -> bool {
        matches!(self, OneSided::AtEnds(saturation) if saturation.is_one_sided(value))
    }

    /// Whether a value may be a bound only.
    fn includes(&self, value: Interval) -> bool {
        matches!(self, OneSided::Perhaps) || self.is_at_end(value)
    }
}

impl WatchedWay {
    /// Whether its latest value is a bound only.
    #[must_use]
    pub fn is_a_bound(&self) -> bool {
        self.latest_value().is_some_and(|value| self.one_sided.is_at_end(value))
    }

    /// Whether some of its values may be.
    pub(super) fn may_be_a_bound(&self) -> bool {
        !matches!(self.one_sided, OneSided::Never)
    }
}

impl Residual {
    /// Whether one of two values is certainly a bound only.
    #[cold]
    #[inline(never)]
    pub(super) fn are_bounds(
        [slower, faster]: [&WatchedWay; 2],
        output: &Measured,
        known: &Measured,
    ) -> bool {
        slower.one_sided.is_at_end(output.value) || faster.one_sided.is_at_end(known.value)
    }

    /// The value beside an output, with a middle of which no trend can be seen where one of both is a bound only.
    #[cold]
    #[inline(never)]
    pub(super) fn without_trend(
        &self,
        [slower, faster]: [&WatchedWay; 2],
        output: &Measured,
        known: Measured,
    ) -> Measured {
        match slower.one_sided.includes(output.value) || faster.one_sided.includes(known.value) {
            true => known.with_guess(output.middle() - self.trend.usual()),
            false => known,
        }
    }
}
