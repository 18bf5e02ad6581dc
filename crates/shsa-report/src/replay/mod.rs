//! The results of a replay: what was published, decided and trusted, session by session.

mod picture;
mod errors;
mod needs;
mod table;
mod values;
mod json;
mod text;
mod strip;
mod bands;
mod cases;
mod over_time;
mod page;
mod played;

pub use errors::NeedErrors;
pub use over_time::CasesOverTime;
pub use page::Provenance;
pub use picture::Recorder;
pub use played::Played;
pub use table::{ReplayTable, ValueTable, write_event_table};
pub use values::{ValueWriter, value_json};

use crate::analysis::{shortened, unwatched};
use crate::{ReportError, Source};
use needs::{NeedReport, need_report, together};
use page::Page;
use shsa_core::alignment::Counts;
use shsa_core::engine::{Options, WatchBudget};
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::monitor::{Figures, WatchedWay, WayIndex};
use shsa_core::time::{Span, Time};
use shsa_format::comparisons::{Compared, Noted, compared, notes};
use shsa_format::drive::{Given, Run};
use shsa_format::event;
use shsa_format::story::Story;

/// A replayed session.
#[derive(Clone, Copy)]
pub struct Part<'a> {
    /// The run at its end.
    pub run: &'a Run,
    /// The errors relative to a run without the injected faults, if there are any.
    pub errors: Option<&'a NeedErrors>,
    /// The inputs.
    pub source: &'a Source,
}

impl<'a> Part<'a> {
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
///
/// # Example
/// ```
/// use shsa_core::engine::Options;
/// use shsa_format::drive::Run;
/// use shsa_report::replay::{Part, Provenance, Recorder, Report};
/// use shsa_report::{Source, Style};
///
/// let text = std::fs::read_to_string("../../stories/02-fallback-by-value.yaml")?;
/// let story = shsa_format::story::load(&text, "02.yaml", std::path::Path::new(".")).story.expect("a story");
/// let source = Source::of_story(&story);
/// let mut recorder = Recorder::new();
/// let run = Run::of(&source.eras, source.span, Options::default(), |run, given| {
///     let published = run.publications.len();
///     run.give(given);
///     recorder.look(run, published);
///     Ok::<(), std::convert::Infallible>(())
/// })?;
/// recorder.end(&run);
/// let parts = [Part { run: &run, errors: None, source: &source }];
/// let report = Report::new(&parts, Options::default().watch).expect("there is a session");
/// assert!(report.all_met());
/// assert!(report.text(Style::PLAIN, std::time::Duration::ZERO).contains("failed      /gnss/speed"));
/// assert_eq!(report.json(std::time::Duration::ZERO)["needs"]["speed"]["met"], true);
/// let made = Provenance { model: "02.yaml".to_owned(), text, hash: String::new(), command: String::new() };
/// assert!(report.page(&[recorder], &made).starts_with("<!DOCTYPE html>"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Report<'a> {
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
    /// The report of all sessions, in their order; `None` without a session. Needs and signals are those of the last model; `watch`
    /// is the budget of the runs.
    #[must_use]
    pub fn new(parts: &'a [Part<'a>], watch: WatchBudget) -> Option<Report<'a>> {
        let &Part { run, source, .. } = parts.last()?;
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
        let mut warnings = unwatched(knowledge, watch);
        let comparisons = compared(parts.iter().map(|part| &part.run.engine));
        let seen = comparisons.iter().filter_map(Compared::warning).collect();
        warnings.extend(shortened(seen));
        let notes = notes(&run.engine).collect();
        Some(Report { knowledge, parts, run, source, needs_of, needs, comparisons, warnings, notes })
    }

    /// The number of a session from 1, if there are several.
    fn number(&self, at: usize) -> Option<usize> {
        (self.parts.len() > 1).then_some(at + 1)
    }

    /// Whether every need had a fresh value all the time.
    #[must_use]
    pub fn all_met(&self) -> bool {
        self.needs.iter().all(|need| need.met)
    }

    /// A page for the browser. There is a recorder for each session; `made` says of what and how it was made.
    #[must_use]
    pub fn page(&self, recorders: &[Recorder], made: &Provenance) -> String {
        Page { report: self }.write(recorders, made)
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

/// The page about a story.
///
/// # Errors
/// When nothing happens in it.
pub fn story_page(story: &Story, made: &Provenance) -> Result<String, ReportError> {
    let source = Source::of_story(story);
    let (options, mut recorder) = (Options::default(), Recorder::new());
    let run = Run::of(&source.eras, source.span, options, |run, given: Given<'_>| {
        let published = run.publications.len();
        run.give(given);
        recorder.look(run, published);
        Ok::<(), ReportError>(())
    })?;
    recorder.end(&run);
    let parts = [Part { run: &run, errors: None, source: &source }];
    let report = Report::new(&parts, options.watch).ok_or(ReportError::NothingHappens)?;
    Ok(report.page(&[recorder], made))
}
