//! `shsa service`: inputs, a program, outputs; the generic service of the thesis (Algorithm 1, Listing 1.1).
//!
//! ```text
//! bus -> ports (latest values) -> formulas -> outlets -> bus
//!     -> tracks of sensors -> association ->
//! ```

mod outlet;
mod ports;
mod program;
mod stdio;
mod timing;
mod tracks;
mod work;
mod association;
mod session;

use crate::bus::BusArguments;
use crate::log::{Log, LogArguments};
use crate::outcome::{AlreadyReported, Outcome};
use crate::run::instance_name;
use crate::run::stop_on_signals;
use crate::show;
use association::Working;
use outlet::Outlet;
use ports::Ports;
use program::Formulas;
use session::{Session, Watch};
use shsa_bridge::memory::MemoryBus;
use shsa_bridge::{Bridge, Clock, Inbox, Provenance, Quality};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time, Validity};
use shsa_format::association::Associations;
use shsa_message::span::parse_span;
use shsa_runtime::FEWEST_EXECUTIONS;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use stdio::Pipes;
use timing::{Figures, Pace};
use work::{Computation, Work};

/// The longest time for trials before the start.
const TRIALS_TAKE: Duration = Duration::from_millis(500);

/// Arguments of `shsa service`.
#[derive(clap::Args)]
#[command(
    after_help = "Example: shsa service -i /left#data -i /right#data -p \"y = (x[0] + x[1]) / 2\" -o /mean#data --bus zenoh

x[0], x[1].. are the inputs and y[0], y[1].. the outputs, in their order; x and y alone where there is one. The language is that of \
models, without units: + - * / ^, if, min, max, sqrt, either, previous, derivative, integral, delay and others. An input that is \
missing or too old has no value, and neither has a result that needs it. A bus that cannot be reached is reported at once, and tried \
again for the time of --patience.

With --associate the service finds out which tracks of several sensors, such as radars, are of one object (docs/association.md).

Exit status: 0 after a signal or the end of its life; 2 bad usage; 4 the bus could not be reached for longer than --patience."
)]
pub(crate) struct Arguments {
    /// Instead of inputs, formulas and outputs: associate the tracks of sensors, as this file says.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["input", "program", "output", "period", "complete", "max_age", "vector"])]
    associate: Option<PathBuf>,
    /// The inputs, as TOPIC#FIELD, in their order: several at once, or one after the other.
    #[arg(short, long = "input", value_name = "TOPIC#FIELD", num_args = 1..)]
    input: Vec<String>,
    /// The computation: `y = x[0] + x[1]`; several statements with `;` or several times.
    #[arg(short, long, value_name = "FORMULA", required_unless_present = "associate")]
    program: Vec<String>,
    /// The outputs, as TOPIC or TOPIC#FIELD, in their order: several at once, or one after the other.
    #[arg(short, long = "output", value_name = "TOPIC#FIELD", num_args = 1.., required_unless_present = "associate")]
    output: Vec<String>,
    /// Compute in this period, as `100 ms`, on the latest values; else with each new value, when all inputs are known.
    #[arg(long, value_name = "TIME", value_parser = parse_span, conflicts_with = "complete")]
    period: Option<Span>,
    /// Wait until every input has a new value.
    #[arg(long)]
    complete: bool,
    /// How old a value may be when it is used; once for all inputs, or once for each.
    #[arg(long, value_name = "TIME", value_parser = parse_span)]
    max_age: Vec<Span>,
    /// Inputs that are lists, by their numbers: `0,2`.
    #[arg(long, value_name = "N", value_delimiter = ',')]
    vector: Vec<usize>,
    /// Print figures on standard error in this period, and at the end: counts, execution times.
    #[arg(long, value_name = "TIME", value_parser = parse_span)]
    stats: Option<Span>,
    /// End when the bus cannot be reached for this time, as `5 s`; else it is waited for.
    #[arg(long, value_name = "TIME", value_parser = parse_span)]
    patience: Option<Span>,
    /// End by itself after this time.
    #[arg(long = "for", value_name = "TIME", value_parser = parse_span)]
    duration: Option<Span>,
    /// The name of the service on the bus.
    #[arg(long, default_value = "shsa-service", value_name = "NAME", value_parser = instance_name)]
    name: String,
    /// Instead of a bus: messages on standard input and output, as lines like
    /// {"topic": "/left", "payload": {"data": 1.5}, "stamp_ns": 5}.
    #[arg(long, conflicts_with = "bus")]
    stdio: bool,
    #[command(flatten)]
    bus: BusArguments,
    #[command(flatten)]
    log: LogArguments,
}

/// Computes until it is interrupted, or its duration has passed.
///
/// # Errors
/// When the arguments are invalid, or the bus cannot be used or refuses something.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    Log::begin(&arguments.log);
    let (work, pace) = match &arguments.associate {
        Some(file) => (association(file)?, Pace::Any),
        None => computation(arguments)?,
    };
    let clock = Clock::running();
    let inbox = Inbox::new(arguments.bus.queue, clock.clone());
    let stop = stop_on_signals(inbox.clone())?;
    let topics = work.topics();
    let mut bridge: Box<dyn Bridge> = match arguments.stdio {
        true => Box::new(Pipes::open(inbox, stop.clone(), topics.clone())?),
        false => arguments.bus.options().open(&arguments.name, inbox, &MemoryBus::new(clock.clone()))?,
    };
    for topic in &topics {
        bridge.subscribe(topic, None)?;
    }
    let session = Session {
        bridge,
        work,
        pace,
        figures: Figures::new()?,
        stop,
        until: arguments.duration.map(|duration| clock.now() + duration),
        bus: arguments.bus.bus.clone(),
        patience: arguments.patience,
        stats: arguments.stats,
        watch: Watch::default(),
    };
    session.run()
}

fn association(file: &Path) -> anyhow::Result<Box<dyn Work>> {
    let read = Associations::load(file).map_err(|report| {
        show::print_report(&report);
        AlreadyReported
    })?;
    Ok(Box::new(Working::new(read)?))
}

fn computation(arguments: &Arguments) -> anyhow::Result<(Box<dyn Work>, Pace)> {
    let outlets =
        arguments.output.iter().map(|text| Outlet::new(text)).collect::<anyhow::Result<Vec<_>>>()?;
    let counts = (arguments.input.len(), outlets.len());
    if let Some(at) = arguments.vector.iter().find(|at| **at >= counts.0) {
        anyhow::bail!("--vector {at}: there are {} inputs, counted from 0", counts.0);
    }
    if counts.0 == 0 && arguments.period.is_none() {
        anyhow::bail!("a service without inputs computes nothing on its own: give it a --period");
    }
    let mut formulas =
        Formulas::read(&arguments.program, counts.0, counts.1, &arguments.vector).map_err(|problems| {
            show::notice(problems.trim_end());
            AlreadyReported
        })?;
    let pace = match (arguments.period, arguments.complete) {
        (Some(period), _) => Pace::Every(fit_period(period, &mut formulas, arguments)?),
        (None, true) => Pace::All,
        (None, false) => Pace::Any,
    };
    let ports = Ports::new(&arguments.input, &arguments.max_age)?;
    let source = format!("{} by {}", arguments.input.join(", "), arguments.program.join("; "));
    let provenance = Provenance::new(Quality::Good, source);
    Ok((Box::new(Computation { ports, formulas, outlets, provenance }), pace))
}

/// Checks that the program can be evaluated within a period, and warns where it takes longer now and then; what is overdue is
/// shed.
fn fit_period(period: Span, formulas: &mut Formulas, arguments: &Arguments) -> anyhow::Result<Span> {
    if period <= Span::ZERO {
        anyhow::bail!("a period is longer than no time");
    }
    let example = |at: usize| match arguments.vector.contains(&at) {
        true => RawValue::Vector(vec![1.0; 16]),
        false => RawValue::Number(1.0),
    };
    let values: Vec<RawValue> = (0..arguments.input.len()).map(example).collect();
    let values: Vec<Option<&RawValue>> = values.iter().map(Some).collect();
    let mut trials = Figures::new()?;
    let began = Instant::now();
    let mut fastest = Duration::MAX;
    while trials.evaluated < FEWEST_EXECUTIONS && (began.elapsed() < TRIALS_TAKE || trials.evaluated == 0) {
        let at = Time::from_seconds(trials.evaluated as f64);
        let began = Instant::now();
        formulas.evaluate(&values, Validity { from: at, to: at });
        let took = began.elapsed();
        trials.took(took);
        fastest = fastest.min(took);
    }
    formulas.reset();
    if fastest.as_nanos() > u128::from(period.0.unsigned_abs()) {
        anyhow::bail!(
            "a period of {:.3} us is shorter than one evaluation, which takes {:.3} us at the least",
            period.seconds() * 1e6,
            fastest.as_secs_f64() * 1e6
        );
    }
    if let Some(bound) = trials.bound().filter(|bound| *bound > period) {
        show::warn(format_args!(
            "one evaluation in a thousand takes up to {:.3} us (95 % confidence), longer than the period of {:.3} us: what is overdue is left out",
            bound.seconds() * 1e6,
            period.seconds() * 1e6
        ));
    }
    Ok(period)
}
