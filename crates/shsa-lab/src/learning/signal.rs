//! Signals as they were recorded, and all of them at the moments of each.

use crate::curve::Curve;
use shsa_core::unit::{Dimension, Unit};

/// Relations are looked for at no more moments than this, taken evenly.
const MOST_MOMENTS: usize = 2_000;

/// Where the part ends that numbers are fitted to, and the one that forms are chosen with, as shares of the time.
const FITTED: f64 = 0.5;
const CHOSEN: f64 = 0.7;

/// Two signals are of one rate when their periods differ by less than this.
const SAME_RATE: f64 = 1.2;

/// What one signal said.
#[derive(Clone, Debug)]
pub struct Signal {
    /// Its name.
    pub name: String,
    /// What its numbers count; `None` where nobody has said.
    pub unit: Option<Unit>,
    /// Times in seconds, in any order, and values in its unit.
    pub points: Vec<(f64, f64)>,
}

/// The part of a recording that a moment lies in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// Numbers are fitted to it.
    Fitted,
    /// Forms are chosen with it.
    Chosen,
    /// It tells how wrong a relation is.
    Unseen,
}

impl Part {
    pub(crate) const ALL: [Part; 3] = [Part::Fitted, Part::Chosen, Part::Unseen];

    /// The part that holds what comes after this share of the time.
    pub(crate) fn at(share: f64) -> Part {
        match share {
            share if share < FITTED => Part::Fitted,
            share if share < CHOSEN => Part::Chosen,
            _ => Part::Unseen,
        }
    }
}

/// The moments of a signal, with what every signal that is not slower says at them.
#[derive(Debug)]
pub(crate) struct Clock {
    pub(crate) times: Vec<f64>,
    pub(crate) parts: Vec<Part>,
    /// Of each signal; not a number where it says nothing; empty of signals that are slower.
    pub(crate) values: Vec<Vec<f64>>,
}

/// Signals, prepared.
#[derive(Debug)]
pub(crate) struct Seen<'s> {
    pub(crate) signals: &'s [Signal],
    pub(crate) curves: Vec<Curve>,
    pub(crate) clocks: Vec<Clock>,
    /// The clock of each signal.
    clock_of: Vec<usize>,
    /// From the first to the last moment, in seconds.
    pub(crate) duration_s: f64,
}

impl<'s> Seen<'s> {
    /// Time and memory: O(signals * moments * rates).
    pub(crate) fn new(signals: &'s [Signal]) -> Seen<'s> {
        let curves: Vec<Curve> = signals.iter().map(|it| Curve::new(in_si(it))).collect();
        let ends = curves.iter().filter_map(|it| it.times().first().zip(it.times().last()));
        let (start, end) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), (first, last)| {
            (lo.min(*first), hi.max(*last))
        });
        let mut keepers: Vec<usize> = Vec::new();
        let clock_of = (0..signals.len()).map(|signal| clock_of(&curves, &mut keepers, signal)).collect();
        let clock = |keeper: &usize| Clock::new(&curves, *keeper, start, end);
        let clocks = keepers.iter().map(clock).collect();
        Seen { signals, clocks, clock_of, duration_s: (end - start).max(0.0), curves }
    }

    /// The clock of the slowest of some signals.
    pub(crate) fn slowest(&self, among: impl IntoIterator<Item = usize>) -> &Clock {
        let slowest =
            among.into_iter().max_by(|one, other| self.period_s(*one).total_cmp(&self.period_s(*other)));
        &self.clocks[self.clock_of[slowest.unwrap_or(0)]]
    }

    pub(crate) fn period_s(&self, signal: usize) -> f64 {
        self.curves[signal].period_s()
    }

    /// What a signal's numbers count, with angles as plain numbers; `None` when it is not known.
    pub(crate) fn dimension(&self, signal: usize) -> Option<Dimension> {
        self.signals[signal].unit.as_ref().map(|unit| unit.dimension.without_angle())
    }

    /// Whether two signals may be added: of one dimension, or both unknown.
    pub(crate) fn is_addable(&self, one: usize, other: usize) -> bool {
        self.dimension(one) == self.dimension(other)
    }
}

/// Its values in SI units, counted from its own zero.
fn in_si(signal: &Signal) -> Vec<(f64, f64)> {
    let scale = signal.unit.as_ref().map_or(1.0, |unit| unit.scale);
    let finite = signal.points.iter().filter(|(time, value)| time.is_finite() && value.is_finite());
    finite.map(|(time, value)| (*time, value * scale)).collect()
}

/// The clock of a signal: that of an earlier one with the same times, or its own.
fn clock_of(curves: &[Curve], keepers: &mut Vec<usize>, signal: usize) -> usize {
    let times = curves[signal].times();
    let known = keepers.iter().position(|keeper| curves[*keeper].times() == times);
    known.unwrap_or_else(|| {
        keepers.push(signal);
        keepers.len() - 1
    })
}

impl Clock {
    fn new(curves: &[Curve], keeper: usize, start: f64, end: f64) -> Clock {
        let own = &curves[keeper];
        let every = own.times().len().div_ceil(MOST_MOMENTS).max(1);
        let times: Vec<f64> = own.times().iter().copied().step_by(every).collect();
        let part = |time: &f64| Part::at((time - start) / (end - start));
        let values = |curve: &Curve| {
            if curve.period_s() > SAME_RATE * own.period_s() {
                return Vec::new();
            }
            times.iter().map(|time| curve.read(*time).map_or(f64::NAN, |(value, _)| value)).collect()
        };
        Clock { parts: times.iter().map(part).collect(), values: curves.iter().map(values).collect(), times }
    }
}
