//! The demonstrations as commands: one for each system.

mod pack;
mod radars;
#[cfg(feature = "zenoh")]
mod radio;
#[cfg(feature = "zenoh")]
mod platoon;
mod operator;
mod processes;

use crate::Outcome;
use crate::bus::BusArguments;
use anyhow::{Context, bail};
use shsa_bridge::memory::MemoryBus;
use shsa_bridge::{Address, Bridge, Clock, Inbox};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

/// What there is to see.
#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// A car's battery of 96 cells: a sensor of it is lost or lies, or a cell gets weak.
    Pack(Seed),
    /// Radars along a road and their tracks of vehicles: one goes blind, is moved, or is late.
    Radars(Seed),
    /// The tracks of the radars and what the vehicles say, on a bus.
    Road(OnBus),
    /// Two trucks, each with an instance of its own, over Zenoh within this machine and in real time.
    Platoon {
        /// Print the summary as one JSON object, and nothing else
        #[arg(long)]
        json: bool,
    },
    /// The robot of `shsa demo rover` as separate programs on a bus, with `shsa run` beside them: one is killed, and an attacker comes.
    Rover(RoverArguments),
}

/// Arguments of systems in simulated time.
#[derive(clap::Args)]
pub(crate) struct Seed {
    /// Another start, other noise, other turns
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Arguments of systems on a bus.
#[derive(clap::Args)]
pub(crate) struct OnBus {
    /// Another start, other noise, other turns
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print no events; the summary, if there is one, as one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    bus: BusArguments,
}

/// Arguments of `shsa-demos rover`. `shsa` is the program beside this one, or that of the environment variable `SHSA`.
#[derive(clap::Args)]
pub(crate) struct RoverArguments {
    /// Take dmin from the lidar alone, right or wrong
    #[arg(long)]
    without_shsa: bool,
    /// One program: world, lidar, sonar, depth, odometry, stop, teleoperation, attacker, or display, the operator's picture. Over
    /// ROS 2 the messages are the standard ones: LaserScan, Odometry, Twist, Float64
    #[arg(long, value_name = "NAME")]
    part: Option<String>,
    /// Each act as soon as the effect of the one before was seen
    #[arg(long, hide = true)]
    brisk: bool,
    #[command(flatten)]
    on: OnBus,
}

/// Runs the demonstration to its end.
///
/// # Errors
/// When the bus cannot be used, or standard output is closed.
pub(crate) fn run(command: Command) -> anyhow::Result<Outcome> {
    match command {
        Command::Pack(args) => pack::run(args.seed),
        Command::Radars(args) => radars::run(args.seed),
        Command::Road(args) => radars::publish(&args),
        Command::Platoon { json } => platoon(json),
        Command::Rover(args) => match &args.part {
            Some(part) => processes::part(&args, part),
            None => processes::run(&args),
        },
    }
}

#[cfg(feature = "zenoh")]
fn platoon(as_json: bool) -> anyhow::Result<Outcome> {
    platoon::run(as_json)
}

#[cfg(not(feature = "zenoh"))]
fn platoon(_: bool) -> anyhow::Result<Outcome> {
    bail!("this build has no Zenoh: build with --features zenoh")
}

impl OnBus {
    /// Opens the bus under a name.
    ///
    /// # Errors
    /// Errors of the bus; that there is none.
    fn open(&self, name: &str) -> anyhow::Result<Box<dyn Bridge>> {
        if self.bus.bus == Address::Memory {
            bail!("this needs a bus: add --bus mqtt://127.0.0.1, the address of a Zenoh router, or ros2-dds");
        }
        let clock = Clock::running();
        let inbox = Inbox::new(self.bus.queue, clock.clone());
        Ok(self.bus.options().open(name, inbox, &MemoryBus::new(clock))?)
    }
}

/// A flag that is set when the process is asked to end; this also wakes the reader of the inbox.
fn stop_on_signals(inbox: Inbox) -> anyhow::Result<Arc<AtomicBool>> {
    let mut signals = Signals::new([SIGINT, SIGTERM]).context("listening for signals")?;
    let stop = Arc::new(AtomicBool::new(false));
    let raised = stop.clone();
    let raise = move || {
        for _ in signals.forever() {
            raised.store(true, Ordering::Release);
            inbox.wake();
        }
    };
    thread::Builder::new().name("signals".into()).spawn(raise)?;
    Ok(stop)
}
