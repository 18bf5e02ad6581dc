//! Fusion of measurements that come late, twice, at different rates or not at all, each at its own time.
//!
//! Every moment with a measurement is kept with the state after it, in a bounded ring. A late measurement is inserted at its
//! moment, and all later moments are computed again. So the estimate is that of a filter with all measurements in the order of
//! time, whatever their order of arrival, gate and watches included (Y. Bar-Shalom 2002, doi:10.1109/TAES.2002.1039398, treats
//! savings). Measurements of one moment, and of moments within 10 us (`cluster`), are stacked in the declared order of their
//! sensors.
//!
//! A measurement costs one step, and one more for each later moment: O(moments). No allocation.

mod verdict;
mod estimate;
mod window;
mod gate;
mod moment;
mod cluster;
mod derived;
mod leave_one_out;

pub use estimate::Estimate;
pub use gate::{Gate, Watch};
pub use leave_one_out::LeaveOneOut;
pub use verdict::{Counts, Verdict};

use crate::Error;
use crate::method::{Innovation, Measurement, Method};
use cluster::{first_cluster, is_close};
use moment::{Moment, Past};
use shsa_core::time::{Span, Time};

/// The settings of a fusion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// How far behind the newest measurement used a late one may be.
    pub horizon: Span,
    /// The number of moments kept, at least 1; where they do not cover the horizon, older measurements are too late, too.
    pub moments: usize,
    /// The gate against outliers; with `None` all measurements count, jointly.
    pub gate: Option<Gate>,
    /// After longer than this without a measurement, the estimate is unknown.
    pub unknown_after: Span,
}

impl Options {
    /// How long a reckoning without a sensor bears witness about that sensor: five times as long as an estimate is given without
    /// any measurement.
    #[must_use]
    pub fn reckoned(&self) -> Span {
        self.unknown_after.times(5)
    }
}

/// A sensor with more rejections in a row than this contradicts the estimate.
const MOST_REJECTIONS: u32 = 3;

/// Where the state before the first moment comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Origin {
    /// The declared estimate, of a given time.
    Given,
    /// The declared estimate, of the first measurement: a late one may be the first.
    First,
    /// A moment that is no longer kept, and accepts no more measurements.
    Moment,
}

/// A method with measurements at their own times.
pub struct Fusion {
    method: Box<dyn Method>,
    options: Options,
    /// The moments in use come first, in the order of time.
    moments: Vec<Moment>,
    count: usize,
    /// The state before the first moment, its time, and where it comes from.
    base: Past,
    base_at: Time,
    origin: Origin,
    initial: Past,
    /// The state of the running computation.
    now: Past,
    masked: Vec<bool>,
    /// The sensors whose errors are those of earlier measurements.
    derived: Vec<bool>,
    counts: Vec<Counts>,
    stack: Vec<Measurement>,
    trial: Vec<f64>,
    /// A copy of the method's memory, and the squared correction of each state by a measurement.
    aside: Vec<f64>,
    moved: Vec<f64>,
}

impl Fusion {
    /// The fusion by a method whose estimate is that of a time, for numbers of sensors and control inputs (all 0 at first).
    ///
    /// # Errors
    /// No moments to keep, or an invalid gate.
    pub fn new(
        method: Box<dyn Method>,
        at: Time,
        sensors: usize,
        controls: usize,
        options: Options,
    ) -> Result<Fusion, Error> {
        if options.moments == 0 {
            return Err(Error::Range { what: "the number of moments", value: 0.0, range: "1 or more" });
        }
        if let Some(gate) = options.gate {
            gate.check()?;
        }
        let mut initial = Past::new(method.memory_len(), sensors, controls);
        method.save(&mut initial.memory);
        let moment = Moment::new(&initial);
        Ok(Fusion {
            moments: vec![moment; options.moments],
            count: 0,
            base: initial.clone(),
            base_at: at,
            origin: Origin::Given,
            now: initial.clone(),
            masked: vec![false; sensors],
            derived: vec![false; sensors],
            counts: vec![Counts::default(); sensors],
            stack: Vec::with_capacity(sensors),
            trial: vec![0.0; method.memory_len()],
            aside: vec![0.0; method.memory_len()],
            moved: vec![0.0; method.mean().len()],
            initial,
            method,
            options,
        })
    }

    /// Sets which sensors are estimates of other filters. Their measurements never make the estimate more certain than they are, whatever
    /// they have in common with each other and with other sensors.
    pub fn set_derived(&mut self, derived: impl Iterator<Item = bool>) {
        self.derived.iter_mut().zip(derived).for_each(|(to, is_derived)| *to = is_derived);
    }

    fn is_derived(&self, sensor: usize) -> bool {
        self.derived.get(sensor).copied().unwrap_or(false)
    }

    /// Takes in a measurement, at its time of validity.
    pub fn measure(&mut self, at: Time, measurement: Measurement) -> Verdict {
        let verdict = self.taken(at, measurement);
        if let Some(counts) = self.counts.get_mut(measurement.sensor) {
            counts.count(verdict);
        }
        verdict
    }

    fn taken(&mut self, at: Time, measurement: Measurement) -> Verdict {
        let Some(is_masked) = self.masked.get(measurement.sensor).copied() else { return Verdict::Rejected };
        if !measurement.value.is_finite() {
            return Verdict::Rejected;
        }
        if self.is_too_late(at) {
            return Verdict::TooLate;
        }
        let Some(place) = self.moment(at) else { return Verdict::TooLate };
        let taken =
            self.moments.get_mut(place).and_then(|moment| moment.measured.get_mut(measurement.sensor));
        match taken {
            Some(taken @ None) => *taken = Some(moment::Taken::new(measurement, is_masked)),
            _ => return Verdict::Duplicate,
        }
        self.replay(place);
        let moment = self.moments.get(place);
        moment.and_then(|moment| moment.verdict(measurement.sensor)).unwrap_or(Verdict::Rejected)
    }

    /// Sets a control input from a time on; ignores an unknown input and a time too far back.
    pub fn control(&mut self, at: Time, control: usize, value: f64) {
        if self.is_too_late(at) || !value.is_finite() {
            return;
        }
        let Some(place) = self.moment(at) else { return };
        let set = self.moments.get_mut(place).and_then(|moment| moment.set.get_mut(control));
        if let Some(set) = set {
            *set = Some(value);
            self.replay(place);
        }
    }

    /// Sets whether a sensor's measurements count from now on; earlier ones stay.
    pub fn mask(&mut self, sensor: usize, is_masked: bool) {
        if let Some(masked) = self.masked.get_mut(sensor) {
            *masked = is_masked;
        }
    }

    /// Restarts with the declared initial estimate, at the time of the first measurement: this time, or that of a late measurement
    /// within the horizon. After a power cycle of a sensor that the states rest on, for example.
    pub fn restart(&mut self, at: Time) {
        self.base.clone_from(&self.initial);
        self.now.clone_from(&self.initial);
        self.method.restore(&self.initial.memory);
        (self.count, self.base_at, self.origin) = (0, at, Origin::First);
    }

    /// Restarts with the state of another fusion of the same method and sensors after its newest moment.
    pub fn begin_as(&mut self, other: &Fusion) {
        self.base.clone_from(other.present());
        self.base.watches.iter_mut().for_each(Watch::excuse);
        self.base.is_doubted = false;
        self.now.clone_from(&self.base);
        self.method.restore(&self.now.memory);
        (self.count, self.base_at, self.origin) = (0, other.at(), Origin::Moment);
    }

    fn is_too_late(&self, at: Time) -> bool {
        let newest = self.present().last_used.unwrap_or(self.base_at);
        let is_before = match self.origin {
            Origin::Given => at < self.base_at,
            Origin::First => false,
            Origin::Moment => at <= self.base_at,
        };
        is_before || at < newest - self.options.horizon
    }

    /// The state after the newest moment.
    fn present(&self) -> &Past {
        let newest = self.count.checked_sub(1).and_then(|place| self.moments.get(place));
        newest.map_or(&self.base, |moment| &moment.after)
    }

    /// The time of the newest moment.
    #[must_use]
    pub fn at(&self) -> Time {
        let newest = self.count.checked_sub(1).and_then(|place| self.moments.get(place));
        newest.map_or(self.base_at, |moment| moment.at)
    }

    /// The place of a moment, which is inserted if new; `None` where the ring is full of later ones.
    fn moment(&mut self, at: Time) -> Option<usize> {
        let used = self.moments.get(..self.count)?;
        let mut place = match used.binary_search_by_key(&at, |moment| moment.at) {
            Ok(place) => return Some(place),
            Err(place) => place,
        };
        if self.count == self.moments.len() {
            let oldest = first_cluster(&self.moments);
            place = place.checked_sub(oldest)?;
            let last = self.moments.get_mut(oldest.checked_sub(1)?)?;
            std::mem::swap(&mut self.base, &mut last.after);
            (self.base_at, self.origin) = (last.at, Origin::Moment);
            self.moments.rotate_left(oldest);
            self.count -= oldest;
        }
        self.moments.get_mut(self.count)?.begin(at);
        self.count += 1;
        self.base_at = self.base_at.min(at);
        self.moments.get_mut(place..self.count)?.rotate_right(1);
        Some(place)
    }

    /// Computes all moments from one on, and those that count as one with it.
    fn replay(&mut self, changed: usize) {
        let used = self.moments.get(..self.count).unwrap_or(&[]);
        let apart = used.windows(2).take(changed).rposition(|pair| !is_close(pair));
        let from = apart.map_or(0, |place| place + 1);
        let before = from.checked_sub(1).and_then(|place| self.moments.get(place));
        let (past, mut at) = before.map_or((&self.base, self.base_at), |moment| (&moment.after, moment.at));
        self.now.clone_from(past);
        self.method.restore(&self.now.memory);
        let mut moments = std::mem::take(&mut self.moments);
        let mut rest = moments.get_mut(from..self.count).unwrap_or(&mut []);
        while let Some((cluster, later)) = rest.split_at_mut_checked(first_cluster(rest))
            && let Some(newest) = cluster.last().map(|moment| moment.at)
        {
            self.step(cluster, newest - at);
            (rest, at) = (later, newest);
        }
        self.moments = moments;
    }

    /// The estimate of a moment, predicted from the newest measurement. `None` after too long without a measurement, without a
    /// value of the model, or during an undecided conflict. An earlier moment has the estimate of the newest one.
    pub fn estimate(&mut self, at: Time) -> Option<Estimate<'_>> {
        if !self.is_known(at) {
            return None;
        }
        let elapsed = at - self.at();
        self.now.clone_from(match self.count.checked_sub(1).and_then(|place| self.moments.get(place)) {
            Some(moment) => &moment.after,
            None => &self.base,
        });
        self.method.restore(&self.now.memory);
        let is_there = elapsed <= Span::ZERO || self.method.predict(elapsed.seconds(), &self.now.controls);
        is_there.then(|| self.told())
    }

    fn told(&self) -> Estimate<'_> {
        Estimate { mean: self.method.mean(), spread: self.method.spread(), bias: self.method.bias() }
    }

    /// The newest moment before a time, and the estimate after it; `None` where none is kept. Time: linear in the moments after it.
    pub fn estimate_before(&mut self, at: Time) -> Option<(Time, Estimate<'_>)> {
        let used = self.moments.get(..self.count)?;
        let found = used.iter().rev().find(|moment| moment.at < at && moment.is_newest_of_cluster)?;
        self.method.restore(&found.after.memory);
        Some((found.at, self.told()))
    }

    /// Whether a moment has an estimate.
    #[must_use]
    pub fn is_known(&self, at: Time) -> bool {
        let present = self.present();
        let since = present.last_used.unwrap_or(self.base_at);
        !present.is_lost && !present.is_doubtful() && at - since <= self.options.unknown_after
    }

    /// Whether the estimate is unknown because of an undecided conflict of a sensor.
    #[must_use]
    pub fn is_undecided(&self) -> bool {
        self.present().is_doubtful()
    }

    /// The last innovation of a sensor, and its time: for a sensor that counts against the prediction, for a masked one against
    /// the estimate by all others.
    #[must_use]
    pub fn innovation(&self, sensor: usize) -> Option<(Time, Innovation)> {
        let used = self.moments.get(..self.count)?;
        used.iter()
            .rev()
            .find_map(|moment| Some((moment.at, moment.measured.get(sensor)?.as_ref()?.innovation?)))
    }

    /// Whether the present estimate fits a measurement of this moment, up to this square of standard deviations.
    pub fn fits(&mut self, measurement: &Measurement, limit: f64) -> bool {
        let innovation = self.method.innovation(measurement, &self.now.controls);
        innovation.is_some_and(|it| it.contradiction() <= limit)
    }

    /// The recent record of a sensor.
    #[must_use]
    pub fn watch(&self, sensor: usize) -> Option<&Watch> {
        self.present().watches.get(sensor)
    }

    /// Whether the sensors that count are consistent: none is rejected again and again, and none drifts by more than this many
    /// standard deviations.
    #[must_use]
    pub fn is_consistent(&self, deviations: f64) -> bool {
        let counting = self.present().watches.iter().zip(&self.masked).filter(|(_, is_masked)| !**is_masked);
        let is_far = |watch: &Watch| watch.drift().is_some_and(|drift| drift.abs() > deviations);
        !counting.map(|(watch, _)| watch).any(|watch| watch.rejections > MOST_REJECTIONS || is_far(watch))
    }

    /// The counts of a sensor's measurements.
    #[must_use]
    pub fn counts(&self, sensor: usize) -> Option<Counts> {
        self.counts.get(sensor).copied()
    }
}

#[cfg(test)]
mod tests;
