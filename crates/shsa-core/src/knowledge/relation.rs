//! A relation: how variables determine each other.

use super::ids::VariableId;
use super::properties::Properties;
use crate::expression::Formula;
use alloc::string::String;
use alloc::vec::Vec;

/// How variables determine each other.
#[derive(Clone, Debug)]
pub struct Relation {
    /// Unique in the model.
    pub name: String,
    /// The variables that may be read, ascending. An output is computed from all of them except itself.
    pub inputs: Vec<VariableId>,
    /// The variables that may be produced, ascending.
    pub outputs: Vec<VariableId>,
    /// The formula of each output, in the order of `outputs`; empty for a relation that is structure only.
    pub formulas: Vec<Formula>,
    /// The condition that must certainly hold for the result to count.
    pub condition: Option<Formula>,
    /// The equation as written in the model; empty for structure only.
    pub text: String,
    /// Named numbers for the utility.
    pub properties: Properties,
}

impl Relation {
    /// The variables that `output` is computed from, ascending.
    pub fn needs(&self, output: VariableId) -> impl Iterator<Item = VariableId> + '_ {
        self.inputs.iter().copied().filter(move |&input| input != output)
    }

    /// The formula that produces `output`; `None` when it is not an output or the relation is structure only.
    #[must_use]
    pub fn formula(&self, output: VariableId) -> Option<&Formula> {
        self.outputs.iter().position(|&o| o == output).and_then(|at| self.formulas.get(at))
    }
}
