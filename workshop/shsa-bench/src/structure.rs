//! Variables and signals of models of structure only: they have names, and no other facts.

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
