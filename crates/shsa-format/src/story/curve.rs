//! A formula of time: the true value of a quantity, or the reading of a sensor, at each moment of a story.

use shsa_core::expression::{
    self, Assignment, Formula, Kind, Problem, Program, Scope, Shape, Symbol, Value, check, parse_expression,
};
use shsa_core::knowledge::{Diagnostic, Text};
use shsa_core::time::{Time, Validity};
use shsa_core::unit::{Dimension, Unit};
use shsa_model::reader::Reader;

/// The symbol of the time since the begin of the story, in seconds.
const TIME: (&str, Symbol) = ("t", Symbol(0));
/// The symbol of the result.
const RESULT: Symbol = Symbol(u32::MAX);

/// A formula of time that can be evaluated.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    program: Program,
    /// `None` for a plain number, which takes the unit that is asked for.
    dimension: Option<Dimension>,
}

impl Curve {
    /// The values in a unit, by the time since the begin of the story.
    pub(super) fn values(&self, unit: Option<Unit>) -> impl FnMut(Time) -> f64 + use<> {
        let Curve { program, dimension } = self.clone();
        let mut state = program.new_state::<f64>(0, 0.0);
        move |time| {
            let inputs = [Value::Scalar(time.seconds())];
            let value = program.evaluate(&mut state, &inputs, Validity::at(time), None).value.scalar();
            match &unit {
                Some(unit) if dimension.is_some() => unit.from_si(value),
                _ => value,
            }
        }
    }
}

/// The names that formulas of a story may use: `t`, and the earlier definitions.
#[derive(Debug, Default)]
pub(super) struct Definitions {
    names: Vec<(String, Option<Dimension>, Formula)>,
}

impl Definitions {
    /// Defines `name` as this formula; a wrong formula is reported and not defined.
    pub(super) fn define(&mut self, reader: &mut Reader, name: &Text, text: &Text) -> Option<Curve> {
        if self.symbol(&name.text).is_some() || expression::is_reserved(&name.text) {
            reader.note(name.place, &format!("`{}` has a meaning already", name.text), "take another name");
            return None;
        }
        let (formula, dimension) = self.formula(reader, text)?;
        let curve = Curve { program: compile(reader, text, &formula)?, dimension: counted(dimension) };
        self.names.push((name.text.clone(), dimension, formula));
        Some(curve)
    }

    /// Reads a formula with a value in `unit` at every time; a plain number takes this unit.
    pub(super) fn curve(&self, reader: &mut Reader, text: &Text, unit: Option<&Unit>) -> Option<Curve> {
        let (formula, dimension) = self.formula(reader, text)?;
        let dimension = counted(dimension);
        if let (Some(own), Some(unit)) = (dimension, unit)
            && own != unit.dimension
        {
            let help = format!("write a number, which counts in `{unit}`, or give the formula its unit");
            reader.note(
                text.place,
                &format!("this formula does not count in `{unit}` but in `{own}`"),
                &help,
            );
            return None;
        }
        Some(Curve { program: compile(reader, text, &formula)?, dimension })
    }

    fn formula(&self, reader: &mut Reader, text: &Text) -> Option<(Formula, Option<Dimension>)> {
        let expression =
            parse_expression(&text.text).map_err(|problem| report(reader, text, problem)).ok()?;
        let checked = check(&expression, self);
        checked.problems.into_iter().for_each(|problem| report(reader, text, problem));
        let formula = checked.formula?;
        if formula.is_stateful() || formula.shape() != Shape::Scalar {
            let message = "a formula of time gives one number and remembers nothing";
            reader.note(
                text.place,
                message,
                "write the value as a formula of `t`, such as `20 + 0.5 * sin(t * 1 rad/s)`",
            );
            return None;
        }
        let definitions: Vec<(Symbol, &Formula)> =
            self.names.iter().enumerate().map(|(at, (_, _, formula))| (symbol(at), formula)).collect();
        Some((formula.inline(&definitions), checked.dimension))
    }
}

impl Scope for Definitions {
    fn symbol(&self, name: &str) -> Option<Symbol> {
        let defined = || self.names.iter().position(|(known, ..)| known == name).map(symbol);
        if name == TIME.0 { Some(TIME.1) } else { defined() }
    }

    fn kind(&self, wanted: Symbol) -> Kind {
        let defined = self.names.iter().enumerate().find(|(at, _)| symbol(*at) == wanted);
        let dimension = defined.map_or(Some(Dimension::TIME), |(_, (_, dimension, _))| *dimension);
        Kind { shape: Shape::Scalar, unit: dimension.map(Unit::si), range: None, constant: None }
    }

    fn function(&self, _name: &str) -> Option<&expression::Function> {
        None
    }

    fn names(&self) -> Vec<&str> {
        self.names.iter().map(|(name, ..)| name.as_str()).chain([TIME.0]).collect()
    }

    fn function_names(&self) -> Vec<&str> {
        Vec::new()
    }
}

/// A plain number takes the unit that is asked for.
fn counted(dimension: Option<Dimension>) -> Option<Dimension> {
    dimension.filter(|dimension| *dimension != Dimension::PLAIN)
}

/// The symbol of a definition; 0 is time.
fn symbol(at: usize) -> Symbol {
    Symbol(u32::try_from(at + 1).unwrap_or(u32::MAX - 1))
}

fn compile(reader: &mut Reader, text: &Text, formula: &Formula) -> Option<Program> {
    let assignment = Assignment { symbol: RESULT, formula, condition: None };
    Program::compile(&[assignment]).map_err(|problem| report(reader, text, problem)).ok()
}

fn report(reader: &mut Reader, text: &Text, problem: Problem) {
    let Problem { severity, span, message, help } = problem;
    reader.problems.push(Diagnostic { severity, place: text.place, span: Some(span), message, help });
}
