//! Formulas: any text can be read, checked, solved, compiled and evaluated, and results of numbers lie within results of
//! intervals.

use shsa_core::expression::{
    Assignment, Constant, Formula, Function, Kind, Number, Operation, Program, Reduction, Scope, Shape,
    Symbol, Value, check, parse_equation, parse_expression, parse_function_head, parse_quantity, solve,
};
use shsa_core::interval::Interval;
use shsa_core::time::{Time, Validity};
use shsa_core::unit::Unit;
use std::sync::LazyLock;

/// Variables with their units; the last two are vectors, `k` is a constant, and `p` is never negative.
const NAMES: [&str; 8] = ["x", "y", "z", "a", "k", "p", "v", "w"];
const UNITS: [Option<&str>; 8] =
    [None, Some("m"), Some("s"), Some("rad"), Some("m"), Some("1"), None, Some("m")];

/// The number of elements of a vector.
const LENGTH: usize = 4;

/// The number of evaluations of a program, 10 ms apart.
const STEPS: usize = 4;

/// The numbers for a byte below 16.
const SPECIAL: [f64; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.1,
    -2.5,
    5e-324,
    -5e-324,
    f64::MIN_POSITIVE,
    1e-300,
    1e300,
    f64::MAX,
    f64::MIN,
    core::f64::consts::FRAC_PI_2,
    core::f64::consts::PI,
    1e17,
];

static UNITS_READ: LazyLock<Vec<Option<Unit>>> =
    LazyLock::new(|| UNITS.map(|unit| unit.and_then(|text| Unit::parse(text).ok())).to_vec());

static TWICE: LazyLock<Option<Function>> = LazyLock::new(|| {
    let (name, parameters) = parse_function_head("twice(b)").ok()?;
    Some(Function { name, parameters, body: parse_expression("b + b").ok()? })
});

struct Model;

impl Scope for Model {
    fn symbol(&self, name: &str) -> Option<Symbol> {
        NAMES.iter().position(|known| *known == name).map(|place| Symbol(place as u32))
    }

    fn kind(&self, symbol: Symbol) -> Kind {
        let place = symbol.0 as usize;
        let shape = if place < 6 { Shape::Scalar } else { Shape::Vector };
        let constant = (place == 4).then_some(Constant { value: 2.67, bounds: Interval::new(2.6, 2.7) });
        let range = (place == 5).then_some(Interval::new(0.0, 100.0));
        Kind { shape, unit: UNITS_READ.get(place).cloned().flatten(), range, constant }
    }

    fn function(&self, name: &str) -> Option<&Function> {
        TWICE.as_ref().filter(|function| function.name == name)
    }

    fn names(&self) -> Vec<&str> {
        NAMES.to_vec()
    }

    fn function_names(&self) -> Vec<&str> {
        vec!["twice"]
    }
}

/// The first line is a formula or an equation; the remaining bytes are the values of its inputs.
pub fn run(bytes: &[u8]) {
    let end = bytes.iter().position(|byte| *byte == b'\n').unwrap_or(bytes.len());
    let (text, values) = bytes.split_at(end);
    let text = String::from_utf8_lossy(text);
    let _ = parse_quantity(&text);
    let _ = parse_function_head(&text);
    match parse_expression(&text) {
        Ok(expression) => {
            let checked = check(&expression, &Model);
            for problem in &checked.problems {
                assert!(text.get(problem.span.clone()).is_some(), "no such place: {problem}");
            }
            checked.formula.iter().for_each(|formula| evaluate(formula, values));
        }
        Err(problem) => assert!(text.get(problem.span.clone()).is_some(), "no such place: {problem}"),
    }
    if let Ok(equation) = parse_equation(&text) {
        let solved =
            (0..NAMES.len()).filter_map(|wanted| solve(&equation, Symbol(wanted as u32), &Model).ok());
        solved.for_each(|formula| evaluate(&formula, values));
    }
}

/// Evaluates a formula over numbers and over intervals around them.
fn evaluate(formula: &Formula, values: &[u8]) {
    let assignment = Assignment { symbol: Symbol(99), formula, condition: None };
    let Ok(program) = Program::compile(&[assignment]) else { return };
    let (mut plain, mut wide) =
        (program.new_state::<f64>(LENGTH, 100.0), program.new_state::<Interval>(LENGTH, 100.0));
    let gaps = gaps(formula);
    for step in 0..STEPS {
        let numbers: Vec<f64> = (0..8 * LENGTH).map(|at| number(values, step * 8 * LENGTH + at)).collect();
        let intervals: Vec<Interval> =
            numbers.iter().enumerate().map(|(at, x)| around(*x, values, at)).collect();
        let at = Validity::at(Time(step as i64 * 10_000_000));
        let value = program.evaluate(&mut plain, &inputs(&program, &numbers), at, None).value;
        let bounds = program.evaluate(&mut wide, &inputs(&program, &intervals), at, None).value;
        if gaps == Gaps::Harmless {
            check_inclusion(&program, value, bounds, step);
        }
    }
}

/// The effect of a step without a value on the rest of a formula.
#[derive(Clone, Copy, PartialEq)]
enum Gaps {
    /// The formula has no value then.
    Harmless,
    /// The rest continues without the value. Numbers can overflow where intervals do not, so both may continue from different
    /// steps.
    PassedOver,
}

/// Whether a formula has parts that skip missing values.
fn gaps(formula: &Formula) -> Gaps {
    use Reduction::{Count, Either, Max, Mean, Median, Min};
    let passes = match formula.operation() {
        Operation::Reduce(Min | Max | Mean | Median | Count | Either) => {
            !formula.arguments().iter().all(|vector| matches!(vector.operation(), Operation::Symbol(_)))
        }
        Operation::Select
        | Operation::Index
        | Operation::Derivative(_)
        | Operation::MovingMean(_)
        | Operation::Integral
        | Operation::Delay(_)
        | Operation::Elapsed => true,
        _ => false,
    };
    let below = || formula.arguments().iter().any(|argument| gaps(argument) == Gaps::PassedOver);
    if passes || below() { Gaps::PassedOver } else { Gaps::Harmless }
}

fn check_inclusion(program: &Program, value: Value<'_, f64>, bounds: Value<'_, Interval>, step: usize) {
    let pairs: Vec<(f64, Interval)> = match (value, bounds) {
        (Value::Scalar(value), Value::Scalar(bounds)) => vec![(value, bounds)],
        (Value::Vector(values), Value::Vector(bounds)) => {
            values.iter().copied().zip(bounds.iter().copied()).collect()
        }
        _ => panic!("two shapes: {value:?}, {bounds:?}"),
    };
    for (value, bounds) in pairs {
        assert!(
            value.is_nan() || bounds.contains(value),
            "{value} is not in {bounds:?} at step {step}: {program:?}"
        );
    }
}

fn number(values: &[u8], at: usize) -> f64 {
    let byte = values.get(at % values.len().max(1)).copied().unwrap_or(144);
    SPECIAL.get(usize::from(byte)).copied().unwrap_or((f64::from(byte) - 128.0) / 8.0)
}

/// An interval around a number, of zero or positive width.
fn around(number: f64, values: &[u8], at: usize) -> Interval {
    let width = values.get(at % values.len().max(1)).copied().unwrap_or(0) % 3;
    Interval::point(number).widened(f64::from(width) * 0.25)
}

/// The inputs of a program; each variable has its own of the `numbers`.
fn inputs<'a, N: Number>(program: &Program, numbers: &'a [N]) -> Vec<Value<'a, N>> {
    let of = |symbol: Symbol| {
        let own = symbol.0 as usize * LENGTH;
        let own = numbers.get(own..own + LENGTH).unwrap_or(&[]);
        match Model.kind(symbol).shape {
            Shape::Vector => Value::Vector(own),
            _ => Value::Scalar(own.first().copied().unwrap_or(N::MISSING)),
        }
    };
    program.inputs().iter().map(|input| of(input.symbol)).collect()
}

/// A formula or equation for every operation.
#[must_use]
pub fn seeds() -> Vec<Vec<u8>> {
    let texts = [
        "sqrt(x^2 + y^2) / z",
        "x + twice(x) - x * 3 / -x + x^p",
        "min(v) + max(v) * mean(v) - sum(v) + norm(v) + median(v) + count(v)",
        "median(x, x, 1) + either(x, p)",
        "(2 * v + 1)[1..3]",
        "v[p] + w[0] / 1 m",
        "if(x < 1 and not (p >= 2 or x != 0), x, 2)",
        "x - previous(x) + dt / 1 s",
        "derivative(y, 20 ms) * z + y",
        "integral(x) / 1 s + delay(x, 10 ms) + moving_mean(y, 30 ms)",
        "sin(a) + cos(a) - tan(a) + asin(x) / 1 rad",
        "exp(x) + ln(p) + log10(p) + floor(x) + abs(x)",
        "hypot(y, k) + atan2(y, k) * 1 m / 1 rad",
        "root(x, 3) + x^-3 + x^0.5 + x^4",
        "y = k * sin(a) + 3 cm",
        "x^2 - 2 * p = ln(x + 1)",
        "w = [1 m, y, k, 0 m] + w",
        "y / z = derivative(y, 0.1 s) + 5 km/h",
        "table(x, [-3, 2], [-1, 1], [-1, 4], [2, 4]) + one_of(x, p, 2)",
        "x = table(p, [0, 1], [2, 5], [4, 2]) * one_of(2, 3)",
        "-40 degC",
        "twice(x, y)",
    ];
    texts.iter().map(|text| [text.as_bytes(), b"\n\x80\x88\x90\x01\x0b\x70"].concat()).collect()
}
