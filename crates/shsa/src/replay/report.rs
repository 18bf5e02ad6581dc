//! What a replay found, as text and as JSON.

use super::Source;
use crate::show::{self, Paint};
use crate::tell;
use serde_json::{Map, Value, json};
use shsa_core::engine::{Event, Publication, PublishedValue};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, Need, NeedId, SignalId, VariableId};
use shsa_core::monitor::{Figures, WatchedWay, WayIndex};
use shsa_core::time::{Span, Time};
use shsa_format::drive::Run;
use std::io::{Write, stdout};
use std::time::Duration;

/// How a need was served.
struct NeedReport {
    id: NeedId,
    published: u64,
    longest_gap: Span,
    /// Whether no value was older than the need allows, to the end.
    met: bool,
    source: Option<String>,
    widest: f64,
    /// Root mean square and largest difference to the run without the injected faults.
    error: Option<(f64, f64)>,
}

/// What a replay found.
pub(super) struct Report<'a> {
    knowledge: &'a KnowledgeBase,
    run: &'a Run,
    source: &'a Source,
    needs: Vec<NeedReport>,
}

impl<'a> Report<'a> {
    /// Needs and signals are those of the model at the end.
    pub(super) fn new(run: &'a Run, clean: Option<&Run>, source: &'a Source) -> Report<'a> {
        let knowledge = run.engine.knowledge();
        let need = |(id, need): (NeedId, &Need)| need_report(run, clean, id, need);
        Report { knowledge, run, source, needs: knowledge.needs().enumerate().map(need).collect() }
    }

    pub(super) fn all_met(&self) -> bool {
        self.needs.iter().all(|need| need.met)
    }

    pub(super) fn print(&self, as_json: bool, elapsed: Duration) -> anyhow::Result<()> {
        let mut output = stdout().lock();
        match as_json {
            true => writeln!(output, "{}", self.json(elapsed))?,
            false => writeln!(output, "{}", self.text(elapsed))?,
        }
        Ok(())
    }

    fn duration(&self) -> Span {
        self.run.last - self.run.first
    }

    fn json(&self, elapsed: Duration) -> Value {
        let events: Vec<Value> =
            self.run.told_events().map(|(known, event)| self.event_json(known, event)).collect();
        let needs: Map<String, Value> = self.needs.iter().map(|need| self.need_json(need)).collect();
        let signals: Map<String, Value> =
            self.knowledge.signals().ids().map(|signal| self.signal_json(signal)).collect();
        let ways: Vec<Value> = self.ways().map(|(way, figures)| self.way_json(way, &figures)).collect();
        let mut report = json!({
            "observations": self.run.observations,
            "duration_s": self.duration().seconds(),
            "elapsed_s": elapsed.as_secs_f64(),
            "events": events,
            "needs": needs,
            "signals": signals,
            "ways": ways,
        });
        let reload = |(time, file): (Span, &str)| json!({ "time_s": time.seconds(), "file": file });
        let reloads: Vec<Value> = self.reloads().map(reload).collect();
        if let Some(report) = report.as_object_mut().filter(|_| !reloads.is_empty()) {
            report.insert("reloads".to_owned(), Value::Array(reloads));
        }
        report
    }

    /// When the model was changed, and by which file.
    fn reloads(&self) -> impl Iterator<Item = (Span, &str)> {
        let eras = self.source.eras.iter().filter_map(|era| Some((era, era.change.as_ref()?)));
        eras.map(|(era, (file, _))| (era.from - self.run.first, file.as_str()))
    }

    fn event_json(&self, known: &KnowledgeBase, event: &Event) -> Value {
        let time = ("time_s".to_owned(), json!((event.time - self.run.first).seconds()));
        let fields = std::iter::once(time).chain(tell::event_fields(known, event));
        Value::Object(fields.collect())
    }

    fn need_json(&self, report: &NeedReport) -> (String, Value) {
        let need = &self.knowledge.needs()[report.id];
        let variable = &self.knowledge.variables()[need.variable];
        let in_unit = |value: f64| difference_from_si(self.knowledge, need.variable, value);
        let mut value = json!({
            "signal": need.signal,
            "met": report.met,
            "source": report.source,
            "published": report.published,
            "longest_gap_s": report.longest_gap.seconds(),
            "widest": in_unit(report.widest),
        });
        if let (Some((rmse, most)), Some(object)) = (report.error, value.as_object_mut()) {
            object.insert("rmse".to_owned(), json!(in_unit(rmse)));
            object.insert("max_error".to_owned(), json!(in_unit(most)));
        }
        (variable.name.clone(), value)
    }

    fn signal_json(&self, signal: SignalId) -> (String, Value) {
        let counts = self.run.engine.monitor().ports()[signal].counts();
        let value = json!({
            "verdict": self.verdict(signal),
            "accepted": counts.accepted,
            "reordered": counts.reordered,
            "duplicates": counts.duplicates,
            "dropped": counts.dropped,
            "late": counts.late,
            "out_of_order": counts.out_of_order,
            "invalid": counts.invalid,
            "out_of_range": counts.out_of_range,
            "too_fast": counts.too_fast,
            "missing": self.missing(signal),
        });
        (self.knowledge.signals()[signal].name.clone(), value)
    }

    /// The ways of knowing under watch, with how they have run at the end.
    fn ways(&self) -> impl Iterator<Item = (&WatchedWay, Figures)> {
        let monitor = self.run.engine.monitor();
        let indices = (0..).map(WayIndex);
        indices.zip(monitor.ways()).map(|(index, way)| (way, monitor.figures(index, self.run.last)))
    }

    fn way_json(&self, way: &WatchedWay, figures: &Figures) -> Value {
        let variable = way.variable();
        let in_unit = |value: f64| difference_from_si(self.knowledge, variable, value);
        json!({
            "variable": self.knowledge.variables()[variable].name,
            "way": way.computation.way().describe(self.knowledge),
            "agreement": figures.agreement,
            "error": figures.error.map(in_unit),
            "width": figures.width.map(in_unit),
            "availability": figures.availability,
        })
    }

    fn missing(&self, signal: SignalId) -> usize {
        self.source.missing.get(&self.knowledge.signals()[signal].name).copied().unwrap_or(0)
    }

    fn verdict(&self, signal: SignalId) -> &'static str {
        show::verdict(self.run.engine.absence(signal), self.run.engine.verdict(signal))
    }

    fn text(&self, elapsed: Duration) -> String {
        let mut parts = vec![format!(
            "{} over {:.1} s, replayed in {:.3} s",
            show::counted(self.run.observations, "observation"),
            self.duration().seconds(),
            elapsed.as_secs_f64()
        )];
        parts.push(self.events_text());
        if !self.needs.is_empty() {
            parts.push(self.needs_text());
        }
        parts.push(self.signals_text());
        parts.extend(self.ways_text());
        parts.join("\n\n")
    }

    fn events_text(&self) -> String {
        let mut lines: Vec<(Time, String)> = self
            .run
            .told_events()
            .map(|(known, event)| (event.time, self.event_text(known, event)))
            .collect();
        for (since, file) in self.reloads() {
            let time = self.run.first + since;
            let word = show::paint(Paint::Bold, &format!("{:<11}", "reloaded"));
            // What follows from the change is told after it.
            let at = lines.partition_point(|(told, _)| *told < time);
            lines.insert(at, (time, format!("{:>9.3} s  {word} {file}", since.seconds())));
        }
        if lines.is_empty() {
            return "No events: nothing failed, nothing was substituted.".to_owned();
        }
        lines.into_iter().map(|(_, line)| line).collect::<Vec<_>>().join("\n")
    }

    fn event_text(&self, known: &KnowledgeBase, event: &Event) -> String {
        let time = format!("{:>9.3} s", (event.time - self.run.first).seconds());
        tell::event_text(&time, known, event)
    }

    fn needs_text(&self) -> String {
        let mut rows = Vec::new();
        for report in &self.needs {
            let need = &self.knowledge.needs()[report.id];
            let in_unit = |value: f64| difference_from_si(self.knowledge, need.variable, value);
            let error = report.error.map_or(String::new(), |(rmse, most)| {
                format!(
                    "rmse {:.3}, at most {:.3}{}",
                    in_unit(rmse),
                    in_unit(most),
                    unit(self.knowledge, need.variable)
                )
            });
            rows.push(vec![
                self.knowledge.variables()[need.variable].name.clone(),
                if report.met { show::paint(Paint::Green, "yes") } else { show::paint(Paint::Red, "no") },
                report.published.to_string(),
                format!("{:.3} s", report.longest_gap.seconds()),
                report.source.clone().unwrap_or_else(|| "nothing".to_owned()),
                error,
            ]);
        }
        let mut head = vec!["need", "met", "published", "longest gap", "source at the end"];
        if self.source.clean.is_some() {
            head.push("error");
        }
        show::table(&head, rows)
    }

    fn signals_text(&self) -> String {
        let mut rows = Vec::new();
        for signal in self.knowledge.signals().ids() {
            let counts = self.run.engine.monitor().ports()[signal].counts();
            rows.push(vec![
                self.knowledge.signals()[signal].name.clone(),
                show::paint_verdict(self.verdict(signal), self.verdict(signal)),
                counts.accepted.to_string(),
                (counts.dropped + counts.duplicates).to_string(),
                counts.late.to_string(),
                counts.out_of_order.to_string(),
                counts.invalid.to_string(),
                counts.out_of_range.to_string(),
                counts.too_fast.to_string(),
            ]);
        }
        let head = [
            "signal",
            "verdict",
            "accepted",
            "dropped",
            "late",
            "out of order",
            "invalid",
            "out of range",
            "too fast",
        ];
        show::table(&head, rows)
    }
}

impl Report<'_> {
    /// How the ways of knowing what is needed have run: which one would take over, and why.
    fn ways_text(&self) -> Option<String> {
        let is_needed =
            |variable: VariableId| self.knowledge.needs().iter().any(|need| need.variable == variable);
        let share = |share: Option<f64>| {
            share.map_or_else(|| "unknown".to_owned(), |share| format!("{:.1} %", 100.0 * share))
        };
        let row = |(way, figures): (&WatchedWay, Figures)| {
            let variable = way.variable();
            let distance = |value: Option<f64>| {
                let in_unit = |value| difference_from_si(self.knowledge, variable, value);
                let with_unit = |value| format!("{:.3}{}", in_unit(value), unit(self.knowledge, variable));
                value.map_or_else(|| "unknown".to_owned(), with_unit)
            };
            vec![
                self.knowledge.variables()[variable].name.clone(),
                way.computation.way().describe(self.knowledge),
                share(figures.agreement),
                distance(figures.error),
                distance(figures.width),
                share(figures.availability),
            ]
        };
        let rows: Vec<_> = self.ways().filter(|(way, _)| is_needed(way.variable())).map(row).collect();
        let head = ["need", "way, in the last minutes", "agreed", "off by", "width", "there"];
        (!rows.is_empty()).then(|| show::table(&head, rows))
    }
}

fn unit(knowledge: &KnowledgeBase, variable: VariableId) -> String {
    knowledge.variables()[variable].unit.as_ref().map_or(String::new(), |unit| format!(" {unit}"))
}

fn difference_from_si(knowledge: &KnowledgeBase, variable: VariableId, value: f64) -> f64 {
    knowledge.variables()[variable].unit.as_ref().map_or(value, |unit| value / unit.scale)
}

fn need_report(run: &Run, clean: Option<&Run>, id: NeedId, need: &Need) -> NeedReport {
    let status = run.engine.need_status(id);
    let to_end = status.last.map_or(run.last - run.first, |last| run.last - last);

    NeedReport {
        id,
        published: status.published,
        longest_gap: status.longest_gap.max(to_end),
        met: status.published > 0 && status.longest_gap.max(to_end) <= need.max_age,
        source: status.source,
        widest: status.widest,
        error: clean
            .and_then(|clean| difference(values(run, need), &values(clean, need).collect::<Vec<_>>())),
    }
}

/// The published scalars of a need, by the name under which it is published: when, and the middle of the value.
fn values<'r>(run: &'r Run, need: &'r Need) -> impl Iterator<Item = (Time, f64)> + 'r {
    let of_need = |known: &KnowledgeBase, publication: &Publication| {
        known.needs()[publication.need].signal == need.signal
    };
    run.told_values(0).filter(move |(known, publication)| of_need(known, publication)).filter_map(
        |(_, publication)| match &publication.value {
            PublishedValue::Scalar(value) => Some((publication.time, value.midpoint())),
            PublishedValue::Vector(_) => None,
        },
    )
}

/// Root mean square and largest difference to the value that stood at the same moment.
fn difference(values: impl Iterator<Item = (Time, f64)>, reference: &[(Time, f64)]) -> Option<(f64, f64)> {
    let (mut count, mut squares, mut most) = (0_u64, 0.0, 0.0_f64);
    for (time, value) in values {
        let standing = reference.partition_point(|(at, _)| *at <= time);
        let Some((_, expected)) = standing.checked_sub(1).and_then(|at| reference.get(at)) else { continue };
        let error = (value - expected).abs();
        count += 1;
        squares += error * error;
        most = most.max(error);
    }
    (count > 0).then(|| ((squares / count as f64).sqrt(), most))
}

/// Writes the values of all needs as JSON lines, in the variables' units.
pub(super) fn write_values(run: &Run, mut output: impl Write) -> anyhow::Result<()> {
    for (knowledge, publication) in run.told_values(0) {
        write_value(knowledge, publication, &mut output)?;
    }
    output.flush()?;
    Ok(())
}

/// Writes one of them.
pub(super) fn write_value(
    knowledge: &KnowledgeBase,
    publication: &Publication,
    output: &mut impl Write,
) -> anyhow::Result<()> {
    writeln!(output, "{}", value_json(knowledge, publication))?;
    Ok(())
}

fn value_json(knowledge: &KnowledgeBase, publication: &Publication) -> Value {
    let need = &knowledge.needs()[publication.need];
    let unit = &knowledge.variables()[need.variable].unit;
    let shown = |value: f64| unit.as_ref().map_or(value, |unit| unit.from_si(value));
    let interval = |value: &Interval| json!({ "lo": shown(value.lo()), "hi": shown(value.hi()) });
    let value = match &publication.value {
        PublishedValue::Scalar(value) => interval(value),
        PublishedValue::Vector(elements) => elements.iter().map(interval).collect(),
    };
    json!({
        "signal": need.signal,
        "time_ns": publication.validity.to.0,
        "received_ns": publication.time.0,
        "value": value,
        "quality": format!("{:?}", publication.quality).to_lowercase(),
    })
}
