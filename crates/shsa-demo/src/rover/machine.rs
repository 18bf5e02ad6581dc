//! The machine and its surroundings: `room -> sensors -> faults -> bus`, and `bus -> avoidance -> robot -> room`.
//!
//! It gets only the messages of the bus from what computes `dmin`, under the name of the need.

use super::avoidance::{Avoidance, Mode};
use super::faults::Fault;
use super::provider::{NEED, lower_bound};
use super::robot::Robot;
use super::room::{Point, Pose, Room};
use super::sensors::{self, Sample, Sensor};
use crate::DemoError;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use shsa_bridge::memory::{MemoryBridge, MemoryBus};
use shsa_bridge::{Bridge, Outgoing, Payload};
use shsa_core::time::{Span, Time};

/// The step of the simulated time.
pub const STEP: Span = Span::from_millis(5);
/// How often the controller decides.
const CONTROL: Span = Span::from_millis(20);
/// The number of messages that may wait for a member of the bus.
pub(super) const INBOX: usize = 64;

/// A robot in a room.
pub(super) struct Machine {
    pub(super) room: Room,
    pub(super) robot: Robot,
    pub(super) avoidance: Avoidance,
    pub(super) faults: Vec<Fault>,
    /// The time of the bus's clock at the beginning.
    origin: Time,
    sensors: Vec<Sensor>,
    /// Samples under way to the bus.
    flying: Vec<Sample>,
    sensor_port: MemoryBridge,
    avoidance_port: MemoryBridge,
}

/// The results of one step of the robot.
pub(super) struct Moved {
    /// The mode of the controller before the step.
    pub(super) before: Mode,
    /// Whether the robot has hit something.
    pub(super) collided: bool,
    /// The driven distance, metres.
    pub(super) driven: f64,
}

impl Machine {
    /// A machine with a start, noise and turns of its own for each seed. It begins at the present time of the bus's clock.
    ///
    /// # Errors
    /// Errors of the bus.
    pub(super) fn new(seed: u64, bus: &MemoryBus) -> Result<Machine, DemoError> {
        let mut avoidance_port = bus.join(INBOX);
        avoidance_port.subscribe(NEED, None)?;
        let room = Room::furnished();
        Ok(Machine {
            robot: Robot::at(start(seed, &room)),
            room,
            avoidance: Avoidance::new(seed),
            faults: Fault::schedule(),
            origin: bus.clock().now(),
            sensors: sensors::all(seed),
            flying: Vec::new(),
            sensor_port: bus.join(INBOX),
            avoidance_port,
        })
    }

    /// The topics of its sensors.
    pub(super) fn topics(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.sensors.iter().map(|sensor| sensor.topic)
    }

    /// Takes measurements; publishes samples that have arrived, in the order of arrival.
    ///
    /// # Errors
    /// Errors of the bus.
    pub(super) fn sense(&mut self, now: Time) -> Result<(), DemoError> {
        for sensor in &mut self.sensors {
            let sample = sensor.sample(now, &self.room, &self.robot);
            let through =
                sample.and_then(|sample| self.faults.iter().try_fold(sample, |s, fault| fault.apply(s)));
            self.flying.extend(through);
        }
        self.flying.sort_by_key(|sample| sample.arrival);
        let arrived = self.flying.partition_point(|sample| sample.arrival <= now);
        for sample in self.flying.drain(..arrived) {
            let stamp = self.origin + (sample.stamp - Time(0));
            let message = Outgoing::new(sample.topic, stamp, Payload::Value(sample.value));
            self.sensor_port.publish(message)?;
        }
        Ok(())
    }

    /// Passes the newest values of the need to the controller, and moves the robot.
    pub(super) fn drive(&mut self, now: Time) -> Moved {
        while let Some(message) = self.avoidance_port.receive() {
            if let Some(dmin) = message.value().and_then(lower_bound) {
                self.avoidance.observe(Time(0) + (message.stamped() - self.origin), dmin);
            }
        }
        let before = self.avoidance.mode;
        let command = self.avoidance.command(now, self.robot.speed, now.0 % CONTROL.0 == 0);
        let from = self.robot.pose.at;
        let collided = self.robot.step(command, &self.room, STEP.seconds());
        let driven = self.robot.pose.at.distance(from);
        if collided {
            self.avoidance.bumped(now);
        }
        Moved { before, collided, driven }
    }
}

/// A random pose with free space around it: that of the seed.
#[must_use]
pub fn start(seed: u64, room: &Room) -> Pose {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(9);
    loop {
        let at = Point { x: random.random_range(0.0..room.width), y: random.random_range(0.0..room.height) };
        if !room.is_solid(at) && room.clearance(at) > 0.6 {
            return Pose { at, heading: random.random_range(-3.1..3.1) };
        }
    }
}
