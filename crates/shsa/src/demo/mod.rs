//! `shsa demo`: a simulated machine that breaks and heals.
//!
//! The way of the data: `room -> sensors -> faults -> bus -> healer -> bus -> avoidance -> robot -> room`. One thread
//! steps it all in virtual time, which real time follows or not; a run repeats byte for byte from its seed.

mod avoidance;
mod engine_node;
mod faults;
mod healer;
mod map;
mod robot;
mod room;
mod score;
mod screen;
mod sensors;

use crate::outcome::Outcome;
use avoidance::{Avoidance, Mode};
use clap::{Args, ValueEnum};
use engine_node::EngineNode;
use faults::Fault;
use healer::{Gift, Healer, NEED, PlainNode};
use map::Ink;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use robot::Robot;
use room::{Point, Pose, Room};
use score::Score;
use screen::{Screen, View, lower_bound};
use sensors::{Sample, Sensor};
use shsa_bridge::memory::{MemoryBridge, MemoryBus};
use shsa_bridge::{Bridge, Clock, Outgoing, Payload};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use std::io::Write;
use std::time::{Duration, Instant};

/// How long the simulated time goes on at once.
const STEP: Span = Span::from_millis(5);
/// How often the controller decides.
const CONTROL: Span = Span::from_millis(20);
/// How often the picture is drawn.
const FRAME: Span = Span::from_millis(50);
/// When it is over.
const END: Time = Time(60_000_000_000);
/// Messages that may wait for a member of the bus.
const INBOX: usize = 64;

/// What there is to see.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum System {
    /// A robot in a room: its lidar breaks down, and later lies.
    Rover,
}

/// Runs a simulated machine that breaks and heals.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Example: shsa demo rover --fast --seed 3")]
pub(crate) struct DemoArgs {
    /// What to simulate
    name: System,
    /// Does not wait for the time to pass: events and summary only
    #[arg(long)]
    fast: bool,
    /// Another start, other noise, other turns
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Takes dmin from the lidar alone, whatever it says
    #[arg(long)]
    without_shsa: bool,
    /// Prints the summary as one JSON object, and nothing else
    #[arg(long)]
    json: bool,
}

/// Runs the demonstration to its end.
///
/// The answer is no when the robot has run into something although it was healed.
///
/// # Errors
/// When standard output is closed.
pub(crate) fn run(args: &DemoArgs) -> anyhow::Result<Outcome> {
    let System::Rover = args.name;
    let live = !args.fast && !args.json;
    let screen = Screen::new(live, args.json);
    let mut demo = Demo::new(args.seed, healer(args.without_shsa)?, screen)?;
    demo.introduce(args)?;
    let start = Instant::now();
    while demo.now < END {
        demo.step()?;
        if live && demo.is_due(FRAME) {
            demo.draw()?;
            wait_until(start, demo.now);
        }
    }
    demo.score.close_gap();
    demo.screen.leave_picture();
    if args.json {
        writeln!(std::io::stdout(), "{}", demo.score.json(args.seed, !args.without_shsa))?;
    } else {
        let (instead, option) =
            if args.without_shsa { ("healed", "") } else { ("not healed", " --without-shsa") };
        demo.screen.say(&format!("\n{}\n{instead}: shsa demo rover{option}\n", demo.score))?;
    }
    let crashed = demo.score.overall.collisions > 0 && !args.without_shsa;
    Ok(if crashed { Outcome::No } else { Outcome::Done })
}

fn healer(without_shsa: bool) -> anyhow::Result<Box<dyn Healer>> {
    Ok(if without_shsa { Box::new(PlainNode::default()) } else { Box::new(EngineNode::new()?) })
}

/// Sleeps until as much real time has passed since `start` as simulated time.
fn wait_until(start: Instant, now: Time) {
    let simulated = Duration::from_nanos(now.0.unsigned_abs());
    std::thread::sleep(simulated.saturating_sub(start.elapsed()));
}

/// Everything that moves.
struct Demo {
    now: Time,
    room: Room,
    robot: Robot,
    sensors: Vec<Sensor>,
    faults: Vec<Fault>,
    /// Samples on their way to the bus.
    flying: Vec<Sample>,
    bus: MemoryBus,
    sensor_port: MemoryBridge,
    healer: Box<dyn Healer>,
    healer_port: MemoryBridge,
    avoidance: Avoidance,
    avoidance_port: MemoryBridge,
    screen: Screen,
    screen_port: MemoryBridge,
    score: Score,
}

impl Demo {
    fn new(seed: u64, healer: Box<dyn Healer>, screen: Screen) -> anyhow::Result<Demo> {
        let bus = MemoryBus::new(Clock::manual());
        let [sensor_port, mut healer_port, mut avoidance_port, mut screen_port] =
            [(); 4].map(|()| bus.join(INBOX));
        let sensors = sensors::all(seed);
        let heard = sensors.iter().map(|sensor| sensor.topic).chain([NEED]);
        heard.into_iter().try_for_each(|topic| screen_port.subscribe(topic, None))?;
        healer.topics().iter().try_for_each(|topic| healer_port.subscribe(topic, None))?;
        avoidance_port.subscribe(NEED, None)?;
        let (room, faults) = (Room::furnished(), faults::schedule());
        Ok(Demo {
            now: Time(0),
            robot: Robot::at(start(seed, &room)),
            room,
            sensors,
            score: Score::new(&faults),
            faults,
            flying: Vec::new(),
            bus,
            sensor_port,
            healer,
            healer_port,
            avoidance: Avoidance::new(seed),
            avoidance_port,
            screen,
            screen_port,
        })
    }

    fn introduce(&mut self, args: &DemoArgs) -> anyhow::Result<()> {
        let by = if args.without_shsa { "the lidar alone" } else { "shsa, from whatever can be trusted" };
        self.screen.say(&format!(
            "A robot drives about a room and stops before obstacles: it needs {NEED},\n\
             the distance of the nearest one, which comes from {by}.\n\n"
        ))?;
        Ok(())
    }

    /// One step of simulated time.
    fn step(&mut self) -> anyhow::Result<()> {
        self.now = self.now + STEP;
        self.bus.clock().set(self.now);
        self.score.truth(self.now, sensors::true_dmin(&self.room, &self.robot));
        self.announce_faults()?;
        self.sense()?;
        self.heal()?;
        self.drive()?;
        while let Some(message) = self.screen_port.receive() {
            self.screen.hear(message);
        }
        Ok(())
    }

    /// Whether a period ends with this step.
    fn is_due(&self, period: Span) -> bool {
        self.now.0 % period.0 == 0
    }

    fn announce_faults(&mut self) -> anyhow::Result<()> {
        for fault in &self.faults {
            if fault.from == self.now {
                self.screen.event(self.now, "fault", Ink::Bad, &fault.describe())?;
            } else if fault.to == self.now && self.now < END {
                let text = format!("{} works again", fault.topic);
                self.screen.event(self.now, "fault ends", Ink::Good, &text)?;
            }
        }
        Ok(())
    }

    /// Sensors measure; what has arrived goes to the bus, in the order of arrival.
    fn sense(&mut self) -> anyhow::Result<()> {
        for sensor in &mut self.sensors {
            let sample = sensor.sample(self.now, &self.room, &self.robot);
            let through =
                sample.and_then(|sample| self.faults.iter().try_fold(sample, |s, fault| fault.apply(s)));
            self.flying.extend(through);
        }
        self.flying.sort_by_key(|sample| sample.arrival);
        let arrived = self.flying.partition_point(|sample| sample.arrival <= self.now);
        for sample in self.flying.drain(..arrived) {
            publish(&mut self.sensor_port, sample.topic, sample.stamp, sample.value)?;
        }
        Ok(())
    }

    fn heal(&mut self) -> anyhow::Result<()> {
        while let Some(message) = self.healer_port.receive() {
            self.healer.observe(&message);
        }
        self.healer.tick(self.now);
        while let Some(outcome) = self.healer.poll() {
            match outcome {
                Gift::Dmin { stamp, value } => self.publish(stamp, value)?,
                Gift::Decision(decision) => {
                    self.score.decided(&decision);
                    self.screen.decided(&decision)?;
                }
            }
        }
        Ok(())
    }

    fn publish(&mut self, stamp: Time, value: RawValue) -> anyhow::Result<()> {
        if let Some(middle) = middle(&value) {
            self.score.published(stamp, middle);
        }
        publish(&mut self.healer_port, NEED, stamp, value)
    }

    fn drive(&mut self) -> anyhow::Result<()> {
        while let Some(message) = self.avoidance_port.receive() {
            if let Some(dmin) = message.value().and_then(lower_bound) {
                self.avoidance.observe(message.stamped(), dmin);
            }
        }
        let before = self.avoidance.mode;
        let command = self.avoidance.command(self.now, self.robot.speed, self.is_due(CONTROL));
        let from = self.robot.pose.at;
        let collided = self.robot.step(command, &self.room, STEP.seconds());
        let driven = self.robot.pose.at.distance(from);
        self.score.moved(driven, self.robot.clearance(&self.room));
        self.report(before, collided)
    }

    /// What the robot has just done, if it is worth a line.
    fn report(&mut self, before: Mode, collided: bool) -> anyhow::Result<()> {
        let after = self.avoidance.mode;
        if collided {
            self.avoidance.bumped(self.now);
            self.score.collision();
            self.screen.event(self.now, "COLLISION", Ink::Bad, "the robot has run into an obstacle")?;
        } else if before == Mode::Brake && after == Mode::Turn {
            self.score.stops += 1;
            let text = format!("{:.2} m before an obstacle", self.robot.clearance(&self.room));
            self.screen.event(self.now, "stopped", Ink::Faint, &text)?;
        } else if before != after && after == Mode::Blind {
            self.screen.event(
                self.now,
                "stopped",
                Ink::Bad,
                "no fresh dmin: standing still is all that is safe",
            )?;
        }
        Ok(())
    }

    fn draw(&mut self) -> anyhow::Result<()> {
        self.screen.frame(&View {
            now: self.now,
            room: &self.room,
            robot: &self.robot,
            mode: self.avoidance.mode,
            true_dmin: sensors::true_dmin(&self.room, &self.robot),
            collisions: self.score.overall.collisions,
            source: self.healer.source(),
        })?;
        Ok(())
    }
}

fn publish(port: &mut MemoryBridge, topic: &str, stamp: Time, value: RawValue) -> anyhow::Result<()> {
    Ok(port.publish(Outgoing::new(topic, stamp, Payload::Value(value)))?)
}

/// Somewhere with room around, looking anywhere.
fn start(seed: u64, room: &Room) -> Pose {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(9);
    loop {
        let at = Point { x: random.random_range(0.0..room.width), y: random.random_range(0.0..room.height) };
        if !room.is_solid(at) && room.clearance(at) > 0.6 {
            return Pose { at, heading: random.random_range(-3.1..3.1) };
        }
    }
}

/// The middle of a published `dmin`; `None` for a list.
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

    /// The summary of a run, as JSON.
    fn summary(seed: u64, without_shsa: bool) -> serde_json::Value {
        let mut demo = Demo::new(seed, healer(without_shsa).unwrap(), Screen::new(false, true)).unwrap();
        while demo.now < END {
            demo.step().unwrap();
        }
        demo.score.close_gap();
        demo.score.json(seed, !without_shsa)
    }

    #[test]
    fn a_run_repeats_from_its_seed() {
        assert_eq!(summary(5, false), summary(5, false));
        assert_ne!(summary(5, true), summary(6, true));
    }

    #[test]
    fn without_shsa_the_robot_stands_blind_and_later_crashes() {
        for seed in 0..20 {
            let summary = summary(seed, true);
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
            let summary = summary(seed, false);
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
