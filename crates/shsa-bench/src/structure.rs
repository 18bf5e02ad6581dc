//! Variables and signals of models that are structure only: nothing is known of them but their names.

use shsa_core::knowledge::{Properties, Shape, Signal, Variable, VariableId};
use shsa_core::time::Span;

/// A number without a unit.
pub(crate) fn variable(name: String, properties: Properties) -> Variable {
    Variable {
        name,
        unit: None,
        shape: Shape::Scalar,
        range: None,
        max_rate: None,
        wraps: None,
        constant: None,
        properties,
    }
}

/// What provides a variable.
pub(crate) fn signal(name: String, variable: VariableId) -> Signal {
    Signal {
        name,
        variable,
        source: String::new(),
        unit: None,
        scaling: None,
        rate_hz: None,
        value_error: Default::default(),
        time_error: (Span::ZERO, Span::ZERO),
        delay: Span::ZERO,
        mean_over: Span::ZERO,
        noise: None,
        timeout: None,
        limits: Default::default(),
        derived_from: Vec::new(),
        properties: Properties::default(),
    }
}
