//! The document that the command writes.

use super::record::Record;
use super::report::{self, Table};
use super::{Arguments, assurance};
use clap::ValueEnum;

const HEAD: &str = "\
Graphs are trees: nodes at even depth are variables, at odd depth relations (`b`: children of a node, `d`: depth of the
leaves, which are provided). `ex1`: complete, nothing else is provided. `ex2`: complete, a variable is provided with a
probability that rises evenly from 0.2 to 1 at the leaves. `ex3`: as `ex2`, by `b`; `ex3c`: with costs of relations from 1 to
10. `ex4`: 1 to `b` children a node, evenly, relations usable towards the root only; availability as `ex2`. The root is never
provided. `rover` and `drivetrain` are the models in `models/`; the steering angle's own signal is lost.

Times are for one core, with other work on the machine: compare them within a row. Reading a model and preparing its graph are not
included. What takes less than a second is run several times, and the fastest turn counts.";

const PUBLIC: &str = "\
*public*: the thesis's own programs, [github.com/dratasich/shsa](https://github.com/dratasich/shsa), with Python 3.11 on two
shared cores, medians over graphs of their own generators; not of this run. Their first answer need not be the best.
Their rover is another graph, so it has no row there.";

/// The tables as Markdown, with the command that makes them.
pub(super) fn markdown(arguments: &Arguments, records: &[Record]) -> String {
    let tables: String = report::tables(records).iter().map(table).collect();
    let plots: String = report::charts(records)
        .iter()
        .map(|(name, chart)| format!("![{}]({name})\n\n", chart.title))
        .collect();
    format!(
        "# The thesis's experiments\n\nWritten by `{}`; each measurement is a line in `thesis.jsonl`.\n\n{HEAD}\n\n{PUBLIC}\n\n\
         {plots}{}\n\n{}\n",
        command(arguments),
        tables.trim_end(),
        assurance::markdown().trim_end(),
    )
}

fn command(arguments: &Arguments) -> String {
    let named = |experiment: &super::Experiment| {
        experiment.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    };
    let experiments: Vec<String> = arguments.experiment.iter().map(named).collect();
    let only = if experiments.is_empty() {
        String::new()
    } else {
        format!(" --experiment {}", experiments.join(","))
    };
    format!("shsa-bench thesis{only} --seeds {} --limit {} --out docs", arguments.seeds, arguments.limit)
}

fn table(table: &Table) -> String {
    let rule = "---|".repeat(table.head.len());
    let rows: String = table.rows.iter().map(|row| format!("| {} |\n", row.join(" | "))).collect();
    format!("## {}\n\n{}\n\n| {} |\n|{rule}\n{rows}\n", table.title, table.note, table.head.join(" | "))
}
