//! The monitor of the thesis in small runs of our own; `shsa-bench oracle monitor` and its tests compare it with recorded runs of
//! the published program.

use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, KnowledgeBase, RelationDraft, SignalDraft, SignalId, Text, VariableDraft, build,
};
use shsa_core::monitor::thesis::{ThesisOptions, ThesisRun, ThesisStep};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::substitution::{Substitution, Way};
use shsa_core::time::Time;
use std::collections::BTreeMap;
use std::fmt::Write as _;

fn checked(draft: &Draft) -> KnowledgeBase {
    let (knowledge, problems) = build(draft);
    let errors: Vec<_> =
        problems.iter().filter(|problem| problem.severity == shsa_core::knowledge::Severity::Error).collect();
    assert!(errors.is_empty(), "{errors:?}");
    knowledge
}

fn words(text: &str) -> Text {
    Text { text: text.to_owned(), ..Text::default() }
}

fn variable(name: &str) -> VariableDraft {
    VariableDraft { name: words(name), ..VariableDraft::default() }
}

fn signal(name: &str, variable: &str) -> SignalDraft {
    SignalDraft { name: words(name), variable: Some(words(variable)), ..SignalDraft::default() }
}

fn relation(name: &str, equation: &str, output: &str) -> RelationDraft {
    RelationDraft {
        name: words(name),
        body: BodyDraft::Equation(words(equation)),
        directions: Some(vec![words(output)]),
        condition: None,
        error: None,
        learn: Vec::new(),
        properties: Vec::new(),
    }
}

/// `lidar` and `sonar` carry `x`, `wheel` carries `a` with x = 2 a; plus-minus 0.1 in value, 100 ms in time.
fn own_model() -> Draft {
    let bounded = |name: &str, carries: &str| SignalDraft {
        value_error: Some(Bounds::One(words("0.1"))),
        time_error: Some(Bounds::One(words("100 ms"))),
        ..signal(name, carries)
    };
    Draft {
        variables: vec![variable("x"), variable("a")],
        relations: vec![relation("double", "x = 2 * a", "x")],
        signals: vec![bounded("lidar", "x"), bounded("sonar", "x"), bounded("wheel", "a")],
        ..Draft::default()
    }
}

/// Runs steps of one second over lines such as `lidar 0.5 1.0` (signal, seconds, value), with `-` between steps; compares the
/// number of outputs, the errors and the failed substitution, one line a step.
#[track_caller]
fn check(draft: &Draft, options: ThesisOptions, input: &str, expected: &str) {
    let knowledge = checked(draft);
    let x = knowledge.variable("x").unwrap();
    let direct = knowledge.carriers(x).iter().map(|&signal| Way {
        substitution: Substitution::from_choice(&knowledge, x, &BTreeMap::new()).unwrap(),
        signals: vec![Some(signal)],
    });
    let computed = knowledge.relations().enumerate().map(|(relation, _)| {
        let substitution =
            Substitution::from_choice(&knowledge, x, &BTreeMap::from([(x, relation)])).unwrap();
        let carrier =
            |source: &shsa_core::knowledge::VariableId| knowledge.carriers(*source).first().copied();
        Way { signals: substitution.sources.iter().map(carrier).collect(), substitution }
    });
    let mut run = ThesisRun::new(&knowledge, direct.chain(computed).collect(), options);
    let mut found = String::new();
    let mut end = Time(0);
    for line in input.lines().chain(["-"]) {
        match *line.split(' ').collect::<Vec<_>>() {
            [signal, seconds, value] => {
                let signal: SignalId = knowledge.signal(signal).unwrap();
                let stamp = Time::from_seconds(seconds.parse().unwrap());
                let value = RawValue::Number(value.parse().unwrap());
                run.observe(&knowledge, &Observation { signal, stamp, received: stamp, value });
            }
            _ => {
                end = Time(end.0 + 1_000_000_000);
                writeln!(found, "{}", shown(&run.step(end))).unwrap();
            }
        }
    }
    assert_eq!(found, expected);
}

fn shown(step: &ThesisStep) -> String {
    let errors: Vec<String> = step.errors.iter().map(|error| format!("{error:.2}")).collect();
    let failed = step.failed.map_or("nobody".to_owned(), |failed| format!("{failed} failed"));
    format!("{} outputs, errors {}, {failed}", step.outputs.len(), errors.join(" "))
}

#[test]
fn the_odd_one_out_has_failed() {
    let input = "lidar 0.5 1\nsonar 0.5 1\nwheel 0.5 0.5\n-\nlidar 1.5 1\nsonar 1.5 5\nwheel 1.5 0.5";
    let expected = "3 outputs, errors 0.00 0.00 0.00, nobody\n3 outputs, errors 3.80 7.50 3.70, 1 failed\n";
    check(&own_model(), ThesisOptions::default(), input, expected);
}

#[test]
fn a_tie_names_nobody() {
    let input = "lidar 0.5 1\nsonar 0.5 5";
    check(&own_model(), ThesisOptions::default(), input, "2 outputs, errors 3.80 3.80 0.00, nobody\n");
}

#[test]
fn what_was_true_at_different_times_is_not_compared() {
    let input = "lidar 0.2 1\nsonar 0.5 5\n-\nlidar 1.3 1\nsonar 1.5 5";
    let expected = "2 outputs, errors 0.00 0.00 0.00, nobody\n2 outputs, errors 3.80 3.80 0.00, nobody\n";
    check(&own_model(), ThesisOptions::default(), input, expected);
}

#[test]
fn not_a_number_is_an_error_of_its_source_only() {
    let input = "lidar 0.5 1\nsonar 0.5 nan\nwheel 0.5 0.5\n-\nlidar 1.5 1\nsonar 1.5 1\nwheel 1.5 inf";
    let expected = "3 outputs, errors 0.00 inf 0.00, 1 failed\n3 outputs, errors 0.00 0.00 inf, 2 failed\n";
    check(&own_model(), ThesisOptions::default(), input, expected);
}

#[test]
fn the_buffer_compares_with_the_steps_before() {
    let input = "lidar 0.9 1\n-\nsonar 1.1 5\n-\nwheel 2.5 0.5";
    let alone = "1 outputs, errors 0.00 0.00 0.00, nobody\n";
    check(&own_model(), ThesisOptions::default(), input, &alone.repeat(3));
    let options = ThesisOptions { buffer: 2, ..ThesisOptions::default() };
    let expected = "2 outputs, errors 3.80 3.80 0.00, nobody\n2 outputs, errors 0.00 0.00 0.00, nobody\n";
    check(&own_model(), options, input, &format!("{alone}{expected}"));
}

/// The sonar is wrong in the second of five steps.
const ONE_SPIKE: &str = "\
lidar 0.5 1\nsonar 0.5 1\nwheel 0.5 0.5\n-
lidar 1.5 1\nsonar 1.5 5\nwheel 1.5 0.5\n-
lidar 2.5 1\nsonar 2.5 1\nwheel 2.5 0.5\n-
lidar 3.5 1\nsonar 3.5 1\nwheel 3.5 0.5\n-
lidar 4.5 1\nsonar 4.5 1\nwheel 4.5 0.5";

#[test]
fn the_average_spreads_a_spike() {
    let expected = "\
3 outputs, errors 0.00 0.00 0.00, nobody
3 outputs, errors 1.90 3.75 1.85, 1 failed
3 outputs, errors 1.27 2.50 1.23, 1 failed
3 outputs, errors 1.27 2.50 1.23, 1 failed
3 outputs, errors 0.00 0.00 0.00, nobody
";
    check(&own_model(), ThesisOptions { average: 3, ..ThesisOptions::default() }, ONE_SPIKE, expected);
}

#[test]
fn the_median_removes_a_spike() {
    let expected = "\
3 outputs, errors 0.00 0.00 0.00, nobody
3 outputs, errors 1.90 3.75 1.85, 1 failed
3 outputs, errors 0.00 0.00 0.00, nobody
3 outputs, errors 0.00 0.00 0.00, nobody
3 outputs, errors 0.00 0.00 0.00, nobody
";
    check(&own_model(), ThesisOptions { median: 3, ..ThesisOptions::default() }, ONE_SPIKE, expected);
}

#[test]
fn signals_may_come_and_go() {
    let input = "lidar 0.5 1\nsonar 0.5 1\n-\nlidar 1.5 1\n-\n-\nlidar 3.5 1\nsonar 3.5 1\nwheel 3.5 2.5";
    let expected = "\
2 outputs, errors 0.00 0.00 0.00, nobody
1 outputs, errors 0.00 0.00 0.00, nobody
0 outputs, errors 0.00 0.00 0.00, nobody
3 outputs, errors 3.70 3.70 7.40, 2 failed
";
    check(&own_model(), ThesisOptions::default(), input, expected);
}

#[test]
fn a_relation_whose_constraint_does_not_hold_gives_nothing() {
    let mut draft = own_model();
    draft.relations[0].condition = Some(words("a > 1"));
    let input = "lidar 0.5 1\nwheel 0.5 0.5\n-\nlidar 1.5 1\nwheel 1.5 2.5";
    let expected = "1 outputs, errors 0.00 0.00 0.00, nobody\n2 outputs, errors 3.70 0.00 3.70, nobody\n";
    check(&draft, ThesisOptions::default(), input, expected);
}

#[test]
fn too_many_combinations_are_reported() {
    let mut draft = own_model();
    draft.variables.push(variable("b"));
    draft.relations.push(relation("sum", "x = a + b", "x"));
    draft.signals.push(signal("other wheel", "b"));
    let knowledge = checked(&draft);
    let (x, sum) = (knowledge.variable("x").unwrap(), knowledge.relations().ids().next_back().unwrap());
    let substitution = Substitution::from_choice(&knowledge, x, &BTreeMap::from([(x, sum)])).unwrap();
    let ways = Way::choices(&knowledge, &substitution, |_| true, 9);
    let mut run = ThesisRun::new(&knowledge, ways, ThesisOptions::default());
    let mut step = |count: usize| {
        for name in ["wheel", "other wheel"].repeat(count) {
            let (signal, stamp) = (knowledge.signal(name).unwrap(), Time(0));
            run.observe(
                &knowledge,
                &Observation { signal, stamp, received: stamp, value: RawValue::Number(1.0) },
            );
        }
        let step = run.step(Time(0));
        (step.outputs.len(), step.truncated)
    };
    assert_eq!([step(2), step(100), step(101)], [(4, false), (10_000, false), (10_000, true)]);
}

/// The published program stores both values in one place, and compares one of them with itself.
#[test]
fn one_variable_read_from_two_signals_is_two_ways() {
    let mut draft = own_model();
    draft.signals.retain(|signal| signal.name.text != "sonar");
    draft.signals.push(signal("second wheel", "a"));
    let knowledge = checked(&draft);
    let x = knowledge.variable("x").unwrap();
    let double = knowledge.relations().ids().next().unwrap();
    let substitution = Substitution::from_choice(&knowledge, x, &BTreeMap::from([(x, double)])).unwrap();
    let ways = Way::choices(&knowledge, &substitution, |_| true, 9);
    let mut run = ThesisRun::new(&knowledge, ways, ThesisOptions::default());
    for (name, value) in [("wheel", 0.5), ("second wheel", 2.5)] {
        let (signal, stamp) = (knowledge.signal(name).unwrap(), Time(0));
        run.observe(
            &knowledge,
            &Observation { signal, stamp, received: stamp, value: RawValue::Number(value) },
        );
    }
    assert_eq!(shown(&run.step(Time(1))), "2 outputs, errors 3.80 3.80, nobody");
}

/// Three compasses that count to 4, one of them a quarter turn ahead.
fn compasses() -> Draft {
    let wraps = |name: &str| VariableDraft { wraps: Some(words("4")), ..variable(name) };
    Draft {
        variables: vec![wraps("x"), wraps("a")],
        relations: vec![relation("ahead", "x = a - 1", "x")],
        signals: vec![signal("one", "x"), signal("other", "x"), signal("ahead", "a")],
        ..Draft::default()
    }
}

#[test]
fn what_wraps_is_compared_the_shorter_way_round() {
    let input = "one 0.5 3.5\nother 0.5 0.5\nahead 0.5 0.75\n-\none 1.5 0.1\nother 1.5 2.1\nahead 1.5 1.1";
    let expected = "3 outputs, errors 1.25 1.75 1.00, 1 failed\n3 outputs, errors 2.00 4.00 2.00, 1 failed\n";
    check(&compasses(), ThesisOptions::default(), input, expected);
}
