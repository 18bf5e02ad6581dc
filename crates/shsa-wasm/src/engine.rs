//! An engine in a loop of the caller.

use crate::{Model, Problem};
use serde_json::{Value, json};
use shsa_core::engine::{self, Input, Options, Output, Ticks};
use shsa_core::knowledge::{Id, SignalId};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;
use shsa_format::{event, state};
use shsa_report::replay::value_json;
use wasm_bindgen::prelude::wasm_bindgen;

/// An engine. Times are nanoseconds of one clock; they never go back.
#[wasm_bindgen]
pub struct Engine(engine::Engine);

impl Engine {
    fn find(&self, name: &str) -> Result<SignalId, Problem> {
        let known = self.0.knowledge();
        let names = || known.signals().iter().map(|signal| signal.name.as_str());
        known.signal(name).ok_or_else(|| Problem::unknown("signal", name, names()))
    }

    fn take(&mut self, signal: SignalId, value: RawValue, received_ns: i64, stamp_ns: i64) {
        let (stamp, received) = (Time(stamp_ns), Time(received_ns));
        self.0.pass(Ticks::before(received));
        self.0.handle(Input::Observation(Observation { signal, stamp, received, value }));
    }
}

#[wasm_bindgen]
impl Engine {
    /// An engine for a model.
    #[wasm_bindgen(constructor)]
    #[must_use]
    pub fn new(model: &Model) -> Engine {
        Engine(shsa_estimate::node::engine(model.knowledge().clone(), Options::default()))
    }

    /// The number of a signal, for [`handle`](Engine::handle).
    ///
    /// # Errors
    /// When the model has no such signal.
    pub fn signal(&self, name: &str) -> Result<u32, Problem> {
        self.find(name).map(|signal| signal.index() as u32)
    }

    /// Takes a number of a signal, in the signal's unit; not-a-number is a value that the sensor could not measure.
    ///
    /// # Errors
    /// When there is no such signal.
    pub fn handle(
        &mut self,
        signal: u32,
        value: f64,
        received_ns: i64,
        stamp_ns: i64,
    ) -> Result<(), Problem> {
        let signal = self.numbered(signal)?;
        self.take(signal, RawValue::Number(value), received_ns, stamp_ns);
        Ok(())
    }

    /// Takes a value that brings its own bounds.
    ///
    /// # Errors
    /// As [`handle`](Engine::handle).
    pub fn handle_bounds(
        &mut self,
        signal: u32,
        lo: f64,
        hi: f64,
        received_ns: i64,
        stamp_ns: i64,
    ) -> Result<(), Problem> {
        let signal = self.numbered(signal)?;
        self.take(signal, RawValue::Interval { lo, hi }, received_ns, stamp_ns);
        Ok(())
    }

    /// Takes the numbers of a vector.
    ///
    /// # Errors
    /// As [`handle`](Engine::handle).
    pub fn handle_vector(
        &mut self,
        signal: u32,
        values: Vec<f64>,
        received_ns: i64,
        stamp_ns: i64,
    ) -> Result<(), Problem> {
        let signal = self.numbered(signal)?;
        self.take(signal, RawValue::Vector(values), received_ns, stamp_ns);
        Ok(())
    }

    /// Lets time pass.
    pub fn advance(&mut self, now_ns: i64) {
        self.0.pass(Ticks::up_to(Time(now_ns)));
    }

    /// All outputs since the last call: published values and decisions, each as the command writes it. O(outputs).
    #[must_use]
    pub fn outputs(&mut self) -> String {
        let (mut values, mut events) = (Vec::new(), Vec::new());
        while let Some(output) = self.0.poll() {
            match output {
                Output::Publication(it) => values.push(value_json(self.0.knowledge(), &it)),
                // A single wrong reading is no decision.
                Output::Event(it) if !it.kind.is_decision() => {}
                Output::Event(it) => {
                    let mut fields = event::fields(self.0.knowledge(), &it);
                    fields.insert("time_ns".to_owned(), json!(it.time.0));
                    events.push(Value::Object(fields));
                }
                // Nobody computes for it, and it has one model for life.
                Output::Task { .. } | Output::Reloaded(_) => {}
            }
        }
        json!({ "values": values, "events": events }).to_string()
    }

    /// When to call [`advance`](Engine::advance) at the latest, in ns.
    #[must_use]
    pub fn next_deadline(&self) -> Option<i64> {
        self.0.next_deadline().map(|due| due.0)
    }

    /// The verdict about a signal in one word.
    ///
    /// # Errors
    /// When the model has no such signal.
    pub fn verdict(&self, signal: &str) -> Result<String, Problem> {
        let id = self.find(signal)?;
        Ok(event::verdict(self.0.absence(id), self.0.verdict(id)).to_owned())
    }

    /// What outlasts the process, as JSON.
    #[must_use]
    pub fn snapshot(&self) -> String {
        state::write_state(&self.0.snapshot())
    }

    /// Goes on from a snapshot.
    ///
    /// # Errors
    /// When the text is none.
    pub fn restore(&mut self, snapshot: &str, now_ns: i64) -> Result<(), Problem> {
        let (snapshot, time) = (state::read_state(snapshot).map_err(Problem::of)?, Time(now_ns));
        self.0.pass(Ticks::before(time));
        self.0.handle(Input::Restore { time, snapshot: Box::new(snapshot) });
        Ok(())
    }

    fn numbered(&self, signal: u32) -> Result<SignalId, Problem> {
        let is_known = (signal as usize) < self.0.knowledge().signals().len();
        is_known
            .then(|| SignalId::from_index(signal as usize))
            .ok_or_else(|| Problem::of(format!("there is no signal {signal}")))
    }
}
