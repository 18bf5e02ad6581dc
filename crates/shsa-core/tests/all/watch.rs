//! The ways of knowing that an engine watches: bounded, chosen, within a cost, and one for each measurement.

use crate::driven::text;
use shsa_core::analysis::{self, Analysis, analyze};
use shsa_core::engine::{Engine, Input, Options, WatchBudget};
use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, Id, KnowledgeBase, RelationDraft, Severity, SignalDraft, SignalId, SignalSet,
    SourceParts, VariableDraft, build,
};
use shsa_core::monitor::Residual;
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time};
use shsa_core::trust::Verdict;
use std::collections::BTreeSet;

/// Variables, equations, and signals as `name: variable` or `name: variable < source`.
fn draft(variables: &[&str], equations: &[&str], signals: &[&str]) -> Draft {
    let variable = |name: &&str| VariableDraft { name: text(*name), ..VariableDraft::default() };
    let relation = |(at, equation): (usize, &&str)| RelationDraft {
        name: text(format!("r{at}")),
        body: BodyDraft::Equation(text(*equation)),
        directions: None,
        condition: None,
        error: None,
        learn: Vec::new(),
        properties: Vec::new(),
    };
    let signal = |line: &&str| {
        let (line, source) =
            line.split_once('<').map_or((*line, None), |(line, source)| (line, Some(source)));
        let (name, variable) = line.split_once(':').unwrap();
        SignalDraft {
            name: text(name),
            variable: Some(text(variable.trim())),
            source: source.map(|source| text(source.trim())),
            source_parts: source.map(|source| parts(source.trim())).unwrap_or_default(),
            rate: Some(text("10 Hz")),
            value_error: Some(Bounds::One(text("0.5"))),
            ..SignalDraft::default()
        }
    };
    Draft {
        variables: variables.iter().map(variable).collect(),
        relations: equations.iter().enumerate().map(relation).collect(),
        signals: signals.iter().map(signal).collect(),
        ..Draft::default()
    }
}

/// A simple grammar of sources: the text before a bracket is a list.
fn parts(source: &str) -> SourceParts {
    SourceParts { lists: source.find('[').map(|end| 0..end).into_iter().collect(), ..SourceParts::default() }
}

#[track_caller]
fn built(draft: &Draft) -> KnowledgeBase {
    let (knowledge, found) = build(draft);
    assert!(found.iter().all(|found| found.severity != Severity::Error), "{found:?}");
    knowledge
}

/// The knowledge base of these lines, and the notes about its signals.
#[track_caller]
fn noted(variables: &[&str], equations: &[&str], signals: &[&str]) -> (KnowledgeBase, Vec<String>) {
    let (knowledge, found) = build(&draft(variables, equations, signals));
    let notes = found.into_iter().filter(|found| found.severity == Severity::Note);
    (knowledge, notes.map(|found| found.message).collect())
}

fn engine(knowledge: &KnowledgeBase, watch: WatchBudget) -> Engine {
    Engine::new(knowledge.clone(), Options { watch, ..Options::default() })
}

fn analysis(knowledge: &KnowledgeBase, watch: WatchBudget) -> Analysis {
    analyze(knowledge, analysis::Options { watch, addition_steps: 0, ..analysis::Options::default() })
}

/// One number that 200 relations know, each from two of 80 signals.
fn known_in_200_ways() -> KnowledgeBase {
    let names: Vec<String> = (0..80).map(|at| format!("a{at}")).collect();
    let variables: Vec<&str> = names.iter().map(String::as_str).chain(["v"]).collect();
    let equations: Vec<String> = (0..200)
        .map(|at| format!("v = (a{} + a{}) / {}", at / 5, 40 + (at / 5 + at % 5) % 40, 2 + at % 5))
        .collect();
    let signals: Vec<String> = names.iter().map(|name| format!("s{name}: {name}")).collect();
    let equations: Vec<&str> = equations.iter().map(String::as_str).collect();
    let signals: Vec<&str> = signals.iter().map(String::as_str).collect();
    let mut draft = draft(&variables, &equations, &signals);
    // One direction only, so that no other variable is known in many ways.
    draft.relations.iter_mut().for_each(|relation| relation.directions = Some(vec![text("v")]));
    built(&draft)
}

#[test]
fn two_hundred_ways_stay_within_the_budget() {
    let knowledge = known_in_200_ways();
    let (engine, found) =
        (engine(&knowledge, WatchBudget::default()), analysis(&knowledge, WatchBudget::default()));
    assert_eq!(engine.monitor().ways().len(), 32);
    assert!(engine.monitor().residuals().len() <= 32 * 31 / 2);
    let watch = &found.watched[0];
    assert_eq!((found.watched.len(), watch.ways, watch.possible, watch.exact), (1, 32, 200, true));
    // Two signals for each way: 32 ways reach 64 of the 80, and each of them is isolated from the others.
    let shown: SignalSet = knowledge.signals().ids().filter(|&id| found.faults.is_detectable(id)).collect();
    assert_eq!(shown.len(), 64);
    assert_eq!(watch.hidden.iter().filter(|hidden| hidden.undetected).count(), 80 - 64);
    let enough = analysis(&knowledge, WatchBudget { ways: 200, cost: u64::MAX });
    assert!(enough.watched[0].hidden.is_empty());
    assert!(knowledge.signals().ids().all(|id| enough.faults.is_detectable(id)));
}

#[test]
fn a_choice_tells_more_than_the_first_ways() {
    let knowledge = known_in_200_ways();
    let first: BTreeSet<usize> = (0..32).flat_map(|at| [at / 5, 40 + (at / 5 + at % 5) % 40]).collect();
    let found = analysis(&knowledge, WatchBudget::default());
    let shown = knowledge.signals().ids().filter(|&id| found.faults.is_detectable(id)).count();
    assert!(shown > 2 * first.len(), "{shown} against {}", first.len());
}

#[test]
fn watching_costs_no_more_than_it_may() {
    let knowledge = known_in_200_ways();
    let mut last = usize::MAX;
    for cost in [200_000, 20_000, 2_000, 400, 0] {
        let budget = WatchBudget { cost, ..WatchBudget::default() };
        let (engine, found) = (engine(&knowledge, budget), analysis(&knowledge, budget));
        let (ways, watched) = (engine.monitor().ways().len(), &found.watched[0]);
        assert_eq!((ways, watched.ways), (watched.ways, ways));
        assert!(watched.cost <= cost as f64 && ways <= last && ways != 1, "{cost}: {watched:?}");
        last = ways;
    }
    assert_eq!(last, 0);
}

/// Each variable first gets two ways, the expensive one as well as the cheap one.
#[test]
fn a_small_cost_is_dealt_out() {
    let signals: Vec<String> =
        (0..20).map(|at| format!("s{at}: {}", if at < 15 { "x" } else { "y" })).collect();
    let signals: Vec<&str> = signals.iter().map(String::as_str).collect();
    let knowledge = built(&draft(&["x", "y"], &[], &signals));
    let found = analysis(&knowledge, WatchBudget { cost: 1_200, ..WatchBudget::default() });
    let ways: Vec<usize> = found.watched.iter().map(|watch| watch.ways).collect();
    assert!(ways[0] >= 2 && ways[1] >= 2 && ways[0].abs_diff(ways[1]) <= 1, "{ways:?}");
}

#[test]
fn the_choice_is_made_anew_with_a_changed_model() {
    let small = built(&draft(&["x"], &[], &["s0: x", "s1: x", "s2: x"]));
    let many: Vec<String> = (0..50).map(|at| format!("s{at}: x")).collect();
    let many: Vec<&str> = many.iter().map(String::as_str).collect();
    let mut engine = engine(&small, WatchBudget { ways: 4, ..WatchBudget::default() });
    assert_eq!(engine.monitor().ways().len(), 3);
    engine.reload(built(&draft(&["x"], &[], &many)), Time(1));
    // No sensor is left out; each is compared with twelve others.
    assert_eq!((engine.monitor().ways().len(), engine.monitor().residuals().len()), (50, 300));
}

#[test]
fn the_same_field_is_one_witness_whatever_it_is_called() {
    let signals = ["speed: v < odom#twist.x", "knots: k < odom#twist.x", "gnss: v < fix#speed"];
    let (knowledge, notes) = noted(&["v", "k"], &["k = 1.94 * v"], &signals);
    assert_eq!(notes, ["`knots` has the same source as `speed`: it bears no witness for it"]);
    let engine = engine(&knowledge, WatchBudget::default());
    let pairs: Vec<Vec<&str>> = engine
        .monitor()
        .residuals()
        .iter()
        .map(|pair| pair.signals.iter().map(|id| knowledge.signals()[id].name.as_str()).collect())
        .collect();
    assert!(!pairs.is_empty() && pairs.iter().all(|pair| pair == &["speed", "gnss"]), "{pairs:?}");
    let analysis = analysis(&knowledge, WatchBudget::default());
    let id = |name| knowledge.signal(name).unwrap();
    assert!(analysis.faults.is_detectable(id("knots")));
    assert!(!analysis.faults.is_isolable_from(id("speed"), id("knots")));
    let knots = analysis.signals[id("knots")].clone();
    assert_eq!((analysis.is_substitutable(id("knots")), knots.survives), (true, Some(1)));
    // Without the other source there is no comparison.
    let (alone, _) = noted(&["v", "k"], &["k = 1.94 * v"], &signals[..2]);
    assert!(self::engine(&alone, WatchBudget::default()).monitor().residuals().is_empty());
    let analysis = self::analysis(&alone, WatchBudget::default());
    assert_eq!(analysis.unhealed().len(), 2);
}

#[test]
fn two_of_the_same_variable_and_source_are_watched_once() {
    let (knowledge, notes) = noted(&["v"], &[], &["a: v < t#x", "b: v < t#x", "c: v < t#y"]);
    assert_eq!(notes.len(), 1);
    let engine = engine(&knowledge, WatchBudget::default());
    assert_eq!((engine.monitor().ways().len(), engine.monitor().residuals().len()), (2, 1));
}

#[test]
fn an_element_is_derived_from_its_list() {
    let signals =
        ["all: v < joints#position", "left: k < joints#position[name=left]", "n: v < joints#position[2]"];
    let (knowledge, notes) = noted(&["v", "k"], &["k = 2 * v"], &signals);
    assert_eq!(notes.len(), 2, "{notes:?}");
    let left = knowledge.signal("left").unwrap();
    assert_eq!(knowledge.signals()[left].derived_from, [knowledge.signal("all").unwrap()]);
    assert_eq!(knowledge.witness(left), left);
}

#[test]
fn other_fields_filters_and_names_are_other_witnesses() {
    for signals in [
        ["a: v < odom#x", "b: v < odom#y"],
        ["a: v < motes#t[mote_id=1]", "b: v < motes#t[mote_id=2]"],
        // Without sources.
        ["a: v", "b: v"],
        ["t[1]: v", "t: v"],
    ] {
        let (knowledge, notes) = noted(&["v"], &[], &signals);
        assert_eq!(notes, [""; 0], "{signals:?}");
        assert_eq!(engine(&knowledge, WatchBudget::default()).monitor().residuals().len(), 1);
    }
}

#[test]
fn what_is_declared_the_other_way_round_makes_no_circle() {
    let mut draft = draft(&["v"], &[], &["a: v < t#x", "b: v < t#x", "c: v < u#x"]);
    draft.signals[0].derived_from = vec![text("b")];
    let (knowledge, found) = build(&draft);
    assert!(found.iter().all(|found| found.severity == Severity::Note), "{found:?}");
    let id = |name| knowledge.signal(name).unwrap();
    assert_eq!((knowledge.witness(id("a")), knowledge.witness(id("b"))), (id("b"), id("b")));
}

/// Two other signals outvote the field; each signal that carries it has failed.
#[test]
fn signals_from_one_source_share_their_verdict() {
    let signals = ["speed: v < odom#x", "knots: k < odom#x", "gnss: v < fix#v", "wheel: v < wheel#v"];
    let (knowledge, _) = noted(&["v", "k"], &["k = 2 * v"], &signals);
    let mut engine = engine(&knowledge, WatchBudget::default());
    for step in 0..60_i64 {
        let now = Time(step * 100_000_000);
        for (at, id) in knowledge.signals().ids().enumerate() {
            let truth = 10.0 + (step as f64 / 10.0).sin() + if at < 2 && step > 20 { 5.0 } else { 0.0 };
            let value = RawValue::Number(if at == 1 { 2.0 * truth } else { truth });
            engine.handle(Input::Observation(Observation { signal: id, stamp: now, received: now, value }));
        }
        engine.handle(Input::Tick(now + Span(1)));
    }
    let verdicts: Vec<Verdict> = knowledge.signals().ids().map(|id| engine.verdict(id)).collect();
    assert_eq!(verdicts, [Verdict::Failed, Verdict::Failed, Verdict::Healthy, Verdict::Healthy]);
}

/// The variables in which signal `s0` is compared.
fn compared_in(knowledge: &KnowledgeBase) -> BTreeSet<String> {
    let engine = engine(knowledge, WatchBudget::default());
    let signal = knowledge.signal("s0").unwrap();
    let monitor = engine.monitor();
    let variable = |pair: &Residual| monitor.way(pair.way).unwrap().variable();
    let is_of_ways = |pair: &&Residual| !monitor.way(pair.other).unwrap().is_range();
    let pairs = monitor.pairs_of(signal).filter(is_of_ways);
    pairs.map(|pair| knowledge.variables()[variable(pair)].name.clone()).collect()
}

#[test]
fn the_same_evidence_is_compared_where_it_tells_most() {
    let all = ["s0: z", "s1: v", "s2: w"];
    let check = |equation: &str, range: Option<(&str, &str)>, expected: &str| {
        let mut draft = draft(&["v", "w", "z"], &[equation], &all);
        draft.variables[1].range = range.map(|(least, most)| (text(least), text(most)));
        assert_eq!(compared_in(&built(&draft)), [expected.to_owned()].into(), "{equation}");
    };
    // Of these, every variable is as good: the first one.
    check("z = v + w", None, "v");
    check("z = v * w", Some(("1", "2")), "v");
    // By a root of either sign, or by a division by what may be zero, values that are too large agree with everything.
    check("z = hypot(v, w)", None, "z");
    check("z = v^2 + w", None, "w");
    check("z = v * w", None, "z");
}

#[test]
fn a_square_that_is_too_large_is_reported() {
    let knowledge = built(&draft(&["v", "z"], &["z = v^2"], &["s0: z", "s1: v", "s2: v"]));
    let mut engine = engine(&knowledge, WatchBudget::default());
    for step in 0..60_i64 {
        for (at, value) in [if step < 30 { 9.0 } else { 30.0 }, 3.0, 3.0].into_iter().enumerate() {
            let now = Time(step * 100_000_000 + at as i64);
            let signal = SignalId::from_index(at);
            let value = RawValue::Number(value);
            engine.handle(Input::Observation(Observation { signal, stamp: now, received: now, value }));
        }
    }
    let verdicts = ["s0", "s1", "s2"].map(|name| engine.verdict(knowledge.signal(name).unwrap()));
    assert_eq!(verdicts, [Verdict::Failed, Verdict::Healthy, Verdict::Healthy]);
}
