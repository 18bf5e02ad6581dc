//! Compiles formulas to a flat program; equal terms share a register.

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::format;
use alloc::vec::Vec;

use super::Symbol;
use super::curve::Point;
use super::formula::{Formula, Shape};
use super::lacking::weighs_arguments;
use super::operation::Operation;
use super::problem::Problem;
use super::program::{
    Assignment, Examined, Input, InputKind, Instruction, MAX_INSTRUCTIONS, NONE, Program, Register,
    Remembered, Retained,
};
use super::tape::Tape;
use crate::interval::{Course, Offset};

impl Program {
    /// Compiles assignments, each of which may use the variables of earlier ones; the last one is the output.
    ///
    /// `previous(x)` of a variable that the program computes becomes an input ([`InputKind::Previous`]); of any other
    /// variable the program keeps the value itself. Equal terms are computed once.
    ///
    /// # Errors
    /// No assignment, a variable assigned twice or used before it is assigned, an output that is neither number nor
    /// vector, more than [`MAX_INSTRUCTIONS`]. Time: n log n in the size of the formulas.
    pub fn compile(assignments: &[Assignment<'_>]) -> Result<Program, Problem> {
        Program::compile_within(assignments, &|_| Course::ANY)
    }

    /// The same, with what bounds each variable between the moments at which it is known: time operators count with what their
    /// argument can have been between its samples.
    ///
    /// # Errors
    /// As [`Program::compile`].
    pub fn compile_within(
        assignments: &[Assignment<'_>],
        course: &dyn Fn(Symbol) -> Course,
    ) -> Result<Program, Problem> {
        Compiler::new(assignments, course).compile(assignments)
    }
}

struct Compiler<'c> {
    program: Program,
    course: &'c dyn Fn(Symbol) -> Course,
    /// The registers that hold the values of operations on registers.
    known: BTreeMap<(Operation, Vec<Register>), Register>,
    /// The registers of the formulas that were asked whether they are to be examined.
    asked: BTreeSet<u32>,
    /// All variables that the program computes, and those computed so far.
    outputs: Vec<Symbol>,
    assigned: BTreeMap<Symbol, Register>,
    /// The conditions on which each of these depends.
    guards: BTreeMap<Symbol, Vec<Register>>,
    /// What all values of each of these are off by alike.
    offsets: BTreeMap<Symbol, Offset>,
}

impl<'c> Compiler<'c> {
    fn new(assignments: &[Assignment<'_>], course: &'c dyn Fn(Symbol) -> Course) -> Compiler<'c> {
        let program = Program {
            inputs: Vec::new(),
            input_registers: Vec::new(),
            constants: Vec::new(),
            truths: Vec::new(),
            instructions: Vec::new(),
            listed: Vec::new(),
            points: Vec::new(),
            retained: Vec::new(),
            memories: Vec::new(),
            guards: Vec::new(),
            elapsed: None,
            conditions: Vec::new(),
            output: NONE,
            scalar_count: 0,
            vector_count: 0,
            truth_count: 0,
            longest_list: 0,
            examined: Vec::new(),
            is_weighed: false,
        };
        let outputs = assignments.iter().map(|assignment| assignment.symbol).collect();
        Compiler {
            program,
            course,
            known: BTreeMap::new(),
            asked: BTreeSet::new(),
            outputs,
            assigned: BTreeMap::new(),
            guards: BTreeMap::new(),
            offsets: BTreeMap::new(),
        }
    }

    fn compile(mut self, assignments: &[Assignment<'_>]) -> Result<Program, Problem> {
        for Assignment { symbol, formula, condition } in assignments {
            if self.assigned.contains_key(symbol) {
                return Err(refused("a program computes a variable twice"));
            }
            let register = self.formula(formula)?;
            if matches!(register, Register::Truth(_)) {
                return Err(refused("a program computes true or false, not a value"));
            }
            self.examine(formula, register)?;
            self.assigned.insert(*symbol, register);
            self.program.output = register;
            let mut guards = self.guards_of(formula);
            if let Some(condition) = condition {
                let register = self.formula(condition)?;
                self.program.conditions.push(register);
                guards.push(register);
            }
            self.guards.insert(*symbol, guards);
            let offset = formula.course(&|symbol| self.course_of(symbol)).offset;
            self.offsets.insert(*symbol, offset);
        }
        if self.program.output == NONE {
            Err(refused("a program computes nothing"))
        } else {
            Ok(self.program)
        }
    }

    /// Notes a formula over which interval arithmetic may overestimate, and that is therefore examined.
    fn examine(&mut self, formula: &Formula, result: Register) -> Result<(), Problem> {
        let Register::Scalar(result) = result else { return Ok(()) };
        if !self.asked.insert(result) {
            return Ok(());
        }
        let tape = Tape::of(formula, &mut |term| match self.formula(term)? {
            Register::Scalar(place) => Ok(Some(place)),
            _ => Ok(None),
        })?;
        if let Some(tape) = tape {
            self.program.examined.push(Examined { tape, after: self.program.instructions.len(), result });
        }
        Ok(())
    }

    /// The register that holds the formula's value.
    fn formula(&mut self, formula: &Formula) -> Result<Register, Problem> {
        match formula.operation() {
            Operation::Symbol(symbol) => return self.symbol(symbol, formula.shape()),
            Operation::Previous(symbol) => return self.previous(symbol, formula.shape()),
            _ => {}
        }
        let arguments = self.arguments(formula)?;
        let key = (formula.operation(), arguments);
        if let Some(register) = self.known.get(&key) {
            return Ok(*register);
        }
        self.program.is_weighed |= weighs_arguments(formula);
        let register = self.register(formula.shape());
        self.emit(key.0, &key.1, register)?;
        if let (true, Some(argument)) = (key.0.recalls(), formula.arguments().first()) {
            let first = self.program.guards.len() as u32;
            let guards = self.guards_of(argument);
            self.program.guards.extend(guards);
            let course = argument.course(&|symbol| self.course_of(symbol));
            let guards = (first, self.program.guards.len() as u32);
            self.program.memories.push(Remembered { operation: key.0, course, guards });
        }
        self.known.insert(key, register);
        Ok(register)
    }

    /// What bounds a variable; the offset of one that the program computes follows from its inputs.
    fn course_of(&self, symbol: Symbol) -> Course {
        let course = (self.course)(symbol);
        let offset = self.offsets.get(&symbol).copied();
        offset.map_or(course, |offset| Course { offset, ..course })
    }

    /// The conditions on which the variables in a formula depend.
    fn guards_of(&self, formula: &Formula) -> Vec<Register> {
        let symbols = formula.symbols();
        let mut guards: Vec<Register> =
            symbols.iter().filter_map(|symbol| self.guards.get(symbol)).flatten().copied().collect();
        guards.sort_unstable();
        guards.dedup();
        guards
    }

    /// The registers of a formula's arguments; those of a table hold its argument, and where its points stand.
    fn arguments(&mut self, formula: &Formula) -> Result<Vec<Register>, Problem> {
        if formula.operation() == Operation::Table
            && let Some(of) = formula.arguments().first()
        {
            let (first, count) = self.points(&formula.points());
            let register = self.formula(of)?;
            self.examine(of, register)?;
            return Ok(Vec::from([register, Register::Scalar(first), Register::Scalar(count)]));
        }
        // What a tape goes through is examined as a whole, the arguments of all else by themselves.
        let is_step = matches!(formula.operation(), Operation::Unary(_) | Operation::Binary(_));
        let register = |argument| {
            let register = self.formula(argument)?;
            if !is_step {
                self.examine(argument, register)?;
            }
            Ok(register)
        };
        formula.arguments().iter().map(register).collect()
    }

    /// Where these points stand; equal ones are kept once.
    fn points(&mut self, points: &[Point]) -> (u32, u32) {
        let known = &mut self.program.points;
        let place = known.windows(points.len().max(1)).position(|window| window == points);
        let place = place.unwrap_or_else(|| {
            known.extend(points);
            known.len() - points.len()
        });
        (place as u32, points.len() as u32)
    }

    fn emit(
        &mut self,
        operation: Operation,
        arguments: &[Register],
        result: Register,
    ) -> Result<(), Problem> {
        if self.program.instructions.len() >= MAX_INSTRUCTIONS {
            let problem = refused(format!("this needs more than {MAX_INSTRUCTIONS} operations"));
            return Err(problem.with_help("use fewer or shorter relations in one substitution"));
        }
        let mut operands = [NONE; 3];
        for (operand, argument) in operands.iter_mut().zip(arguments) {
            *operand = *argument;
        }
        match (operation, result) {
            (Operation::Constant(constant) | Operation::Known(_, constant), Register::Scalar(place)) => {
                self.program.constants.push((place, constant));
                return Ok(());
            }
            (Operation::Truth(truth), Register::Truth(place)) => {
                self.program.truths.push((place, truth));
                return Ok(());
            }
            (Operation::Elapsed, Register::Scalar(place)) => {
                self.program.elapsed = Some(place);
                return Ok(());
            }
            (Operation::List, _) => {
                let start = self.program.listed.len() as u32;
                self.program.listed.extend(arguments);
                self.program.longest_list = self.program.longest_list.max(arguments.len());
                operands = [Register::Scalar(start), Register::Scalar(arguments.len() as u32), NONE];
            }
            (operation, _) if operation.recalls() => {
                let memory = Register::Scalar(self.program.memories.len() as u32);
                let [_, second, _] = &mut operands;
                *second = memory;
            }
            _ => {}
        }
        self.program.instructions.push(Instruction { operation, arguments: operands, result });
        Ok(())
    }

    fn register(&mut self, shape: Shape) -> Register {
        let Program { scalar_count, vector_count, truth_count, .. } = &mut self.program;
        let (count, register): (&mut u32, fn(u32) -> Register) = match shape {
            Shape::Scalar => (scalar_count, Register::Scalar),
            Shape::Vector => (vector_count, Register::Vector),
            Shape::Truth => (truth_count, Register::Truth),
        };
        *count += 1;
        register(*count - 1)
    }

    fn symbol(&mut self, symbol: Symbol, shape: Shape) -> Result<Register, Problem> {
        if let Some(register) = self.assigned.get(&symbol) {
            return Ok(*register);
        }
        if self.outputs.contains(&symbol) {
            return Err(refused("a program uses a variable before it has computed it"));
        }
        Ok(self.input(Input { symbol, kind: InputKind::Current }, shape))
    }

    fn previous(&mut self, symbol: Symbol, shape: Shape) -> Result<Register, Problem> {
        if self.outputs.contains(&symbol) {
            return Ok(self.input(Input { symbol, kind: InputKind::Previous }, shape));
        }
        let key = (Operation::Previous(symbol), Vec::new());
        if let Some(register) = self.known.get(&key) {
            return Ok(*register);
        }
        let current = self.symbol(symbol, shape)?;
        let (kept, seen) = (self.register(shape), self.register(shape));
        self.program.retained.push(Retained { current, kept, seen });
        self.known.insert(key, seen);
        Ok(seen)
    }

    fn input(&mut self, input: Input, shape: Shape) -> Register {
        let place = self.program.inputs.iter().position(|known| *known == input);
        if let Some(register) = place.and_then(|place| self.program.input_registers.get(place)) {
            return *register;
        }
        let register = self.register(shape);
        self.program.inputs.push(input);
        self.program.input_registers.push(register);
        register
    }
}

fn refused(message: impl Into<alloc::string::String>) -> Problem {
    Problem::error(0..0, message)
}
