//! The whole loop over recordings, with injected faults.

use crate::model::Model;
use crate::problem::{failed, unknown};
use crate::work::{self, Watch};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use shsa_core::engine::{Input, Options, WatchBudget};
use shsa_format::arrow::{self, Measure};
use shsa_format::drive::{Era, Given, Run};
use shsa_format::fault::Fault;
use shsa_format::table::Kind;
use shsa_recording::{ReadOptions, Recording, RecordingError, Wanted};
use shsa_report::Source;
use shsa_report::recorded::{Injection, Recorded, Stage, broken, wanted};
use shsa_report::replay::{NeedErrors, Part, ReplayTable, Report};
use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// After how many observations the work looks whether it is interrupted.
const STEP: usize = 4_096;

/// Recordings: files and folders, or the bytes of a table in Parquet.
#[derive(FromPyObject)]
pub(crate) enum Recordings {
    Table(Vec<u8>),
    Paths(Vec<PathBuf>),
}

impl Recordings {
    /// Reads what a model wants.
    ///
    /// # Errors
    /// As the readers.
    pub(crate) fn read(&self, wanted: &[Wanted]) -> Result<Recording, RecordingError> {
        let options = ReadOptions::default();
        match self {
            Recordings::Paths(paths) => shsa_recording::read(paths, wanted, &options),
            Recordings::Table(bytes) => {
                shsa_recording::read_bytes(Path::new("table.parquet"), bytes, wanted, &options)
            }
        }
    }
}

/// Why nothing can be done with a recording that was read; `None` where something can.
pub(crate) fn emptiness(recording: &Recording) -> Option<String> {
    if let Some(cause) = recording.cause() {
        return Some(format!("nothing of the recording can be read: {cause}"));
    }
    let why =
        "none of the model's signals is in the recording; `source` in the model says where each is found";
    recording.samples.is_empty().then(|| why.to_owned())
}

/// What is to be told of a recording.
pub(crate) fn warnings(recording: &Recording) -> Vec<String> {
    recording.warnings.iter().map(ToString::to_string).collect()
}

/// A replay that is over.
struct Played {
    sources: Vec<Source>,
    runs: Vec<Run>,
    errors: Vec<Option<NeedErrors>>,
    elapsed: Duration,
}

impl Played {
    fn parts(&self) -> Vec<Part<'_>> {
        let played = self.sources.iter().zip(&self.runs).zip(&self.errors);
        played.map(|((source, run), errors)| Part { run, errors: errors.as_ref(), source }).collect()
    }
}

/// A replay; its lock is only for Python's rule that objects may be shared.
#[pyclass(frozen)]
pub(crate) struct Replay {
    played: Mutex<Played>,
    #[pyo3(get)]
    warnings: Vec<String>,
}

impl Replay {
    fn lock(&self) -> MutexGuard<'_, Played> {
        self.played.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Replay {
    fn report(&self, py: Python<'_>) -> Option<String> {
        py.detach(|| {
            let played = self.lock();
            let parts = played.parts();
            let report = Report::new(&parts, WatchBudget::default())?;
            Some(report.json(played.elapsed).to_string())
        })
    }

    /// The published values.
    fn values<'py>(&self, py: Python<'py>) -> PyResult<Table<'py>> {
        self.table(py, ReplayTable::Values)
    }

    /// The decisions.
    fn events<'py>(&self, py: Python<'py>) -> PyResult<Table<'py>> {
        self.table(py, ReplayTable::Events)
    }
}

/// A table as Arrow has it: its memory, the number of rows, and the columns in it.
type Table<'py> = (Bound<'py, PyBytes>, usize, Vec<Column>);

/// A column: its name, kind and number of missing values; the bytes at which its bitmap, its offsets and its values begin and end; and the
/// width of an offset.
type Column = (String, &'static str, usize, [(usize, usize); 3], usize);

impl Replay {
    /// A table, written right into memory of Python: nothing is copied after that.
    fn table<'py>(&self, py: Python<'py>, which: ReplayTable) -> PyResult<Table<'py>> {
        let mut measure = Measure::new(which.columns());
        py.detach(|| which.write(&self.lock().parts(), &mut measure))?;
        let layout = measure.layout();
        let fill = |memory: &mut [u8]| -> PyResult<()> {
            py.detach(|| which.write(&self.lock().parts(), &mut layout.filler(memory)))?;
            Ok(())
        };
        let memory = PyBytes::new_with(py, layout.length, fill)?;
        Ok((memory, layout.rows, layout.columns.into_iter().map(column).collect()))
    }
}

fn column(it: arrow::Column) -> Column {
    let places = [it.validity, it.offsets, it.values].map(|place| (place.start, place.end));
    (it.name, kind(it.kind), it.missing, places, it.offset_width)
}

fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::Time => "time",
        Kind::Number => "number",
        Kind::Whole => "whole",
        Kind::Text => "text",
    }
}

/// Replays recordings.
#[pyfunction]
pub(crate) fn replay(
    py: Python<'_>,
    model: &Model,
    recordings: Recordings,
    inject: Vec<String>,
    seed: u64,
    progress: Option<Py<PyAny>>,
) -> PyResult<Replay> {
    let stages = [Stage::first(model.knowledge().clone())];
    let wanted = wanted(model.knowledge());
    let faults: Vec<Fault> = inject
        .iter()
        .map(|text| text.parse().map_err(|why| failed(py, format!("the fault '{text}': {why}"))))
        .collect::<PyResult<_>>()?;
    let injections: Vec<Injection<'_>> =
        faults.iter().map(|fault| Injection::new(fault, &stages, &wanted)).collect();
    if let Some(lost) = injections.iter().find(|injection| !injection.has_target()) {
        let known = wanted.iter().map(|it| it.signal.as_str());
        return Err(unknown(py, "signal", &lost.fault.signal, known));
    }
    let read = work::run(py, None, |_| recordings.read(&wanted))?;
    let recording = read.map_err(|error| failed(py, error))?;
    if let Some(why) = emptiness(&recording) {
        return Err(failed(py, why));
    }
    let mut warnings = warnings(&recording);
    let idle = injections.iter().filter(|injection| !injection.strikes(&recording));
    warnings.extend(idle.map(|it| format!("the fault of {} changes nothing", it.fault.signal)));
    let played = work::run(py, progress.as_ref(), |watch| {
        let broken = broken(&recording, &injections, seed);
        let broken = broken.as_deref();
        let (stages, wanted, recording) = (&stages, &*wanted, &recording);
        play(Recorded { stages, wanted, recording, broken, degraded: false }.sources(), watch)
    })?;
    Ok(Replay { played: Mutex::new(played), warnings })
}

/// Runs each session, with and without faults.
fn play(sources: Vec<Source>, watch: &Watch) -> Played {
    let began = Instant::now();
    let length = |source: &Source| {
        let eras = source.eras.iter().chain(source.clean.iter().flatten());
        eras.map(|era| era.inputs.len()).sum::<usize>()
    };
    watch.begin(sources.iter().map(length).sum());
    let runs = sources.iter().map(|source| drive(&source.eras, source, watch)).collect();
    let elapsed = began.elapsed();
    let clean = |source: &Source| Some(drive(source.clean.as_ref()?, source, watch));
    let errors = |(source, run): (&Source, &Run)| Some(NeedErrors::between(run, &clean(source)?));
    let errors = sources.iter().zip(&runs).map(errors).collect();
    Played { runs, errors, elapsed, sources }
}

fn drive(eras: &[Era], source: &Source, watch: &Watch) -> Run {
    let step = |run: &mut Run, given: Given<'_>| -> Result<(), Infallible> {
        run.give(given);
        let is_observation = matches!(given, Given::Input(Input::Observation(_)));
        if is_observation && run.observations.is_multiple_of(STEP) {
            watch.advance(STEP);
        }
        Ok(())
    };
    match Run::of(eras, source.span, Options::default(), step) {
        Ok(run) => run,
        Err(never) => match never {},
    }
}
