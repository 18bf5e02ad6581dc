//! The results of a replay, as text and as JSON.

mod needs;
mod json;
mod text;
mod strip;
mod bands;
mod cases;
mod page;

pub(crate) use page::Made;
pub(super) use page::Page;

use super::Source;
use crate::unwatched;
use needs::{NeedReport, need_report, together};
use shsa_core::alignment::Counts;
use shsa_core::engine::WatchBudget;
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::monitor::{Figures, WatchedWay, WayIndex};
use shsa_core::time::{Span, Time};
use shsa_format::comparisons::{Compared, Noted, compared, notes};
use shsa_format::drive::Run;
use shsa_format::event;
use std::io::{Write, stdout};
use std::time::Duration;

/// A replayed session.
pub(super) struct Part<'a> {
    pub(super) run: &'a Run,
    /// The run without the injected faults.
    pub(super) clean: Option<&'a Run>,
    pub(super) source: &'a Source,
}

impl<'a> Part<'a> {
    pub(super) fn of(source: &'a Source, run: &'a Run, clean: &'a Option<Run>) -> Part<'a> {
        Part { run, clean: clean.as_ref(), source }
    }

    /// The origin of the times.
    fn origin(&self) -> Time {
        self.source.origin.unwrap_or(self.run.first)
    }

    fn since(&self, time: Time) -> f64 {
        (time - self.origin()).seconds()
    }

    fn duration(&self) -> Span {
        self.run.last - self.run.first
    }

    /// The changes of the model: times and files.
    fn reloads(&self) -> impl Iterator<Item = (Time, &str)> {
        let eras = self.source.eras.iter().filter_map(|era| Some((era, era.change.as_ref()?)));
        eras.map(|(era, (file, _))| (era.from, file.as_str()))
    }

    /// Why this is a session of its own.
    fn because(&self) -> String {
        let session = self.source.session.as_ref();
        session.and_then(|it| it.because.as_ref()).map_or(String::new(), |because| format!("; {because}"))
    }

    fn files(&self) -> Vec<String> {
        let files = self.source.session.iter().flat_map(|session| &session.files);
        files.map(|file| file.display().to_string()).collect()
    }
}

/// The results of a replay over all sessions; there is at least one.
pub(super) struct Report<'a> {
    knowledge: &'a KnowledgeBase,
    parts: &'a [Part<'a>],
    /// The run of the last session, for the facts about the end.
    run: &'a Run,
    source: &'a Source,
    /// By session, and all together.
    needs_of: Vec<Vec<NeedReport>>,
    needs: Vec<NeedReport>,
    /// Each comparison with its count, over all sessions.
    comparisons: Vec<Compared>,
    /// Declared comparisons that are not made: known in advance, and found in the run.
    warnings: Vec<String>,
    /// Deviations at the end that accuse nobody.
    notes: Vec<Noted>,
}

impl<'a> Report<'a> {
    /// Needs and signals are those of the last model.
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

    /// The number of a session from 1, if there are several.
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

    /// The monitored ways with their figures at the end.
    fn ways(&self) -> impl Iterator<Item = (&WatchedWay, Figures)> {
        let monitor = self.run.engine.monitor();
        let indices = (0..).map(WayIndex);
        indices.zip(monitor.ways()).map(|(index, way)| (way, monitor.figures(index, self.run.last)))
    }

    fn counts(&self, signal: &str, parts: &[Part<'_>]) -> Counts {
        let mut counts = Counts::default();
        for engine in parts.iter().map(|part| &part.run.engine) {
            let id = engine.knowledge().signal(signal);
            id.into_iter().for_each(|id| counts += engine.monitor().ports()[id].counts());
        }
        counts
    }
}

fn difference_from_si(knowledge: &KnowledgeBase, variable: VariableId, value: f64) -> f64 {
    knowledge.variables()[variable].unit.as_ref().map_or(value, |unit| value / unit.scale)
}

/// The verdict about a signal at the end of a run.
fn verdict(run: &Run, signal: &str) -> &'static str {
    let id = run.engine.knowledge().signal(signal);
    id.map_or("", |id| event::verdict(run.engine.absence(id), run.engine.verdict(id)))
}
