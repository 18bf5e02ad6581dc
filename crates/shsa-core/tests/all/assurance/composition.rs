//! Contracts of random models, composed over every way of serving a need, beside an evaluation that goes through the way by the
//! definition alone.

use super::drawn::{Drawn, LEVELS, Plain, Says, World};
use crate::plan_support::Random;
use crate::seeds::seeds;
use shsa_core::assurance::{Assurance, Reading, Verdict};
use shsa_core::interval::Truth;
use shsa_core::knowledge::{KnowledgeBase, Severity, Watched, build};
use shsa_core::plan::{Limits, Options, exhaustive};
use shsa_core::statement::Level;
use shsa_core::substitution::Way;
use std::collections::BTreeMap;

/// The evaluation by the definition.
pub(super) struct Oracle<'a> {
    pub(super) world: &'a World,
    pub(super) knowledge: &'a KnowledgeBase,
    pub(super) way: &'a Way,
    /// The evidence that counts as true, by its owner.
    pub(super) is_true: &'a dyn Fn(&str, usize) -> bool,
}

impl Oracle<'_> {
    /// Whether the provider of a variable meets a demand.
    fn meets(&self, variable: usize, wanted: Says) -> bool {
        let id = self.knowledge.variable(&format!("v{variable}")).unwrap();
        let substitution = &self.way.substitution;
        if let Some(step) = substitution.steps.iter().find(|step| step.output == id) {
            let relation = &self.knowledge.relations()[step.relation];
            return self.computed(&relation.name, step, wanted);
        }
        let at = substitution.sources.iter().position(|source| *source == id).unwrap();
        let signal = &self.knowledge.signals()[self.way.signals[at].unwrap()].name;
        match self.world.contracts.get(signal) {
            Some(contract) => self.gives(signal, contract, wanted),
            None => {
                let own = self.world.integrity.get(signal).map(|level| level - 1);
                wanted.error.is_none() && reaches(own, wanted.level)
            }
        }
    }

    fn computed(&self, name: &str, step: &shsa_core::substitution::Step, wanted: Says) -> bool {
        if let Some(contract) = self.world.contracts.get(name) {
            return self.gives(name, contract, wanted);
        }
        let bounded = match (self.world.integrity.get(name), wanted.level) {
            (Some(own), Some(level)) if level < 4 => level < *own,
            _ => true,
        };
        let inputs = self.knowledge.relations()[step.relation].needs(step.output);
        let place = |id| self.knowledge.variables()[id].name[1..].parse::<usize>().unwrap();
        let mut all = inputs.map(|id| self.meets(place(id), Says { error: None, ..wanted }));
        wanted.error.is_none() && bounded && all.all(|met| met)
    }

    fn gives(&self, name: &str, contract: &Drawn, wanted: Says) -> bool {
        contract.gives.iter().any(|(says, when)| {
            let error = wanted.error.is_none_or(|most| says.error.is_some_and(|own| own <= most));
            error && reaches(says.level, wanted.level) && self.holds(name, contract, when)
        })
    }

    fn holds(&self, name: &str, contract: &Drawn, plain: &Plain) -> bool {
        let part = |part: &&Plain| self.holds(name, contract, part);
        match plain {
            Plain::All(parts) => parts.iter().all(|it| part(&it)),
            Plain::Any(parts) => parts.iter().any(|it| part(&it)),
            Plain::AtLeast(count, parts) => parts.iter().filter(part).count() >= *count,
            Plain::Asked(at) => self.meets(contract.asks[*at].0, contract.asks[*at].1),
            Plain::Watched(at) => (self.is_true)(name, *at),
        }
    }

    /// Whether the need can give something.
    pub(super) fn is_served(&self) -> bool {
        let name = &self.world.draft.needs[0].variable.text;
        let contract = &self.world.contracts[name];
        match contract.gives.is_empty() {
            true => {
                let asked = contract.asks.iter().all(|(input, says)| self.meets(*input, *says));
                asked && (0..contract.evidence).all(|at| (self.is_true)(name, at))
            }
            false => contract.gives.iter().any(|(_, when)| self.holds(name, contract, when)),
        }
    }
}

/// Places in `LEVELS` are ordered within each scale.
fn reaches(own: Option<usize>, wanted: Option<usize>) -> bool {
    wanted.is_none_or(|wanted| own.is_some_and(|own| (own < 4) == (wanted < 4) && own >= wanted))
}

/// The highest level that anybody who takes part states, of each scale: nothing may reach beyond.
fn highest_stated(world: &World, knowledge: &KnowledgeBase, way: &Way) -> [usize; 2] {
    let signals = way.inputs().map(|id| knowledge.signals()[id].name.clone());
    let steps = way.substitution.steps.iter().map(|step| knowledge.relations()[step.relation].name.clone());
    let mut highest = [0, 0];
    for name in signals.chain(steps) {
        let contract = world.contracts.get(&name);
        let stated = contract.into_iter().flat_map(|it| &it.gives).filter_map(|(says, _)| says.level);
        let integrity = world.integrity.get(&name).filter(|_| contract.is_none()).map(|level| level - 1);
        for level in stated.chain(integrity) {
            let (scale, rank) = if level < 4 { (0, level + 1) } else { (1, level - 3) };
            highest[scale] = highest[scale].max(rank);
        }
    }
    highest
}

fn rank(knowledge: &KnowledgeBase, level: Level) -> (usize, usize) {
    let written = knowledge.contracts().scales().written(level);
    let at = LEVELS.iter().position(|known| *known == written).unwrap();
    if at < 4 { (0, at + 1) } else { (1, at - 3) }
}

#[test]
fn contracts_over_a_way_say_what_their_definition_says() {
    let (mut held, mut open, mut compared) = (0, 0, 0);
    for seed in seeds(200) {
        let mut random = Random(seed);
        let world = World::new(&mut random);
        let (knowledge, problems) = build(&world.draft);
        let errors: Vec<_> = problems.iter().filter(|problem| problem.severity == Severity::Error).collect();
        assert!(errors.is_empty(), "seed {seed}: {errors:?}");
        let need = knowledge.needs().ids().next().unwrap();
        let assurance = Assurance::new(&knowledge).unwrap();
        let truths: BTreeMap<(String, String), Truth> = world
            .contracts
            .iter()
            .flat_map(|(name, drawn)| (0..drawn.evidence).map(move |at| (name.clone(), format!("e{at}"))))
            .map(|key| (key, [Truth::True, Truth::True, Truth::False, Truth::Unknown][random.below(4)]))
            .collect();
        let truth = |of: &str, name: &str| truths[&(of.to_owned(), name.to_owned())];
        let contract_name = |id| knowledge.contracts().rows()[id].name.as_str();
        let read = |id, watched: &Watched, _: &Way| Reading::lasting(truth(contract_name(id), &watched.name));
        let mut bounds = assurance.bounds(&knowledge, need);
        bounds.read(&knowledge, &|_, _, _| Reading::lasting(Truth::True));
        bounds.read(&knowledge, &read);
        let (signals, relations) = bounds.barred();
        let mut at_once = assurance.bounds(&knowledge, need);
        at_once.read(&knowledge, &read);
        assert_eq!(bounds.barred(), at_once.barred(), "seed {seed}: bounds depend on earlier evidence");
        let found =
            exhaustive(&knowledge, knowledge.needs()[need].variable, &Options::default(), Limits::default());
        for (substitution, _) in &found.substitutions {
            for way in Way::choices(&knowledge, substitution, |_| true, 4) {
                let composition = assurance.compose(&knowledge, need, &way);
                let mut evaluation = composition.evaluation();
                for (id, of, watched) in composition.evidence(&knowledge) {
                    evaluation.set(composition.system(), id, truth(contract_name(of), &watched.name));
                }
                let assessment = composition.assess(&evaluation);
                let oracle = |is: &dyn Fn(Truth) -> bool| {
                    let is_true = |name: &str, at: usize| is(truth(name, &format!("e{at}")));
                    Oracle { world: &world, knowledge: &knowledge, way: &way, is_true: &is_true }.is_served()
                };
                let expected = match (oracle(&Truth::is_true), oracle(&|truth| !truth.is_false())) {
                    (true, _) => Verdict::Holds,
                    (false, true) => Verdict::Open,
                    (false, false) => Verdict::Refused,
                };
                assert_eq!(assessment.verdict, expected, "seed {seed}: {}", way.describe(&knowledge));
                if let Some(level) = assessment.level {
                    let (scale, rank) = rank(&knowledge, level);
                    let highest = highest_stated(&world, &knowledge, &way)[scale];
                    assert!(rank <= highest, "seed {seed}: {level:?} is higher than anybody states");
                }
                if expected == Verdict::Holds {
                    held += 1;
                    let bars = way.inputs().any(|signal| signals.contains(signal))
                        || substitution.relations().iter().any(|&relation| relations.contains(relation));
                    assert!(!bars, "seed {seed}: {} is barred", way.describe(&knowledge));
                }
                open += usize::from(expected == Verdict::Open);
                compared += 1;
            }
        }
    }
    assert!(held > compared / 50 && open > compared / 100, "{held} held, {open} open of {compared}");
}

/// What is computed by relations without a contract is never better than its worst input.
#[test]
fn no_level_is_raised_by_a_substitution() {
    let mut compared = 0;
    for seed in seeds(200) {
        let mut random = Random(seed);
        let mut world = World::new(&mut random);
        world.draft.contracts.retain(|contract| !contract.name.text.starts_with('r'));
        world.contracts.retain(|name, _| !name.starts_with('r'));
        let (knowledge, _) = build(&world.draft);
        let need = knowledge.needs().ids().next().unwrap();
        let assurance = Assurance::new(&knowledge).unwrap();
        let found =
            exhaustive(&knowledge, knowledge.needs()[need].variable, &Options::default(), Limits::default());
        for way in found.substitutions.iter().flat_map(|(it, _)| Way::choices(&knowledge, it, |_| true, 4)) {
            let composition = assurance.compose(&knowledge, need, &way);
            let assessment = composition.assess(&composition.supposing(|_| Truth::True));
            let Some(level) = assessment.level else { continue };
            let (scale, rank) = rank(&knowledge, level);
            for signal in way.inputs() {
                let name = &knowledge.signals()[signal].name;
                let contract = world.contracts.get(name);
                let stated = contract.into_iter().flat_map(|it| &it.gives).filter_map(|(says, _)| says.level);
                let integrity =
                    world.integrity.get(name).filter(|_| contract.is_none()).map(|level| level - 1);
                let own = stated.chain(integrity).map(|at| if at < 4 { (0, at + 1) } else { (1, at - 3) });
                let best = own.filter(|(of, _)| *of == scale).map(|(_, rank)| rank).max();
                assert!(
                    best.is_some_and(|best| best >= rank),
                    "seed {seed}: {name} in {}",
                    way.describe(&knowledge)
                );
            }
            compared += 1;
        }
    }
    assert!(compared > 20, "only {compared} compared");
}
