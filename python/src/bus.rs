//! The functions of the caller that take what a run publishes.

use pyo3::prelude::*;
use shsa_bridge::{Outgoing, Payload};
use shsa_core::observation::RawValue;

/// The functions of the caller that take publications.
#[derive(FromPyObject)]
pub(crate) struct Functions {
    /// Takes values: topic, value, quality, source, stamp in ns.
    publish: Option<Py<PyAny>>,
    /// Takes the status of a need as JSON, in which the need is named.
    status: Option<Py<PyAny>>,
}

impl Functions {
    /// Passes a publication to the function that takes it; what that raises is shown by Python.
    pub(crate) fn take(&self, message: &Outgoing<'_>) {
        let function = match &message.payload {
            Payload::Value(_) => &self.publish,
            Payload::Bytes(_) if is_status(message.topic) => &self.status,
            Payload::Bytes(_) => return,
        };
        let Some(function) = function else { return };
        Python::attach(|py| {
            if let Err(error) = called(py, function, message) {
                error.write_unraisable(py, Some(function.bind(py)));
            }
        });
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
