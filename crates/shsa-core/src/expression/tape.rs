//! A formula as a list of steps on numbers, gone through forwards for its value and backwards for its derivatives.
//!
//! Interval arithmetic takes each use of a variable for a variable of its own, so that `a + s * (b - a)` is wider than it can be.
//! A tape is made of formulas in which this can happen: where something occurs more than once. Its leaves are variables,
//! uncertain constants, and terms that a tape cannot go through, each of which counts as one number.

use super::formula::Formula;
use super::number::Number;
use super::operation::{Binary, Constant, Operation, Unary};
use super::slope::{of_one, of_two};
use crate::interval::Interval;
use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;

/// Formulas with more steps are not examined: each sweep goes through all of them.
const MOST_STEPS: usize = 200;

const ZERO: Interval = Interval::new(0.0, 0.0);

#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    /// The leaf of this number.
    Leaf(u32),
    Constant(Interval),
    Unary(Unary, u32),
    Binary(Binary, u32, u32),
}

/// Where the interval of a leaf is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Origin {
    /// The scalar register of this number.
    Register(u32),
    /// A constant between these bounds, in one place.
    Bounds(Interval),
}

/// What is known of a leaf at compile time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Leaf {
    pub(super) origin: Origin,
    /// Whether it is used in several places, so that interval arithmetic may overestimate.
    pub(super) is_repeated: bool,
    /// Whether the value is linear in it while all other leaves stay, so that its extremes lie at its bounds.
    pub(super) is_linear: bool,
}

/// The steps of a formula; the last one is its value.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tape {
    steps: Vec<Step>,
    leaves: Vec<Leaf>,
}

impl Tape {
    /// The tape of a formula; `None` where each leaf occurs once, as interval arithmetic is exact there, and for formulas that are
    /// no number or too large. `register` computes a term as one number. Complexity: O(n log n) for n nodes, and O(n) for each of at
    /// most [`MOST_STEPS`] leaves.
    pub(super) fn of<E>(
        formula: &Formula,
        register: &mut dyn FnMut(&Formula) -> Result<Option<u32>, E>,
    ) -> Result<Option<Tape>, E> {
        let mut builder = Builder { steps: Vec::new(), leaves: Vec::new(), known: BTreeMap::new(), register };
        if builder.step(formula)?.is_none() {
            return Ok(None);
        }
        let mut tape = Tape { steps: builder.steps, leaves: Vec::new() };
        let uses = tape.uses();
        tape.leaves = builder
            .leaves
            .into_iter()
            .map(|origin| Leaf { origin, is_repeated: false, is_linear: false })
            .collect();
        for at in 0..tape.leaves.len() {
            let (is_repeated, is_linear) =
                (uses.get(at).is_some_and(|uses| *uses > 1), tape.is_linear(at as u32));
            if let Some(leaf) = tape.leaves.get_mut(at) {
                (leaf.is_repeated, leaf.is_linear) = (is_repeated, is_linear);
            }
        }
        Ok(tape.leaves.iter().any(|leaf| leaf.is_repeated).then_some(tape))
    }

    /// What the formula is made of.
    pub(super) fn leaves(&self) -> &[Leaf] {
        &self.leaves
    }

    /// The number of steps.
    pub(super) fn len(&self) -> usize {
        self.steps.len()
    }

    /// For each leaf, in how many ways its value reaches the formula's.
    fn uses(&self) -> Vec<u32> {
        let mut paths = vec![0_u32; self.steps.len()];
        let mut uses = Vec::new();
        if let Some(last) = paths.last_mut() {
            *last = 1;
        }
        for (at, step) in self.steps.iter().enumerate().rev() {
            let own = paths.get(at).copied().unwrap_or(0);
            let mut add = |to: u32| {
                if let Some(paths) = paths.get_mut(to as usize) {
                    *paths = paths.saturating_add(own);
                }
            };
            match step {
                Step::Leaf(leaf) => {
                    uses.resize(uses.len().max(*leaf as usize + 1), 0);
                    uses.get_mut(*leaf as usize).into_iter().for_each(|uses| *uses = own);
                }
                Step::Constant(_) => {}
                Step::Unary(_, of) => add(*of),
                Step::Binary(_, left, right) => {
                    add(*left);
                    add(*right);
                }
            }
        }
        uses
    }

    /// Whether the value is a polynomial of at most the first degree in a leaf.
    fn is_linear(&self, leaf: u32) -> bool {
        /// What is no polynomial, or of a higher degree.
        const MORE: u32 = 2;
        let mut degrees: Vec<u32> = Vec::with_capacity(self.steps.len());
        for step in &self.steps {
            let of = |at: &u32| degrees.get(*at as usize).copied().unwrap_or(MORE);
            let degree = match step {
                Step::Leaf(own) => u32::from(*own == leaf),
                Step::Constant(_) => 0,
                Step::Unary(Unary::Neg, at) => of(at),
                Step::Unary(_, at) => of(at) * MORE,
                Step::Binary(Binary::Add | Binary::Sub, left, right) => of(left).max(of(right)),
                Step::Binary(Binary::Mul, left, right) => of(left) + of(right),
                Step::Binary(Binary::Div, left, right) => of(left) + of(right) * MORE,
                Step::Binary(_, left, right) => (of(left) + of(right)) * MORE,
            };
            degrees.push(degree.min(MORE));
        }
        degrees.last().is_some_and(|degree| *degree < MORE)
    }

    /// Computes the values of all steps for these leaves; returns that of the formula.
    pub(super) fn forwards(&self, leaves: &[Interval], values: &mut [Interval]) -> Interval {
        let mut last = Interval::EMPTY;
        for (at, step) in self.steps.iter().enumerate() {
            let of = |at: &u32| values.get(*at as usize).copied().unwrap_or(Interval::EMPTY);
            last = match step {
                Step::Leaf(leaf) => leaves.get(*leaf as usize).copied().unwrap_or(Interval::EMPTY),
                Step::Constant(bounds) => *bounds,
                Step::Unary(unary, at) => of(at).unary(*unary),
                Step::Binary(binary, left, right) => of(left).binary(*binary, of(right)),
            };
            if let Some(value) = values.get_mut(at) {
                *value = last;
            }
        }
        last
    }

    /// Computes bounds of the formula's derivatives by each leaf from the values of a sweep forwards (reverse accumulation).
    /// Returns whether the formula is defined and continuous for all values of the leaves: otherwise the bounds mean nothing.
    ///
    /// Source: A. Griewank, A. Walther, "Evaluating derivatives", 2008, 3.2, doi:10.1137/1.9780898717761.
    pub(super) fn backwards(
        &self,
        values: &[Interval],
        by_step: &mut [Interval],
        by_leaf: &mut [Interval],
    ) -> bool {
        by_step.iter_mut().for_each(|slope| *slope = ZERO);
        by_leaf.iter_mut().for_each(|slope| *slope = ZERO);
        if let Some(last) = by_step.get_mut(self.steps.len().saturating_sub(1)) {
            *last = Interval::point(1.0);
        }
        for (at, step) in self.steps.iter().enumerate().rev() {
            let own = by_step.get(at).copied().unwrap_or(ZERO);
            let of = |at: u32| values.get(at as usize).copied().unwrap_or(Interval::EMPTY);
            let mut add = |to: u32, slope: Interval| {
                if let Some(sum) = by_step.get_mut(to as usize) {
                    *sum = *sum + own * slope;
                }
            };
            match *step {
                Step::Constant(_) => {}
                Step::Leaf(leaf) => {
                    by_leaf.get_mut(leaf as usize).into_iter().for_each(|slope| *slope = own);
                }
                Step::Unary(unary, x) => {
                    let Some(slope) = of_one(unary, of(x), of(at as u32)) else { return false };
                    add(x, slope);
                }
                Step::Binary(binary, x, y) => {
                    let Some((by_x, by_y)) = of_two(binary, of(x), of(y), of(at as u32)) else {
                        return false;
                    };
                    add(x, by_x);
                    add(y, by_y);
                }
            }
        }
        true
    }
}

struct Builder<'f, 'r, E> {
    steps: Vec<Step>,
    leaves: Vec<Origin>,
    /// The steps of terms, equal ones once, but for those that are uncertain by themselves.
    known: BTreeMap<&'f Formula, u32>,
    register: &'r mut dyn FnMut(&Formula) -> Result<Option<u32>, E>,
}

impl<'f, E> Builder<'f, '_, E> {
    /// The step of a term; `None` when there is no tape.
    fn step(&mut self, formula: &'f Formula) -> Result<Option<u32>, E> {
        if let Some(step) = self.known.get(formula) {
            return Ok(Some(*step));
        }
        let step = match (formula.operation(), formula.arguments()) {
            (Operation::Constant(constant), _) => self.constant(constant),
            (Operation::Unary(unary), [of]) => {
                let Some(of) = self.step(of)? else { return Ok(None) };
                Step::Unary(unary, of)
            }
            // What continues beyond half a turn depends on the interval.
            (Operation::Binary(binary), [left, right]) if binary != Binary::Bearing => {
                let (Some(left), Some(right)) = (self.step(left)?, self.step(right)?) else {
                    return Ok(None);
                };
                Step::Binary(binary, left, right)
            }
            _ if formula.is_uncertain() => return Ok(None),
            _ => {
                let Some(register) = (self.register)(formula)? else { return Ok(None) };
                self.leaf(Origin::Register(register))
            }
        };
        if self.steps.len() >= MOST_STEPS {
            return Ok(None);
        }
        let at = self.steps.len() as u32;
        self.steps.push(step);
        if !formula.is_uncertain() {
            self.known.insert(formula, at);
        }
        Ok(Some(at))
    }

    fn constant(&mut self, constant: Constant) -> Step {
        match constant.is_certain() || constant.is(0.0) {
            true => Step::Constant(constant.bounds),
            false => self.leaf(Origin::Bounds(constant.bounds)),
        }
    }

    fn leaf(&mut self, origin: Origin) -> Step {
        self.leaves.push(origin);
        Step::Leaf(self.leaves.len() as u32 - 1)
    }
}
