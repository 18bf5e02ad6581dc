//! An engine in a loop of the caller.

use crate::columns::{Columns, Observations, Outputs};
use crate::model::Model;
use crate::problem::{failed, unknown};
use pyo3::prelude::*;
use serde_json::{Value, json};
use shsa_core::engine::{self, Input, Options, Output, Publication, PublishedValue, Ticks};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;
use shsa_format::{event, state};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A number, a pair of bounds, or a list of numbers.
#[derive(FromPyObject)]
pub(crate) enum Reading {
    Number(f64),
    Bounds((f64, f64)),
    Vector(Vec<f64>),
}

impl From<Reading> for RawValue {
    fn from(reading: Reading) -> RawValue {
        match reading {
            Reading::Number(value) => RawValue::Number(value),
            Reading::Bounds((lo, hi)) => RawValue::Interval { lo, hi },
            Reading::Vector(values) => RawValue::Vector(values),
        }
    }
}

/// An output: a publication as (need, time, from, to, bounds, quality), or a decision as JSON; the other is `None`.
type Polled = (Option<(String, i64, i64, i64, Vec<(f64, f64)>, &'static str)>, Option<String>);

/// An engine; its lock is only for Python's rule that objects may be shared.
#[pyclass(frozen)]
pub(crate) struct Engine(Mutex<engine::Engine>);

impl Engine {
    fn lock(&self) -> MutexGuard<'_, engine::Engine> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Engine {
    #[new]
    fn new(model: &Model) -> Engine {
        Engine(Mutex::new(shsa_estimate::node::engine(model.knowledge().clone(), Options::default())))
    }

    fn handle(
        &self,
        py: Python<'_>,
        signal: &str,
        value: Reading,
        received_ns: i64,
        stamp_ns: i64,
    ) -> PyResult<()> {
        let mut engine = self.lock();
        let signal = find(py, &engine, signal)?;
        let (stamp, received) = (Time(stamp_ns), Time(received_ns));
        engine.pass(Ticks::before(received));
        engine.handle(Input::Observation(Observation { signal, stamp, received, value: value.into() }));
        Ok(())
    }

    /// Takes observations in columns.
    fn handle_all(
        &self,
        py: Python<'_>,
        names: Vec<String>,
        signals: &[u8],
        stamps: &[u8],
        received: &[u8],
        values: &[u8],
    ) -> PyResult<()> {
        let observations = Observations { signals, stamps, received, values };
        if let Some(problem) = observations.problem(names.len()) {
            return Err(failed(py, problem));
        }
        let mut engine = self.lock();
        let known = names.iter().map(|name| find(py, &engine, name)).collect::<PyResult<Vec<SignalId>>>()?;
        observations.give(&mut engine, &known);
        Ok(())
    }

    /// All outputs until now, in columns.
    fn take<'py>(&self, py: Python<'py>) -> Columns<'py> {
        Outputs::of(&mut self.lock()).columns(py)
    }

    fn advance(&self, now_ns: i64) {
        self.lock().pass(Ticks::up_to(Time(now_ns)));
    }

    fn poll(&self) -> Option<Polled> {
        let mut engine = self.lock();
        loop {
            match engine.poll()? {
                Output::Publication(it) => return Some((Some(published(engine.knowledge(), &it)), None)),
                // A single wrong reading is no decision.
                Output::Event(it) if !it.kind.is_decision() => {}
                Output::Event(it) => {
                    let mut fields = event::fields(engine.knowledge(), &it);
                    fields.insert("time_ns".to_owned(), json!(it.time.0));
                    return Some((None, Some(Value::Object(fields).to_string())));
                }
                // Nobody computes for it, and it has one model for life.
                Output::Task { .. } | Output::Reloaded(_) => {}
            }
        }
    }

    fn next_deadline(&self) -> Option<i64> {
        self.lock().next_deadline().map(|due| due.0)
    }

    fn verdict(&self, py: Python<'_>, signal: &str) -> PyResult<&'static str> {
        let engine = self.lock();
        let id = find(py, &engine, signal)?;
        Ok(event::verdict(engine.absence(id), engine.verdict(id)))
    }

    fn snapshot(&self) -> String {
        state::write_state(&self.lock().snapshot())
    }

    fn restore(&self, py: Python<'_>, snapshot: &str, now_ns: i64) -> PyResult<()> {
        let snapshot = state::read_state(snapshot).map_err(|error| failed(py, error))?;
        let (mut engine, time) = (self.lock(), Time(now_ns));
        engine.pass(Ticks::before(time));
        engine.handle(Input::Restore { time, snapshot: Box::new(snapshot) });
        Ok(())
    }
}

/// The signal of a name.
///
/// # Errors
/// When the model has no such signal.
fn find(py: Python<'_>, engine: &engine::Engine, name: &str) -> PyResult<SignalId> {
    let known = engine.knowledge();
    let names = || known.signals().iter().map(|signal| signal.name.as_str());
    known.signal(name).ok_or_else(|| unknown(py, "signal", name, names()))
}

fn published(
    known: &KnowledgeBase,
    it: &Publication,
) -> (String, i64, i64, i64, Vec<(f64, f64)>, &'static str) {
    let need = &known.needs()[it.need];
    let unit = known.variables()[need.variable].unit.as_ref();
    let shown = |bound: f64| unit.map_or(bound, |unit| unit.from_si(bound));
    let bounds = |value: &Interval| (shown(value.lo()), shown(value.hi()));
    let values = match &it.value {
        PublishedValue::Scalar(value) => vec![bounds(value)],
        PublishedValue::Vector(elements) => elements.iter().map(bounds).collect(),
    };
    (need.signal.clone(), it.time.0, it.validity.from.0, it.validity.to.0, values, it.quality.name())
}
