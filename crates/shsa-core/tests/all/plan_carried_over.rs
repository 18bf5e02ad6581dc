//! Tables of plans carried over changes of structure, compared with new tables, on random knowledge bases.

use crate::plan_support::{KINDS, Kind, Random, knowledge, random, random_utility};
use crate::seeds::seeds;
use shsa_core::knowledge::{
    Id, IdVec, KnowledgeBase, Lineage, Relation, RelationId, Signal, SignalId, Variable, VariableId,
};
use shsa_core::plan::{Contingency, Graph, Limits, Options, Preparation};
use std::collections::BTreeMap;

/// A knowledge base with names in place of ids, so that elements can be removed and inserted anywhere.
#[derive(Clone)]
struct Sheet {
    variables: Vec<Variable>,
    /// With the names of outputs and inputs.
    relations: Vec<(Relation, Vec<String>, Vec<String>)>,
    /// With the names of the variable and of the origins, and whether the signal is available.
    signals: Vec<(Signal, String, Vec<String>, bool)>,
    utility: shsa_core::knowledge::Utility,
    made: usize,
}

impl Sheet {
    fn of(knowledge: &KnowledgeBase) -> Sheet {
        let variable = |id: &VariableId| knowledge.variables()[*id].name.clone();
        let signal = |id: &SignalId| knowledge.signals()[*id].name.clone();
        let relation = |(at, relation): (usize, &Relation)| {
            let names = |ids: &[VariableId]| ids.iter().map(variable).collect();
            // Names are unique, as in checked models.
            let named = Relation { name: format!("r{at}"), ..relation.clone() };
            (named, names(&relation.outputs), names(&relation.inputs))
        };
        let carrier = |(id, it): (SignalId, &Signal)| {
            let derived_from = it.derived_from.iter().map(signal).collect();
            (it.clone(), variable(&it.variable), derived_from, knowledge.is_available(id))
        };
        Sheet {
            variables: knowledge.variables().iter().cloned().collect(),
            relations: knowledge.relations().iter().enumerate().map(relation).collect(),
            signals: knowledge.signals().enumerate().map(carrier).collect(),
            utility: knowledge.utility().clone(),
            made: 0,
        }
    }

    /// Elements that name a missing one are left out.
    fn build(&self) -> KnowledgeBase {
        fn ids<I: Id>(names: &BTreeMap<&str, I>, of: &[String]) -> Vec<I> {
            of.iter().filter_map(|name| names.get(name.as_str()).copied()).collect()
        }
        let (mut variables, mut relations, mut signals) = (IdVec::new(), IdVec::new(), IdVec::new());
        let mut by_name = BTreeMap::new();
        for variable in &self.variables {
            by_name.insert(variable.name.as_str(), variables.push(variable.clone()));
        }
        for (relation, outputs, inputs) in &self.relations {
            let (known, read) = (ids(&by_name, outputs), ids(&by_name, inputs));
            if known.len() == outputs.len() && read.len() == inputs.len() {
                relations.push(Relation { outputs: known, inputs: read, ..relation.clone() });
            }
        }
        let carry =
            |(_, carried, ..): &&(Signal, String, Vec<String>, bool)| by_name.contains_key(carried.as_str());
        let kept: Vec<_> = self.signals.iter().filter(carry).collect();
        let names: BTreeMap<&str, SignalId> =
            kept.iter().enumerate().map(|(at, it)| (it.0.name.as_str(), SignalId::from_index(at))).collect();
        for (signal, carried, derived_from, _) in &kept {
            let derived_from = ids(&names, derived_from);
            signals.push(Signal { variable: by_name[carried.as_str()], derived_from, ..signal.clone() });
        }
        let mut built = KnowledgeBase::from_parts(variables, relations, signals, IdVec::new())
            .with_utility(self.utility.clone());
        kept.iter()
            .zip(built.signals().ids().collect::<Vec<_>>())
            .for_each(|(it, id)| built.set_available(id, it.3));
        built
    }

    fn fresh(&mut self, kind: &str) -> String {
        self.made += 1;
        format!("new {kind} {}", self.made)
    }

    fn some_variables(&self, numbers: &mut Random, most: usize) -> Vec<String> {
        let mut names: Vec<String> = (0..1 + numbers.below(most))
            .map(|_| self.variables[numbers.below(self.variables.len())].name.clone())
            .collect();
        names.sort();
        names.dedup();
        names
    }

    /// Makes a random change, mostly of the structure.
    fn change(&mut self, numbers: &mut Random) {
        match numbers.below(14) {
            0 => self.add_variable(numbers),
            1 | 2 => self.add_relation(numbers),
            3 | 4 => self.add_signal(numbers),
            5 if self.variables.len() > 2 => {
                drop(self.variables.remove(1 + numbers.below(self.variables.len() - 1)))
            }
            6 if !self.relations.is_empty() => {
                drop(self.relations.remove(numbers.below(self.relations.len())))
            }
            7 if !self.signals.is_empty() => drop(self.signals.remove(numbers.below(self.signals.len()))),
            8 => self.reorder(numbers),
            9 if !self.relations.is_empty() => self.change_relation(numbers),
            10 | 11 if !self.signals.is_empty() => self.change_signal(numbers),
            12 => {
                let at = numbers.below(self.variables.len());
                self.variables[at].properties.insert("accuracy", numbers.share());
            }
            13 if numbers.chance(0.2) => self.utility = random_utility(numbers),
            // A rewrite without a change.
            _ => {}
        }
    }

    fn add_variable(&mut self, numbers: &mut Random) {
        let name = self.fresh("variable");
        let new = Variable { name, ..self.variables[numbers.below(self.variables.len())].clone() };
        self.variables.insert(numbers.below(self.variables.len() + 1), new);
    }

    fn add_relation(&mut self, numbers: &mut Random) {
        let name = self.fresh("relation");
        let new = Relation {
            name,
            inputs: Vec::new(),
            outputs: Vec::new(),
            formulas: Vec::new(),
            condition: None,
            text: String::new(),
            properties: [("cost".to_owned(), 1.0 + numbers.share())].into_iter().collect(),
        };
        let (outputs, inputs) = (self.some_variables(numbers, 2), self.some_variables(numbers, 3));
        self.relations.insert(numbers.below(self.relations.len() + 1), (new, outputs, inputs));
    }

    fn add_signal(&mut self, numbers: &mut Random) {
        let Some((like, ..)) = self.signals.first().cloned() else { return };
        let new = Signal { name: self.fresh("signal"), ..like };
        let carried = self.variables[numbers.below(self.variables.len())].name.clone();
        let derived =
            numbers.chance(0.3).then(|| self.signals[numbers.below(self.signals.len())].0.name.clone());
        let new = (new, carried, derived.into_iter().collect(), true);
        self.signals.insert(numbers.below(self.signals.len() + 1), new);
    }

    /// Moves a block of elements.
    fn reorder(&mut self, numbers: &mut Random) {
        fn turn<T>(list: &mut [T], numbers: &mut Random) {
            let from = numbers.below(list.len());
            let to = from + numbers.below(list.len() - from + 1);
            if to > from {
                list[from..to].rotate_left(numbers.below(to - from));
            }
        }
        match numbers.below(3) {
            0 => turn(&mut self.variables, numbers),
            1 => turn(&mut self.relations, numbers),
            _ => turn(&mut self.signals, numbers),
        }
    }

    fn change_relation(&mut self, numbers: &mut Random) {
        let at = numbers.below(self.relations.len());
        let inputs = self.some_variables(numbers, 3);
        let (relation, outputs, read) = &mut self.relations[at];
        match numbers.below(4) {
            0 => *read = inputs,
            1 => *outputs = inputs,
            2 => drop(relation.properties.insert("cost", 1.0 + 9.0 * numbers.share())),
            // A change of a part that searches do not read.
            _ => relation.text.push('!'),
        }
    }

    fn change_signal(&mut self, numbers: &mut Random) {
        let at = numbers.below(self.signals.len());
        let (variable, origin) = (
            self.variables[numbers.below(self.variables.len())].name.clone(),
            self.signals[numbers.below(self.signals.len())].0.name.clone(),
        );
        let (signal, carried, derived_from, available) = &mut self.signals[at];
        match numbers.below(5) {
            0 => *carried = variable,
            1 => *derived_from = vec![origin],
            2 => derived_from.clear(),
            3 => *available = !*available,
            _ => drop(signal.properties.insert("accuracy", numbers.share())),
        }
    }
}

fn some_sheet(numbers: &mut Random) -> Sheet {
    let kind = KINDS[numbers.below(KINDS.len())];
    let size = match kind {
        Kind::Tree | Kind::BidirectionalTree => 6 + numbers.below(30),
        Kind::Shared => 4 + numbers.below(12),
        Kind::Cyclic | Kind::Equations | Kind::Mixed => 4 + numbers.below(8),
    };
    let ties = numbers.chance(0.3);
    let mut sheet = Sheet::of(&random(numbers, kind, size, ties).with_utility(random_utility(numbers)));
    let names: Vec<String> = sheet.signals.iter().map(|it| it.0.name.clone()).collect();
    let derived = numbers.chance(0.5);
    for (_, _, derived_from, available) in &mut sheet.signals {
        *available = numbers.chance(0.9);
        if derived && numbers.chance(0.3) {
            derived_from.push(names[numbers.below(names.len())].clone());
        }
    }
    sheet
}

fn preparation(numbers: &mut Random, knowledge: &KnowledgeBase) -> Preparation {
    let forbidden = knowledge.signals().ids().filter(|_| numbers.chance(0.05)).collect();
    let relations: Vec<RelationId> = knowledge.relations().ids().filter(|_| numbers.chance(0.05)).collect();
    let options = Options {
        substitute_provided: numbers.chance(0.2),
        without_empty: numbers.chance(0.2),
        forbidden_signals: forbidden,
        forbidden_relations: relations,
    };
    let count = [1, 1, 2, 5, usize::MAX][numbers.below(5)];
    let limits = Limits { expansions: 100_000, states: 100_000 };
    let scarce = numbers.chance(0.2);
    let work = if scarce { numbers.below(3_000) as u64 } else { 100_000_000 };
    let work_each = if scarce { numbers.below(2_000) as u64 } else { 10_000_000 };
    Preparation {
        count,
        pairs: numbers.chance(0.5),
        options,
        limits,
        work_each,
        work,
        ..Preparation::default()
    }
}

/// Checks that two tables give the same answers.
#[track_caller]
fn check_same(seed: u64, one: &Contingency, other: &Contingency, knowledge: &KnowledgeBase) {
    assert_eq!(one.version(), other.version());
    assert_eq!(one.preparation(), other.preparation(), "seed {seed}");
    assert_eq!(one.variables().collect::<Vec<_>>(), other.variables().collect::<Vec<_>>(), "seed {seed}");
    let signals: Vec<SignalId> = knowledge.signals().ids().collect();
    for variable in knowledge.variables().ids() {
        let all = |table: &Contingency| -> Vec<_> {
            let losses = table.losses(variable);
            let losses = losses.map(|(lost, plan)| {
                (lost.to_vec(), table.then_matter(variable, lost).to_vec(), plan.clone())
            });
            losses.collect()
        };
        assert_eq!(all(one), all(other), "seed {seed} {variable:?}");
        assert_eq!(one.events(variable), other.events(variable), "seed {seed} {variable:?}");
        assert_eq!(one.is_complete(variable), other.is_complete(variable), "seed {seed} {variable:?}");
        for lost in signals.windows(2) {
            assert_eq!(one.loss(variable, lost), other.loss(variable, lost), "seed {seed} {variable:?}");
        }
    }
}

#[test]
fn a_table_that_is_carried_over_equals_one_that_is_made_anew() {
    let (mut carried, mut needed, mut reordered) = (0, 0, 0);
    for seed in seeds(60) {
        let mut numbers = Random(seed);
        let mut sheet = some_sheet(&mut numbers);
        let mut known = sheet.build();
        let mut graph = Graph::new(&known);
        let preparation = preparation(&mut numbers, &known);
        let wanted: Vec<VariableId> = known.variables().ids().filter(|_| numbers.chance(0.6)).collect();
        let mut table = Contingency::new(&known, &graph, wanted, preparation);
        for _ in 0..5 {
            let mut changed = sheet.clone();
            (0..1 + numbers.below(2)).for_each(|_| changed.change(&mut numbers));
            let next = changed.build().succeeding(known.version());
            let lineage = Lineage::new(&known, &next);
            let fresh = Graph::new(&next);
            let wanted: Vec<VariableId> = next.variables().ids().filter(|_| numbers.chance(0.8)).collect();
            let before = table.searches();
            table = table.carried_over(&graph, &lineage, &next, &fresh, wanted.iter().copied());
            let new = Contingency::new(&next, &fresh, wanted, table.preparation().clone());
            check_same(seed, &table, &new, &next);
            let saved = new.searches() - (table.searches() - before);
            (carried, needed) = (carried + saved, needed + new.searches());
            reordered += if lineage.keeps_ids() { 0 } else { saved };
            // A later update keeps both tables equal.
            if let Some(signal) = next.signals().ids().nth(numbers.below(next.signals().len())) {
                let mut next = next.clone();
                next.set_available(signal, !next.is_available(signal));
                let mut graph = fresh.clone();
                let element = [shsa_core::knowledge::Element::Signal(signal)];
                graph.update(&next, &element);
                let (mut one, mut other) = (table.clone(), new);
                assert_eq!(one.update(&next, &graph, &element), other.update(&next, &graph, &element));
                check_same(seed, &one, &other, &next);
            }
            (sheet, known, graph) = (changed, next, fresh);
        }
    }
    assert!(carried * 5 > needed, "{carried} of {needed}");
    assert!(reordered * 10 > needed, "{reordered} of {needed} where ids change");
}

fn table(lines: &[&str]) -> (KnowledgeBase, Graph, Contingency) {
    let knowledge = Sheet::of(&knowledge(lines)).build();
    let graph = Graph::new(&knowledge);
    let table = Contingency::new(&knowledge, &graph, knowledge.variables().ids(), Preparation::default());
    (knowledge, graph, table)
}

/// The number of searches that a change costs.
fn cost(before: &[&str], after: &[&str]) -> u64 {
    let ((old, graph, table), (new, fresh, _)) = (self::table(before), self::table(after));
    let searches = table.searches();
    let new = new.succeeding(old.version());
    let lineage = Lineage::new(&old, &new);
    table.carried_over(&graph, &lineage, &new, &fresh, new.variables().ids()).searches() - searches
}

#[test]
fn only_what_a_change_touches_is_made_again() {
    let two = ["x = r(a)", "x = r(b)", "!a", "!b", "y = r(c)", "!c"];
    assert_eq!(cost(&two, &two), 0);
    let anew = table(&two).2.searches();
    // The new variable costs a search with its signal and one without; no other search is made.
    let added = ["x = r(a)", "x = r(b)", "!a", "!b", "y = r(c)", "!c", "!d"];
    assert_eq!((cost(&two, &added), cost(&added, &two)), (2, 0));
    let other = ["x = r(a)", "x = r(b)", "!a", "!b", "y = r(c)", "!c", "!c"];
    let touched = cost(&two, &other);
    assert!(0 < touched && touched < anew, "{touched} of {anew}");
}
