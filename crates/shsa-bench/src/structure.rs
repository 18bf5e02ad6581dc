//! Variables and signals of models that are structure only: nothing is known of them but their names.

use shsa_core::knowledge::{Properties, Shape, Variable};

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
