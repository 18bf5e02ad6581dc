//! Rejects outliers without locking a sensor out for ever.
//!
//! A gate alone cannot tell a jump of a sensor from a jump of the state: it would refuse the truth for ever. So after some
//! rejections in a row the sensor is in conflict with the estimate, and other sensors decide:
//!
//! * Another sensor in conflict agrees with it: both are accepted again, and the covariance widens until they fit.
//! * Other sensors determine what it measures: it stays rejected. The test is the *doubt*, a copy of the estimate that is
//!   uncertain enough for the sensor to fit: other sensors determine the quantity if their measurements draw the doubt back.
//!   Measurements of its change alone do not: a position reckoned from speeds is no witness against a position fix, however
//!   sure the reckoning is of itself.
//! * No sensor decides: the estimate is unknown, until the sensor fits again or another agrees. When the sensor has not counted
//!   for as long as reckoning bears witness ([`Options::reckoned`](super::Options::reckoned)), or never has, the doubt becomes
//!   the estimate, which the sensor fits.
//!
//! Without a gate all measurements count. A sensor that returns after longer than reckoning bears witness, and does not fit,
//! corrects the position, and not the speed that the jump would suggest.
//!
//! So the only sensor of a quantity is rejected for at most that time and its patience. The doubt costs a second step for each
//! moment while a sensor is in conflict.

use super::Fusion;
use super::moment::Past;
use super::window::Window;
use crate::Error;
use crate::matrix::{at, put};
use crate::method::{Innovation, Measurement};
use crate::normal::two_sided;
use shsa_core::time::{Span, Time};

/// This many rejections in a row are no glitch: the doubt begins.
const REPEATED: u32 = 2;
/// Squared standard deviations from the doubt, above which other sensors determine what a sensor in lasting conflict measures: 95
/// % of right measurements are below.
const HELD: f64 = 3.841;
/// A measurement further off than this, in squared standard deviations, does not fit: 99.99 % of right ones do.
const FAR: f64 = 15.137;
/// The variance of the doubt in squared innovations: a rejected measurement is a fifth of a standard deviation off.
const DOUBT: f64 = 25.0;

/// The limits that reject measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gate {
    threshold: f64,
    patience: u32,
}

impl Gate {
    /// Accepts this share of healthy measurements (0.999 is a chi-square of 10.83), and asks other sensors after more than
    /// `patience` rejections in a row.
    #[must_use]
    pub fn new(share: f64, patience: u32) -> Gate {
        Gate { threshold: two_sided(share).powi(2), patience }
    }

    pub(super) fn check(self) -> Result<(), Error> {
        if self.threshold > 0.0 && self.threshold.is_finite() {
            return Ok(());
        }
        Err(Error::Range {
            what: "the threshold of the gate",
            value: self.threshold,
            range: "finite and above 0",
        })
    }

    pub(super) fn threshold(self) -> f64 {
        self.threshold
    }
}

/// The recent record of a sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Watch {
    /// Rejections in a row.
    pub rejections: u32,
    /// Whether the sensor is in conflict and no other sensor decides.
    pub is_undecided: bool,
    /// Rejections since the doubt began.
    doubted: u32,
    /// When the sensor's last measurement counted.
    used: Option<Time>,
    last: Option<Measurement>,
    /// The last innovations that counted.
    window: Window,
}

impl Watch {
    pub(super) fn note(&mut self, innovation: Innovation) {
        self.window.note(innovation);
    }

    /// The mean of the last 16 innovations in its own standard deviations: normal with variance 1 while model and sensor are
    /// right, as innovations are independent then. It shows a slow drift long before the gate. `None` for fewer innovations.
    #[must_use]
    pub fn drift(&self) -> Option<f64> {
        self.window.drift()
    }

    /// Notes a measurement that counts and ends a conflict.
    pub(super) fn accept(&mut self, at: Time) {
        *self = Watch { used: Some(at), window: self.window, ..Watch::default() };
    }

    /// Notes a measurement that counts without a gate.
    pub(super) fn count(&mut self, at: Time) {
        self.used = Some(at);
    }

    /// Ends a conflict of a sensor that does not count for now.
    pub(super) fn excuse(&mut self) {
        *self = Watch { used: self.used, window: self.window, ..Watch::default() };
    }

    pub(super) fn reject(&mut self, measurement: &Measurement) {
        self.rejections = self.rejections.saturating_add(1);
        self.doubted = self.doubted.saturating_add(1);
        self.last = Some(*measurement);
    }

    /// Whether the sensor's last measurement counted longer ago than this, or never.
    fn is_away(&self, at: Time, within: Span) -> bool {
        self.used.is_none_or(|used| at - used > within)
    }
}

impl Past {
    fn in_conflict(&self) -> impl Iterator<Item = &Watch> {
        self.watches.iter().filter(|watch| watch.rejections >= REPEATED)
    }
}

impl Fusion {
    /// Whether a sensor is accepted again after a rejection.
    pub(super) fn reconsider(&mut self, sensor: usize, at: Time, gate: Gate, innovation: Innovation) -> bool {
        let Some(watch) = self.now.watches.get(sensor).copied() else { return false };
        if watch.rejections == REPEATED {
            self.begin_doubt();
        }
        let Some(measurement) = watch.last.filter(|_| watch.rejections > gate.patience) else { return false };
        self.method.save(&mut self.trial);
        // Wide enough for the measurement: its own noise cannot widen, hence twice the apparent factor.
        self.method.widen(2.0 * innovation.normalized_square() / gate.threshold);
        self.update(&measurement);
        if (0..self.now.watches.len()).any(|other| other != sensor && self.agrees(other, gate)) {
            self.now.accept(sensor, at);
            return true;
        }
        let is_taken =
            watch.doubted + REPEATED > gate.patience && self.decide(sensor, at, &measurement, gate);
        if !is_taken {
            self.method.restore(&self.trial);
        }
        is_taken
    }

    /// Whether a sensor fits the doubt, which others have updated, and has been away for long enough: then it is accepted again.
    fn decide(&mut self, sensor: usize, at: Time, measurement: &Measurement, gate: Gate) -> bool {
        self.method.restore(&self.now.doubt);
        let fits = self
            .method
            .innovation(measurement, &self.now.controls)
            .is_none_or(|it| it.contradiction() <= HELD.min(gate.threshold));
        let reckoned = self.options.reckoned();
        let Some(watch) = self.now.watches.get_mut(sensor) else { return false };
        watch.is_undecided = fits;
        if !fits || !watch.is_away(at, reckoned) {
            return false;
        }
        self.update(measurement);
        self.now.accept(sensor, at);
        true
    }

    /// Starts the doubt: a copy of the estimate that is uncertain enough for every sensor in conflict.
    fn begin_doubt(&mut self) {
        self.method.save(&mut self.trial);
        for place in 0..self.now.watches.len() {
            let Some(watch) = self.now.watches.get_mut(place) else { continue };
            watch.doubted = 0;
            let last = watch.last.filter(|_| watch.rejections >= REPEATED);
            last.iter().for_each(|measurement| self.widen_to(measurement, DOUBT));
        }
        self.method.save(&mut self.now.doubt);
        self.now.is_doubted = true;
        self.method.restore(&self.trial);
    }

    /// Widens the estimate for a sensor that returns after longer than reckoning bears witness and does not fit.
    pub(super) fn welcome(&mut self, at: Time, measurement: &Measurement) {
        let used = self.now.watches.get(measurement.sensor).and_then(|watch| watch.used);
        if used.is_some_and(|used| at - used > self.options.reckoned()) {
            let innovation = self.method.innovation(measurement, &self.now.controls);
            if innovation.is_some_and(|it| it.contradiction() > FAR) {
                self.widen_to(measurement, DOUBT);
            }
        }
        self.now.watches.get_mut(measurement.sensor).into_iter().for_each(|watch| watch.count(at));
    }

    /// Widens the estimate so that the variance of an expectation is `times` the square of its innovation.
    ///
    /// The variance of each state grows in proportion to the square of its correction by the measurement, without correlations:
    /// then measurements of one state say nothing about another.
    fn widen_to(&mut self, measurement: &Measurement, times: f64) {
        let Some(innovation) = self.method.innovation(measurement, &self.now.controls) else { return };
        let wanted = times * innovation.value * innovation.value;
        if !self.method.is_gaussian() {
            let factor = wanted / innovation.variance;
            self.method.widen(if factor.is_finite() { factor.max(1.0) } else { 1.0 });
            return;
        }
        self.method.save(&mut self.aside);
        self.method.update(&[*measurement], &self.now.controls);
        for (place, moved) in self.moved.iter_mut().enumerate() {
            let (mean, before) = (self.method.mean().get(place), self.aside.get(place));
            *moved = mean.zip(before).map_or(0.0, |(mean, before)| (mean - before) * (mean - before));
        }
        self.method.restore(&self.aside);
        self.spread_by(1.0);
        let grown = self.method.innovation(measurement, &self.now.controls);
        let own = grown.map_or(0.0, |it| it.variance - innovation.variance);
        let share = wanted / own;
        self.method.restore(&self.aside);
        if share.is_finite() && own > 0.0 {
            self.spread_by(share);
        }
    }

    fn spread_by(&mut self, share: f64) {
        let spread = &mut self.method.gaussian_mut().spread;
        for (place, moved) in self.moved.iter().enumerate() {
            let own = at(spread, place, place);
            put(spread, place, place, own + share * moved);
        }
    }

    /// Predicts the doubt to this moment, or updates it with a measurement that counts. The doubt ends with the last conflict.
    pub(super) fn go_on_doubting(&mut self, elapsed: Span, counted: Option<&Measurement>) {
        if !self.now.is_doubted {
            return;
        }
        if self.now.in_conflict().next().is_none() {
            self.now.is_doubted = false;
            return;
        }
        self.method.save(&mut self.trial);
        self.method.restore(&self.now.doubt);
        match counted {
            Some(measurement) => {
                self.update(measurement);
            }
            None => {
                self.method.predict(elapsed.seconds(), &self.now.controls);
            }
        }
        self.method.save(&mut self.now.doubt);
        self.method.restore(&self.trial);
    }

    /// Whether the last measurement of another sensor in lasting conflict fits now.
    fn agrees(&mut self, other: usize, gate: Gate) -> bool {
        let Some(watch) = self.now.watches.get(other) else { return false };
        let Some(last) = watch.last.filter(|_| watch.rejections >= REPEATED) else { return false };
        let innovation = self.method.innovation(&last, &self.now.controls);
        innovation.is_some_and(|it| it.contradiction() <= gate.threshold)
    }
}
