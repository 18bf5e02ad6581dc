//! A live run in a thread: on a bus, or between functions of the caller.

use crate::bus::Functions;
use crate::engine::Reading;
use crate::model::Model;
use crate::problem::failed;
use pyo3::prelude::*;
use serde_json::Value;
use shsa_bridge::memory::MemoryBus;
use shsa_bridge::{
    Address, Bridge, BusOptions, Clock, Inbox, Message, Outgoing, OwnBus, OwnConnection, Payload,
};
use shsa_core::time::Time;
use shsa_runtime::{self as live, Ending, Events, Handle, Options, Order, RuntimeError};
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::thread::{self, JoinHandle};

/// How many messages of one topic may wait.
const QUEUE: usize = 1_024;

/// A run; its locks are only for Python's rule that objects may be shared.
#[pyclass(frozen)]
pub(crate) struct Runtime {
    inbox: Inbox,
    /// What brings the messages of the caller; `None`: they come from a bus.
    connection: Option<OwnConnection>,
    handle: Mutex<Handle>,
    decisions: Mutex<Events>,
    run: Mutex<Option<JoinHandle<Result<Ending, RuntimeError>>>>,
    /// Where the page of the run is, if it is served.
    #[pyo3(get)]
    address: Option<String>,
}

#[pymethods]
impl Runtime {
    #[new]
    fn new(
        py: Python<'_>,
        models: Vec<PyRef<'_, Model>>,
        functions: Functions,
        bus: Option<&str>,
        name: String,
        http: Option<&str>,
        state: Option<PathBuf>,
    ) -> PyResult<Runtime> {
        let inbox = Inbox::new(QUEUE, Clock::running());
        let (bridge, connection): (Box<dyn Bridge>, _) = match bus {
            Some(text) => (opened(text, &name, inbox.clone()).map_err(|why| failed(py, why))?, None),
            None => {
                let take = move |message: Outgoing<'_>| {
                    functions.take(&message);
                    Ok(())
                };
                let own = OwnBus::new(inbox.clone(), take);
                let connection = own.connection();
                (Box::new(own), Some(connection))
            }
        };
        let models = models.iter().map(|model| live::Model {
            name: model.stem(),
            path: None,
            live: model.live.clone(),
        });
        let options = Options { name, state, ..Options::default() };
        let runtime = live::Runtime::new(models.collect(), options, bridge);
        let runtime = runtime.map_err(|error| failed(py, error))?;
        let serve = |text: &str| {
            let address = text.parse().map_err(|_| failed(py, format!("'{text}' is no address: IP:PORT")))?;
            runtime.serve_http(address, &[]).map_err(|error| failed(py, error))
        };
        let address = http.map(serve).transpose()?.map(|address| format!("http://{address}/"));
        let handle = runtime.handle();
        let decisions = Mutex::new(handle.subscribe());
        let run = Mutex::new(Some(thread::spawn(move || runtime.run())));
        Ok(Runtime { inbox, connection, handle: Mutex::new(handle), decisions, run, address })
    }

    fn push(&self, py: Python<'_>, topic: &str, value: Reading, stamp_ns: Option<i64>) -> PyResult<()> {
        self.own(py)?;
        let payload = Payload::Value(value.into());
        let mut message = Message::new(topic.into(), self.inbox.clock().now(), payload);
        message.stamp = stamp_ns.map(Time);
        py.detach(|| self.inbox.push(message));
        Ok(())
    }

    fn lose(&self, py: Python<'_>, because: String) -> PyResult<()> {
        let connection = self.own(py)?;
        py.detach(|| connection.lose(because));
        Ok(())
    }

    fn find(&self, py: Python<'_>) -> PyResult<()> {
        self.own(py)?.find();
        Ok(())
    }

    fn state(&self, py: Python<'_>) -> PyResult<String> {
        self.ask(py, |handle| handle.state())
    }

    fn order(&self, py: Python<'_>, order: &str) -> PyResult<String> {
        let order = Order::read(order).map_err(|error| failed(py, error))?;
        self.ask(py, |handle| handle.order(order))
    }

    fn poll(&self) -> Option<String> {
        let mut decisions = self.decisions.lock().unwrap_or_else(PoisonError::into_inner);
        decisions.poll().map(|decision| decision.to_string())
    }

    fn stop(&self, py: Python<'_>) -> PyResult<Option<bool>> {
        self.handle.lock().unwrap_or_else(PoisonError::into_inner).stop();
        let run = self.run.lock().unwrap_or_else(PoisonError::into_inner).take();
        // The run may be about to call a function of Python.
        let Some(ending) = py.detach(|| run.map(JoinHandle::join)) else { return Ok(None) };
        match ending {
            Ok(Ok(ending)) => Ok(Some(ending == Ending::Served)),
            Ok(Err(error)) => Err(failed(py, error)),
            Err(_) => Err(failed(py, "the run has broken off")),
        }
    }
}

impl Runtime {
    /// What brings the messages of the caller.
    ///
    /// # Errors
    /// When they come from a bus.
    fn own(&self, py: Python<'_>) -> PyResult<&OwnConnection> {
        let refused = || failed(py, "the messages of this run come from its bus");
        self.connection.as_ref().ok_or_else(refused)
    }

    fn ask(
        &self,
        py: Python<'_>,
        ask: impl FnOnce(&Handle) -> Result<Value, RuntimeError> + Send,
    ) -> PyResult<String> {
        let handle = self.handle.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let answer = py.detach(move || ask(&handle));
        answer.map(|answer| answer.to_string()).map_err(|error| failed(py, error))
    }
}

/// Connects to a bus.
fn opened(text: &str, name: &str, inbox: Inbox) -> Result<Box<dyn Bridge>, String> {
    let address: Address = text.parse()?;
    let memory = MemoryBus::new(inbox.clock().clone());
    BusOptions::at(address).open(name, inbox, &memory).map_err(|error| error.to_string())
}
