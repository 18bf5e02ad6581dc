//! The keys of a model: the content of each section and how it is written.
//!
//! The reader and the schema use these tables, and so do the tests of the reference.

use shsa_core::knowledge::{
    Access, Aggregate, FusionMethod, INTEGRITY_LEVELS, ISOLATIONS, Policy, Shape, WhenUnsure,
};

/// A top-level section of a model.
#[derive(Clone, Copy, Debug)]
pub struct Section {
    /// The key of the section.
    pub name: &'static str,
    /// The content under the key.
    pub holds: Holds,
}

/// The kind of content of a section.
#[derive(Clone, Copy, Debug)]
pub enum Holds {
    /// The version of the model's shape.
    Version,
    /// Names with one value each.
    Values(Form),
    /// Names with a mapping of these keys each.
    Entries(&'static [Key], Short),
    /// A mapping of these keys, or a word in its place.
    Mapping(&'static [Key]),
}

/// The short form of the mapping of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Short {
    /// No short form.
    None,
    /// A text: the value of the first key.
    Text,
    /// A list of several mappings.
    List,
}

/// A key of a mapping.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// The key as it is written.
    pub name: &'static str,
    /// The form of the value.
    pub form: Form,
    /// The name of the value in messages.
    pub what: &'static str,
    /// An example of the value.
    pub example: &'static str,
}

/// The form of a value.
#[derive(Clone, Copy, Debug)]
pub enum Form {
    /// A word, a number, a quantity or a formula.
    Text,
    /// One of these words.
    Choice(fn() -> Vec<&'static str>),
    /// `true` or `false`, or a number or quantity.
    FlagOrText,
    /// One value, or a list of the lowest and the highest.
    Bounds,
    /// A list of the lowest and the highest.
    Pair,
    /// A list of names, or a single name.
    Names,
    /// Names with a number each.
    Numbers,
    /// A list of names, or names with a number each.
    Shares,
    /// Names with a mapping each: these keys, and bounds under names of the model.
    Statements(&'static [Key]),
    /// Names with a text each.
    Words,
    /// Names with a mapping of these keys each.
    Entries(&'static [Key], Short),
}

/// The sections of a model.
pub const SECTIONS: [Section; 12] = [
    Section { name: "shsa", holds: Holds::Version },
    Section { name: "variables", holds: Holds::Entries(&VARIABLE, Short::None) },
    Section { name: "constants", holds: Holds::Values(Form::Bounds) },
    Section { name: "functions", holds: Holds::Values(Form::Text) },
    Section { name: "relations", holds: Holds::Entries(&RELATION, Short::Text) },
    Section { name: "specifications", holds: Holds::Entries(&SPECIFICATION, Short::Text) },
    Section { name: "signals", holds: Holds::Entries(&SIGNAL, Short::None) },
    Section { name: "fusion", holds: Holds::Entries(&FUSION, Short::None) },
    Section { name: "needs", holds: Holds::Entries(&NEED, Short::List) },
    Section { name: "platform", holds: Holds::Entries(&PLATFORM, Short::None) },
    Section { name: "contracts", holds: Holds::Entries(&CONTRACT, Short::None) },
    Section { name: "utility", holds: Holds::Mapping(&UTILITY) },
];

const fn text(name: &'static str, what: &'static str, example: &'static str) -> Key {
    Key { name, form: Form::Text, what, example }
}

const fn span(name: &'static str) -> Key {
    text(name, "a time", "300 ms")
}

const fn names(name: &'static str, what: &'static str) -> Key {
    Key { name, form: Form::Names, what, example: "[speed, dmin]" }
}

const fn numbers(name: &'static str) -> Key {
    Key { name, form: Form::Numbers, what: "named numbers", example: "{ accuracy: 0.9 }" }
}

const fn formed(name: &'static str, form: Form, what: &'static str, example: &'static str) -> Key {
    Key { name, form, what, example }
}

/// The keys of a variable.
pub const VARIABLE: [Key; 6] = [
    text("unit", "a unit", "m/s"),
    formed(
        "shape",
        Form::Choice(|| Shape::NAMES.map(|(name, _)| name).into()),
        "`scalar` or `vector`",
        "vector",
    ),
    formed("range", Form::Pair, "the lowest and the highest value", "[-3, 3]"),
    text("max_rate", "a rate of change", "12 m/s^2"),
    text("wraps", "a turn", "360 deg"),
    numbers("properties"),
];

/// The keys of a relation.
pub const RELATION: [Key; 9] = [
    text("equation", "an equation", "dmin = min(distances)"),
    names("for", "the variables to solve for"),
    text("when", "a condition", "abs(speed) > 0.2"),
    formed("error", Form::Bounds, "an error or its bounds", "0.1"),
    names("learn", "variables that change slowly"),
    names("output", "the output"),
    names("outputs", "the outputs"),
    names("inputs", "the inputs"),
    numbers("properties"),
];

/// The keys of a temporal specification.
pub const SPECIFICATION: [Key; 6] = [
    text("always", "a condition", "level <= 4 m"),
    text("for", "a time", "5 s"),
    text("eventually", "a condition", "flow > 1 l/s"),
    text("within", "a time", "2 s"),
    text("when", "a condition", "valve > 50 %"),
    numbers("properties"),
];

/// The keys of a signal.
pub const SIGNAL: [Key; 26] = [
    text("variable", "a variable", "speed"),
    text("source", "a place", "scan#ranges"),
    text("unit", "a unit", "m"),
    text("scale", "a number", "0.01"),
    text("offset", "a number or a quantity", "-40 degC"),
    text("rate", "a frequency", "10 Hz"),
    formed("value_error", Form::Bounds, "an error or its lowest and highest value", "[-0.1, 0.2]"),
    text("change_error", "the error of a difference of two readings", "0.3 hPa + 1 hPa/h"),
    text("noise", "a standard deviation", "0.1"),
    formed("time_error", Form::Bounds, "a time or the lowest and the highest", "[-100 ms, 0 ms]"),
    span("delay"),
    span("mean_over"),
    span("timeout"),
    formed("range", Form::Pair, "the lowest and the highest reading", "[0, 5 V]"),
    formed(
        "saturates",
        Form::Pair,
        "the readings at which it only says that the value is beyond",
        "[-16, 16]",
    ),
    text("max_rate", "a rate of change", "12 m/s^2"),
    span("max_delay"),
    span("frozen_after"),
    text("rests_at", "a value", "0"),
    span("rests_for"),
    formed("counter", Form::FlagOrText, "`true` or `false`", "true"),
    formed("hold", Form::FlagOrText, "`true`, `false` or a dead band", "0.2 K"),
    formed(
        "access",
        Form::Choice(|| Access::NAMES.map(|(name, _)| name).into()),
        "`port`, `estimate` or `both`",
        "estimate",
    ),
    names("derived_from", "names of signals"),
    formed("shares", Form::Shares, "what it shares with other signals", "[imu], or shares: { imu: 0.001 }"),
    numbers("properties"),
];

/// The keys of a fusion.
pub const FUSION: [Key; 14] = [
    formed(
        "method",
        Form::Choice(|| FusionMethod::NAMES.map(|(name, _)| name).into()),
        "a method of fusion",
        "kalman",
    ),
    formed(
        "states",
        Form::Entries(&FUSION_STATE, Short::None),
        "what is estimated",
        "{ speed: { spread: 2 } }",
    ),
    formed("controls", Form::Words, "names in formulas, each with a signal", "{ acceleration: /imu }"),
    formed("inputs", Form::Entries(&FUSION_INPUT, Short::Text), "what is measured", "{ /gps: position }"),
    formed("outputs", Form::Entries(&FUSION_OUTPUT, Short::Text), "new signals", "{ fused/speed: speed }"),
    span("period"),
    span("horizon"),
    span("unknown_after"),
    text("gate", "a share, or `none`", "99.9 %"),
    formed("witnesses", Form::Choice(|| vec!["all", "none"]), "`all` or `none`", "none"),
    text("faulty", "a number of inputs", "1"),
    text("window", "a number of values", "5"),
    text("particles", "a number", "1000"),
    text("seed", "a number", "1"),
];

/// The keys of a state of a fusion.
pub const FUSION_STATE: [Key; 5] = [
    text("unit", "a unit", "m/s"),
    text("initial", "a value", "0"),
    text("spread", "a standard deviation", "10"),
    text("noise", "a standard deviation in a second, or a formula", "0.5"),
    text("transition", "a formula over states, controls and `dt`", "position + speed * dt"),
];

/// The keys of an input of a fusion.
pub const FUSION_INPUT: [Key; 2] = [
    text("measures", "a formula over states and controls", "speed"),
    text("noise", "a standard deviation, or a formula", "0.1"),
];

/// The keys of an output of a fusion.
pub const FUSION_OUTPUT: [Key; 4] = [
    text("value", "a formula over states and controls", "speed"),
    text("variable", "a variable", "speed"),
    text("confidence", "a share", "99 %"),
    numbers("properties"),
];

/// The keys of a need.
pub const NEED: [Key; 11] = [
    text("signal", "a name", "/healed/dmin"),
    span("max_age"),
    text("max_width", "a width", "0.5 m"),
    formed(
        "integrity",
        Form::Choice(|| INTEGRITY_LEVELS.map(|(name, _)| name).into()),
        "a level from A to D",
        "B",
    ),
    text("min_rate", "a frequency", "5 Hz"),
    formed(
        "when_unsure",
        Form::Choice(|| WhenUnsure::ALL.map(WhenUnsure::name).into()),
        "`hull`, `last` or `withhold`",
        "hull",
    ),
    span("hold"),
    span("probation"),
    span("blend"),
    text("hysteresis", "a share", "5 %"),
    formed(
        "isolation",
        Form::Choice(|| ISOLATIONS.map(|(name, _)| name).into()),
        "`engine` or `process`",
        "process",
    ),
];

const RUNS_ON: Key = text("runs_on", "a platform", "computer");
const GIVES: Key = formed(
    "gives",
    Form::Statements(&GIVEN),
    "what is guaranteed, the best first",
    "{ near: { error: at most 0.1 m, level: SIL 2, when: fresh } }",
);
const ASKS: Key = formed(
    "asks",
    Form::Statements(&ASKED),
    "what is demanded of others",
    "{ time: { of: platform, time: at least 2 ms, level: SIL 2 } }",
);
const EVIDENCE: Key =
    formed("evidence", Form::Words, "what is observed at run time", "{ fresh: age at most 300 ms }");

/// The keys of a platform, on which others run.
pub const PLATFORM: [Key; 4] = [RUNS_ON, GIVES, ASKS, EVIDENCE];

/// The keys of a contract.
pub const CONTRACT: [Key; 5] = [
    RUNS_ON,
    GIVES,
    ASKS,
    EVIDENCE,
    formed(
        "policy",
        Form::Choice(|| Policy::NAMES.map(|(name, _)| name).into()),
        "`stop`, `degrade` or `warn`",
        "stop",
    ),
];

/// The keys of a guarantee, beside its bounds.
pub const GIVEN: [Key; 4] = [
    text("of", "a variable", "speed"),
    text("level", "a level of a scale", "SIL 2"),
    text("when", "a condition", "fresh and (lidar or 2 of (a, b, c))"),
    formed("redundant", Form::Names, "two of what is asked", "[sonar, camera]"),
];

/// The keys of a demand, beside its bounds.
pub const ASKED: [Key; 2] = [
    text("of", "a variable, a signal, a platform, `platform`, `consumers` or `shsa`", "platform"),
    text("level", "a level of a scale", "SIL 2"),
];

/// The keys of a utility that the model defines.
pub const UTILITY: [Key; 5] = [
    formed(
        "aggregate",
        Form::Choice(|| Aggregate::NAMES.map(|(name, _)| name).into()),
        "`product`, `sum` or `minimum`",
        "product",
    ),
    text("relation", "a formula over properties of a relation", "1 / cost"),
    text("signal", "a formula over properties of a signal", "accuracy"),
    text("way", "a formula over the record of a way", "agreement * availability"),
    numbers("defaults"),
];
