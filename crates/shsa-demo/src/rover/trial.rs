//! A trial: the robot and what computes its `dmin`, in simulated time, measured against the truth.

use super::avoidance::Mode;
use super::faults::Fault;
use super::healed::{HealedNode, Settings};
use super::machine::{INBOX, Machine, Moved, STEP};
use super::provider::{LidarNode, NEED, Provided, Provider};
use super::robot::Robot;
use super::room::Room;
use super::score::Score;
use super::sensors;
use crate::DemoError;
use crate::healer::Decision;
use crate::trial::Provision;
use shsa_bridge::memory::{MemoryBridge, MemoryBus};
use shsa_bridge::{Bridge, Clock, Message, Outgoing, Payload};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;

/// Something worth telling.
#[derive(Clone, Debug, PartialEq)]
pub enum Happening {
    /// A fault begins.
    FaultBegins(Fault),
    /// A fault ends before the trial does.
    FaultEnds(Fault),
    /// The engine has decided something.
    Decided(Decision),
    /// The robot has run into an obstacle.
    Collided,
    /// The robot has stopped before an obstacle, this many metres from it.
    StoppedBefore(f64),
    /// The robot stands still, as there is no fresh `dmin`.
    StoppedBlind,
}

/// The present state of a trial.
#[derive(Clone, Debug)]
pub struct View<'a> {
    /// The simulated time since the beginning.
    pub now: Time,
    /// The room.
    pub room: &'a Room,
    /// The robot in it.
    pub robot: &'a Robot,
    /// The activity of its controller.
    pub mode: Mode,
    /// The true `dmin`, metres.
    pub true_dmin: f64,
    /// How often the robot has run into something.
    pub collisions: u32,
    /// The source of `dmin`.
    pub source: String,
}

/// A robot, what computes its `dmin`, and an observer. The same seed and provision give the same trial.
///
/// # Example
/// ```
/// use shsa_demo::Provision;
/// use shsa_demo::rover::{Happening, Trial};
///
/// let mut trial = Trial::new(1, Provision::Healed)?;
/// let mut decisions = 0;
/// while trial.now().seconds() < 15.0 {
///     let happened = trial.step()?;
///     decisions += happened.iter().filter(|it| matches!(it, Happening::Decided(_))).count();
/// }
/// // The lidar has been silent since second 12.
/// assert!(decisions > 0 && trial.finish().collisions() == 0);
/// # Ok::<(), shsa_demo::DemoError>(())
/// ```
pub struct Trial {
    now: Time,
    bus: MemoryBus,
    machine: Machine,
    provider: Box<dyn Provider>,
    provider_port: MemoryBridge,
    observer_port: MemoryBridge,
    score: Score,
}

impl Trial {
    /// The end of a whole trial: it has two faults. It can be driven beyond it; the faults come again every minute.
    pub const END: Time = Time(60_000_000_000);

    /// A trial with a start, noise and turns of its own for each seed.
    ///
    /// # Errors
    /// [`DemoError::Model`] when the model that is compiled in has errors.
    pub fn new(seed: u64, provision: Provision) -> Result<Trial, DemoError> {
        match provision {
            Provision::Healed => Trial::healed(seed, &Settings::default()),
            Provision::SensorsAlone => Trial::of(seed, Box::new(LidarNode::default())),
        }
    }

    /// The same trial, healed with other settings.
    ///
    /// # Errors
    /// [`DemoError::Model`] when their model has errors.
    pub fn healed(seed: u64, settings: &Settings) -> Result<Trial, DemoError> {
        Trial::of(seed, Box::new(HealedNode::new(settings)?))
    }

    fn of(seed: u64, provider: Box<dyn Provider>) -> Result<Trial, DemoError> {
        let bus = MemoryBus::new(Clock::manual());
        let machine = Machine::new(seed, &bus)?;
        let [mut provider_port, mut observer_port] = [(); 2].map(|()| bus.join(INBOX));
        machine.topics().chain([NEED]).try_for_each(|topic| observer_port.subscribe(topic, None))?;
        provider.topics().iter().try_for_each(|topic| provider_port.subscribe(topic, None))?;
        let (now, score) = (Time(0), Score::new(&machine.faults));
        Ok(Trial { now, bus, machine, provider, provider_port, observer_port, score })
    }

    /// The simulated time since the beginning.
    #[must_use]
    pub fn now(&self) -> Time {
        self.now
    }

    /// Goes on by 5 ms of simulated time; returns what has happened, in this order.
    ///
    /// # Errors
    /// Errors of the bus.
    pub fn step(&mut self) -> Result<Vec<Happening>, DemoError> {
        self.now = self.now + STEP;
        self.bus.clock().set(self.now);
        self.score.truth(self.now, sensors::true_dmin(&self.machine.room, &self.machine.robot));
        let mut happened = self.faults();
        self.machine.sense(self.now)?;
        self.provide(&mut happened)?;
        let moved = self.machine.drive(self.now);
        self.score.moved(moved.driven, self.machine.robot.clearance(&self.machine.room));
        happened.extend(self.action(&moved));
        Ok(happened)
    }

    /// The next message of the bus that was not received yet: a sensor's, or a `dmin`. Of each topic, 64 wait at the most.
    pub fn receive(&mut self) -> Option<Message> {
        self.observer_port.receive()
    }

    /// The present state.
    #[must_use]
    pub fn view(&self) -> View<'_> {
        let Machine { room, robot, avoidance, .. } = &self.machine;
        View {
            now: self.now,
            room,
            robot,
            mode: avoidance.mode,
            true_dmin: sensors::true_dmin(room, robot),
            collisions: self.score.collisions(),
            source: self.provider.source(),
        }
    }

    /// Ends the trial; a gap without `dmin` that is still open counts, too.
    #[must_use]
    pub fn finish(mut self) -> Score {
        self.score.close_gap();
        self.score
    }

    fn faults(&self) -> Vec<Happening> {
        let happening = |fault: &Fault| match self.now {
            now if now == fault.from => Some(Happening::FaultBegins(*fault)),
            now if now == fault.to && now < Trial::END => Some(Happening::FaultEnds(*fault)),
            _ => None,
        };
        self.machine.faults.iter().filter_map(happening).collect()
    }

    fn provide(&mut self, happened: &mut Vec<Happening>) -> Result<(), DemoError> {
        while let Some(message) = self.provider_port.receive() {
            self.provider.observe(&message);
        }
        self.provider.tick(self.now);
        while let Some(provided) = self.provider.poll() {
            match provided {
                Provided::Dmin { stamp, value } => self.publish(stamp, value)?,
                Provided::Decision(decision) => {
                    self.score.decided(&decision);
                    happened.push(Happening::Decided(decision));
                }
            }
        }
        Ok(())
    }

    fn publish(&mut self, stamp: Time, value: RawValue) -> Result<(), DemoError> {
        if let Some(middle) = middle(&value) {
            self.score.published(stamp, middle);
        }
        Ok(self.provider_port.publish(Outgoing::new(NEED, stamp, Payload::Value(value)))?)
    }

    /// The robot's action, if it is worth telling.
    fn action(&mut self, moved: &Moved) -> Option<Happening> {
        let (before, after) = (moved.before, self.machine.avoidance.mode);
        if moved.collided {
            self.score.collision();
            return Some(Happening::Collided);
        }
        if before == Mode::Brake && after == Mode::Turn {
            self.score.stops += 1;
            return Some(Happening::StoppedBefore(self.machine.robot.clearance(&self.machine.room)));
        }
        (before != after && after == Mode::Blind).then_some(Happening::StoppedBlind)
    }
}

/// The midpoint of a published `dmin`; `None` for a list.
fn middle(value: &RawValue) -> Option<f64> {
    match *value {
        RawValue::Number(dmin) => Some(dmin),
        RawValue::Interval { lo, hi } => Some((lo + hi) / 2.0),
        RawValue::Vector(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The summary of a whole trial, as JSON.
    fn summary(seed: u64, provision: Provision) -> serde_json::Value {
        let mut trial = Trial::new(seed, provision).unwrap();
        while trial.now() < Trial::END {
            trial.step().unwrap();
        }
        trial.finish().json(seed, provision)
    }

    #[test]
    fn a_run_repeats_from_its_seed() {
        assert_eq!(summary(5, Provision::Healed), summary(5, Provision::Healed));
        assert_ne!(summary(5, Provision::SensorsAlone), summary(6, Provision::SensorsAlone));
    }

    #[test]
    fn without_shsa_the_robot_stands_blind_and_later_crashes() {
        for seed in 0..20 {
            let summary = summary(seed, Provision::SensorsAlone);
            let [silent, spoofed] = [0, 1].map(|fault| &summary["faults"][fault]);
            assert!(silent["longest_gap_s"].as_f64().unwrap() > 11.9, "seed {seed}: {summary}");
            assert_eq!(silent["collisions"], 0, "seed {seed}: {summary}");
            assert!(spoofed["collisions"].as_u64().unwrap() > 0, "seed {seed}: {summary}");
            assert_eq!(spoofed["collisions"], summary["collisions"], "seed {seed}: {summary}");
        }
    }

    #[test]
    fn with_shsa_the_lidar_is_named_dmin_stays_right_and_nothing_is_hit() {
        for seed in 0..20 {
            let summary = summary(seed, Provision::Healed);
            let number = |key: &str| summary[key].as_f64().unwrap();
            for fault in summary["faults"].as_array().unwrap() {
                let within = |key: &str| fault[key].as_f64().is_some_and(|seconds| seconds < 0.6);
                assert!(within("detected_after_s") && within("healed_after_s"), "seed {seed}: {summary}");
            }
            assert!(number("longest_gap_s") <= 0.3, "seed {seed}: {summary}");
            assert!(number("worst_error_m") < 0.15, "seed {seed}: {summary}");
            assert_eq!(number("collisions") + number("false_alarms"), 0.0, "seed {seed}: {summary}");
        }
    }
}
