//! `shsa draft`: the first model of a system, from its recordings or its bus.
//!
//! `recordings -> columns -> units (asked) -> draft -> what measures the same (asked) -> needs (asked) -> model file`

mod ask;

use crate::bus::BusArguments;
use crate::columns::{ColumnArguments, names, write};
use crate::outcome::Outcome;
use crate::progress::Search;
use crate::{scan, show, written};
use anyhow::bail;
use ask::Asking;
use shsa_core::time::Span;
use shsa_format::text::counted;
use shsa_lab::drafting::{Drafted, checked_text, draft, why_nothing};
use shsa_message::span::parse_span;
use std::io::{IsTerminal, stderr, stdin};
use std::path::{Path, PathBuf};

/// Arguments of `shsa draft`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa draft drive/ -o car.yaml
         shsa calibrate car.yaml drive/ -o tuned.yaml
         shsa draft drive/ -o car.yaml --yes
         shsa draft --bus mqtt://localhost --for 10min -o plant.yaml

A draft says which columns are signals, which of them measure the same, and with which numbers. Each number that can be a signal is one. Signals that measure the same share a variable: their values are equal but for an offset \
and a delay; or their names differ by a number only, and their values are near. Comments give the figure for each decision. The file \
is valid as it is; `shsa calibrate` then fits the tolerances, and `shsa learn` finds relations.

On a terminal, `draft` asks what no recording says: units that the headers leave out, whether signals with names of one kind measure \
the same, and which variables must stay available, how fresh. An empty answer takes the proposal in brackets; the end of the input \
does so for all that is left. --yes takes every proposal without a question. Without a terminal and without --yes, what is not certain \
is commented out: guessed units, candidates of relations, ranges of what drifts.

From a bus, a draft states what was received: listen until the plant has been through what it usually does.

Rows of several sources in one table: shsa draft motes.csv --by mote_id --time-column reading --time-unit 5s

Exit status: 1 when no message is received from the bus; 4 when it cannot be reached.")]
pub(crate) struct Arguments {
    /// Files and folders of any format; files of the same time form one recording.
    #[arg(required_unless_present = "bus", conflicts_with = "bus", value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// Where to write the model; `-` is standard output.
    #[arg(short, long, value_name = "FILE", default_value = "-")]
    output: PathBuf,
    /// Ask nothing, and take every proposal.
    #[arg(long)]
    yes: bool,
    /// How long to listen on the bus, as `10 s`.
    #[arg(long = "for", value_name = "TIME", default_value = "5s", value_parser = parse_span, requires = "bus")]
    duration: Span,
    /// With --bus: leave out the signals that this model has.
    #[arg(long, value_name = "MODEL", requires = "bus")]
    model: Option<PathBuf>,
    #[command(flatten)]
    bus: BusArguments,
    #[command(flatten)]
    columns: ColumnArguments,
}

/// Arguments of `shsa init`, which `shsa draft` replaces.
#[derive(clap::Args)]
pub(crate) struct OldArguments {
    /// Files and folders of any format; files of the same time form one recording.
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// Where to write the model; a file that exists is not replaced.
    #[arg(short, long, value_name = "FILE", default_value = "model.yaml")]
    output: PathBuf,
    /// Ask nothing, and take every proposal.
    #[arg(long)]
    yes: bool,
    #[command(flatten)]
    columns: ColumnArguments,
}

/// A draft of recordings.
struct Drafting<'a> {
    recordings: &'a [PathBuf],
    columns: &'a ColumnArguments,
    output: &'a Path,
    /// Who answers questions; `None` asks none, and leaves open what is not certain.
    asking: Option<Asking>,
}

/// Drafts a model.
///
/// # Errors
/// When a recording cannot be read, the bus cannot be used, or nothing there can be a signal.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let Arguments { recordings, columns, output, .. } = arguments;
    written::ensure_free([output.as_path()], &recordings.iter().chain(&arguments.model).collect::<Vec<_>>())?;
    if recordings.is_empty() {
        return received(arguments);
    }
    let is_terminal = stdin().is_terminal() && stderr().is_terminal();
    if is_terminal && !arguments.yes {
        ensure_new(output)?;
    }
    let asking = (arguments.yes || is_terminal).then(|| Asking::new(arguments.yes));
    Drafting { recordings, columns, output, asking }.write()
}

/// As `shsa init` did: asks, also without a terminal, and replaces no file.
///
/// # Errors
/// When a recording cannot be read, nothing in it can be a signal, or the file exists or cannot be written.
pub(crate) fn init(arguments: &OldArguments) -> anyhow::Result<Outcome> {
    let OldArguments { recordings, columns, output, yes } = arguments;
    ensure_new(output)?;
    Drafting { recordings, columns, output, asking: Some(Asking::new(*yes)) }.write()
}

/// # Errors
/// When the file exists: questions are about a new one.
fn ensure_new(path: &Path) -> anyhow::Result<()> {
    if path.is_file() {
        bail!("{} exists: name another file (-o), or move it away", path.display());
    }
    Ok(())
}

/// Drafts what a bus carries.
fn received(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let listening = scan::Listening {
        model: arguments.model.as_deref(),
        bus: &arguments.bus,
        duration: arguments.duration,
        is_draft: true,
    };
    let scan = match scan::listened(&listening)? {
        Ok(scan) => scan,
        Err(outcome) => return Ok(outcome),
    };
    write(&arguments.output, &format!("{}\n", scan::draft::drafted(&scan)?.trim_end()))?;
    Ok(if scan.is_silent() { Outcome::No } else { Outcome::Done })
}

impl Drafting<'_> {
    /// Reads, asks, and writes the model.
    fn write(mut self) -> anyhow::Result<Outcome> {
        let mut read = self.columns.read(self.recordings)?;
        let warned = read.warnings.len();
        self.asking.as_mut().map_or(Ok(()), |asking| ask::units(&mut read, asking))?;
        let mut drafted = draft(&read.columns, &read.joints, &Search::default())?;
        if drafted.groups.is_empty() {
            bail!(why_nothing(&read, &drafted));
        }
        if let Some(asking) = &mut self.asking {
            ask::groups(&read, &mut drafted, asking)?;
            ask::needs(&read, &mut drafted, asking)?;
        }
        let text = checked_text(&mut read, &mut drafted, &names(self.recordings).join(", "))?;
        read.warnings[warned..].iter().for_each(show::warn);
        write(self.output, &text)?;
        if self.asking.is_some() && self.output.as_os_str() != "-" {
            self.report(&drafted);
        }
        Ok(if read.degraded { Outcome::Degraded } else { Outcome::Done })
    }

    /// Says what was written, and what to do next.
    fn report(&self, drafted: &Drafted) {
        let (model, recordings) = (self.output.display(), names(self.recordings).join(" "));
        let signals = drafted.groups.iter().map(|group| group.members.len()).sum();
        show::notice(&format!(
            "{model}: {}, {}, {}",
            counted(drafted.groups.len(), "variable"),
            counted(signals, "signal"),
            counted(drafted.needs.len(), "need")
        ));
        show::notice(&format!("next: shsa learn {recordings} --model {model} -o learned.yaml"));
        show::notice(&format!("      shsa calibrate {model} {recordings} -o tuned.yaml"));
    }
}
