//! Temporal specifications: conditions over time that must hold.
//!
//! The verdict of a specification is a variable: 1 where the specification holds, 0 where it is violated, both where the
//! observations leave it open. It is known in two ways: a relation computes it, and another one requires 1. So the comparison of
//! both is evidence about the signals that the specification reads, like any other.

use super::ids::{RelationId, VariableId};

/// A temporal specification.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Specification {
    /// The variable of its verdict, which has its name.
    pub variable: VariableId,
    /// The relation that computes the verdict.
    pub verdict: RelationId,
    /// The relation that requires the verdict 1.
    pub required: RelationId,
}
