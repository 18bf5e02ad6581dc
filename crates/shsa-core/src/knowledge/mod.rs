//! The knowledge base: variables, relations, signals and needs, built only through checks.
//!
//! Elements are found by dense ids in file order. Cycles, and relations usable in several directions, are allowed. The
//! availability of signals and the properties can change at run time; every change raises the version.

mod ids;
mod rows;
mod index;
mod properties;
mod id_set;
mod variable;
mod relation;
mod signal;
mod draft;
mod fusion;
mod learned;
mod specification;
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
    Requirement, Severity, SignalDraft, Source, SpecificationDraft, Text, UtilityDraft, VariableDraft,
};
pub use fusion::{
    Fusion, FusionInput, FusionMethod, FusionOutput, FusionPlaces, FusionPrediction, FusionSettings,
    FusionState,
};
pub use id_set::{IdSet, RelationSet, SignalSet};
pub use ids::{CauseId, Id, IdVec, NeedId, RelationId, SignalId, VariableId};
pub use learned::Learned;
pub use lineage::Lineage;
pub use need::{INTEGRITY_LEVELS, ISOLATIONS, Need, Switching, WhenUnsure, integrity_level};
pub use parts::{Contradiction, join, part};
pub use properties::{ACCURACY, COST, INTEGRITY, NEGLIGIBLE, PRIOR, PROPERTIES, Properties};
pub use relation::Relation;
pub use signal::{
    Access, CAUSE_PRIOR, Cause, ChangeError, ReadingLimits, Saturation, Scaling, Signal, SourceParts,
    ValueError,
};
pub use specification::Specification;
pub use utility::{
    Aggregate, Element, Fact, Figure, Inputs, Numbers, OwnUtility, Rating, Utility, UtilityProblem,
};
pub use variable::{Shape, Variable};

use alloc::collections::BTreeSet;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// Variables, relations, signals and needs of one system.
#[derive(Clone, Debug, Default)]
pub struct KnowledgeBase {
    variables: IdVec<VariableId, Variable>,
    relations: IdVec<RelationId, Relation>,
    signals: IdVec<SignalId, Signal>,
    needs: IdVec<NeedId, Need>,
    causes: IdVec<CauseId, Cause>,
    fusions: Vec<Fusion>,
    learned: Vec<Learned>,
    specifications: Vec<Specification>,
    /// The outputs of fusions, and all signals that fusions compute.
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

    /// The short name of a need: its variable, or its name of publication where the variable has several needs. O(needs).
    #[must_use]
    pub fn need_name(&self, need: NeedId) -> &str {
        let Some(named) = self.needs.find(need) else { return "" };
        let of_variable = self.needs.iter().filter(|other| other.variable == named.variable);
        match of_variable.count() {
            1 => &self.variables[named.variable].name,
            _ => &named.signal,
        }
    }

    /// The needs of a name: the need published under it, else all needs of the variable of this name. O(needs).
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

    /// Replaces the common causes; they must name only signals of the knowledge base, ascending.
    #[must_use]
    pub fn with_causes(self, causes: IdVec<CauseId, Cause>) -> KnowledgeBase {
        KnowledgeBase { causes, ..self }
    }

    /// The temporal specifications, in file order.
    #[must_use]
    pub fn specifications(&self) -> &[Specification] {
        &self.specifications
    }

    /// Replaces the specifications; their relations must be those of the knowledge base.
    #[must_use]
    pub fn with_specifications(self, specifications: Vec<Specification>) -> KnowledgeBase {
        KnowledgeBase { specifications, ..self }
    }

    /// How substitutions are rated.
    #[must_use]
    pub fn utility(&self) -> &Utility {
        &self.utility
    }

    /// Replaces the rating of substitutions.
    #[must_use]
    pub fn with_utility(self, utility: Utility) -> KnowledgeBase {
        KnowledgeBase { utility, ..self }
    }

    /// The guarantees and demands of all subjects.
    #[must_use]
    pub fn contracts(&self) -> &Contracts {
        &self.contracts
    }

    /// Replaces the contracts; they must name only elements of the knowledge base.
    #[must_use]
    pub fn with_contracts(self, contracts: Contracts) -> KnowledgeBase {
        KnowledgeBase { contracts, ..self }
    }

    /// The version, which every change raises by one.
    #[must_use]
    pub fn version(&self) -> u64 {
        self.version
    }

    /// The knowledge base as the successor of another of this version.
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

    /// Allows or forbids the use of a signal; a change raises the version.
    pub fn set_available(&mut self, signal: SignalId, available: bool) {
        if self.available[signal] != available {
            self.available[signal] = available;
            self.version += 1;
        }
    }

    /// Sets or removes a property of an element; a change raises the version.
    ///
    /// Complexity: logarithmic in the element's properties; O(model) where the model has formulas of its own as utility, which
    /// may read the property anywhere.
    ///
    /// # Errors
    /// The problem of the number, in words; then nothing has changed.
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

    /// Returns the previous number.
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

    /// The knowledge base with the availability of signals of the same name in another one.
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

    /// The origins of a signal: itself, and all signals that it is derived from, transitively.
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

    /// The signal that represents all signals from the same field of the same source, as one measurement and one witness.
    #[must_use]
    pub fn witness(&self, signal: SignalId) -> SignalId {
        self.witnesses.of(signal)
    }

    /// The signals that represent these signals.
    #[must_use]
    pub fn as_witnesses(&self, signals: SignalSet) -> SignalSet {
        match self.witnesses.is_empty() {
            true => signals,
            false => signals.iter().map(|signal| self.witness(signal)).collect(),
        }
    }

    /// These signals, and all others of the same measurements.
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

    /// The only constructor, used by the checks and by structure generators, from checked parts.
    ///
    /// Relations and signals must name only ids of `variables`; inputs and outputs are sorted here. Signals from the same field
    /// of the same source, or from an element of it, become derived from each other.
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
            learned: Vec::new(),
            specifications: Vec::new(),
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
