//! Keeps readings: as values within their errors, unwrapped, counted, measured by those before.

use super::counting::Counted;
use super::{LONGEST_VECTOR, Port, Scan, VECTORS};
use crate::alignment::gate::{Gate, Measured};
use crate::alignment::history::Sample;
use crate::alignment::reception::{Acceptance, Defect};
use crate::circle;
use crate::interval::Interval;
use crate::knowledge::{Shape, Signal};
use crate::observation::RawValue;
use crate::time::{Span, Validity};
use alloc::vec::Vec;

impl Port {
    #[inline]
    pub(super) fn keep(&mut self, signal: &Signal, value: &RawValue, validity: Validity) -> Acceptance {
        let bounds = match (value, self.shape) {
            (RawValue::Vector(elements), Shape::Vector) => return self.keep_scan(signal, elements, validity),
            (RawValue::Vector(_), Shape::Scalar) | (_, Shape::Vector) => {
                return Acceptance::Invalid(Defect::Shape);
            }
            (&RawValue::Number(number), _) => (number, number),
            (&RawValue::Interval { lo, hi }, _) => (lo, hi),
        };
        self.keep_scalar(signal, bounds, validity)
    }

    #[inline]
    fn keep_scalar(&mut self, signal: &Signal, (lo, hi): (f64, f64), validity: Validity) -> Acceptance {
        let value = signal.enclose_bounds(lo, hi);
        if value.is_empty() || !value.is_bounded() {
            return Acceptance::Invalid(defect(lo, hi));
        }
        if !value.overlaps(self.range) {
            return Acceptance::OutOfRange(value);
        }
        let value = self.turn.map_or(value, |turn| self.unwrapped(value, validity, turn));
        let sample = Sample { validity, value };
        if signal.holds && self.is_repeated(signal, sample) {
            return Acceptance::Repeated;
        }
        if self.counting.is_some() { self.keep_counted(sample) } else { self.keep_measured(sample) }
    }

    #[inline]
    fn keep_measured(&mut self, sample: Sample) -> Acceptance {
        match self.gate.measure(sample) {
            Measured::Possible => self.scalars.push(sample),
            Measured::TooFast(jump) => Acceptance::TooFast(jump),
            Measured::Doubtful => Acceptance::Doubtful,
            Measured::Refuting(jump) => match self.scalars.push(sample) {
                Acceptance::Newest => Acceptance::Refuting(jump),
                other => other,
            },
            Measured::Confirming(doubt) => {
                self.scalars.push(doubt);
                self.scalars.push(sample)
            }
        }
    }

    /// Keeps a reading of a counter. What the gate refuses has not been counted.
    #[inline(never)]
    fn keep_counted(&mut self, sample: Sample) -> Acceptance {
        let Some(mut counting) = self.counting else { return self.keep_measured(sample) };
        let counted = counting.count(sample);
        let acceptance = match counted {
            Counted::On => self.keep_measured(sample),
            Counted::OnAfter(jump) => match self.keep_measured(sample) {
                Acceptance::Newest => Acceptance::Refuting(jump),
                other => other,
            },
            Counted::Lower => Acceptance::Doubtful,
            Counted::Down(jump) => Acceptance::TooFast(jump),
            Counted::Old => Acceptance::Dropped,
            Counted::Anew(first) => {
                let last = self.scalars.newest(0).map(|last| last.value);
                self.scalars.clear();
                self.gate.inherit(Gate::default());
                self.keep_measured(first);
                self.keep_measured(sample);
                Acceptance::Anew { last: last.unwrap_or(first.value), first: first.value }
            }
        };
        if acceptance.is_kept() || !matches!(counted, Counted::On | Counted::OnAfter(_)) {
            self.counting = Some(counting);
        }
        acceptance
    }

    /// Whether a reading repeats the standing value before the next answer is due: then the reading is no evidence about its
    /// own moment.
    fn is_repeated(&self, signal: &Signal, sample: Sample) -> bool {
        let since = self.scalars.newest(0).filter(|newest| newest.value == sample.value);
        let since = since.map(|newest| sample.validity.to - newest.validity.to);
        since.is_some_and(|since| since > Span::ZERO && signal.period().is_none_or(|period| since < period))
    }

    /// A reading of what wraps, shifted by whole turns to what was kept before it.
    #[inline(never)]
    fn unwrapped(&self, value: Interval, validity: Validity, turn: f64) -> Interval {
        let before = self.scalars.before(validity);
        before.map_or(value, |kept| circle::nearest(value, kept.value, turn))
    }

    #[inline(never)]
    fn keep_scan(&mut self, signal: &Signal, elements: &[f64], validity: Validity) -> Acceptance {
        if elements.is_empty() || elements.len() > LONGEST_VECTOR {
            return Acceptance::Invalid(Defect::Shape);
        }
        if elements.iter().all(|element| element.is_nan()) {
            return Acceptance::Invalid(Defect::NotANumber);
        }
        match self.scans.last().map(|newest| newest.validity.to) {
            Some(newest) if newest == validity.to => return Acceptance::Duplicate,
            Some(newest) if newest > validity.to => return Acceptance::Dropped,
            _ => {}
        }
        let mut scan = if self.scans.len() < VECTORS {
            Scan { validity, elements: Vec::with_capacity(elements.len()) }
        } else {
            self.scans.remove(0)
        };
        scan.validity = validity;
        scan.elements.clear();
        let any = |element: f64| enclose_element(signal, element);
        match signal.plain_error() {
            // The most frequent case. The signal's settings are read once, not for each element.
            Some(error) => scan.elements.extend(elements.iter().map(|&element| {
                let is_finite = element.abs() < f64::INFINITY;
                if is_finite { Interval::new(element + error.lo, element + error.hi) } else { any(element) }
            })),
            None => scan.elements.extend(elements.iter().map(|&element| any(element))),
        }
        self.scans.push(scan);
        Acceptance::Newest
    }
}

/// Why two bounds enclose no value.
fn defect(lo: f64, hi: f64) -> Defect {
    match (lo, hi) {
        _ if lo.is_nan() || hi.is_nan() => Defect::NotANumber,
        _ if lo.is_finite() && hi.is_finite() && lo > hi => Defect::Bounds,
        _ => Defect::Infinite,
    }
}

/// An element of a scan. Range sensors report infinity when nothing is near: it counts as beyond every number. Not-a-number is no
/// value.
fn enclose_element(signal: &Signal, element: f64) -> Interval {
    let beyond = Interval::new(f64::MAX, f64::INFINITY);
    match signal.scaling {
        _ if element != f64::INFINITY => signal.enclose(element),
        Some(scaling) if scaling.scale < 0.0 => -beyond,
        _ => beyond,
    }
}
