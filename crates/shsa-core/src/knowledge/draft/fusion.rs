//! A fusion as it is written: what goes in, the model of its states, the method, and what comes out.

use super::{PropertyDrafts, Text};
use alloc::vec::Vec;

/// Several signals fused to new ones.
#[derive(Clone, Debug, Default)]
pub struct FusionDraft {
    /// Unique among fusions.
    pub name: Text,
    /// One word.
    pub method: Option<Text>,
    /// What is estimated.
    pub states: Vec<FusionStateDraft>,
    /// Names in formulas, and the signals that set them.
    pub controls: Vec<(Text, Text)>,
    /// What measures the states.
    pub inputs: Vec<FusionInputDraft>,
    /// New signals.
    pub outputs: Vec<FusionOutputDraft>,
    /// Time between two estimates; one with every input when absent.
    pub period: Option<Text>,
    /// How far behind the newest measurement a late one still counts.
    pub horizon: Option<Text>,
    /// After how long without a measurement nothing is known.
    pub unknown_after: Option<Text>,
    /// The share of healthy measurements that count, or `none`.
    pub gate: Option<Text>,
    /// `all` or `none`: whether each input is predicted by the others.
    pub witnesses: Option<Text>,
    /// How many inputs may lie, for fusion of intervals.
    pub faulty: Option<Text>,
    /// How many values a moving average or median goes over.
    pub window: Option<Text>,
    /// How many particles there are.
    pub particles: Option<Text>,
    /// Of the particles' random numbers.
    pub seed: Option<Text>,
}

/// A quantity that is estimated.
#[derive(Clone, Debug, Default)]
pub struct FusionStateDraft {
    /// An identifier; of a variable of this name it takes unit and turn.
    pub name: Text,
    /// A unit; that of the variable of its name when absent.
    pub unit: Option<Text>,
    /// What it is at first; 0 when absent.
    pub initial: Option<Text>,
    /// Standard deviation of that.
    pub spread: Option<Text>,
    /// Standard deviation of what the transition does not know, in a second.
    pub noise: Option<Text>,
    /// What it is `dt` later, a formula over states and controls; the same when absent.
    pub transition: Option<Text>,
}

/// What measures the states.
#[derive(Clone, Debug, Default)]
pub struct FusionInputDraft {
    /// A signal, or a variable for all signals that carry it.
    pub name: Text,
    /// A formula over states and controls; the state of its variable's name when absent.
    pub measures: Option<Text>,
    /// Standard deviation of its noise; that of the signal when absent.
    pub noise: Option<Text>,
}

/// A new signal.
#[derive(Clone, Debug, Default)]
pub struct FusionOutputDraft {
    /// Unique among signals.
    pub name: Text,
    /// A formula over states and controls.
    pub value: Option<Text>,
    /// What it carries; the variable that `value` names when absent.
    pub variable: Option<Text>,
    /// The share of probability within its interval.
    pub confidence: Option<Text>,
    /// Named numbers.
    pub properties: PropertyDrafts,
}

impl FusionDraft {
    /// All of its texts, to change.
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

    /// All of its texts.
    pub(in crate::knowledge) fn words(&self) -> Vec<Text> {
        let mut all = Vec::new();
        self.clone().texts(&mut |text| all.push(text.clone()));
        all
    }
}
