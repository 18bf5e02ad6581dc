//! The results of a replay as one JSON object.

use super::needs::NeedReport;
use super::{Part, Report, difference_from_si, verdict};
use serde_json::{Map, Value, json};
use shsa_core::engine::Event;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::monitor::{Figures, WatchedWay};
use shsa_core::time::Time;
use shsa_format::comparisons::{Compared, Noted};
use shsa_format::{event, learned, measurements};
use std::time::Duration;

impl Report<'_> {
    /// One object; `elapsed` is how long the replay has taken.
    #[must_use]
    pub fn json(&self, elapsed: Duration) -> Value {
        let parts = || self.parts.iter().enumerate();
        let events: Vec<Value> = parts()
            .flat_map(|(at, part)| self.events_json(at, part, part.run.events_with_models()))
            .collect();
        let outliers: Vec<Value> = parts()
            .flat_map(|(at, part)| self.events_json(at, part, part.run.outliers_with_models()))
            .collect();
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
        let fused = self.parts.last().map(|part| measurements::json(&part.run.engine)).unwrap_or_default();
        let learned = self.parts.last().map(|part| learned::json(&part.run.engine)).unwrap_or_default();
        for (key, of_it) in [("fusion", fused), ("learned", learned)] {
            if let Some(report) = report.as_object_mut().filter(|_| !of_it.is_empty()) {
                report.insert(key.to_owned(), Value::Object(of_it));
            }
        }
        let sessions: Vec<Value> = parts().filter_map(|(at, part)| self.session_json(at, part)).collect();
        for (key, more) in [("outliers", outliers), ("reloads", reloads), ("sessions", sessions)] {
            if let Some(report) = report.as_object_mut().filter(|_| !more.is_empty()) {
                report.insert(key.to_owned(), Value::Array(more));
            }
        }
        report
    }

    fn events_json<'e>(
        &self,
        at: usize,
        part: &Part<'_>,
        events: impl Iterator<Item = (&'e KnowledgeBase, &'e Event)>,
    ) -> Vec<Value> {
        let event = |(known, event): (&KnowledgeBase, &Event)| {
            let session = self.number(at).map(|number| ("session".to_owned(), json!(number)));
            let time = ("time_s".to_owned(), json!(part.since(event.time)));
            let fields = std::iter::once(time).chain(session).chain(event::fields(known, event));
            Value::Object(fields.collect())
        };
        events.map(event).collect()
    }

    fn reloads_json(&self, at: usize, part: &Part<'_>) -> Vec<Value> {
        let reload = |(time, file): (Time, &str)| match self.number(at) {
            None => json!({ "time_s": part.since(time), "file": file }),
            Some(number) => json!({ "time_s": part.since(time), "session": number, "file": file }),
        };
        part.reloads().map(reload).collect()
    }

    /// One of several sessions, with its state at the end.
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

    /// Counts over sessions, and the verdict at the end of the last one.
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

    pub(super) fn missing(&self, signal: SignalId) -> usize {
        self.source.missing.get(&self.knowledge.signals()[signal].name).copied().unwrap_or(0)
    }
}
