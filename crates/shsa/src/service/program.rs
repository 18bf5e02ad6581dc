//! The program of a service: statements such as `y = x[0] + x[1]`, in the language of the models.

use shsa_core::expression::{
    Assignment, Equation, Expr, Formula, Function, InputKind, Kind, Node, Problem, Program, Scope, Severity,
    Shape, State, Symbol, Value, check, parse_equation,
};
use shsa_core::observation::RawValue;
use shsa_core::time::Validity;
use std::fmt::Write as _;

/// Vectors up to this length need no further allocation.
const USUAL_LENGTH: usize = 256;
/// The rate for which time operators are sized, in evaluations a second; at a higher rate they skip some.
const MOST_A_SECOND: f64 = 1_000.0;

/// A program of a service: one formula for each output.
#[derive(Debug)]
pub(super) struct Formulas(Vec<Output>);

#[derive(Debug)]
struct Output {
    program: Program,
    state: State<f64>,
    /// The last value, and its time.
    last: Option<(RawValue, Validity)>,
}

/// The names `x[0]`, `x[1]`.. and `y[0]`..; also `x` and `y` if there is only one. In the parsed text, underscores replace the
/// brackets, so that positions stay the same.
struct Names {
    inputs: usize,
    outputs: usize,
    vectors: Vec<usize>,
    /// The symbol and the assumed shape of the output being checked.
    own: (Symbol, Shape),
    names: Vec<String>,
}

impl Names {
    fn new(inputs: usize, outputs: usize, vectors: &[usize]) -> Names {
        let numbered = |letter: char, count: usize| (0..count).map(move |at| format!("{letter}_{at}_"));
        let names = numbered('x', inputs).chain(numbered('y', outputs)).collect();
        Names { inputs, outputs, vectors: vectors.to_vec(), own: (Symbol(0), Shape::Scalar), names }
    }
}

impl Scope for Names {
    fn symbol(&self, name: &str) -> Option<Symbol> {
        let at = match name {
            "x" if self.inputs == 1 => Some(0),
            "y" if self.outputs == 1 => Some(self.inputs),
            _ => self.names.iter().position(|known| known == name),
        };
        at.and_then(|at| u32::try_from(at).ok()).map(Symbol)
    }

    fn kind(&self, symbol: Symbol) -> Kind {
        let is_vector = self.vectors.contains(&(symbol.0 as usize)) || self.own == (symbol, Shape::Vector);
        let shape = if is_vector { Shape::Vector } else { Shape::Scalar };
        Kind { shape, unit: None, range: None, constant: None }
    }

    fn function(&self, _: &str) -> Option<&Function> {
        None
    }

    fn names(&self) -> Vec<&str> {
        self.names.iter().map(String::as_str).collect()
    }

    fn function_names(&self) -> Vec<&str> {
        Vec::new()
    }
}

impl Formulas {
    /// Reads statements, separated by `;` or a new line, one for each output. `vectors` are the numbers of the inputs that are
    /// lists.
    ///
    /// # Errors
    /// All errors, each with its position.
    pub(super) fn read(
        texts: &[String],
        inputs: usize,
        outputs: usize,
        vectors: &[usize],
    ) -> Result<Formulas, String> {
        let mut names = Names::new(inputs, outputs, vectors);
        let statements = texts.iter().flat_map(|text| text.split([';', '\n']));
        let statements: Vec<&str> = statements.filter(|text| !text.trim().is_empty()).collect();
        let mut found: Vec<Option<Output>> = (0..outputs).map(|_| None).collect();
        let mut problems = String::new();
        for text in &statements {
            match statement(text, &mut names) {
                Ok((at, output)) => match found.get_mut(at) {
                    Some(place @ None) => *place = Some(output),
                    _ => {
                        let twice = Problem::error(0..text.len(), "this output is computed already");
                        problems += &shown(text, &[twice]);
                    }
                },
                Err(wrong) => problems += &shown(text, &wrong),
            }
        }
        if problems.is_empty() {
            for (at, _) in found.iter().enumerate().filter(|(_, output)| output.is_none()) {
                let _ = writeln!(
                    problems,
                    "error: nothing computes y[{at}]\n  = help: add `-p \"y[{at}] = ..\"`"
                );
            }
        }
        if problems.is_empty() { Ok(Formulas(found.into_iter().flatten().collect())) } else { Err(problems) }
    }

    /// Evaluates all formulas on the latest values of the inputs, which may be missing; returns the values of the outputs.
    pub(super) fn evaluate(&mut self, inputs: &[Option<&RawValue>], at: Validity) -> Vec<Option<RawValue>> {
        self.0.iter_mut().map(|output| output.evaluate(inputs, at)).collect()
    }

    /// Forgets the past evaluations.
    pub(super) fn reset(&mut self) {
        for output in &mut self.0 {
            output.state.reset(&output.program);
            output.last = None;
        }
    }
}

impl Output {
    fn evaluate(&mut self, inputs: &[Option<&RawValue>], at: Validity) -> Option<RawValue> {
        let last = self.last.take();
        let given = |symbol: Symbol, kind: InputKind| match kind {
            InputKind::Previous => last.as_ref().map(|(value, _)| value),
            InputKind::Current => inputs.get(symbol.0 as usize).copied().flatten(),
        };
        let values = self.program.inputs().iter().map(|input| given(input.symbol, input.kind));
        let values: Vec<Value<'_, f64>> =
            values.map(|value| value.map_or(Value::Scalar(f64::NAN), plain)).collect();
        let longest =
            values.iter().map(|value| if let Value::Vector(list) = value { list.len() } else { 0 }).max();
        self.state.make_room(longest.unwrap_or(0));
        let previous_at = last.as_ref().map(|(_, at)| *at);
        let outcome = self.program.evaluate(&mut self.state, &values, at, previous_at);
        let value = match outcome.value {
            value if value.is_missing() => None,
            Value::Scalar(number) => Some(RawValue::Number(number)),
            Value::Vector(list) => Some(RawValue::Vector(list.to_vec())),
        };
        self.last = value.clone().map(|value| (value, at)).or(last);
        value
    }
}

/// A value for the programs; of an interval the midpoint.
fn plain(value: &RawValue) -> Value<'_, f64> {
    match value {
        RawValue::Number(number) => Value::Scalar(*number),
        RawValue::Interval { lo, hi } => Value::Scalar(lo.midpoint(*hi)),
        RawValue::Vector(list) => Value::Vector(list),
    }
}

/// One statement: the output that it computes, and its formula.
fn statement(text: &str, names: &mut Names) -> Result<(usize, Output), Vec<Problem>> {
    let Equation { lhs, rhs } = parse_equation(&flat(text)).map_err(|problem| vec![problem])?;
    let symbol = match &lhs.node {
        Node::Name(name) => names.symbol(name).filter(|symbol| symbol.0 as usize >= names.inputs),
        _ => None,
    };
    let Some(own) = symbol else {
        let known = (0..names.outputs).map(|at| format!("y[{at}]")).collect::<Vec<_>>().join(", ");
        let wrong = Problem::error(lhs.span, "this is no output of the service");
        return Err(vec![wrong.with_help(format!("an output stands before the `=`: {known}"))]);
    };
    let formula = formula(&rhs, own, names)?;
    let assignment = Assignment { symbol: own, formula: &formula, condition: None };
    let program = Program::compile(&[assignment]).map_err(|problem| vec![problem])?;
    let is_foreign = |symbol: Symbol| symbol.0 as usize >= names.inputs;
    let reads_output =
        program.inputs().iter().any(|input| input.kind == InputKind::Current && is_foreign(input.symbol));
    if reads_output {
        let wrong = Problem::error(rhs.span, "a formula reads inputs, and no outputs");
        return Err(vec![
            wrong.with_help("write out what it needs; `previous(y)` is what it gave last itself"),
        ]);
    }
    let state = program.new_state(USUAL_LENGTH, MOST_A_SECOND);
    Ok((own.0 as usize - names.inputs, Output { program, state, last: None }))
}

/// Checks a right side; a formula that reads its own previous value must have the shape of that value.
fn formula(rhs: &Expr, own: Symbol, names: &mut Names) -> Result<Formula, Vec<Problem>> {
    let mut problems = Vec::new();
    for shape in [Shape::Scalar, Shape::Vector] {
        names.own = (own, shape);
        let checked = check(rhs, names);
        problems = checked.problems;
        problems.retain(|problem| problem.severity == Severity::Error);
        match checked.formula {
            Some(formula) if formula.shape() == shape || !formula.previous_symbols().contains(&own) => {
                return Ok(formula);
            }
            Some(formula) => problems.push(Problem::error(
                rhs.span.clone(),
                format!("it would be a {:?} that goes on from another shape", formula.shape()),
            )),
            None => {}
        }
    }
    Err(problems)
}

/// `x[0]` as a name of the same length: `x_0_`.
fn flat(text: &str) -> String {
    let mut flat: Vec<u8> = text.bytes().collect();
    let is_word = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
    for at in 0..flat.len() {
        let is_start = matches!(flat.get(at), Some(b'x' | b'y'))
            && flat.get(at + 1) == Some(&b'[')
            && !at.checked_sub(1).and_then(|before| flat.get(before)).is_some_and(|byte| is_word(*byte));
        let digits = flat.iter().skip(at + 2).take_while(|byte| byte.is_ascii_digit()).count();
        let end = at + 2 + digits;
        if is_start && digits > 0 && flat.get(end) == Some(&b']') {
            flat[at + 1] = b'_';
            flat[end] = b'_';
        }
    }
    // Only brackets were replaced, so the text is still valid UTF-8.
    String::from_utf8(flat).unwrap_or_else(|_| text.to_owned())
}

/// Names as the user writes them.
fn bracketed(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(['x', 'y']) {
        let (before, from) = rest.split_at(at);
        let number =
            from.get(1..).and_then(|name| name.strip_prefix('_')).and_then(|name| name.split_once('_'));
        shown += before;
        match number {
            Some((digits, after))
                if !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit()) =>
            {
                let _ = write!(shown, "{}[{digits}]", &from[..1]);
                rest = after;
            }
            _ => {
                shown += &from[..1];
                rest = &from[1..];
            }
        }
    }
    shown + rest
}

/// Problems, shown under the text.
fn shown(text: &str, problems: &[Problem]) -> String {
    let mut quality = String::new();
    for problem in problems {
        let width = |range: std::ops::Range<usize>| text.get(range).map_or(1, |part| part.chars().count());
        let (from, to) = (problem.span.start.min(text.len()), problem.span.end.min(text.len()));
        let blank = " ".repeat(width(0..from));
        let mark = "^".repeat(width(from..to).max(1));
        let _ = writeln!(quality, "error: {}\n  | {text}\n  | {blank}{mark}", bracketed(&problem.message));
        if let Some(help) = &problem.help {
            let _ = writeln!(quality, "  = help: {}", bracketed(help));
        }
    }
    quality
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_core::time::Time;

    fn at(seconds: f64) -> Validity {
        let time = Time::from_seconds(seconds);
        Validity { from: time, to: time }
    }

    /// Checks the outputs for rows of inputs, one row a second.
    #[track_caller]
    fn check(texts: &[&str], outputs: usize, rows: &[&[f64]], expected: &str) {
        let texts: Vec<String> = texts.iter().map(|text| (*text).to_owned()).collect();
        let inputs = rows.first().map_or(0, |row| row.len());
        let found = match Formulas::read(&texts, inputs, outputs, &[]) {
            Ok(mut formulas) => {
                let shown = |value: Option<RawValue>| match value {
                    Some(RawValue::Number(number)) => format!("{number}"),
                    other => format!("{other:?}"),
                };
                let mut line = |(second, row): (usize, &&[f64])| {
                    let values: Vec<RawValue> = row.iter().map(|number| RawValue::Number(*number)).collect();
                    let values: Vec<Option<&RawValue>> = values.iter().map(Some).collect();
                    let given = formulas.evaluate(&values, at(second as f64));
                    given.into_iter().map(shown).collect::<Vec<_>>().join(" ")
                };
                rows.iter().enumerate().map(&mut line).collect::<Vec<_>>().join(", ")
            }
            Err(problems) => problems,
        };
        assert_eq!(found, expected);
    }

    #[test]
    fn formulas_are_computed() {
        check(&["y = x[0] + x[1]"], 1, &[&[1.0, 2.0], &[0.5, -1.0]], "3, -0.5");
        check(&["y = 2 * x"], 1, &[&[1.0], &[4.0]], "2, 8");
        check(&["y[1] = x[0] - x[1]; y[0] = max(x[0], x[1])"], 2, &[&[1.0, 2.0]], "2 -1");
        check(&["y = x[0] / x[1]"], 1, &[&[1.0, 0.0], &[1.0, 2.0]], "None, 0.5");
        check(&["y = max(x[0], 7)"], 1, &[&[f64::NAN], &[9.0]], "None, 9");
    }

    #[test]
    fn what_goes_on_from_before_has_a_memory() {
        check(&["y = x[0] - previous(x[0])"], 1, &[&[1.0], &[4.0], &[6.0]], "None, 3, 2");
    }

    #[test]
    fn what_is_wrong_is_reported_with_its_place() {
        let one: &[&[f64]] = &[&[1.0, 2.0]];
        check(
            &["y = x[0] + x[2]"],
            1,
            one,
            "error: `x[2]` is not defined\n  | y = x[0] + x[2]\n  |            ^^^^\n  = help: did you mean `x[0]`?\n",
        );
        check(
            &["z = x[0]"],
            1,
            one,
            "error: this is no output of the service\n  | z = x[0]\n  | ^\n  = help: an output stands before the `=`: y[0]\n",
        );
        check(&["y[0] = x[0]"], 2, one, "error: nothing computes y[1]\n  = help: add `-p \"y[1] = ..\"`\n");
        check(
            &["y[0] = x[0]; y[0] = x[1]; y[1] = x[1]"],
            2,
            one,
            "error: this output is computed already\n  |  y[0] = x[1]\n  | ^^^^^^^^^^^^\n",
        );
        check(
            &["y[0] = x[0]; y[1] = 2 * y[0]"],
            2,
            one,
            "error: a formula reads inputs, and no outputs\n  |  y[1] = 2 * y[0]\n  |         ^^^^^^^^\n  = help: write out what it needs; `previous(y)` is what it gave last itself\n",
        );
    }

    #[test]
    fn lists_are_inputs_and_outputs() {
        let texts = ["y[0] = min(x[0]); y[1] = x[0] * x[1]".to_owned()];
        let mut formulas = Formulas::read(&texts, 2, 2, &[0]).unwrap();
        let scan = RawValue::Vector((0..1_000).map(|at| 5.0 + f64::from(at)).collect());
        let given = formulas.evaluate(&[Some(&scan), Some(&RawValue::Number(2.0))], at(0.0));
        assert_eq!(given[0], Some(RawValue::Number(5.0)));
        let Some(RawValue::Vector(list)) = &given[1] else { panic!("{given:?}") };
        assert_eq!((list.len(), list[999]), (1_000, 2_008.0));
        let given = formulas.evaluate(&[None, Some(&RawValue::Number(2.0))], at(1.0));
        assert_eq!(given, [None, None]);
    }
}
