//! `shsa explain`: why a signal was suspected, which witnesses were for and against it, and what would have cleared it.

mod question;

use crate::headings::OUTPUT;
use crate::outcome::{AlreadyReported, Outcome};
use crate::progress::Observations;
use crate::reading::ReadArguments;
use crate::replay::{SourceArguments, drive, read_one};
use crate::show;
use crate::written;
use anyhow::{Context, bail};
use question::{asked, files};
use shsa_core::engine::Options;
use shsa_core::time::Span;
use shsa_format::story;
use shsa_message::span::parse_span;
use shsa_report::Source;
use shsa_report::explanation::{Explanation, Question, inquire, list_json, list_text};
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, IsTerminal, Write, stderr, stdout};
use std::path::{Path, PathBuf};

/// Arguments of `shsa explain`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa explain stories/01-dead-but-looks-alive.yaml /room/a

  shsa explain MODEL JOURNAL                     all decisions, numbered
  shsa explain MODEL JOURNAL wheel_1             the first accusation of a signal
  shsa explain MODEL JOURNAL wheel_1@20.5s       what stood at that time, and why
  shsa explain MODEL drive/ wheel_1 --inject bias=2:wheel_1@20s..
An explanation has the evidence, the other candidates, and what would have cleared the signal.
A journal comes from `shsa replay --journal`. Faults and --reload are written as for `shsa replay`. Times count from \
the first observation. The last argument is the signal when there is no file of this name.")]
pub(crate) struct Arguments {
    /// The knowledge base, YAML or JSON; or a story, which needs no recordings.
    model: PathBuf,
    /// A journal or recordings, as for `shsa replay`; then, if wanted, what to explain: SIGNAL or SIGNAL@TIME.
    #[arg(value_name = "RECORDING.. [SIGNAL[@TIME]]")]
    rest: Vec<PathBuf>,
    /// Explain the decision of this number in the list.
    #[arg(long, value_name = "NUMBER")]
    decision: Option<usize>,
    /// How much time the drawings show, the decision in the middle.
    #[arg(long, value_name = "SPAN", value_parser = parse_span)]
    window: Option<Span>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    source: SourceArguments,
    /// Write the explanation with its drawings to a page for the browser, which needs nothing else.
    #[arg(long, alias = "report", value_name = "FILE", help_heading = OUTPUT)]
    html: Option<PathBuf>,
    /// Draw the values of the witnesses over time.
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    svg: Option<PathBuf>,
    #[command(flatten)]
    reading: ReadArguments,
}

/// Explains. The answer that there was no accusation is a valid answer.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let (recordings, text) = files(&arguments.rest);
    let source = source(arguments, recordings, text)?;
    let question = asked(text, arguments.decision, &source.eras)?;
    let outcome = if source.degraded { Outcome::Degraded } else { Outcome::Done };
    if question == Question::All {
        list(arguments, &source)?;
        return Ok(outcome);
    }
    let read: Vec<&PathBuf> = recordings.iter().chain([&arguments.model]).collect();
    let [svg, html] = written::open([arguments.svg.as_deref(), arguments.html.as_deref()], &read)?;
    let mut bar = Observations::of(&source.eras);
    let inquiry = inquire(&source, &question, |given| bar.count(given));
    drop(bar);
    let inquiry = inquiry?;
    let explanation = Explanation::new(&inquiry, &source);
    draw(arguments, &explanation, &source, [svg, html])?;
    let mut output = stdout().lock();
    match arguments.json {
        true => writeln!(output, "{}", explanation.json())?,
        false => writeln!(output, "{}", explanation.text(show::style()))?,
    }
    Ok(outcome)
}

/// The inputs of the run.
fn source(arguments: &Arguments, recordings: &[PathBuf], text: Option<&Path>) -> anyhow::Result<Source> {
    if is_story(&arguments.model) {
        if !recordings.is_empty() || arguments.source.changes() {
            bail!("a story is told as it is written; recordings and faults are for models");
        }
        return from_story(&arguments.model);
    }
    if recordings.is_empty() {
        match text {
            Some(text) => bail!("{} cannot be read: there is no such file", text.display()),
            None => bail!("give a journal or recordings after the model"),
        }
    }
    read_one(recordings, &arguments.source, &arguments.reading, show::load_live(&arguments.model)?)
}

/// Whether a file is a story: `story:` is its first key.
fn is_story(path: &Path) -> bool {
    let Ok(file) = File::open(path) else { return false };
    let lines = BufReader::new(std::io::Read::take(file, 1 << 16)).lines().map_while(Result::ok);
    let mut keys = lines.filter(|line| !line.trim_start().starts_with('#') && !line.trim().is_empty());
    keys.next().is_some_and(|line| line.starts_with("story:"))
}

fn from_story(path: &Path) -> anyhow::Result<Source> {
    let loaded = story::load_file(path);
    let report = loaded.report.render(show::colour(stderr().is_terminal()));
    if !report.is_empty() {
        show::notice(report.trim_end());
    }
    Ok(Source::of_story(&loaded.story.ok_or(AlreadyReported)?))
}

fn list(arguments: &Arguments, source: &Source) -> anyhow::Result<()> {
    if arguments.svg.is_some() || arguments.html.is_some() {
        bail!("name the signal that is to be drawn");
    }
    let run = drive(&source.eras, source.span, Options::default(), |run, given| {
        run.give(given);
        Ok(())
    })?;
    let mut output = stdout().lock();
    match arguments.json {
        true => writeln!(output, "{}", list_json(&run))?,
        false => writeln!(output, "{}", list_text(&run, show::style()))?,
    }
    Ok(())
}

fn draw(
    arguments: &Arguments,
    explanation: &Explanation<'_>,
    source: &Source,
    [svg, html]: [Option<BufWriter<File>>; 2],
) -> anyhow::Result<()> {
    if svg.is_none() && html.is_none() {
        return Ok(());
    }
    // Only the page has room for more than one.
    let most = if html.is_some() { usize::MAX } else { 1 };
    let drawings = explanation.drawings(source, arguments.window, most);
    if let (Some(mut file), Some(first)) = (svg, drawings.first()) {
        file.write_all(first.svg().as_bytes())
            .and_then(|()| file.flush())
            .context("cannot write the drawing")?;
    }
    if let Some(mut file) = html {
        let model = arguments.model.file_name().unwrap_or(arguments.model.as_os_str()).to_string_lossy();
        let page = explanation.page(&drawings, &model);
        file.write_all(page.as_bytes()).and_then(|()| file.flush()).context("cannot write the page")?;
    }
    Ok(())
}
