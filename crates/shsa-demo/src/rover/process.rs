//! The rover as separate programs on a bus, as in Fig. 1.9 of the thesis: the world, each sensor, the emergency stop, the
//! tele-operation; and an attacker, who sends scans between the true ones.
//!
//! Messages are JSON. Those of the lidar, the sonar ring and the depth camera carry the time of the measurement as `header.stamp`, as
//! messages of ROS do.

use super::avoidance::Avoidance;
use super::machine::{self, STEP};
use super::provider::NEED;
use super::robot::{Command, Robot};
use super::room::{Point, Pose, Room};
use super::sensors::{self, DEPTH, LIDAR, ODOMETRY, SONAR, Sample, Sensor, true_dmin};
use crate::DemoError;
use serde_json::{Value, json};
use shsa_bridge::{Bridge, Outgoing, Payload};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Where the robot is: x and y in m, the heading in rad, the speed in m/s. It stands for the world that sensors look at.
pub const POSE: &str = "/world/pose";
/// The true distance of the nearest obstacle in m, and how often the robot has hit one.
pub const TRUTH: &str = "/world/truth";
/// The command to the drive: speed in m/s, turn rate in rad/s.
pub const COMMAND: &str = "/drive/command";
/// How fast the operator wants to drive, in m/s.
pub const WISH: &str = "/teleoperation/speed";

/// The longest pause between two looks at the clock.
const TICK: Duration = Duration::from_millis(4);
/// How often the pose is published.
const POSES: Span = Span::from_millis(20);
/// A drive that gets no command for this long stops.
const COMMAND_AGE: Span = Span::from_millis(300);
/// How often the emergency stop decides, and how often the operator's wish is sent.
const CONTROL: Span = Span::from_millis(20);
const WISHES: Span = Span::from_millis(100);
/// The period of the attacker's scans, and the distance that they report, metres.
const ATTACK: Span = Span::from_millis(10);
const ATTACK_M: f64 = 3.0;

/// A program of the rover.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The robot and the room: moves as commanded.
    World,
    /// The lidar.
    Lidar,
    /// The sonar ring.
    Sonar,
    /// The depth camera.
    Depth,
    /// The odometry.
    Odometry,
    /// Drives about, and stops before obstacles: the consumer of the need.
    Stop,
    /// Says how fast to drive.
    Teleoperation,
    /// The smallest distance of each scan of the lidar under the name of the need: what there is without `shsa`.
    LidarAlone,
    /// Sends scans of 3 m under the name of the lidar, 100 a second.
    Attacker,
}

/// What a program does with messages, and as time passes. `now` counts from its start.
trait Process {
    fn topics(&self) -> Vec<&'static str>;
    fn observe(&mut self, now: Time, topic: &str, content: &Value);
    /// Sends what is due, as topics and contents; `stamp` is the present moment as in `header.stamp`.
    fn step(&mut self, now: Time, stamp: &Value, send: &mut dyn FnMut(&'static str, Value));
}

/// Runs a program on a bus, in real time, until `stop` is set.
///
/// # Errors
/// Errors of the bus.
pub fn run(part: Part, seed: u64, bus: &mut dyn Bridge, stop: &AtomicBool) -> Result<(), DemoError> {
    let mut process = process(part, seed);
    for topic in process.topics() {
        bus.subscribe(topic, None)?;
    }
    let origin = bus.inbox().clock().now();
    let mut sent = Vec::new();
    while !stop.load(Ordering::Acquire) {
        bus.inbox().wait(TICK);
        let time = bus.inbox().clock().now();
        let now = Time(0) + (time - origin);
        while let Some(message) = bus.receive() {
            let Payload::Bytes(bytes) = &message.payload else { continue };
            if let Ok(content) = serde_json::from_slice(bytes) {
                process.observe(now, &message.topic, &content);
            }
        }
        let stamp = json!({ "sec": time.0 / 1_000_000_000, "nanosec": time.0 % 1_000_000_000 });
        process.step(now, &stamp, &mut |topic, content| sent.push((topic, content.to_string())));
        for (topic, text) in sent.drain(..) {
            bus.publish(Outgoing::new(topic, time, Payload::Bytes(text.into())))?;
        }
        bus.flush();
    }
    Ok(())
}

fn process(part: Part, seed: u64) -> Box<dyn Process> {
    let sensor = |topic| Box::new(Sensing::new(topic, seed)) as Box<dyn Process>;
    match part {
        Part::World => Box::new(World::new(seed)),
        Part::Lidar => sensor(LIDAR),
        Part::Sonar => sensor(SONAR),
        Part::Depth => sensor(DEPTH),
        Part::Odometry => sensor(ODOMETRY),
        Part::Stop => Box::new(Stop::new(seed)),
        Part::Teleoperation => Box::new(Periodic::teleoperation()),
        Part::LidarAlone => Box::new(LidarAlone { nearest: None }),
        Part::Attacker => Box::new(Periodic::attacker()),
    }
}

fn numbers(content: &Value) -> Vec<f64> {
    content.as_array().into_iter().flatten().filter_map(Value::as_f64).collect()
}

/// Whether something is due; sets the next time.
fn is_due(due: &mut Time, now: Time, period: Span) -> bool {
    let is_due = now >= *due;
    if is_due {
        *due = (*due + period).max(now);
    }
    is_due
}

struct World {
    room: Room,
    robot: Robot,
    command: Command,
    commanded: Time,
    /// Until when the robot has moved, and when its pose is due.
    moved: Time,
    due: Time,
    collisions: u32,
}

impl World {
    fn new(seed: u64) -> World {
        let room = Room::furnished();
        let robot = Robot::at(machine::start(seed, &room));
        let (command, commanded) = (Command::default(), Time::MIN);
        World { room, robot, command, commanded, moved: Time(0), due: Time(0), collisions: 0 }
    }
}

impl Process for World {
    fn topics(&self) -> Vec<&'static str> {
        vec![COMMAND]
    }

    fn observe(&mut self, now: Time, _: &str, content: &Value) {
        if let [speed, turn_rate] = numbers(content)[..] {
            (self.command, self.commanded) = (Command { speed, turn_rate }, now);
        }
    }

    fn step(&mut self, now: Time, _: &Value, send: &mut dyn FnMut(&'static str, Value)) {
        while self.moved + STEP <= now {
            self.moved = self.moved + STEP;
            let is_fresh = self.moved <= self.commanded + COMMAND_AGE;
            let command = if is_fresh { self.command } else { Command::default() };
            self.collisions += u32::from(self.robot.step(command, &self.room, STEP.seconds()));
        }
        if is_due(&mut self.due, now, POSES) {
            let Robot { pose, speed, .. } = &self.robot;
            send(POSE, json!([pose.at.x, pose.at.y, pose.heading, speed]));
            let dmin_m = true_dmin(&self.room, &self.robot);
            send(TRUTH, json!({ "dmin_m": dmin_m, "collisions": self.collisions }));
        }
    }
}

/// A sensor that looks at the world.
struct Sensing {
    room: Room,
    robot: Option<Robot>,
    sensor: Option<Sensor>,
    flying: Vec<(Sample, Value)>,
}

impl Sensing {
    fn new(topic: &str, seed: u64) -> Sensing {
        let sensor = sensors::all(seed).into_iter().find(|sensor| sensor.topic == topic);
        Sensing { room: Room::furnished(), robot: None, sensor, flying: Vec::new() }
    }
}

impl Process for Sensing {
    fn topics(&self) -> Vec<&'static str> {
        vec![POSE]
    }

    fn observe(&mut self, _: Time, _: &str, content: &Value) {
        if let [x, y, heading, speed] = numbers(content)[..] {
            let mut robot = Robot::at(Pose { at: Point { x, y }, heading });
            robot.speed = speed;
            self.robot = Some(robot);
        }
    }

    fn step(&mut self, now: Time, stamp: &Value, send: &mut dyn FnMut(&'static str, Value)) {
        if let (Some(sensor), Some(robot)) = (&mut self.sensor, &self.robot) {
            self.flying.extend(sensor.sample(now, &self.room, robot).map(|sample| (sample, stamp.clone())));
        }
        let arrived = self.flying.partition_point(|(sample, _)| sample.arrival <= now);
        for (sample, stamp) in self.flying.drain(..arrived) {
            let field = if sample.topic == DEPTH { "data" } else { "ranges" };
            send(
                sample.topic,
                match sample.value {
                    RawValue::Vector(values) => json!({ "header": { "stamp": stamp }, field: values }),
                    RawValue::Number(value) => json!(value),
                    RawValue::Interval { lo, hi } => json!([lo, hi]),
                },
            );
        }
    }
}

/// The emergency stop, which drives about.
struct Stop {
    avoidance: Avoidance,
    speed: f64,
    wish: f64,
    collisions: u64,
    due: Time,
}

impl Stop {
    fn new(seed: u64) -> Stop {
        Stop { avoidance: Avoidance::new(seed), speed: 0.0, wish: f64::INFINITY, collisions: 0, due: Time(0) }
    }
}

impl Process for Stop {
    fn topics(&self) -> Vec<&'static str> {
        vec![NEED, ODOMETRY, WISH, TRUTH]
    }

    fn observe(&mut self, now: Time, topic: &str, content: &Value) {
        match topic {
            // The lower bound is what is safe.
            NEED => {
                let dmin = content["lo"].as_f64().or_else(|| content.as_f64());
                dmin.into_iter().for_each(|dmin| self.avoidance.observe(now, dmin));
            }
            ODOMETRY => self.speed = content.as_f64().unwrap_or(self.speed),
            WISH => self.wish = content.as_f64().unwrap_or(self.wish),
            // The bumper.
            _ => {
                let collisions = content["collisions"].as_u64().unwrap_or(0);
                if collisions > self.collisions {
                    self.avoidance.bumped(now);
                }
                self.collisions = collisions;
            }
        }
    }

    fn step(&mut self, now: Time, _: &Value, send: &mut dyn FnMut(&'static str, Value)) {
        if is_due(&mut self.due, now, CONTROL) {
            let Command { speed, turn_rate } = self.avoidance.command(now, self.speed, true);
            send(COMMAND, json!([speed.min(self.wish), turn_rate]));
        }
    }
}

/// Sends one kind of message, whatever happens.
struct Periodic {
    due: Time,
    period: Span,
    topic: &'static str,
    /// The message at a time since the start, with its stamp.
    message: fn(Time, &Value) -> Value,
}

impl Periodic {
    /// The operator, who drives slower for 3 s of each 10.
    fn teleoperation() -> Periodic {
        let message = |now: Time, _: &Value| json!(if now.0 / 1_000_000_000 % 10 < 7 { 0.6 } else { 0.3 });
        Periodic { due: Time(0), period: WISHES, topic: WISH, message }
    }

    /// The attacker, with scans of one beam.
    fn attacker() -> Periodic {
        let message = |_: Time, stamp: &Value| json!({ "header": { "stamp": stamp }, "ranges": [ATTACK_M] });
        Periodic { due: Time(0), period: ATTACK, topic: LIDAR, message }
    }
}

impl Process for Periodic {
    fn topics(&self) -> Vec<&'static str> {
        Vec::new()
    }

    fn observe(&mut self, _: Time, _: &str, _: &Value) {}

    fn step(&mut self, now: Time, stamp: &Value, send: &mut dyn FnMut(&'static str, Value)) {
        if is_due(&mut self.due, now, self.period) {
            send(self.topic, (self.message)(now, stamp));
        }
    }
}

struct LidarAlone {
    nearest: Option<f64>,
}

impl Process for LidarAlone {
    fn topics(&self) -> Vec<&'static str> {
        vec![LIDAR]
    }

    fn observe(&mut self, _: Time, _: &str, content: &Value) {
        self.nearest = numbers(&content["ranges"]).into_iter().reduce(f64::min);
    }

    fn step(&mut self, _: Time, _: &Value, send: &mut dyn FnMut(&'static str, Value)) {
        self.nearest.take().into_iter().for_each(|nearest| send(NEED, json!(nearest)));
    }
}
