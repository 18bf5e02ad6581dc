//! Contracts inside the search for substitutions, beside the list of all, of which each is asked by the definition.

use super::composition::Oracle;
use super::drawn::World;
use crate::plan_admission::check;
use crate::plan_support::Random;
use crate::seeds::seeds;
use shsa_core::assurance::{Assurance, Reading, Search};
use shsa_core::interval::Truth;
use shsa_core::knowledge::{ContractId, KnowledgeBase, SignalId, Watched, build};
use shsa_core::plan::{BestFirst, Graph, Limits, Options, StopReason, exhaustive};
use shsa_core::substitution::{Substitution, Way};

const LIMITS: Limits = Limits { expansions: 10_000_000, states: 3_000_000 };

/// How many choices of signals the search asks about, too.
const MOST_CHOICES: usize = 256;

/// What is so at a moment: the evidence of each contract, and the signals that are lost.
struct Moment {
    truths: Vec<Vec<Truth>>,
    lost: Vec<SignalId>,
}

impl Moment {
    fn random(random: &mut Random, knowledge: &KnowledgeBase) -> Moment {
        let truth = |random: &mut Random| {
            [Truth::True, Truth::True, Truth::True, Truth::False, Truth::Unknown][random.below(5)]
        };
        let rows = knowledge.contracts().rows();
        let truths = rows.iter().map(|row| row.evidence.iter().map(|_| truth(random)).collect()).collect();
        let lost = knowledge.signals().ids().filter(|_| random.chance(0.15)).collect();
        Moment { truths, lost }
    }

    fn truth(&self, knowledge: &KnowledgeBase, contract: ContractId, name: &str) -> Truth {
        let place = knowledge.contracts().rows().ids().position(|id| id == contract).unwrap();
        self.truths[place][name[1..].parse::<usize>().unwrap()]
    }

    /// Whether the definition lets some choice of signals for a substitution serve the need.
    fn admits(&self, world: &World, knowledge: &KnowledgeBase, substitution: &Substitution) -> bool {
        let named = |name: &str| {
            knowledge.contracts().rows().enumerate().find(|(_, row)| row.name == name).map(|(id, _)| id)
        };
        let is_true =
            |name: &str, at: usize| self.truth(knowledge, named(name).unwrap(), &format!("e{at}")).is_true();
        let is_usable = |signal| !self.lost.contains(&signal);
        let ways = Way::choices(knowledge, substitution, is_usable, MOST_CHOICES);
        ways.iter().any(|way| Oracle { world, knowledge, way, is_true: &is_true }.is_served())
    }
}

#[test]
fn the_best_admissible_is_found_and_not_the_best_refused() {
    let (mut cases, mut admitted, mut refused, mut saved) = (0, 0, 0, 0);
    for seed in seeds(2_000) {
        let random = &mut Random(seed);
        let world = World::new(random);
        let (knowledge, _) = build(&world.draft);
        let need = knowledge.needs().ids().next().unwrap();
        let root = knowledge.needs()[need].variable;
        let moment = Moment::random(random, &knowledge);
        let options = Options { forbidden_signals: moment.lost.to_vec(), ..Options::default() };
        let assurance = Assurance::new(&knowledge).unwrap();
        let read = |contract, watched: &Watched, _: &Way| {
            Reading::lasting(moment.truth(&knowledge, contract, &watched.name))
        };
        let mut bounds = assurance.bounds(&knowledge, need);
        bounds.read(&knowledge, &read);
        let plain = Search::new(&knowledge, &assurance, need, &read, &moment.lost);
        let contracts = Search::new(&knowledge, &assurance, need, &read, &moment.lost).within(&bounds);
        let graph = Graph::new(&knowledge);
        let mut search = BestFirst::new(&graph, root, &options, LIMITS).admitted_by(&contracts);
        let found: Vec<_> = search.by_ref().collect();
        assert_eq!(search.stop(), StopReason::Complete, "seed {seed}");
        let unpruned: Vec<_> = BestFirst::new(&graph, root, &options, LIMITS).admitted_by(&plain).collect();
        assert_eq!(unpruned, found, "seed {seed}: bounds change the answers");
        let all = exhaustive(&knowledge, root, &options, LIMITS).substitutions;
        refused += check(seed, &found, &all, |it| moment.admits(&world, &knowledge, it));
        let mut without = BestFirst::new(&graph, root, &options, LIMITS);
        let _all = without.by_ref().count();
        saved += usize::from(search.expanded() < without.expanded());
        admitted += found.len();
        cases += 1;
    }
    assert!(admitted > cases / 5 && refused > cases / 2, "{admitted} admitted, {refused} refused");
    assert!(saved > cases / 20, "contracts have saved work only {saved} times of {cases}");
}
