//! Fusions in a model file: reading and writing.

mod unused;

use shsa_core::knowledge::{
    Diagnostic, FusionDraft, FusionInputDraft, FusionOutputDraft, FusionStateDraft, KnowledgeBase,
    PropertyDrafts, Severity, Text,
};

use super::keys::{FUSION, FUSION_INPUT, FUSION_OUTPUT, FUSION_STATE};
use super::known::Known;
use super::reader::Reader;
use super::tree::{Node, Value};
use super::write::{Tree, keys, properties, text};

/// The findings about a knowledge base and, when these are no errors, the findings that only the algebra of its fusions gives.
pub(super) fn checked(knowledge: &KnowledgeBase, mut found: Vec<Diagnostic>) -> Vec<Diagnostic> {
    if found.iter().all(|it| it.severity != Severity::Error) {
        found.extend(shsa_estimate::node::check(knowledge));
    }
    found
}

/// Reads one fusion.
pub(super) fn read(reader: &mut Reader, (name, node): &(Text, Node)) -> FusionDraft {
    let example = "motion: { method: kalman, states: .., inputs: .., outputs: .. }";
    let mut keys = Known::of(reader, node, &FUSION, "a fusion's keys", example);
    let draft = FusionDraft {
        name: name.clone(),
        method: keys.text("method"),
        states: keys.entries("states", state),
        controls: keys.texts("controls"),
        inputs: keys.entries("inputs", input),
        outputs: keys.entries("outputs", output),
        period: keys.text("period"),
        horizon: keys.text("horizon"),
        unknown_after: keys.text("unknown_after"),
        gate: keys.text("gate"),
        witnesses: keys.text("witnesses"),
        faulty: keys.text("faulty"),
        window: keys.text("window"),
        particles: keys.text("particles"),
        seed: keys.text("seed"),
    };
    unused::unused(&draft).into_iter().for_each(|it| reader.report(it));
    draft
}

fn state(reader: &mut Reader, (name, node): &(Text, Node)) -> FusionStateDraft {
    let example = "speed: { unit: m/s, spread: 2, noise: 0.5 }";
    let mut keys = Known::of(reader, node, &FUSION_STATE, "a state's keys", example);
    FusionStateDraft {
        name: name.clone(),
        unit: keys.text("unit"),
        initial: keys.text("initial"),
        spread: keys.text("spread"),
        noise: keys.text("noise"),
        transition: keys.text("transition"),
    }
}

fn input(reader: &mut Reader, (name, node): &(Text, Node)) -> FusionInputDraft {
    if let Value::Scalar(measures) = &node.value {
        return FusionInputDraft {
            name: name.clone(),
            measures: Some(measures.clone()),
            ..FusionInputDraft::default()
        };
    }
    let mut keys =
        Known::of(reader, node, &FUSION_INPUT, "what it measures, or an input's keys", "/gps: position");
    FusionInputDraft { name: name.clone(), measures: keys.text("measures"), noise: keys.text("noise") }
}

fn output(reader: &mut Reader, (name, node): &(Text, Node)) -> FusionOutputDraft {
    if let Value::Scalar(value) = &node.value {
        let properties = PropertyDrafts::new();
        let value = Some(value.clone());
        return FusionOutputDraft { name: name.clone(), value, variable: None, confidence: None, properties };
    }
    let example = "fused/speed: speed";
    let mut keys = Known::of(reader, node, &FUSION_OUTPUT, "what it provides, or an output's keys", example);
    FusionOutputDraft {
        name: name.clone(),
        value: keys.text("value"),
        variable: keys.text("variable"),
        confidence: keys.text("confidence"),
        properties: keys.numbers("properties"),
    }
}

/// A fusion as the tree of its text.
pub(super) fn written(fusion: &FusionDraft) -> Tree {
    let controls = fusion.controls.iter().map(|(name, signal)| (name.text.clone(), text(signal)));
    keys([
        ("method", fusion.method.as_ref().map(text)),
        ("states", filled(fusion.states.iter().map(|it| (it.name.text.clone(), of_state(it))))),
        ("controls", filled(controls)),
        ("inputs", filled(fusion.inputs.iter().map(|it| (it.name.text.clone(), of_input(it))))),
        ("outputs", filled(fusion.outputs.iter().map(|it| (it.name.text.clone(), of_output(it))))),
        ("period", fusion.period.as_ref().map(text)),
        ("horizon", fusion.horizon.as_ref().map(text)),
        ("unknown_after", fusion.unknown_after.as_ref().map(text)),
        ("gate", fusion.gate.as_ref().map(text)),
        ("witnesses", fusion.witnesses.as_ref().map(text)),
        ("faulty", fusion.faulty.as_ref().map(text)),
        ("window", fusion.window.as_ref().map(text)),
        ("particles", fusion.particles.as_ref().map(text)),
        ("seed", fusion.seed.as_ref().map(text)),
    ])
}

/// A mapping of the entries; `None` when there are none.
fn filled(entries: impl Iterator<Item = (String, Tree)>) -> Option<Tree> {
    let entries: Vec<(String, Tree)> = entries.collect();
    (!entries.is_empty()).then_some(Tree::Map(entries))
}

fn of_state(state: &FusionStateDraft) -> Tree {
    keys([
        ("unit", state.unit.as_ref().map(text)),
        ("initial", state.initial.as_ref().map(text)),
        ("spread", state.spread.as_ref().map(text)),
        ("noise", state.noise.as_ref().map(text)),
        ("transition", state.transition.as_ref().map(text)),
    ])
}

fn of_input(input: &FusionInputDraft) -> Tree {
    let FusionInputDraft { name: _, measures, noise } = input;
    match measures {
        Some(measures) if noise.is_none() => text(measures),
        _ => keys([("measures", measures.as_ref().map(text)), ("noise", noise.as_ref().map(text))]),
    }
}

fn of_output(output: &FusionOutputDraft) -> Tree {
    let FusionOutputDraft { name: _, value, variable, confidence, properties: own } = output;
    match (value, variable, confidence) {
        (Some(value), None, None) if own.is_empty() => text(value),
        _ => keys([
            ("value", value.as_ref().map(text)),
            ("variable", variable.as_ref().map(text)),
            ("confidence", confidence.as_ref().map(text)),
            ("properties", properties(own)),
        ]),
    }
}
