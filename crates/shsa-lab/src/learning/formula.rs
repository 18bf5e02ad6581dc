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
    let input = relation.inputs.first().copied().unwrap_or(relation.target);
    if let (Shape::Integral, [factor, _]) = (&relation.shape, &*relation.numbers) {
        let window_s = relation.window_s.unwrap_or(1.0);
        return format!("{} = {}", name(input), writer.rate(input, relation.target, 1.0 / factor, window_s));
    }
    let predicted = writer.of_one(relation, input).unwrap_or_else(|| writer.of_more(relation, input));
    format!("{} = {predicted}", writer.amount(relation.target))
}

struct Writer<'a> {
    signals: &'a [Signal],
    name: &'a dyn Fn(usize) -> String,
}

impl Writer<'_> {
    /// The right side of a relation with one input; `None` for other forms.
    fn of_one(&self, relation: &Relation, input: usize) -> Option<String> {
        let target = relation.target;
        let line =
            |factor: f64, term: String, offset: f64| self.line(target, &[(factor, input, term)], offset);
        Some(match (&relation.shape, &*relation.numbers) {
            (Shape::Equal { lag_s }, [offset]) => line(1.0, self.delayed(input, *lag_s), *offset),
            (Shape::Line { lag_s }, [factor, offset]) => line(*factor, self.delayed(input, *lag_s), *offset),
            (Shape::Mean { window_s }, [factor, offset]) => {
                let mean = format!("moving_mean({}, {} s)", self.amount(input), digits(*window_s));
                line(*factor, mean, *offset)
            }
            (Shape::Polynomial(_), numbers) => self.polynomial(target, input, numbers),
            (Shape::Saturated, [factor, offset, low, high]) => {
                let line = line(*factor, self.amount(input), *offset);
                self.limited(target, line, *low, *high)
            }
            (Shape::Rate { window_s }, [factor]) => self.rate(target, input, *factor, *window_s),
            (Shape::Rate { window_s }, [factor, offset]) => {
                let mut text = self.rate(target, input, *factor, *window_s);
                add(&mut text, *offset < 0.0, &self.constant(target, offset.abs()));
                text
            }
            (Shape::Power(power), [factor]) => {
                let whole = (power.fract() == 0.0).then_some(*power as i8);
                let of = whole.and_then(|whole| self.dimension(input)?.power(whole));
                let size = self.factor(*factor, target, of);
                format!("{size} * {}^{}", (self.name)(input), digits(*power))
            }
            (Shape::Absolute, [factor, offset]) => {
                line(*factor, format!("abs({})", self.amount(input)), *offset)
            }
            (Shape::Follower { tau_s }, [factor, offset]) => {
                let line = line(*factor, self.amount(input), *offset);
                let name = (self.name)(target);
                let own = self.amount(target).replace(&name, &format!("previous({name})"));
                format!("{own} + ({line} - {own}) * min(dt / ({} s), 1)", digits(*tau_s))
            }
            _ => return None,
        })
    }

    /// The right side of a relation with several inputs.
    fn of_more(&self, relation: &Relation, input: usize) -> String {
        let (target, inputs) = (relation.target, &*relation.inputs);
        match (&relation.shape, &*relation.numbers) {
            (Shape::Product(powers), [factor]) => self.product(target, inputs, powers, *factor),
            (Shape::Sum, [factors @ .., offset]) => {
                let terms = inputs.iter().zip(factors);
                let terms: Vec<_> =
                    terms.map(|(input, factor)| (*factor, *input, self.amount(*input))).collect();
                self.line(target, &terms, *offset)
            }
            (Shape::Gears(levels), factors) => {
                self.selected(inputs, levels, &vec![input; levels.len()], factors)
            }
            (Shape::Modes(modes), factors) => {
                let levels: Vec<f64> = modes.iter().map(|it| it.level).collect();
                let sources: Vec<usize> = modes.iter().map(|it| inputs[it.input]).collect();
                self.selected(inputs, &levels, &sources, factors)
            }
            (Shape::Projected { is_sine }, [factor]) => {
                let function = if *is_sine { "sin" } else { "cos" };
                let angle = inputs.get(1).map_or_else(String::new, |it| (self.name)(*it));
                let product = format!("{} * {function}({angle})", (self.name)(input));
                let size = self.factor(factor.abs(), target, self.dimension(input));
                let sign = if *factor < 0.0 { "-" } else { "" };
                if size == "1" { format!("{sign}{product}") } else { format!("{sign}{size} * {product}") }
            }
            (Shape::Table(arguments), numbers) => self.table(target, inputs, arguments, numbers),
            (Shape::Largest, [offset]) => self.of_two("max", target, inputs, *offset),
            (Shape::Smallest, [offset]) => self.of_two("min", target, inputs, *offset),
            (Shape::Norm, factors) => {
                let terms: Vec<_> = factors.iter().copied().zip(inputs.iter().copied()).collect();
                format!("sqrt({})", self.squares(&terms))
            }
            (Shape::Terms(terms), [factors @ .., offset]) => {
                self.terms(target, inputs, terms, factors, *offset)
            }
            _ => String::new(),
        }
    }

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

    /// An expression within limits; an infinite one is none.
    fn limited(&self, target: usize, line: String, low: f64, high: f64) -> String {
        let from_below =
            if low.is_finite() { format!("max({line}, {})", self.constant(target, low)) } else { line };
        if high.is_finite() {
            format!("min({from_below}, {})", self.constant(target, high))
        } else {
            from_below
        }
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
        let predicted = |place: usize| {
            let factor = digits(factors[place]);
            let name = (self.name)(sources[place]);
            match (is_one_source, factor.as_str()) {
                (true, _) => factor,
                (false, "1") => name,
                (false, _) => format!("{factor} * {name}"),
            }
        };
        let Some(last) = levels.len().checked_sub(1) else { return String::new() };
        let mut text = predicted(last);
        for (place, pair) in levels.windows(2).enumerate().rev() {
            let between = self.constant(*chooser, 0.5 * (pair[0] + pair[1]));
            text = format!("if({} < {between}, {}, {text})", (self.name)(*chooser), predicted(place));
        }
        if is_one_source { format!("{text} * {}", (self.name)(sources[0])) } else { text }
    }

    /// A table of a curve, and what a second input adds. The outer lines go on for a part of the width that was seen, as a table has no
    /// value beyond its points.
    fn table(&self, target: usize, inputs: &[usize], arguments: &[f64], numbers: &[f64]) -> String {
        let [input, loads @ ..] = inputs else { return String::new() };
        let points = continued(arguments, numbers);
        let point = |(at, value): &(f64, f64)| {
            format!("[{}, {}]", self.constant(*input, *at), self.constant(target, *value))
        };
        let points: Vec<String> = points.iter().map(point).collect();
        let mut text = format!("table({}, {})", self.amount(*input), points.join(", "));
        for (load, factor) in loads.iter().zip(numbers.iter().skip(arguments.len())) {
            let size = self.factor(factor.abs(), target, self.dimension(*load));
            let amount = self.amount(*load);
            let term = if size == "1" { amount } else { format!("{size} * {amount}") };
            add(&mut text, *factor < 0.0, &term);
        }
        text
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
    fn terms(
        &self,
        target: usize,
        inputs: &[usize],
        terms: &[Vec<i8>],
        factors: &[f64],
        offset: f64,
    ) -> String {
        let mut text = String::new();
        for (powers, factor) in terms.iter().zip(factors) {
            let used = inputs.iter().zip(powers).filter(|(_, power)| **power != 0);
            let (signals, powers): (Vec<usize>, Vec<i8>) =
                used.map(|(signal, power)| (*signal, *power)).unzip();
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

/// The points of a table, the outer ones moved outward on their lines.
fn continued(arguments: &[f64], values: &[f64]) -> Vec<(f64, f64)> {
    /// How far, as a share of the width.
    const BEYOND: f64 = 0.2;
    let mut points: Vec<(f64, f64)> = arguments.iter().copied().zip(values.iter().copied()).collect();
    let [first, second, .., before, last] = points.as_mut_slice() else { return points };
    let beyond = BEYOND * (last.0 - first.0);
    let at = |one: (f64, f64), other: (f64, f64), argument: f64| {
        let slope = (other.1 - one.1) / (other.0 - one.0);
        (argument, one.1 + slope * (argument - one.0))
    };
    let ends = [at(*first, *second, first.0 - beyond), at(*before, *last, last.0 + beyond)];
    [*first, *last] = ends;
    points
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
