//! A model as it is written: pieces of text with their places, before any check.

mod fusion;
mod specification;

use super::signal::SourceParts;
pub use crate::expression::Severity;
use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;
use core::ops::Range;
pub use fusion::{FusionDraft, FusionInputDraft, FusionOutputDraft, FusionStateDraft};
pub use specification::{Requirement, SpecificationDraft};

/// A range of bytes in the source that a draft was read from.
///
/// The core only orders and returns places; the maker of the draft knows the file. A draft made by a program may leave all places
/// at their default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Place {
    /// The first byte.
    pub from: u32,
    /// The byte after the last.
    pub to: u32,
}

/// A piece of a model and its place.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Text {
    /// The text, without quotes.
    pub text: String,
    /// The place of the text.
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
    /// `0.5 m`, or plus-minus this amount.
    One(Text),
    /// `[0 m, 2 m]`.
    Two(Text, Text),
}

/// Names and their numbers, in file order.
pub type PropertyDrafts = Vec<(Text, Text)>;

/// A model before it is checked, in file order.
#[derive(Clone, Debug, Default)]
pub struct Draft {
    /// Physical quantities.
    pub variables: Vec<VariableDraft>,
    /// Names and their values: a number, a quantity such as `2.67 m`, or two bounds.
    pub constants: Vec<(Text, Bounds)>,
    /// Heads such as `clamp01(x)` and their formulas.
    pub functions: Vec<(Text, Text)>,
    /// How variables determine each other.
    pub relations: Vec<RelationDraft>,
    /// Signals on the bus.
    pub signals: Vec<SignalDraft>,
    /// Signals that are computed from others by estimation.
    pub fusions: Vec<FusionDraft>,
    /// Variables that must stay available.
    pub needs: Vec<NeedDraft>,
    /// Platforms that services run on, each with its contract.
    pub platform: Vec<ContractDraft>,
    /// Guarantees and demands of signals, relations, needs and this program.
    pub contracts: Vec<ContractDraft>,
    /// The figure of merit; `norm` when absent.
    pub utility: Option<UtilityDraft>,
}

/// How substitutions are rated.
#[derive(Clone, Debug)]
pub enum UtilityDraft {
    /// A predefined utility.
    Named(Text),
    /// The model's own formulas.
    Own {
        /// The key, as the place of problems of the whole.
        at: Text,
        /// `product` (when absent), `sum` or `minimum`.
        aggregate: Option<Text>,
        /// A formula over the properties of a relation, and `inputs`, `unprovided`, `input_accuracy`.
        relation: Option<Text>,
        /// A formula over the properties of a signal, and `rate` and `delay` in SI.
        signal: Option<Text>,
        /// A formula over the record of a way: `agreement`, `error`, `width`, `availability`.
        way: Option<Text>,
        /// Default values of properties, and of figures of a way without evidence.
        defaults: PropertyDrafts,
    },
}

/// A model that is read a piece at a time: no piece of a large model is kept after its check.
///
/// Each list may be read more than once, and gives the same pieces each time, in file order.
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
    /// Gives all platforms.
    fn platform(&mut self) -> Vec<ContractDraft>;
    /// Gives all contracts.
    fn contracts(&mut self) -> Vec<ContractDraft>;
    /// Gives the utility.
    fn utility(&mut self) -> Option<UtilityDraft>;
}

impl Draft {
    /// The draft of all pieces of a source.
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
    /// The turn after which the values repeat, as a number in the variable's unit or as a quantity.
    pub wraps: Option<Text>,
    /// Named numbers.
    pub properties: PropertyDrafts,
}

/// How variables determine each other.
#[derive(Clone, Debug)]
pub struct RelationDraft {
    /// Unique among relations.
    pub name: Text,
    /// The relation's content.
    pub body: BodyDraft,
    /// The variables to solve the relation for; all possible ones when absent.
    pub directions: Option<Vec<Text>>,
    /// A condition over the relation's variables that must hold for the result to count.
    pub condition: Option<Text>,
    /// By how much the left side may differ from the right: a number in the unit of the left side, a quantity,
    /// or bounds.
    pub error: Option<Bounds>,
    /// Variables that change slowly, and are fitted to the relation while its signals are trusted.
    pub learn: Vec<Text>,
    /// Named numbers.
    pub properties: PropertyDrafts,
}

impl RelationDraft {
    /// A relation that always holds, exactly and in all directions, and has no properties.
    #[must_use]
    pub fn new(name: Text, body: BodyDraft) -> RelationDraft {
        RelationDraft {
            name,
            body,
            directions: None,
            condition: None,
            error: None,
            learn: Vec::new(),
            properties: Vec::new(),
        }
    }
}

/// The content of a relation.
#[derive(Clone, Debug)]
pub enum BodyDraft {
    /// Two formulas with `=` between them.
    Equation(Text),
    /// Only inputs and outputs: the relation can be planned and analysed, not run.
    Structure {
        /// The variables that the relation may produce.
        outputs: Vec<Text>,
        /// The variables that the relation may read: for one output, all of them but that output.
        inputs: Vec<Text>,
    },
    /// A temporal specification; the variable of the relation's name has its verdict.
    Specification(Box<SpecificationDraft>),
}

/// A signal on the bus that carries a variable.
#[derive(Clone, Debug, Default)]
pub struct SignalDraft {
    /// Unique among signals.
    pub name: Text,
    /// The variable that the signal carries.
    pub variable: Option<Text>,
    /// Where the signal is found; its name when absent.
    pub source: Option<Text>,
    /// The parts of the source's text, from the module that knows the notation.
    pub source_parts: SourceParts,
    /// The unit of the values, or a multiple of one such as `-1 m/s`; the variable's unit when absent.
    pub unit: Option<Text>,
    /// The factor from a reading to a value in the signal's unit; 1 when absent.
    pub scale: Option<Text>,
    /// The amount added to that, as a number in the signal's unit or as a quantity; 0 when absent.
    pub offset: Option<Text>,
    /// A frequency such as `10 Hz`.
    pub rate: Option<Text>,
    /// Plus-minus (`0.15`, `5 cm`, `2 %`, `0.3 + 1 %`), or lowest and highest.
    pub value_error: Option<Bounds>,
    /// Plus-minus, of the difference of two readings: `0.3`, `0.3 hPa`, `0.3 hPa + 1 hPa/h`.
    pub change_error: Option<Text>,
    /// Standard deviation of the noise: a number in the signal's unit, or a quantity.
    pub noise: Option<Text>,
    /// Plus-minus (`50 ms`), or lowest and highest.
    pub time_error: Option<Bounds>,
    /// How much older the content is than the time stamp.
    pub delay: Option<Text>,
    /// How long a time each value is the mean over, around the moment of the value.
    pub mean_over: Option<Text>,
    /// How long the signal may be silent, or `none`.
    pub timeout: Option<Text>,
    /// Lowest and highest possible reading, as numbers in the signal's unit or as quantities; within the variable's range.
    pub range: Option<(Text, Text)>,
    /// Lowest and highest reading that is a measurement: at these the value is there or beyond.
    pub saturates: Option<(Text, Text)>,
    /// Largest rate of change, as a number in the signal's unit a second or as a quantity, or `none`; the variable's when absent.
    pub max_rate: Option<Text>,
    /// Longest time from the time stamp to the reception, or `none`.
    pub max_delay: Option<Text>,
    /// How long readings may stay exactly the same, or `none`.
    pub frozen_after: Option<Text>,
    /// The value at which readings may stay the same for longer: a number in the signal's unit, or a quantity.
    pub rests_at: Option<Text>,
    /// How long readings may stay the same at `rests_at`, or `none`: for any time.
    pub rests_for: Option<Text>,
    /// `true` when a value stands until the next one, or `false`.
    pub hold: Option<Text>,
    /// `true` when the signal only counts up, but for beginning anew, or `false`.
    pub counter: Option<Text>,
    /// `port`, `estimate` or `both`: what is computed from it later takes for its value.
    pub access: Option<Text>,
    /// Names of signals that it is computed from.
    pub derived_from: Vec<Text>,
    /// Common causes (a device, a clock, a power supply) that the signal shares with others, each with its prior probability.
    pub shares: Vec<(Text, Option<Text>)>,
    /// Named numbers.
    pub properties: PropertyDrafts,
}

/// A variable that must stay available.
#[derive(Clone, Debug, Default)]
pub struct NeedDraft {
    /// The variable.
    pub variable: Text,
    /// The name of the publication; `/healed/<variable>` when absent.
    pub signal: Option<Text>,
    /// How old a published value may be.
    pub max_age: Option<Text>,
    /// How wide a published interval may be: a number in the variable's unit, or a quantity.
    pub max_width: Option<Text>,
    /// `A`, `B`, `C` or `D`.
    pub integrity: Option<Text>,
    /// How often values must come: a frequency such as `5 Hz`.
    pub min_rate: Option<Text>,
    /// `hull`, `last` or `withhold`: what is published while every source is suspect.
    pub when_unsure: Option<Text>,
    /// Least time between two voluntary switches.
    pub hold: Option<Text>,
    /// How long a recovered source is watched before it is used again.
    pub probation: Option<Text>,
    /// How long the output moves from one source to the next.
    pub blend: Option<Text>,
    /// By what share another source must be better: a number or a percentage.
    pub hysteresis: Option<Text>,
    /// `engine` or `process`: where substitutes are computed.
    pub isolation: Option<Text>,
}

/// The contract of a signal, a relation, a need, a platform, or `shsa`.
#[derive(Clone, Debug, Default)]
pub struct ContractDraft {
    /// The name of the subject.
    pub name: Text,
    /// The platform that the subject runs on.
    pub runs_on: Option<Text>,
    /// `stop`, `degrade` or `warn`: what happens to a need without an admissible source.
    pub policy: Option<Text>,
    /// Guarantees, the best first.
    pub gives: Vec<GuaranteeDraft>,
    /// Demands of others.
    pub asks: Vec<DemandDraft>,
    /// Names and the observed quantity, such as `age at most 300 ms`.
    pub evidence: Vec<(Text, Text)>,
}

/// A statement that holds on a condition.
#[derive(Clone, Debug, Default)]
pub struct GuaranteeDraft {
    /// Unique in its contract.
    pub name: Text,
    /// The variable of the statement, where a relation may produce several.
    pub of: Option<Text>,
    /// A level such as `SIL 2`; none when absent.
    pub level: Option<Text>,
    /// Names of demands and evidence, joined by `and`, `or` and `2 of (..)`; all of them when absent.
    pub when: Option<Text>,
    /// Two demands that are claimed to be redundant.
    pub redundant: Option<Vec<Text>>,
    /// Names and their bounds, such as `error` and `at most 0.5 m`.
    pub properties: Vec<(Text, Text)>,
}

/// A statement that is demanded of another party.
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

/// A problem of a draft, and its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// An error keeps the model from being used.
    pub severity: Severity,
    /// The piece of text with the problem.
    pub place: Place,
    /// The bytes of that text with the problem; all when `None`.
    pub span: Option<Range<usize>>,
    /// The problem, in one line.
    pub message: String,
    /// What to write instead.
    pub help: Option<String>,
}
