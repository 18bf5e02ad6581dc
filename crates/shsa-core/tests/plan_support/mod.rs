//! Knowledge bases for the tests and benchmarks of the searches: written by hand, generated, or recorded.
#![allow(dead_code, reason = "each test and benchmark uses a part of it")]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "tests may fail loudly"
)]

use shsa_core::knowledge::{
    Draft, IdVec, KnowledgeBase, Properties, Relation, RelationId, Shape, Signal, SignalId, Text, Utility,
    UtilityDraft, Variable, VariableId, build,
};
use shsa_core::plan::Options;
use shsa_core::substitution::Substitution;
use std::collections::{BTreeMap, BTreeSet};

/// Builds a knowledge base from names.
#[derive(Default)]
pub(crate) struct Builder {
    names: BTreeMap<String, VariableId>,
    variables: IdVec<VariableId, Variable>,
    relations: IdVec<RelationId, Relation>,
    signals: IdVec<SignalId, Signal>,
}

fn property(name: &str, value: Option<f64>) -> Properties {
    value.map(|value| (name.to_owned(), value)).into_iter().collect()
}

impl Builder {
    pub(crate) fn variable(&mut self, name: &str, accuracy: Option<f64>) -> VariableId {
        if let Some(&id) = self.names.get(name) {
            return id;
        }
        let id = self.variables.push(Variable {
            name: name.to_owned(),
            unit: None,
            shape: Shape::Scalar,
            range: None,
            max_rate: None,
            wraps: None,
            constant: None,
            properties: property("accuracy", accuracy),
        });
        self.names.insert(name.to_owned(), id);
        id
    }

    pub(crate) fn signal(&mut self, variable: VariableId, accuracy: Option<f64>) {
        let name = format!("/{}/{}", self.variables[variable].name, self.signals.len());
        self.signals
            .push(Signal { properties: property("accuracy", accuracy), ..Signal::new(name, variable) });
    }

    pub(crate) fn relation(
        &mut self,
        name: &str,
        outputs: &[VariableId],
        inputs: &[VariableId],
        cost: Option<f64>,
    ) {
        self.relations.push(Relation {
            name: name.to_owned(),
            inputs: inputs.to_vec(),
            outputs: outputs.to_vec(),
            formulas: Vec::new(),
            condition: None,
            text: String::new(),
            properties: property("cost", cost),
        });
    }

    pub(crate) fn build(self) -> KnowledgeBase {
        KnowledgeBase::from_parts(self.variables, self.relations, self.signals, IdVec::new())
    }
}

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
const OWN: [(&str, &str, &str); 6] = [
    ("product", NORM, ""),
    ("product", "1 / cost", "0.5 + accuracy / 2"),
    ("sum", "cost + 0.1 * unprovided", "1 - accuracy"),
    ("sum", "cost * inputs", ""),
    ("minimum", "input_accuracy / cost", "accuracy"),
    ("minimum", "", "accuracy"),
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

/// A small generator of pseudo-random numbers (SplitMix64).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }

    pub(crate) fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn chance(&mut self, share: f64) -> bool {
        self.share() < share
    }

    fn some_of<T: Copy>(&mut self, items: &[T], count: usize) -> Vec<T> {
        let mut items = items.to_vec();
        while items.len() > count {
            let at = self.below(items.len());
            items.remove(at);
        }
        items
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

/// A complete tree as in the experiments of the thesis: variables at even depth, relations at odd depth, usable
/// in both directions; a variable is provided with a probability that rises from `availability` at the root to
/// 1 at the leaves (`None`: only the leaves are).
pub(crate) fn tree(branch: usize, depth: usize, availability: Option<f64>, seed: u64) -> KnowledgeBase {
    let mut random = Random(seed);
    let mut builder = Builder::default();
    let root = builder.variable("root", None);
    let mut level = vec![root];
    let mut relations = 0;
    for at in (2..=depth).step_by(2) {
        let share = availability.map_or(0.0, |low| low + (1.0 - low) * at as f64 / depth as f64);
        let mut next = Vec::new();
        for &variable in &level {
            for _ in 0..branch {
                let start = next.len();
                for _ in 0..branch {
                    let input = builder.variable(&format!("v{at}_{}", next.len()), None);
                    if at == depth || random.chance(share) {
                        builder.signal(input, None);
                    }
                    next.push(input);
                }
                let all: Vec<_> = core::iter::once(variable).chain(next[start..].iter().copied()).collect();
                builder.relation(&format!("r{relations}"), &all, &all, None);
                relations += 1;
            }
        }
        level = next;
    }
    builder.build()
}

/// A large system of parts with some 100 relations each: two for each variable, reading one to three variables that come later in
/// the part or are the first of another. The first variable of a part and half of the others have one or two signals; there are
/// costs and accuracies.
pub(crate) fn large(relations: usize, seed: u64) -> KnowledgeBase {
    const PART: usize = 50;
    let mut random = Random(seed);
    let mut builder = Builder::default();
    let parts = relations.div_ceil(2 * PART);
    for i in 0..parts * PART {
        let variable = builder.variable(&format!("v{i}"), None);
        let signals = if i % PART == 0 { 1 } else { [0, 0, 0, 1, 1, 2][random.below(6)] };
        for _ in 0..signals {
            let accuracy = random.chance(0.5).then(|| random.share());
            builder.signal(variable, accuracy);
        }
    }
    let ids: Vec<VariableId> = builder.variables.ids().collect();
    for i in 0..2 * parts * PART {
        let output = i / 2;
        let later = PART - 1 - output % PART;
        let mut input = || match later == 0 || random.chance(0.1) {
            true => ids[random.below(parts) * PART],
            false => ids[output + 1 + random.below(later)],
        };
        let inputs: Vec<_> = (0..1 + i % 3).map(|_| input()).collect();
        let cost = random.chance(0.5).then(|| 1.0 + 9.0 * random.share());
        builder.relation(&format!("r{i}"), &[ids[output]], &inputs, cost);
    }
    builder.build()
}

/// A chain in which each variable is computed from the next, in `ways` ways, in both directions.
pub(crate) fn chain(length: usize, ways: usize) -> KnowledgeBase {
    let mut builder = Builder::default();
    let variables: Vec<_> = (0..=length).map(|i| builder.variable(&format!("v{i}"), None)).collect();
    builder.signal(variables[length], None);
    for pair in variables.windows(2) {
        for way in 0..ways {
            builder.relation("r", pair, pair, Some(1.0 + way as f64));
        }
    }
    builder.build()
}

/// The drivetrain of the thesis (Höftberger's example): the structure only.
pub(crate) fn drivetrain() -> KnowledgeBase {
    let mut builder = Builder::default();
    let accuracies = [
        ("angular_speed", 0.85),
        ("lateral_acceleration", 0.2),
        ("longitudinal_acceleration", 0.3),
        ("speed", 0.95),
        ("track_width", 0.99),
        ("w_l", 0.9),
        ("w_r", 0.9),
        ("wheel_base", 0.99),
    ];
    for (name, accuracy) in accuracies {
        let variable = builder.variable(name, Some(accuracy));
        if name != "angular_speed" {
            builder.signal(variable, None);
        }
    }
    let relations: [(&str, &str, &[&str]); 8] = [
        ("r1", "steering_angle", &["wheel_angle"]),
        ("r2", "wheel_angle", &["curve_radius", "wheel_base"]),
        ("r3", "curve_radius", &["lateral_acceleration", "speed"]),
        ("r4", "curve_radius", &["track_width", "w_l", "w_r"]),
        ("r5", "angular_speed", &["w_l", "w_r"]),
        ("r6", "speed", &["angular_speed", "dynamic_radius"]),
        ("r7", "speed", &["longitudinal_acceleration", "time"]),
        ("r8", "speed", &["distance", "time"]),
    ];
    for (name, output, inputs) in relations {
        let output = builder.variable(output, None);
        let inputs: Vec<_> = inputs.iter().map(|input| builder.variable(input, None)).collect();
        builder.relation(name, &[output], &inputs, None);
    }
    builder.build()
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
