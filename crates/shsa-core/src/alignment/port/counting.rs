//! What only counts up: a reading below an earlier one is a glitch, or the counter has begun anew. The next reading decides.

use crate::alignment::history::Sample;
use crate::alignment::reception::Jump;
use crate::time::Time;

/// The readings of a counter. O(1) a reading.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counting {
    /// The highest reading since the counter began.
    highest: Option<Sample>,
    /// A reading below it, which the next one confirms or refutes.
    lower: Option<Sample>,
    /// When the counter began anew, as far as that is known.
    began: Option<Time>,
}

/// What a reading of a counter says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Counted {
    /// The counter goes on.
    On,
    /// The counter goes on; the lower reading before was wrong.
    OnAfter(Jump),
    /// The reading is lower than an earlier one.
    Lower,
    /// The reading is lower still: a counter does not count down.
    Down(Jump),
    /// The counter has begun anew with the lower reading before, and goes on from there.
    Anew(Sample),
    /// The reading is from before the counter began anew.
    Old,
}

impl Counting {
    /// Takes in a reading.
    pub(super) fn count(&mut self, reading: Sample) -> Counted {
        let at = reading.validity.to;
        if self.began.is_some_and(|began| at < began) {
            return Counted::Old;
        }
        let Some(highest) = self.highest else {
            self.highest = Some(reading);
            return Counted::On;
        };
        let follows = |earlier: Sample| earlier.validity.to < reading.validity.from;
        if reading.value.hi() >= highest.value.lo() {
            let is_higher = reading.value.lo() > highest.value.lo();
            let validity = if follows(highest) { reading.validity } else { highest.validity };
            self.highest = Some(if is_higher { reading } else { Sample { validity, ..highest } });
            let refuted = self.lower.take_if(|lower| follows(*lower));
            return refuted.map_or(Counted::On, |lower| Counted::OnAfter(down(highest, lower)));
        }
        if reading.validity.to < highest.validity.from {
            return Counted::On;
        }
        if !follows(highest) {
            // What may be the earlier one of both may be the lower one.
            return Counted::Lower;
        }
        let lower = self.lower.filter(|lower| follows(*lower));
        self.lower = Some(reading);
        match lower {
            None => Counted::Lower,
            Some(lower) if reading.value.hi() < lower.value.lo() => Counted::Down(down(lower, reading)),
            Some(lower) => {
                *self = Counting { highest: Some(reading), lower: None, began: Some(lower.validity.to) };
                Counted::Anew(lower)
            }
        }
    }
}

/// A step down, for which a counter is never fast enough.
fn down(from: Sample, to: Sample) -> Jump {
    let within = (to.validity.to - from.validity.from).max(from.validity.to - to.validity.from);
    Jump { from: from.value, to: to.value, within, max_rate: 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alignment::{Acceptance, Port};
    use crate::interval::Interval;
    use crate::knowledge::{Id, Shape, Signal, SignalId, VariableId};
    use crate::observation::{Observation, RawValue};
    use crate::time::Validity;
    use alloc::vec::Vec;
    use proptest::prelude::*;

    fn reading(second: usize, value: f64, error: f64) -> Sample {
        let value = Interval::new(value - error, value + error);
        Sample { validity: Validity::at(Time(second as i64 * 1_000_000_000)), value }
    }

    proptest! {
        /// Of a counter within its errors, each restart is found with the reading after it, and nothing else is.
        #[test]
        fn restarts_are_found_and_nothing_else(
            steps in prop::collection::vec(0.0..5.0_f64, 40..80),
            restarts in prop::collection::btree_set(3_usize..12, 0..3),
            saved in 0.0..1.0_f64, error in 0.0..0.4_f64, side in prop::collection::vec(-1.0..1.0_f64, 80),
        ) {
            // A few steps between two of them.
            let restarts: Vec<usize> = restarts.into_iter().map(|at| 3 * at).collect();
            let (mut counting, mut count, mut found) = (Counting::default(), 1000.0, Vec::new());
            for (at, step) in steps.iter().enumerate() {
                let is_anew = restarts.contains(&at);
                count = if is_anew { (count - 500.0) * saved } else { count + step };
                match counting.count(reading(at, count + 0.999 * error * side[at], error)) {
                    Counted::On => prop_assert!(!is_anew),
                    Counted::Lower => prop_assert!(is_anew),
                    Counted::Anew(first) => found.push(first.validity.to.0 as usize / 1_000_000_000),
                    other => prop_assert!(false, "{other:?}"),
                }
            }
            let expected: Vec<usize> = restarts.into_iter().filter(|at| at + 1 < steps.len()).collect();
            prop_assert_eq!(found, expected);
        }

        /// A single lower reading is refuted by the next one.
        #[test]
        fn a_glitch_is_refuted(at in 2_usize..30, low in 0.0..990.0_f64) {
            let mut counting = Counting::default();
            for second in 0..40 {
                let value = if second == at { low } else { 1000.0 + second as f64 };
                let counted = counting.count(reading(second, value, 0.5));
                let is_right = match counted {
                    Counted::Lower => second == at,
                    Counted::OnAfter(jump) => second == at + 1 && jump.to.contains(low),
                    other => other == Counted::On && second != at,
                };
                prop_assert!(is_right, "{second}: {counted:?}");
            }
        }
    }

    /// A reading that is too high to be possible is no new height of the counter.
    #[test]
    fn what_the_gate_refuses_has_not_been_counted() {
        let mut signal = Signal::new("counter".into(), VariableId::from_index(0));
        (signal.limits.counts, signal.limits.max_rate) = (true, Some(1.5));
        let mut port = Port::new(Shape::Scalar, &signal, 16);
        for second in 0..40 {
            let value = RawValue::Number(if second % 10 == 9 { 65_535.0 } else { f64::from(second) });
            let now = Time::from_seconds(second.into());
            let observation =
                Observation { signal: SignalId::from_index(0), stamp: now, received: now, value };
            let acceptance = port.accept(&signal, &observation, now).acceptance;
            assert_eq!(acceptance == Acceptance::Newest, second % 10 != 9, "{second}: {acceptance:?}");
        }
    }

    #[test]
    fn what_counts_down_is_no_counter() {
        let mut counting = Counting::default();
        let counted =
            [9.0, 7.0, 5.0, 3.0].map(|value| counting.count(reading(10 - value as usize, value, 0.1)));
        assert!(
            matches!(counted, [Counted::On, Counted::Lower, Counted::Down(_), Counted::Down(_)]),
            "{counted:?}"
        );
    }
}
