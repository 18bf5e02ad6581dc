//! Knowledge bases to draw: the models of this project, generated ones, hostile ones.

use shsa_core::knowledge::KnowledgeBase;
use shsa_core::substitution::Substitution;
use std::fmt::Write;
use std::path::Path;

/// A model of this project.
#[track_caller]
pub(crate) fn model(name: &str) -> KnowledgeBase {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models").join(name);
    let loaded = shsa_model::load_file(&path);
    assert!(loaded.report.ok(), "{}", loaded.report.render(false));
    loaded.knowledge
}

/// A model from its text.
#[track_caller]
pub(crate) fn read(text: &str) -> KnowledgeBase {
    let loaded = shsa_model::load(text, "test");
    assert!(loaded.report.ok(), "{}", loaded.report.render(false));
    loaded.knowledge
}

/// The substitution of a variable by one relation for each of some variables.
#[track_caller]
pub(crate) fn substitution(knowledge: &KnowledgeBase, sink: &str, by: &[(&str, &str)]) -> Substitution {
    let variable = |name: &str| knowledge.variable(name).unwrap();
    let relation =
        |name: &str| knowledge.relations().enumerate().find(|(_, relation)| relation.name == name).unwrap().0;
    let choice = by.iter().map(|(output, name)| (variable(output), relation(name))).collect();
    Substitution::from_choice(knowledge, variable(sink), &choice).unwrap()
}

/// Random numbers that are the same everywhere.
pub(crate) struct Dice(pub(crate) u64);

impl Dice {
    pub(crate) fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % count
    }
}

/// Variables in layers, each explained by relations over earlier ones; some in both directions, some loops.
pub(crate) fn layered(variables: usize, dice: &mut Dice) -> KnowledgeBase {
    let mut text = "shsa: 1\nvariables:\n".to_owned();
    for variable in 0..variables {
        let _ = writeln!(text, "  v{variable}: {{}}");
    }
    text += "relations:\n";
    let near = |at: usize, dice: &mut Dice| (at + 1 + dice.below(variables / 6 + 3)) % variables;
    for variable in 0..variables * 3 / 4 {
        let mut inputs: Vec<usize> = (0..1 + dice.below(3)).map(|_| near(variable, dice)).collect();
        inputs.retain(|&input| input != variable);
        inputs.sort_unstable();
        inputs.dedup();
        let names: Vec<String> = inputs.iter().map(|input| format!("v{input}")).collect();
        let (names, first) = (names.join(", "), format!("v{}", inputs.first().unwrap_or(&variable)));
        let _ = match dice.below(5) {
            _ if inputs.is_empty() => Ok(()),
            0 => writeln!(
                text,
                "  r{variable}: {{ outputs: [v{variable}, {first}], inputs: [v{variable}, {names}] }}"
            ),
            _ => writeln!(text, "  r{variable}: {{ output: v{variable}, inputs: [{names}] }}"),
        };
    }
    text += "signals:\n";
    for variable in (0..variables).filter(|variable| variable % 3 != 0) {
        let _ = writeln!(text, "  /sensor/{variable}: {{ variable: v{variable} }}");
    }
    text += "needs:\n  v0: { signal: /out }\n";
    read(&text)
}
