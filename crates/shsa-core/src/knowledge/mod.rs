//! The knowledge base: variables, relations, signals and needs, built only through checks.
//!
//! Everything is found by dense ids in file order. Cycles and relations that are usable in several directions
//! are ordinary. What can change at run time is the availability of signals; every change bumps the version.

mod ids;
mod rows;
mod index;
mod properties;
mod id_set;
mod variable;
mod signal;
mod draft;
mod fusion;
mod need;
mod contract;
mod decomposition;
mod utility;
mod sources;
mod build;
mod lineage;
mod change;
mod parts;
mod places;

pub(crate) use ids::id;
pub(crate) use rows::Rows;

pub use build::{build, build_from};
pub use change::{Edit, Model, Section};
pub use contract::{
    Asked, CONSUMER, Condition, Contract, ContractId, Contracts, EvidenceSource, Given, HEALER,
    INTEGRITY_SCALE, Measure, PLATFORM, Party, Policy, Subject, Watched,
};
pub use decomposition::{Claim, Common, Objection, Redundancy, dependence, in_common, level_of_pair};
pub use draft::{
    BodyDraft, Bounds, ContractDraft, DemandDraft, Diagnostic, Draft, FusionDraft, FusionInputDraft,
    FusionOutputDraft, FusionStateDraft, GuaranteeDraft, NeedDraft, Place, PropertyDrafts, RelationDraft,
    Severity, SignalDraft, Source, Text, UtilityDraft, VariableDraft,
};
pub use fusion::{
    Fusion, FusionInput, FusionMethod, FusionOutput, FusionPlaces, FusionPrediction, FusionSettings,
    FusionState,
};
pub use id_set::{IdSet, RelationSet, SignalSet};
pub use ids::{CauseId, Id, IdVec, NeedId, RelationId, SignalId, VariableId};
pub use lineage::Lineage;
pub use need::{INTEGRITY_LEVELS, ISOLATIONS, Need, Switching, WhenUnsure, integrity_level};
pub use parts::{Contradiction, join, part};
pub use properties::{ACCURACY, COST, INTEGRITY, NEGLIGIBLE, PRIOR, PROPERTIES, Properties};
pub use signal::{CAUSE_PRIOR, Cause, ReadingLimits, Scaling, Signal, SourceParts, ValueError};
pub use utility::{Aggregate, Element, Fact, Figure, Inputs, OwnUtility, Rating, Utility, UtilityProblem};
pub use variable::{Shape, Variable};

use crate::expression::Formula;
use alloc::collections::BTreeSet;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// How variables determine each other.
#[derive(Clone, Debug)]
pub struct Relation {
    /// Unique in the model.
    pub name: String,
    /// Every variable that may be read, ascending. For one output, all of them but that output are needed.
    pub inputs: Vec<VariableId>,
    /// Every variable that may be produced, ascending.
    pub outputs: Vec<VariableId>,
    /// The formula of each output, in the order of `outputs`; empty for a relation that is structure only.
    pub formulas: Vec<Formula>,
    /// What must certainly hold for the result to count.
    pub condition: Option<Formula>,
    /// The equation as written in the model; empty for structure only.
    pub text: String,
    /// Named numbers for the utility.
    pub properties: Properties,
}

impl Relation {
    /// What must be known to produce `output`, ascending.
    pub fn needs(&self, output: VariableId) -> impl Iterator<Item = VariableId> + '_ {
        self.inputs.iter().copied().filter(move |&input| input != output)
    }

    /// The formula that produces `output`; `None` when it is not an output or the relation is structure only.
    #[must_use]
    pub fn formula(&self, output: VariableId) -> Option<&Formula> {
        self.outputs.iter().position(|&o| o == output).and_then(|at| self.formulas.get(at))
    }
}

/// Variables, relations, signals and needs of one system.
#[derive(Clone, Debug, Default)]
pub struct KnowledgeBase {
    variables: IdVec<VariableId, Variable>,
    relations: IdVec<RelationId, Relation>,
    signals: IdVec<SignalId, Signal>,
    needs: IdVec<NeedId, Need>,
    causes: IdVec<CauseId, Cause>,
    fusions: Vec<Fusion>,
    /// Their outputs, and all signals that they compute.
    fused: SignalSet,
    computed: SignalSet,
    utility: Utility,
    contracts: Contracts,
    available: IdVec<SignalId, bool>,
    /// Relations that can produce each variable, ascending.
    producers: Rows<VariableId, RelationId>,
    /// Signals that carry each variable, ascending.
    carriers: Rows<VariableId, SignalId>,
    /// Signals that are one measurement.
    witnesses: sources::Witnesses,
    version: u64,
}

impl KnowledgeBase {
    /// All variables.
    #[must_use]
    pub fn variables(&self) -> &IdVec<VariableId, Variable> {
        &self.variables
    }

    /// All relations.
    #[must_use]
    pub fn relations(&self) -> &IdVec<RelationId, Relation> {
        &self.relations
    }

    /// All signals.
    #[must_use]
    pub fn signals(&self) -> &IdVec<SignalId, Signal> {
        &self.signals
    }

    /// What a need is called where needs go by their variables: its variable, or, where that has several needs, the name under
    /// which it is published. O(needs).
    #[must_use]
    pub fn need_name(&self, need: NeedId) -> &str {
        let Some(named) = self.needs.find(need) else { return "" };
        let of_variable = self.needs.iter().filter(|other| other.variable == named.variable);
        match of_variable.count() {
            1 => &self.variables[named.variable].name,
            _ => &named.signal,
        }
    }

    /// The needs that a name means: the one that is published under it, else all of the variable of this name. O(needs).
    #[must_use]
    pub fn needs_named(&self, name: &str) -> Vec<NeedId> {
        let published = self.needs.enumerate().find(|(_, need)| need.signal == name).map(|(id, _)| id);
        let variable = self.variable(name);
        let of_it = || self.needs.enumerate().filter(|(_, need)| Some(need.variable) == variable);
        published.map_or_else(|| of_it().map(|(id, _)| id).collect(), |id| Vec::from([id]))
    }

    /// All needs.
    #[must_use]
    pub fn needs(&self) -> &IdVec<NeedId, Need> {
        &self.needs
    }

    /// All common causes.
    #[must_use]
    pub fn causes(&self) -> &IdVec<CauseId, Cause> {
        &self.causes
    }

    /// The same with these common causes; they must name only its signals, ascending.
    #[must_use]
    pub fn with_causes(self, causes: IdVec<CauseId, Cause>) -> KnowledgeBase {
        KnowledgeBase { causes, ..self }
    }

    /// How substitutions are rated.
    #[must_use]
    pub fn utility(&self) -> &Utility {
        &self.utility
    }

    /// The same with substitutions rated by `utility`.
    #[must_use]
    pub fn with_utility(self, utility: Utility) -> KnowledgeBase {
        KnowledgeBase { utility, ..self }
    }

    /// What those who take part guarantee and demand.
    #[must_use]
    pub fn contracts(&self) -> &Contracts {
        &self.contracts
    }

    /// The same with these contracts; they must name only its elements.
    #[must_use]
    pub fn with_contracts(self, contracts: Contracts) -> KnowledgeBase {
        KnowledgeBase { contracts, ..self }
    }

    /// Grows by one with every change.
    #[must_use]
    pub fn version(&self) -> u64 {
        self.version
    }

    /// The same as the one that takes the place of another of this version.
    #[must_use]
    pub fn succeeding(self, version: u64) -> KnowledgeBase {
        KnowledgeBase { version: self.version.max(version.saturating_add(1)), ..self }
    }

    /// The relations that can produce `variable`, ascending.
    #[must_use]
    pub fn producers(&self, variable: VariableId) -> &[RelationId] {
        self.producers.row(variable)
    }

    /// The signals that carry `variable`, ascending, available or not.
    #[must_use]
    pub fn carriers(&self, variable: VariableId) -> &[SignalId] {
        self.carriers.row(variable)
    }

    /// Whether a signal may be used now.
    #[must_use]
    pub fn is_available(&self, signal: SignalId) -> bool {
        self.available[signal]
    }

    /// Allows or forbids the use of a signal; the version changes when this does.
    pub fn set_available(&mut self, signal: SignalId, available: bool) {
        if self.available[signal] != available {
            self.available[signal] = available;
            self.version += 1;
        }
    }

    /// Sets a property of an element, or takes it away; the version changes when this does.
    ///
    /// Complexity: logarithmic in the element's properties; O(model) with formulas of the model's own as utility, which may
    /// read the property anywhere.
    ///
    /// # Errors
    /// What is wrong with the number, in words; nothing has changed then.
    pub fn set_property(&mut self, element: Element, name: &str, value: Option<f64>) -> Result<(), String> {
        if let Some(sense) = value.and_then(|value| build::senseless(name, value)) {
            return Err(String::from(sense));
        }
        let before = self.put_property(element, name, value);
        if let Some(problem) = self.utility.check_after(self, element) {
            self.put_property(element, name, before);
            return Err(format!("{}: {}", problem.message, problem.help));
        }
        if before != value {
            self.version += 1;
        }
        Ok(())
    }

    /// Gives the number that it had.
    fn put_property(&mut self, element: Element, name: &str, value: Option<f64>) -> Option<f64> {
        let properties = match element {
            Element::Variable(id) => &mut self.variables[id].properties,
            Element::Relation(id) => &mut self.relations[id].properties,
            Element::Signal(id) => &mut self.signals[id].properties,
        };
        match value {
            Some(value) => properties.insert(String::from(name), value),
            None => properties.remove(name),
        }
    }

    /// The same with the signals as available as those of the same name in another knowledge base.
    #[must_use]
    pub fn available_as(mut self, other: &KnowledgeBase) -> KnowledgeBase {
        let withdrawn: BTreeSet<&str> = other
            .signals
            .enumerate()
            .filter(|(id, _)| !other.available[*id])
            .map(|(_, signal)| signal.name.as_str())
            .collect();
        let available = |id: SignalId| !withdrawn.contains(self.signals[id].name.as_str());
        self.available = IdVec::filled(self.signals.len(), available);
        self
    }

    /// Whether a variable is known without a relation: a constant, or carried by an available signal.
    #[must_use]
    pub fn is_provided(&self, variable: VariableId) -> bool {
        self.variables[variable].constant.is_some()
            || self.carriers(variable).iter().any(|&signal| self.available[signal])
    }

    /// A signal with all that it is derived from, transitively.
    #[must_use]
    pub fn origins(&self, signal: SignalId) -> SignalSet {
        let mut all = SignalSet::new();
        let mut open = Vec::from([signal]);
        while let Some(signal) = open.pop() {
            if !all.contains(signal) {
                all.insert(signal);
                open.extend(self.signals[signal].derived_from.iter().copied());
            }
        }
        all
    }

    /// The signal that stands for all that come from the same field of the same source: one measurement, one witness.
    #[must_use]
    pub fn witness(&self, signal: SignalId) -> SignalId {
        self.witnesses.of(signal)
    }

    /// Signals with those in place of them that stand for the same measurement.
    #[must_use]
    pub fn as_witnesses(&self, signals: SignalSet) -> SignalSet {
        match self.witnesses.is_empty() {
            true => signals,
            false => signals.iter().map(|signal| self.witness(signal)).collect(),
        }
    }

    /// Signals with all others that are the same measurements.
    #[must_use]
    pub fn with_same(&self, mut signals: SignalSet) -> SignalSet {
        let of = |&(first, same): &(SignalId, SignalId)| signals.contains(first).then_some(same);
        let same: Vec<SignalId> = self.witnesses.all().iter().filter_map(of).collect();
        same.into_iter().for_each(|signal| _ = signals.insert(signal));
        signals
    }

    /// The variable of a name.
    #[must_use]
    pub fn variable(&self, name: &str) -> Option<VariableId> {
        self.variables.enumerate().find(|(_, variable)| variable.name == name).map(|(id, _)| id)
    }

    /// The signal of a name.
    #[must_use]
    pub fn signal(&self, name: &str) -> Option<SignalId> {
        self.signals.enumerate().find(|(_, signal)| signal.name == name).map(|(id, _)| id)
    }

    /// Puts checked parts together; the one constructor, used by the checks and by structure generators.
    ///
    /// Relations and signals must name only ids of `variables`; inputs and outputs are sorted here. Signals from the
    /// same field of the same source, or from an element of it, become derived from each other.
    #[must_use]
    pub fn from_parts(
        variables: IdVec<VariableId, Variable>,
        mut relations: IdVec<RelationId, Relation>,
        mut signals: IdVec<SignalId, Signal>,
        needs: IdVec<NeedId, Need>,
    ) -> KnowledgeBase {
        let (witnesses, _) = sources::derive(&mut signals);
        for relation in relations.iter_mut() {
            relation.inputs.sort_unstable();
            relation.inputs.dedup();
        }
        let outputs = relations.enumerate().map(|(id, relation)| (id, relation.outputs.as_slice()));
        let produced = outputs.flat_map(|(id, outputs)| outputs.iter().map(move |&output| (output, id)));
        let producers = Rows::grouped(variables.len(), produced);
        let carried = signals.enumerate().map(|(id, signal)| (signal.variable, id));
        let carriers = Rows::grouped(variables.len(), carried);
        let available = IdVec::filled(signals.len(), |_| true);
        KnowledgeBase {
            variables,
            relations,
            signals,
            needs,
            causes: IdVec::new(),
            fusions: Vec::new(),
            fused: SignalSet::new(),
            computed: SignalSet::new(),
            utility: Utility::default(),
            contracts: Contracts::default(),
            available,
            producers,
            carriers,
            witnesses,
            version: 0,
        }
    }
}
