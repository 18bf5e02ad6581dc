//! The knowledge base: variables, relations, signals and needs, built only through checks.
//!
//! Everything is found by dense ids in file order. Cycles and relations that are usable in several directions
//! are ordinary. What can change at run time is the availability of signals; every change bumps the version.

mod ids;
mod rows;
mod index;
mod properties;
mod id_set;
mod utility;
mod sources;
mod draft;
mod build;
mod lineage;
mod change;
mod parts;
mod places;

pub use build::{build, build_from};
pub use change::{Edit, Model, Section};
pub use draft::{
    BodyDraft, Bounds, Diagnostic, Draft, NeedDraft, Place, PropertyDrafts, RelationDraft, Severity,
    SignalDraft, Source, Text, UtilityDraft, VariableDraft,
};
pub use id_set::{IdSet, RelationSet, SignalSet};
pub use ids::{CauseId, Id, IdVec, NeedId, RelationId, SignalId, VariableId};
pub use lineage::Lineage;
pub use parts::{Contradiction, join, part};
pub use properties::{ACCURACY, COST, INTEGRITY, NEGLIGIBLE, PRIOR, PROPERTIES, Properties};
pub use utility::{Aggregate, Element, Fact, Figure, Inputs, OwnUtility, Rating, Utility, UtilityProblem};

use crate::circle;
use crate::expression::Formula;
use crate::interval::Interval;
use crate::time::Span;
use crate::unit::{Unit, enclosed};
use alloc::collections::BTreeSet;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use rows::Rows;

/// Whether a variable is one number or a list of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shape {
    /// One number.
    #[default]
    Scalar,
    /// A list of numbers whose length the observations decide.
    Vector,
}

impl Shape {
    /// All, with their names in models.
    pub const NAMES: [(&'static str, Shape); 2] = [("scalar", Shape::Scalar), ("vector", Shape::Vector)];
}

/// A physical quantity.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Unique in the model.
    pub name: String,
    /// What values are read and shown in; `None` when the model does not say. Inside, values are coherent SI.
    pub unit: Option<Unit>,
    /// One number or a list.
    pub shape: Shape,
    /// Physically possible values, in SI.
    pub range: Option<Interval>,
    /// Largest rate of change, SI units a second: how fast the uncertainty of an old value grows.
    pub max_rate: Option<f64>,
    /// The turn after which its values are the same again, SI, above 0; `None` of what does not wrap. Of numbers, not of vectors.
    pub wraps: Option<f64>,
    /// The value, in SI, when it never changes: a constant is always provided.
    pub constant: Option<Interval>,
    /// Named numbers for the utility.
    pub properties: Properties,
}

/// By what share a range may differ from a turn and still span one: 360 deg and 6.283 rad are both written.
const SPANS_A_TURN: f64 = 1e-3;

impl Variable {
    /// Where the turn begins in which its values are shown: at its range where that spans one turn, else at 0.
    #[must_use]
    pub fn turn_begins(&self) -> f64 {
        let spans_one = |range: &Interval| {
            self.wraps.is_some_and(|turn| (range.width() / turn - 1.0).abs() < SPANS_A_TURN)
        };
        self.range.filter(spans_one).map_or(0.0, Interval::lo)
    }

    /// A value of it, SI, as it is shown and published: within one turn where it wraps, by its middle.
    #[must_use]
    pub fn brought_back(&self, value: Interval) -> Interval {
        self.wraps.map_or(value, |turn| circle::brought_back(value, self.turn_begins(), turn))
    }

    /// What its readings may be: where its range spans a turn, one turn more to either side, as sensors count from
    /// different points.
    #[must_use]
    pub fn readable(&self) -> Option<Interval> {
        let wide = |range: Interval, turn: f64| range.width() >= turn * (1.0 - SPANS_A_TURN);
        match (self.range, self.wraps) {
            (Some(range), Some(turn)) if wide(range, turn) => Some(range.widened(turn)),
            (range, _) => range,
        }
    }
}

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

/// The error of a value: it lies within `[v + lo, v + hi]`, each widened by its share of `|v|`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ValueError {
    /// Lowest error, SI, at most 0 for a usual sensor.
    pub lo: f64,
    /// Highest error, SI.
    pub hi: f64,
    /// Plus-minus share of the magnitude of the value (0.02 is 2 %).
    pub relative: f64,
}

/// How the readings of a signal become values in its unit: `scale * reading + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scaling {
    /// Finite and not 0; below 0 it turns the direction round.
    pub scale: f64,
    /// Finite, in the signal's unit.
    pub offset: f64,
}

impl Scaling {
    /// The value of a reading, in the signal's unit.
    #[must_use]
    pub fn value(self, reading: f64) -> f64 {
        self.scale * reading + self.offset
    }

    /// The reading of a value in the signal's unit.
    #[must_use]
    pub fn reading(self, value: f64) -> f64 {
        (value - self.offset) / self.scale
    }

    /// The values, in the signal's unit, of all readings in an interval, rounded outward.
    #[must_use]
    pub fn values(self, readings: Interval) -> Interval {
        let scaled = if self.scale == 1.0 { readings } else { readings * enclosed(self.scale) };
        if self.offset == 0.0 { scaled } else { scaled + enclosed(self.offset) }
    }
}

/// What no reading of a sound signal goes beyond, its errors allowed for; `None` where nothing is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReadingLimits {
    /// Possible values, SI: those of its variable, and within them its own. Of numbers, not of vectors.
    pub range: Option<Interval>,
    /// Largest rate of change, SI a second: its own, else its variable's. Of numbers, not of vectors.
    pub max_rate: Option<f64>,
    /// Longest time from the time stamp to the reception: as declared, else its delay and its timeout together where the
    /// model gives a delay.
    pub max_delay: Option<Span>,
    /// How long its readings may stay exactly the same while they keep coming.
    pub frozen_after: Option<Span>,
    /// The turn after which its variable's values are the same again, SI; see [`Variable::wraps`].
    pub turn: Option<f64>,
}

/// Something on the bus that carries a variable.
#[derive(Clone, Debug)]
pub struct Signal {
    /// Unique in the model.
    pub name: String,
    /// What it carries.
    pub variable: VariableId,
    /// Where it is found: topic or file, `#`, field or column.
    pub source: String,
    /// What its values come in: its own unit or else the variable's; `None` when the model gives neither.
    pub unit: Option<Unit>,
    /// How its readings become values in that unit; `None` when they are.
    pub scaling: Option<Scaling>,
    /// Observations a second; `None` when it comes when it comes.
    pub rate_hz: Option<f64>,
    /// Error of its values.
    pub value_error: ValueError,
    /// Standard deviation of the noise of its values, SI; `None` when nothing is known of it but the bounds of
    /// `value_error`: only what is declared here lets statistics over many comparisons accuse.
    pub noise: Option<f64>,
    /// Lowest and highest error of its time stamps.
    pub time_error: (Span, Span),
    /// How much older the content is than its time stamp says.
    pub delay: Span,
    /// How long a time each of its values is the mean over, half of it before and half after the moment that time stamp and
    /// delay say; zero of a value that is true at that moment.
    pub mean_over: Span,
    /// How long it may say nothing before it counts as silent; `None` when it is never silent.
    pub timeout: Option<Span>,
    /// What its readings can be.
    pub limits: ReadingLimits,
    /// Signals that it is computed from: it is no independent witness about them.
    pub derived_from: Vec<SignalId>,
    /// Named numbers for the utility; `prior` is the probability that it is faulty.
    pub properties: Properties,
}

/// What several signals share: a device, a clock, a power supply. When it fails, they all may be wrong at once
/// (a common cause failure).
#[derive(Clone, Debug, PartialEq)]
pub struct Cause {
    /// Unique in the model.
    pub name: String,
    /// Who shares it, ascending.
    pub signals: Vec<SignalId>,
    /// The probability that it is faulty.
    pub prior: f64,
}

/// The probability that a common cause is faulty when no signal gives one.
pub const CAUSE_PRIOR: f64 = 0.001;

/// A variable that must stay available.
#[derive(Clone, Debug)]
pub struct Need {
    /// The variable that is needed.
    pub variable: VariableId,
    /// The name under which it is published.
    pub signal: String,
    /// How old a published value may be.
    pub max_age: Span,
    /// How wide a published interval may be, SI.
    pub max_width: Option<f64>,
    /// The least integrity level of all that serves it, `A` to `D`.
    pub integrity: Option<char>,
    /// The least rate of the signals that serve it, observations a second.
    pub min_rate_hz: Option<f64>,
    /// What goes out while all that could serve it is suspect.
    pub when_unsure: WhenUnsure,
    /// How switching behaves.
    pub switching: Switching,
    /// Whether its substitutes are to be computed in processes of their own, where the system has such.
    pub is_isolated: bool,
}

/// What serves a need while all of its sources are suspect: one of them lies, and nothing tells which.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WhenUnsure {
    /// All that enough of the candidates hold possible, as an interval: the truth is in it. Usual where a largest width is
    /// stated.
    Hull,
    /// The last trusted value, until it is too old.
    Last,
    /// Nothing. Usual where no largest width is stated.
    #[default]
    Withhold,
}

impl WhenUnsure {
    /// Every choice.
    pub const ALL: [WhenUnsure; 3] = [WhenUnsure::Hull, WhenUnsure::Last, WhenUnsure::Withhold];

    /// The word for it in models.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            WhenUnsure::Hull => "hull",
            WhenUnsure::Last => "last",
            WhenUnsure::Withhold => "withhold",
        }
    }
}

/// Where substitutes of a need are computed, as models name it, and whether that is in processes of their own.
pub const ISOLATIONS: [(&str, bool); 2] = [("engine", false), ("process", true)];

/// Integrity levels with their numbers in the property `integrity`, the highest last.
pub const INTEGRITY_LEVELS: [(&str, f64); 4] = [("A", 1.0), ("B", 2.0), ("C", 3.0), ("D", 4.0)];

/// The number of an integrity level.
#[must_use]
pub fn integrity_level(name: &str) -> Option<f64> {
    INTEGRITY_LEVELS.iter().find(|(known, _)| *known == name).map(|(_, level)| *level)
}

/// How a need switches between its sources.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Switching {
    /// At most one voluntary switch in this time; a lost source is replaced at once.
    pub hold: Span,
    /// How long a recovered source must stay healthy before the need goes back to it.
    pub probation: Span,
    /// How long the output moves from the old source to the new one; zero switches at once.
    pub blend: Span,
    /// By how much better the utility of a trusted source must be to leave a healthy one, as a share.
    pub hysteresis: f64,
}

impl Default for Switching {
    fn default() -> Self {
        Switching {
            hold: Span::from_millis(1_000),
            probation: Span::from_millis(5_000),
            blend: Span::ZERO,
            hysteresis: 0.0,
        }
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
    utility: Utility,
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
            utility: Utility::default(),
            available,
            producers,
            carriers,
            witnesses,
            version: 0,
        }
    }
}
