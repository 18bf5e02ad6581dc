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
    #[inline]
    pub(super) fn is_at_end(&self, value: Interval) -> bool {
        matches!(self, OneSided::AtEnds(saturation) if saturation.is_one_sided(value))
    }

    /// Whether a value may be a bound only.
    #[inline]
    fn includes(&self, value: Interval) -> bool {
        match self {
            OneSided::Never => false,
            OneSided::AtEnds(saturation) => saturation.is_one_sided(value),
            OneSided::Perhaps => true,
        }
    }
}

impl WatchedWay {
    /// Whether its latest value is a bound only.
    #[must_use]
    pub fn is_a_bound(&self) -> bool {
        self.latest_value().is_some_and(|value| self.one_sided.is_at_end(value))
    }
}

impl Residual {
    /// The value beside an output, with a middle of which no trend can be seen where one of both is a bound only.
    #[inline]
    pub(super) fn without_trend(
        &self,
        slower: &WatchedWay,
        faster: &WatchedWay,
        output: &Measured,
        known: Measured,
    ) -> Measured {
        if slower.one_sided.includes(output.value) || faster.one_sided.includes(known.value) {
            return known.with_guess(output.middle() - self.trend.usual());
        }
        known
    }
}
