//! The recorded signals, and all of them at the moments of each.

use crate::curve::Curve;
use crate::learning::lag::Lagged;
use crate::learning::sessions::{Place, Sessions};
use shsa_core::unit::{Dimension, Unit};

/// The most moments at which relations are searched, taken evenly.
const MOST_MOMENTS: usize = 2_000;

/// The end of the part for fits, and the end of the part for the choice of forms, as shares of the time of each session.
const FITTED: f64 = 0.5;
const CHOSEN: f64 = 0.7;

/// Two signals have the same rate when their periods differ by less than this factor.
const SAME_RATE: f64 = 1.2;

/// The values of one signal.
#[derive(Clone, Debug)]
pub struct Signal {
    /// Its name.
    pub name: String,
    /// The unit; `None` where it is unknown.
    pub unit: Option<Unit>,
    /// Times in seconds, in any order, with values in the unit.
    pub points: Vec<(f64, f64)>,
}

/// A part of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// Constants are fitted to this part.
    Fitted,
    /// Forms are chosen by this part.
    Chosen,
    /// This part gives the error of a relation.
    Unseen,
}

impl Part {
    pub(crate) const ALL: [Part; 3] = [Part::Fitted, Part::Chosen, Part::Unseen];

    /// The part at this share of the time.
    pub(crate) fn at(share: f64) -> Part {
        match share {
            share if share < FITTED => Part::Fitted,
            share if share < CHOSEN => Part::Chosen,
            _ => Part::Unseen,
        }
    }
}

/// The moments of a signal, with the values of all signals that are not slower.
#[derive(Debug)]
pub(crate) struct Clock {
    pub(crate) times: Vec<f64>,
    pub(crate) parts: Vec<Part>,
    pub(crate) places: Vec<Place>,
    /// The values of each signal; not a number where it has none; empty for slower signals.
    pub(crate) values: Vec<Vec<f64>>,
}

/// The signals, prepared for the search.
#[derive(Debug)]
pub(crate) struct Seen<'s> {
    pub(crate) signals: &'s [Signal],
    pub(crate) curves: Vec<Curve>,
    pub(crate) clocks: Vec<Clock>,
    /// The clock of each signal.
    clock_of: Vec<usize>,
    /// Each signal with delays, by its clock.
    pub(crate) lagged: Vec<Lagged>,
    /// The time of the sessions in seconds, of which windows and delays are shares.
    pub(crate) duration_s: f64,
}

impl<'s> Seen<'s> {
    /// Of one session. Time and memory: O(signals * moments * rates).
    pub(crate) fn new(signals: &'s [Signal]) -> Seen<'s> {
        Seen::over(signals, &[])
    }

    /// Of sessions that meet at these times, in order, of which each has parts of its own. No times are one session.
    pub(crate) fn over(signals: &'s [Signal], joints: &[f64]) -> Seen<'s> {
        let curves: Vec<Curve> = signals.iter().map(|it| Curve::of_sessions(in_si(it), joints)).collect();
        let sessions = Sessions::new(&curves, joints);
        let mut keepers: Vec<usize> = Vec::new();
        let clock_of: Vec<usize> =
            (0..signals.len()).map(|signal| clock_of(&curves, &mut keepers, signal)).collect();
        let clock = |keeper: &usize| Clock::new(&curves, *keeper, &sessions);
        let clocks: Vec<Clock> = keepers.iter().map(clock).collect();
        let duration_s = sessions.duration_s();
        let lagged = |(curve, clock): (&Curve, &usize)| Lagged::new(curve, &clocks[*clock].times, duration_s);
        let lagged = curves.iter().zip(&clock_of).map(lagged).collect();
        Seen { signals, clocks, clock_of, lagged, duration_s, curves }
    }

    /// Whether two signals have their values at the same moments.
    pub(crate) fn have_one_clock(&self, one: usize, other: usize) -> bool {
        self.clock_of[one] == self.clock_of[other]
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

    /// The dimension of a signal, with angles as plain numbers; `None` when it is unknown.
    pub(crate) fn dimension(&self, signal: usize) -> Option<Dimension> {
        self.signals[signal].unit.as_ref().map(|unit| unit.dimension.without_angle())
    }

    /// Whether two signals may be added: of one dimension, or both unknown.
    pub(crate) fn is_addable(&self, one: usize, other: usize) -> bool {
        self.dimension(one) == self.dimension(other)
    }
}

/// The values in SI units, counted from the zero of the signal's own unit.
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
    fn new(curves: &[Curve], keeper: usize, sessions: &Sessions) -> Clock {
        let own = &curves[keeper];
        let every = own.times().len().div_ceil(MOST_MOMENTS).max(1);
        let times: Vec<f64> = own.times().iter().copied().step_by(every).collect();
        let places: Vec<Place> = times.iter().map(|time| sessions.place(*time)).collect();
        let parts = places.iter().map(|place| Part::at(place.share)).collect();
        let values = |curve: &Curve| {
            if curve.period_s() > SAME_RATE * own.period_s() {
                return Vec::new();
            }
            times.iter().map(|time| curve.read(*time).map_or(f64::NAN, |(value, _)| value)).collect()
        };
        Clock { parts, places, values: curves.iter().map(values).collect(), times }
    }
}
