//! `shsa demo`: a simulated system that breaks and heals, shown as it happens. The systems are those of `shsa-demo`.

mod terminal;
mod verdict;
mod map;
mod screen;
mod scan;
mod operator;
mod processes;
mod pack;
#[cfg(feature = "zenoh")]
mod radio;
#[cfg(feature = "zenoh")]
mod platoon;
mod radars;

use crate::bus::BusArguments;
use crate::headings::OUTPUT;
use crate::outcome::Outcome;
use crate::replay::provenance;
use crate::test;
use anyhow::{Context, bail};
use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use screen::Screen;
use shsa_bridge::Address;
use shsa_core::time::{Span, Time};
use shsa_demo::Provision;
use shsa_demo::rover::{Happening, NEED, Trial};
use shsa_demo::stories;
use shsa_format::story::load;
use shsa_format::text;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use terminal::{Ink, Terminal};

/// How often the picture is drawn.
const FRAME: Span = Span::from_millis(50);

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
    /// A car's battery of 96 cells: a sensor of it is lost or lies, or a cell gets weak.
    Pack,
    /// Radars along a road and their tracks of vehicles: one goes blind, is moved, or is late.
    Radars,
    /// A car without its steering angle: each way to it provides it in turn.
    Drivetrain,
    /// A tank whose float sticks: its flows and its weight say so.
    Tank,
    /// A room whose thermometer stands in the sun.
    Room,
    /// Three sensors of one level: two decide, and how surely is a number.
    Vote,
}

/// Runs a simulated machine that breaks and heals.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Example: shsa demo --list\n  shsa demo rover --fast --seed 3\n  shsa demo rover --processes --bus mqtt://127.0.0.1\n  shsa demo rover --processes --bus ros2-dds\n  shsa demo radars --part road --bus mqtt://127.0.0.1\n  shsa demo stop --report stop.html\n  shsa demo platoon --live"
)]
pub(crate) struct DemoArgs {
    /// The simulated system
    #[arg(required_unless_present = "list")]
    name: Option<System>,
    /// List the systems
    #[arg(long, exclusive = true)]
    list: bool,
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
    /// The platoon with two instances over Zenoh, within this machine and in real time
    #[arg(long, conflicts_with_all = ["fast", "seed", "without_shsa", "page", "report"])]
    live: bool,
    /// Show the live page instead, http://127.0.0.1:7410/, until it is interrupted: `shsa run` with its defaults
    #[arg(long, conflicts_with_all = ["fast", "seed", "without_shsa", "json"])]
    page: bool,
    /// The rover as separate programs on a bus, with `shsa run` beside them: one is killed, and an attacker comes. Over ROS 2 their
    /// messages are the standard ones: LaserScan, Odometry, Twist, Float64
    #[arg(long, conflicts_with_all = ["fast", "page", "report", "live"])]
    processes: bool,
    /// One program of the rover on a bus: world, lidar, sonar, depth, odometry, stop, teleoperation, attacker, or display, the
    /// operator's picture; of the radars: road, which gives the tracks of all radars
    #[arg(long, value_name = "NAME", conflicts_with_all = ["processes", "fast", "page", "report", "live"])]
    part: Option<String>,
    /// Each act of --processes as soon as the effect of the one before was seen
    #[arg(long, hide = true, requires = "processes")]
    brisk: bool,
    /// Write the page of `shsa replay --report` about it, with the assurance case where there are contracts; not of the rover
    #[arg(long, alias = "html", value_name = "FILE", help_heading = OUTPUT)]
    report: Option<PathBuf>,
    #[command(flatten)]
    bus: BusArguments,
}

impl DemoArgs {
    /// Whether the robot is shown on the live page.
    pub(crate) fn is_live(&self) -> bool {
        self.page && self.name == Some(System::Rover)
    }
}

/// Runs the demonstration to its end.
///
/// The answer is no if the robot has hit something although it was healed.
///
/// # Errors
/// When standard output is closed.
pub(crate) fn run(args: &DemoArgs) -> anyhow::Result<Outcome> {
    let Some(name) = args.name else { return list() };
    let is_rover = name == System::Rover;
    if let Some(part) = args.part.as_deref().filter(|_| is_rover) {
        return processes::part(args, part);
    }
    if args.part.as_deref() == Some("road") && name == System::Radars {
        return radars::publish(args);
    }
    if args.part.is_some() {
        bail!("the rover has parts, and the radars have the part `road`");
    }
    if args.processes && is_rover {
        return processes::run(args);
    }
    if args.processes || args.bus.bus != Address::Memory {
        bail!("--processes and --bus belong together, and to the rover");
    }
    let story = match name {
        System::Platoon if args.live => return live_platoon(args.json),
        _ if args.live => bail!("--live is of the platoon; the rover has --page"),
        System::Rover => return rover(args),
        System::Pack => return simulated(args, pack::run),
        System::Radars => return simulated(args, radars::run),
        System::Car => stories::car(),
        System::Stop => stories::stop(),
        System::Platoon => stories::platoon(),
        System::Drivetrain => stories::drivetrain(),
        System::Tank => stories::tank(),
        System::Room => stories::room(),
        System::Vote => stories::vote(),
    };
    print_story(args, &story)
}

/// Prints each system with what happens to it.
fn list() -> anyhow::Result<Outcome> {
    let systems = System::value_variants().iter().filter_map(System::to_possible_value);
    let row = |system: PossibleValue| {
        vec![system.get_name().to_owned(), system.get_help().map(ToString::to_string).unwrap_or_default()]
    };
    writeln!(
        io::stdout(),
        "{}",
        text::table(&["system", "what happens"], systems.map(row).collect()).trim_end()
    )?;
    Ok(Outcome::Done)
}

#[cfg(feature = "zenoh")]
fn live_platoon(as_json: bool) -> anyhow::Result<Outcome> {
    platoon::run(as_json)
}

#[cfg(not(feature = "zenoh"))]
fn live_platoon(_: bool) -> anyhow::Result<Outcome> {
    bail!("this build has no Zenoh: build with --features zenoh")
}

/// Runs a demonstration that takes a seed and never waits.
fn simulated(args: &DemoArgs, run: fn(u64) -> anyhow::Result<Outcome>) -> anyhow::Result<Outcome> {
    if args.without_shsa || args.json || args.page || args.report.is_some() {
        bail!("this demonstration takes --seed only: it shows both, with shsa and without");
    }
    run(args.seed)
}

/// Tells the story of a system, and writes the page about it.
fn print_story(args: &DemoArgs, text: &str) -> anyhow::Result<Outcome> {
    if args.fast || args.without_shsa || args.json || args.page {
        bail!("this demonstration is a story: it takes --seed and --report only");
    }
    let text = &stories::with_seed(text, args.seed);
    let story = load(text, "story", Path::new(".")).story.context("the story has errors")?;
    let report =
        args.report.as_deref().map(|path| (path, provenance(Path::new("story.yaml"), text.as_bytes())));
    test::run_story(&story, report.as_ref().map(|(path, made)| (*path, made)))
}

fn rover(args: &DemoArgs) -> anyhow::Result<Outcome> {
    if args.report.is_some() {
        bail!("the rover has no report: its live page is --page");
    }
    let live = !args.fast && !args.json;
    let mut screen = Screen::new(Terminal::new(live, args.json));
    let provision = if args.without_shsa { Provision::SensorsAlone } else { Provision::Healed };
    let mut trial = Trial::new(args.seed, provision)?;
    introduce(&mut screen, provision)?;
    let start = Instant::now();
    while trial.now() < Trial::END {
        for happening in trial.step()? {
            print_happening(&mut screen, trial.now(), &happening)?;
        }
        while let Some(message) = trial.receive() {
            screen.receive(message);
        }
        if live && trial.now().0 % FRAME.0 == 0 {
            screen.frame(&trial.view())?;
            wait_until(start, trial.now());
        }
    }
    let score = trial.finish();
    screen.leave_picture();
    if args.json {
        writeln!(io::stdout(), "{}", score.json(args.seed, provision))?;
    } else {
        let (instead, option) =
            if args.without_shsa { ("healed", "") } else { ("not healed", " --without-shsa") };
        screen.print_line(&format!("\n{score}\n{instead}: shsa demo rover{option}\n"))?;
    }
    let crashed = score.collisions() > 0 && !args.without_shsa;
    Ok(if crashed { Outcome::No } else { Outcome::Done })
}

fn introduce(screen: &mut Screen, provision: Provision) -> io::Result<()> {
    let by = match provision {
        Provision::SensorsAlone => "the lidar alone",
        Provision::Healed => "shsa, from whatever can be trusted",
    };
    screen.print_line(&format!(
        "A robot drives about a room and stops before obstacles: it needs {NEED},\n\
         the distance of the nearest one, which comes from {by}.\n\n"
    ))
}

fn print_happening(screen: &mut Screen, now: Time, happening: &Happening) -> io::Result<()> {
    match happening {
        Happening::FaultBegins(fault) => screen.event(now, "fault", Ink::Bad, &fault.describe()),
        Happening::FaultEnds(fault) => {
            screen.event(now, "fault ends", Ink::Good, &format!("{} works again", fault.topic))
        }
        Happening::Decided(decision) => screen.decided(decision),
        Happening::Collided => screen.event(now, "COLLISION", Ink::Bad, "the robot has run into an obstacle"),
        Happening::StoppedBefore(clearance_m) => {
            screen.event(now, "stopped", Ink::Faint, &format!("{clearance_m:.2} m before an obstacle"))
        }
        Happening::StoppedBlind => {
            screen.event(now, "stopped", Ink::Bad, "no fresh dmin: standing still is all that is safe")
        }
    }
}

/// Sleeps until the real time since `start` equals the simulated time.
fn wait_until(start: Instant, now: Time) {
    let simulated = Duration::from_nanos(now.0.unsigned_abs());
    std::thread::sleep(simulated.saturating_sub(start.elapsed()));
}
