//! Formulas (being written).

/// Dense index of a variable of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Symbol(pub u32);

/// A checked formula over symbols, in coherent SI units.
#[derive(Clone, Debug)]
pub struct Formula;
