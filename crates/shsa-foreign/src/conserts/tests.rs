//! Small certificates of our own, and the public ones where they are available.

use super::{compose, read};
use shsa_core::assurance::{
    Certificates, Demand, Evaluation, Evidence, EvidenceId, Guarantee, Quantifier, Service, ServiceId,
    ServiceKind, System, Tree, Verdict,
};
use shsa_core::interval::{Interval, Truth};
use shsa_core::knowledge::Id;
use shsa_core::statement::{Content, FailureMode, Statement};
use shsa_drawing::case::prolog;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

const WHEEL: &str = "
guarantees:
  - id: SpeedGood
    dimensions:
      - Numeric: { type: Deviation, covered: [ { Inclusive: { start: 0.0, end: 0.3 } } ], subset: Guarantee, uom: m/s }
evidence:
  - { id: Cool, description: bearing below 90 degrees, dimension: { Binary: { type: Cool } } }
demands: []
gates: []
tree_propagations: [ { from: Cool, to: SpeedGood } ]
required_services: []
provided_services: [ { id: Wheel, functional_service_type: Speed, guarantees: [SpeedGood] } ]
";

const USER: &str = "
guarantees: [ { id: Control, dimensions: [ { Binary: { type: Control } } ] } ]
evidence: []
demands:
  - id: Speed
    dimensions:
      - Numeric: { type: Deviation, covered: [ { RANGE: { start: 0, end: 1.08 } } ], subset: Guarantee, uom: km/h }
gates: [ { id: G, function: Or } ]
tree_propagations: [ { from: Speed, to: G }, { from: G, to: Control } ]
required_services: [ { id: S, functional_service_type: Speed, demands: [Speed] } ]
provided_services: [ { id: C, functional_service_type: Control, guarantees: [Control] } ]
";

/// Whether the user's guarantee holds while the wheel is cool.
#[track_caller]
fn check(user: &str, expected: Verdict) {
    for turned in [false, true] {
        let mut files = vec![read(WHEEL, "wheel"), read(user, "user")];
        if turned {
            files.reverse();
        }
        assert!(files.iter().all(|(_, report)| report.ok()));
        let system = System::new(compose(files.into_iter().map(|(rows, _)| rows).collect())).unwrap();
        let mut evaluation = Evaluation::new(&system);
        let rows = system.certificates();
        rows.evidence.ids().for_each(|id| evaluation.set(&system, id, Truth::True));
        let control = rows.guarantees.enumerate().find(|(_, row)| row.name == "Control").unwrap().0;
        assert_eq!(evaluation.guarantee(&system, control), expected);
    }
}

#[test]
fn the_order_of_files_does_not_matter_and_an_open_bound_is_not_touched() {
    check(&USER.replace("RANGE", "Inclusive"), Verdict::Holds);
    check(&USER.replace("RANGE", "Exclusive"), Verdict::Refused);
}

#[track_caller]
fn check_problems(text: &str, expected: &[&str]) {
    let (_, report) = read(text, "a.yml");
    let reported = report.diagnostics.iter().map(|it| format!("{}:{} {}", it.line, it.column, it.message));
    assert_eq!(reported.collect::<Vec<_>>(), expected);
}

#[test]
fn what_nothing_defines_is_reported_with_its_place() {
    check_problems(
        &WHEEL.replace("from: Cool", "from: Cold"),
        &["10:30 no evidence, demand or gate `Cold` is defined"],
    );
    check_problems(
        &WHEEL.replace("guarantees: [SpeedGood]", "guarantees: [Fast]"),
        &["12:80 no guarantee `Fast` is defined"],
    );
    assert!(read(&WHEEL.replace("guarantees: [SpeedGood]", "guarantees: [Fast]"), "a.yml").1.ok());
    assert!(!read(&WHEEL.replace("from: Cool", "from: Cold"), "a.yml").1.ok());
    let circle = WHEEL.replace("gates: []", "gates: [ { id: A, function: And } ]");
    let circle = circle.replace("from: Cool, to: SpeedGood", "from: A, to: A }, { from: A, to: SpeedGood");
    check_problems(&circle, &["10:30 the condition of `A` never ends"]);
}

#[test]
fn hostile_texts_are_bounded() {
    for text in [
        "<",
        "<a",
        "<a b=",
        "<a b='&#xFFFFFFFF;'/>",
        "<!--",
        "</a>",
        "<a></b>",
        "<a/><a/>",
        "",
        "a: [",
        "<é ü='ß'>",
    ] {
        let (rows, _) = read(text, "x");
        assert!(rows.guarantees.is_empty());
    }
    assert!(!read(&"<a>".repeat(100_000), "x").1.ok());
    // Each gate twice below the next one: 2^40 leaves when written out.
    let gates: String = (0..40).map(|at| format!("{{ id: g{at}, function: And }}, ")).collect();
    let arrow =
        |at: usize| format!("{{ from: g{at}, to: g{} }}, {{ from: g{at}, to: g{} }}, ", at + 1, at + 1);
    let arrows: String = (0..39).map(arrow).collect();
    let text = WHEEL.replace("gates: []", &format!("gates: [ {gates} ]"));
    let text = text.replace("from: Cool, to: SpeedGood }", &format!("from: g39, to: SpeedGood }}, {arrows}"));
    let (rows, report) = read(&text.replace(", ]", " ]"), "x");
    assert!(!report.ok() && rows.guarantees.len() == 1);
}

const TRUCK: &str = r#"<?xml version="1.0"?><!-- a truck --><a:System name="Truck"><configurations name="One"><conSert>
<guarantees name="G"><integrityLevel asilLevel="ASIL_B"/><safetyProperties>
  <refinement name="Speed Deviation is bound to &lt;= 3.6 km/h"/><safetyPropertyType name="TooHigh"/></safetyProperties></guarantees>
<runtimeEvidence name="E1" description="Delay bound to &lt; 300 ms"/><runtimeEvidence name="E2" description="healthy"/>
<gates name="Or" gateType="OR"/><invariant/>
<guaranteePropagations sourceElement="//@configurations.0/@conSert/@runtimeEvidence.0" targetElement="//@configurations.0/@conSert/@gates.0"/>
<guaranteePropagations sourceElement="//@configurations.0/@conSert/@gates.0" targetElement="//@configurations.0/@conSert/@guarantees.0"/>
<guaranteePropagations sourceElement="//@configurations.0/@conSert/@runtimeEvidence.1" targetElement="//@configurations.0/@conSert/@invariant"/>
</conSert><providedServices guarantees="//@configurations.0/@conSert/@guarantees.0"><functionalServiceType name="Speed"/></providedServices>
</configurations></a:System>"#;

#[test]
fn a_model_of_safetbox_keeps_level_failure_bound_and_invariant() {
    let (rows, report) = read(TRUCK, "truck.model");
    assert!(report.ok(), "{}", report.render(false));
    let given = rows.guarantees.iter().next().unwrap();
    assert_eq!(given.statement.level, rows.scales.level("asil", "B"));
    let [property] = given.statement.properties.as_slice() else { panic!("one property") };
    assert_eq!(
        (property.name.as_str(), property.mode),
        ("Speed Deviation is bound to", Some(FailureMode::Value))
    );
    let Content::Numeric { ranges, .. } = &property.content else { panic!("a number") };
    assert!((ranges[0].hi() - 1.0).abs() < 1e-9);
    let [delay, healthy] = [0, 1].map(EvidenceId::from_index);
    assert_eq!(given.when, Tree::All(vec![Tree::Evidence(healthy), Tree::Evidence(delay)]));
    let truth = |measured| rows.evidence[delay].truth(Interval::point(measured));
    assert_eq!([truth(0.2), truth(0.3)], [Truth::True, Truth::False]);
}

#[test]
fn texts_that_are_cut_or_changed_anywhere_are_read_to_an_end() {
    for whole in [WHEEL, TRUCK] {
        for at in (0..whole.len()).filter(|&at| whole.is_char_boundary(at)) {
            let (_, _) = read(&whole[..at], "cut");
            for other in ["<", "\"", "&", "[", "\n", "é"] {
                let _ = read(&[&whole[..at], other, &whole[at + 1..]].concat(), "changed");
            }
        }
    }
}

/// Random conditions that depend on each other: services ask services, cycles included.
fn random_system(random: &mut impl FnMut(usize) -> usize) -> System {
    let mut rows = Certificates::default();
    let services = 2 + random(4);
    for at in 0..services {
        rows.services.push(Service { name: format!("s{at}\n:- halt."), kind: ServiceKind::Application });
    }
    let says = |random: &mut dyn FnMut(usize) -> usize| Statement {
        service: ["t", "u"][random(2)].into(),
        level: rows.scales.level("sil", ["1", "2", "3"][random(3)]),
        properties: Vec::new(),
    };
    for at in 0..services {
        let service = ServiceId::from_index(at);
        let mut leaves = Vec::new();
        for _ in 0..1 + random(2) {
            let row = Evidence { name: "e\n:- halt.".into(), service, within: None, max_age: None };
            leaves.push(Tree::Evidence(rows.evidence.push(row)));
            let quantifier = [Quantifier::Any, Quantifier::All][random(4) / 3];
            let of = (0..random(4)).map(|_| ServiceId::from_index(random(services))).collect();
            let row = Demand { name: "d".into(), service, statement: says(random), of, quantifier };
            leaves.push(Tree::Demand(rows.demands.push(row)));
        }
        for _ in 0..1 + random(3) {
            let parts: Vec<Tree> = (0..random(4)).map(|_| leaves[random(leaves.len())].clone()).collect();
            let inner = Tree::Any(parts.iter().take(2).cloned().collect());
            let when = match random(4) {
                0 => Tree::All(vec![inner, leaves[random(leaves.len())].clone()]),
                1 => Tree::All(parts),
                2 => Tree::Any(parts),
                _ => Tree::AtLeast(2, parts),
            };
            rows.guarantees.push(Guarantee { name: "g".into(), service, statement: says(random), when });
        }
    }
    System::new(rows).unwrap()
}

/// What SWI-Prolog derives from a program: `g(GUARANTEE)` and `d(DEMAND)`; `None`, with a loud message, where there is no SWI-Prolog.
fn derived(program: &str) -> Option<BTreeSet<String>> {
    let all = "forall(guarantee(G), (write(g(G)), nl)), forall(demand(D), (write(d(D)), nl)), halt";
    let mut swipl = match Command::new("swipl")
        .args(["-q", "-g", &format!("load_files(user, [stream(user_input)]), {all}")])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
    {
        Ok(swipl) => swipl,
        Err(error) => {
            let _ =
                writeln!(std::io::stderr(), "SKIPPED: swipl: {error}: install SWI-Prolog (swi-prolog-nox)");
            return None;
        }
    };
    swipl.stdin.take().unwrap().write_all(program.as_bytes()).unwrap();
    let output = swipl.wait_with_output().unwrap();
    assert!(output.stderr.is_empty(), "{}\n{program}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8(output.stdout).unwrap().lines().map(str::to_owned).collect())
}

/// Holds an evaluation against SWI-Prolog; gives how many guarantees and demands hold.
#[track_caller]
fn agrees_with_prolog(system: &System, evaluation: &Evaluation) -> Option<usize> {
    let (rows, program) = (system.certificates(), prolog::write(system, evaluation));
    let theirs = derived(&program)?;
    let guarantees = rows.guarantees.ids().filter(|&id| evaluation.guarantee(system, id) == Verdict::Holds);
    let demands = rows.demands.ids().filter(|&id| evaluation.demand(system, id) == Verdict::Holds);
    let ours: BTreeSet<String> = guarantees
        .map(|id| format!("g({})", id.index()))
        .chain(demands.map(|id| format!("d({})", id.index())))
        .collect();
    assert_eq!(theirs, ours, "{program}");
    Some(ours.len())
}

fn numbers(mut state: u64) -> impl FnMut(usize) -> usize {
    move |end| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % end
    }
}

fn evaluated(system: &System, mut truth: impl FnMut() -> Truth) -> Evaluation {
    let mut evaluation = Evaluation::new(system);
    system.certificates().evidence.ids().for_each(|id| evaluation.set(system, id, truth()));
    evaluation
}

const TRUTHS: [Truth; 3] = [Truth::True, Truth::False, Truth::Unknown];

#[test]
fn swi_prolog_derives_the_same() {
    let mut random = numbers(7);
    let mut held = 0;
    for _ in 0..40 {
        let system = random_system(&mut random);
        let evaluation = evaluated(&system, || TRUTHS[random(3)]);
        let Some(count) = agrees_with_prolog(&system, &evaluation) else { return };
        held += count;
    }
    assert!(held > 40, "only {held} held in all: this compares nothing");
}

/// The public models with the guarantees that meet each demand by the strict rule, and the verdicts of SWI-Prolog; prints SKIPPED where the models are absent.
#[test]
fn public_models_are_told_apart_as_recorded() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/reference/conserts");
    let Ok(text) = std::fs::read_to_string(folder.join("compositions.json")) else {
        let _ = writeln!(std::io::stderr(), "SKIPPED: the public certificates are absent");
        return;
    };
    let recorded: serde_json::Value = serde_json::from_str(&text).unwrap();
    let mut random = numbers(11);
    for composition in recorded["compositions"].as_array().unwrap() {
        let files = composition["files"].as_array().unwrap().iter().map(|file| file.as_str().unwrap());
        let mut parts = Vec::new();
        let mut origin = Vec::new();
        for file in files {
            let (rows, _) = read(&std::fs::read_to_string(folder.join(file)).unwrap(), file);
            origin.extend(rows.services.iter().map(|_| file));
            parts.push(rows);
        }
        let system = System::new(compose(parts)).unwrap();
        let rows = system.certificates();
        let name = |service: ServiceId, name: &str| format!("{}#{name}", origin[service.index()]);
        let ours: BTreeMap<String, BTreeSet<String>> = rows
            .demands
            .enumerate()
            .map(|(id, row)| {
                let by =
                    system.matches(id).map(|it| name(rows.guarantees[it].service, &rows.guarantees[it].name));
                (name(row.service, &row.name), by.collect())
            })
            .collect();
        let expected: BTreeMap<String, BTreeSet<String>> =
            serde_json::from_value(composition["matches"].clone()).unwrap();
        assert_eq!(ours, expected, "{}", composition["files"]);
        let _ = agrees_with_prolog(&system, &evaluated(&system, || Truth::True));
        let _ = agrees_with_prolog(&system, &evaluated(&system, || TRUTHS[random(3)]));
    }
    for (file, problems) in [("conserts-rs/Truck.model", 0), ("fabos/robot.yml", 3), ("fabos/camera.yml", 0)]
    {
        let (_, report) = read(&std::fs::read_to_string(folder.join(file)).unwrap(), file);
        assert_eq!(report.diagnostics.len(), problems, "{}", report.render(false));
        assert!(report.ok(), "it loads, with warnings: {}", report.render(false));
    }
    for (file, place) in
        [("conserts-rs/InvalidCovered.yml", (13, 18)), ("conserts-rs/InvalidGuarantee.yml", (7, 5))]
    {
        let (_, report) = read(&std::fs::read_to_string(folder.join(file)).unwrap(), file);
        let first = report.diagnostics.first().unwrap();
        assert_eq!((first.line, first.column), place, "{}", report.render(false));
    }
}
