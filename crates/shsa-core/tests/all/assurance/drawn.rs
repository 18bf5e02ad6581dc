//! Random models with contracts, as drawn and as a draft.

use crate::driven::text;
use crate::plan_support::Random;
use shsa_core::knowledge::{
    BodyDraft, ContractDraft, DemandDraft, Draft, GuaranteeDraft, NeedDraft, RelationDraft, SignalDraft,
    Text, VariableDraft,
};
use std::collections::BTreeMap;

pub(super) const LEVELS: [&str; 6] = ["ASIL A", "ASIL B", "ASIL C", "ASIL D", "SIL 1", "SIL 2"];

/// A statement: a place in `LEVELS`, and an error in tenths of a metre.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Says {
    pub(super) level: Option<usize>,
    pub(super) error: Option<u32>,
}

#[derive(Clone, Debug)]
pub(super) enum Plain {
    All(Vec<Plain>),
    Any(Vec<Plain>),
    AtLeast(usize, Vec<Plain>),
    Asked(usize),
    Watched(usize),
}

/// A contract as it was drawn: demands with the input that is asked, how many pieces of evidence, guarantees.
#[derive(Clone, Debug, Default)]
pub(super) struct Drawn {
    pub(super) asks: Vec<(usize, Says)>,
    pub(super) evidence: usize,
    pub(super) gives: Vec<(Says, Plain)>,
}

/// A model as it was drawn.
#[derive(Debug, Default)]
pub(super) struct World {
    pub(super) draft: Draft,
    /// By the name of the subject.
    pub(super) contracts: BTreeMap<String, Drawn>,
    /// Signals and relations with an `integrity`, 1 to 4.
    pub(super) integrity: BTreeMap<String, usize>,
}

fn says(random: &mut Random) -> Says {
    Says {
        level: random.chance(0.8).then(|| random.below(LEVELS.len())),
        error: random.chance(0.5).then(|| 1 + random.below(3) as u32),
    }
}

fn condition(random: &mut Random, leaves: &[Plain], depth: usize) -> Plain {
    if leaves.is_empty() {
        return Plain::All(Vec::new());
    }
    let leaf = |random: &mut Random| leaves[random.below(leaves.len())].clone();
    if depth == 0 || random.chance(0.4) {
        return leaf(random);
    }
    let parts: Vec<Plain> = (0..2 + random.below(2)).map(|_| condition(random, leaves, depth - 1)).collect();
    match random.below(3) {
        0 => Plain::All(parts),
        1 => Plain::Any(parts),
        _ => Plain::AtLeast(1 + random.below(parts.len()), parts),
    }
}

fn written(plain: &Plain) -> String {
    let joined = |parts: &[Plain], by: &str| parts.iter().map(written).collect::<Vec<_>>().join(by);
    match plain {
        Plain::All(parts) => format!("({})", joined(parts, " and ")),
        Plain::Any(parts) => format!("({})", joined(parts, " or ")),
        Plain::AtLeast(count, parts) => format!("{count} of ({})", joined(parts, ", ")),
        Plain::Asked(at) => format!("a{at}"),
        Plain::Watched(at) => format!("e{at}"),
    }
}

fn properties(says: Says) -> Vec<(Text, Text)> {
    says.error.iter().map(|tenths| (text("error"), text(format!("at most {tenths}0 cm")))).collect()
}

impl World {
    pub(super) fn new(random: &mut Random) -> World {
        let mut world = World::default();
        let variables = 3 + random.below(3);
        let unit = Some(text("m"));
        let variable = |at: usize| VariableDraft {
            name: text(format!("v{at}")),
            unit: unit.clone(),
            ..VariableDraft::default()
        };
        world.draft.variables = (0..variables).map(variable).collect();
        for at in 0..variables {
            for number in 0..random.below(3).max(usize::from(at < 2)) {
                world.signal(random, at, number);
            }
        }
        for at in 1..variables {
            for number in 0..1 + random.below(2) {
                world.relation(random, at, number);
            }
        }
        let needed = variables - 1;
        world.draft.needs = vec![NeedDraft {
            variable: text(format!("v{needed}")),
            max_age: Some(text("1 s")),
            ..NeedDraft::default()
        }];
        let asks = (0..1 + random.below(2)).map(|_| (needed, says(random))).collect();
        let gives = random_gives(random);
        world.contract(random, format!("v{needed}"), asks, gives);
        world
    }

    fn integrity(&mut self, random: &mut Random, name: &str) -> Vec<(Text, Text)> {
        if !random.chance(0.4) {
            return Vec::new();
        }
        let level = random.below(4);
        self.integrity.insert(name.to_owned(), level + 1);
        vec![(text("integrity"), text(["A", "B", "C", "D"][level]))]
    }

    fn signal(&mut self, random: &mut Random, of: usize, number: usize) {
        let name = format!("/s{of}/{number}");
        let properties = self.integrity(random, &name);
        let variable = Some(text(format!("v{of}")));
        self.draft.signals.push(SignalDraft {
            name: text(&*name),
            variable,
            properties,
            ..SignalDraft::default()
        });
        if random.chance(0.6) {
            let gives = 1 + random.below(2);
            self.contract(random, name, Vec::new(), gives);
        }
    }

    fn relation(&mut self, random: &mut Random, of: usize, number: usize) {
        let name = format!("r{of}-{number}");
        let mut inputs: Vec<usize> = (0..1 + random.below(2)).map(|_| random.below(of)).collect();
        inputs.sort_unstable();
        inputs.dedup();
        let properties = self.integrity(random, &name);
        let body = BodyDraft::Structure {
            outputs: vec![text(format!("v{of}"))],
            inputs: inputs.iter().map(|input| text(format!("v{input}"))).collect(),
        };
        self.draft.relations.push(RelationDraft {
            name: text(&*name),
            body,
            directions: None,
            condition: None,
            error: None,
            learn: Vec::new(),
            properties,
        });
        if random.chance(0.5) {
            let asks = inputs.into_iter().map(|input| (input, says(random))).collect();
            let gives = 1 + random.below(2);
            self.contract(random, name, asks, gives);
        }
    }

    fn contract(&mut self, random: &mut Random, name: String, asks: Vec<(usize, Says)>, gives: usize) {
        let evidence = random.below(3);
        let leaves: Vec<Plain> =
            (0..asks.len()).map(Plain::Asked).chain((0..evidence).map(Plain::Watched)).collect();
        let gives: Vec<(Says, Plain)> =
            (0..gives).map(|_| (says(random), condition(random, &leaves, 2))).collect();
        let level = |says: Says| says.level.map(|at| text(LEVELS[at]));
        let of_need = name.starts_with('v');
        self.draft.contracts.push(ContractDraft {
            name: text(&*name),
            gives: gives
                .iter()
                .enumerate()
                .map(|(at, (says, when))| GuaranteeDraft {
                    name: text(format!("g{at}")),
                    level: level(*says),
                    // Of a variable's bound only where it gives one.
                    properties: if of_need { Vec::new() } else { properties(*says) },
                    when: (!leaves.is_empty()).then(|| text(written(when))),
                    ..GuaranteeDraft::default()
                })
                .collect(),
            asks: asks
                .iter()
                .enumerate()
                .map(|(at, (input, says))| DemandDraft {
                    name: text(format!("a{at}")),
                    of: Some(text(format!("v{input}"))),
                    level: level(*says),
                    properties: properties(*says),
                })
                .collect(),
            evidence: (0..evidence).map(|at| (text(format!("e{at}")), text("told"))).collect(),
            ..ContractDraft::default()
        });
        self.contracts.insert(name, Drawn { asks, evidence, gives });
    }
}

/// A need gives nothing of its own, or some modes.
fn random_gives(random: &mut Random) -> usize {
    if random.chance(0.5) { 0 } else { 1 + random.below(2) }
}
