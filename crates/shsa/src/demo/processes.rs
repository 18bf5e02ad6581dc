//! `shsa demo rover --processes`: the rover as separate programs on a bus, with `shsa run` beside them. The program of the lidar is
//! killed, and started again; later an attacker sends scans between the true ones.

use super::DemoArgs;
use crate::outcome::Outcome;
use crate::run::stop_on_signals;
use anyhow::{Context, bail};
use serde_json::{Value, json};
use shsa_bridge::memory::MemoryBus;
use shsa_bridge::{Address, Bridge, Clock, Inbox, Message, Payload};
use shsa_core::time::Time;
use shsa_demo::rover::NEED;
use shsa_demo::rover::process::{self, Part, TRUTH};
use shsa_format::text::table;
use std::env;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Write, stdout};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

/// The programs that run all the time.
const PARTS: [Part; 7] =
    [Part::World, Part::Lidar, Part::Sonar, Part::Depth, Part::Odometry, Part::Stop, Part::Teleoperation];

/// What happens, in seconds after the first value of the need.
const SCENARIO: [(f64, Act); 4] = [
    (5.0, Act::Kill(Part::Lidar)),
    (11.0, Act::Start(Part::Lidar)),
    (19.0, Act::Start(Part::Attacker)),
    (25.0, Act::Kill(Part::Attacker)),
];
const END_S: f64 = 29.0;
/// How long the programs may take to find each other.
const PATIENCE_S: f64 = 20.0;
/// The names of the options that concern neither the bus nor a part.
const OWN: [&str; 5] = ["demo", "rover", "--processes", "--json", "--without-shsa"];

#[derive(Clone, Copy, PartialEq)]
enum Act {
    Start(Part),
    Kill(Part),
}

impl Act {
    fn describe(self) -> &'static str {
        match self {
            Act::Kill(Part::Attacker) => "the attack ends",
            Act::Kill(_) => "the program of the lidar is killed",
            Act::Start(Part::Attacker) => "an attacker sends scans of 3 m, 100 a second",
            Act::Start(_) => "the program of the lidar is started again",
        }
    }
}

/// The name of a part on the command line.
fn named(part: Part) -> &'static str {
    match part {
        Part::World => "world",
        Part::Lidar => "lidar",
        Part::Sonar => "sonar",
        Part::Depth => "depth",
        Part::Odometry => "odometry",
        Part::Stop => "stop",
        Part::Teleoperation => "teleoperation",
        Part::LidarAlone => "lidar-alone",
        Part::Attacker => "attacker",
    }
}

/// Runs one program of the rover until it is interrupted.
pub(super) fn part(args: &DemoArgs, name: &str) -> anyhow::Result<Outcome> {
    let others = [Part::LidarAlone, Part::Attacker];
    let found = PARTS.into_iter().chain(others).find(|part| named(*part) == name);
    let part = found.with_context(|| format!("the rover has no part `{name}`"))?;
    let (mut bus, inbox) = open(args, name)?;
    let stop = stop_on_signals(inbox)?;
    process::run(part, args.seed, &mut *bus, &stop)?;
    Ok(Outcome::Done)
}

fn open(args: &DemoArgs, name: &str) -> anyhow::Result<(Box<dyn Bridge>, Inbox)> {
    if args.bus.bus == Address::Memory {
        bail!("separate programs need a bus: add --bus mqtt://127.0.0.1, or the address of a Zenoh router");
    }
    let clock = Clock::running();
    let inbox = Inbox::new(args.bus.queue, clock.clone());
    let bus = args.bus.options().open(&format!("rover-{name}"), inbox.clone(), &MemoryBus::new(clock))?;
    Ok((bus, inbox))
}

/// A running program; it is killed when this is dropped.
struct Program {
    part: Option<Part>,
    child: Child,
}

impl Drop for Program {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The options of the bus, as they were given.
fn bus_options() -> Vec<OsString> {
    let mut given = env::args_os().skip(1).filter(|it| OWN.iter().all(|own| it != own));
    let mut options = Vec::new();
    while let Some(option) = given.next() {
        if option == "--seed" {
            given.next();
        } else if !option.to_string_lossy().starts_with("--seed=") {
            options.push(option);
        }
    }
    options
}

fn start(part: Part, seed: u64) -> anyhow::Result<Program> {
    let mut command = Command::new(env::current_exe()?);
    command.args(["demo", "rover", "--part", named(part), "--seed", &seed.to_string()]).args(bus_options());
    let child = command.stdin(Stdio::null()).stdout(Stdio::null()).spawn();
    Ok(Program { part: Some(part), child: child.with_context(|| format!("starting {}", named(part)))? })
}

/// Starts `shsa run`; its decisions come one by one.
fn heal() -> anyhow::Result<(Program, Receiver<Value>)> {
    let mut command = Command::new(env::current_exe()?);
    command.args(["run", "--json", "--form", "json", "--http", "127.0.0.1:0"]).args(bus_options());
    let mut child =
        command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().context("starting shsa run")?;
    let lines = BufReader::new(child.stdout.take().context("a pipe that is not there")?);
    let (sender, receiver) = channel();
    thread::Builder::new().name("decisions".into()).spawn(move || {
        let decisions =
            lines.lines().map_while(Result::ok).filter_map(|line| serde_json::from_str(&line).ok());
        for decision in decisions {
            if sender.send(decision).is_err() {
                return;
            }
        }
    })?;
    Ok((Program { part: None, child }, receiver))
}

/// What one act did to the need.
struct Effect {
    act: Act,
    at: Time,
    /// The first decision after it: when, and what it says.
    decided: Option<(f64, String)>,
    /// The longest time without a value, seconds, and the largest excess of a value over the truth, metres.
    gap_s: f64,
    excess_m: f64,
}

/// What is seen on the bus.
struct Watch {
    bus: Box<dyn Bridge>,
    decisions: Option<Receiver<Value>>,
    truth_m: Option<f64>,
    collisions: u64,
    /// The last value of the need.
    last: Option<Time>,
    began: Option<Time>,
    effects: Vec<Effect>,
    is_quiet: bool,
}

/// Plays the scenario; the answer is no if the healed robot has hit something, or lacks its distance at the end.
pub(super) fn run(args: &DemoArgs) -> anyhow::Result<Outcome> {
    let (mut bus, inbox) = open(args, "display")?;
    bus.subscribe(NEED, None)?;
    bus.subscribe(TRUTH, None)?;
    let provider = if args.without_shsa { None } else { Some(heal()?) };
    let (healer, decisions) = provider.unzip();
    let mut programs: Vec<Program> = healer.into_iter().collect();
    let alone = args.without_shsa.then_some(Part::LidarAlone);
    for part in PARTS.into_iter().chain(alone) {
        programs.push(start(part, args.seed)?);
    }
    let mut watch = Watch {
        bus,
        decisions,
        truth_m: None,
        collisions: 0,
        last: None,
        began: None,
        effects: Vec::new(),
        is_quiet: args.json,
    };
    let stop = stop_on_signals(inbox.clone())?;
    let started = inbox.clock().now();
    let mut acts = SCENARIO.into_iter().peekable();
    while !stop.load(Ordering::Acquire) {
        inbox.wait(Duration::from_millis(20));
        let now = inbox.clock().now();
        watch.look(now)?;
        let Some(began) = watch.began else {
            if (now - started).seconds() > PATIENCE_S {
                bail!("no value of {NEED} came within {PATIENCE_S} s: is the bus there?");
            }
            continue;
        };
        let after = (now - began).seconds();
        if let Some((_, act)) = acts.next_if(|(at, _)| *at <= after) {
            watch.say(now, act.describe())?;
            match act {
                Act::Kill(part) => programs.retain(|program| program.part != Some(part)),
                Act::Start(part) => programs.push(start(part, args.seed)?),
            }
            watch.effects.push(Effect { act, at: now, decided: None, gap_s: 0.0, excess_m: 0.0 });
        }
        if after > END_S {
            break;
        }
    }
    let now = inbox.clock().now();
    let is_served = watch.last.is_some_and(|last| (now - last).seconds() < 1.0);
    drop(programs);
    let text = if args.json { format!("{}\n", watch.json(is_served)) } else { watch.figures() };
    stdout().write_all(text.as_bytes())?;
    let is_well = is_served && watch.collisions == 0;
    Ok(if is_well || args.without_shsa { Outcome::Done } else { Outcome::No })
}

impl Watch {
    /// Takes in what has come.
    fn look(&mut self, now: Time) -> anyhow::Result<()> {
        while let Some(message) = self.bus.receive() {
            self.observe(&message)?;
        }
        let came: Vec<Value> = self.decisions.iter().flat_map(Receiver::try_iter).collect();
        for decision in came {
            let kind = decision["kind"].as_str().unwrap_or_default();
            if !["failed", "silent", "suspected", "substituted", "restored", "unhealable"].contains(&kind) {
                continue;
            }
            let subject = decision["signal"].as_str().or(decision["variable"].as_str()).unwrap_or_default();
            let text = format!("{kind} {subject}: {}", decision["because"].as_str().unwrap_or_default());
            self.say(now, &text)?;
            if let Some(effect) = self.effects.last_mut().filter(|it| it.decided.is_none()) {
                effect.decided = Some(((now - effect.at).seconds(), format!("{kind} {subject}")));
            }
        }
        let gap_s = self.last.map_or(0.0, |last| (now - last).seconds());
        self.effects.last_mut().into_iter().for_each(|effect| effect.gap_s = effect.gap_s.max(gap_s));
        Ok(())
    }

    fn observe(&mut self, message: &Message) -> anyhow::Result<()> {
        let Payload::Bytes(bytes) = &message.payload else { return Ok(()) };
        let Ok(content) = serde_json::from_slice::<Value>(bytes) else { return Ok(()) };
        if *message.topic == *TRUTH {
            self.truth_m = content["dmin_m"].as_f64();
            let collisions = content["collisions"].as_u64().unwrap_or(0);
            if collisions > self.collisions {
                self.say(message.received, "COLLISION: the robot has run into an obstacle")?;
            }
            self.collisions = collisions;
            return Ok(());
        }
        let dmin_m = content["lo"].as_f64().or_else(|| content.as_f64());
        let excess_m = dmin_m.zip(self.truth_m).map_or(0.0, |(dmin_m, truth_m)| dmin_m - truth_m);
        if let Some(effect) = self.effects.last_mut() {
            let gap_s = self.last.map_or(0.0, |last| (message.received - last).seconds());
            (effect.gap_s, effect.excess_m) = (effect.gap_s.max(gap_s), effect.excess_m.max(excess_m));
        }
        self.last = Some(message.received);
        self.began.get_or_insert(message.received);
        Ok(())
    }

    fn say(&self, now: Time, text: &str) -> anyhow::Result<()> {
        if !self.is_quiet {
            let after = self.began.map_or(0.0, |began| (now - began).seconds());
            writeln!(stdout(), "{after:7.2} s  {text}")?;
        }
        Ok(())
    }

    fn figures(&self) -> String {
        let row = |effect: &Effect| {
            let none = || ("-".to_owned(), "-".to_owned());
            let decided = effect.decided.as_ref();
            let (after, what) =
                decided.map_or_else(none, |(after, what)| (format!("{after:.2} s"), what.clone()));
            let gap = format!("{:.2} s", effect.gap_s);
            vec![effect.act.describe().to_owned(), what, after, gap, format!("{:.2} m", effect.excess_m)]
        };
        let head =
            ["what happened", "first decision", "after", "longest time without dmin", "dmin too large by"];
        let rows = self.effects.iter().map(row).collect();
        format!("\n{}\n{} collisions\n", table(&head, rows).trim_end(), self.collisions)
    }

    fn json(&self, is_served: bool) -> Value {
        let effect = |effect: &Effect| {
            let (after_s, decision) = effect.decided.clone().unzip();
            json!({
                "what": effect.act.describe(), "decision": decision, "after_s": after_s,
                "longest_gap_s": effect.gap_s, "too_large_m": effect.excess_m,
            })
        };
        let effects: Vec<Value> = self.effects.iter().map(effect).collect();
        json!({ "collisions": self.collisions, "is_served": is_served, "effects": effects })
    }
}
