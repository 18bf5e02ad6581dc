//! `shsa run`: heals a running system.
//!
//! ```text
//! bus -> inbox -> session (healers: engine and outlets) -> bus
//!                    | requests          | decisions
//!                 control             herald -> terminal, bus, HTTP
//! ```
//!
//! One thread at a time does everything that decides ([`helm`]): the run's own, or while that sleeps a thread of the bus that
//! brings a message. HTTP has threads of its own that only hand things in, and the terminal one that writes what it is handed.

mod control;
mod execution;
mod figures;
mod fittings;
mod healer;
mod helm;
mod herald;
pub(crate) mod isolation;
mod journal;
mod likeness;
mod memory;
mod metrics;
mod outlet;
mod parts;
mod session;
mod shares;
mod terminal;
#[cfg(test)]
mod tests;
mod undelivered;
pub(crate) mod wires;
mod wiring;

pub(crate) use wires::topic_and_field;

use crate::bus::{Address, BusArguments};
use crate::outcome::{AlreadyTold, Outcome};
use crate::watch::Watching;
use crate::{demo, show, unwatched};
use anyhow::Context;
use control::{Desk, Guard, Reply, Request, Token, bus, http};
use figures::Figures;
use fittings::Outgoings;
use healer::Healer;
use helm::Helm;
use herald::{Herald, Style};
use isolation::IsolationArguments;
use journal::Bounds;
use outlet::Form;
use parts::Parts;
use serde_json::Value;
use session::{House, Session};
use shares::Shares;
use shsa_bridge::memory::MemoryBus;
use shsa_bridge::{Bridge, Clock, Inbox};
use shsa_core::engine::Options;
use shsa_core::time::{Span, Time};
use shsa_format::model::live::{Live, Written};
use shsa_format::wiring::Wiring;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

/// The model of the embedded simulator.
const ROVER: (&str, &str) = ("models/rover.yaml", include_str!("../../../../models/rover.yaml"));

/// Why `--join` is refused.
const NO_JOIN: &str = "--join is not possible on this bus, which does not tell what instances are there: use --bus zenoh://HOST:PORT or \
ros2://HOST:PORT, or put the models together before, by shsa join A.yaml B.yaml -o ALL.yaml";

/// Arguments of `shsa run`.
#[derive(clap::Args)]
#[command(
    after_help = "Example: shsa run            (a simulated robot in this process; see http://127.0.0.1:7410/state)

State, decisions and figures are served over HTTP, on this machine only unless --http says otherwise:
GET /health, /state, /events, /events/stream, /metrics; POST /orders with `Authorization: Bearer TOKEN`.
On the bus: shsa/NAME/events, and shsa/NAME/need/VARIABLE with the quality of each need; requests to shsa/NAME/request."
)]
pub(crate) struct Arguments {
    /// The knowledge bases, YAML or JSON; none: the model of the simulated robot.
    models: Vec<PathBuf>,
    #[command(flatten)]
    bus: BusArguments,
    #[command(flatten)]
    watching: Watching,
    #[command(flatten)]
    isolation: IsolationArguments,
    /// What this instance is called on the bus.
    #[arg(long, default_value = "shsa", value_name = "NAME")]
    name: String,
    /// Announce the model to other instances, and join what theirs know about the same things, while they are there
    /// (Zenoh and ROS 2). Whoever is on the bus can add to what is known then.
    #[arg(long)]
    join: bool,
    /// Where the control interface listens: ADDRESS:PORT, or `off`.
    #[arg(long, default_value = "127.0.0.1:7410", value_name = "ADDRESS", value_parser = http_address)]
    http: HttpAddress,
    /// A file whose first line is the token that orders need; else it is taken from SHSA_TOKEN. Without one,
    /// nothing can be changed.
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// How the values of needs are written.
    #[arg(long, value_name = "FORM", default_value = "plain")]
    form: Form,
    /// How single needs go out: their form, and where the substitute takes the failed source's name, how that source is
    /// silenced (docs/deployment.md).
    #[arg(long, value_name = "FILE")]
    wiring: Option<PathBuf>,
    /// Keep in FOLDER/MODEL.json what must outlast the process: verdicts, orders, what serves each need; and go on from
    /// there.
    #[arg(long, value_name = "FOLDER")]
    state: Option<PathBuf>,
    /// Write every input to FOLDER/MODEL.jsonl, which can be replayed and explained.
    #[arg(long, value_name = "FOLDER")]
    journal: Option<PathBuf>,
    /// How large a file of the journal grows, MiB; then another is begun.
    #[arg(long, value_name = "MIB", default_value_t = 64, value_parser = clap::value_parser!(u64).range(1..))]
    journal_size: u64,
    /// How many older files of the journal are kept.
    #[arg(long, value_name = "N", default_value_t = 7)]
    journal_keep: usize,
    /// End by itself after this time, as `90 s`.
    #[arg(long = "for", value_name = "TIME", value_parser = shsa_format::recording::parse_span)]
    duration: Option<Span>,
    /// Print decisions as JSON lines instead of text.
    #[arg(long)]
    json: bool,
}

/// Where to listen; `None` for nowhere.
type HttpAddress = Option<SocketAddr>;

fn http_address(text: &str) -> Result<HttpAddress, String> {
    match text {
        "off" => Ok(None),
        text => {
            text.parse().map(Some).map_err(|_| "write ADDRESS:PORT, as 127.0.0.1:7410, or off".to_owned())
        }
    }
}

/// Runs until it is interrupted, or its time is over.
///
/// # Errors
/// When a model is wrong, or the bus or the address for HTTP cannot be had.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let is_told = matches!(arguments.bus.bus, Address::Zenoh(_) | Address::Ros2(_));
    anyhow::ensure!(is_told || !arguments.join, NO_JOIN);
    let models = models(&arguments.models)?;
    let token = Token::find(arguments.token_file.as_deref())?;
    let clock = Clock::running();
    let inbox = Inbox::new(arguments.bus.queue, clock.clone());
    let memory = MemoryBus::new(clock.clone());
    let mut bridge = arguments.bus.open(&arguments.name, inbox.clone(), &memory)?;
    let options = Options { watch: arguments.watching.budget(), ..Options::default() };
    for (_, live) in &models {
        unwatched::declared(live.knowledge(), options.watch).iter().for_each(show::warn);
    }
    let outgoings = outgoings(arguments, &models)?;
    let healer =
        |(path, live): (PathBuf, Live)| Healer::new(&path, live, options, outgoings.clone(), bridge.as_mut());
    let healers = models.into_iter().map(healer);
    let mut healers = healers.collect::<anyhow::Result<Vec<_>>>()?;
    healers.iter_mut().try_for_each(|healer| healer.isolate(&arguments.isolation, inbox.clone()))?;
    if let Some(folder) = &arguments.journal {
        let bounds = Bounds { size: arguments.journal_size << 20, older: arguments.journal_keep };
        healers.iter_mut().try_for_each(|healer| healer.keep_journal(folder, bounds))?;
    }

    if let Some(folder) = &arguments.state {
        healers.iter_mut().try_for_each(|healer| healer.keep_state(folder, clock.now()))?;
    }

    let style = if arguments.json { Style::Json } else { Style::Text };
    let herald = Herald::new(format!("shsa/{}/events", arguments.name), style, clock.now())?;
    let (desk, requests) = Desk::new(inbox.clone());
    if token.is_some() && !arguments.bus.is_private() {
        show::tell(
            "the bus is not encrypted: who gives an order over it shows the token to everyone on the network",
        );
    }
    let guard = Guard::new(token);
    let tally = bus::serve(&arguments.name, bridge.as_mut(), desk.clone(), guard.clone())?;
    if let Some(address) = arguments.http {
        let address = http::serve(address, desk, guard, herald.listeners())?;
        show::tell(&format!("state, events and metrics: http://{address}/state"));
    }
    let stop = stop_on_signals(inbox)?;
    if arguments.bus.bus == Address::Memory {
        show::tell("no bus was given: a simulated robot drives about in this process (see --bus)");
        demo::simulate(&memory, &stop)?;
    }
    let until = arguments.duration.map(|duration| clock.now() + duration);
    let shares = Shares::new(&arguments.name, bridge.as_ref())?;
    let parts = if arguments.join { Parts::new(&arguments.name, &healers, bridge.as_mut())? } else { None };
    let session = Session {
        shares,
        parts,
        name: arguments.name.clone(),
        bridge,
        healers,
        herald,
        figures: Figures::new()?,
        requests,
        stop,
        until,
        rests_until: Time::MIN,
        house: House::new(),
        tally,
    };
    Helm::take(session)
}

/// How needs go out, by the arguments and the operator's file.
fn outgoings(arguments: &Arguments, models: &[(PathBuf, Live)]) -> anyhow::Result<Outgoings> {
    let models: Vec<_> = models.iter().map(|(_, live)| live.knowledge()).collect();
    let wiring = arguments.wiring.as_ref().map(|path| Wiring::load(path, &models)).transpose();
    let wiring = wiring.map_err(|report| {
        show::tell_report(&report);
        AlreadyTold
    })?;
    Ok(Outgoings { form: arguments.form, wiring: wiring.unwrap_or_default() })
}

/// A run of one model over a bridge that somebody else has opened, without a terminal, HTTP and files, for measurements: what
/// runs it until `stop` is raised, and what asks it for its state meanwhile (`None`: it has ended).
///
/// # Errors
/// When the bus refuses.
pub(crate) fn within(
    name: &str,
    live: Live,
    bridge: Box<dyn Bridge>,
    stop: Arc<AtomicBool>,
) -> anyhow::Result<(impl FnOnce() -> anyhow::Result<Outcome> + Send, impl Fn() -> Option<Value>)> {
    let outgoings = Outgoings { form: Form::Plain, wiring: Wiring::default() };
    let (session, desk) = session(name, live, outgoings, bridge, stop)?;
    let state = move || match desk.ask(Request::State)? {
        Reply::Json(state) => Some(state),
        Reply::Text(_) | Reply::Refused(_) => None,
    };
    Ok((move || Helm::take(session), state))
}

/// The same as parts: what runs, and where it is asked.
fn session(
    name: &str,
    live: Live,
    outgoings: Outgoings,
    mut bridge: Box<dyn Bridge>,
    stop: Arc<AtomicBool>,
) -> anyhow::Result<(Session, Desk)> {
    let healer = Healer::new(Path::new(name), live, Options::default(), outgoings, bridge.as_mut())?;
    let inbox = bridge.inbox().clone();
    let (desk, requests) = Desk::new(inbox.clone());
    let session = Session {
        shares: Shares::new(name, bridge.as_ref())?,
        name: name.to_owned(),
        healers: vec![healer],
        herald: Herald::new(format!("shsa/{name}/events"), Style::Silent, inbox.clock().now())?,
        figures: Figures::new()?,
        requests,
        tally: Arc::default(),
        parts: None,
        stop,
        until: None,
        rests_until: Time::MIN,
        house: House::new(),
        bridge,
    };
    Ok((session, desk))
}

/// Loads the models, or the one of the simulated robot.
fn models(paths: &[PathBuf]) -> anyhow::Result<Vec<(PathBuf, Live)>> {
    if !paths.is_empty() {
        return paths.iter().map(|path| Ok((path.clone(), show::load_live(path)?))).collect();
    }
    let (name, text) = ROVER;
    let (live, _) =
        Live::load(Written { name, text }).map_err(|report| anyhow::anyhow!(report.render(false)))?;
    Ok(vec![(Path::new(name).to_owned(), live)])
}

/// A flag that is raised when the process is asked to end; the wait for the inbox ends then.
pub(crate) fn stop_on_signals(inbox: Inbox) -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let mut signals = Signals::new([SIGINT, SIGTERM]).context("listening for signals")?;
    let raised = stop.clone();
    thread::Builder::new().name("signals".into()).spawn(move || {
        for _ in signals.forever() {
            raised.store(true, Ordering::Release);
            inbox.wake();
        }
    })?;
    Ok(stop)
}
