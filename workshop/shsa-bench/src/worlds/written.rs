//! A world as the text of a model.

use super::unit::{Dimension, TEMPERATURE, quantity, rate};
use super::world::{Need, Relation, Signal, Variable, World};
use std::f64::consts::TAU;

/// The names in a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Names {
    Plain,
    /// Others, whose alphabetical order is the reverse.
    Other,
}

/// The order of the entries of each section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Order {
    Written,
    Reverse,
}

impl Order {
    /// The lines of a section.
    fn of(self, lines: impl Iterator<Item = String>) -> String {
        let mut lines: Vec<String> = lines.collect();
        if self == Order::Reverse {
            lines.reverse();
        }
        lines.concat()
    }
}

impl Names {
    pub(super) fn variable(self, at: usize) -> String {
        match self {
            Names::Plain => format!("v{at}"),
            Names::Other => format!("quantity_{}", 999 - at),
        }
    }

    pub(super) fn signal(self, at: usize) -> String {
        match self {
            Names::Plain => format!("s{at}"),
            Names::Other => format!("/plant/{}/sensor", 999 - at),
        }
    }

    fn relation(self, at: usize) -> String {
        match self {
            Names::Plain => format!("r{at}"),
            Names::Other => format!("law {}", 999 - at),
        }
    }

    /// A text in which `$2` is a variable and `@2` a signal.
    fn filled(self, text: &str) -> String {
        let mut filled = String::new();
        let mut rest = text;
        while let Some(place) = rest.find(['$', '@']) {
            let (before, from) = rest.split_at(place);
            let digits: String = from[1..].chars().take_while(char::is_ascii_digit).collect();
            let at = digits.parse().unwrap_or(0);
            filled += before;
            filled += &if from.starts_with('$') { self.variable(at) } else { self.signal(at) };
            rest = &from[1 + digits.len()..];
        }
        filled + rest
    }
}

/// A difference of two values of SI.
fn difference(dimension: Dimension, si: f64) -> String {
    if dimension == TEMPERATURE { format!("{si:?} K") } else { quantity(dimension, si) }
}

fn seconds(seconds: f64) -> String {
    format!("{seconds:?} s")
}

/// `[low, high]` of texts.
fn bounds(low: &str, high: &str) -> String {
    format!("[\"{low}\", \"{high}\"]")
}

impl World {
    /// The model. Every number has its unit, so that other declared units change nothing else.
    pub(super) fn model(&self, names: Names, order: Order) -> String {
        let line = |name: &str, keys: &[String]| format!("  \"{name}\": {{ {} }}\n", keys.join(", "));
        let variables =
            self.variables.iter().enumerate().map(|(at, it)| line(&names.variable(at), &it.keys()));
        let mut text = format!("shsa: 1\nvariables:\n{}", order.of(variables));
        for section in ["constants", "functions", "specifications", "fusion"] {
            let entries = self.entries.iter().filter(|it| it.0 == section);
            text += &titled(section, &order.of(entries.map(|it| format!("  {}\n", names.filled(&it.1)))));
        }
        let relations = self.relations.iter().enumerate();
        let relations = relations.map(|(at, it)| line(&names.relation(at), &it.keys(self, names)));
        text += &titled("relations", &order.of(relations));
        let signals = self.signals.iter().enumerate();
        let signals =
            signals.map(|(at, it)| line(&names.signal(at), &it.keys(&self.variables[it.variable], names)));
        text += &titled("signals", &order.of(signals));
        let needs = self.needs.iter();
        let needs =
            needs.map(|it| line(&names.variable(it.variable), &it.keys(&self.variables[it.variable])));
        text + &titled("needs", &order.of(needs))
    }
}

/// A section, unless it is empty.
fn titled(title: &str, lines: &str) -> String {
    if lines.is_empty() { String::new() } else { format!("{title}:\n{lines}") }
}

impl Variable {
    fn keys(&self) -> Vec<String> {
        let mut keys = self.dimension[self.unit].key();
        if self.is_vector {
            keys.push("shape: vector".to_owned());
        }
        if let Some((lo, hi)) = self.range {
            keys.push(format!(
                "range: {}",
                bounds(&quantity(self.dimension, lo), &quantity(self.dimension, hi))
            ));
        }
        if let Some(turn) = self.wraps {
            keys.push(format!("wraps: \"{}\"", quantity(self.dimension, turn)));
        }
        if let Some(most) = self.max_rate {
            keys.push(format!("max_rate: \"{}\"", rate(self.dimension, most)));
        }
        keys
    }
}

impl Relation {
    fn keys(&self, world: &World, names: Names) -> Vec<String> {
        let mut keys = vec![format!("equation: \"{}\"", names.filled(&self.equation))];
        if !self.only_for.is_empty() {
            let all: Vec<String> = self.only_for.iter().map(|it| names.variable(*it)).collect();
            keys.push(format!("for: [{}]", all.join(", ")));
        }
        if let Some(when) = &self.when {
            keys.push(format!("when: \"{}\"", names.filled(when)));
        }
        if self.error > 0.0 {
            let dimension = world.variables[self.left].dimension;
            keys.push(format!("error: \"{}\"", difference(dimension, self.error)));
        }
        if let Some(learned) = self.learns {
            keys.push(format!("learn: {}", names.variable(learned)));
        }
        keys
    }
}

impl Signal {
    fn keys(&self, variable: &Variable, names: Names) -> Vec<String> {
        let dimension = variable.dimension;
        let mut keys = vec![format!("variable: {}", names.variable(self.variable))];
        keys.extend(dimension[self.unit].key());
        if let Some((scale, offset)) = self.scaling {
            // An offset counts in the unit of the signal.
            keys.push(format!("scale: {scale:?}, offset: {offset:?}"));
        }
        if self.declares_rate {
            keys.push(format!("rate: {:?} Hz", self.rate_hz));
        }
        if self.error != (0.0, 0.0) || self.share > 0.0 {
            keys.push(format!("value_error: {}", self.value_error(dimension)));
        }
        // A share of the value changes with it.
        if let Some((most, period)) = self.offset.filter(|_| self.share == 0.0) {
            let change = difference(dimension, self.error.1 - self.error.0 - 2.0 * most);
            let drift = difference(dimension, most * TAU / period);
            keys.push(format!("change_error: \"{change} + {drift}/s\""));
        }
        if let Some(noise) = self.noise {
            keys.push(format!("noise: \"{}\"", difference(dimension, noise)));
        }
        if self.time_error != (0.0, 0.0) {
            let (lo, hi) = self.time_error;
            keys.push(format!("time_error: {}", bounds(&seconds(lo), &seconds(hi))));
        }
        for (key, span) in [("delay", self.delay), ("mean_over", self.mean_over)] {
            if span != 0.0 {
                keys.push(format!("{key}: {}", seconds(span)));
            }
        }
        if self.dead_band > 0.0 {
            keys.push(format!("hold: \"{}\"", difference(dimension, self.dead_band)));
        } else if self.holds {
            keys.push("hold: true".to_owned());
        }
        if let Some((lo, hi)) = self.ends {
            let end = |si: f64| if si.is_finite() { quantity(dimension, si) } else { si.to_string() };
            keys.push(format!("saturates: {}", bounds(&end(lo), &end(hi))));
        }
        if let Some(of) = self.copies {
            keys.push(format!("derived_from: [{}]", names.signal(of)));
        }
        if !self.causes.is_empty() {
            let causes: Vec<String> = self.causes.iter().map(|it| format!("c{it}")).collect();
            keys.push(format!("shares: [{}]", causes.join(", ")));
        }
        if !self.keys.is_empty() {
            keys.push(self.keys.clone());
        }
        keys
    }

    fn value_error(&self, dimension: Dimension) -> String {
        let (lo, hi) = self.error;
        if self.share > 0.0 {
            format!("\"{} + {:?} %\"", difference(dimension, hi), 100.0 * self.share)
        } else if lo == -hi {
            format!("\"{}\"", difference(dimension, hi))
        } else {
            bounds(&difference(dimension, lo), &difference(dimension, hi))
        }
    }
}

impl Need {
    fn keys(&self, variable: &Variable) -> Vec<String> {
        let mut keys = vec![format!("max_age: {}", seconds(self.max_age))];
        if let Some(width) = self.max_width {
            keys.push(format!("max_width: \"{}\"", difference(variable.dimension, width)));
        }
        keys
    }
}
