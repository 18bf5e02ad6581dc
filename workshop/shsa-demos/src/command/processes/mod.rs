//! `shsa-demos rover`: the rover as separate programs on a bus, with `shsa run` beside them. The program of the lidar is
//! killed, and started again; later an attacker sends scans between the true ones. The operator has a picture all the time.

mod program;
mod scenario;

use super::operator::Operator;
use super::{RoverArguments, stop_on_signals};
use crate::Outcome;
use anyhow::bail;
use program::{PARTS, Program, heal, part_of, start};
use scenario::{Act, Scenario};
use serde_json::{Value, json};
use shsa_bridge::Address;
use shsa_core::time::Time;
use shsa_demo::rover::NEED;
use shsa_demo::terminal::{Ink, Terminal};
use shsa_demos::rover::Encoding;
use shsa_demos::rover::port::{Port, Received, TRUTH};
use shsa_demos::rover::process::{self, Part};
use std::io::{Write, stdout};
use std::sync::atomic::Ordering;
use std::sync::mpsc::Receiver;
use std::time::Duration;

/// How long the programs may take to find each other.
const PATIENCE_S: f64 = 20.0;
/// The longest pause between two looks at the clock.
const TICK: Duration = Duration::from_millis(20);
/// The name of the program with the operator's picture.
const DISPLAY: &str = "display";

/// Runs one program of the rover until it is interrupted.
pub(super) fn part(args: &RoverArguments, name: &str) -> anyhow::Result<Outcome> {
    let part = part_of(name);
    if part.is_none() && name != DISPLAY {
        bail!("the rover has no part `{name}`");
    }
    let mut port = open(args, name)?;
    let stop = stop_on_signals(port.inbox().clone())?;
    match part {
        Some(part) => process::run(part, args.on.seed, &mut port, &stop)?,
        None => {
            let mut operator = Operator::new(Terminal::new(true, args.on.json));
            Operator::subscribe(&mut port)?;
            Operator::subscribe_decisions(&mut port)?;
            while !stop.load(Ordering::Acquire) {
                port.inbox().wait(TICK);
                let now = port.inbox().clock().now();
                operator.begin(now);
                while let Some(received) = port.receive() {
                    operator.observe(now, &received)?;
                }
                operator.frame(now)?;
            }
            operator.leave_picture();
        }
    }
    Ok(Outcome::Done)
}

fn open(args: &RoverArguments, name: &str) -> anyhow::Result<Port> {
    Ok(Port::new(args.on.open(&format!("rover-{name}"))?, encoding(&args.on.bus.bus)))
}

/// What the messages of the programs look like on this bus.
fn encoding(bus: &Address) -> Encoding {
    match bus {
        Address::Ros2(_) | Address::Ros2Dds(_) => Encoding::Ros2,
        _ => Encoding::Json,
    }
}

/// What is seen on the bus.
struct Watch {
    port: Port,
    operator: Operator,
    decisions: Option<Receiver<Value>>,
    truth_m: Option<f64>,
    collisions: f64,
    scenario: Scenario,
}

/// Plays the scenario; the answer is no if the healed robot has hit something, or lacks its distance at the end.
pub(super) fn run(args: &RoverArguments) -> anyhow::Result<Outcome> {
    let mut port = open(args, DISPLAY)?;
    Operator::subscribe(&mut port)?;
    port.subscribe(TRUTH)?;
    let provider = if args.without_shsa { None } else { Some(heal(encoding(&args.on.bus.bus))?) };
    let (healer, decisions) = provider.unzip();
    let mut programs: Vec<Program> = healer.into_iter().collect();
    let alone = args.without_shsa.then_some(Part::LidarAlone);
    for part in PARTS.into_iter().chain(alone) {
        programs.push(start(part, args.on.seed)?);
    }
    let mut watch = Watch {
        port,
        operator: Operator::new(Terminal::new(!args.on.json, args.on.json)),
        decisions,
        truth_m: None,
        collisions: 0.0,
        scenario: Scenario::new(args.brisk),
    };
    watch.play(&mut programs, args.on.seed)?;
    drop(programs);
    let is_served = watch.scenario.is_served(watch.now());
    watch.operator.leave_picture();
    let collisions = watch.collisions as u64;
    let text = if args.on.json {
        let effects = watch.scenario.json();
        format!("{}\n", json!({ "collisions": collisions, "is_served": is_served, "effects": effects }))
    } else {
        format!("\n{}\n{collisions} collisions\n", watch.scenario.figures().trim_end())
    };
    stdout().write_all(text.as_bytes())?;
    let is_well = is_served && collisions == 0;
    Ok(if is_well || args.without_shsa { Outcome::Done } else { Outcome::No })
}

impl Watch {
    fn now(&self) -> Time {
        self.port.inbox().clock().now()
    }

    /// Lets the acts happen, until the end or an interrupt.
    fn play(&mut self, programs: &mut Vec<Program>, seed: u64) -> anyhow::Result<()> {
        let stop = stop_on_signals(self.port.inbox().clone())?;
        let started = self.now();
        while !stop.load(Ordering::Acquire) {
            self.port.inbox().wait(TICK);
            let now = self.now();
            self.look(now)?;
            if self.scenario.began().is_none() {
                if (now - started).seconds() > PATIENCE_S {
                    bail!("no value of {NEED} came within {PATIENCE_S} s: is the bus there?");
                }
                continue;
            }
            if let Some(act) = self.scenario.due(now) {
                self.operator.say(now, "act", Ink::Strong, act.describe())?;
                match act {
                    Act::Kill(part) => programs.retain(|program| program.part != Some(part)),
                    Act::Start(part) => programs.push(start(part, seed)?),
                }
            }
            self.operator.frame(now)?;
            if self.scenario.is_over(now) {
                break;
            }
        }
        Ok(())
    }

    /// Takes in what has come.
    fn look(&mut self, now: Time) -> anyhow::Result<()> {
        while let Some(received) = self.port.receive() {
            self.operator.observe(now, &received)?;
            if let Received::Numbers { topic, numbers, received } = received {
                self.observe(topic, &numbers, received)?;
            }
        }
        if self.operator.is_good() {
            self.scenario.is_good(now);
        }
        let came: Vec<Value> = self.decisions.iter().flat_map(Receiver::try_iter).collect();
        for decision in came {
            self.operator.decided(now, &decision)?;
            let kind = decision["kind"].as_str().unwrap_or_default();
            if ["failed", "silent", "suspected", "substituted", "restored", "unhealable"].contains(&kind) {
                let subject = decision["signal"].as_str().or(decision["variable"].as_str());
                self.scenario.decided(now, format!("{kind} {}", subject.unwrap_or_default()));
            }
        }
        self.scenario.pass(now);
        Ok(())
    }

    fn observe(&mut self, topic: &str, numbers: &[f64], received: Time) -> anyhow::Result<()> {
        match (topic, numbers) {
            (TRUTH, &[truth_m, collisions]) => {
                self.truth_m = Some(truth_m);
                if collisions > self.collisions {
                    let what = "the robot has run into an obstacle";
                    self.operator.say(received, "COLLISION", Ink::Bad, what)?;
                }
                self.collisions = collisions;
            }
            (NEED, &[lo, _]) => {
                self.operator.begin(received);
                self.scenario.served(received, self.truth_m.map_or(0.0, |truth_m| lo - truth_m));
            }
            _ => {}
        }
        Ok(())
    }
}
