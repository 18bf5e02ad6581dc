//! Structural analysis compared with its definitions, evaluated on all subsets, and its limits.

use crate::plan_support::Random;
use shsa_core::analysis::structure::{EquationSet, LIMITS, Sets, Structure};
use shsa_core::knowledge::{
    Id, IdVec, KnowledgeBase, Properties, Relation, Shape, Signal, SignalId, Variable, VariableId,
};
use shsa_core::plan::{Limits, StopReason};

/// Equations as bits of variables, and which of them may fail: equations of one variable are signals.
#[derive(Debug)]
struct Bits {
    variables: usize,
    equations: Vec<u32>,
    may_fail: u32,
}

fn prior(may_fail: bool) -> Properties {
    Properties::from([("prior".to_owned(), if may_fail { 0.01 } else { 1e-9 })])
}

fn ids(bits: u32) -> Vec<VariableId> {
    (0..32).filter(|bit| bits >> bit & 1 == 1).map(VariableId::from_index).collect()
}

fn variable(index: usize, constant: Option<f64>) -> Variable {
    let constant = constant.map(shsa_core::interval::Interval::point);
    let (unit, shape, range, max_rate) = (None, Shape::Scalar, None, None);
    Variable {
        name: format!("x{index}"),
        unit,
        shape,
        range,
        max_rate,
        wraps: None,
        constant,
        properties: Properties::new(),
    }
}

fn signal(name: String, variable: VariableId, may_fail: bool, derived_from: Vec<SignalId>) -> Signal {
    Signal { derived_from, properties: prior(may_fail), ..Signal::new(name, variable) }
}

fn relation(name: String, outputs: Vec<VariableId>, inputs: Vec<VariableId>, may_fail: bool) -> Relation {
    let (formulas, condition, text) = (Vec::new(), None, String::new());
    Relation { name, inputs, outputs, formulas, condition, text, properties: prior(may_fail) }
}

/// Sorts relations first, as a structure numbers them.
fn sorted(mut bits: Bits) -> Bits {
    let mut order: Vec<usize> = (0..bits.equations.len()).collect();
    order.sort_by_key(|&at| bits.equations[at].count_ones() == 1);
    bits.may_fail = order.iter().enumerate().map(|(to, from)| (bits.may_fail >> from & 1) << to).sum();
    bits.equations = order.iter().map(|&at| bits.equations[at]).collect();
    bits
}

fn knowledge(bits: &Bits) -> KnowledgeBase {
    let (mut variables, mut relations, mut signals) = (IdVec::new(), IdVec::new(), IdVec::new());
    (0..bits.variables).for_each(|at| _ = variables.push(variable(at, None)));
    for (at, &equation) in bits.equations.iter().enumerate() {
        let mut holds = ids(equation);
        let may_fail = bits.may_fail >> at & 1 == 1;
        let first = holds.remove(0);
        if holds.is_empty() {
            signals.push(signal(format!("s{at}"), first, may_fail, Vec::new()));
        } else {
            relations.push(relation(format!("r{at}"), vec![first], holds, may_fail));
        }
    }
    KnowledgeBase::from_parts(variables, relations, signals, IdVec::new())
}

fn random(seed: u64) -> Bits {
    let mut random = Random(seed);
    let mut below = |limit: usize| (random.next() % limit as u64) as usize;
    let variables = 1 + below(6);
    let count = 1 + below(10);
    let mut equations = Vec::new();
    for _ in 0..count {
        let holds = [1, 1, 2, 2, 3, 4][below(6)];
        equations.push((0..holds).fold(0_u32, |bits, _| bits | 1 << below(variables)));
    }
    let may_fail = below(1 << count) as u32 | below(1 << count) as u32;
    sorted(Bits { variables, equations, may_fail })
}

/// The literal definitions, on subsets as bits.
impl Bits {
    fn subsets(&self) -> std::ops::Range<u32> {
        0..1 << self.equations.len()
    }

    fn holds(&self, set: u32) -> u32 {
        let equations = self.equations.iter().enumerate();
        equations.filter(|(at, _)| set >> at & 1 == 1).fold(0, |all, (_, holds)| all | holds)
    }

    fn surplus(&self, set: u32) -> i64 {
        i64::from(set.count_ones()) - i64::from(self.holds(set).count_ones())
    }

    /// The largest surplus of any subset of each set.
    fn redundancies(&self) -> Vec<i64> {
        let mut best: Vec<i64> = self.subsets().map(|set| self.surplus(set)).collect();
        for set in self.subsets() {
            for at in 0..self.equations.len() {
                if set >> at & 1 == 1 {
                    best[set as usize] = best[set as usize].max(best[(set & !(1 << at)) as usize]);
                }
            }
        }
        best
    }

    /// The sets that lose redundancy with any of their equations.
    fn proper(&self) -> Vec<u32> {
        let best = self.redundancies();
        let loses = |set: u32, at: usize| best[(set & !(1 << at)) as usize] < best[set as usize];
        let all = |set: u32| (0..self.equations.len()).all(|at| set >> at & 1 == 0 || loses(set, at));
        self.subsets().filter(|&set| set != 0 && all(set)).collect()
    }

    fn overdetermined_sets(&self) -> Vec<u32> {
        let over: Vec<u32> = self.subsets().filter(|&set| self.surplus(set) > 0).collect();
        let is_minimal = |set: u32| !over.iter().any(|&other| other != set && other & set == other);
        over.iter().copied().filter(|&set| is_minimal(set)).collect()
    }

    fn test_supports(&self) -> Vec<u32> {
        let proper = self.proper();
        let faults = |set: u32| set & self.may_fail;
        let is_largest = |set: u32| {
            proper.iter().all(|&other| other == set || other & set != set || faults(other) != faults(set))
        };
        let tests: Vec<u32> =
            proper.iter().copied().filter(|&set| faults(set) != 0 && is_largest(set)).collect();
        let is_minimal = |set: u32| {
            !tests.iter().any(|&other| faults(other) != faults(set) && faults(other) & !faults(set) == 0)
        };
        tests.iter().copied().filter(|&set| is_minimal(set)).collect()
    }

    /// The largest proper set: the union of all proper sets.
    fn over(&self) -> u32 {
        self.proper().into_iter().fold(0, |all, set| all | set)
    }
}

fn bits(set: &EquationSet) -> u32 {
    set.iter().fold(0, |bits, id| bits | 1 << id.index())
}

fn all_bits(found: &Sets) -> Vec<u32> {
    assert_eq!(found.stop, StopReason::Complete);
    let mut sets: Vec<u32> = found.sets.iter().map(bits).collect();
    sets.sort_unstable();
    sets
}

#[test]
fn minimal_overdetermined_sets_are_those_of_the_definition() {
    let mut several = 0;
    for seed in 0..3_000 {
        let model = random(seed);
        let expected = model.overdetermined_sets();
        several += usize::from(expected.len() > 5);
        let found = Structure::new(&knowledge(&model)).overdetermined_sets(LIMITS);
        assert_eq!(all_bits(&found), expected, "seed {seed}: {model:?}");
    }
    assert!(several > 300, "only {several} models have more than five sets");
}

#[test]
fn minimal_test_supports_are_those_of_the_definition() {
    let (mut several, mut redundant) = (0, 0);
    for seed in 0..2_000 {
        let model = random(seed);
        let expected = model.test_supports();
        several += usize::from(expected.len() > 3);
        redundant += usize::from(expected.iter().any(|&set| model.surplus(set) > 1));
        let structure = Structure::new(&knowledge(&model));
        let found = structure.test_supports(LIMITS);
        assert_eq!(all_bits(&found), expected, "seed {seed}: {model:?}");
        for set in &found.sets {
            assert_eq!(bits(&structure.support(set)), bits(set) & model.may_fail, "seed {seed}: {model:?}");
        }
    }
    assert!(several > 200 && redundant > 200, "{several} and {redundant} models say little");
}

#[test]
fn faults_are_isolable_when_some_minimal_set_holds_one_without_the_other() {
    for seed in 0..1_000 {
        let model = random(seed);
        let sets = model.overdetermined_sets();
        let structure = Structure::new(&knowledge(&model));
        let found = structure.isolability(LIMITS);
        assert_eq!(found.stop, StopReason::Complete);
        for one in structure.equations().ids() {
            let holds = |set: u32, id: shsa_core::analysis::structure::EquationId| set >> id.index() & 1 == 1;
            assert_eq!(found.is_detectable(one), sets.iter().any(|&set| holds(set, one)), "seed {seed}");
            for other in structure.equations().ids() {
                let expected = sets.iter().any(|&set| holds(set, one) && !holds(set, other));
                assert_eq!(found.is_isolable(one, other), expected, "seed {seed}: {model:?}");
            }
        }
    }
}

/// The variables whose removal lowers the surplus of variables over equations of the best subset of variables.
fn unknowable(model: &Bits) -> u32 {
    let surplus = |set: u32| {
        let touched = model.equations.iter().filter(|&&holds| holds & set != 0).count();
        i64::from(set.count_ones()) - touched as i64
    };
    let best = |within: u32| {
        (0..1_u32 << model.variables).filter(|set| set & !within == 0).map(surplus).max().unwrap()
    };
    let all = (1 << model.variables) - 1;
    (0..model.variables).filter(|at| best(all & !(1 << at)) < best(all)).fold(0, |bits, at| bits | 1 << at)
}

#[test]
fn the_parts_are_those_of_dulmage_and_mendelsohn() {
    for seed in 0..1_000 {
        let model = random(seed);
        let structure = Structure::new(&knowledge(&model));
        let parts = structure.decomposition();
        let equations = |list: &[_]| bits(&list.iter().copied().collect());
        let variables = |list: &[VariableId]| list.iter().fold(0, |bits, id| bits | 1_u32 << id.index());
        let over = model.over();
        assert_eq!(equations(&parts.over.equations), over, "seed {seed}: {model:?}");
        assert_eq!(variables(&parts.over.variables), model.holds(over), "seed {seed}: {model:?}");
        assert_eq!(parts.redundancy() as i64, model.surplus(over), "seed {seed}: {model:?}");
        assert_eq!(variables(&parts.under.variables), unknowable(&model), "seed {seed}: {model:?}");
        let mut known = model.holds(over);
        let mut seen = over | equations(&parts.under.equations);
        for block in &parts.just {
            let (rows, columns) = (equations(&block.equations), variables(&block.variables));
            assert_eq!((seen & rows, known & columns), (0, 0), "seed {seed}: {model:?}");
            assert_eq!(model.holds(rows) & !known, columns, "seed {seed}: solvable in order {model:?}");
            assert_eq!(rows.count_ones(), columns.count_ones(), "seed {seed}: {model:?}");
            let splits = |part: u32| (model.holds(part) & !known).count_ones() == part.count_ones();
            let smaller = model.subsets().filter(|part| part & !rows == 0 && *part != 0 && *part != rows);
            assert!(smaller.into_iter().all(|part| !splits(part)), "seed {seed}: not the smallest {model:?}");
            (seen, known) = (seen | rows, known | columns);
        }
        assert_eq!(seen, model.subsets().end - 1, "seed {seed}: every equation is in one part");
        let everything = (1 << model.variables) - 1;
        assert_eq!(known | unknowable(&model), everything, "seed {seed}: every variable is in one part");
    }
}

#[test]
fn constants_are_known_and_derived_signals_are_relations() {
    let mut variables = IdVec::new();
    let speed: VariableId = variables.push(variable(0, None));
    let height = variables.push(variable(1, None));
    let gravity = variables.push(variable(2, Some(9.81)));
    let mut relations = IdVec::new();
    relations.push(relation("fall".into(), vec![speed], vec![height, gravity], false));
    let mut signals = IdVec::new();
    let raw = signals.push(signal("raw".into(), height, true, Vec::new()));
    let smooth = signals.push(signal("smooth".into(), height, true, vec![raw]));
    let computed = signals.push(signal("computed".into(), speed, true, vec![raw]));
    let scale = signals.push(signal("scale".into(), gravity, true, Vec::new()));
    let mut knowledge = KnowledgeBase::from_parts(variables, relations, signals, IdVec::new());
    let structure = Structure::new(&knowledge);
    assert_eq!(structure.equations()[Id::from_index(0)].variables, [speed, height]);
    assert_eq!(structure.of_signal(smooth), None, "no witness of its own");
    let computed = structure.of_signal(computed).unwrap();
    assert_eq!(structure.equations()[computed].variables, [speed, height]);
    let scale = structure.of_signal(scale).unwrap();
    assert_eq!(structure.equations()[scale].variables, [], "compared with the constant");
    let sets = structure.overdetermined_sets(LIMITS).sets;
    assert_eq!(sets.iter().map(bits).collect::<Vec<_>>(), [1 << scale.index(), 0b111]);
    knowledge.set_available(raw, false);
    let structure = Structure::new(&knowledge);
    assert_eq!(structure.of_signal(raw), None);
    assert_eq!(structure.overdetermined_sets(LIMITS).sets.len(), 1, "only the constant is left");
}

/// A model in which every equation contains every variable.
fn complete(equations: usize, variables: usize) -> KnowledgeBase {
    let mut all = IdVec::new();
    (0..variables).for_each(|at| _ = all.push(variable(at, None)));
    let outputs: Vec<VariableId> = all.ids().collect();
    let mut relations = IdVec::new();
    for at in 0..equations {
        relations.push(relation(format!("r{at}"), outputs.clone(), outputs.clone(), true));
    }
    KnowledgeBase::from_parts(all, relations, IdVec::new(), IdVec::new())
}

/// A model of variables with a number of signals each, with or without a chain of relations between them.
fn carried(variables: usize, signals: usize, is_chain: bool) -> KnowledgeBase {
    let mut all: IdVec<VariableId, Variable> = IdVec::new();
    (0..variables).for_each(|at| _ = all.push(variable(at, None)));
    let (mut relations, mut carriers) = (IdVec::new(), IdVec::new());
    let names: Vec<VariableId> = all.ids().collect();
    for pair in names.windows(2).filter(|_| is_chain) {
        relations.push(relation("r".into(), vec![pair[0]], vec![pair[1]], false));
    }
    for id in all.ids() {
        (0..signals).for_each(|at| _ = carriers.push(signal(format!("s{at}"), id, true, Vec::new())));
    }
    KnowledgeBase::from_parts(all, relations, carriers, IdVec::new())
}

#[test]
fn complete_structures_have_binomially_many_sets() {
    let structure = Structure::new(&complete(12, 5));
    assert_eq!(structure.overdetermined_sets(LIMITS).sets.len(), 924, "6 of 12");
    assert_eq!(structure.test_supports(LIMITS).sets.len(), 924);
    assert_eq!(structure.isolability(LIMITS).classes().len(), 12);
}

#[test]
fn parts_without_connection_cost_a_sum() {
    let structure = Structure::new(&carried(2_000, 2, false));
    let found = structure.overdetermined_sets(LIMITS);
    assert_eq!((found.sets.len(), found.stop), (2_000, StopReason::Complete));
    assert_eq!(structure.test_supports(LIMITS).sets.len(), 2_000);
    assert!(found.expanded < 1_000_000, "{} edges", found.expanded);
    assert_eq!(structure.isolability(LIMITS).classes().len(), 2_000);
}

#[test]
fn a_limit_stops_the_search_and_what_is_there_is_right() {
    let limits = Limits { expansions: u64::MAX, states: 300 };
    for model in [complete(40, 20), carried(1, 1_000, false), carried(40, 3, true)] {
        let structure = Structure::new(&model);
        for found in [structure.overdetermined_sets(limits), structure.test_supports(limits)] {
            assert_eq!((found.sets.len(), found.stop), (300, StopReason::LimitStates));
            for set in &found.sets {
                let holds: std::collections::BTreeSet<VariableId> =
                    set.iter().flat_map(|id| structure.equations()[id].variables.clone()).collect();
                assert!(set.len() > holds.len());
            }
        }
    }
}

#[test]
fn the_limit_of_expansions_holds_for_every_search() {
    for model in [complete(300, 150), carried(1, 20_000, false), carried(5_000, 2, true)] {
        let structure = Structure::new(&model);
        let edges: usize = structure.equations().iter().map(|equation| 1 + equation.variables.len()).sum();
        let limits = Limits { expansions: 1_000_000, states: usize::MAX };
        let isolability = structure.isolability(limits);
        assert!(isolability.classes().iter().map(Vec::len).sum::<usize>() == structure.equations().len());
        let sets = [structure.overdetermined_sets(limits), structure.test_supports(limits)];
        let ends = sets.iter().map(|found| (found.stop, found.expanded));
        for (stop, expanded) in ends.chain([(isolability.stop, isolability.expanded)]) {
            assert_eq!(stop, StopReason::LimitExpansions);
            assert!(expanded < limits.expansions + 10 * edges as u64, "{expanded} of {edges} edges");
        }
    }
}

/// In a chain, any two signals contradict each other in exactly one way.
#[test]
fn much_redundancy_is_no_hindrance() {
    for (variables, signals) in [(5, 3), (10, 3), (20, 1), (1, 100)] {
        let structure = Structure::new(&carried(variables, signals, true));
        let count = variables * signals;
        for found in [structure.overdetermined_sets(LIMITS), structure.test_supports(LIMITS)] {
            assert_eq!((found.sets.len(), found.stop), (count * (count - 1) / 2, StopReason::Complete));
            assert!(found.expanded < 5_000_000, "{} edges", found.expanded);
        }
    }
}
