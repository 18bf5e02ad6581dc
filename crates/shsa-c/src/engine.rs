//! An engine with what its last output points to.

use crate::error::{Error, Status};
use crate::model::Model;
use crate::output::{Output, Room};
use crate::words::c_text;
use shsa_core::engine::{self, Input, Options, Ticks};
use shsa_core::knowledge::SignalId;
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;
use shsa_estimate::node;
use shsa_format::{event, state};
use std::ffi::CString;

/// What is thought of a signal.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// There is no evidence.
    Unknown = 0,
    /// Others agree with it.
    Healthy = 1,
    /// It may be faulty.
    Suspect = 2,
    /// It is faulty, or its values are none.
    Failed = 3,
    /// It sends nothing.
    Silent = 4,
}

/// An engine: observations in, published values and decisions out. It may move between threads; only one may use it at a time.
pub struct Engine {
    engine: engine::Engine,
    /// The signals by their numbers.
    signals: Vec<SignalId>,
    room: Room,
    /// Whether a call has panicked: nothing is known of the state after it.
    pub(crate) is_broken: bool,
}

impl Engine {
    /// Sets everything up; what is allocated for observations is allocated here.
    pub(crate) fn new(model: &Model) -> Engine {
        let signals = model.knowledge().signals().ids().collect();
        let engine = node::engine(model.knowledge().clone(), Options::default());
        Engine { engine, signals, room: Room::default(), is_broken: false }
    }

    /// Takes an observation, after the ticks that are due before it.
    pub(crate) fn observe(
        &mut self,
        signal: u32,
        stamp_ns: i64,
        received_ns: i64,
        value: RawValue,
    ) -> Status {
        let Some(signal) = self.signal(signal) else { return Status::Argument };
        let (stamp, received) = (Time(stamp_ns), Time(received_ns));
        self.engine.pass(Ticks::before(received));
        self.engine.handle(Input::Observation(Observation { signal, stamp, received, value }));
        Status::Ok
    }

    /// Lets time pass: all observations until now have been taken.
    pub(crate) fn advance(&mut self, now_ns: i64) {
        self.engine.pass(Ticks::up_to(Time(now_ns)));
    }

    /// The next output, whose pointers are valid until the next one is asked for.
    pub(crate) fn poll(&mut self) -> Option<Output> {
        loop {
            let output = self.engine.poll()?;
            let known = self.engine.knowledge();
            match output {
                engine::Output::Publication(it) => return Some(self.room.publication(known, &it)),
                engine::Output::Event(it) => return Some(self.room.event(known, &it)),
                // Nobody computes for it, and it has one model for life.
                engine::Output::Task { .. } | engine::Output::Reloaded(_) => {}
            }
        }
    }

    /// When it must be given the time at the latest, in ns; `None` before the first observation.
    pub(crate) fn next_deadline(&self) -> Option<i64> {
        self.engine.next_deadline().map(|due| due.0)
    }

    /// What is thought of a signal; of an unknown one, nothing.
    pub(crate) fn verdict(&self, signal: u32) -> Verdict {
        let Some(signal) = self.signal(signal) else { return Verdict::Unknown };
        match event::verdict(self.engine.absence(signal), self.engine.verdict(signal)) {
            "healthy" => Verdict::Healthy,
            "suspect" => Verdict::Suspect,
            "failed" => Verdict::Failed,
            "silent" => Verdict::Silent,
            _ => Verdict::Unknown,
        }
    }

    /// The state that outlasts the process, as JSON.
    pub(crate) fn snapshot(&self) -> CString {
        c_text(&state::write_state(&self.engine.snapshot()))
    }

    /// Takes over a state.
    ///
    /// # Errors
    /// A text that is no state; then nothing has changed.
    pub(crate) fn restore(&mut self, text: &str, now_ns: i64) -> Result<(), Box<Error>> {
        let snapshot = state::read_state(text).map_err(|error| Box::new(Error::of_state(&error)))?;
        self.engine.pass(Ticks::before(Time(now_ns)));
        self.engine.handle(Input::Restore { time: Time(now_ns), snapshot: Box::new(snapshot) });
        Ok(())
    }

    fn signal(&self, signal: u32) -> Option<SignalId> {
        self.signals.get(signal as usize).copied()
    }
}
