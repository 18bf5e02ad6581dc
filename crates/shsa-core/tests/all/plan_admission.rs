//! Searches with an additional admission, compared with the oracle filtered in the same way.

use crate::plan_support::{Random, question};
use crate::seeds::seeds;
use shsa_core::knowledge::{Id, KnowledgeBase, RelationId, SignalId, VariableId};
use shsa_core::plan::{Admission, BestFirst, Graph, Limits, Options, StopReason, exhaustive};
use shsa_core::substitution::{Step, Substitution, Way};
use std::collections::{BTreeMap, BTreeSet};

const LIMITS: Limits = Limits { expansions: 10_000_000, states: 3_000_000 };

/// The guarantees about a variable, one bit each.
type Guarantees = u8;

/// Small certificates: a signal gives some guarantees, a relation gives each guarantee if all of its inputs give certain others.
#[derive(Debug)]
struct Certificates<'a> {
    knowledge: &'a KnowledgeBase,
    options: &'a Options,
    signals: Vec<Guarantees>,
    /// For each relation and guarantee, the guarantees that every input must give; `None` where the relation never gives it.
    relations: Vec<[Option<Guarantees>; 3]>,
    demanded: Guarantees,
    root: VariableId,
    /// The most guarantees of each variable, over all choices.
    most: Vec<Guarantees>,
}

impl<'a> Certificates<'a> {
    fn random(
        random: &mut Random,
        knowledge: &'a KnowledgeBase,
        options: &'a Options,
        root: VariableId,
    ) -> Self {
        let guarantees = |random: &mut Random| (random.next() % 8) as u8 | (random.next() % 8) as u8;
        let rule = |random: &mut Random| random.chance(0.8).then(|| guarantees(random) & guarantees(random));
        let mut certificates = Certificates {
            knowledge,
            options,
            signals: knowledge.signals().ids().map(|_| guarantees(random)).collect(),
            relations: knowledge.relations().ids().map(|_| [(); 3].map(|()| rule(random))).collect(),
            demanded: 1 + (random.next() % 7) as u8,
            root,
            most: vec![0; knowledge.variables().len()],
        };
        loop {
            let next: Vec<_> = knowledge.variables().ids().map(|it| certificates.most_of(it)).collect();
            if next == certificates.most {
                return certificates;
            }
            certificates.most = next;
        }
    }

    fn usable(&self, variable: VariableId) -> impl Iterator<Item = SignalId> + '_ {
        let is_usable = |signal: &SignalId| !self.options.forbidden_signals.contains(signal);
        self.knowledge.carriers(variable).iter().copied().filter(is_usable)
    }

    fn most_of(&self, variable: VariableId) -> Guarantees {
        let direct = self.usable(variable).fold(0, |all, signal| all | self.signals[signal.index()]);
        let steps = self.knowledge.producers(variable).iter();
        let steps = steps.map(|&relation| Step { relation, output: variable });
        steps.fold(direct, |all, step| all | self.given(step, |input| self.most[input.index()]))
    }

    fn given(&self, step: Step, of: impl Fn(VariableId) -> Guarantees) -> Guarantees {
        let relation = &self.knowledge.relations()[step.relation];
        let least = relation.needs(step.output).map(of).fold(7, |all, it| all & it);
        let given =
            |at: &usize| self.relations[step.relation.index()][*at].is_some_and(|rule| least & rule == rule);
        (0..3).filter(given).fold(0, |all, at| all | 1 << at)
    }

    fn along(&self, steps: &[Step], source: impl Fn(VariableId) -> Guarantees) -> bool {
        let mut known: BTreeMap<VariableId, Guarantees> = BTreeMap::new();
        for step in steps {
            let given = self.given(*step, |it| known.get(&it).copied().unwrap_or_else(|| source(it)));
            known.insert(step.output, given);
        }
        let given = known.get(&self.root).copied().unwrap_or_else(|| source(self.root));
        given & self.demanded == self.demanded
    }

    fn admits_way(&self, way: &Way) -> bool {
        let sources = way.substitution.sources.iter().zip(&way.signals);
        let chosen: BTreeMap<_, _> = sources.filter_map(|(&it, signal)| Some((it, (*signal)?))).collect();
        self.along(&way.substitution.steps, |it| self.signals[chosen[&it].index()])
    }
}

impl Admission for Certificates<'_> {
    fn may_admit(&self, steps: &[Step]) -> bool {
        self.along(steps, |variable| self.most[variable.index()])
    }

    fn admits(&self, substitution: &Substitution) -> bool {
        let usable = |signal| !self.options.forbidden_signals.contains(&signal);
        let ways = Way::choices(self.knowledge, substitution, usable, 256);
        ways.iter().any(|way| self.admits_way(way))
    }
}

/// Of substitutions with the same relations, the search returns the best admitted one; the oracle has only the best of all.
///
/// Returns how many of the oracle's answers are refused.
pub(crate) fn check(
    seed: u64,
    found: &[(Substitution, f64)],
    all: &[(Substitution, f64)],
    admits: impl Fn(&Substitution) -> bool,
) -> usize {
    let (admitted, refused): (Vec<_>, Vec<_>) = all.iter().partition(|(it, _)| admits(it));
    let instead: BTreeSet<Vec<RelationId>> = refused.iter().map(|(it, _)| it.relations()).collect();
    let expected: Vec<_> = found.iter().filter(|(it, _)| !instead.contains(&it.relations())).collect();
    assert_eq!(expected, admitted, "seed {seed}");
    let others = found.iter().filter(|(it, _)| instead.contains(&it.relations()));
    others.for_each(|(it, _)| assert!(admits(it), "seed {seed}: {it:?} is given and refused"));
    refused.len()
}

#[test]
fn the_search_gives_what_the_filtered_list_holds() {
    let (mut found, mut refused, mut saved) = (0, 0, 0);
    for seed in seeds(500) {
        let mut random = Random(seed);
        let (_, knowledge, root, options) = question(&mut random);
        let certificates = Certificates::random(&mut random, &knowledge, &options, root);
        let all = exhaustive(&knowledge, root, &options, LIMITS).substitutions;
        let graph = Graph::new(&knowledge);
        let mut search = BestFirst::new(&graph, root, &options, LIMITS).admitted_by(&certificates);
        let admitted: Vec<_> = search.by_ref().collect();
        assert_eq!(search.stop(), StopReason::Complete, "seed {seed}");
        refused += check(seed, &admitted, &all, |substitution| certificates.admits(substitution));
        let mut without = BestFirst::new(&graph, root, &options, LIMITS);
        let count = without.by_ref().count();
        saved += (search.expanded() < without.expanded()) as usize;
        found += admitted.len().min(count);
    }
    assert!(found > 500 && refused > 500, "{found} found, {refused} refused");
    assert!(saved > 125, "the bound has saved work only {saved} times");
}
