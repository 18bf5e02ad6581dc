//! Knowledge bases for the tests and benchmarks of the searches: written by hand, generated, or recorded.
#![allow(dead_code, reason = "each test and benchmark uses a part of it")]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "tests may fail loudly"
)]

mod generated;

pub(crate) use generated::*;
use shsa_core::knowledge::{
    Draft, KnowledgeBase, RelationId, SignalId, Text, Utility, UtilityDraft, VariableId, build,
};
use shsa_core::plan::Options;
use shsa_core::substitution::Substitution;
use std::collections::{BTreeMap, BTreeSet};

/// A structure-only model: `"x = r(a, b) 2"` is a relation with a cost, `"x y <> r(x, y)"` one for several outputs, `"!a"`
/// provides a variable, `"!a 0.9"` with an accuracy.
pub(crate) fn knowledge(lines: &[&str]) -> KnowledgeBase {
    let mut builder = Builder::default();
    for line in lines {
        if let Some(provided) = line.strip_prefix('!') {
            let mut words = provided.split_whitespace();
            let variable = builder.variable(words.next().unwrap(), None);
            builder.signal(variable, words.next().map(|word| word.parse().unwrap()));
            continue;
        }
        let (outputs, rest) = line.split_once('=').unwrap();
        let (name, rest) = rest.split_once('(').unwrap();
        let (inputs, cost) = rest.split_once(')').unwrap();
        let mut ids = |text: &str| -> Vec<VariableId> {
            let names = text.split([' ', ',']).filter(|name| !name.is_empty());
            names.map(|name| builder.variable(name, None)).collect()
        };
        let (outputs, inputs) = (ids(outputs), ids(inputs));
        builder.relation(name.trim(), &outputs, &inputs, cost.trim().parse().ok());
    }
    builder.build()
}

/// The formula of the norm.
pub(crate) const NORM: &str =
    "(0.3 / max(inputs, 1) + 0.5 / cost + 0.1 / (unprovided + 1) + 0.5 * input_accuracy) / 1.4";

/// Formulas that are valid for all random knowledge bases: aggregate, relation, signal.
const OWN: [(&str, &str, &str); 7] = [
    ("product", NORM, ""),
    ("product", "1 / cost", "0.5 + accuracy / 2"),
    ("sum", "cost + 0.1 * unprovided", "1 - accuracy"),
    ("sum", "cost * inputs", ""),
    ("minimum", "input_accuracy / cost", "accuracy"),
    ("minimum", "", "accuracy"),
    // The accuracy of the output, as relations have none.
    ("product", "accuracy / cost", "accuracy"),
];

/// A utility as a model gives it; an empty formula is none.
pub(crate) fn utility(aggregate: &str, relation: &str, signal: &str) -> Utility {
    let text = |text: &str| Text { text: text.to_owned(), ..Text::default() };
    let formula = |formula: &str| (!formula.is_empty()).then(|| text(formula));
    let own = UtilityDraft::Own {
        at: Text::default(),
        aggregate: Some(text(aggregate)),
        relation: formula(relation),
        signal: formula(signal),
        way: None,
        defaults: vec![(text("cost"), text("1")), (text("accuracy"), text("1"))],
    };
    let (knowledge, problems) = build(&Draft { utility: Some(own), ..Draft::default() });
    assert!(problems.is_empty(), "{problems:?}");
    knowledge.utility().clone()
}

/// The norm or one of several others.
pub(crate) fn random_utility(random: &mut Random) -> Utility {
    match OWN.get(random.below(2 * OWN.len())) {
        Some((aggregate, relation, signal)) => utility(aggregate, relation, signal),
        None => Utility::Norm,
    }
}

/// The kind of a random knowledge base.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Every variable is used by one relation.
    Tree,
    /// A tree whose relations work in all directions.
    BidirectionalTree,
    /// Variables are shared, without cycles.
    Shared,
    /// Any structure with one output for each relation.
    Cyclic,
    /// Equations, usable for each of their variables.
    Equations,
    /// Several outputs, independent of the inputs.
    Mixed,
}

pub(crate) const KINDS: [Kind; 6] =
    [Kind::Tree, Kind::BidirectionalTree, Kind::Shared, Kind::Cyclic, Kind::Equations, Kind::Mixed];

/// A random knowledge base of about `size` variables; without `ties` it has random costs and accuracies.
pub(crate) fn random(random: &mut Random, kind: Kind, size: usize, ties: bool) -> KnowledgeBase {
    let mut builder = Builder::default();
    let accuracy = |r: &mut Random| (!ties && r.chance(0.4)).then(|| r.share());
    let variables: Vec<_> = (0..size).map(|i| builder.variable(&format!("v{i}"), accuracy(random))).collect();
    let mut fresh = 1;
    for i in 0..size + random.below(size) {
        let cost = (!ties && random.chance(0.5)).then(|| 1.0 + (9.0 * random.share()));
        let count = 1 + random.below(3);
        let (outputs, inputs) = match kind {
            Kind::Tree | Kind::BidirectionalTree => {
                let inputs: Vec<_> = variables.iter().skip(fresh).take(count).copied().collect();
                let output = variables[random.below(fresh)];
                fresh += inputs.len();
                if inputs.is_empty() {
                    break;
                }
                let all: Vec<_> = core::iter::once(output).chain(inputs.iter().copied()).collect();
                if kind == Kind::Tree { (vec![output], inputs) } else { (all.clone(), all) }
            }
            Kind::Shared => {
                let output = random.below(size - 1);
                (vec![variables[output]], random.some_of(&variables[output + 1..], count))
            }
            Kind::Cyclic => (random.some_of(&variables, 1), random.some_of(&variables, count)),
            Kind::Equations => {
                let all = random.some_of(&variables, 1 + count);
                (all.clone(), all)
            }
            Kind::Mixed => {
                let outputs = 1 + random.below(3);
                (random.some_of(&variables, outputs), random.some_of(&variables, count - 1))
            }
        };
        builder.relation(&format!("r{i}"), &outputs, &inputs, cost);
    }
    let open = 0.3 + 0.6 * random.share();
    for (i, &variable) in variables.iter().enumerate() {
        let computed = builder.relations.iter().any(|relation| relation.outputs.contains(&variable));
        let share = if computed { open } else { 0.1 };
        let signals = if i == 0 || random.chance(share) { random.below(10) / 8 } else { 1 + random.below(2) };
        for _ in 0..signals {
            let accuracy = accuracy(random);
            builder.signal(variable, accuracy);
        }
    }
    builder.build()
}

/// Random options for a search in a random knowledge base.
pub(crate) fn options(random: &mut Random, knowledge: &KnowledgeBase) -> Options {
    let mut options = Options {
        substitute_provided: random.chance(0.2),
        without_empty: random.chance(0.3),
        ..Options::default()
    };
    if random.chance(0.3) {
        let signals: Vec<SignalId> = knowledge.signals().ids().collect();
        options.forbidden_signals = signals.into_iter().filter(|_| random.chance(0.2)).collect();
    }
    if random.chance(0.2) {
        let relations: Vec<RelationId> = knowledge.relations().ids().collect();
        options.forbidden_relations = relations.into_iter().filter(|_| random.chance(0.2)).collect();
    }
    options
}

/// Checks the properties of a valid substitution, from any search.
pub(crate) fn check_sound(
    knowledge: &KnowledgeBase,
    root: VariableId,
    options: &Options,
    substitution: &Substitution,
) {
    let usable = |signal: &SignalId| !options.forbidden_signals.contains(signal);
    let mut known: BTreeSet<VariableId> = substitution.sources.iter().copied().collect();
    assert!(known.iter().all(|&source| knowledge.carriers(source).iter().any(usable)));
    let mut needed = BTreeSet::from([root]);
    for step in &substitution.steps {
        let relation = &knowledge.relations()[step.relation];
        assert!(relation.outputs.contains(&step.output));
        assert!(!options.forbidden_relations.contains(&step.relation));
        assert!(relation.needs(step.output).all(|input| known.contains(&input)), "a step before its inputs");
        assert!(known.insert(step.output), "computed twice, or provided and computed");
        needed.extend(relation.needs(step.output));
    }
    assert_eq!(known, needed, "something is not used");
}

/// A random question: a knowledge base, a variable of it, and options.
pub(crate) fn question(numbers: &mut Random) -> (Kind, KnowledgeBase, VariableId, Options) {
    let kind = KINDS[numbers.below(KINDS.len())];
    let size = match kind {
        Kind::Tree | Kind::BidirectionalTree => 4 + numbers.below(45),
        Kind::Shared => 3 + numbers.below(13),
        Kind::Cyclic | Kind::Equations | Kind::Mixed => 3 + numbers.below(9),
    };
    let ties = numbers.chance(0.4);
    let knowledge = random(numbers, kind, size, ties).with_utility(random_utility(numbers));
    let options = options(numbers, &knowledge);
    let at = if numbers.chance(0.5) { 0 } else { numbers.below(size) };
    let root = knowledge.variables().ids().nth(at).unwrap();
    (kind, knowledge, root, options)
}

/// The recorded answers of the public programs; `None`, with a message, where the file is missing.
pub(crate) fn reference(file: &str) -> Option<serde_json::Value> {
    let path = format!("{}/../../../shared/reference/{file}", env!("CARGO_MANIFEST_DIR"));
    match std::fs::read_to_string(&path) {
        Ok(text) => Some(serde_json::from_str(&text).expect("valid JSON")),
        Err(error) => {
            eprintln!("SKIPPED: {path}: {error}");
            None
        }
    }
}

/// A model of `models/*.json`: a tree of variables and relations; node 0 becomes the first variable.
pub(crate) fn reference_tree(model: &serde_json::Value) -> KnowledgeBase {
    let parents: Vec<i64> = model["parent"].as_array().unwrap().iter().map(|p| p.as_i64().unwrap()).collect();
    let provided = model["provided"].as_str().unwrap().as_bytes();
    let both = model["bidirectional"].as_bool().unwrap();
    let mut builder = Builder::default();
    let mut children: Vec<Vec<VariableId>> = vec![Vec::new(); parents.len()];
    let mut ids = BTreeMap::new();
    for node in (0..parents.len()).filter(|&node| provided[node] != b'-') {
        let id = builder.variable(&format!("{node}"), None);
        ids.insert(node, id);
        if provided[node] == b'1' {
            builder.signal(id, None);
        }
        if parents[node] >= 0 {
            children[parents[node] as usize].push(id);
        }
    }
    for node in (0..parents.len()).filter(|&node| provided[node] == b'-') {
        let output = ids[&(parents[node] as usize)];
        let all: Vec<_> = core::iter::once(output).chain(children[node].iter().copied()).collect();
        let cost = model["cost"][node.to_string()].as_f64();
        if both {
            builder.relation(&node.to_string(), &all, &all, cost);
        } else {
            builder.relation(&node.to_string(), &[output], &children[node], cost);
        }
    }
    builder.build()
}

/// The first variable of a knowledge base.
pub(crate) fn first(knowledge: &KnowledgeBase) -> VariableId {
    knowledge.variables().ids().next().unwrap()
}
