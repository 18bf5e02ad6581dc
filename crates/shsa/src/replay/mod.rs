//! `shsa replay`: the whole loop over recordings, optionally with injected faults.

mod drive;
mod reload;
mod source;
mod stream;
mod record;

pub(crate) use drive::drive;
pub(crate) use source::{CutArguments, SourceArguments, only, read, read_one};

use crate::compare::{self, Comparison};
use crate::headings::{COMPARISON, OUTPUT};
use crate::outcome::Outcome;
use crate::reading::ReadArguments;
use crate::show;
use crate::watch::Watching;
use crate::written;
use anyhow::{Context, bail};
use record::Record;
use sha2::{Digest, Sha256};
use shsa_core::engine::Options;
use shsa_format::drive::{Given, Run};
use shsa_format::journal::JournalWriter;
use shsa_report::Source;
use shsa_report::replay::{NeedErrors, Part, Provenance, Recorder, Report, ValueWriter, write_event_table};
use std::fs::File;
use std::io::{self, BufWriter, Write, stdout};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Arguments of `shsa replay`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa replay models/car.yaml drive/ --inject bias=2:wheel_1@20s..

A fault is KIND[=AMOUNT]:SIGNAL@FROM..TO.
  stuck, stuck=1.5  the value stays, or is the amount
  bias=2            the amount is added
  drift=0.1         the amount is added for every second
  noise=0.5         noise up to plus or minus the amount is added
  spike=5           the amount is added to one value in ten
  scale=1.3         values are multiplied by the amount
  spoof=3           the amount comes instead
  delay=600ms       values come later, with their old time stamps
  drop              values are lost
Times count from the first observation; FROM and TO may be left out. Amounts are in the signal's unit.

Recordings with different signals, such as one file for each topic, are replayed together. Two recordings with the same signal are \
sessions, one after the other, unless the second follows at once at the end of the first. Each session has an engine of its own, and \
all times count from its own first observation: those of faults, --reload, --from, --until and --skip, too. A new session also begins \
where the clock was set within a file (by more than an hour forwards, or back over recorded times), and after each stretch that is \
left out; there times continue.

--reload FILE@TIME changes the model while it is in use. A file with the key `shsa` is a whole model and replaces \
the old one. Any other file is a change: its entries are added, or replace those of the same name, and null \
removes, as in `relations: { turn: null, double: \"y = 2 * x\" }`. A file with errors changes nothing (exit status 3).

--compare VARIABLE runs the monitor alone: it prints, step by step, the values of all ways of knowing the variable and how far each \
is from the others; with --mode thesis by the published method.")]
pub(crate) struct Arguments {
    /// The knowledge base, YAML or JSON.
    model: PathBuf,
    /// Files and folders of any format (`shsa help recordings`), or the journal of an earlier run.
    #[arg(required = true)]
    recordings: Vec<PathBuf>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    /// Read the recordings while they are replayed, so that memory does not grow with them; by itself from 1 MiB on.
    /// They are looked through once before.
    #[arg(long, conflicts_with = "reload")]
    stream: bool,
    #[command(flatten)]
    source: SourceArguments,
    #[command(flatten)]
    cut: CutArguments,
    /// Write every value that the needs are served with, as JSON lines; as a table of Parquet if the name ends in .parquet.
    #[arg(short, long, value_name = "FILE", help_heading = OUTPUT)]
    output: Option<PathBuf>,
    /// Write a page for the browser with the needs, signals and decisions of the whole replay; it needs nothing else.
    #[arg(long, alias = "html", value_name = "FILE", help_heading = OUTPUT)]
    report: Option<PathBuf>,
    /// Write every decision as a table of Parquet, for pandas, Polars or DuckDB.
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    events: Option<PathBuf>,
    /// Write every input of the run as a journal that can be replayed; of one session only.
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    journal: Option<PathBuf>,
    /// Write the run as a file of MCAP, for Foxglove, Rerun and PlotJuggler: inputs, values of all ways of knowing, verdicts,
    /// decisions, needs. It can be replayed as a journal can; of one session only.
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    record: Option<PathBuf>,
    /// Write a layout for Foxglove that shows the record.
    #[arg(long, value_name = "FILE", requires = "record", help_heading = OUTPUT)]
    layout: Option<PathBuf>,
    /// Instead of the whole loop: print, step by step, how far all ways of knowing this variable are apart.
    #[arg(long, value_name = "VARIABLE", help_heading = COMPARISON, conflicts_with_all = NOT_COMPARED)]
    compare: Option<String>,
    #[command(flatten)]
    comparison: compare::Settings,
    #[command(flatten)]
    watching: Watching,
    #[command(flatten)]
    reading: ReadArguments,
}

/// What is of the whole loop only.
const NOT_COMPARED: [&str; 13] = [
    "inject", "reload", "session", "stream", "from", "until", "skip", "output", "report", "events",
    "journal", "record", "watch",
];

/// Replays and reports; the answer is no if a need was unmet.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    if let Some(variable) = &arguments.compare {
        return compare::run(&Comparison {
            model: &arguments.model,
            variable,
            recordings: &arguments.recordings,
            settings: &arguments.comparison,
            reading: &arguments.reading,
            json: arguments.json,
        });
    }
    let live = show::load_live(&arguments.model)?;
    if let Some(outcome) = stream::run(arguments, live.knowledge())? {
        return Ok(outcome);
    }
    let sources = source::read(
        &arguments.recordings,
        &arguments.source,
        &arguments.reading,
        &arguments.cut.cuts(),
        live,
    )?;
    only_one_is_written(arguments, sources.len())?;
    let [mut journal, mut record, mut layout, output, events, page] = written(arguments)?;
    let made = made(arguments)?;
    let began = Instant::now();
    let options = arguments.options();
    let mut recorders: Vec<Recorder> = page.iter().flat_map(|_| &sources).map(|_| Recorder::new()).collect();
    let mut onlookers = recorders.iter_mut();
    let runs: Vec<Run> = sources
        .iter()
        .map(|source| {
            let record = record.take().map(|file| Record { file, layout: layout.take(), made: &made });
            play(source, options, Onlookers { journal: journal.take(), record, page: onlookers.next() })
        })
        .collect::<anyhow::Result<_>>()?;
    let elapsed = began.elapsed();
    let clean = |source: &Source| Some(drive(source.clean.as_ref()?, source.span, options, give));
    let errors =
        |(source, run): (&Source, &Run)| Some(clean(source)?.map(|clean| NeedErrors::between(run, &clean)));
    let errors: Vec<Option<NeedErrors>> =
        sources.iter().zip(&runs).map(|it| errors(it).transpose()).collect::<anyhow::Result<_>>()?;
    let played = sources.iter().zip(&runs).zip(&errors);
    let part = |((source, run), errors)| Part { run, errors: Option::as_ref(errors), source };
    let parts: Vec<Part<'_>> = played.map(part).collect();
    if let Some(output) = output {
        let mut values = arguments.values(output)?;
        values.write_all(&parts)?;
        values.finish()?;
    }
    if let Some(events) = events {
        write_event_table(&parts, events)?;
    }
    finish(arguments, &parts, elapsed, page.map(|file| (file, &*recorders)))
}

/// # Errors
/// When a journal or a record is asked for of several sessions.
fn only_one_is_written(arguments: &Arguments, sessions: usize) -> anyhow::Result<()> {
    if sessions > 1 && arguments.journal.as_ref().or(arguments.record.as_ref()).is_some() {
        bail!(
            "a journal, or a record, is of one session, and these are {sessions}; say which with --session NUMBER"
        );
    }
    Ok(())
}

impl Arguments {
    fn options(&self) -> Options {
        Options { watch: self.watching.budget(), ..Options::default() }
    }

    /// Writes values in the form that the name of the file asks for.
    fn values(&self, file: BufWriter<File>) -> io::Result<ValueWriter<BufWriter<File>>> {
        let ending = self.output.as_ref().and_then(|path| path.extension());
        ValueWriter::new(file, ending.is_some_and(|ending| ending.eq_ignore_ascii_case("parquet")))
    }
}

/// Opens the output files: journal, record, its layout, values, decisions and page.
fn written(arguments: &Arguments) -> anyhow::Result<[Option<BufWriter<File>>; 6]> {
    let reloads = arguments.source.reload.iter().map(|reload| &reload.path);
    let read: Vec<&PathBuf> = arguments.recordings.iter().chain([&arguments.model]).chain(reloads).collect();
    let Arguments { journal, record, layout, output, events, report, .. } = arguments;
    written::open([journal, record, layout, output, events, report].map(Option::as_deref), &read)
}

fn finish(
    arguments: &Arguments,
    parts: &[Part<'_>],
    elapsed: Duration,
    page: Option<(BufWriter<File>, &[Recorder])>,
) -> anyhow::Result<Outcome> {
    let report = Report::new(parts, arguments.watching.budget()).context("nothing to replay")?;
    if let Some((mut file, recorders)) = page {
        let page = report.page(recorders, &made(arguments)?);
        file.write_all(page.as_bytes()).and_then(|()| file.flush()).context("cannot write the report")?;
    }
    let mut output = stdout().lock();
    match arguments.json {
        true => writeln!(output, "{}", report.json(elapsed))?,
        false => writeln!(output, "{}", report.text(show::style(), elapsed))?,
    }
    Ok(match (report.all_met(), parts.iter().any(|part| part.source.degraded)) {
        (false, _) => Outcome::No,
        (true, true) => Outcome::Degraded,
        (true, false) => Outcome::Done,
    })
}

/// The model and the command, for the report.
fn made(arguments: &Arguments) -> anyhow::Result<Provenance> {
    let path = &arguments.model;
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {} again", path.display()))?;
    Ok(provenance(path, &bytes))
}

/// What a page is made of: a file with these bytes, by the present command.
pub(crate) fn provenance(path: &Path, bytes: &[u8]) -> Provenance {
    let hash = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    let words = std::env::args().skip(1).map(|word| quoted(&word));
    let command = std::iter::once("shsa".to_owned()).chain(words).collect::<Vec<String>>().join(" ");
    let model = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    Provenance { model, text: String::from_utf8_lossy(bytes).into_owned(), hash, command }
}

/// A word, quoted for a shell.
fn quoted(word: &str) -> String {
    let is_plain = |char: char| char.is_alphanumeric() || "-_./=:,@+%".contains(char);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

/// What is written during a run.
struct Onlookers<'a> {
    journal: Option<BufWriter<File>>,
    record: Option<Record<'a>>,
    page: Option<&'a mut Recorder>,
}

/// The run over recordings of one session, with the record of its needs and cases.
///
/// # Errors
/// When a file cannot be read, or the recordings are several sessions.
pub(crate) fn recorded(
    model: &Path,
    recordings: &[PathBuf],
    arguments: &SourceArguments,
    reading: &ReadArguments,
) -> anyhow::Result<(Recorder, Run)> {
    let source = read_one(recordings, arguments, reading, show::load_live(model)?)?;
    let mut recorder = Recorder::new();
    let onlookers = Onlookers { journal: None, record: None, page: Some(&mut recorder) };
    let run = play(&source, Options::default(), onlookers)?;
    Ok((recorder, run))
}

fn play(source: &Source, options: Options, onlookers: Onlookers<'_>) -> anyhow::Result<Run> {
    let Source { eras, span, .. } = source;
    let Onlookers { journal, record, page: mut recorder } = onlookers;
    let first = eras.first().map(|era| &era.knowledge);
    let journal = journal.zip(first).map(|(file, known)| JournalWriter::new(file, known));
    let mut journal = journal.transpose()?;
    let mut record = record.zip(first).map(|(record, known)| record.begin(known)).transpose()?;
    let run = drive(eras, *span, options, |run, given| {
        journal.as_mut().map_or(Ok(()), |journal| journal.record(given))?;
        record.as_mut().map_or(Ok(()), |record| record.recorder.input(given))?;
        let published = run.publications.len();
        run.give(given);
        recorder.as_mut().into_iter().for_each(|recorder| recorder.look(run, published));
        Ok(record.as_mut().map_or(Ok(()), |record| record.recorder.look(run, published))?)
    })?;
    journal.as_mut().map_or(Ok(()), JournalWriter::flush)?;
    record.map_or(Ok(()), |record| record.finish(&run))?;
    recorder.into_iter().for_each(|recorder| recorder.end(&run));
    Ok(run)
}

fn give(run: &mut Run, given: Given<'_>) -> anyhow::Result<()> {
    run.give(given);
    Ok(())
}
