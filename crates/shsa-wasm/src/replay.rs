//! The whole loop over recordings, with injected faults; and why it decided as it did.

use crate::progress::{Told, UNMEASURED};
use crate::{Model, Problem, Recordings};
use js_sys::Function;
use shsa_core::engine::{Input, Options};
use shsa_core::time::Span;
use shsa_format::drive::Given;
use shsa_format::fault::Fault;
use shsa_lab::campaign::Progress as _;
use shsa_report::explanation::{Explanation, Question, inquire, list_json};
use shsa_report::recorded::{Injection, Recorded, Stage, broken, wanted};
use shsa_report::replay::{Played, Provenance, Report, value_json};
use shsa_report::{Source, Style};
use std::convert::Infallible;
use wasm_bindgen::prelude::wasm_bindgen;

/// How many observations are one step of the progress.
const STEP: usize = 4_096;

/// A replay that is over.
#[wasm_bindgen]
pub struct Replay {
    played: Played,
    made: Provenance,
    warnings: Vec<String>,
}

/// The inputs of a replay, and what is to be told of them.
struct Asked {
    sources: Vec<Source>,
    warnings: Vec<String>,
}

fn asked(recordings: &Recordings, model: &Model, faults: &[Fault], seed: u64) -> Result<Asked, Problem> {
    let stages = [Stage::first(model.knowledge().clone())];
    let wanted = wanted(model.knowledge());
    let injections: Vec<Injection<'_>> =
        faults.iter().map(|fault| Injection::new(fault, &stages, &wanted)).collect();
    if let Some(lost) = injections.iter().find(|injection| !injection.has_target()) {
        let known = wanted.iter().map(|it| it.signal.as_str());
        return Err(Problem::unknown("signal", &lost.fault.signal, known));
    }
    let recording = recordings.read(&wanted)?;
    let mut warnings: Vec<String> = recording.joined.clone();
    warnings.extend(recording.warnings.iter().map(ToString::to_string));
    let idle = injections.iter().filter(|injection| !injection.strikes(&recording));
    warnings.extend(idle.map(|it| {
        format!("the fault of {} changes nothing: no observation of it in that time", it.fault.signal)
    }));
    let broken = broken(&recording, &injections, seed);
    let broken = broken.as_deref();
    let (stages, wanted, recording) = (&stages, &*wanted, &recording);
    Ok(Asked { sources: Recorded { stages, wanted, recording, broken, degraded: false }.sources(), warnings })
}

fn faults(texts: &[String]) -> Result<Vec<Fault>, Problem> {
    let fault = |text: &String| text.parse().map_err(|why| Problem::of(format!("the fault '{text}': {why}")));
    texts.iter().map(fault).collect()
}

#[wasm_bindgen]
impl Replay {
    /// Replays recordings with faults as the command writes them, `bias=2:wheel_1@20s..`.
    ///
    /// # Errors
    /// When the recordings cannot be read, have none of the model's signals, or a fault cannot be injected.
    #[wasm_bindgen(constructor)]
    pub fn new(
        model: &Model,
        recordings: &Recordings,
        inject: Vec<String>,
        seed: u32,
        progress: Option<Function>,
    ) -> Result<Replay, Problem> {
        let told = Told::to(progress);
        let Asked { sources, warnings } = asked(recordings, model, &faults(&inject)?, u64::from(seed))?;
        let count = |source: &Source| {
            source.eras.iter().chain(source.clean.iter().flatten()).map(|era| era.inputs.len()).sum::<usize>()
        };
        told.begin(sources.iter().map(count).sum::<usize>() / STEP, "thousands of observations");
        let mut seen = 0_usize;
        let Ok(played) = Played::of(sources, Options::default(), |given| {
            seen += usize::from(matches!(given, Given::Input(Input::Observation(_))));
            if seen.is_multiple_of(STEP) {
                told.step();
            }
            Ok::<(), Infallible>(())
        });
        let faults: String = inject.iter().map(|fault| format!(" --inject {fault}")).collect();
        let made = Provenance {
            model: model.name().to_owned(),
            text: model.text().to_owned(),
            hash: String::new(),
            command: format!("shsa replay {} {}{faults}", model.name(), recordings.names()),
        };
        Ok(Replay { played, made, warnings })
    }

    /// What `shsa replay --json` prints, but for the time that it took, which is 0.
    ///
    /// # Errors
    /// When nothing was replayed.
    pub fn json(&self) -> Result<String, Problem> {
        let parts = self.played.parts();
        Ok(report(&parts)?.json(UNMEASURED).to_string())
    }

    /// What `shsa replay` prints.
    ///
    /// # Errors
    /// As [`json`](Replay::json).
    pub fn text(&self) -> Result<String, Problem> {
        let parts = self.played.parts();
        Ok(report(&parts)?.text(Style::PLAIN, UNMEASURED))
    }

    /// The page that `shsa replay --report` writes.
    ///
    /// # Errors
    /// As [`json`](Replay::json).
    pub fn page(&self) -> Result<String, Problem> {
        let parts = self.played.parts();
        Ok(report(&parts)?.page(&self.played.recorders, &self.made))
    }

    /// The published values as JSON lines, as `shsa replay --output` writes them for one session.
    #[must_use]
    pub fn values(&self) -> String {
        let all = self.played.runs.iter().flat_map(|run| run.publications_with_models(0));
        all.map(|(known, publication)| format!("{}\n", value_json(known, publication))).collect()
    }

    /// What there is to know of the recordings, one line each.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// All decisions, numbered: what `shsa explain --json` prints without a signal.
    #[must_use]
    pub fn decisions(&self) -> String {
        self.played.runs.first().map_or_else(String::new, |run| list_json(run).to_string())
    }

    /// Why a signal was suspected, at its first accusation or at a time in seconds: what `shsa explain --json` prints.
    ///
    /// # Errors
    /// When the model has no such signal, or the run ends before the time.
    pub fn explain(&self, signal: &str, at_s: Option<f64>) -> Result<String, Problem> {
        let at = at_s.map(|at| Span((at * 1e9) as i64));
        self.explained(&Question::Signal { name: signal.to_owned(), at }, |it, _| it.json().to_string())
    }

    /// As [`explain`](Replay::explain), as a page with drawings.
    ///
    /// # Errors
    /// As [`explain`](Replay::explain).
    pub fn explain_page(&self, signal: &str, at_s: Option<f64>) -> Result<String, Problem> {
        let at = at_s.map(|at| Span((at * 1e9) as i64));
        self.explained(&Question::Signal { name: signal.to_owned(), at }, |it, source| {
            it.page(&it.drawings(source, None, usize::MAX), &self.made.model)
        })
    }

    fn explained(
        &self,
        question: &Question,
        write: impl Fn(&Explanation<'_>, &Source) -> String,
    ) -> Result<String, Problem> {
        let Some(source) = self.played.sources.first() else { return Err(Problem::of(NOTHING)) };
        let inquiry = inquire(source, question, |_| {}).map_err(Problem::of)?;
        Ok(write(&Explanation::new(&inquiry, source), source))
    }
}

const NOTHING: &str = "nothing to replay";

fn report<'a>(parts: &'a [shsa_report::replay::Part<'a>]) -> Result<Report<'a>, Problem> {
    Report::new(parts, Options::default().watch).ok_or_else(|| Problem::of(NOTHING))
}
