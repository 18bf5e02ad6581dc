//! `shsa run`: heals a running system with the library `shsa-runtime`: its arguments and its output.

#[cfg(feature = "foxglove")]
mod foxglove;
mod isolation;
mod name;
mod record;

pub(crate) use name::instance_name;

use crate::bus::BusArguments;
use crate::headings::OUTPUT;
use crate::log::{self, Log, LogArguments};
use crate::outcome::{AlreadyReported, Outcome};
use crate::watch::Watching;
use crate::{service_manager, show};
use anyhow::Context;
use clap::Parser;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use isolation::IsolationArguments;
use shsa_bridge::memory::MemoryBus;
use shsa_bridge::{Address, Clock, Inbox};
use shsa_core::engine;
use shsa_core::time::Span;
use shsa_demo::rover;
use shsa_format::wiring::{Form, Wiring};
use shsa_message::span::parse_span;
use shsa_model::live::{Live, Written};
use shsa_report::analysis::unwatched;
use shsa_report::event_text;
use shsa_report::explanation::evidence_json;
use shsa_runtime::{
    Decision, Ending, Handle, JournalOptions, JournalSeal, Model, Options, Order, Printer, Runtime,
    SigningKey, Token, substitute,
};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::iterator::Signals;
use std::io::stdout;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

/// The name of the model of the simulated robot.
const ROVER: &str = "models/rover.yaml";

/// Why `--join` is refused.
const NO_JOIN: &str = "--join is not possible on this bus, which does not tell what instances are there: use --bus zenoh://HOST:PORT or \
ros2://HOST:PORT, or put the models together before, by shsa model join A.yaml B.yaml -o ALL.yaml";

/// Why `--home-assistant` is refused.
const NO_DISCOVERY: &str =
    "--home-assistant needs the broker that Home Assistant is connected to: use --bus mqtt://HOST:PORT";

/// Arguments of `shsa run`.
#[derive(clap::Args)]
#[command(
    after_help = "Example: shsa run            (a simulated robot in this process; see http://127.0.0.1:7410/)

State, decisions and figures are served over HTTP, on this machine only unless --http says otherwise:
GET /health, /state, /events, /events/stream, /metrics; POST /orders with `Authorization: Bearer TOKEN`.
On the bus: shsa/NAME/events, and shsa/NAME/need/VARIABLE with the quality of each need; requests to shsa/NAME/request."
)]
pub(crate) struct Arguments {
    /// The knowledge bases, YAML or JSON; none and no bus: the model of the simulated robot.
    models: Vec<PathBuf>,
    /// The name of this instance on the bus.
    #[arg(long, default_value = "shsa", value_name = "NAME", value_parser = instance_name)]
    name: String,
    /// Announce the model to other instances, and join what theirs know about the same things, while they are there
    /// (Zenoh and ROS 2). Whoever is on the bus can add to what is known then.
    #[arg(long)]
    join: bool,
    #[arg(long, help = form_help(), value_name = "FORM", default_value = "plain", value_parser = forms(), hide_possible_values = true)]
    form: Form,
    /// How single needs are published: their form, and where the substitute takes the failed source's name, how that source is
    /// silenced (docs/deployment.md).
    #[arg(long, value_name = "FILE")]
    wiring: Option<PathBuf>,
    /// Keep in FOLDER/MODEL.json what must outlast the process: verdicts, orders, what serves each need; and go on from
    /// there.
    #[arg(long, value_name = "FOLDER")]
    state: Option<PathBuf>,
    /// End by itself after this time, as `90 s`.
    #[arg(long = "for", value_name = "TIME", value_parser = parse_span)]
    duration: Option<Span>,
    /// Print decisions as JSON lines instead of text, as they are published on the bus.
    #[arg(long, conflicts_with = "log_format")]
    json: bool,
    /// Where the control interface listens: ADDRESS:PORT, or `off`.
    #[arg(long, default_value = "127.0.0.1:7410", value_name = "ADDRESS", value_parser = http_address, help_heading = CONTROL)]
    http: HttpAddress,
    /// A name of this host by which it may be asked over HTTP, beside its addresses and `localhost`; may be given several times.
    /// Any other name is refused, to prevent DNS rebinding.
    #[arg(long, value_name = "NAME", help_heading = CONTROL)]
    http_host: Vec<String>,
    /// Another instance to whose page the live page leads, as `truck=http://10.0.0.2:7410/`; may be given several times.
    #[arg(long, value_name = "NAME=URL", value_parser = named_page, help_heading = CONTROL)]
    other_page: Vec<(String, String)>,
    /// A file whose first line is the token that orders need; else it is taken from SHSA_TOKEN. Without one,
    /// nothing can be changed.
    #[arg(long, value_name = "FILE", help_heading = CONTROL)]
    token_file: Option<PathBuf>,
    /// A file whose first line is the token that looking needs over HTTP and the bus, but for the health; else it is taken from
    /// SHSA_VIEW_TOKEN. Without one, everyone who can reach it may look.
    #[arg(long, value_name = "FILE", help_heading = CONTROL)]
    view_token_file: Option<PathBuf>,
    #[command(flatten)]
    watching: Watching,
    /// Write every input to FOLDER/MODEL.jsonl, which can be replayed and explained.
    #[arg(long, value_name = "FOLDER", help_heading = OUTPUT)]
    journal: Option<PathBuf>,
    /// How large a file of the journal grows, MiB; then another is begun.
    #[arg(long, value_name = "MIB", default_value_t = 64, value_parser = clap::value_parser!(u64).range(1..), help_heading = OUTPUT)]
    journal_size: u64,
    /// How many older files of the journal are kept.
    #[arg(long, value_name = "N", default_value_t = 7, help_heading = OUTPUT)]
    journal_keep: usize,
    /// Let each record of the journal carry the hash of the one before, so that `shsa journal verify` finds what was changed; who
    /// gives an order is written down as well.
    #[arg(long, requires = "journal", help_heading = OUTPUT)]
    journal_seal: bool,
    /// Seal the journal, and sign the end of each of its files by the private Ed25519 key in this file.
    #[arg(long, value_name = "FILE", requires = "journal", help_heading = OUTPUT)]
    journal_key: Option<PathBuf>,
    /// Write the run as a file of MCAP, for Foxglove, Rerun and PlotJuggler, as `shsa replay --record` does; of one model only. It
    /// grows until the run ends, and can be replayed.
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    record: Option<PathBuf>,
    #[command(flatten)]
    viewers: ViewerArguments,
    #[command(flatten)]
    isolation: IsolationArguments,
    #[command(flatten)]
    bus: BusArguments,
    #[command(flatten)]
    log: LogArguments,
}

/// The heading of options about the control interface.
const CONTROL: &str = "Control interface";

/// The arguments about viewers that follow the run.
#[derive(Clone, Debug, clap::Args)]
struct ViewerArguments {
    /// Send what a record has to Foxglove and others that speak its WebSocket protocol, while the run goes on; of one model only.
    #[cfg(feature = "foxglove")]
    #[arg(long, value_name = "ADDRESS:PORT", num_args = 0..=1, require_equals = true, default_missing_value = "127.0.0.1:8765", help_heading = OUTPUT)]
    foxglove: Option<SocketAddr>,
    /// Announce needs and verdicts to Home Assistant by its discovery over MQTT, under topics that begin with PREFIX.
    #[arg(long, value_name = "PREFIX", num_args = 0..=1, require_equals = true, default_missing_value = "homeassistant", help_heading = OUTPUT)]
    home_assistant: Option<String>,
    /// Write a layout for Foxglove that shows the run.
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    layout: Option<PathBuf>,
}

/// The arguments alone, as they are when none is given.
#[derive(clap::Parser)]
struct Alone {
    #[command(flatten)]
    arguments: Arguments,
}

impl Arguments {
    /// Those of a run of the simulated robot in this process.
    pub(crate) fn of_the_robot() -> Arguments {
        Alone::parse_from(["shsa"]).arguments
    }
}

/// Describes the forms of values.
fn form_help() -> String {
    let forms = Form::ALL.map(|(name, _, what)| format!("`{name}`: {what}"));
    format!("How the values of needs are written. {}", forms.join(". "))
}

/// Reads the form of values.
fn forms() -> impl TypedValueParser<Value = Form> {
    let names = Form::ALL.map(|(name, ..)| PossibleValue::new(name));
    PossibleValuesParser::new(names).try_map(|name| Form::named(&name).ok_or("there is no such form"))
}

/// Arguments of `shsa substitute`, which `shsa run` calls.
#[derive(clap::Args)]
pub(crate) struct SubstituteArguments {
    /// The memory that it may take, bytes.
    #[arg(long, value_name = "BYTES")]
    memory: u64,
}

/// Computes a substitute until its input ends.
///
/// # Errors
/// When the starting process does not read the output.
pub(crate) fn compute(arguments: &SubstituteArguments) -> anyhow::Result<Outcome> {
    Ok(if substitute(arguments.memory)? { Outcome::Done } else { Outcome::Bad })
}

/// What DDS cannot be limited to.
const OPEN_PORTS: &str = "DDS announces itself only on the interfaces of --bus, but takes datagrams from all of them, and a forged one can \
make it take all memory: close UDP ports 7400 and above to others by a firewall";

/// The address to listen on; `None`: nowhere.
type HttpAddress = Option<SocketAddr>;

fn http_address(text: &str) -> Result<HttpAddress, String> {
    match text {
        "off" => Ok(None),
        text => {
            text.parse().map(Some).map_err(|_| "write ADDRESS:PORT, as 127.0.0.1:7410, or off".to_owned())
        }
    }
}

/// A name and the address of a page.
fn named_page(text: &str) -> Result<(String, String), String> {
    let named = text.split_once('=').filter(|(name, _)| !name.is_empty());
    let is_page = |url: &str| url.starts_with("http://") || url.starts_with("https://");
    let named = named.filter(|(_, url)| is_page(url));
    let (name, url) = named.ok_or("write NAME=URL, as truck=http://10.0.0.2:7410/")?;
    Ok((name.to_owned(), url.to_owned()))
}

/// Runs until it is interrupted, or its duration has passed.
///
/// # Errors
/// When a model is invalid, or the bus or the HTTP address cannot be used.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let log = Log::begin(&arguments.log);
    let is_reported = matches!(arguments.bus.bus, Address::Zenoh(_) | Address::Ros2(_));
    anyhow::ensure!(is_reported || !arguments.join, NO_JOIN);
    let has_discovery =
        arguments.viewers.home_assistant.is_none() || matches!(arguments.bus.bus, Address::Mqtt(_));
    anyhow::ensure!(has_discovery, NO_DISCOVERY);
    let models = models(&arguments.models, &arguments.bus)?;
    let options = options(arguments, &models, log)?;
    let has_token = options.token.is_some();
    let clock = Clock::running();
    let memory = MemoryBus::new(clock.clone());
    let bus = arguments.bus.options();
    let bridge = bus.open(&arguments.name, Inbox::new(arguments.bus.queue, clock), &memory)?;
    for model in &models {
        unwatched(model.live.knowledge(), options.engine.watch).iter().for_each(show::warn);
    }
    let runtime = Runtime::new(models, options, bridge)?;
    if has_token && !bus.is_private() {
        show::notice(
            "the bus is not encrypted: who gives an order over it shows the token to everyone on the network",
        );
    }
    if let Address::Ros2Dds(_) = arguments.bus.bus {
        show::notice(OPEN_PORTS);
    }
    if let Some(address) = arguments.http {
        let address = runtime.serve_http(address, &arguments.http_host)?;
        show::notice(&format!("state, events and metrics: http://{address}/state"));
        show::notice(&format!("the page: http://{address}/"));
    }
    let (handle, stop) = (runtime.handle(), Arc::new(AtomicBool::new(false)));
    let raised = stop.clone();
    service_manager::attend(runtime.handle())?;
    log::print_figures(log, runtime.handle())?;
    on_signals([SIGINT, SIGTERM, SIGHUP, SIGXFSZ], move |signal| match signal {
        SIGHUP => reload(&handle),
        // A file beyond its size limit is treated like a full disk: the write fails, and the process goes on.
        SIGXFSZ => {}
        _ => {
            service_manager::notify("STOPPING=1");
            raised.store(true, Ordering::Release);
            handle.stop();
        }
    })?;
    if arguments.bus.bus == Address::Memory {
        show::notice("no bus was given: a simulated robot drives about in this process (see --bus)");
        rover::simulate(&memory, &stop)?;
    }
    Ok(match runtime.run()? {
        // A requested end is a success.
        _ if stop.load(Ordering::Acquire) => Outcome::Done,
        Ending::Served => Outcome::Done,
        Ending::Unserved => Outcome::No,
    })
}

/// Orders a reload of the models.
fn reload(handle: &Handle) {
    service_manager::notify("RELOADING=1");
    if let Err(why) = handle.order(Order::Reload { force: false }) {
        show::warn(format!("the models stay as they are: {why}"));
    }
    service_manager::notify("READY=1");
}

/// The options of the run from the arguments, for these models.
fn options(arguments: &Arguments, models: &[Model], log: Log) -> anyhow::Result<Options> {
    let engine = engine::Options { watch: arguments.watching.budget(), ..engine::Options::default() };
    let recorders = record::recorder(arguments, models, engine)?.into_iter().collect();
    let models: Vec<_> = models.iter().map(|model| model.live.knowledge()).collect();
    let token = Token::find(arguments.token_file.as_deref(), "SHSA_TOKEN")?;
    let view_token = Token::find(arguments.view_token_file.as_deref(), "SHSA_VIEW_TOKEN")?;
    let wiring = arguments.wiring.as_ref().map(|path| Wiring::load(path, &models)).transpose();
    let wiring = wiring.map_err(|report| {
        show::print_report(&report);
        AlreadyReported
    })?;
    let seal = match (&arguments.journal_key, arguments.journal_seal) {
        (Some(key), _) => JournalSeal::Signed(SigningKey::read(key)?),
        (None, true) => JournalSeal::Chained,
        (None, false) => JournalSeal::Off,
    };
    let journal = |folder: &PathBuf| JournalOptions {
        folder: folder.clone(),
        size: arguments.journal_size << 20,
        older: arguments.journal_keep,
        seal,
    };
    Ok(Options {
        name: arguments.name.clone(),
        engine,
        form: arguments.form,
        wiring: wiring.unwrap_or_default(),
        sandbox: arguments.isolation.options()?,
        journal: arguments.journal.as_ref().map(journal),
        recorders,
        state: arguments.state.clone(),
        home_assistant: arguments.viewers.home_assistant.clone(),
        join: arguments.join,
        token,
        view_token,
        duration: arguments.duration,
        printer: Some(printer(arguments.json, log)),
        other_pages: arguments.other_page.clone(),
        explainer: Some(Box::new(evidence_json)),
    })
}

/// A printer of decisions.
fn printer(is_json: bool, log: Log) -> Printer {
    let printer = match is_json {
        true => Printer::json(stdout()),
        false => Printer::text(stdout(), move |decision| log.decision(decision, || line(decision))),
    };
    printer.only(move |decision| log.includes(decision))
}

/// A decision as text.
fn line(decision: &Decision<'_>) -> String {
    let time = |after: Span| format!("{:>9.3} s", after.seconds());
    match decision {
        Decision::Decided { after, knowledge, event, .. } => {
            event_text(show::style(), &time(*after), knowledge, event)
        }
        Decision::Noted { after, kind, because, .. } => format!("{}  {kind:<11} {because}", time(*after)),
    }
}

/// Loads the models; without any, that of the simulated robot, which runs without a bus.
fn models(paths: &[PathBuf], bus: &BusArguments) -> anyhow::Result<Vec<Model>> {
    if !paths.is_empty() {
        return paths.iter().map(|path| Ok(Model::of_file(path, show::load_live(path)?))).collect();
    }
    if bus.bus != Address::Memory {
        anyhow::bail!("no model was given: name one, as in `shsa run MODEL --bus {}`", bus.bus);
    }
    let (name, text) = (ROVER, rover::MODEL);
    let (live, _) =
        Live::load(Written { name, text }).map_err(|report| anyhow::anyhow!(report.render(false)))?;
    Ok(vec![Model::of_file(Path::new(name), live)])
}

/// Calls a function for each of these signals.
fn on_signals<const N: usize>(
    signals: [i32; N],
    act: impl FnMut(i32) + Send + 'static,
) -> anyhow::Result<()> {
    let mut signals = Signals::new(signals).context("listening for signals")?;
    let each = move || signals.forever().for_each(act);
    thread::Builder::new().name("signals".into()).spawn(each)?;
    Ok(())
}

/// A flag that is set when the process is asked to end; this also wakes the reader of the inbox.
pub(crate) fn stop_on_signals(inbox: Inbox) -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let raised = stop.clone();
    on_signals([SIGINT, SIGTERM], move |_| {
        raised.store(true, Ordering::Release);
        inbox.wake();
    })?;
    Ok(stop)
}
