//! States, controls, inputs and outputs of a fusion.

use super::scope::Local;
use super::settings::share;
use super::{Readable, required};
use crate::expression::{self, Checked, Constant, Formula, Problem, check, is_reserved, parse_expression};
use crate::interval::Interval;
use crate::knowledge::build::problems::Problems;
use crate::knowledge::build::quantity::{self, Kind};
use crate::knowledge::build::scope::Names;
use crate::knowledge::draft::{
    FusionDraft, FusionInputDraft, FusionOutputDraft, FusionStateDraft, Place, Text,
};
use crate::knowledge::properties::SharedNames;
use crate::knowledge::{
    FusionInput, FusionOutput, FusionState, IdVec, Properties, Shape, Signal, SignalId, Variable, VariableId,
};
use crate::unit::Unit;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// The default probability of the truth within the interval of an output.
const CONFIDENCE: f64 = 0.99;

/// An output signal that is to be added.
pub(super) struct Written {
    pub(super) name: String,
    pub(super) variable: VariableId,
    pub(super) properties: Properties,
}

/// The elements that the parts of a fusion refer to.
pub(super) struct Parts<'a> {
    pub(super) signals: &'a IdVec<SignalId, Signal>,
    pub(super) readable: &'a Readable<'a>,
    pub(super) local: &'a Local<'a>,
}

/// The control signals, and the names of states and controls with their units.
pub(super) fn local<'a>(
    problems: &mut Problems,
    draft: &FusionDraft,
    model: &'a Names<'a>,
    signals: &IdVec<SignalId, Signal>,
    readable: &Readable<'_>,
) -> (Option<Vec<SignalId>>, Local<'a>) {
    let mut names: Vec<(String, Option<Unit>)> = Vec::new();
    let mut is_right = true;
    let mut add = |problems: &mut Problems, name: &Text, unit: Option<Unit>| {
        let is_known = names.iter().any(|(known, _)| *known == name.text);
        if is_known
            || is_reserved(&name.text)
            || model.variables.find(&name.text).is_some_and(|id| model.variables.list[id].constant.is_some())
        {
            problems.error(
                name,
                format!("`{}` means something else already", name.text),
                "give it another name",
            );
            is_right = false;
        }
        names.push((name.text.clone(), unit));
    };
    for state in &draft.states {
        let of_variable =
            model.variables.find(&state.name.text).and_then(|id| model.variables.list[id].unit.clone());
        let own = state.unit.as_ref().and_then(|text| quantity::unit(problems, text));
        add(problems, &state.name, own.or(of_variable));
    }
    let mut controls = Vec::new();
    for (name, signal) in &draft.controls {
        let found = readable.find(problems, signal, signals);
        add(problems, name, found.and_then(|id| model.variables.list[signals[id].variable].unit.clone()));
        controls.push(found);
    }
    let controls = controls.into_iter().collect::<Option<Vec<SignalId>>>().filter(|_| is_right);
    (controls, Local { model, names })
}

impl Parts<'_> {
    fn variable(&self, id: VariableId) -> &Variable {
        &self.local.model.variables.list[id]
    }

    pub(super) fn states(&self, problems: &mut Problems, draft: &FusionDraft) -> Option<Vec<FusionState>> {
        let all = draft.states.iter().enumerate().map(|(place, state)| self.state(problems, place, state));
        // All elements are checked, so that every problem is reported at once.
        all.collect::<Vec<_>>().into_iter().collect()
    }

    fn state(&self, problems: &mut Problems, place: usize, draft: &FusionStateDraft) -> Option<FusionState> {
        let unit = self.local.unit(place);
        let help = "write how far off it may be at first: `spread: 10`";
        let spread = required(problems, draft.spread.as_ref(), &draft.name, "spread", help);
        let spread = spread.and_then(|text| self.deviation(problems, text, unit));
        let initial = match &draft.initial {
            None => Some(unit.map_or(0.0, |unit| unit.to_si(0.0))),
            Some(text) => quantity::quantity(problems, text, unit, Kind::Value),
        };
        let noise = match &draft.noise {
            None => Some(number(0.0)),
            Some(text) => self.noise(problems, text, unit),
        };
        let transition = match &draft.transition {
            None => Some(Formula::symbol(expression::Symbol(place as u32), expression::Shape::Scalar)),
            Some(text) => self.checked(problems, text, unit, true),
        };
        let of_variable = self.local.model.variables.find(&draft.name.text);
        Some(FusionState {
            name: draft.name.text.clone(),
            unit: unit.cloned(),
            turn: of_variable.and_then(|id| self.variable(id).wraps),
            initial: initial?,
            spread: spread?,
            noise: noise?,
            transition: transition?,
        })
    }

    /// The inputs in the order of the file; a variable stands for all its signals that are not named themselves.
    pub(super) fn inputs(
        &self,
        problems: &mut Problems,
        draft: &FusionDraft,
    ) -> Option<(Vec<FusionInput>, Vec<Place>)> {
        let (mut inputs, mut places) = (Vec::new(), Vec::new());
        for input in &draft.inputs {
            for signal in self.carriers(problems, draft, input) {
                places.push(input.name.place);
                inputs.push(self.input(problems, input, signal));
            }
        }
        let inputs = inputs.into_iter().collect::<Option<Vec<FusionInput>>>()?;
        for (at, place) in places.iter().enumerate() {
            let (before, own) = (inputs.get(..at).unwrap_or(&[]), inputs.get(at).map(|it| it.signal));
            if before.iter().any(|other| Some(other.signal) == own) {
                problems.error(*place, "this input is given twice", "keep one");
                return None;
            }
        }
        (!inputs.is_empty()).then_some((inputs, places))
    }

    fn carriers(
        &self,
        problems: &mut Problems,
        draft: &FusionDraft,
        input: &FusionInputDraft,
    ) -> Vec<SignalId> {
        let is_named = |id: &SignalId| draft.inputs.iter().any(|it| it.name.text == self.signals[*id].name);
        match self.local.model.variables.find(&input.name.text) {
            Some(variable)
                if !self.signals.iter().take(self.readable.declared).any(|it| it.name == input.name.text) =>
            {
                let carries = |id: &SignalId| self.signals[*id].variable == variable && !is_named(id);
                let found: Vec<SignalId> =
                    self.signals.ids().take(self.readable.declared).filter(carries).collect();
                if found.is_empty() {
                    let message = format!("no other signal carries `{}`", input.name.text);
                    problems.error(&input.name, message, "name a signal, or the output of another fusion");
                }
                found
            }
            _ => self.readable.find(problems, &input.name, self.signals).into_iter().collect(),
        }
    }

    fn input(
        &self,
        problems: &mut Problems,
        draft: &FusionInputDraft,
        signal: SignalId,
    ) -> Option<FusionInput> {
        let carried = &self.signals[signal];
        let variable = self.variable(carried.variable);
        if variable.shape == Shape::Vector {
            let message = format!("`{}` carries a list, and a fusion takes numbers", carried.name);
            problems.error(
                &draft.name,
                message,
                "take its elements one by one: signals with the source `scan#ranges[0]`",
            );
            return None;
        }
        let own_name = Text { text: variable.name.clone(), place: draft.name.place };
        let measures =
            self.formula(problems, draft.measures.as_ref().unwrap_or(&own_name), variable.unit.as_ref());
        let noise = match &draft.noise {
            None => Some(None),
            Some(text) => self.noise(problems, text, variable.unit.as_ref()).map(Some),
        };
        let error = carried.value_error;
        let says_nothing = error.hi <= error.lo && error.relative == 0.0 && carried.noise.is_none();
        // An output of a fusion brings its intervals.
        if draft.noise.is_none() && says_nothing && !self.readable.is_output(signal) {
            let message = format!("nothing says how wrong `{}` may be", carried.name);
            problems.warn(&draft.name, message, "give it a `noise`, or the signal a `noise` or `value_error`: what brings no interval with it does not count");
        }
        Some(FusionInput { signal, measures: measures?, noise: noise?, turn: variable.wraps })
    }

    pub(super) fn outputs(
        &self,
        problems: &mut Problems,
        draft: &FusionDraft,
    ) -> Option<Vec<(FusionOutput, Written)>> {
        let all = draft.outputs.iter().map(|output| self.output(problems, output));
        all.collect::<Vec<_>>().into_iter().collect()
    }

    fn output(&self, problems: &mut Problems, draft: &FusionOutputDraft) -> Option<(FusionOutput, Written)> {
        if self.signals.iter().any(|signal| signal.name == draft.name.text) {
            problems.error(
                &draft.name,
                format!("there is a signal `{}` already", draft.name.text),
                "give the output another name",
            );
            return None;
        }
        let help = "write what it tells: `fused/speed: speed`";
        let value = required(problems, draft.value.as_ref(), &draft.name, "value", help)?;
        let named = draft.variable.as_ref().unwrap_or(value);
        let Some(variable) = self.local.model.variables.find(&named.text) else {
            let message = format!("output `{}` carries no variable", draft.name.text);
            problems.error(named, message, "declare one under `variables`, and name it: `variable: speed`");
            return None;
        };
        let known = self.variable(variable);
        let formula = self.formula(problems, value, known.unit.as_ref());
        let confidence = match &draft.confidence {
            None => Some(CONFIDENCE),
            Some(text) => share(problems, text),
        };
        let turn = known.wraps.map(|turn| (turn, known.turn_begins()));
        let properties = quantity::properties(problems, &mut SharedNames::default(), &draft.properties);
        let signal = crate::knowledge::Id::from_index(0);
        let output = FusionOutput { signal, value: formula?, confidence: confidence?, turn };
        Some((output, Written { name: draft.name.text.clone(), variable, properties }))
    }

    /// Reads a number in a unit that is not below 0.
    fn deviation(&self, problems: &mut Problems, text: &Text, unit: Option<&Unit>) -> Option<f64> {
        let read = quantity::quantity(problems, text, unit, Kind::Difference)?;
        if read >= 0.0 {
            return Some(read);
        }
        let message = format!("`{}` is below 0, and a standard deviation cannot be", text.text);
        problems.error(text, message, "write how far values stray to one side");
        None
    }

    /// Reads a standard deviation: a number, a quantity, or a formula.
    fn noise(&self, problems: &mut Problems, text: &Text, unit: Option<&Unit>) -> Option<Formula> {
        match expression::parse_quantity(&text.text) {
            Ok(_) => self.deviation(problems, text, unit).map(number),
            Err(_) => self.formula(problems, text, unit),
        }
    }

    /// Reads a formula over states, controls and constants whose value is in a unit.
    fn formula(&self, problems: &mut Problems, text: &Text, unit: Option<&Unit>) -> Option<Formula> {
        self.checked(problems, text, unit, false)
    }

    fn checked(
        &self,
        problems: &mut Problems,
        text: &Text,
        unit: Option<&Unit>,
        is_transition: bool,
    ) -> Option<Formula> {
        let parsed = parse_expression(&text.text).map_err(|problem| problems.inside(text, problem)).ok()?;
        let Checked { formula, dimension, problems: found } = check(&parsed, self.local);
        found.into_iter().for_each(|problem| problems.inside(text, problem));
        let elapsed = expression::Symbol(self.local.names.len() as u32);
        let formula = formula?.with_elapsed(elapsed);
        if !is_transition && formula.symbols().contains(&elapsed) {
            problems.error(text, "`dt` has a meaning in transitions only", "noise counts in a second");
            return None;
        }
        if let (Some(found), Some(wanted)) = (dimension, unit)
            && found != wanted.dimension
        {
            let message = format!("this counts in `{}`, and `{wanted}` is wanted", Unit::si(found));
            problems.inside(text, Problem::error(parsed.span, message));
            return None;
        }
        if formula.is_stateful() || formula.shape() != expression::Shape::Scalar {
            let help = "make what it remembers a state; a truth or a list is no number";
            problems.error(text, "this is not one number of the present", help);
            return None;
        }
        Some(formula)
    }
}

fn number(value: f64) -> Formula {
    Formula::constant(Constant { value, bounds: Interval::point(value) })
}
