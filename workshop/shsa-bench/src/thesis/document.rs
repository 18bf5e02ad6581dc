//! The document that the command writes.

use super::Arguments;
use super::charts;
use super::record::Record;
use super::report::{self, Table};
use clap::ValueEnum;

const HEAD: &str = "\
Graphs are trees. Nodes at even depth are variables, nodes at odd depth are relations; `b` is the number of children of a node,
and `d` the depth of the leaves, which are provided. In `ex1` the tree is complete, and only the leaves are provided. In `ex2`
the tree is complete, and the probability that a variable at depth i is provided is 0.2 + 0.8 (i - 1) / (d - 1), as in the thesis.
`ex3` is `ex2` over `b`, and `ex3c` adds costs of relations from 1 to 10. In `ex4` a node has 1 to `b` children, evenly distributed,
relations are usable towards the root only, and variables are provided as in `ex2`. The root is never provided. `rover` and
`drivetrain` are the models in `models/`, without the signal of the steering angle. All searches run over the same graphs.

Times are for one core, with other work on the machine, so compare them within a row only. They do not include reading a model
and preparing its graph. A search that takes less than 0.1 s is run several times, and the fastest run counts.";

const PUBLIC: &str = "\
*public*: the thesis's own programs, [github.com/dratasich/shsa](https://github.com/dratasich/shsa), with Python 3.11 on two shared cores. Their figures are medians over graphs of their own generators, measured in an earlier run.
The first answer of these programs need not be the best. The rover of these programs is another graph, so it has no row.";

/// The tables as Markdown, with the command that makes them.
pub(super) fn markdown(arguments: &Arguments, records: &[Record]) -> String {
    let tables: String = report::tables(records).iter().map(table).collect();
    let plots: String = charts::charts(records)
        .iter()
        .map(|(name, chart)| format!("![{}]({name})\n\n", chart.title))
        .collect();
    format!(
        "# The thesis's experiments\n\nWritten by `{}`; each measurement is a line in `experiments.jsonl`.\n\n{HEAD}\n\n{PUBLIC}\n\n\
         {plots}{}\n",
        command(arguments),
        tables.trim_end(),
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
    let threads = match arguments.threads.get() {
        1 => String::new(),
        several => format!(" --threads {several}"),
    };
    format!(
        "shsa-bench thesis{only} --seeds {} --limit {}{threads} --out workshop/measured",
        arguments.seeds, arguments.limit
    )
}

fn table(table: &Table) -> String {
    let rule = "---|".repeat(table.head.len());
    let rows: String = table.rows.iter().map(|row| format!("| {} |\n", row.join(" | "))).collect();
    format!("## {}\n\n{}\n\n| {} |\n|{rule}\n{rows}\n", table.title, table.note, table.head.join(" | "))
}
