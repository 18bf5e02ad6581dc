//! How many signals may lie together, beside exact numbers.

use crate::driven::text;
use proptest::prelude::*;
use shsa_core::analysis::{Liar, Options, Withstands, liars};
use shsa_core::knowledge::{
    BodyDraft, Draft, Id, KnowledgeBase, NeedDraft, NeedId, RelationDraft, SignalDraft, VariableDraft, build,
};

/// A linear system: the number of sensors of each variable, and equations by the factor of each variable. The need is of the first one.
#[derive(Clone, Debug)]
struct Linear {
    sensors: Vec<usize>,
    equations: Vec<Vec<(usize, i32)>>,
}

impl Linear {
    fn model(&self) -> KnowledgeBase {
        let variable = |at: usize| VariableDraft { name: text(format!("x{at}")), ..VariableDraft::default() };
        let signal = |(variable, number): (usize, usize)| SignalDraft {
            name: text(format!("s{variable}_{number}")),
            variable: Some(text(format!("x{variable}"))),
            ..SignalDraft::default()
        };
        let relation = |(at, equation): (usize, &Vec<(usize, i32)>)| {
            let terms: Vec<String> = equation[1..]
                .iter()
                .map(|(variable, factor)| format!("({}) * x{variable}", -factor))
                .collect();
            let equation = format!("({}) * x{} = {}", equation[0].1, equation[0].0, terms.join(" + "));
            RelationDraft::new(text(format!("r{at}")), BodyDraft::Equation(text(equation)))
        };
        let draft = Draft {
            variables: (0..self.sensors.len()).map(variable).collect(),
            signals: self.of_sensors().into_iter().map(signal).collect(),
            relations: self.equations.iter().enumerate().map(relation).collect(),
            needs: vec![NeedDraft { variable: text("x0"), ..NeedDraft::default() }],
            ..Draft::default()
        };
        let (knowledge, problems) = build(&draft);
        assert!(problems.iter().all(|problem| problem.message.starts_with("nothing ")), "{problems:?}");
        knowledge
    }

    /// Variable and number of each sensor.
    fn of_sensors(&self) -> Vec<(usize, usize)> {
        let counted = self.sensors.iter().enumerate();
        counted.flat_map(|(variable, &count)| (0..count).map(move |number| (variable, number))).collect()
    }

    /// Whether the equations and these sensors determine the first variable: its unit vector is in the space of their rows.
    fn is_observed_by(&self, sensors: impl Iterator<Item = usize>) -> bool {
        let row = |terms: &[(usize, i32)]| {
            let mut row = vec![0.0; self.sensors.len()];
            terms.iter().for_each(|(variable, factor)| row[*variable] += f64::from(*factor));
            row
        };
        let of_sensors = self.of_sensors();
        let mut rows: Vec<Vec<f64>> = self.equations.iter().map(|equation| row(equation)).collect();
        rows.extend(sensors.map(|at| row(&[(of_sensors[at].0, 1)])));
        let before = rank(rows.clone());
        rows.push(row(&[(0, 1)]));
        rank(rows) == before
    }

    /// The most liars with which twice as many sensors may be taken away, by trying all.
    fn sparsely_observable(&self) -> usize {
        let count = self.of_sensors().len();
        let is_lost = |kept: u32| !self.is_observed_by((0..count).filter(|at| kept & (1 << at) != 0));
        let taken =
            (0..1_u32 << count).filter(|&kept| is_lost(kept)).map(|kept| count - kept.count_ones() as usize);
        // What the equations alone determine, nobody takes away.
        taken.min().map_or(usize::MAX, |taken| taken.saturating_sub(1) / 2)
    }
}

fn rank(mut rows: Vec<Vec<f64>>) -> usize {
    let mut rank = 0;
    for column in 0..rows.first().map_or(0, Vec::len) {
        let Some(pivot) = (rank..rows.len()).find(|&at| rows[at][column].abs() > 1e-9) else { continue };
        rows.swap(rank, pivot);
        let pivot = rows[rank].clone();
        for row in &mut rows[rank + 1..] {
            let factor = row[column] / pivot[column];
            row.iter_mut().zip(&pivot).for_each(|(number, of_pivot)| *number -= factor * of_pivot);
        }
        rank += 1;
    }
    rank
}

fn factor() -> impl Strategy<Value = i32> {
    prop_oneof![Just(-3), Just(-1), Just(1), Just(2)]
}

/// A system whose equations form a tree: each has one variable of those before, and one or two new ones.
fn tree() -> impl Strategy<Value = Linear> {
    let equation = (any::<prop::sample::Index>(), factor(), prop::collection::vec(factor(), 1..3));
    (prop::collection::vec(equation, 0..4), prop::collection::vec(0..4_usize, 9)).prop_map(
        |(shapes, mut sensors)| {
            let (mut variables, mut equations) = (1, Vec::new());
            for (known, own, others) in shapes {
                let mut terms = vec![(known.index(variables), own)];
                terms.extend(others.into_iter().enumerate().map(|(at, factor)| (variables + at, factor)));
                variables += terms.len() - 1;
                equations.push(terms);
            }
            sensors.truncate(variables);
            Linear { sensors, equations }
        },
    )
}

/// Any system: equations of two or three variables.
fn any_system() -> impl Strategy<Value = Linear> {
    let terms = prop::collection::btree_map(0..4_usize, factor(), 2..4);
    let equations = prop::collection::vec(terms, 0..4);
    (prop::collection::vec(0..3_usize, 4), equations).prop_map(|(sensors, equations)| Linear {
        sensors,
        equations: equations.into_iter().map(|terms| terms.into_iter().collect()).collect(),
    })
}

fn withstands(knowledge: &KnowledgeBase, by_cause: bool) -> Withstands {
    liars(knowledge, by_cause, Options::default())[NeedId::from_index(0)].clone()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, ..ProptestConfig::default() })]

    #[test]
    fn of_a_tree_the_number_is_exact(system in tree()) {
        let found = withstands(&system.model(), false);
        prop_assert!(found.exact);
        prop_assert_eq!(found.liars, Some(system.sparsely_observable()));
    }

    /// Where equations have to be solved together, fewer ways are known than there are.
    #[test]
    fn it_is_never_too_high(system in any_system()) {
        prop_assert!(withstands(&system.model(), false).liars <= Some(system.sparsely_observable()));
    }
}

#[test]
fn of_like_sensors_fewer_than_half_may_lie() {
    for count in 1..9 {
        let found = withstands(&Linear { sensors: vec![count], equations: Vec::new() }.model(), false);
        assert_eq!(found.liars, Some((count - 1) / 2));
        assert_eq!((found.coalition.len(), found.is_tie), (count.div_ceil(2), count % 2 == 0));
        // With so many more, one more liar is withstood.
        let more = Linear { sensors: vec![count + found.missing], equations: Vec::new() };
        assert_eq!(withstands(&more.model(), false).liars, Some((count - 1) / 2 + 1));
        let fewer = Linear { sensors: vec![count + found.missing - 1], equations: Vec::new() };
        assert_eq!(withstands(&fewer.model(), false).liars, found.liars);
    }
    let nothing = withstands(&Linear { sensors: vec![0], equations: Vec::new() }.model(), false);
    assert_eq!((nothing.liars, nothing.missing, nothing.coalition.len()), (Some(0), 3, 0));
}

/// A bus that three of five sensors share is one liar for all three.
#[test]
fn a_common_cause_lies_for_all_its_signals() {
    let signal = |at: usize| SignalDraft {
        name: text(format!("s{at}")),
        variable: Some(text("v")),
        shares: if at < 3 { vec![(text("bus"), None)] } else { Vec::new() },
        ..SignalDraft::default()
    };
    let draft = Draft {
        variables: vec![VariableDraft { name: text("v"), ..VariableDraft::default() }],
        signals: (0..5).map(signal).collect(),
        needs: vec![NeedDraft { variable: text("v"), ..NeedDraft::default() }],
        ..Draft::default()
    };
    let knowledge = build(&draft).0;
    assert_eq!(withstands(&knowledge, false).liars, Some(2));
    let found = withstands(&knowledge, true);
    assert_eq!((found.liars, found.coalition.len()), (Some(1), 2));
    let causes =
        |found: &Withstands| found.coalition.iter().filter(|it| matches!(it, Liar::Cause(_))).count();
    assert!(causes(&found) <= 1);
}
