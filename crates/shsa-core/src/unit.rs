//! Units (being written).

/// A unit of measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit;
