//! Models of systems as formulas, compiled once and differentiated exactly.

use crate::Error;
use crate::compiled::{Arguments, Compiled};
use crate::degree::is_linear;
use crate::dual::WIDTH;
use crate::matrix::{Matrix, put};
use crate::system::{Ensemble, System};
use shsa_core::expression::{
    Checked, Formula, Function, Kind, Scope, Shape, Symbol, check, parse_expression,
};

/// The names that formulas of a model may use: states first, then control inputs, then constants.
#[derive(Clone, Debug, Default)]
pub struct Vocabulary {
    names: Vec<(String, Kind)>,
}

impl Vocabulary {
    /// Adds a name; its symbol is its place.
    pub fn add(&mut self, name: impl Into<String>, kind: Kind) -> Symbol {
        self.names.push((name.into(), kind));
        Symbol(self.names.len() as u32 - 1)
    }

    /// Adds a scalar without a unit.
    pub fn add_number(&mut self, name: impl Into<String>) -> Symbol {
        self.add(name, Kind { shape: Shape::Scalar, unit: None, range: None, constant: None })
    }

    /// Parses and checks a formula.
    ///
    /// # Errors
    /// The text with its first problem.
    pub fn formula(&self, what: &str, text: &str) -> Result<Formula, Error> {
        let wrong = |reason: String| Error::Formula { what: what.to_owned(), reason };
        let expression =
            parse_expression(text).map_err(|problem| wrong(format!("`{text}`: {}", problem.message)))?;
        let Checked { formula, problems, .. } = check(&expression, self);
        let first = || problems.first().map_or_else(String::new, |problem| problem.message.clone());
        formula.ok_or_else(|| wrong(format!("`{text}`: {}", first())))
    }
}

impl Scope for Vocabulary {
    fn symbol(&self, name: &str) -> Option<Symbol> {
        let place = self.names.iter().position(|(known, _)| known == name)?;
        Some(Symbol(place as u32))
    }

    fn kind(&self, symbol: Symbol) -> Kind {
        let nothing = Kind { shape: Shape::Scalar, unit: None, range: None, constant: None };
        self.names.get(symbol.0 as usize).map_or(nothing, |(_, kind)| kind.clone())
    }

    fn function(&self, _: &str) -> Option<&Function> {
        None
    }

    fn names(&self) -> Vec<&str> {
        self.names.iter().map(|(name, _)| name.as_str()).collect()
    }

    fn function_names(&self) -> Vec<&str> {
        Vec::new()
    }
}

/// The measurement model of a sensor.
#[derive(Clone, Debug)]
pub struct Sensor {
    /// The name in messages.
    pub name: String,
    /// The expected value, over states and controls.
    pub formula: Formula,
    /// The variance of its noise, over states and controls.
    pub variance: Formula,
    /// The turn after which values repeat.
    pub turn: Option<f64>,
}

/// A model before it is compiled. States are the symbols from 0, controls follow them.
#[derive(Clone, Debug)]
pub struct Draft {
    /// The next value of each state, in the order of the states; over states, controls and `dt`.
    pub transition: Vec<Formula>,
    /// The number of control inputs.
    pub controls: usize,
    /// The covariance of the process noise after `dt`: the upper triangle, row by row.
    pub noise: Vec<Formula>,
    /// The sensors in declared order.
    pub sensors: Vec<Sensor>,
}

/// A system of compiled formulas.
#[derive(Clone, Debug)]
pub struct Formulas {
    states: usize,
    controls: usize,
    transition: Compiled,
    /// Whether the derivatives of the transition depend on `dt` alone.
    is_linear: bool,
    noise: Compiled,
    sensors: Vec<Measured>,
}

#[derive(Clone, Debug)]
struct Measured {
    formula: Compiled,
    variance: Compiled,
    turn: Option<f64>,
}

impl Formulas {
    /// Compiles a model.
    ///
    /// # Errors
    /// A formula that has a memory, is not a single number, or uses more than states and control inputs; a noise of a wrong size.
    /// Time: n log n in the size of the formulas.
    pub fn new(draft: Draft) -> Result<Formulas, Error> {
        let states = draft.transition.len();
        let count = states + draft.controls + 1;
        let wanted = states * (states + 1) / 2;
        if draft.noise.len() != wanted {
            return Err(Error::Size { what: "the process noise", found: draft.noise.len(), wanted });
        }
        let sensors = draft.sensors.into_iter().map(|sensor| {
            Ok(Measured {
                formula: Compiled::new(&sensor.name, vec![sensor.formula], count)?,
                variance: Compiled::new(&sensor.name, vec![sensor.variance], count)?,
                turn: sensor.turn,
            })
        });
        Ok(Formulas {
            states,
            controls: draft.controls,
            sensors: sensors.collect::<Result<_, Error>>()?,
            is_linear: draft.transition.iter().all(|it| is_linear(it, Symbol(count as u32 - 1))),
            transition: Compiled::new("the transition", draft.transition, count)?,
            noise: Compiled::new("the process noise", draft.noise, count)?,
        })
    }

    /// Whether the derivatives of the transition depend on `dt` alone.
    pub(crate) fn is_linear(&self) -> bool {
        self.is_linear
    }

    /// The arguments of formulas, for one state vector or many.
    fn arguments<'a>(&self, states: &'a [f64], controls: &'a [f64], dt: f64) -> Arguments<'a> {
        let (state_len, control_count) = (self.states, self.controls);
        let many = states.len() / state_len.max(1);
        Arguments { states, many, state_len, controls, control_count, dt }
    }
}

/// Copies numbers into a slice; absent ones become not-a-number.
fn fill(to: &mut [f64], from: impl Iterator<Item = f64>) {
    let from = from.chain(std::iter::repeat(f64::NAN));
    to.iter_mut().zip(from).for_each(|(to, from)| *to = from);
}

/// The only value of a formula; not-a-number where there is none.
fn only(found: &[f64]) -> f64 {
    found.first().copied().unwrap_or(f64::NAN)
}

impl System for Formulas {
    fn states(&self) -> usize {
        self.states
    }

    fn sensors(&self) -> usize {
        self.sensors.len()
    }

    fn transition(&mut self, from: &[f64], controls: &[f64], dt: f64, to: &mut [f64]) {
        let found = self.transition.evaluate(self.arguments(from, controls, dt));
        fill(to, found.iter().copied());
    }

    fn linearised(&mut self, from: &[f64], controls: &[f64], dt: f64, to: &mut [f64], jacobian: &mut Matrix) {
        let arguments = self.arguments(from, controls, dt);
        for first in (0..self.states).step_by(WIDTH) {
            let found = self.transition.differentiate(arguments, first);
            fill(to, found.iter().map(|dual| dual.value));
            for (row, dual) in found.iter().enumerate() {
                for (column, slope) in (first..self.states).zip(dual.slopes) {
                    put(jacobian, row, column, slope);
                }
            }
        }
    }

    fn noise(&mut self, from: &[f64], controls: &[f64], dt: f64, noise: &mut Matrix) {
        let n = self.states;
        let found = self.noise.evaluate(self.arguments(from, controls, dt));
        let places = (0..n).flat_map(|row| (row..n).map(move |column| (row, column)));
        for ((row, column), number) in places.zip(found) {
            put(noise, row, column, *number);
            put(noise, column, row, *number);
        }
    }

    fn expected(&mut self, sensor: usize, state: &[f64], controls: &[f64]) -> f64 {
        let arguments = self.arguments(state, controls, f64::NAN);
        let Some(measured) = self.sensors.get_mut(sensor) else { return f64::NAN };
        only(measured.formula.evaluate(arguments))
    }

    fn gradient(&mut self, sensor: usize, state: &[f64], controls: &[f64], gradient: &mut [f64]) -> f64 {
        let arguments = self.arguments(state, controls, f64::NAN);
        let Some(measured) = self.sensors.get_mut(sensor) else { return f64::NAN };
        let mut value = f64::NAN;
        for (chunk, part) in gradient.chunks_mut(WIDTH).enumerate() {
            let found = measured.formula.differentiate(arguments, chunk * WIDTH);
            let Some(dual) = found.first() else { return f64::NAN };
            fill(part, dual.slopes.into_iter());
            value = dual.value;
        }
        value
    }

    fn covariance(&mut self, one: usize, other: usize, state: &[f64], controls: &[f64]) -> f64 {
        if one != other {
            return 0.0;
        }
        let arguments = self.arguments(state, controls, f64::NAN);
        let Some(measured) = self.sensors.get_mut(one) else { return f64::NAN };
        only(measured.variance.evaluate(arguments))
    }

    fn is_independent(&self) -> bool {
        true
    }

    fn turn(&self, sensor: usize) -> Option<f64> {
        self.sensors.get(sensor)?.turn
    }
}

impl Ensemble for Formulas {
    fn transitions(&mut self, from: &Matrix, controls: &[f64], dt: f64, to: &mut Matrix) {
        let arguments = self.arguments(from.as_slice(), controls, dt);
        self.transition.evaluate_many(arguments, to.as_mut_slice());
    }

    fn expectations(&mut self, sensor: usize, states: &Matrix, controls: &[f64], to: &mut [f64]) {
        let arguments = self.arguments(states.as_slice(), controls, f64::NAN);
        match self.sensors.get_mut(sensor) {
            Some(measured) => measured.formula.evaluate_many(arguments, to),
            None => to.fill(f64::NAN),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn formulas(names: &[&str], texts: &[&str], measured: &str) -> Result<Formulas, Error> {
        let mut vocabulary = Vocabulary::default();
        for name in names {
            vocabulary.add_number(*name);
        }
        let n = texts.len();
        let formula = |text: &str| vocabulary.formula("a test", text);
        Formulas::new(Draft {
            transition: texts.iter().map(|text| formula(text)).collect::<Result<_, _>>()?,
            controls: names.len() - n,
            noise: vec![formula("dt")?; n * (n + 1) / 2],
            sensors: vec![Sensor {
                name: "z".into(),
                formula: formula(measured)?,
                variance: formula("2")?,
                turn: None,
            }],
        })
    }

    #[test]
    fn derivatives_of_a_transition_and_a_sensor() {
        let mut system = formulas(&["x", "v", "u"], &["x + v*dt", "v*u"], "x^2 + u").unwrap();
        let (mut to, mut jacobian) = ([0.0; 2], Matrix::zeros(2, 2));
        system.linearised(&[1.0, 2.0], &[3.0], 0.5, &mut to, &mut jacobian);
        assert_eq!(to, [2.0, 6.0]);
        assert_eq!(jacobian, Matrix::from_row_slice(2, 2, &[1.0, 0.5, 0.0, 3.0]));
        let mut gradient = [0.0; 2];
        assert_eq!(system.gradient(0, &[4.0, 2.0], &[3.0], &mut gradient), 19.0);
        assert_eq!(gradient, [8.0, 0.0]);
        assert_eq!(system.covariance(0, 0, &[4.0, 2.0], &[]), 2.0);
    }

    #[test]
    fn more_states_than_directions() {
        let names: Vec<String> = (0..11).map(|place| format!("x{place}")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let texts = [&names[1..], &names[..1]].concat();
        let mut system = formulas(&names, &texts, "x0*x10").unwrap();
        let state: Vec<f64> = (0..11).map(f64::from).collect();
        let (mut to, mut jacobian) = ([0.0; 11], Matrix::zeros(11, 11));
        system.linearised(&state, &[], 1.0, &mut to, &mut jacobian);
        for row in 0..11 {
            assert_eq!(to[row], ((row + 1) % 11) as f64);
            assert!(
                (0..11)
                    .all(|column| jacobian[(row, column)] == f64::from(u8::from(column == (row + 1) % 11)))
            );
        }
        let mut gradient = [0.0; 11];
        system.gradient(0, &state, &[], &mut gradient);
        assert_eq!((gradient[0], gradient[10]), (10.0, 0.0));
    }

    #[test]
    fn what_cannot_be_a_model_is_reported() {
        let error = formulas(&["x"], &["previous(x)"], "x").unwrap_err();
        assert_eq!(
            error.to_string(),
            "the formula of the transition remembers earlier values: make what it remembers a state"
        );
        assert!(formulas(&["x"], &["x + y"], "x").unwrap_err().to_string().contains("`y`"));
        assert!(formulas(&["x"], &["x > 1"], "x").is_err());
    }

    /// Formulas with and without branches, for a number of states that is no multiple of the lanes.
    #[test]
    fn an_ensemble_goes_on_as_each_of_its_states_does() {
        for transition in
            [["sqrt(x) + v*dt*u", "sin(v)/x"], ["if(x > 2, x*dt, v)", "min(x, v) + sqrt(v - 4)"]]
        {
            let mut system = formulas(&["x", "v", "u"], &transition, "x*v + u").unwrap();
            let from = Matrix::from_fn(37, 2, |place, state| 0.3 * place as f64 - 2.0 + 7.0 * state as f64);
            let (mut to, mut results) = (Matrix::zeros(37, 2), [0.0; 37]);
            system.transitions(&from, &[3.0], 0.5, &mut to);
            system.expectations(0, &from, &[3.0], &mut results);
            for (place, results) in results.iter().enumerate() {
                let (state, mut alone) = ([from[(place, 0)], from[(place, 1)]], [0.0; 2]);
                system.transition(&state, &[3.0], 0.5, &mut alone);
                let bits = alone.map(f64::to_bits);
                assert_eq!([to[(place, 0)], to[(place, 1)]].map(f64::to_bits), bits, "{state:?}");
                assert_eq!(*results, system.expected(0, &state, &[3.0]));
            }
        }
    }

    #[test]
    fn what_has_no_value_is_missing() {
        let mut system = formulas(&["x"], &["sqrt(x)"], "1/x").unwrap();
        let mut to = [0.0];
        system.transition(&[-1.0], &[], 1.0, &mut to);
        assert!(to[0].is_nan() && system.expected(0, &[0.0], &[]).is_nan());
    }
}
