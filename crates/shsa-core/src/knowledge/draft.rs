//! A model as it is written: pieces of text, each with its place, before anything is checked.

mod fusion;

use super::signal::SourceParts;
pub use crate::expression::Severity;
use alloc::string::String;
use alloc::vec::Vec;
use core::ops::Range;
pub use fusion::{FusionDraft, FusionInputDraft, FusionOutputDraft, FusionStateDraft};

/// A range of bytes in the source that a draft was read from.
///
/// The core only orders and hands back places; who made the draft knows the file behind them. A draft that was
/// made by a program may leave all places at their default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Place {
    /// The first byte.
    pub from: u32,
    /// The byte after the last.
    pub to: u32,
}

/// A piece of a model and where it stands.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Text {
    /// What is written, without quotes.
    pub text: String,
    /// Where.
    pub place: Place,
}

impl From<&Text> for Place {
    fn from(text: &Text) -> Place {
        text.place
    }
}

/// One value, or the lowest and the highest.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Bounds {
    /// `0.5 m`, or plus-minus that.
    One(Text),
    /// `[0 m, 2 m]`.
    Two(Text, Text),
}

/// Names with their numbers, in file order.
pub type PropertyDrafts = Vec<(Text, Text)>;

/// A model before it is checked, in file order.
#[derive(Clone, Debug, Default)]
pub struct Draft {
    /// Physical quantities.
    pub variables: Vec<VariableDraft>,
    /// Names and their values: a number, a quantity such as `2.67 m`, or the bounds of one.
    pub constants: Vec<(Text, Bounds)>,
    /// Heads such as `clamp01(x)` and their formulas.
    pub functions: Vec<(Text, Text)>,
    /// How variables determine each other.
    pub relations: Vec<RelationDraft>,
    /// What carries variables.
    pub signals: Vec<SignalDraft>,
    /// Signals that are computed from others by estimation.
    pub fusions: Vec<FusionDraft>,
    /// What must stay available.
    pub needs: Vec<NeedDraft>,
    /// What others run on, each with its contract.
    pub platform: Vec<ContractDraft>,
    /// What signals, relations, needs and this program guarantee and demand.
    pub contracts: Vec<ContractDraft>,
    /// The figure of merit; `norm` when absent.
    pub utility: Option<UtilityDraft>,
}

/// How substitutions are rated.
#[derive(Clone, Debug)]
pub enum UtilityDraft {
    /// One that is known by name.
    Named(Text),
    /// Formulas of the model's own.
    Own {
        /// The key, for what is wrong with all of it.
        at: Text,
        /// `product` (when absent), `sum` or `minimum`.
        aggregate: Option<Text>,
        /// A formula over the properties of a relation, and `inputs`, `unprovided`, `input_accuracy`.
        relation: Option<Text>,
        /// A formula over the properties of a signal, and `rate` and `delay` in SI.
        signal: Option<Text>,
        /// A formula over how a way ran: `agreement`, `error`, `width`, `availability`.
        way: Option<Text>,
        /// Values of properties where they are not given, and of figures of a way that are not known.
        defaults: PropertyDrafts,
    },
}

/// A model that is read a piece at a time: of a large one, no piece is kept longer than it takes to check it.
///
/// Each list may be read more than once, and gives the same pieces then, in file order.
pub trait Source {
    /// Gives all variables.
    fn variables(&mut self, take: &mut dyn FnMut(&VariableDraft));
    /// Gives all constants.
    fn constants(&mut self, take: &mut dyn FnMut(&(Text, Bounds)));
    /// Gives all functions.
    fn functions(&mut self, take: &mut dyn FnMut(&(Text, Text)));
    /// Gives all relations.
    fn relations(&mut self, take: &mut dyn FnMut(&RelationDraft));
    /// Gives all signals.
    fn signals(&mut self, take: &mut dyn FnMut(&SignalDraft));
    /// Gives all fusions.
    fn fusions(&mut self, take: &mut dyn FnMut(&FusionDraft));
    /// Gives all needs.
    fn needs(&mut self, take: &mut dyn FnMut(&NeedDraft));
    /// What others run on.
    fn platform(&mut self) -> Vec<ContractDraft>;
    /// What signals, relations, needs and this program guarantee and demand.
    fn contracts(&mut self) -> Vec<ContractDraft>;
    /// The figure of merit.
    fn utility(&mut self) -> Option<UtilityDraft>;
}

impl Draft {
    /// Everything that a source has.
    #[must_use]
    pub fn of(source: &mut dyn Source) -> Draft {
        let mut draft = Draft { utility: source.utility(), ..Draft::default() };
        source.variables(&mut |variable| draft.variables.push(variable.clone()));
        source.constants(&mut |constant| draft.constants.push(constant.clone()));
        source.functions(&mut |function| draft.functions.push(function.clone()));
        source.relations(&mut |relation| draft.relations.push(relation.clone()));
        source.signals(&mut |signal| draft.signals.push(signal.clone()));
        source.fusions(&mut |fusion| draft.fusions.push(fusion.clone()));
        source.needs(&mut |need| draft.needs.push(need.clone()));
        draft.platform = source.platform();
        draft.contracts = source.contracts();
        draft
    }
}

impl Source for &Draft {
    fn variables(&mut self, take: &mut dyn FnMut(&VariableDraft)) {
        self.variables.iter().for_each(take);
    }
    fn constants(&mut self, take: &mut dyn FnMut(&(Text, Bounds))) {
        self.constants.iter().for_each(take);
    }
    fn functions(&mut self, take: &mut dyn FnMut(&(Text, Text))) {
        self.functions.iter().for_each(take);
    }
    fn relations(&mut self, take: &mut dyn FnMut(&RelationDraft)) {
        self.relations.iter().for_each(take);
    }
    fn signals(&mut self, take: &mut dyn FnMut(&SignalDraft)) {
        self.signals.iter().for_each(take);
    }
    fn fusions(&mut self, take: &mut dyn FnMut(&FusionDraft)) {
        self.fusions.iter().for_each(take);
    }
    fn needs(&mut self, take: &mut dyn FnMut(&NeedDraft)) {
        self.needs.iter().for_each(take);
    }
    fn platform(&mut self) -> Vec<ContractDraft> {
        self.platform.clone()
    }
    fn contracts(&mut self) -> Vec<ContractDraft> {
        self.contracts.clone()
    }
    fn utility(&mut self) -> Option<UtilityDraft> {
        self.utility.clone()
    }
}

/// A physical quantity.
#[derive(Clone, Debug, Default)]
pub struct VariableDraft {
    /// An identifier, unique among variables, constants and functions.
    pub name: Text,
    /// A unit such as `m/s^2`.
    pub unit: Option<Text>,
    /// `scalar` (when absent) or `vector`.
    pub shape: Option<Text>,
    /// Lowest and highest possible value, as numbers in the variable's unit or as quantities.
    pub range: Option<(Text, Text)>,
    /// Largest rate of change, as a number in the variable's unit a second or as a quantity.
    pub max_rate: Option<Text>,
    /// The turn after which its values are the same again, as a number in the variable's unit or as a quantity.
    pub wraps: Option<Text>,
    /// Named numbers.
    pub properties: PropertyDrafts,
}

/// How variables determine each other.
#[derive(Clone, Debug)]
pub struct RelationDraft {
    /// Unique among relations.
    pub name: Text,
    /// What it says.
    pub body: BodyDraft,
    /// The variables that it may be solved for; all that it can be when absent.
    pub directions: Option<Vec<Text>>,
    /// A condition over its variables that must hold for the result to count.
    pub condition: Option<Text>,
    /// By how much the left side may differ from the right: a number in the unit of the left side, a quantity,
    /// or bounds.
    pub error: Option<Bounds>,
    /// Named numbers.
    pub properties: PropertyDrafts,
}

/// What a relation says.
#[derive(Clone, Debug)]
pub enum BodyDraft {
    /// Two formulas with `=` between them.
    Equation(Text),
    /// Only who determines whom: it can be planned and analysed, not run.
    Structure {
        /// What it may produce.
        outputs: Vec<Text>,
        /// What it may read: for one output, all of them but that output.
        inputs: Vec<Text>,
    },
}

/// Something on the bus that carries a variable.
#[derive(Clone, Debug, Default)]
pub struct SignalDraft {
    /// Unique among signals.
    pub name: Text,
    /// What it carries.
    pub variable: Option<Text>,
    /// Where it is found; its name when absent.
    pub source: Option<Text>,
    /// What that tells of its measurement, by who knows how such texts are written.
    pub source_parts: SourceParts,
    /// What its values come in, or a multiple of it such as `-1 m/s`; the variable's unit when absent.
    pub unit: Option<Text>,
    /// What each reading is multiplied by to be a value in its unit; 1 when absent.
    pub scale: Option<Text>,
    /// What is added to that, as a number in its unit or as a quantity; 0 when absent.
    pub offset: Option<Text>,
    /// A frequency such as `10 Hz`.
    pub rate: Option<Text>,
    /// Plus-minus (`0.15`, `5 cm`, `2 %`, `0.3 + 1 %`), or lowest and highest.
    pub value_error: Option<Bounds>,
    /// Standard deviation of its noise: a number in the signal's unit, or a quantity.
    pub noise: Option<Text>,
    /// Plus-minus (`50 ms`), or lowest and highest.
    pub time_error: Option<Bounds>,
    /// How old its content is at its time stamp.
    pub delay: Option<Text>,
    /// How long a time each value is the mean over, around the moment that it tells about.
    pub mean_over: Option<Text>,
    /// How long it may be silent, or `none`.
    pub timeout: Option<Text>,
    /// Lowest and highest possible reading, as numbers in the signal's unit or as quantities; within its variable's.
    pub range: Option<(Text, Text)>,
    /// Largest rate of change, as a number in the signal's unit a second or as a quantity, or `none`; its variable's when
    /// absent.
    pub max_rate: Option<Text>,
    /// Longest time from the time stamp to the reception, or `none`.
    pub max_delay: Option<Text>,
    /// How long its values may stay exactly the same, or `none`.
    pub frozen_after: Option<Text>,
    /// `true` when a value stands until the next one, or `false`.
    pub hold: Option<Text>,
    /// Names of signals that it is computed from.
    pub derived_from: Vec<Text>,
    /// What it shares with other signals (a device, a clock, a power supply), each with the probability that it fails.
    pub shares: Vec<(Text, Option<Text>)>,
    /// Named numbers.
    pub properties: PropertyDrafts,
}

/// A variable that must stay available.
#[derive(Clone, Debug, Default)]
pub struct NeedDraft {
    /// Which.
    pub variable: Text,
    /// The name under which it is published; `/healed/<variable>` when absent.
    pub signal: Option<Text>,
    /// How old a published value may be.
    pub max_age: Option<Text>,
    /// How wide a published interval may be: a number in the variable's unit, or a quantity.
    pub max_width: Option<Text>,
    /// `A`, `B`, `C` or `D`.
    pub integrity: Option<Text>,
    /// How often values must come: a frequency such as `5 Hz`.
    pub min_rate: Option<Text>,
    /// `hull`, `last` or `withhold`: what goes out while all that could serve it is suspect.
    pub when_unsure: Option<Text>,
    /// Least time between two voluntary switches.
    pub hold: Option<Text>,
    /// How long a recovered source is watched before it is used again.
    pub probation: Option<Text>,
    /// How long the output moves from one source to the next.
    pub blend: Option<Text>,
    /// By what share another source must be better: a number or a percentage.
    pub hysteresis: Option<Text>,
    /// `engine` or `process`: where its substitutes are computed.
    pub isolation: Option<Text>,
}

/// What somebody guarantees, demands and observes.
#[derive(Clone, Debug, Default)]
pub struct ContractDraft {
    /// Of a signal, a relation, a need, a platform, or `shsa`.
    pub name: Text,
    /// The platform that it runs on.
    pub runs_on: Option<Text>,
    /// `stop`, `degrade` or `warn`: what is done with a need that nothing admissible serves.
    pub policy: Option<Text>,
    /// The best first.
    pub gives: Vec<GuaranteeDraft>,
    /// Of others.
    pub asks: Vec<DemandDraft>,
    /// Names, and what is observed, such as `age at most 300 ms`.
    pub evidence: Vec<(Text, Text)>,
}

/// A statement that holds on a condition.
#[derive(Clone, Debug, Default)]
pub struct GuaranteeDraft {
    /// Unique in its contract.
    pub name: Text,
    /// The variable that it is about, where a relation may produce several.
    pub of: Option<Text>,
    /// A level such as `SIL 2`; none when absent.
    pub level: Option<Text>,
    /// Names of what is asked and observed, joined by `and`, `or` and `2 of (..)`; all of them when absent.
    pub when: Option<Text>,
    /// Two of what is asked that are claimed to be redundant.
    pub redundant: Option<Vec<Text>>,
    /// Names and their bounds, such as `error` and `at most 0.5 m`.
    pub properties: Vec<(Text, Text)>,
}

/// A statement that is asked of somebody else.
#[derive(Clone, Debug, Default)]
pub struct DemandDraft {
    /// Unique in its contract, among demands and evidence.
    pub name: Text,
    /// A variable, a signal, a platform, `platform`, `consumers` or `shsa`.
    pub of: Option<Text>,
    /// A level such as `SIL 2`; any when absent.
    pub level: Option<Text>,
    /// Names and their bounds, such as `error` and `at most 0.5 m`.
    pub properties: Vec<(Text, Text)>,
}

/// What is wrong in a draft, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// An error keeps the model from being used.
    pub severity: Severity,
    /// The piece of text that it is about.
    pub place: Place,
    /// The bytes of that text that it is about; all when `None`.
    pub span: Option<Range<usize>>,
    /// What is wrong, in one line.
    pub message: String,
    /// What to write instead.
    pub help: Option<String>,
}
