//! Knowledge bases of any size, with and without contracts, and the random numbers they are made of.

use shsa_core::interval::Interval;
use shsa_core::knowledge::{
    Condition, Contract, Contracts, EvidenceSource, Given, IdVec, KnowledgeBase, Measure, Need, Policy,
    Properties, Relation, RelationId, Shape, Signal, SignalId, Subject, Switching, Variable, VariableId,
    Watched, WhenUnsure,
};
use shsa_core::statement::{Scales, Statement};
use shsa_core::time::Span;
use std::collections::BTreeMap;

/// Builds a knowledge base from names.
#[derive(Default)]
pub(crate) struct Builder {
    names: BTreeMap<String, VariableId>,
    variables: IdVec<VariableId, Variable>,
    pub(super) relations: IdVec<RelationId, Relation>,
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

    pub(super) fn some_of<T: Copy>(&mut self, items: &[T], count: usize) -> Vec<T> {
        let mut items = items.to_vec();
        while items.len() > count {
            let at = self.below(items.len());
            items.remove(at);
        }
        items
    }
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

/// The same model under contract: every signal gives ASIL B while a reading of it is fresh, and the root is needed at ASIL A.
pub(crate) fn under_contract(plain: &KnowledgeBase, root: VariableId) -> KnowledgeBase {
    let level = Scales::standard().level("asil", "B");
    let mut needs = IdVec::new();
    needs.push(Need {
        variable: root,
        signal: "/need".to_owned(),
        max_age: Span::from_millis(500),
        max_width: None,
        integrity: Some('A'),
        min_rate_hz: None,
        when_unsure: WhenUnsure::Withhold,
        switching: Switching::default(),
        is_isolated: false,
    });
    let contract = |(id, signal): (SignalId, &Signal)| Contract {
        name: signal.name.clone(),
        subject: Subject::Signal(id),
        runs_on: None,
        gives: vec![Given {
            name: "value".to_owned(),
            statement: Statement {
                service: plain.variables()[signal.variable].name.clone(),
                level,
                properties: Vec::new(),
            },
            when: Condition::Watched(0),
            redundant: None,
        }],
        asks: Vec::new(),
        evidence: vec![Watched {
            name: "fresh".to_owned(),
            source: EvidenceSource::Signal(id, Measure::Age),
            within: Some(Interval::new(0.0, 0.3)),
            max_age: None,
        }],
        policy: Policy::Stop,
    };
    let mut contracts = IdVec::new();
    plain.signals().enumerate().map(contract).for_each(|contract| _ = contracts.push(contract));
    let (variables, relations, signals) = (plain.variables(), plain.relations(), plain.signals());
    KnowledgeBase::from_parts(variables.clone(), relations.clone(), signals.clone(), needs)
        .with_contracts(Contracts::new(contracts))
}
