//! What is found out from recordings: calibration, campaigns of faults, learned relations.

use crate::model::Model;
use crate::problem::failed;
use crate::replay::{Recordings, emptiness, warnings};
use crate::work;
use pyo3::prelude::*;
use serde_json::{Value, json};
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::time::Span;
use shsa_lab::LabError;
use shsa_lab::calibration::{self, Parted};
use shsa_lab::campaign::{
    AmountSpec, Baseline, Campaign, Grid, GridSpec, Kind, Progress, Recorded, instead, measure,
};
use shsa_lab::doctor::examine;
use shsa_lab::drafting::Origin;
use shsa_lab::learning;
use shsa_lab::proposal::{Proposals, Subject};
use shsa_recording::{ReadOptions, Recording};
use shsa_report::recorded::wanted;
use shsa_report::{Style, calibration as calibrated, doctor as examined, learning as learned};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::thread;

/// Reads what a model wants.
fn read(py: Python<'_>, model: &Model, recordings: &Recordings) -> PyResult<Recording> {
    let wanted = wanted(model.knowledge());
    let read = work::run(py, None, |_| recordings.read(&wanted))?;
    let recording = read.map_err(|error| failed(py, error))?;
    emptiness(&recording).map_or(Ok(recording), |why| Err(failed(py, why)))
}

/// Fits the numbers of a model; returns the results as JSON and the change of the model, if it is none for the worse.
#[pyfunction]
pub(crate) fn calibrate(
    py: Python<'_>,
    model: &Model,
    recordings: Recordings,
    false_alarms: f64,
    split_s: Option<f64>,
    skip_s: Vec<(f64, f64)>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(String, Option<String>, Vec<String>)> {
    let recording = read(py, model, &recordings)?;
    let skip: Vec<(Span, Span)> =
        skip_s.iter().map(|(from, to)| (Span::from_seconds(*from), Span::from_seconds(*to))).collect();
    let parted = Parted::of(&recording, split_s.map(Span::from_seconds), &skip);
    let parted = parted.map_err(|error| failed(py, error))?;
    let found = work::run(py, progress.as_ref(), |watch| {
        watch.begin(calibration::STEPS);
        let options = calibration::Options {
            alarms_per_hour: false_alarms,
            threads: thread::available_parallelism().map_or(1, NonZeroUsize::get),
            progress: &|| watch.advance(1),
            ..calibration::Options::default()
        };
        calibration::calibrate(model.live.draft(), &parted.fitted, &parted.unseen, &options)
    })?;
    let found = found.map_err(|error| failed(py, error))?;
    let refusal = found.refusal().or_else(|| found.blindness());
    let report = calibrated::Report {
        draft: model.live.draft(),
        knowledge: model.knowledge(),
        found: &found,
        smallest: None,
        firsts: &parted.firsts,
        split: parted.split,
        duration: parted.duration,
        refusal: refusal.as_deref(),
    };
    let patch = refusal.is_none().then(|| report.patch(Style::PLAIN));
    Ok((report.json().to_string(), patch, warnings(&recording)))
}

/// What a campaign tries.
struct Asked {
    kinds: Vec<Kind>,
    multiples: Vec<f64>,
    signals: Vec<SignalId>,
    onsets: usize,
    seeds: u64,
    duration: Option<Span>,
}

/// Tries a grid of faults; returns the figures as JSON.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the Python function names them all")]
pub(crate) fn campaign(
    py: Python<'_>,
    model: &Model,
    recordings: Recordings,
    kinds: Vec<String>,
    amounts: Vec<f64>,
    signals: Vec<String>,
    onsets: usize,
    seeds: u64,
    duration_s: Option<f64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(String, Vec<String>)> {
    let named = signals.iter().map(|name| model.signal(py, name)).collect::<PyResult<Vec<SignalId>>>()?;
    let all = || model.knowledge().signals().ids().collect();
    let asked = Asked {
        kinds: kinds_named(py, &kinds)?,
        multiples: amounts,
        signals: if named.is_empty() { all() } else { named },
        onsets,
        seeds,
        duration: duration_s.map(Span::from_seconds),
    };
    let recording = read(py, model, &recordings)?;
    let sessions: Vec<Recorded<'_>> = recording
        .by_session()
        .map(|(session, samples)| Recorded { origin: session.origin, samples })
        .collect();
    let found = work::run(py, progress.as_ref(), |watch| tried(model.knowledge(), &sessions, &asked, watch))?;
    let (found, left_out) = found.map_err(|error| failed(py, error))?;
    Ok((found.to_string(), [warnings(&recording), left_out].concat()))
}

fn kinds_named(py: Python<'_>, names: &[String]) -> PyResult<Vec<Kind>> {
    let known = || Kind::ALL.map(Kind::name).join(", ");
    let kind = |name: &String| {
        let found = Kind::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| failed(py, format!("there is no kind of fault '{name}'; known are {}", known())))
    };
    let named = names.iter().map(kind).collect::<PyResult<Vec<Kind>>>()?;
    Ok(if named.is_empty() { Kind::ALL.to_vec() } else { named })
}

/// The figures, and what was left out.
fn tried(
    known: &KnowledgeBase,
    sessions: &[Recorded<'_>],
    asked: &Asked,
    progress: &dyn Progress,
) -> Result<(Value, Vec<String>), LabError> {
    let Asked { kinds, multiples, signals, onsets, seeds, duration } = asked;
    let (onsets, seeds, duration) = (*onsets, *seeds, *duration);
    let instead =
        instead(known, sessions, &AmountSpec { signals, onsets, duration, threads: None, progress })?;
    let spec =
        GridSpec { kinds, multiples, signals, onsets, seeds, duration, detectable: None, instead: &instead };
    let grid = Grid::new(known, sessions, &spec)?;
    let baselines: Option<Vec<Baseline<'_>>> =
        sessions.iter().map(|it| Baseline::new(known, it.origin, it.samples)).collect();
    let baselines = baselines.ok_or_else(|| LabError::Unfit("nothing recorded".to_owned()))?;
    let results = measure(&baselines, &grid, None, progress)?;
    let left_out = grid.left_out.iter().map(|reason| format!("left out: {reason}")).collect();
    let campaign = Campaign { baselines: &baselines, knowledge: known, grid: &grid, seeds, results };
    Ok((campaign.to_json(), left_out))
}

/// Learns relations between the signals of a model, or of recordings alone; returns them as JSON, the change of the model, and
/// warnings.
#[pyfunction]
pub(crate) fn learn(
    py: Python<'_>,
    model: Option<&Model>,
    recordings: Recordings,
    need: Option<&str>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(String, String, Vec<String>)> {
    let (subject, warnings) = match (model, recordings) {
        (Some(model), recordings) => {
            let recording = read(py, model, &recordings)?;
            (Subject::of_model(model.written(), model.knowledge(), &recording), warnings(&recording))
        }
        (None, Recordings::Paths(recordings)) => {
            let names: Vec<String> = recordings.iter().map(|path| path.display().to_string()).collect();
            let columns = Origin { recordings, by: None, options: ReadOptions::default() }.read();
            let columns = columns.map_err(|error| failed(py, error))?;
            let subject = Subject::of_draft(&columns, &names.join(", "), &());
            (subject.map_err(|error| failed(py, error))?, columns.warnings)
        }
        (None, Recordings::Table(_)) => return Err(failed(py, "a table is learned from with a model")),
    };
    let found = work::run(py, progress.as_ref(), |progress| {
        let learned = learning::learn_sessions(&subject.signals, &subject.joints, progress)?;
        let mut proposals = Proposals::new(&subject, &learned, progress)?;
        let serving = need.map(|need| proposals.serve(&subject, need)).transpose()?;
        let report = learned::Report {
            subject: &subject,
            learned: &learned,
            proposals: &proposals,
            serving: serving.as_ref(),
        };
        Ok::<_, LabError>((report.json(), report.patch()))
    })?;
    let (found, patch): (Value, String) = found.map_err(|error| failed(py, error))?;
    Ok((json!(found).to_string(), patch, warnings))
}

/// Finds what is wrong in recordings; returns it as JSON and as a page, the model that was found out, and warnings.
#[pyfunction]
pub(crate) fn doctor(
    py: Python<'_>,
    recordings: Vec<PathBuf>,
    names: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<(String, String, String, Vec<String>)> {
    let origin = Origin { recordings, by: None, options: ReadOptions::default() };
    let found = work::run(py, progress.as_ref(), |progress| {
        let mut columns = origin.read()?;
        let diagnosis = examine(&mut columns, names, progress)?;
        let report = examined::Report { columns: &columns, diagnosis: &diagnosis };
        let (json, page) = (report.json().to_string(), report.page(names));
        Ok::<_, LabError>((json, page, diagnosis.model, columns.warnings))
    })?;
    found.map_err(|error| failed(py, error))
}
