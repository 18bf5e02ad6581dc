//! What is too far off to be used, without locking a sensor out for ever.
//!
//! A gate alone cannot tell a sensor that jumped from a state that did: it would refuse the truth for ever. So after some
//! rejections in a row the sensor is in conflict with the estimate, and others decide:
//!
//! * Another sensor in conflict agrees with it: both are taken back, and the covariance widens until they fit.
//! * Others that still count hold what it measures (its expectation has not become much less certain): it stays out.
//! * Nothing decides: what is known is unknown, until it fits again or another agrees.

use super::Fusion;
use super::window::Window;
use crate::Error;
use crate::method::{Innovation, Measurement};
use crate::normal::two_sided;

/// By how much the variance of an expectation may grow while others hold it.
const HELD: f64 = 4.0;

/// When a measurement is too far off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gate {
    threshold: f64,
    patience: u32,
}

impl Gate {
    /// Uses this share of healthy measurements (0.999 is a chi-square of 10.83), and asks others after so many rejections in a
    /// row.
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

/// What has been seen of a sensor lately.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Watch {
    /// Rejections in a row.
    pub rejections: u32,
    /// Whether it is in conflict and nothing decides.
    pub is_undecided: bool,
    /// Measurements of others that counted meanwhile.
    others: u32,
    /// The variance of its expectation and itself when the rejections began.
    variance_before: f64,
    last: Option<Measurement>,
    /// The last innovations that counted.
    window: Window,
}

impl Watch {
    pub(super) fn note(&mut self, innovation: Innovation) {
        self.window.note(innovation);
    }

    /// The mean of the last 16 innovations in its own standard deviations: normal with variance 1 while model and sensor are
    /// right, as innovations are independent then. A slow drift shows here long before the gate sees it. `None` of fewer.
    #[must_use]
    pub fn drift(&self) -> Option<f64> {
        self.window.drift()
    }

    pub(super) fn accept(&mut self, is_own: bool) {
        if is_own {
            (self.rejections, self.others, self.is_undecided, self.last) = (0, 0, false, None);
        } else if self.rejections > 0 {
            self.others = self.others.saturating_add(1);
        }
    }

    pub(super) fn reject(&mut self, measurement: &Measurement, innovation: Innovation) {
        if self.rejections == 0 {
            self.variance_before = innovation.variance;
        }
        self.rejections = self.rejections.saturating_add(1);
        self.last = Some(*measurement);
    }

    /// Whether others that count hold what it measures.
    fn is_held(&self, innovation: Innovation) -> bool {
        self.others > 0 && innovation.variance <= HELD * self.variance_before
    }
}

impl Fusion {
    /// Whether a sensor that was rejected again is taken back.
    pub(super) fn reconsider(&mut self, sensor: usize, gate: Gate, innovation: Innovation) -> bool {
        let Some(watch) = self.now.watches.get(sensor).copied() else { return false };
        let Some(measurement) = watch.last.filter(|_| watch.rejections > gate.patience) else { return false };
        self.method.save(&mut self.trial);
        // So wide that the measurement fits: the share of its own noise cannot widen, so twice what a first look says.
        self.method.widen(2.0 * innovation.normalized_square() / gate.threshold);
        self.method.update(&[measurement], &self.now.controls);
        let agrees = (0..self.now.watches.len()).any(|other| other != sensor && self.agrees(other, gate));
        if agrees {
            self.now.accept(sensor);
            return true;
        }
        self.method.restore(&self.trial);
        if let Some(watch) = self.now.watches.get_mut(sensor) {
            watch.is_undecided = !watch.is_held(innovation);
        }
        false
    }

    /// Whether what another sensor in conflict said last fits now.
    fn agrees(&mut self, other: usize, gate: Gate) -> bool {
        let Some(watch) = self.now.watches.get(other) else { return false };
        let Some(last) = watch.last.filter(|_| watch.rejections > 0) else { return false };
        let innovation = self.method.innovation(&last, &self.now.controls);
        innovation.is_some_and(|it| it.normalized_square() <= gate.threshold)
    }
}
