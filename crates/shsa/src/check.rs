//! `shsa check`: loads a knowledge base and reports every problem with its position.

use crate::outcome::Outcome;
use crate::show;
use shsa_core::knowledge::{KnowledgeBase, Severity};
use shsa_format::text::counted;
use shsa_model::Report;
use shsa_report::{Paint, check};
use std::io::{IsTerminal, Write, stdout};
use std::path::PathBuf;

/// Ends the help.
const EXAMPLES: &str = "\
Example: shsa check models/car.yaml

Limits for the readings of a signal; a reading beyond is out of range, too fast, late, or frozen:
  range: [0.2, 10 m]   the possible readings, within the range of the signal's variable
  max_rate: 3 m/s      the largest rate of change; default: that of the variable; `none`: no limit
  max_delay: 300 ms    the longest time from the time stamp to the reception; default: `delay` and
                       `timeout` together where a `delay` is given, else `none`
  frozen_after: 2 s    the longest time with exactly the same reading (of at least three); default:
                       no limit. For sensors of which no two readings are equal
  rests_at: 0          the value at which `frozen_after` does not count, but
  rests_for: 1 min     the longest time with exactly this reading; default: no limit
  counter: true        it only counts up: a lower reading is wrong, or the counter begins anew
  saturates: [-16, 16] the readings at which the signal only says that the value is there or beyond

Errors of a signal's values:
  value_error: 0.3     a bound, plus-minus or [lowest, highest]: a value within it is sound, a value
                       beyond it is proof of a fault
  change_error: 0.1    the bound of the error of a difference of two readings, where most of the
                       `value_error` is an offset; with a drift `0.1 hPa + 1 hPa/h`
  noise: 0.1           the standard deviation of the noise, where it is known: then scatter, drift
                       and skew over many comparisons within the bounds accuse, too; without it
                       they are only notes

Times of a signal's values:
  delay: 500 ms        the age of the content at its time stamp
  mean_over: 1 s       the time over which each value is a mean, centred at the stamp minus the
                       delay; the value is compared with means over the same time
  access: estimate     a computation after the latest value uses an estimate for its moment; default:
                       `port`, the latest value; `both`: the latest value for half a period
  time_error: 50 ms    the error of that moment, to either side
  hold: true           a value stands until the next one, as with polled signals: a repeated value
                       is no new measurement, and the signal is silent only after a given `timeout`,
                       or with its device
  hold: 0.2 K          the same of a signal that is sent when its value has changed by so much";

/// Arguments of `shsa check`.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The knowledge base, YAML or JSON.
    model: PathBuf,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Checks a model; a model with errors is bad input.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let mut loaded = show::load_file(&arguments.model);
    check::complete(&mut loaded, &arguments.model.display().to_string());
    let knowledge = &loaded.knowledge;
    let mut output = stdout().lock();
    if arguments.json {
        let answer = check::json(&loaded);
        writeln!(output, "{answer}")?;
    } else {
        let report = loaded.report.render(show::colour(stdout().is_terminal()));
        if !report.is_empty() {
            writeln!(output, "{}\n", report.trim_end())?;
        }
        let found = if loaded.report.ok() { size(knowledge) } else { problems(&loaded.report) };
        writeln!(output, "{}: {found}", arguments.model.display())?;
    }
    Ok(if loaded.report.ok() { Outcome::Done } else { Outcome::Bad })
}

fn size(knowledge: &KnowledgeBase) -> String {
    format!(
        "{}: {}, {}, {}, {}",
        show::style().paint(Paint::Green, "ok"),
        counted(knowledge.variables().len(), "variable"),
        counted(knowledge.relations().len(), "relation"),
        counted(knowledge.signals().len(), "signal"),
        counted(knowledge.needs().len(), "need"),
    )
}

fn problems(report: &Report) -> String {
    let of = |severity| report.diagnostics.iter().filter(|found| found.severity == severity).count();
    let errors = counted(of(Severity::Error), "error");
    match of(Severity::Warning) {
        0 => show::style().paint(Paint::Red, &errors),
        warnings => format!("{}, {}", show::style().paint(Paint::Red, &errors), counted(warnings, "warning")),
    }
}
