//! `shsa-bench oracle` with small recorded answers written here, and with those of the published programs.
//!
//! The latter lie outside the project; tests without their file print SKIPPED. Intended differences from the published programs
//! are listed below with their reasons; no other difference may occur.

use crate::folder::Folder;
use std::io::Write as _;
use std::path::PathBuf;

const REFERENCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference/");

/// Our differences in the experiments. A tie is no evidence against either: we name neither, the published program names the
/// lowest index.
const EXPERIMENT_DIFFERENCES: &str = "\
generic_value, order abc, buffer 1, run 2, step 6: a tie of 0 and 2 names nobody, not 0
generic_time, order abc, buffer 1, run 3, step 2: a tie of 1 and 2 names nobody, not 1
generic_time, order abc, buffer 2, run 4, step 2: a tie of 1 and 2 names nobody, not 1
generic_time, order abc, buffer 3, run 5, step 2: a tie of 1 and 2 names nobody, not 1
generic_value, order cab, buffer 1, run 8, step 6: a tie of 0 and 2 names nobody, not 0
generic_time, order cab, buffer 1, run 9, step 2: a tie of 1 and 2 names nobody, not 1
generic_time, order cab, buffer 2, run 10, step 2: a tie of 1 and 2 names nobody, not 1
generic_time, order cab, buffer 3, run 11, step 2: a tie of 1 and 2 names nobody, not 1
";

/// Our differences in the unit cases. Ties as above. The published program forgets the time of a relation's result; ours is valid
/// when its inputs are. Values before the first one are unknown to us; the published program takes the first value for them.
const UNIT_DIFFERENCES: &str = "\
time intervals overlap, step 0: substitution 1 has a time
time intervals overlap, step 0: substitution 2 has a time
one itom late, step 0: substitution 1 has a time
one itom late, step 0: substitution 2 has a time
one itom late, step 1: substitution 1 has a time
one itom late, step 1: substitution 2 has a time
time stamped itoms, buffer 2, step 2: a tie of 0 and 1 names nobody, not 0
delay model, one step, step 0: substitution 1 has 0 outputs, not 1
delay model, one step, step 3: a tie of 0 and 1 names nobody, not 0
delay model, two steps, step 0: substitution 1 has 0 outputs, not 1
delay model, two steps, step 1: substitution 1 has 0 outputs, not 1
delay model, two steps, step 4: a tie of 0 and 1 names nobody, not 0
";

/// Two sensors of `a`, and a relation that gives it from `b`; UTILITY is that of the relation.
const SEARCH: &str = r#"{ "format": "shsa-search-golden-1", "models": { "small": {
    "graph": {
        "variables": { "a": { "provided": true }, "b": { "provided": true } },
        "relations": { "r": { "in": ["b"], "out": ["a"] } }
    },
    "roots": { "a": { "dfs": [
        { "relations": [], "utility": 1.0 },
        { "relations": ["r"], "utility": UTILITY }
    ] }, "b": { "dfs": [{ "relations": [], "utility": 1.0 }] } }
} } }"#;

/// Two sensors of `x` that first agree and then disagree; FAILED is the failed one.
const MONITOR: &str = r#"{ "format": "shsa-monitor-unit-1", "cases": [ {
    "label": "small", "domain": "x", "options": {},
    "model": { "functions": [{ "out": "x", "relation": "r", "in": ["a"], "meaning": "x = 2 a" }] },
    "steps": [ {
        "inputs": [
            { "name": "x1", "variable": "x", "v": 10.0, "t": null },
            { "name": "x2", "variable": "x", "v": 10.0, "t": null },
            { "name": "a1", "variable": "a", "v": 7.0, "t": null }
        ],
        "substitutions": [
            { "functions": [{ "out": "x", "name": "equals", "in": ["x1"] }] },
            { "functions": [{ "out": "x", "name": "equals", "in": ["x2"] }] },
            { "functions": [
                { "out": "a", "name": "equals", "in": ["a1"] }, { "out": "x", "name": "r", "in": ["a"] }
            ] }
        ],
        "outputs": [
            { "sidx": 0, "v": 10.0, "t": null }, { "sidx": 1, "v": 10.0, "t": null },
            { "sidx": 2, "v": 14.0, "t": null }
        ],
        "error": [4.0, 4.0, 8.0], "failed": FAILED
    } ]
} ] }"#;

/// A number that is measured once; STATE is its estimate.
const FUSION: &str = r#"{ "format": "shsa-fusion-oracle-1", "linear": [ {
    "label": "small", "A": [[1.0]], "H": [[1.0]], "Q": [[1.0]], "R": [[1.0]], "x0": [0.0], "P0": [[1.0]],
    "tolerance_x": 1e-9, "tolerance_P": 1e-9, "log_likelihood": -2.9682446775387277,
    "steps": [{ "z": [3.0], "x": [STATE], "P": [0.6666666666666666], "nis": 3.0, "dof": 1 }]
} ], "particle": [], "nonlinear": [], "out_of_sequence": [], "gating": [], "masking": [], "intervals": [],
"moving": [], "recursive_average": [], "weighted_by_confidence": [] }"#;

/// A product, planted with its VARIABLES, a signal that only follows at first, and one that is a copy.
const PLANTED: &str = r#"{ "format": "shsa-planted-1", "systems": [ {
    "id": "small", "seed": 5, "duration_s": 200,
    "variables": [
        { "name": "x1", "unit": "V", "make": { "kind": "wander", "mean": 24, "sd": 4, "from_hz": 0.02, "to_hz": 0.2 } },
        { "name": "x2", "unit": "A", "make": { "kind": "levels", "low": 5, "high": 25, "hold_s": 8, "tau_s": 1 } },
        { "name": "x3", "unit": "W", "make": { "kind": "product", "of": ["x1", "x2"], "by": 1 } },
        { "name": "x4", "unit": "V", "make": { "kind": "until", "of": ["x1"], "share": 0.5 } }
    ],
    "files": [{ "name": "fast", "rate_hz": 20, "jitter": 0.1 }, { "name": "slow", "rate_hz": 5, "jitter": 0 }],
    "signals": [
        { "name": "s1", "variable": "x1", "file": "fast", "noise": { "kind": "gaussian", "size": 0.05 } },
        { "name": "s2", "variable": "x2", "file": "slow", "noise": { "kind": "uniform", "size": 0.1 } },
        { "name": "s3", "variable": "x3", "file": "fast", "noise": { "kind": "quantised", "size": 2 } },
        { "name": "s4", "variable": "x4", "file": "fast", "noise": { "kind": "drift", "size": 0.05, "tau_s": 3 } },
        { "name": "s1_copy", "variable": "x1", "file": "fast", "copy_of": "s1", "by": 2, "plus": 1 }
    ],
    "relations": [{ "id": "r1", "kind": "product", "variables": VARIABLES, "formula": "x3 = x1 x2" }]
} ] }"#;

#[track_caller]
fn check(kind: &str, text: &str, status: i32, expected: &str) {
    let folder = Folder::with(&[("recorded.json", text.as_bytes())]);
    assert_eq!(folder.ends(&format!("oracle {kind} recorded.json"), status).stdout, expected);
}

#[test]
fn equal_answers_are_counted_and_others_are_shown() {
    check("search", &SEARCH.replace("UTILITY", "1.0"), 0, "2 of 2 equal\n");
    let other = "1 of 2 equal\nsmall a: {r} has the utility 1, not 0.5\n";
    check("search", &SEARCH.replace("UTILITY", "0.5"), 1, other);
    check("monitor", &MONITOR.replace("FAILED", "2"), 0, "1 of 1 equal\n");
    let other = "0 of 1 equal\nsmall, step 0: Some(2) failed, not Some(0)\n";
    check("monitor", &MONITOR.replace("FAILED", "0"), 1, other);
    check("fusion", &FUSION.replace("STATE", "2.0"), 0, "2 of 2 equal\n");
    let other = "1 of 2 equal\nsmall step 0: state 0 is 2, not 2.5\n";
    check("fusion", &FUSION.replace("STATE", "2.5"), 1, other);
    check("planted", &PLANTED.replace("VARIABLES", r#"["x1", "x2", "x3"]"#), 0, "1 of 1 equal\n");
    let other = "0 of 2 equal\nsmall: s3 = s1 * s2: bloated\nsmall r1: product not found: x3 = x1 x2\n";
    check("planted", &PLANTED.replace("VARIABLES", r#"["x1", "x3"]"#), 1, other);
}

#[test]
fn what_is_no_recording_of_the_kind_is_refused() {
    let folder = Folder::with(&[("recorded.json", MONITOR.as_bytes())]);
    folder.refuses("oracle search absent.json", &["absent.json cannot be read"]);
    let text = MONITOR.replace("FAILED", "2");
    let folder = Folder::with(&[("recorded.json", text.as_bytes())]);
    folder.refuses("oracle search recorded.json", &["`shsa-monitor-unit-1` is no format of search"]);
}

/// The path of a recorded file; prints SKIPPED and returns `None` where it is missing.
fn reference(name: &str) -> Option<PathBuf> {
    let path = PathBuf::from(format!("{REFERENCE}{name}"));
    let is_there = path.exists();
    if !is_there {
        let _ = writeln!(std::io::stderr(), "SKIPPED: {name} of the recorded answers is absent");
    }
    is_there.then_some(path)
}

#[track_caller]
fn check_reference(kind: &str, name: &str, count: &str, differences: &str) {
    let Some(path) = reference(name) else { return };
    let status = i32::from(!differences.is_empty());
    let ended = Folder::new().ends(&format!("oracle {kind} --all {}", path.display()), status);
    assert_eq!(ended.stdout, format!("{count}\n{differences}"));
}

#[test]
fn searches_answer_as_the_published_programs() {
    check_reference("search", "search.json", "161 of 161 equal", "");
}

#[test]
fn the_monitor_answers_as_the_published_program_but_for_what_is_listed() {
    check_reference("monitor", "monitor_experiments.json", "160 of 168 equal", EXPERIMENT_DIFFERENCES);
    check_reference("monitor", "monitor_unit.json", "56 of 65 equal", UNIT_DIFFERENCES);
}

#[test]
fn certificates_are_evaluated_as_recorded() {
    check_reference("assurance", "assurance.json", "1450 of 1450 equal", "");
}

/// One guarantee on evidence that is not known; VERDICT is what it is then.
const ASSURANCE: &str = r#"{ "format": "shsa-assurance-golden-1", "scales": { "asil": ["QM", "A"] },
"units": { "": { "dimension": "none", "factor": 1.0 } }, "cases": [], "examples": [ { "id": "small", "services": [
    { "name": "s", "kind": "application", "demands": [],
      "guarantees": [{ "id": "g", "type": "t", "level": ["asil", "A"], "properties": [], "when": { "evidence": "e" } }],
      "evidence": [{ "id": "e", "value": null }] } ],
"expected": { "evidence": { "e": "unknown" }, "matches": {}, "holds": [], "holds_if_unknown_true": ["g"],
    "greatest_fixed_point": [], "demands": {},
    "guarantees": { "g": { "verdict": "VERDICT", "missing": [["e"]], "repairs": [["e"]], "causes": [["e"]] } } } } ] }"#;

#[test]
fn an_evaluation_that_differs_is_shown_by_its_place() {
    check("assurance", &ASSURANCE.replace("VERDICT", "open"), 0, "1 of 1 equal\n");
    let other = "0 of 1 equal\nsmall guarantees g verdict: recorded \"refused\", ours \"open\"\n";
    check("assurance", &ASSURANCE.replace("VERDICT", "refused"), 1, other);
}

#[test]
fn estimates_are_those_computed_with_fifty_digits() {
    check_reference("fusion", "fusion.json", "2911 of 2911 equal", "");
    check_reference("fusion", "fusion_sfpkg.json", "354 of 354 equal", "");
}
