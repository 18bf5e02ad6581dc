//! The handle of a run: stops it, asks for its state, gives it orders, and subscribes to its decisions.

use crate::control::{Desk, Order, Reply, Request};
use crate::error::RuntimeError;
use serde_json::Value;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tokio::sync::broadcast;
use tokio::sync::broadcast::error::{RecvError, TryRecvError};

/// Controls a run from other threads; clones control the same run.
///
/// Questions and orders wait for the run, so the run must be under way in another thread.
///
/// ```
/// use shsa_bridge::{Clock, memory::MemoryBus};
/// use shsa_model::live::{Live, Written};
/// use shsa_runtime::{Model, Options, Order, Runtime, RuntimeError};
///
/// let text = "
/// shsa: 1
/// variables: { speed: { unit: m/s } }
/// signals: { wheel: { variable: speed } }
/// needs: { speed: { signal: healed/speed, max_age: 1 min } }
/// ";
/// let (live, _) = Live::load(Written { name: "car", text }).unwrap();
/// let model = Model { name: "car".to_owned(), path: None, live };
/// let bus = MemoryBus::new(Clock::running());
/// let runtime = Runtime::new(vec![model], Options::default(), Box::new(bus.join(16)))?;
/// let handle = runtime.handle();
/// let run = std::thread::spawn(move || runtime.run());
///
/// handle.order(Order::read(r#"{"order": "forbid", "signal": "wheel"}"#).unwrap())?;
/// assert_eq!(handle.state()?["models"]["car"]["signals"]["wheel"]["accepted"], 0);
/// handle.stop();
/// run.join().unwrap()?;
/// # Ok::<(), RuntimeError>(())
/// ```
#[derive(Clone)]
pub struct Handle {
    pub(super) desk: Desk,
    pub(super) stop: Arc<AtomicBool>,
    pub(super) listeners: broadcast::WeakSender<String>,
}

impl Handle {
    /// Ends the run soon.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Release);
        self.desk.wake();
    }

    /// The state of needs, signals (with verdicts and counts) and the run, as `GET /state` of the control interface.
    ///
    /// # Errors
    /// [`RuntimeError::NoAnswer`].
    pub fn state(&self) -> Result<Value, RuntimeError> {
        self.ask(Request::State)
    }

    /// Whether every need is served, and each need's quality.
    ///
    /// # Errors
    /// [`RuntimeError::NoAnswer`].
    pub fn health(&self) -> Result<Value, RuntimeError> {
        self.ask(Request::Health)
    }

    /// Gives an operator's order; returns its effect.
    ///
    /// # Errors
    /// [`RuntimeError::Refused`] with the reason; [`RuntimeError::NoAnswer`].
    pub fn order(&self, order: Order) -> Result<Value, RuntimeError> {
        self.ask(Request::Order { order, caller: "the program".to_owned() })
    }

    /// A subscription to every decision from now on.
    #[must_use]
    pub fn subscribe(&self) -> Events {
        Events(self.listeners.upgrade().map(|listeners| listeners.subscribe()))
    }

    fn ask(&self, request: Request) -> Result<Value, RuntimeError> {
        match self.desk.ask(request) {
            Some(Reply::Json(value)) => Ok(value),
            Some(Reply::Text(text)) => Ok(Value::String(text)),
            Some(Reply::Refused(why)) => Err(RuntimeError::Refused(why)),
            None => Err(RuntimeError::NoAnswer),
        }
    }
}

/// Decisions of a run as JSON objects, as published on the bus. The iterator waits for the next decision and ends with the run. A
/// subscriber that falls far behind misses the oldest ones; the field `number` counts them all.
pub struct Events(Option<broadcast::Receiver<String>>);

impl Events {
    /// The next decision that has already arrived.
    pub fn poll(&mut self) -> Option<Value> {
        let events = self.0.as_mut()?;
        loop {
            match events.try_recv() {
                Ok(event) => return serde_json::from_str(&event).ok(),
                Err(TryRecvError::Lagged(_)) => {}
                Err(TryRecvError::Empty | TryRecvError::Closed) => return None,
            }
        }
    }
}

impl Iterator for Events {
    type Item = Value;

    fn next(&mut self) -> Option<Value> {
        let events = self.0.as_mut()?;
        loop {
            match events.blocking_recv() {
                Ok(event) => return serde_json::from_str(&event).ok(),
                Err(RecvError::Lagged(_)) => {}
                Err(RecvError::Closed) => return None,
            }
        }
    }
}
