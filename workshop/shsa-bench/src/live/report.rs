//! The results as tables, as plots and as a document with a section for each part. A soak writes its own section only.

use super::browser::PageMemory;
use super::gate::Gate;
use super::pages::{self, Pages};
use super::soak::{Slope, Soak, Window};
use super::throughput::Throughput;
use super::times::Quantiles;
use super::{Arguments, Found};
use anyhow::Context;
use clap::ValueEnum;
use shsa_drawing::{Axis, Chart, Point, Scale, Series};
use shsa_format::text::{seconds, table};
use std::fs;
use std::path::Path;

/// What passing a value through may cost beyond the transport, seconds: median and 99th percentile.
const GATE_GOAL: (f64, f64) = (30e-6, 300e-6);
/// The rate that one instance on one core has to pass on without loss, messages a second.
const RATE_GOAL: f64 = 50_000.0;
/// Time within which 99 of 100 substitutes must be on the wire, seconds: in memory, and on other middleware.
const REACTION_GOALS: (f64, f64) = (1e-3, 5e-3);

const GATE_HEAD: [&str; 8] =
    ["bus", "direct", "relay", "gate", "beyond the relay", "best turns", "inside", "lost"];
const REACTION_HEAD: [&str; 8] =
    ["bus", "fault", "faults", "unhealed", "wrong values seen", "reaction p50", "p99 (goal)", "worst"];
const RATE_HEAD: [&str; 7] = [
    "bus",
    "messages a second",
    "lost",
    "cores of the instance",
    "a message",
    "cores of the server",
    "publisher kept up",
];
/// The section of the soak.
const SOAK: &str = "## Soak";

fn gate_rows(found: &Found) -> Vec<Vec<String>> {
    found.gates.iter().map(gate_row).collect()
}

/// Median / 99th percentile of each path.
fn gate_row(gate: &Gate) -> Vec<String> {
    let [direct, relay, through] = gate.all();
    let [_, best_relay, best_through] = gate.best();
    let both = |Quantiles { p50, p99, .. }: Quantiles| format!("{} / {}", signed(p50), signed(p99));
    vec![
        gate.kind.name().to_owned() + if gate.is_awake { ", awake" } else { "" },
        both(direct),
        both(relay),
        both(through),
        both(through.beyond(relay)),
        both(best_through.beyond(best_relay)),
        both(gate.inside),
        gate.lost().to_string(),
    ]
}

/// A difference may be below zero.
fn signed(value: f64) -> String {
    if value < 0.0 { format!("-{}", seconds(-value)) } else { seconds(value) }
}

fn reaction_rows(found: &Found) -> Vec<Vec<String>> {
    let row = |reaction: &super::Reaction| {
        let Quantiles { p50, p99, worst } = reaction.times.quantiles();
        let (within, between) = REACTION_GOALS;
        let goal = if reaction.kind == super::Kind::Memory { within } else { between };
        vec![
            reaction.kind.name().to_owned(),
            reaction.fault.to_owned(),
            reaction.faults.to_string(),
            reaction.unhealed.to_string(),
            reaction.wrong.to_string(),
            signed(p50),
            format!("{} ({})", signed(p99), seconds(goal)),
            signed(worst),
        ]
    };
    found.reactions.iter().map(row).collect()
}

fn rate_rows(found: &Found) -> Vec<Vec<String>> {
    let row = |step: &Throughput| {
        vec![
            step.kind.name().to_owned(),
            format!("{:.0}", step.input_rate),
            step.tally.lost().to_string(),
            format!("{:.2}", step.cores()),
            seconds(step.each_s()),
            format!("{:.2}", step.server_seconds / step.seconds),
            if step.is_reached() { "yes".to_owned() } else { format!("no, of {:.0}", step.wanted) },
        ]
    };
    found.throughputs.iter().map(row).collect()
}

/// Tables for the terminal; only of parts that were measured.
pub(super) fn text(found: &Found) -> String {
    let tables = [
        (&GATE_HEAD[..], gate_rows(found)),
        (&REACTION_HEAD[..], reaction_rows(found)),
        (&RATE_HEAD[..], rate_rows(found)),
        (&pages::HEAD[..], found.pages.iter().map(Pages::row).collect()),
    ];
    let shown = tables.into_iter().filter(|(_, rows)| !rows.is_empty());
    shown.map(|(head, rows)| table(head, rows)).collect::<Vec<_>>().join("\n\n")
}

/// Writes `live.md` and the raw results; keeps the section of a soak.
pub(super) fn write(folder: &Path, arguments: &Arguments, found: &Found) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    put(folder, "live.jsonl", &found.lines().map(|line| format!("{line}\n")).collect::<String>())?;
    let soak = section(&read(folder), SOAK);
    put(folder, "live.md", &(document(arguments, found) + &soak))
}

/// Writes the section of a soak and its plot; keeps the other sections.
pub(super) fn write_soak(folder: &Path, arguments: &Arguments, soak: &Soak) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    put(folder, "live-soak.jsonl", &format!("{}\n", soak.to_json()))?;
    put(folder, "live-soak-memory.svg", &memory_chart(soak).svg())?;
    put(folder, "live-soak-latency.svg", &latency_chart(soak).svg())?;
    let before = read(folder);
    let others = match before.is_empty() {
        true => format!("{TITLE}\n\n"),
        false => before.replace(&section(&before, SOAK), ""),
    };
    put(folder, "live.md", &(others + &soak_section(arguments, soak)))
}

fn put(folder: &Path, name: &str, text: &str) -> anyhow::Result<()> {
    let path = folder.join(name);
    fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
}

/// The present document; empty if there is none.
fn read(folder: &Path) -> String {
    fs::read_to_string(folder.join("live.md")).unwrap_or_default()
}

/// A section of a document: from its heading to the next heading of the same level.
fn section(document: &str, head: &str) -> String {
    let Some(begin) = document.find(head) else { return String::new() };
    let (_, section) = document.split_at(begin);
    let end = section.get(head.len()..).and_then(|rest| rest.find("\n## "));
    end.and_then(|end| section.get(..head.len() + end + 1)).unwrap_or(section).to_owned()
}

const TITLE: &str = "# What healing costs on the wire";

fn document(arguments: &Arguments, found: &Found) -> String {
    let names = |all: Vec<Option<clap::builder::PossibleValue>>| {
        all.iter().flatten().map(|value| value.get_name().to_owned()).collect::<Vec<_>>().join(",")
    };
    let buses = names(arguments.bus.iter().map(ValueEnum::to_possible_value).collect());
    let parts = names(arguments.part.iter().map(ValueEnum::to_possible_value).collect());
    let head = format!(
        "{TITLE}

Written by `shsa-bench live --bus {buses} --part {parts} --seconds {} --faults {} --out workshop/measured`; each measurement is a line in
`live.jsonl`. The broker (Mosquitto with MQTT 5, or a Zenoh router) and `shsa run` are separate processes on one machine of {} cores.
Publisher and consumer share a third process. The load average at the end was {}. All times are read from one clock. A time runs from the
call that publishes a message until the consumer's thread has the message. Other work on the machine affects every figure, so compare
figures within a row only.

",
        arguments.seconds,
        arguments.faults,
        std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get),
        load(),
    );
    head + &gate_section(found) + &reaction_section(found) + &rate_section(found)
}

/// The load average over one minute.
fn load() -> String {
    let text = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split_whitespace().next().unwrap_or("unknown").to_owned()
}

fn gate_section(found: &Found) -> String {
    if found.gates.is_empty() {
        return String::new();
    }
    format!(
        "## The gate

Median / 99th percentile of the delay of one signal at 1 kHz. The model compares this signal with two others at 100 Hz.

{}
- *direct*: from publisher to consumer. *relay*: through a process that only subscribes and publishes again with the same client
  library, so these are the two hops of the transport. *gate*: through `shsa run`, with the same two hops.
- *beyond the relay*: gate minus relay; the goal is below {} / {}. *best turns*: the same difference for the best turn of {}
  messages of each path, since other work on the machine only adds time. *inside*: from the reception of a message until the resulting
  value is handed to the client library, as `shsa run` reports it (`/state`, `/metrics`).
- *awake*: the processors were kept from sleeping between two messages (`/dev/cpu_dma_latency`, as `cyclictest` does). Without this,
  each process on the path waits until a sleeping processor has woken up. This takes longest on a virtual machine.

",
        markdown(&GATE_HEAD, &gate_rows(found)),
        seconds(GATE_GOAL.0),
        seconds(GATE_GOAL.1),
        super::gate::TURN,
    )
}

fn reaction_section(found: &Found) -> String {
    if found.reactions.is_empty() {
        return String::new();
    }
    format!(
        "## Reaction

The reaction time runs from the publication of the observation that reveals the fault until the consumer has the first substitute. It
includes both hops of the transport (the column *relay* above). The model has 20 variables with three signals each, at 50 Hz. The
sources of the needs fail one after the other.

{}
- *lies*: the source is off by {}, where the declared error is 0.1; its first wrong value reveals the fault. *silent*: the source stops
  publishing; its time-out reveals the fault. *wrong values seen*: the wrong values that the consumer received during a fault.

",
        markdown(&REACTION_HEAD, &reaction_rows(found)),
        super::model::LIE,
    )
}

fn rate_section(found: &Found) -> String {
    if found.throughputs.is_empty() {
        return String::new();
    }
    let highest = |kind: super::Kind| {
        let of = found.throughputs.iter().filter(|step| step.kind == kind && step.tally.lost() == 0);
        of.map(|step| step.input_rate).fold(f64::NAN, f64::max)
    };
    let mut kinds: Vec<super::Kind> = found.throughputs.iter().map(|step| step.kind).collect();
    kinds.dedup();
    let best: Vec<String> =
        kinds.iter().map(|kind| format!("{} {:.0}", kind.name(), highest(*kind))).collect();
    format!(
        "## Throughput

25 needs with two signals each, and one topic for each signal. Every second message causes a message to the consumer. One instance runs on
one core. A message that is missing in the instance or at the consumer is lost. The goal is {RATE_GOAL:.0} messages a second on one core. The highest
rates without loss: {}.

{}
- *cores of the instance*: processor time of all threads of the instance in a second. *a message*: processor time for each received
  message, including all work that follows from it. Publisher, consumer and server are not included.

",
        best.join(", "),
        markdown(&RATE_HEAD, &rate_rows(found)),
    )
}

/// The results of a soak as sentences.
pub(super) fn soak_text(soak: &Soak) -> String {
    sentences(soak).join("\n")
}

fn sentences(soak: &Soak) -> Vec<String> {
    without_page(soak).into_iter().chain(soak.page.as_ref().map(PageMemory::sentence)).collect()
}

fn without_page(soak: &Soak) -> Vec<String> {
    let mib = |bytes: f64| bytes / f64::from(1 << 20);
    let memory = soak.slope(|window| window.memory);
    let ends = |figure: fn(&Window) -> f64| {
        let mut warm = soak.warm().map(figure);
        let first = warm.next().unwrap_or(f64::NAN);
        (first, warm.last().unwrap_or(first))
    };
    let (first, last) = ends(|window| window.memory);
    let latency = |name: &str, figure: fn(&Window) -> f64| {
        let (first, last) = ends(figure);
        let Slope { slope, half } = soak.slope(figure);
        format!(
            "Latency, {name} of a window: {} after the warm-up, {} at the end; {:+.0} us an hour, 95 % within {:.0}: {}.",
            seconds(first),
            seconds(last),
            slope * 3_600.0 * 1e6,
            half * 3_600.0 * 1e6,
            growth(soak.grows(figure))
        )
    };
    vec![
        format!(
            "{:.0} s at {:.0} messages a second over {}: {} sent, {} received, {} published, {} consumed; lost: {}; decisions: {}; \
             {:.2} cores.",
            soak.seconds,
            soak.tally.published_inputs as f64 / soak.seconds,
            soak.kind.name(),
            soak.tally.published_inputs,
            soak.tally.received,
            soak.tally.published,
            soak.tally.consumed,
            soak.tally.lost(),
            soak.decisions,
            soak.cores
        ),
        format!(
            "Memory of its own (`RssAnon`): {:.2} MiB after the warm-up, {:.2} MiB at the end; {:+.3} MiB an hour, 95 % within {:.3}: {}.",
            mib(first),
            mib(last),
            mib(memory.slope * 3_600.0),
            mib(memory.half * 3_600.0),
            growth(soak.grows(|window| window.memory))
        ),
        latency("median", |window| window.latency.p50),
        latency("99th percentile", |window| window.latency.p99),
    ]
}

fn growth(grows: bool) -> &'static str {
    if grows { "it grows" } else { "it does not grow" }
}

fn soak_section(arguments: &Arguments, soak: &Soak) -> String {
    let list: String = sentences(soak).iter().map(|sentence| format!("- {sentence}\n")).collect();
    format!(
        "{SOAK}

Written by `{}`. The first tenth is the warm-up. Slopes are least squares over {} windows. A figure grows if its
slope is significant and adds more than a fiftieth during the run. The load average at the end was {}.

{list}
![memory](live-soak-memory.svg)

![latency](live-soak-latency.svg)
",
        super::soak_command(arguments, soak),
        soak.windows.len(),
        load()
    )
}

fn memory_chart(soak: &Soak) -> Chart {
    let points = soak.windows.iter().map(|window| Point::exact(window.at, window.memory)).collect();
    Chart {
        title: "Memory of the instance".into(),
        x: axis("time", "s", Scale::Linear),
        y: axis("memory", "B", Scale::Linear),
        series: vec![Series { name: "RssAnon".into(), points }],
    }
}

fn latency_chart(soak: &Soak) -> Chart {
    let series = |name: &str, figure: fn(&Window) -> f64| Series {
        name: name.into(),
        points: soak.windows.iter().map(|window| Point::exact(window.at, figure(window))).collect(),
    };
    Chart {
        title: "From the publisher through the instance to the consumer".into(),
        x: axis("time", "s", Scale::Linear),
        y: axis("time of a message", "s", Scale::Log),
        series: vec![
            series("median", |window| window.latency.p50),
            series("99th percentile", |window| window.latency.p99),
        ],
    }
}

fn axis(label: &str, unit: &str, scale: Scale) -> Axis {
    Axis { label: label.into(), unit: unit.into(), scale }
}

fn markdown(head: &[&str], rows: &[Vec<String>]) -> String {
    let rule = "---|".repeat(head.len());
    let rows: String = rows.iter().map(|row| format!("| {} |\n", row.join(" | "))).collect();
    format!("| {} |\n|{rule}\n{rows}", head.join(" | "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_ends_where_the_next_one_begins() {
        let document = "# T\n\n## A\n\na\n\n## Soak\n\ns\n\n## B\n\nb\n";
        assert_eq!(section(document, SOAK), "## Soak\n\ns\n\n");
        assert_eq!(section(document, "## B"), "## B\n\nb\n");
        assert_eq!(section(document, "## C"), "");
    }

    #[test]
    fn differences_may_be_below_zero() {
        assert_eq!([signed(-2e-6), signed(2e-6)], ["-2.0 us", "2.0 us"]);
    }
}
