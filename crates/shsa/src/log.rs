//! The log of a long-running command: its levels and its times.
//!
//! Decisions go to standard output, everything else to standard error. On a terminal, a line has no time, or the time since the
//! start. In a log, it begins with the wall-clock time (UTC) and a level, or is a JSON object with both.

use crate::show::colour;
use serde_json::{Map, Value, json};
use shsa_core::engine::Severity;
use shsa_core::time::Time;
use shsa_format::event;
use shsa_message::stamp::{Notation, written};
use shsa_report::{Paint, Style};
use shsa_runtime::{Decision, Handle};
use std::io::{IsTerminal, stderr};
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, SystemTime};

/// The period of the figures with `--verbose`.
const FIGURES: Duration = Duration::from_secs(10);
/// The kinds of a run's events that are no warnings.
const GOOD_NEWS: [&str; 8] =
    ["connected", "ordered", "responsible", "released", "joined", "returned", "within_errors", "clock"];

/// How much something matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Level {
    Error,
    Warning,
    Info,
    Debug,
}

impl Level {
    fn name(self) -> &'static str {
        match self {
            Level::Error => "error",
            Level::Warning => "warning",
            Level::Info => "info",
            Level::Debug => "debug",
        }
    }

    fn of(decision: &Decision<'_>) -> Level {
        match decision {
            Decision::Decided { event, .. } => match event.kind.severity() {
                Severity::Error => Level::Error,
                Severity::Warning => Level::Warning,
                Severity::Info => Level::Info,
            },
            Decision::Noted { kind, .. } if GOOD_NEWS.contains(kind) => Level::Info,
            Decision::Noted { .. } => Level::Warning,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum LogFormat {
    /// TIME LEVEL and the words, one line each.
    Text,
    /// One JSON object a line: time, level, kind, because, and what else an event has.
    Json,
}

/// The arguments about logs.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Logs")]
pub(crate) struct LogArguments {
    /// Begin every line with the wall clock's time (UTC) and its level, or make it a JSON object with both.
    #[arg(long, value_name = "FORMAT")]
    log_format: Option<LogFormat>,
    /// Print only warnings and errors; twice: only errors.
    #[arg(short, long, action = clap::ArgAction::Count, conflicts_with = "verbose")]
    quiet: u8,
    /// Print the figures of a run every 10 s, too.
    #[arg(short, long, action = clap::ArgAction::Count)]
    verbose: u8,
}

static SETTINGS: OnceLock<Log> = OnceLock::new();

/// The log settings of this process.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Log {
    format: Option<LogFormat>,
    /// The least important level that is written.
    least: Level,
}

impl Log {
    const PLAIN: Log = Log { format: None, least: Level::Info };

    /// Sets the log settings of this process.
    pub(crate) fn begin(arguments: &LogArguments) -> Log {
        let least = match (arguments.quiet, arguments.verbose) {
            (0, 0) => Level::Info,
            (0, _) => Level::Debug,
            (1, _) => Level::Warning,
            _ => Level::Error,
        };
        *SETTINGS.get_or_init(|| Log { format: arguments.log_format, least })
    }

    /// Whether a decision is written.
    pub(crate) fn includes(self, decision: &Decision<'_>) -> bool {
        Level::of(decision) <= self.least
    }

    /// The line of a decision; `words` is its text for a terminal.
    pub(crate) fn decision(self, decision: &Decision<'_>, words: impl FnOnce() -> String) -> String {
        let level = Level::of(decision);
        let (at, fields) = match decision {
            Decision::Decided { at, knowledge, event, .. } => (*at, event::fields(knowledge, event)),
            Decision::Noted { at, kind, because, .. } => {
                (*at, Map::from_iter([("kind".into(), json!(kind)), ("because".into(), json!(because))]))
            }
        };
        match self.format {
            Some(LogFormat::Json) => object(at, level, fields),
            Some(LogFormat::Text) => {
                let text =
                    |name: &str| fields.get(name).and_then(Value::as_str).unwrap_or_default().to_owned();
                let [kind, signal, variable, because] = ["kind", "signal", "variable", "because"].map(text);
                let about = if signal.is_empty() { variable } else { signal };
                let words = [kind, about, because].into_iter().filter(|word| !word.is_empty());
                text_line(at, level, &words.collect::<Vec<_>>().join(" "))
            }
            None => words(),
        }
    }
}

/// The line of a message by the log settings; `None` if it is not written.
pub(crate) fn line(level: Level, message: &str) -> Option<String> {
    let Log { format, least } = SETTINGS.get().copied().unwrap_or(Log::PLAIN);
    if level > least {
        return None;
    }
    let now = || {
        let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        Time(i64::try_from(since.as_nanos()).unwrap_or(i64::MAX))
    };
    Some(match format {
        Some(LogFormat::Json) => {
            let fields = [("kind".to_owned(), json!("note")), ("because".to_owned(), json!(message))];
            object(now(), level, Map::from_iter(fields))
        }
        Some(LogFormat::Text) => text_line(now(), level, message),
        None => match level {
            Level::Error => format!("{} {message}", mark(Paint::Red, "error:")),
            Level::Warning => format!("{} {message}", mark(Paint::Yellow, "warning:")),
            Level::Info | Level::Debug => message.to_owned(),
        },
    })
}

fn mark(paint: Paint, word: &str) -> String {
    Style { colour: colour(stderr().is_terminal()), width: None }.paint(paint, word)
}

fn object(at: Time, level: Level, fields: Map<String, Value>) -> String {
    let mut object = json!({ "time": written(at, Notation::Rfc3339), "level": level.name() });
    if let Some(object) = object.as_object_mut() {
        object.extend(fields);
    }
    object.to_string()
}

/// A line of text; a line break becomes a blank.
fn text_line(at: Time, level: Level, words: &str) -> String {
    let words: Vec<&str> = words.split_whitespace().collect();
    format!("{} {:<7} {}", written(at, Notation::Rfc3339), level.name(), words.join(" "))
}

/// Writes the figures of a run periodically, if asked for.
///
/// # Errors
/// When no thread can be started.
pub(crate) fn print_figures(log: Log, handle: Handle) -> std::io::Result<()> {
    if log.least < Level::Debug {
        return Ok(());
    }
    thread::Builder::new().name("figures".into()).spawn(move || {
        while let Ok(state) = handle.state() {
            if let Some(line) = line(Level::Debug, &format!("figures {}", state["figures"])) {
                crate::show::write(&line);
            }
            thread::sleep(FIGURES);
        }
    })?;
    Ok(())
}
