//! The names that formulas of a fusion may use: its states, then its controls, and the model's constants and functions.

use crate::expression::{Function, Kind, Scope, Shape, Symbol};
use crate::knowledge::build::scope::Names;
use crate::unit::Unit;
use alloc::string::String;
use alloc::vec::Vec;

/// Symbols from this one on are the model's constants; lower ones are states and controls.
const CONSTANTS: u32 = 1 << 24;

/// States and controls by their places.
pub(super) struct Local<'a> {
    pub(super) model: &'a Names<'a>,
    /// Names and units, states first.
    pub(super) names: Vec<(String, Option<Unit>)>,
}

impl Local<'_> {
    /// The unit of a state or control.
    pub(super) fn unit(&self, place: usize) -> Option<&Unit> {
        self.names.get(place)?.1.as_ref()
    }
}

impl Scope for Local<'_> {
    fn symbol(&self, name: &str) -> Option<Symbol> {
        let own = self.names.iter().position(|(known, _)| known == name);
        own.map(|place| Symbol(place as u32)).or_else(|| {
            let Symbol(constant) =
                self.model.symbol(name).filter(|symbol| self.model.is_constant(*symbol))?;
            Some(Symbol(constant.saturating_add(CONSTANTS)))
        })
    }

    fn kind(&self, symbol: Symbol) -> Kind {
        if let Some(constant) = symbol.0.checked_sub(CONSTANTS) {
            return self.model.kind(Symbol(constant));
        }
        let unit = self.unit(symbol.0 as usize).cloned();
        Kind { shape: Shape::Scalar, unit, range: None, constant: None }
    }

    fn function(&self, name: &str) -> Option<&Function> {
        self.model.function(name)
    }

    fn names(&self) -> Vec<&str> {
        self.names.iter().map(|(name, _)| name.as_str()).collect()
    }

    fn function_names(&self) -> Vec<&str> {
        self.model.function_names()
    }
}
