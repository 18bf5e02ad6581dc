//! Weighs what instructions have computed: whether it may be missing, and what it may be where arguments may be.

use super::curve::Curve;
use super::domain::leaves_out;
use super::number::Number;
use super::operation::{Constant, Operation, Reduction};
use super::presence::Presence;
use super::program::{Instruction, Program, Register};
use super::registers::{get, set};
use super::selection::{least_mean, least_median};
use super::state::{Moment, State};
use crate::interval::{Interval, Truth};
use crate::time::Span;

impl<N: Number> State<N> {
    /// Hides the argument of a time operator that must not count as a sample; returns it.
    pub(super) fn hide(&mut self, instruction: &Instruction) -> Option<N> {
        let [argument, ..] = instruction.arguments;
        let (true, Register::Scalar(place)) = (instruction.operation.recalls(), argument) else {
            return None;
        };
        let hidden = (self.presences.of(argument, 0) == Presence::Open).then(|| self.scalar(argument))?;
        set(&mut self.scalars, place, N::MISSING);
        Some(hidden)
    }

    /// Shows what was hidden.
    pub(super) fn show(&mut self, instruction: &Instruction, hidden: Option<N>) {
        if let ([Register::Scalar(place), ..], Some(number)) = (instruction.arguments, hidden) {
            set(&mut self.scalars, place, number);
        }
    }

    /// Whether an output has a value, as far as what it needs is concerned. Elements of a vector that have none become missing.
    pub(super) fn has_output(&mut self, output: Register) -> bool {
        let Register::Vector(place) = output else { return self.presences.of(output, 0) != Presence::Open };
        let start = place as usize * self.vectors.stride;
        for at in 0..self.vectors.get(place).len() {
            if let (Presence::Open, Some(own)) =
                (self.presences.of(output, at), self.vectors.elements.get_mut(start + at))
            {
                *own = N::MISSING;
            }
        }
        true
    }

    /// Weighs what an instruction has computed: whether it may be missing, and what it may be where arguments may be.
    pub(super) fn weigh(&mut self, program: &Program, instruction: &Instruction, moment: &Moment) {
        let Instruction { operation, arguments, result } = *instruction;
        let [first, ..] = arguments;
        let presence = match (operation, result) {
            (Operation::Select, _) => self.weigh_choice(arguments, result),
            (Operation::Index, _) => self.weigh_element(arguments, result),
            (Operation::Reduce(reduction), _) => self.weigh_reduced(reduction, arguments, result),
            (Operation::And | Operation::Or | Operation::Not, _) => self.weigh_truth(operation, arguments),
            (operation, Register::Scalar(_)) if operation.recalls() => {
                self.weigh_recalled(operation, arguments, moment)
            }
            (_, Register::Vector(place)) => {
                for at in 0..self.vectors.get(place).len() {
                    let presence = match operation {
                        Operation::List => self.listed(program, arguments, at),
                        Operation::Slice(from, _) => {
                            self.presences.of(first, (from as usize).saturating_add(at))
                        }
                        _ => self.weighed(program, operation, arguments, at),
                    };
                    self.presences.set(result, at, presence);
                }
                return;
            }
            _ => self.weighed(program, operation, arguments, 0),
        };
        if let (Register::Truth(place), Presence::Open) = (result, presence) {
            set(&mut self.truths, place, Truth::Unknown);
        }
        self.presences.set(result, 0, presence);
    }

    /// The bounds of a register, or of an element of a vector.
    fn bounds(&self, register: Register, place: usize) -> Interval {
        match register {
            Register::Vector(_) => self.vector(register).get(place).map_or(Interval::EMPTY, |it| it.bounds()),
            _ => self.scalar(register).bounds(),
        }
    }

    /// An operation that needs its arguments.
    fn weighed(
        &self,
        program: &Program,
        operation: Operation,
        [first, second, third]: [Register; 3],
        place: usize,
    ) -> Presence {
        let mut all = self.presences.of(first, place);
        let (one, mut other) = (self.bounds(first, place), Interval::point(0.0));
        if matches!(operation, Operation::Binary(_) | Operation::Compare(_)) {
            all = all.max(self.presences.of(second, place));
            other = self.bounds(second, place);
        }
        let curve =
            if operation == Operation::Table { program.curve(second, third) } else { Curve::new(&[]) };
        let is_partial = one.is_empty() || other.is_empty() || leaves_out(operation, one, other, curve);
        if is_partial { all.max(Presence::Partial) } else { all }
    }

    fn listed(&self, program: &Program, [start, ..]: [Register; 3], at: usize) -> Presence {
        let Register::Scalar(start) = start else { return Presence::Certain };
        let register = program.listed.get(start as usize + at);
        register.map_or(Presence::Certain, |register| self.presences.of(*register, 0))
    }

    /// The conditions of which one certainly decides need not hold otherwise.
    fn weigh_truth(&self, operation: Operation, [first, second, _]: [Register; 3]) -> Presence {
        let deciding = if operation == Operation::And { Truth::False } else { Truth::True };
        let decides = |register: Register| {
            operation != Operation::Not
                && self.presences.of(register, 0) == Presence::Certain
                && self.truth(register) == deciding
        };
        match operation {
            Operation::Not => self.presences.of(first, 0),
            _ if decides(first) || decides(second) => Presence::Certain,
            _ => self.presences.of(first, 0).max(self.presences.of(second, 0)),
        }
    }

    fn weigh_choice(&mut self, [condition, then, other]: [Register; 3], result: Register) -> Presence {
        let of = |register| self.presences.of(register, 0);
        let asked = of(condition);
        match self.truth(condition) {
            Truth::True => asked.max(of(then)),
            Truth::False => asked.max(of(other)),
            Truth::Unknown => {
                let (one, two) = (self.bounds(then, 0), self.bounds(other, 0));
                if one.is_empty() == two.is_empty() {
                    return asked.max(of(then)).max(of(other));
                }
                self.put(result, one.hull(two));
                Presence::Open
            }
        }
    }

    fn weigh_element(&mut self, [vector, index, _]: [Register; 3], result: Register) -> Presence {
        let (at, count) = (self.bounds(index, 0), self.vector(vector).len());
        let mut presence = self.presences.of(index, 0);
        if at.is_empty() || count == 0 || at.hi() < 0.0 || at.lo() >= count as f64 {
            return presence;
        }
        let (first, last) = (libm::floor(at.lo()), libm::floor(at.hi()));
        let mut hull = Interval::EMPTY;
        for place in first.max(0.0) as usize..=(last as usize).min(count - 1) {
            let element = self.bounds(vector, place);
            let own = if element.is_empty() { Presence::Open } else { self.presences.of(vector, place) };
            (presence, hull) = (presence.max(own), hull.hull(element));
        }
        self.put(result, hull);
        if first < 0.0 || last >= count as f64 { Presence::Open } else { presence }
    }

    fn weigh_recalled(
        &mut self,
        operation: Operation,
        arguments: [Register; 3],
        moment: &Moment,
    ) -> Presence {
        let [argument, Register::Scalar(memory), _] = arguments else { return Presence::Certain };
        let span = match operation {
            Operation::Derivative(span) | Operation::Delay(span) | Operation::MovingMean(span) => span,
            Operation::Held(span) | Operation::Answered(span) => span,
            _ => Span::MAX,
        };
        let Some(until) = self.presences.until.get_mut(memory as usize) else { return Presence::Certain };
        if get(&self.presences.scalars, scalar_of(argument), Presence::Certain) > Presence::Certain {
            // A window may reach back by half of its length more.
            *until = moment.at.to + span + span;
        }
        if moment.at.from <= *until { Presence::Partial } else { Presence::Certain }
    }

    fn weigh_reduced(
        &mut self,
        reduction: Reduction,
        arguments: [Register; 3],
        result: Register,
    ) -> Presence {
        let [Register::Vector(place), ..] = arguments else { return Presence::Certain };
        let [list, ..] = arguments;
        let presences = &self.presences;
        let elements = self.vectors.get(place).iter().map(|element| element.bounds()).enumerate();
        let mut present = elements
            .filter(|(_, bounds)| !bounds.is_empty())
            .map(|(at, bounds)| (bounds, presences.of(list, at)));
        if matches!(reduction, Reduction::Sum | Reduction::Norm) {
            return present.map(|(_, presence)| presence).max().unwrap_or_default();
        }
        let least = present.clone().map(|(_, presence)| presence).min().unwrap_or_default();
        if present.all(|(_, presence)| presence == Presence::Certain) {
            return least;
        }
        let all = self.vectors.get(place).iter().map(|element| element.bounds()).enumerate();
        let all = all
            .filter(|(_, bounds)| !bounds.is_empty())
            .map(|(at, bounds)| (bounds, presences.of(list, at) == Presence::Certain));
        if let Some(bounds) = with_and_without(reduction, all, &mut self.scratch) {
            self.put(result, bounds);
        }
        if reduction == Reduction::Count { Presence::Certain } else { least }
    }

    /// Makes these the bounds of a number.
    fn put(&mut self, result: Register, bounds: Interval) {
        if let Register::Scalar(place) = result {
            set(&mut self.scalars, place, N::constant(Constant::between(bounds)));
        }
    }
}

fn scalar_of(register: Register) -> u32 {
    if let Register::Scalar(place) = register { place } else { u32::MAX }
}

/// What a function may be of elements of which some are certainly there; `None` where that is what it is of all.
fn with_and_without(
    reduction: Reduction,
    elements: impl Iterator<Item = (Interval, bool)> + Clone,
    scratch: &mut [f64],
) -> Option<Interval> {
    let all = elements.clone().map(|(bounds, _)| bounds).fold(Interval::EMPTY, Interval::hull);
    let certain = elements.clone().filter(|(_, is_certain)| *is_certain).map(|(bounds, _)| bounds);
    let bounds = match reduction {
        Reduction::Min => {
            let most = certain.map(Interval::hi).reduce(f64::min);
            Interval::new(all.lo(), most.unwrap_or(all.hi()))
        }
        Reduction::Max => {
            let least = certain.map(Interval::lo).reduce(f64::max);
            Interval::new(least.unwrap_or(all.lo()), all.hi())
        }
        Reduction::Count => Interval::new(certain.count() as f64, elements.count() as f64),
        Reduction::Mean | Reduction::Median => {
            let mut least = |end: fn(Interval) -> f64| {
                let numbers = elements.clone().map(|(bounds, is_certain)| (end(bounds), is_certain));
                if reduction == Reduction::Mean {
                    least_mean(numbers, scratch)
                } else {
                    least_median(numbers, scratch)
                }
            };
            Interval::new(least(Interval::lo), -least(|bounds| -bounds.hi()))
        }
        _ => return None,
    };
    Some(bounds)
}
