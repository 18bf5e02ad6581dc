//! A fusion as it is written: its inputs, the model of its states, its method, and its outputs.

use super::{PropertyDrafts, Text};
use alloc::vec::Vec;

/// Several signals fused to new ones.
#[derive(Clone, Debug, Default)]
pub struct FusionDraft {
    /// Unique among fusions.
    pub name: Text,
    /// The method's name.
    pub method: Option<Text>,
    /// The estimated quantities.
    pub states: Vec<FusionStateDraft>,
    /// Names in formulas, and the control signals.
    pub controls: Vec<(Text, Text)>,
    /// The measurements of the states.
    pub inputs: Vec<FusionInputDraft>,
    /// New signals.
    pub outputs: Vec<FusionOutputDraft>,
    /// Time between two estimates; one with every input when absent.
    pub period: Option<Text>,
    /// How far behind the newest measurement a late one still counts.
    pub horizon: Option<Text>,
    /// After how long without a measurement the estimate is unknown.
    pub unknown_after: Option<Text>,
    /// The share of healthy measurements that count, or `none`.
    pub gate: Option<Text>,
    /// `all` or `none`: whether each input is predicted by the others.
    pub witnesses: Option<Text>,
    /// How many inputs may be faulty, for fusion of intervals.
    pub faulty: Option<Text>,
    /// The number of values of a moving average or median.
    pub window: Option<Text>,
    /// The number of particles.
    pub particles: Option<Text>,
    /// The seed of the particles' random numbers.
    pub seed: Option<Text>,
}

/// A quantity that is estimated.
#[derive(Clone, Debug, Default)]
pub struct FusionStateDraft {
    /// An identifier; a state with the name of a variable takes its unit and turn.
    pub name: Text,
    /// A unit; that of the variable of the same name when absent.
    pub unit: Option<Text>,
    /// The initial value; 0 when absent.
    pub initial: Option<Text>,
    /// Standard deviation of the initial value.
    pub spread: Option<Text>,
    /// Standard deviation of the state's unmodelled change, in a second.
    pub noise: Option<Text>,
    /// The state `dt` later, a formula over states and controls; unchanged when absent.
    pub transition: Option<Text>,
}

/// A measurement of the states.
#[derive(Clone, Debug, Default)]
pub struct FusionInputDraft {
    /// A signal, or a variable for all signals that carry it.
    pub name: Text,
    /// A formula over states and controls; the state of the variable's name when absent.
    pub measures: Option<Text>,
    /// Standard deviation of the noise; the signal's noise when absent.
    pub noise: Option<Text>,
}

/// A new signal.
#[derive(Clone, Debug, Default)]
pub struct FusionOutputDraft {
    /// Unique among signals.
    pub name: Text,
    /// A formula over states and controls.
    pub value: Option<Text>,
    /// The variable that the output carries; the variable that `value` names when absent.
    pub variable: Option<Text>,
    /// The probability that the interval holds the truth.
    pub confidence: Option<Text>,
    /// Named numbers.
    pub properties: PropertyDrafts,
}

impl FusionDraft {
    /// Visits all texts, to change them.
    pub(in crate::knowledge) fn texts(&mut self, each: &mut dyn FnMut(&mut Text)) {
        each(&mut self.name);
        let settings = [
            &mut self.method,
            &mut self.period,
            &mut self.horizon,
            &mut self.unknown_after,
            &mut self.gate,
            &mut self.witnesses,
            &mut self.faulty,
            &mut self.window,
            &mut self.particles,
            &mut self.seed,
        ];
        settings.into_iter().flatten().for_each(&mut *each);
        for it in &mut self.states {
            each(&mut it.name);
            let texts = [&mut it.unit, &mut it.initial, &mut it.spread, &mut it.noise, &mut it.transition];
            texts.into_iter().flatten().for_each(&mut *each);
        }
        self.controls.iter_mut().flat_map(|(name, signal)| [name, signal]).for_each(&mut *each);
        for it in &mut self.inputs {
            each(&mut it.name);
            [&mut it.measures, &mut it.noise].into_iter().flatten().for_each(&mut *each);
        }
        for it in &mut self.outputs {
            each(&mut it.name);
            [&mut it.value, &mut it.variable, &mut it.confidence].into_iter().flatten().for_each(&mut *each);
            it.properties.iter_mut().flat_map(|(name, value)| [name, value]).for_each(&mut *each);
        }
    }

    /// All texts.
    pub(in crate::knowledge) fn words(&self) -> Vec<Text> {
        let mut all = Vec::new();
        self.clone().texts(&mut |text| all.push(text.clone()));
        all
    }
}
