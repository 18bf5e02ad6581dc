//! What stands outside of a run: stops it, asks it, gives it orders, and hears its decisions.

use crate::control::{Desk, Order, Reply, Request};
use crate::error::RuntimeError;
use serde_json::Value;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tokio::sync::broadcast;
use tokio::sync::broadcast::error::{RecvError, TryRecvError};

/// A run, seen from other threads; clones are the same.
///
/// Questions and orders wait until the run comes to them: it must be under way in another thread.
///
/// ```
/// use shsa_bridge::{Clock, memory::MemoryBus};
/// use shsa_format::model::live::{Live, Written};
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

    /// How everything stands: needs, signals with verdicts and counts, figures; as `GET /state` of the control interface.
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

    /// The last decisions from this number on.
    ///
    /// # Errors
    /// [`RuntimeError::NoAnswer`].
    pub fn events_since(&self, number: u64) -> Result<Value, RuntimeError> {
        self.ask(Request::Events(number))
    }

    /// Does what an operator orders; what was done, in words.
    ///
    /// # Errors
    /// [`RuntimeError::Refused`] says why it cannot be done; [`RuntimeError::NoAnswer`].
    pub fn order(&self, order: Order) -> Result<Value, RuntimeError> {
        self.ask(Request::Order { order, caller: "the program".to_owned() })
    }

    /// Every decision from now on.
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

/// Decisions of a run as JSON objects, each as it goes out on the bus. As an iterator it waits for the next one, and ends with the
/// run. Who falls far behind misses the oldest; the field `number` counts them all.
pub struct Events(Option<broadcast::Receiver<String>>);

impl Events {
    /// The next one that is there already.
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
