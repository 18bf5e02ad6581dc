//! Exceptions: the classes are in `package/shsa/_errors.py`.

use pyo3::prelude::*;
use shsa_core::unit::nearest;
use shsa_model::Report;
use std::fmt::Display;

/// An exception of the package.
pub(crate) fn failed(py: Python<'_>, why: impl Display) -> PyErr {
    raised(py, "ShsaError", (why.to_string(),))
}

/// The exception of a model with errors, with every problem and its place.
pub(crate) fn refused(py: Python<'_>, report: &Report) -> PyErr {
    let problems = serde_json::to_string(&report.diagnostics).unwrap_or_default();
    raised(py, "ModelError", (report.without_notes().render(false), problems))
}

/// The exception of a name that the model lacks.
pub(crate) fn unknown<'a>(
    py: Python<'_>,
    what: &str,
    name: &str,
    known: impl Iterator<Item = &'a str>,
) -> PyErr {
    let help = nearest(name, known).map_or(String::new(), |near| format!("; did you mean '{near}'?"));
    failed(py, format!("the model has no {what} '{name}'{help}"))
}

fn raised<'py>(py: Python<'py>, class: &str, arguments: impl pyo3::call::PyCallArgs<'py>) -> PyErr {
    let exception = py.import("shsa._errors").and_then(|errors| errors.getattr(class)?.call1(arguments));
    exception.map_or_else(|error| error, PyErr::from_value)
}
