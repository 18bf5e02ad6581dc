//! The faults that comparisons isolate, compared with the definition of structural isolability, on random structures.
//!
//! A fault is detectable when its equation is in the overdetermined part, and isolable from another one when it still is there
//! without the other's equation (Krysander and Frisk 2008, doi:10.1109/TSMCA.2008.2001048).

use crate::driven::text;
use crate::plan_support::Random;
use shsa_core::analysis::{Analysis, Gap, Obstacle, Options, analyze};
use shsa_core::engine::{Engine, WatchBudget};
use shsa_core::knowledge::{
    BodyDraft, Draft, Id, KnowledgeBase, RelationDraft, RelationId, Severity, SignalDraft, SignalId,
    SignalSet, Text, VariableDraft, VariableId, build,
};
use shsa_core::substitution::Way;
use shsa_core::trust::Component;
use std::collections::BTreeSet;

const OPTIONS: Options = Options {
    only_runnable: false,
    steps: 10_000_000,
    addition_steps: 0,
    watch: WatchBudget { ways: 64, cost: u64::MAX },
};

/// An equation between variables; a signal has a single variable.
#[derive(Clone, Debug)]
struct Row {
    variables: Vec<usize>,
    /// The variables that the equation is solved for.
    solved_for: Vec<usize>,
}

fn names(places: &[usize]) -> Vec<Text> {
    places.iter().map(|at| text(format!("x{at}"))).collect()
}

/// Relations first, as a structure numbers its equations; `body` gives the content of each.
fn built(variables: usize, rows: &[Row], may_fail: bool, body: impl Fn(&Row) -> BodyDraft) -> KnowledgeBase {
    let variable = |at: usize| VariableDraft { name: text(format!("x{at}")), ..VariableDraft::default() };
    let mut draft = Draft { variables: (0..variables).map(variable).collect(), ..Draft::default() };
    let prior =
        || if may_fail { vec![(text("prior".to_owned()), text("0.01".to_owned()))] } else { Vec::new() };
    for (at, row) in rows.iter().enumerate() {
        if let [one] = row.variables[..] {
            let (name, variable) = (text(format!("s{at}")), names(&[one]).pop());
            draft.signals.push(SignalDraft { name, variable, properties: prior(), ..SignalDraft::default() });
            continue;
        }
        let body = body(row);
        let is_equation = matches!(body, BodyDraft::Equation(_));
        draft.relations.push(RelationDraft {
            name: text(format!("r{at}")),
            body,
            directions: is_equation.then(|| names(&row.solved_for)),
            condition: None,
            error: None,
            learn: Vec::new(),
            properties: prior(),
        });
    }
    let (knowledge, found) = build(&draft);
    assert!(found.iter().all(|found| found.severity != Severity::Error), "{found:?}");
    knowledge
}

/// The structure alone; every equation may be faulty.
fn knowledge(variables: usize, rows: &[Row]) -> KnowledgeBase {
    built(variables, rows, true, |row| BodyDraft::Structure {
        outputs: names(&row.solved_for),
        inputs: names(&row.variables),
    })
}

/// The same system with formulas: each relation is a sum.
fn runnable(variables: usize, rows: &[Row]) -> KnowledgeBase {
    built(variables, rows, false, |row| {
        let of: Vec<String> = row.variables.iter().map(|at| format!("x{at}")).collect();
        BodyDraft::Equation(text(format!("{} = {}", of[0], of[1..].join(" + "))))
    })
}

/// The number of variables that the rows can determine: a maximum matching, by augmenting paths.
fn rank(rows: &[&Row], variables: usize) -> usize {
    fn augment(rows: &[&Row], row: usize, seen: &mut BTreeSet<usize>, owner: &mut [Option<usize>]) -> bool {
        for &variable in &rows[row].variables {
            if seen.insert(variable) && owner[variable].is_none_or(|other| augment(rows, other, seen, owner))
            {
                owner[variable] = Some(row);
                return true;
            }
        }
        false
    }
    let mut owner = vec![None; variables];
    (0..rows.len()).filter(|&row| augment(rows, row, &mut BTreeSet::new(), &mut owner)).count()
}

/// Whether an equation is overdetermined when another one is left out: the others determine as much without it.
fn is_over(rows: &[Row], variables: usize, row: usize, without: Option<usize>) -> bool {
    let but = |left_out: &[Option<usize>]| -> usize {
        let kept = rows.iter().enumerate().filter(|(at, _)| !left_out.contains(&Some(*at)));
        rank(&kept.map(|(_, row)| row).collect::<Vec<_>>(), variables)
    };
    but(&[without]) == but(&[without, Some(row)])
}

fn component(rows: &[Row], at: usize) -> Component {
    let relations = rows.iter().filter(|row| row.variables.len() > 1).count();
    match rows[at].variables.len() {
        1 => Component::Signal(SignalId::from_index(at - relations)),
        _ => Component::Relation(RelationId::from_index(at)),
    }
}

/// A random system whose relations may be solved for all of their variables, or for some; relations first.
fn random(seed: u64, all_directions: bool) -> (usize, Vec<Row>) {
    let mut numbers = Random(seed);
    let variables = 3 + numbers.below(5);
    let mut rows = Vec::new();
    for _ in 0..2 + numbers.below(variables + 1) {
        let mut of = BTreeSet::new();
        while of.len() < 2 + usize::from(numbers.chance(0.4)) {
            of.insert(numbers.below(variables));
        }
        let of: Vec<usize> = of.into_iter().collect();
        let mut solved: Vec<usize> =
            of.iter().copied().filter(|_| all_directions || numbers.chance(0.6)).collect();
        if solved.is_empty() {
            solved.push(of[0]);
        }
        rows.push(Row { variables: of, solved_for: solved });
    }
    for _ in 0..2 + numbers.below(variables) {
        let at = numbers.below(variables);
        rows.push(Row { variables: vec![at], solved_for: vec![at] });
    }
    (variables, rows)
}

/// Checks isolation against its definition, except for the gaps. Returns the number of isolable pairs, and the analysis.
#[track_caller]
fn check(variables: usize, rows: &[Row], case: &str) -> (usize, Analysis) {
    let knowledge = knowledge(variables, rows);
    let analysis = analyze(&knowledge, OPTIONS);
    assert!(analysis.limited.is_empty(), "{case}: {:?}", analysis.limited);
    let gap = |fault, from| analysis.gaps.iter().any(|gap| gap.fault == fault && gap.from == from);
    let mut reported = 0;
    for (at, _) in rows.iter().enumerate() {
        let fault = component(rows, at);
        let found = analysis.faults.isolability(fault).unwrap();
        let (shows, expected) = (found.shown_by > 0, is_over(rows, variables, at, None));
        let name = |component| format!("{case}: {component:?} of {rows:?}");
        assert!(!shows || expected, "{} shows against the definition", name(fault));
        assert_eq!(expected && !shows, gap(fault, None), "{} at all", name(fault));
        for other in (0..rows.len()).filter(|&other| other != at) {
            let from = component(rows, other);
            let (is_reported, expected) =
                (found.is_isolable_from(from), is_over(rows, variables, at, Some(other)));
            assert!(!is_reported || expected, "{} from {from:?} against the definition", name(fault));
            let is_gap = shows && expected && !is_reported;
            assert_eq!(is_gap, gap(fault, Some(from)), "{} from {from:?}", name(fault));
            reported += usize::from(is_reported);
        }
    }
    for Gap { fault, from, obstacles } in &analysis.gaps {
        let is_named =
            obstacles.iter().all(|it| matches!(it, Obstacle::Loop { .. } | Obstacle::Direction { .. }));
        assert!(
            is_named && !obstacles.is_empty(),
            "{case}: {fault:?} from {from:?} of {rows:?}: {obstacles:?}"
        );
    }
    (reported, analysis)
}

#[test]
fn what_is_told_apart_is_what_the_definition_says_or_a_gap_names_why_not() {
    let (mut reported, mut gaps, mut loops) = (0, 0, 0);
    for seed in 0..250 {
        for all_directions in [true, false] {
            let (variables, rows) = random(seed, all_directions);
            let (count, analysis) = check(variables, &rows, &format!("seed {seed}, {all_directions}"));
            reported += count;
            gaps += analysis.gaps.len();
            let is_loop = |gap: &&Gap| gap.obstacles.iter().any(|it| matches!(it, Obstacle::Loop { .. }));
            loops += analysis.gaps.iter().filter(is_loop).count();
        }
    }
    assert!(
        reported > 2_000 && gaps > 200 && loops > 80,
        "too simple: {reported} told, {gaps} gaps, {loops} loops"
    );
}

/// An engine compares the ways that the analysis uses.
#[test]
fn what_is_looked_behind_is_watched() {
    let mut behind = 0;
    for seed in 0..200 {
        let (variables, rows) = random(seed, seed % 2 == 0);
        let knowledge = runnable(variables, &rows);
        let analysis = analyze(&knowledge, OPTIONS);
        let options = shsa_core::engine::Options { watch: OPTIONS.watch, ..Default::default() };
        let engine = Engine::new(knowledge.clone(), options);
        let compared: Vec<&SignalSet> =
            engine.monitor().residuals().iter().map(|pair| &pair.signals).collect();
        let comparisons = &analysis.comparisons;
        let counted: Vec<SignalSet> = comparisons.pairs().iter().map(|&it| comparisons.signals(it)).collect();
        assert_eq!(counted.iter().collect::<Vec<_>>(), compared, "seed {seed}");
        let looks_behind = |way: &Way| {
            let passed = way.substitution.steps.iter().map(|step| step.output);
            passed
                .filter(|&output| output != way.substitution.sink)
                .any(|output| knowledge.is_provided(output))
        };
        behind += comparisons.ways().iter().filter(|way| looks_behind(way)).count();
    }
    assert!(behind > 10, "too simple: {behind}");
}

/// In a chain through a measured number, a fault at one end is isolable from one of the middle.
#[test]
fn a_fault_is_isolable_from_one_of_the_number_between_by_looking_behind_it() {
    let row = |of: &[usize]| Row { variables: of.to_vec(), solved_for: of.to_vec() };
    // x0 - x1 - x2, all measured.
    let rows = [row(&[0, 1]), row(&[1, 2]), row(&[0]), row(&[1]), row(&[2])];
    let (_, analysis) = check(3, &rows, "chain");
    let [first, middle, last] = [0, 1, 2].map(SignalId::from_index);
    assert!(analysis.faults.is_isolable_from(first, middle) && analysis.faults.is_isolable_from(first, last));
    assert_eq!(analysis.comparisons.pairs().len(), 3);
}

/// Two relations between the same unknowns must be solved together.
#[test]
fn a_loop_is_named() {
    let row = |of: &[usize]| Row { variables: of.to_vec(), solved_for: of.to_vec() };
    // Two equations for x0 and x1 with measured x2 and x3, and a third one that would show a fault.
    let rows = [row(&[0, 1, 2]), row(&[0, 1, 3]), row(&[0, 1, 4]), row(&[2]), row(&[3]), row(&[4])];
    let (reported, analysis) = check(5, &rows, "loop");
    assert_eq!(reported, 0);
    let expected = Obstacle::Loop {
        relations: [1, 2].map(RelationId::from_index).to_vec(),
        variables: [0, 1].map(VariableId::from_index).to_vec(),
        is_dynamic: false,
    };
    assert_eq!(analysis.gaps[0].from, None);
    // Of equally feasible residuals, the first relation is the one left over.
    assert!(analysis.gaps.iter().any(|gap| gap.obstacles == [expected.clone()]), "{:?}", analysis.gaps);
}
