//! The words of the formula language: its constants and functions.

/// Functions that a formula may call by name, besides those of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Builtin {
    Sqrt,
    Exp,
    Ln,
    Log10,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Atan2,
    Hypot,
    Abs,
    Floor,
    Root,
    If,
    Table,
    OneOf,
    Min,
    Max,
    Sum,
    Mean,
    Norm,
    Median,
    Count,
    Either,
    Within,
    PlusMinus,
    Interval,
    Previous,
    Derivative,
    Integral,
    Delay,
    MovingMean,
    Always,
    Once,
    Answered,
}

/// By name: the least and largest number of arguments, and the notation.
pub(super) const FUNCTIONS: [(&str, Builtin, usize, usize, &str); 37] = [
    ("sqrt", Builtin::Sqrt, 1, 1, "sqrt(x)"),
    ("exp", Builtin::Exp, 1, 1, "exp(x)"),
    ("ln", Builtin::Ln, 1, 1, "ln(x)"),
    ("log10", Builtin::Log10, 1, 1, "log10(x)"),
    ("sin", Builtin::Sin, 1, 1, "sin(angle)"),
    ("cos", Builtin::Cos, 1, 1, "cos(angle)"),
    ("tan", Builtin::Tan, 1, 1, "tan(angle)"),
    ("asin", Builtin::Asin, 1, 1, "asin(x)"),
    ("acos", Builtin::Acos, 1, 1, "acos(x)"),
    ("atan", Builtin::Atan, 1, 1, "atan(x)"),
    ("atan2", Builtin::Atan2, 2, 2, "atan2(y, x)"),
    ("hypot", Builtin::Hypot, 2, 2, "hypot(x, y)"),
    ("abs", Builtin::Abs, 1, 1, "abs(x)"),
    ("floor", Builtin::Floor, 1, 1, "floor(x)"),
    ("root", Builtin::Root, 2, 2, "root(x, 3)"),
    ("if", Builtin::If, 3, 3, "if(condition, then, else)"),
    ("table", Builtin::Table, 3, MANY, "table(x, [0, 1], [2, 5])"),
    ("one_of", Builtin::OneOf, 2, MOST_ALTERNATIVES, "one_of(x, y)"),
    ("min", Builtin::Min, 1, MANY, "min(vector) or min(x, y)"),
    ("max", Builtin::Max, 1, MANY, "max(vector) or max(x, y)"),
    ("sum", Builtin::Sum, 1, MANY, "sum(vector) or sum(x, y)"),
    ("mean", Builtin::Mean, 1, MANY, "mean(vector) or mean(x, y)"),
    ("norm", Builtin::Norm, 1, MANY, "norm(vector) or norm(x, y)"),
    ("median", Builtin::Median, 1, MANY, "median(vector) or median(x, y, z)"),
    ("count", Builtin::Count, 1, MANY, "count(vector)"),
    ("either", Builtin::Either, 1, MANY, "either(x, y)"),
    ("within", Builtin::Within, 3, 3, "within(x, least, greatest)"),
    ("plusminus", Builtin::PlusMinus, 1, 1, "plusminus(0.1 m)"),
    ("interval", Builtin::Interval, 2, 2, "interval(0.9, 1.1)"),
    ("previous", Builtin::Previous, 1, 1, "previous(x)"),
    ("derivative", Builtin::Derivative, 2, 2, "derivative(x, 0.5 s)"),
    ("integral", Builtin::Integral, 1, 1, "integral(x)"),
    ("delay", Builtin::Delay, 2, 2, "delay(x, 0.5 s)"),
    ("moving_mean", Builtin::MovingMean, 2, 2, "moving_mean(x, 0.5 s)"),
    ("always", Builtin::Always, 2, 2, "always(condition, 2 s)"),
    ("once", Builtin::Once, 2, 2, "once(condition, 2 s)"),
    ("answered", Builtin::Answered, 3, 3, "answered(trigger, response, 2 s)"),
];

const MANY: usize = 1_000;
/// The most values of which one holds.
pub(super) const MOST_ALTERNATIVES: usize = 16;

/// The functions of the language: each name and its notation.
pub fn functions() -> impl Iterator<Item = (&'static str, &'static str)> {
    FUNCTIONS.into_iter().map(|(name, .., usage)| (name, usage))
}

/// Words with a meaning besides the functions.
pub const WORDS: [&str; 7] = ["pi", "dt", "true", "false", "and", "or", "not"];

/// Whether a name has a meaning in formulas, so that no element of a model can have it.
#[must_use]
pub fn is_reserved(name: &str) -> bool {
    WORDS.contains(&name) || FUNCTIONS.iter().any(|(function, ..)| *function == name)
}
