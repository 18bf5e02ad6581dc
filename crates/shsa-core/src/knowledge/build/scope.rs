//! The names that formulas may use: the model's variables, constants and functions.

use super::problems::MAX_COMPARISONS;
use super::variables::Variables;
use crate::expression::{self, Constant, Function, Kind, Scope, Symbol};
use crate::knowledge::{Id, Shape, VariableId};
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::string::String;
use alloc::vec::Vec;
use core::cell::{Cell, RefCell};

/// The largest effort to solve all equations, in directions times squared variables: some seconds.
const MAX_WORK: usize = 20_000_000;

/// All names; records which variables and constants formulas use.
pub(super) struct Names<'a> {
    pub(super) variables: &'a Variables,
    functions: &'a BTreeMap<String, Function>,
    used: RefCell<BTreeSet<VariableId>>,
    mentioned: RefCell<BTreeSet<VariableId>>,
    comparisons: Cell<usize>,
    work: Cell<usize>,
}

impl<'a> Names<'a> {
    pub(super) fn new(variables: &'a Variables, functions: &'a BTreeMap<String, Function>) -> Names<'a> {
        Names {
            variables,
            functions,
            used: RefCell::default(),
            mentioned: RefCell::default(),
            comparisons: Cell::new(0),
            work: Cell::new(0),
        }
    }

    /// The variables and constants used since the last call, ascending, also through functions.
    pub(super) fn take_used(&self) -> BTreeSet<VariableId> {
        let used = self.used.take();
        self.mentioned.borrow_mut().extend(&used);
        used
    }

    /// Whether a symbol stands for a constant.
    pub(super) fn is_constant(&self, symbol: Symbol) -> bool {
        self.variables.list.find(variable(symbol)).is_some_and(|it| it.constant.is_some())
    }

    /// Counts the effort of solving an equation of this many variables; returns whether the total is within the limit.
    pub(super) fn may_solve(&self, directions: usize, variables: usize) -> bool {
        let work = directions.saturating_mul(variables).saturating_mul(variables);
        self.work.set(self.work.get().saturating_add(work));
        self.work.get() <= MAX_WORK
    }

    /// The variables and constants that any formula has used.
    pub(super) fn mentioned(&self) -> BTreeSet<VariableId> {
        self.take_used();
        self.mentioned.borrow().clone()
    }
}

impl Scope for Names<'_> {
    fn symbol(&self, name: &str) -> Option<Symbol> {
        self.variables.find(name).map(VariableId::symbol)
    }

    fn kind(&self, symbol: Symbol) -> Kind {
        let id = variable(symbol);
        self.used.borrow_mut().insert(id);
        let Some(declared) = self.variables.list.find(id) else {
            return Kind { shape: expression::Shape::Scalar, unit: None, range: None, constant: None };
        };
        let shape = match declared.shape {
            Shape::Scalar => expression::Shape::Scalar,
            Shape::Vector => expression::Shape::Vector,
        };
        let value = declared.constant.filter(|bounds| bounds.is_bounded());
        let constant = value.map(|bounds| Constant { value: bounds.midpoint(), bounds });
        Kind { shape, unit: declared.unit.clone(), range: declared.range, constant }
    }

    fn function(&self, name: &str) -> Option<&Function> {
        self.functions.get(name)
    }

    fn names(&self) -> Vec<&str> {
        let comparisons = self.comparisons.get().saturating_add(self.variables.list.len());
        self.comparisons.set(comparisons);
        if comparisons > MAX_COMPARISONS { Vec::new() } else { self.variables.names() }
    }

    fn function_names(&self) -> Vec<&str> {
        self.functions.keys().map(String::as_str).collect()
    }
}

/// The variable that a symbol stands for.
pub(super) fn variable(symbol: Symbol) -> VariableId {
    VariableId::from_index(symbol.0 as usize)
}
