//! `shsa demo`: a simulated machine that breaks and heals.
//!
//! The data flow: `room -> sensors -> faults -> bus -> healer -> bus -> avoidance -> robot -> room`. One thread runs all of it in
//! simulated time, with or without waiting for real time. A run can be repeated byte for byte from its seed.

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
mod stories;
mod world;

use crate::outcome::Outcome;
use anyhow::bail;
use avoidance::Mode;
use clap::{Args, ValueEnum};
use engine_node::EngineNode;
use healer::{Gift, Healer, NEED, PlainNode};
use map::Ink;
use score::Score;
use screen::{Screen, View};
use shsa_bridge::memory::{MemoryBridge, MemoryBus};
use shsa_bridge::{Bridge, Clock, Outgoing, Payload};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use world::{INBOX, Moved, STEP, World};

/// How often the picture is drawn.
const FRAME: Span = Span::from_millis(50);
/// The end of the run.
const END: Time = Time(60_000_000_000);

/// What there is to see.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum System {
    /// A robot in a room: its lidar breaks down, and later lies.
    Rover,
    /// A car under contract: it loses its speed, gets an upgrade, and runs out of processing time.
    Car,
    /// A robot's emergency stop at SIL 2: by its lidar, or by sonar and camera together.
    Stop,
    /// A truck behind another: what the leader guarantees comes over the network, and ends with it.
    Platoon,
}

/// Runs a simulated machine that breaks and heals.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Example: shsa demo rover --fast --seed 3\n  shsa demo stop --report stop.html")]
pub(crate) struct DemoArgs {
    /// The simulated system
    name: System,
    /// Do not wait for the time to pass: events and summary only
    #[arg(long)]
    fast: bool,
    /// Another start, other noise, other turns
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Take dmin from the lidar alone, right or wrong
    #[arg(long)]
    without_shsa: bool,
    /// Print the summary as one JSON object, and nothing else
    #[arg(long)]
    json: bool,
    /// Show the live page instead, http://127.0.0.1:7410/, until it is interrupted: `shsa run` with its defaults
    #[arg(long, conflicts_with_all = ["fast", "seed", "without_shsa", "json"])]
    page: bool,
    /// Writes the page of `shsa replay --report` about it, with the assurance case: car, stop, platoon
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

impl DemoArgs {
    /// Whether the robot is shown on the live page.
    pub(crate) fn is_live(&self) -> bool {
        self.page && self.name == System::Rover
    }
}

/// Runs the demonstration to its end.
///
/// The answer is no if the robot has hit something although it was healed.
///
/// # Errors
/// When standard output is closed.
pub(crate) fn run(args: &DemoArgs) -> anyhow::Result<Outcome> {
    if args.name != System::Rover {
        return stories::run(args);
    }
    if args.report.is_some() {
        bail!("the rover has no report: its live page is --page");
    }
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

/// Runs the simulated machine on a bus in real time, in a thread of its own, until `stop` is set. Its faults are repeated, as in
/// the demonstration.
///
/// # Errors
/// When no thread can be started.
pub(crate) fn simulate(bus: &MemoryBus, stop: &Arc<AtomicBool>) -> anyhow::Result<()> {
    let (bus, stop) = (bus.clone(), stop.clone());
    let mut world = World::new(1, &bus)?;
    std::thread::Builder::new().name("simulator".into()).spawn(move || {
        let began = Instant::now();
        let mut now = Time(0);
        while !stop.load(Ordering::Acquire) {
            now = now + STEP;
            if world.sense(now).is_err() {
                return;
            }
            world.drive(now);
            wait_until(began, now);
        }
    })?;
    Ok(())
}

fn healer(without_shsa: bool) -> anyhow::Result<Box<dyn Healer>> {
    Ok(if without_shsa { Box::new(PlainNode::default()) } else { Box::new(EngineNode::new()?) })
}

/// Sleeps until the real time since `start` equals the simulated time.
fn wait_until(start: Instant, now: Time) {
    let simulated = Duration::from_nanos(now.0.unsigned_abs());
    std::thread::sleep(simulated.saturating_sub(start.elapsed()));
}

/// A world, a healer, and an observer.
struct Demo {
    now: Time,
    bus: MemoryBus,
    world: World,
    healer: Box<dyn Healer>,
    healer_port: MemoryBridge,
    screen: Screen,
    screen_port: MemoryBridge,
    score: Score,
}

impl Demo {
    fn new(seed: u64, healer: Box<dyn Healer>, screen: Screen) -> anyhow::Result<Demo> {
        let bus = MemoryBus::new(Clock::manual());
        let world = World::new(seed, &bus)?;
        let [mut healer_port, mut screen_port] = [(); 2].map(|()| bus.join(INBOX));
        world.topics().chain([NEED]).try_for_each(|topic| screen_port.subscribe(topic, None))?;
        healer.topics().iter().try_for_each(|topic| healer_port.subscribe(topic, None))?;
        Ok(Demo {
            now: Time(0),
            bus,
            score: Score::new(&world.faults),
            world,
            healer,
            healer_port,
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
        self.score.truth(self.now, sensors::true_dmin(&self.world.room, &self.world.robot));
        self.announce_faults()?;
        self.world.sense(self.now)?;
        self.heal()?;
        let moved = self.world.drive(self.now);
        self.score.moved(moved.driven, self.world.robot.clearance(&self.world.room));
        self.report(&moved)?;
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
        for fault in &self.world.faults {
            if fault.from == self.now {
                self.screen.event(self.now, "fault", Ink::Bad, &fault.describe())?;
            } else if fault.to == self.now && self.now < END {
                let text = format!("{} works again", fault.topic);
                self.screen.event(self.now, "fault ends", Ink::Good, &text)?;
            }
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
        Ok(self.healer_port.publish(Outgoing::new(NEED, stamp, Payload::Value(value)))?)
    }

    /// Tells the robot's action, if it is worth a line.
    fn report(&mut self, moved: &Moved) -> anyhow::Result<()> {
        let (before, after) = (moved.before, self.world.avoidance.mode);
        if moved.collided {
            self.score.collision();
            self.screen.event(self.now, "COLLISION", Ink::Bad, "the robot has run into an obstacle")?;
        } else if before == Mode::Brake && after == Mode::Turn {
            self.score.stops += 1;
            let clearance = self.world.robot.clearance(&self.world.room);
            let text = format!("{clearance:.2} m before an obstacle");
            self.screen.event(self.now, "stopped", Ink::Faint, &text)?;
        } else if before != after && after == Mode::Blind {
            let text = "no fresh dmin: standing still is all that is safe";
            self.screen.event(self.now, "stopped", Ink::Bad, text)?;
        }
        Ok(())
    }

    fn draw(&mut self) -> anyhow::Result<()> {
        let World { room, robot, avoidance, .. } = &self.world;
        self.screen.frame(&View {
            now: self.now,
            room,
            robot,
            mode: avoidance.mode,
            true_dmin: sensors::true_dmin(room, robot),
            collisions: self.score.overall.collisions,
            source: self.healer.source(),
        })?;
        Ok(())
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
