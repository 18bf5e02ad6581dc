//! Functions and constants of Python that our formulas also have.

use super::term::{Binding, Term};

/// The arguments of a call.
pub(super) struct Arguments {
    pub(super) terms: Vec<Term>,
    /// Whether the only argument is a name of a list of numbers, not a written list.
    pub(super) is_list: bool,
}

/// Python's names of functions of one number, and our names.
const OF_ONE: [(&str, &str); 16] = [
    ("sqrt", "sqrt"),
    ("exp", "exp"),
    ("log10", "log10"),
    ("sin", "sin"),
    ("cos", "cos"),
    ("tan", "tan"),
    ("asin", "asin"),
    ("arcsin", "asin"),
    ("acos", "acos"),
    ("arccos", "acos"),
    ("atan", "atan"),
    ("arctan", "atan"),
    ("abs", "abs"),
    ("fabs", "abs"),
    ("absolute", "abs"),
    ("floor", "floor"),
];

/// Functions that are expanded, or that do not take exactly one number.
const OTHERS: [&str; 16] = [
    "ceil", "log2", "radians", "deg2rad", "degrees", "rad2deg", "float", "log", "pow", "power", "square",
    "cbrt", "atan2", "arctan2", "hypot", "interval",
];

/// Functions of a list, or of several numbers.
const OF_MANY: [(&str, &str); 13] = [
    ("min", "min"),
    ("amin", "min"),
    ("minimum", "min"),
    ("max", "max"),
    ("amax", "max"),
    ("maximum", "max"),
    ("sum", "sum"),
    ("fsum", "sum"),
    ("mean", "mean"),
    ("average", "mean"),
    ("median", "median"),
    ("norm", "norm"),
    ("len", "count"),
];

/// Whether a function of one argument takes a list.
pub(super) fn takes_list(name: &str) -> bool {
    OF_MANY.iter().any(|(python, _)| *python == name)
}

/// A constant of Python or of its modules.
pub(super) fn constant(name: &str) -> Option<Term> {
    let text = match name {
        "True" | "true" => "true",
        "False" | "false" => "false",
        "pi" => "pi",
        "tau" => return Some(Term::new("2 * pi".to_owned(), Binding::Product)),
        "e" => "2.718281828459045",
        _ => return None,
    };
    Some(Term::atom(text.to_owned()))
}

/// A call of a function in our notation; with plain angles, radians are numbers without a unit.
///
/// # Errors
/// The problem in one line.
pub(super) fn call(name: &str, arguments: &Arguments, plain_angles: bool) -> Result<Term, String> {
    let terms = arguments.terms.as_slice();
    if let Some((_, ours)) = OF_MANY.iter().find(|(python, _)| *python == name) {
        return of_many(name, ours, arguments);
    }
    match (name, terms) {
        ("log", [of]) => Ok(Term::atom(format!("ln({})", of.text()))),
        ("log", [of, base]) => {
            Ok(Term::new(format!("ln({}) / ln({})", of.text(), base.text()), Binding::Product))
        }
        ("pow" | "power", [base, exponent]) => Ok(power(base, exponent)),
        ("square", [of]) => Ok(Term::new(format!("{}^2", of.at_least(Binding::Atom)), Binding::Power)),
        ("cbrt", [of]) => Ok(Term::atom(format!("root({}, 3)", of.text()))),
        ("atan2" | "arctan2", [y, x]) => {
            Ok(angle(format!("atan2({}, {})", y.text(), x.text()), plain_angles))
        }
        ("hypot", [x, y]) => Ok(Term::atom(format!("hypot({}, {})", x.text(), y.text()))),
        ("interval", [lo, hi]) => Ok(Term::atom(format!("interval({}, {})", lo.text(), hi.text()))),
        (_, [of]) => of_one(name, of, plain_angles),
        _ => Err(unknown(name, terms.len())),
    }
}

/// One term to the power of another; both languages associate to the right.
pub(super) fn power(base: &Term, exponent: &Term) -> Term {
    let text = format!("{}^{}", base.at_least(Binding::Atom), exponent.at_least(Binding::Sign));
    Term::new(text, Binding::Power)
}

/// A computed angle.
fn angle(text: String, plain: bool) -> Term {
    if plain { Term::new(format!("{text} / 1 rad"), Binding::Product) } else { Term::atom(text) }
}

fn of_one(name: &str, of: &Term, plain_angles: bool) -> Result<Term, String> {
    let scaled = |by: &str| Term::new(format!("{} * {by}", of.at_least(Binding::Product)), Binding::Product);
    let ours = OF_ONE.iter().find(|(python, _)| *python == name).map(|(_, ours)| *ours);
    Ok(match name {
        "ceil" => Term::new(format!("-floor(-{})", of.at_least(Binding::Power)), Binding::Sign),
        "log2" => Term::new(format!("ln({}) / ln(2)", of.text()), Binding::Product),
        "radians" | "deg2rad" => scaled("pi / 180"),
        "degrees" | "rad2deg" => scaled("180 / pi"),
        "float" => of.clone(),
        _ => match ours.ok_or_else(|| unknown(name, 1))? {
            ours @ ("sin" | "cos" | "tan") if plain_angles => {
                Term::atom(format!("{ours}({} * 1 rad)", of.at_least(Binding::Product)))
            }
            ours @ ("asin" | "acos" | "atan") => angle(format!("{ours}({})", of.text()), plain_angles),
            ours => Term::atom(format!("{ours}({})", of.text())),
        },
    })
}

fn of_many(name: &str, ours: &str, arguments: &Arguments) -> Result<Term, String> {
    let terms = arguments.terms.as_slice();
    if terms.is_empty() {
        return Err(format!("`{name}` of nothing"));
    }
    // of a list of one number that was written out, the number
    if let ([of], false, true) = (terms, arguments.is_list, ours != "count") {
        return Ok(of.clone());
    }
    let list: Vec<&str> = terms.iter().map(Term::text).collect();
    Ok(Term::atom(format!("{ours}({})", list.join(", "))))
}

fn unknown(name: &str, count: usize) -> String {
    let known =
        OF_ONE.iter().chain(&OF_MANY).map(|(python, _)| *python).chain(OTHERS).any(|known| known == name);
    if known {
        return format!("`{name}` with {count} arguments can not be taken over");
    }
    format!("the function `{name}` is not known here")
}
