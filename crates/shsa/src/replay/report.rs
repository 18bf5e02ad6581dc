//! What a replay found, as text and as JSON.

use super::Source;
use crate::show::{self, Paint};
use crate::tell;
use crate::unwatched;
use serde_json::{Map, Value, json};
use shsa_core::alignment::Counts;
use shsa_core::engine::{Event, Publication, PublishedValue, Quality, WatchBudget};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, Need, NeedId, SignalId, VariableId};
use shsa_core::monitor::{Figures, WatchedWay, WayIndex};
use shsa_core::time::{Span, Time};
use shsa_format::comparisons::{Compared, Noted, compared, notes};
use shsa_format::drive::Run;
use shsa_format::event;
use shsa_format::text::counted;
use std::io::{Write, stdout};
use std::time::Duration;

/// A session that was replayed.
pub(super) struct Part<'a> {
    pub(super) run: &'a Run,
    /// The same without the injected faults.
    pub(super) clean: Option<&'a Run>,
    pub(super) source: &'a Source,
}

impl<'a> Part<'a> {
    pub(super) fn of(((source, run), clean): ((&'a Source, &'a Run), &'a Option<Run>)) -> Part<'a> {
        Part { run, clean: clean.as_ref(), source }
    }

    /// From which times count.
    fn origin(&self) -> Time {
        self.source.origin.unwrap_or(self.run.first)
    }

    fn since(&self, time: Time) -> f64 {
        (time - self.origin()).seconds()
    }

    fn duration(&self) -> Span {
        self.run.last - self.run.first
    }

    /// When the model was changed, and by which file.
    fn reloads(&self) -> impl Iterator<Item = (Time, &str)> {
        let eras = self.source.eras.iter().filter_map(|era| Some((era, era.change.as_ref()?)));
        eras.map(|(era, (file, _))| (era.from, file.as_str()))
    }

    /// Why it is one of its own.
    fn because(&self) -> String {
        let session = self.source.session.as_ref();
        session.and_then(|it| it.because.as_ref()).map_or(String::new(), |because| format!("; {because}"))
    }

    fn files(&self) -> Vec<String> {
        let files = self.source.session.iter().flat_map(|session| &session.files);
        files.map(|file| file.display().to_string()).collect()
    }
}

/// How a need was served.
#[derive(Clone)]
struct NeedReport {
    id: NeedId,
    published: u64,
    longest_gap: Span,
    /// Whether no value was older than the need allows, to the end.
    met: bool,
    source: Option<String>,
    widest: f64,
    /// How far it was off from the run without the injected faults.
    error: Option<Difference>,
}

/// How far values are off from those of another run.
#[derive(Clone, Copy, Default)]
struct Difference {
    count: u64,
    squares: f64,
    most: f64,
}

impl Difference {
    fn rms(&self) -> f64 {
        (self.squares / self.count as f64).sqrt()
    }

    fn and(self, other: Difference) -> Difference {
        Difference {
            count: self.count + other.count,
            squares: self.squares + other.squares,
            most: self.most.max(other.most),
        }
    }
}

/// What a replay found, over all sessions; there is at least one.
pub(super) struct Report<'a> {
    knowledge: &'a KnowledgeBase,
    parts: &'a [Part<'a>],
    /// The last one: what stands at the end is told of it.
    run: &'a Run,
    source: &'a Source,
    /// By session, and all together.
    needs_of: Vec<Vec<NeedReport>>,
    needs: Vec<NeedReport>,
    /// Each comparison with how often it was made, over all sessions.
    comparisons: Vec<Compared>,
    /// What is not compared though the model declares it, by what was known before and by what has turned out.
    warnings: Vec<String>,
    /// What showed at the end and accuses nobody.
    notes: Vec<Noted>,
}

impl<'a> Report<'a> {
    /// Needs and signals are those of the model at the end.
    pub(super) fn new(parts: &'a [Part<'a>], watch: WatchBudget) -> Option<Report<'a>> {
        let Part { run, source, .. } = parts.last()?;
        let knowledge = run.engine.knowledge();
        let of_part = |part: &Part<'_>| -> Vec<NeedReport> {
            knowledge
                .needs()
                .enumerate()
                .map(|(id, need)| need_report(part, id, need, parts.len() > 1))
                .collect()
        };
        let needs_of: Vec<Vec<NeedReport>> = parts.iter().map(of_part).collect();
        let needs = (0..knowledge.needs().len()).filter_map(|at| together(&needs_of, at)).collect();
        let mut warnings = unwatched::declared(knowledge, watch);
        let comparisons = compared(parts.iter().map(|part| &part.run.engine));
        let seen = comparisons.iter().filter_map(Compared::warning).collect();
        warnings.extend(unwatched::shortened(seen));
        let notes = notes(&run.engine).collect();
        Some(Report { knowledge, parts, run, source, needs_of, needs, comparisons, warnings, notes })
    }

    /// The number of a session where there are several, from 1.
    fn number(&self, at: usize) -> Option<usize> {
        (self.parts.len() > 1).then_some(at + 1)
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
        Span(self.parts.iter().map(|part| part.duration().0).sum())
    }

    fn observations(&self) -> usize {
        self.parts.iter().map(|part| part.run.observations).sum()
    }

    fn json(&self, elapsed: Duration) -> Value {
        let parts = || self.parts.iter().enumerate();
        let events: Vec<Value> = parts().flat_map(|(at, part)| self.events_json(at, part)).collect();
        let reloads: Vec<Value> = parts().flat_map(|(at, part)| self.reloads_json(at, part)).collect();
        let needs: Map<String, Value> = self.needs.iter().map(|need| self.need_json(need)).collect();
        let signals: Map<String, Value> =
            self.knowledge.signals().ids().map(|signal| self.signal_json(signal, self.parts)).collect();
        let ways: Vec<Value> = self.ways().map(|(way, figures)| self.way_json(way, &figures)).collect();
        let mut report = json!({
            "observations": self.observations(),
            "duration_s": self.duration().seconds(),
            "elapsed_s": elapsed.as_secs_f64(),
            "events": events,
            "needs": needs,
            "signals": signals,
            "ways": ways,
            "comparisons": self.comparisons.iter().map(Compared::json).collect::<Vec<_>>(),
            "warnings": self.warnings,
            "notes": self.notes.iter().map(Noted::json).collect::<Vec<_>>(),
        });
        let sessions: Vec<Value> = parts().filter_map(|(at, part)| self.session_json(at, part)).collect();
        for (key, more) in [("reloads", reloads), ("sessions", sessions)] {
            if let Some(report) = report.as_object_mut().filter(|_| !more.is_empty()) {
                report.insert(key.to_owned(), Value::Array(more));
            }
        }
        report
    }

    fn events_json(&self, at: usize, part: &Part<'_>) -> Vec<Value> {
        let event = |(known, event): (&KnowledgeBase, &Event)| {
            let session = self.number(at).map(|number| ("session".to_owned(), json!(number)));
            let time = ("time_s".to_owned(), json!(part.since(event.time)));
            let fields = std::iter::once(time).chain(session).chain(event::fields(known, event));
            Value::Object(fields.collect())
        };
        part.run.told_events().map(event).collect()
    }

    fn reloads_json(&self, at: usize, part: &Part<'_>) -> Vec<Value> {
        let reload = |(time, file): (Time, &str)| match self.number(at) {
            None => json!({ "time_s": part.since(time), "file": file }),
            Some(number) => json!({ "time_s": part.since(time), "session": number, "file": file }),
        };
        part.reloads().map(reload).collect()
    }

    /// One of several sessions, with what stood at its end.
    fn session_json(&self, at: usize, part: &Part<'_>) -> Option<Value> {
        let number = self.number(at)?;
        let because =
            part.source.session.as_ref().and_then(|it| it.because.as_ref()).map(ToString::to_string);
        let of_part = std::slice::from_ref(part);
        let signals = self.knowledge.signals().ids().map(|signal| self.signal_json(signal, of_part));
        let needs = self.needs_of.get(at).into_iter().flatten().map(|need| self.need_json(need));
        Some(json!({
            "session": number,
            "files": part.files(),
            "because": because,
            "from_s": part.since(part.run.first),
            "to_s": part.since(part.run.last),
            "observations": part.run.observations,
            "needs": needs.collect::<Map<String, Value>>(),
            "signals": signals.collect::<Map<String, Value>>(),
        }))
    }

    fn need_json(&self, report: &NeedReport) -> (String, Value) {
        let need = &self.knowledge.needs()[report.id];
        let in_unit = |value: f64| difference_from_si(self.knowledge, need.variable, value);
        let mut value = json!({
            "signal": need.signal,
            "met": report.met,
            "source": report.source,
            "published": report.published,
            "longest_gap_s": report.longest_gap.seconds(),
            "widest": in_unit(report.widest),
        });
        if let (Some(error), Some(object)) = (report.error, value.as_object_mut()) {
            object.insert("rmse".to_owned(), json!(in_unit(error.rms())));
            object.insert("max_error".to_owned(), json!(in_unit(error.most)));
        }
        (self.knowledge.need_name(report.id).to_owned(), value)
    }

    /// Counts over sessions, and the verdict at the end of the last.
    fn signal_json(&self, signal: SignalId, parts: &[Part<'_>]) -> (String, Value) {
        let name = &self.knowledge.signals()[signal].name;
        let counts = self.counts(name, parts);
        let value = json!({
            "verdict": parts.last().map_or("", |part| verdict(part.run, name)),
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
        (name.clone(), value)
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

    fn counts(&self, signal: &str, parts: &[Part<'_>]) -> Counts {
        let mut counts = Counts::default();
        for engine in parts.iter().map(|part| &part.run.engine) {
            let id = engine.knowledge().signal(signal);
            id.into_iter().for_each(|id| counts += engine.monitor().ports()[id].counts());
        }
        counts
    }

    fn text(&self, elapsed: Duration) -> String {
        let sessions = match self.parts.len() {
            1 => String::new(),
            count => format!(" in {count} sessions"),
        };
        let mut parts = vec![format!(
            "{} over {:.1} s{sessions}, replayed in {:.3} s",
            counted(self.observations(), "observation"),
            self.duration().seconds(),
            elapsed.as_secs_f64()
        )];
        parts.extend(self.parts.iter().enumerate().map(|(at, part)| self.events_text(at, part)));
        if !self.needs.is_empty() {
            parts.push(self.needs_text());
        }
        parts.push(self.signals_text());
        parts.extend(self.ways_text());
        let warning = |told: &String| format!("{} {told}", show::paint(Paint::Yellow, "warning:"));
        let warnings: Vec<String> = self.warnings.iter().map(warning).collect();
        parts.extend((!warnings.is_empty()).then(|| warnings.join("\n")));
        let notes = unwatched::shortened(self.notes.iter().map(Noted::text).collect());
        let notes: Vec<String> = notes.iter().map(|told| format!("note: {told}")).collect();
        parts.extend((!notes.is_empty()).then(|| notes.join("\n")));
        parts.join("\n\n")
    }

    fn events_text(&self, at: usize, part: &Part<'_>) -> String {
        let text = |time: Time| format!("{:>9.3} s", part.since(time));
        let told = part.run.told_events();
        let mut lines: Vec<(Time, String)> = told
            .map(|(known, event)| (event.time, tell::event_text(&text(event.time), known, event)))
            .collect();
        for (time, file) in part.reloads() {
            let word = show::paint(Paint::Bold, &format!("{:<11}", "reloaded"));
            // What follows from the change is told after it.
            let at = lines.partition_point(|(told, _)| *told < time);
            lines.insert(at, (time, format!("{}  {word} {file}", text(time))));
        }
        let head = self.number(at).map(|number| {
            let (from, to) = (part.since(part.run.first), part.since(part.run.last));
            let files = part.files().join(", ");
            format!("Session {number}: {files}, {from:.1} s to {to:.1} s{}", part.because())
        });
        let nothing = "No events: nothing failed, nothing was substituted.".to_owned();
        let nothing = lines.is_empty().then_some(nothing);
        let lines = lines.into_iter().map(|(_, line)| line);
        head.into_iter().chain(nothing).chain(lines).collect::<Vec<_>>().join("\n")
    }

    fn needs_text(&self) -> String {
        let mut rows = Vec::new();
        for report in &self.needs {
            let need = &self.knowledge.needs()[report.id];
            let in_unit = |value: f64| difference_from_si(self.knowledge, need.variable, value);
            let error = report.error.map_or(String::new(), |error| {
                format!(
                    "rmse {:.3}, at most {:.3}{}",
                    in_unit(error.rms()),
                    in_unit(error.most),
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
        for signal in self.knowledge.signals().iter() {
            let counts = self.counts(&signal.name, self.parts);
            let verdict = verdict(self.run, &signal.name);
            rows.push(vec![
                signal.name.clone(),
                show::paint_verdict(verdict, verdict),
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

/// What a run thinks of a signal at its end.
fn verdict(run: &Run, signal: &str) -> &'static str {
    let id = run.engine.knowledge().signal(signal);
    id.map_or("", |id| event::verdict(run.engine.absence(id), run.engine.verdict(id)))
}

fn need_report(part: &Part<'_>, id: NeedId, need: &Need, is_one_of_several: bool) -> NeedReport {
    let run = part.run;
    let of_name = |(_, known): &(NeedId, &Need)| known.signal == need.signal;
    // A session may end before the change of the model that brought the need.
    let Some((own, _)) = run.engine.knowledge().needs().enumerate().find(of_name) else {
        let (published, longest_gap, widest) = (0, Span::ZERO, 0.0);
        return NeedReport { id, published, longest_gap, met: true, source: None, widest, error: None };
    };
    let status = run.engine.need_status(own);
    let to_end = status.last.map_or(run.last - run.first, |last| run.last - last);
    let longest_gap = status.longest_gap.max(to_end);
    // Of several sessions one may be over before anything is due.
    let is_over = status.published == 0 && is_one_of_several && part.duration() <= need.max_age;
    NeedReport {
        id,
        published: status.published,
        longest_gap,
        met: is_over || status.published > 0 && longest_gap <= need.max_age,
        source: status.source,
        widest: status.widest,
        error: part
            .clean
            .and_then(|clean| difference(values(run, need), &values(clean, need).collect::<Vec<_>>())),
    }
}

/// A need over all sessions; what serves it is that of the last one.
fn together(needs_of: &[Vec<NeedReport>], at: usize) -> Option<NeedReport> {
    let mut of_need = needs_of.iter().filter_map(|needs| needs.get(at));
    let first = of_need.next()?.clone();
    Some(of_need.fold(first, |sum, next| NeedReport {
        id: next.id,
        published: sum.published + next.published,
        longest_gap: sum.longest_gap.max(next.longest_gap),
        met: sum.met && next.met,
        source: next.source.clone(),
        widest: sum.widest.max(next.widest),
        error: match (sum.error, next.error) {
            (Some(one), Some(other)) => Some(one.and(other)),
            (one, other) => one.or(other),
        },
    }))
}

/// The published scalars of a need, by the name under which it is published: when, and the middle of the value.
fn values<'r>(run: &'r Run, need: &'r Need) -> impl Iterator<Item = (Time, f64)> + 'r {
    // The middle of an uncertain value is nothing that anybody is told.
    let of_need = |known: &KnowledgeBase, publication: &Publication| {
        known.needs()[publication.need].signal == need.signal && publication.quality != Quality::Uncertain
    };
    run.told_values(0).filter(move |(known, publication)| of_need(known, publication)).filter_map(
        |(_, publication)| match &publication.value {
            PublishedValue::Scalar(value) => Some((publication.time, value.midpoint())),
            PublishedValue::Vector(_) => None,
        },
    )
}

/// Root mean square and largest difference to the value that stood at the same moment.
fn difference(values: impl Iterator<Item = (Time, f64)>, reference: &[(Time, f64)]) -> Option<Difference> {
    let mut sum = Difference::default();
    for (time, value) in values {
        let standing = reference.partition_point(|(at, _)| *at <= time);
        let Some((_, expected)) = standing.checked_sub(1).and_then(|at| reference.get(at)) else { continue };
        let error = (value - expected).abs();
        sum = sum.and(Difference { count: 1, squares: error * error, most: error });
    }
    (sum.count > 0).then_some(sum)
}

/// Writes the values of all needs as JSON lines, in the variables' units; with the number of the session where there are several.
pub(super) fn write_values(parts: &[Part<'_>], mut output: impl Write) -> anyhow::Result<()> {
    for (at, part) in parts.iter().enumerate() {
        let session = (parts.len() > 1).then_some(at + 1);
        for (knowledge, publication) in part.run.told_values(0) {
            write_value(knowledge, publication, session, &mut output)?;
        }
    }
    output.flush()?;
    Ok(())
}

/// Writes one of them.
pub(super) fn write_value(
    knowledge: &KnowledgeBase,
    publication: &Publication,
    session: Option<usize>,
    output: &mut impl Write,
) -> anyhow::Result<()> {
    let mut value = value_json(knowledge, publication);
    if let (Some(session), Some(value)) = (session, value.as_object_mut()) {
        value.insert("session".to_owned(), json!(session));
    }
    writeln!(output, "{value}")?;
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
        "quality": publication.quality.name(),
    })
}
