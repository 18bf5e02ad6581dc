//! Relations as formulas of the model's language.

use crate::learning::shape::{Relation, Shape};
use crate::learning::signal::Signal;
use shsa_core::unit::{Dimension, Unit};

/// A factor this near to 1 is 1.
const NEARLY_ONE: f64 = 0.01;

/// The digits of a fitted number.
const DIGITS: i32 = 4;

/// The equation of a relation; `name` gives the name of a signal's variable.
///
/// The start of an integral is unknown, so an integral is written as its rate.
#[must_use]
pub fn formula(signals: &[Signal], relation: &Relation, name: &dyn Fn(usize) -> String) -> String {
    let writer = Writer { signals, name };
    let (target, numbers) = (relation.target, &*relation.numbers);
    let input = relation.inputs.first().copied().unwrap_or(target);
    let told = match (&relation.shape, numbers) {
        (Shape::Equal { lag_s }, [offset]) => {
            writer.line(target, &[(1.0, input, writer.delayed(input, *lag_s))], *offset)
        }
        (Shape::Line { lag_s }, [factor, offset]) => {
            writer.line(target, &[(*factor, input, writer.delayed(input, *lag_s))], *offset)
        }
        (Shape::Mean { window_s }, [factor, offset]) => {
            let mean = format!("moving_mean({}, {} s)", writer.amount(input), digits(*window_s));
            writer.line(target, &[(*factor, input, mean)], *offset)
        }
        (Shape::Polynomial(_), numbers) => writer.polynomial(target, input, numbers),
        (Shape::Saturated, [factor, offset, low, high]) => {
            let line = writer.line(target, &[(*factor, input, writer.amount(input))], *offset);
            format!("min(max({line}, {}), {})", writer.constant(target, *low), writer.constant(target, *high))
        }
        (Shape::Rate { window_s }, [factor]) => writer.rate(target, input, *factor, *window_s),
        (Shape::Integral, [factor, _]) => {
            let window_s = relation.window_s.unwrap_or(1.0);
            return format!("{} = {}", name(input), writer.rate(input, target, 1.0 / factor, window_s));
        }
        (Shape::Product(powers), [factor]) => writer.product(target, &relation.inputs, powers, *factor),
        (Shape::Sum, [factors @ .., offset]) => {
            let terms = relation.inputs.iter().zip(factors);
            let terms: Vec<_> =
                terms.map(|(input, factor)| (*factor, *input, writer.amount(*input))).collect();
            writer.line(target, &terms, *offset)
        }
        (Shape::Gears(levels), factors) => {
            let sources = vec![input; levels.len()];
            writer.selected(&relation.inputs, levels, &sources, factors)
        }
        (Shape::Modes(modes), factors) => {
            let levels: Vec<f64> = modes.iter().map(|it| it.level).collect();
            let sources: Vec<usize> = modes.iter().map(|it| relation.inputs[it.input]).collect();
            writer.selected(&relation.inputs, &levels, &sources, factors)
        }
        (Shape::Follower { tau_s }, [factor, offset]) => {
            let line = writer.line(target, &[(*factor, input, writer.amount(input))], *offset);
            let own = writer.amount(target).replace(&name(target), &format!("previous({})", name(target)));
            let share = format!("min(dt / ({} s), 1)", digits(*tau_s));
            format!("{own} + ({line} - {own}) * {share}")
        }
        (Shape::Largest, [offset]) => writer.of_two("max", target, &relation.inputs, *offset),
        (Shape::Smallest, [offset]) => writer.of_two("min", target, &relation.inputs, *offset),
        (Shape::Norm, factors) => {
            let terms: Vec<_> = factors.iter().copied().zip(relation.inputs.iter().copied()).collect();
            format!("sqrt({})", writer.squares(&terms))
        }
        (Shape::Terms(terms), [factors @ .., offset]) => {
            writer.terms(target, &relation.inputs, terms, factors, *offset)
        }
        _ => String::new(),
    };
    format!("{} = {told}", writer.amount(target))
}

struct Writer<'a> {
    signals: &'a [Signal],
    name: &'a dyn Fn(usize) -> String,
}

impl Writer<'_> {
    fn unit(&self, signal: usize) -> Option<&Unit> {
        self.signals[signal].unit.as_ref()
    }

    /// A variable as an amount: one with a conventional zero is counted from its zero.
    fn amount(&self, signal: usize) -> String {
        let name = (self.name)(signal);
        match self.unit(signal) {
            Some(unit) if unit.is_affine() => format!("({name} - 0 {unit})"),
            _ => name,
        }
    }

    fn delayed(&self, signal: usize, lag_s: f64) -> String {
        if lag_s == 0.0 {
            self.amount(signal)
        } else {
            format!("delay({}, {} s)", self.amount(signal), digits(lag_s))
        }
    }

    /// A number of a signal's kind in its own unit.
    fn constant(&self, signal: usize, value: f64) -> String {
        match self.unit(signal) {
            Some(unit) if unit.is_affine() => format!("{} K", digits(value)),
            Some(unit) if unit.dimension != Dimension::PLAIN || unit.scale != 1.0 => {
                format!("{} {unit}", digits(value / unit.scale))
            }
            _ => digits(value),
        }
    }

    /// A factor with the unit that converts the unit of its operand to that of the target.
    fn factor(&self, value: f64, target: usize, of: Option<Dimension>) -> String {
        let own = self.unit(target).map(|unit| unit.dimension);
        match own.zip(of).and_then(|(own, of)| own.over(of)) {
            Some(dimension) if dimension != Dimension::PLAIN => {
                format!("{} {}", digits(value), Unit::si(dimension).to_string().replace(' ', "*"))
            }
            _ => digits(value),
        }
    }

    fn dimension(&self, signal: usize) -> Option<Dimension> {
        self.unit(signal).map(|unit| unit.dimension)
    }

    /// A sum of terms with their factors, and an offset.
    fn line(&self, target: usize, terms: &[(f64, usize, String)], offset: f64) -> String {
        let mut text = String::new();
        for (factor, signal, term) in terms {
            let size = self.factor(factor.abs(), target, self.dimension(*signal));
            let term = if size == "1" { term.clone() } else { format!("{size} * {term}") };
            add(&mut text, *factor < 0.0, &term);
        }
        if offset != 0.0 {
            add(&mut text, offset < 0.0, &self.constant(target, offset.abs()));
        }
        text
    }

    fn polynomial(&self, target: usize, input: usize, numbers: &[f64]) -> String {
        let mut text = String::new();
        let x = self.amount(input);
        for (power, number) in numbers.iter().enumerate() {
            let of = self.dimension(input).and_then(|it| it.power(power as i8));
            let size = if power == 0 {
                self.constant(target, number.abs())
            } else {
                self.factor(number.abs(), target, of)
            };
            let term = match power {
                0 => size,
                1 => format!("{size} * {x}"),
                _ => format!("{size} * {x}^{power}"),
            };
            add(&mut text, *number < 0.0, &term);
        }
        text
    }

    fn rate(&self, target: usize, input: usize, factor: f64, window_s: f64) -> String {
        let rate = format!("derivative({}, {} s)", (self.name)(input), digits(window_s));
        let of = self.dimension(input).and_then(|it| it.over(Dimension::TIME));
        let size = self.factor(factor.abs(), target, of);
        let sign = if factor < 0.0 { "-" } else { "" };
        if size == "1" { format!("{sign}{rate}") } else { format!("{sign}{size} * {rate}") }
    }

    fn product(&self, target: usize, inputs: &[usize], powers: &[i8], factor: f64) -> String {
        let of = inputs.iter().zip(powers).try_fold(Dimension::PLAIN, |of, (input, power)| {
            of.times(self.dimension(*input)?.power(*power)?)
        });
        let size = self.factor(factor, target, of);
        let mut text = if size == "1" { String::new() } else { size };
        for (input, power) in inputs.iter().zip(powers) {
            let sign = if *power < 0 { " / " } else { " * " };
            let name = (self.name)(*input);
            let raised = if power.abs() == 1 { name } else { format!("{name}^{}", power.abs()) };
            text = match (text.is_empty(), *power < 0) {
                (true, false) => raised,
                (true, true) => format!("1 / {raised}"),
                (false, _) => format!("{text}{sign}{raised}"),
            };
        }
        text
    }

    /// Factors and sources that the last input selects.
    fn selected(&self, inputs: &[usize], levels: &[f64], sources: &[usize], factors: &[f64]) -> String {
        let Some(chooser) = inputs.last() else { return String::new() };
        let is_one_source = sources.windows(2).all(|pair| pair[0] == pair[1]);
        let told = |place: usize| {
            let factor = digits(factors[place]);
            let name = (self.name)(sources[place]);
            match (is_one_source, factor.as_str()) {
                (true, _) => factor,
                (false, "1") => name,
                (false, _) => format!("{factor} * {name}"),
            }
        };
        let Some(last) = levels.len().checked_sub(1) else { return String::new() };
        let mut text = told(last);
        for (place, pair) in levels.windows(2).enumerate().rev() {
            let between = self.constant(*chooser, 0.5 * (pair[0] + pair[1]));
            text = format!("if({} < {between}, {}, {text})", (self.name)(*chooser), told(place));
        }
        if is_one_source { format!("{text} * {}", (self.name)(sources[0])) } else { text }
    }

    fn of_two(&self, function: &str, target: usize, inputs: &[usize], offset: f64) -> String {
        let inputs: Vec<String> = inputs.iter().map(|it| self.amount(*it)).collect();
        let mut text = format!("{function}({})", inputs.join(", "));
        if offset != 0.0 {
            add(&mut text, offset < 0.0, &self.constant(target, offset.abs()));
        }
        text
    }

    fn squares(&self, terms: &[(f64, usize)]) -> String {
        let mut text = String::new();
        for (factor, input) in terms {
            let is_one = (factor.abs() - 1.0).abs() < NEARLY_ONE;
            let square = format!("{}^2", (self.name)(*input));
            let term = if is_one { square } else { format!("{} * {square}", digits(factor.abs())) };
            add(&mut text, *factor < 0.0, &term);
        }
        text
    }

    /// A sum of products of powers.
    fn terms(&self, target: usize, inputs: &[usize], terms: &[Vec<i8>], factors: &[f64], offset: f64) -> String {
        let mut text = String::new();
        for (powers, factor) in terms.iter().zip(factors) {
            let used = inputs.iter().zip(powers).filter(|(_, power)| **power != 0);
            let (signals, powers): (Vec<usize>, Vec<i8>) = used.map(|(signal, power)| (*signal, *power)).unzip();
            let term = match (&*signals, &*powers) {
                ([signal], [1]) => {
                    let size = self.factor(factor.abs(), target, self.dimension(*signal));
                    let amount = self.amount(*signal);
                    if size == "1" { amount } else { format!("{size} * {amount}") }
                }
                _ => self.product(target, &signals, &powers, factor.abs()),
            };
            add(&mut text, *factor < 0.0, &term);
        }
        if offset != 0.0 {
            add(&mut text, offset < 0.0, &self.constant(target, offset.abs()));
        }
        text
    }
}

fn add(text: &mut String, is_negative: bool, term: &str) {
    let sign = match (text.is_empty(), is_negative) {
        (true, true) => "-",
        (true, false) => "",
        (false, true) => " - ",
        (false, false) => " + ",
    };
    *text += &format!("{sign}{term}");
}

/// A number with its significant digits.
fn digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return "0".to_owned();
    }
    let size = value.abs().log10().floor() as i32;
    if (-5..9).contains(&size) {
        let places = (DIGITS - 1 - size).max(0) as usize;
        let text = format!("{value:.places$}");
        return if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        };
    }
    format!("{value:.3e}")
}
