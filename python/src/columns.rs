//! Observations and outputs of an engine in columns: one call for thousands of them, each column the bytes of an array in the order
//! of the machine's memory.

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use shsa_core::engine::{Engine, Input, Output, Publication, PublishedValue, Quality, Ticks};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Id, SignalId};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;
use shsa_format::event;

/// Observations: of each the place of its signal in a list (`u16`), when it was true and when it was received (ns, `i64`, the latter
/// ascending), and its number (`f64`).
pub(crate) struct Observations<'a> {
    pub(crate) signals: &'a [u8],
    pub(crate) stamps: &'a [u8],
    pub(crate) received: &'a [u8],
    pub(crate) values: &'a [u8],
}

impl Observations<'_> {
    /// Why the columns do not belong together, if so.
    pub(crate) fn problem(&self, signals: usize) -> Option<String> {
        let rows = self.signals.len() / 2;
        let is_long = |column: &[u8]| column.len() == 8 * rows;
        if !(is_long(self.stamps) && is_long(self.received) && is_long(self.values)) {
            return Some("the columns have different lengths".to_owned());
        }
        let worst = places(self.signals).max()?;
        (worst >= signals).then(|| format!("signal {worst} of {signals} is none"))
    }

    /// Gives them to an engine, with the ticks between them.
    pub(crate) fn give(&self, engine: &mut Engine, known: &[SignalId]) {
        let times = times(self.stamps).zip(times(self.received));
        let rows = places(self.signals).zip(times).zip(numbers(self.values));
        for ((place, (stamp, received)), value) in rows {
            let Some(signal) = known.get(place).copied() else { continue };
            engine.pass(Ticks::before(received));
            let value = RawValue::Number(value);
            engine.handle(Input::Observation(Observation { signal, stamp, received, value }));
        }
    }
}

fn places(column: &[u8]) -> impl Iterator<Item = usize> {
    column.as_chunks().0.iter().map(|bytes| u16::from_ne_bytes(*bytes).into())
}

fn times(column: &[u8]) -> impl Iterator<Item = Time> {
    column.as_chunks().0.iter().map(|bytes| Time(i64::from_ne_bytes(*bytes)))
}

fn numbers(column: &[u8]) -> impl Iterator<Item = f64> {
    column.as_chunks().0.iter().map(|bytes| f64::from_ne_bytes(*bytes))
}

/// Outputs: of each value the place of its need (`u16`), the moment at which it was computed and the middle of the time in which it was
/// true (ns, `i64`), its element (`i32`, -1 of a number), its bounds (`f64`, the unit of the variable), and the place of its
/// quality (`u8`); and the decisions as JSON.
#[derive(Default)]
pub(crate) struct Outputs {
    needs: Vec<u8>,
    times: Vec<u8>,
    truths: Vec<u8>,
    elements: Vec<u8>,
    lo: Vec<u8>,
    hi: Vec<u8>,
    qualities: Vec<u8>,
    events: Vec<String>,
}

/// The columns of [`Outputs`], in their order.
pub(crate) type Columns<'py> = ([Bound<'py, PyBytes>; 7], Vec<String>);

impl Outputs {
    /// Takes all outputs of an engine.
    pub(crate) fn of(engine: &mut Engine) -> Outputs {
        let mut outputs = Outputs::default();
        while let Some(output) = engine.poll() {
            match output {
                Output::Publication(it) => outputs.publish(engine, &it),
                // A single wrong reading is no decision.
                Output::Event(it) if !it.kind.is_decision() => {}
                Output::Event(it) => {
                    let mut fields = event::fields(engine.knowledge(), &it);
                    fields.insert("time_ns".to_owned(), it.time.0.into());
                    outputs.events.push(serde_json::Value::Object(fields).to_string());
                }
                // Nobody computes for it, and it has one model for life.
                Output::Task { .. } | Output::Reloaded(_) => {}
            }
        }
        outputs
    }

    fn publish(&mut self, engine: &Engine, it: &Publication) {
        match &it.value {
            PublishedValue::Scalar(value) => self.row(engine, it, -1, value),
            PublishedValue::Vector(elements) => {
                (0..).zip(elements).for_each(|(at, value)| self.row(engine, it, at, value));
            }
        }
    }

    fn row(&mut self, engine: &Engine, it: &Publication, element: i32, value: &Interval) {
        let known = engine.knowledge();
        let unit = known.variables()[known.needs()[it.need].variable].unit.as_ref();
        let shown = |bound: f64| unit.map_or(bound, |unit| unit.from_si(bound)).to_ne_bytes();
        let need = u16::try_from(it.need.index()).unwrap_or(u16::MAX);
        let quality = Quality::ALL.iter().position(|quality| *quality == it.quality);
        self.needs.extend(need.to_ne_bytes());
        self.times.extend(it.time.0.to_ne_bytes());
        self.truths.extend(it.validity.centre().0.to_ne_bytes());
        self.elements.extend(element.to_ne_bytes());
        self.lo.extend(shown(value.lo()));
        self.hi.extend(shown(value.hi()));
        self.qualities.push(quality.and_then(|place| place.try_into().ok()).unwrap_or(u8::MAX));
    }

    pub(crate) fn columns(self, py: Python<'_>) -> Columns<'_> {
        let columns = [self.needs, self.times, self.truths, self.elements, self.lo, self.hi, self.qualities];
        (columns.map(|column| PyBytes::new(py, &column)), self.events)
    }
}
