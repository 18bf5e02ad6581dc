//! A bus between functions of the caller.

use pyo3::prelude::*;
use shsa_bridge::{Bridge, BridgeError, Inbox, Link, Outage, Outgoing, Payload, PublisherId};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What brings the messages to the caller may lose its connection; clones are the same connection.
#[derive(Clone, Default)]
pub(crate) struct Connection(Arc<Mutex<Option<Outage>>>);

impl Connection {
    fn last(&self) -> MutexGuard<'_, Option<Outage>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// It is lost, for a reason; a second loss in a row has no effect.
    pub(crate) fn lose(&self, now: Time, because: String) {
        let mut last = self.last();
        let number = last.as_ref().map_or(0, |last| last.number);
        if last.as_ref().is_none_or(|last| last.found.is_some()) {
            *last = Some(Outage { number: number + 1, lost: now, found: None, because });
        }
    }

    /// It is there again.
    pub(crate) fn find(&self, now: Time) {
        if let Some(last) = self.last().as_mut() {
            last.found.get_or_insert(now);
        }
    }
}

/// The functions of the caller that take publications.
#[derive(FromPyObject)]
pub(crate) struct Functions {
    /// Takes values: topic, value, quality, source, stamp in ns.
    publish: Option<Py<PyAny>>,
    /// Takes the status of a need as JSON, in which the need is named.
    status: Option<Py<PyAny>>,
}

/// The caller pushes messages, and functions take publications.
pub(crate) struct OwnBus {
    pub(crate) inbox: Inbox,
    pub(crate) functions: Functions,
    pub(crate) connection: Connection,
}

impl Bridge for OwnBus {
    fn publisher(&self) -> PublisherId {
        PublisherId(0)
    }

    fn inbox(&self) -> &Inbox {
        &self.inbox
    }

    /// The caller decides what to push.
    fn subscribe(&mut self, _: &str, _: Option<&str>) -> Result<(), BridgeError> {
        Ok(())
    }

    fn subscribe_all(&mut self) -> Result<(), BridgeError> {
        Ok(())
    }

    fn publish(&mut self, message: Outgoing<'_>) -> Result<(), BridgeError> {
        let function = match &message.payload {
            Payload::Value(_) => &self.functions.publish,
            Payload::Bytes(_) if is_status(message.topic) => &self.functions.status,
            Payload::Bytes(_) => return Ok(()),
        };
        let Some(function) = function else { return Ok(()) };
        Python::attach(|py| {
            if let Err(error) = called(py, function, &message) {
                error.write_unraisable(py, Some(function.bind(py)));
            }
        });
        Ok(())
    }

    /// The functions get the bounds of every value.
    fn carries_bounds(&self) -> bool {
        true
    }

    fn link(&self) -> Link {
        match self.connection.last().as_ref() {
            Some(Outage { found: None, because, .. }) => Link::Down(because.clone()),
            _ => Link::Up,
        }
    }

    fn outage(&self) -> Option<Outage> {
        self.connection.last().clone()
    }
}

/// Whether a topic has the status of a need: `shsa/NAME/need/VARIABLE`.
fn is_status(topic: &str) -> bool {
    topic.starts_with("shsa/") && topic.contains("/need/")
}

/// Calls a function with what is published.
fn called(py: Python<'_>, function: &Py<PyAny>, message: &Outgoing<'_>) -> PyResult<()> {
    let value = match &message.payload {
        Payload::Bytes(text) => {
            return function.call1(py, (String::from_utf8_lossy(text),)).map(|_| ());
        }
        Payload::Value(RawValue::Number(value)) => (*value, *value).into_pyobject(py)?.into_any(),
        Payload::Value(RawValue::Interval { lo, hi }) => (*lo, *hi).into_pyobject(py)?.into_any(),
        Payload::Value(RawValue::Vector(values)) => values.clone().into_pyobject(py)?.into_any(),
    };
    let quality = message.provenance.map(|provenance| provenance.quality.name());
    let source = message.provenance.map(|provenance| provenance.source.as_str());
    function.call1(py, (message.topic, value, quality, source, message.stamp.0)).map(|_| ())
}
