//! `shsa demo`: a simulated robot that breaks and heals, shown as it happens. It is that of `shsa-demo`.

mod map;
mod screen;

use crate::outcome::Outcome;
use clap::{Args, ValueEnum};
use screen::Screen;
use shsa_core::time::{Span, Time};
use shsa_demo::Provision;
use shsa_demo::rover::{Happening, NEED, Trial};
use shsa_demo::terminal::{Ink, Terminal};
use std::io::{self, Write};
use std::time::{Duration, Instant};

/// How often the picture is drawn.
const FRAME: Span = Span::from_millis(50);

/// What there is to see.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum System {
    /// A robot in a room: its lidar breaks down, and later lies.
    Rover,
}

/// Runs a simulated machine that breaks and heals.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Example: shsa demo rover --fast --seed 3\n  shsa demo rover --page")]
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
}

impl DemoArgs {
    /// Whether the robot is shown on the live page.
    pub(crate) fn is_live(&self) -> bool {
        self.page
    }
}

/// Runs the demonstration to its end.
///
/// The answer is no if the robot has hit something although it was healed.
///
/// # Errors
/// When standard output is closed.
pub(crate) fn run(args: &DemoArgs) -> anyhow::Result<Outcome> {
    let System::Rover = args.name;
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
