//! The rover as separate programs on a bus, as in Fig. 1.9 of the thesis: the world, each sensor, the emergency stop, the
//! tele-operation; and an attacker, who sends scans between the true ones.

use super::port::{COMMAND, POSE, Port, Received, TRUTH, WISH};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_demo::DemoError;
use shsa_demo::rover::{
    Avoidance, Command, DEPTH, LIDAR, NEED, ODOMETRY, Point, Pose, Robot, Room, SONAR, STEP, Sample, Sensor,
    all, start, true_dmin,
};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

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

/// A message to be sent.
struct Sent {
    topic: &'static str,
    /// When it was true.
    stamp: Time,
    numbers: Vec<f64>,
}

/// The present moment.
#[derive(Clone, Copy)]
struct Now {
    /// Since the start of the program.
    since: Time,
    /// By the clock.
    clock: Time,
}

/// What a program does with messages, and as time passes.
trait Process {
    fn topics(&self) -> Vec<&'static str>;
    fn observe(&mut self, now: Time, topic: &str, numbers: &[f64]);
    /// Appends the messages that are due.
    fn step(&mut self, now: Now, sent: &mut Vec<Sent>);
}

/// Runs a program on a bus, in real time, until `stop` is set.
///
/// # Errors
/// Errors of the bus.
pub fn run(part: Part, seed: u64, port: &mut Port, stop: &AtomicBool) -> Result<(), DemoError> {
    let mut process = process(part, seed);
    process.topics().into_iter().try_for_each(|topic| port.subscribe(topic))?;
    let origin = port.inbox().clock().now();
    let mut sent = Vec::new();
    while !stop.load(Ordering::Acquire) {
        port.inbox().wait(TICK);
        let clock = port.inbox().clock().now();
        let now = Now { since: Time(0) + (clock - origin), clock };
        while let Some(received) = port.receive() {
            if let Received::Numbers { topic, numbers, .. } = received {
                process.observe(now.since, topic, &numbers);
            }
        }
        process.step(now, &mut sent);
        for Sent { topic, stamp, numbers } in sent.drain(..) {
            port.publish(topic, stamp, &numbers)?;
        }
        port.flush();
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
        let robot = Robot::at(start(seed, &room));
        let (command, commanded) = (Command::default(), Time::MIN);
        World { room, robot, command, commanded, moved: Time(0), due: Time(0), collisions: 0 }
    }
}

impl Process for World {
    fn topics(&self) -> Vec<&'static str> {
        vec![COMMAND]
    }

    fn observe(&mut self, now: Time, _: &str, numbers: &[f64]) {
        if let &[speed, turn_rate] = numbers {
            (self.command, self.commanded) = (Command { speed, turn_rate }, now);
        }
    }

    fn step(&mut self, now: Now, sent: &mut Vec<Sent>) {
        while self.moved + STEP <= now.since {
            self.moved = self.moved + STEP;
            let is_fresh = self.moved <= self.commanded + COMMAND_AGE;
            let command = if is_fresh { self.command } else { Command::default() };
            self.collisions += u32::from(self.robot.step(command, &self.room, STEP.seconds()));
        }
        if is_due(&mut self.due, now.since, POSES) {
            let (Robot { pose, speed, .. }, stamp) = (&self.robot, now.clock);
            let numbers = vec![pose.at.x, pose.at.y, pose.heading, *speed];
            sent.push(Sent { topic: POSE, stamp, numbers });
            let numbers = vec![true_dmin(&self.room, &self.robot), f64::from(self.collisions)];
            sent.push(Sent { topic: TRUTH, stamp, numbers });
        }
    }
}

/// A sensor that looks at the world.
struct Sensing {
    room: Room,
    robot: Option<Robot>,
    sensor: Option<Sensor>,
    /// Samples under way to the bus, each with the time of its measurement by the clock.
    flying: Vec<(Sample, Time)>,
}

impl Sensing {
    fn new(topic: &str, seed: u64) -> Sensing {
        let sensor = all(seed).into_iter().find(|sensor| sensor.topic == topic);
        Sensing { room: Room::furnished(), robot: None, sensor, flying: Vec::new() }
    }
}

impl Process for Sensing {
    fn topics(&self) -> Vec<&'static str> {
        vec![POSE]
    }

    fn observe(&mut self, _: Time, _: &str, numbers: &[f64]) {
        if let &[x, y, heading, speed] = numbers {
            let mut robot = Robot::at(Pose { at: Point { x, y }, heading });
            robot.speed = speed;
            self.robot = Some(robot);
        }
    }

    fn step(&mut self, now: Now, sent: &mut Vec<Sent>) {
        if let (Some(sensor), Some(robot)) = (&mut self.sensor, &self.robot) {
            let sample = sensor.sample(now.since, &self.room, robot);
            self.flying.extend(sample.map(|sample| (sample, now.clock)));
        }
        let arrived = self.flying.partition_point(|(sample, _)| sample.arrival <= now.since);
        sent.extend(self.flying.drain(..arrived).map(|(sample, stamp)| {
            let numbers = match sample.value {
                RawValue::Vector(values) => values,
                RawValue::Number(value) => vec![value],
                RawValue::Interval { lo, hi } => vec![lo, hi],
            };
            Sent { topic: sample.topic, stamp, numbers }
        }));
    }
}

/// The emergency stop, which drives about.
struct Stop {
    avoidance: Avoidance,
    speed: f64,
    wish: f64,
    collisions: f64,
    due: Time,
}

impl Stop {
    fn new(seed: u64) -> Stop {
        Stop {
            avoidance: Avoidance::new(seed),
            speed: 0.0,
            wish: f64::INFINITY,
            collisions: 0.0,
            due: Time(0),
        }
    }
}

impl Process for Stop {
    fn topics(&self) -> Vec<&'static str> {
        vec![NEED, ODOMETRY, WISH, TRUTH]
    }

    fn observe(&mut self, now: Time, topic: &str, numbers: &[f64]) {
        match (topic, numbers) {
            // The lower bound is what is safe.
            (NEED, &[lo, _]) => self.avoidance.observe(now, lo),
            (ODOMETRY, &[speed]) => self.speed = speed,
            (WISH, &[speed]) => self.wish = speed,
            // The bumper.
            (TRUTH, &[_, collisions]) => {
                if collisions > self.collisions {
                    self.avoidance.bumped(now);
                }
                self.collisions = collisions;
            }
            _ => {}
        }
    }

    fn step(&mut self, now: Now, sent: &mut Vec<Sent>) {
        if is_due(&mut self.due, now.since, CONTROL) {
            let Command { speed, turn_rate } = self.avoidance.command(now.since, self.speed, true);
            let numbers = vec![speed.min(self.wish), turn_rate];
            sent.push(Sent { topic: COMMAND, stamp: now.clock, numbers });
        }
    }
}

/// Sends one kind of message, whatever happens.
struct Periodic {
    due: Time,
    period: Span,
    topic: &'static str,
    /// The number of the message at a time since the start.
    number: fn(Time) -> f64,
}

impl Periodic {
    /// The operator, who drives slower for 3 s of each 10.
    fn teleoperation() -> Periodic {
        let number = |since: Time| if since.0 / 1_000_000_000 % 10 < 7 { 0.6 } else { 0.3 };
        Periodic { due: Time(0), period: WISHES, topic: WISH, number }
    }

    /// The attacker, with scans of one beam.
    fn attacker() -> Periodic {
        Periodic { due: Time(0), period: ATTACK, topic: LIDAR, number: |_| ATTACK_M }
    }
}

impl Process for Periodic {
    fn topics(&self) -> Vec<&'static str> {
        Vec::new()
    }

    fn observe(&mut self, _: Time, _: &str, _: &[f64]) {}

    fn step(&mut self, now: Now, sent: &mut Vec<Sent>) {
        if is_due(&mut self.due, now.since, self.period) {
            sent.push(Sent { topic: self.topic, stamp: now.clock, numbers: vec![(self.number)(now.since)] });
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

    fn observe(&mut self, _: Time, _: &str, numbers: &[f64]) {
        self.nearest = numbers.iter().copied().reduce(f64::min);
    }

    fn step(&mut self, now: Now, sent: &mut Vec<Sent>) {
        let nearest = self.nearest.take();
        sent.extend(nearest.map(|nearest| Sent { topic: NEED, stamp: now.clock, numbers: vec![nearest] }));
    }
}
