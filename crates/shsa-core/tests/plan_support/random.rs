//! Random numbers, and knowledge bases and questions made from them.

use super::{Builder, utility};
use shsa_core::knowledge::{
    Draft, IdVec, KnowledgeBase, Properties, Relation, RelationId, Shape, Signal, SignalId, Text, Utility,
    UtilityDraft, Variable, VariableId, build,
};
use shsa_core::plan::Options;
use shsa_core::substitution::Substitution;
use shsa_core::time::Span;
use std::collections::{BTreeMap, BTreeSet};

/// Formulas that are right for all random knowledge bases: aggregate, relation, signal.
const OWN: [(&str, &str, &str); 6] = [
    ("product", NORM, ""),
    ("product", "1 / cost", "0.5 + accuracy / 2"),
    ("sum", "cost + 0.1 * unprovided", "1 - accuracy"),
    ("sum", "cost * inputs", ""),
    ("minimum", "input_accuracy / cost", "accuracy"),
    ("minimum", "", "accuracy"),
];

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

/// What a random knowledge base looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Every variable is used by one relation.
    Tree,
    /// A tree whose relations work in all directions.
    BidirectionalTree,
    /// Variables are shared, without cycles.
    Shared,
    /// Anything that has one output.
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
