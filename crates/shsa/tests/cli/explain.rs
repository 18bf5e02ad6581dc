//! `shsa explain`: the evidence against a signal, the rivals, and what would have cleared it.

use crate::folder::{Folder, keys};
use crate::tank;
use serde_json::Value;
use std::path::PathBuf;

/// The tank without the volume: two sensors that disagree do not tell which one is faulty.
const WITHOUT_VOLUME: &str = "signals: { /volume: null }\n";

#[track_caller]
fn tells(text: &str, words: &[&str]) {
    for word in words {
        assert!(text.contains(word), "no '{word}' in: {text}");
    }
}

/// The way, and its bounds, of one side of a comparison.
fn side(side: &Value) -> (&str, f64, f64) {
    (side["way"].as_str().unwrap(), side["lo"].as_f64().unwrap(), side["hi"].as_f64().unwrap())
}

#[test]
fn the_decisions_are_listed_and_numbered() {
    let folder = tank::folder();
    let list = folder.json("explain tank.yaml run.csv", 0);
    let decisions: Vec<(u64, &str, &str)> = list["decisions"]
        .as_array()
        .unwrap()
        .iter()
        .map(|it| (it["number"].as_u64().unwrap(), it["kind"].as_str().unwrap(), it["of"].as_str().unwrap()))
        .collect();
    assert_eq!(decisions, [(1, "failed", "/level"), (2, "substituted", "level")]);
    let text = folder.ends("explain tank.yaml run.csv", 0).stdout;
    tells(
        &text,
        &["1", "failed", "/level", "substituted", "<- /pressure by hydrostatic", "--decision NUMBER"],
    );
    folder.write("calm.csv", tank::csv().lines().take(20).collect::<Vec<_>>().join("\n"));
    tells(&folder.ends("explain tank.yaml calm.csv", 0).stdout, &["No decisions"]);
}

#[test]
fn a_lie_is_explained() {
    let folder = tank::folder();
    let text = folder.ends("explain tank.yaml run.csv /level", 0).stdout;
    tells(
        &text,
        &[
            "/level was found to have failed at ",
            "Of 2 comparisons that /level is part of, 2 are evidence against it and 0 for it.",
            "Of all signals in these disagreements, /level alone is part of each.",
            "Evidence against it\n  level: /level said ",
            "/pressure by hydrostatic said ",
            ", since 30.000 s\n",
            "/pressure: ruled out as the only culprit\n      1 disagreement with /level would be left, such as /level against \
             /volume by cylinder\n",
            "If it is sound, at least 2 others are faulty at once, such as /pressure and /volume",
            "Had it agreed with ",
            "agree in every comparison for 5.0 s",
            "At the end, 59.000 s, it is failed and not trusted again: 2 comparisons still disagree.",
            "level substituted, now from /pressure by hydrostatic",
        ],
    );
    assert!(!text.contains("Evidence for it"), "{text}");
}

#[test]
fn the_object_holds_the_intervals() {
    let object = tank::folder().json("explain tank.yaml run.csv /level", 0);
    let all = [
        "signal",
        "time_s",
        "decision",
        "number",
        "symptom",
        "verdict",
        "because",
        "against",
        "for",
        "silent",
        "rivals",
        "would_clear",
        "probation_s",
        "later",
        "verdict_at_end",
        "needs",
    ];
    assert_eq!(keys(&object), all);
    assert_eq!((object["decision"].as_str(), object["number"].as_u64()), (Some("failed"), Some(1)));
    let against = object["against"].as_array().unwrap();
    assert_eq!(against.len(), 2);
    for comparison in against {
        let ((own, own_lo, own_hi), (other, lo, hi)) = (side(&comparison["own"]), side(&comparison["other"]));
        assert_eq!((own, comparison["unit"].as_str()), ("/level", Some("m")));
        assert!(other.starts_with("/pressure") || other.starts_with("/volume"), "{other}");
        // The level is 0.5 m too high, while its error is 5 cm.
        assert!(own_lo > hi && own_hi - own_lo < 0.11 && hi > lo, "{comparison}");
        assert_eq!(comparison["since_s"], 30.0);
        assert!(comparison["disagree"].as_u64() <= comparison["of"].as_u64());
    }
    let rivals = object["rivals"].as_array().unwrap();
    assert!(rivals.len() == 2 && rivals.iter().all(|rival| rival["ruled_out"] == true), "{rivals:?}");
    assert_eq!(object["needs"][0]["substitution"], "/pressure by hydrostatic");
}

#[test]
fn what_cannot_be_told_apart_is_said_with_what_would_help() {
    let folder = tank::folder();
    folder.write(
        "two.yaml",
        tank::MODEL.replace("  /volume:   { variable: volume, rate: 1 Hz, value_error: 2 % }\n", ""),
    );
    let text = folder.ends("explain two.yaml run.csv /level", 0).stdout;
    tells(
        &text,
        &[
            "/level was suspected at ",
            "No evidence distinguishes it from /pressure, so it is only suspected.",
            "/pressure: not ruled out, it is part of every disagreement with /level",
            "A further witness of level that rests neither on /level nor on /pressure",
            "`shsa analyze` ranks what could be added",
            "unhealable",
        ],
    );
}

#[test]
fn a_witness_that_was_silent_is_named() {
    let folder = tank::folder();
    // The volume is only known until 10 s; later it would have distinguished the two.
    let text = folder.ends("explain tank.yaml run.csv /level --inject drop:/volume@10s..", 0).stdout;
    tells(
        &text,
        &[
            "No evidence distinguishes it from /pressure",
            "Comparisons that are no evidence\n  level: /level against /volume by cylinder\n      /volume was silent\n",
            "A comparison that the model has: level: /level against /volume by cylinder; but /volume was silent.",
        ],
    );
}

#[test]
fn a_time_without_a_decision_tells_the_verdict_and_why() {
    let folder = tank::folder();
    let text = folder.ends("explain tank.yaml run.csv /level@20s", 0).stdout;
    tells(
        &text,
        &[
            "/level was healthy at 20.000 s: no decision about it stood",
            "0 are evidence against it and 2 for it",
            "At least one independent witness agreed with it",
            "What followed",
            "failed\n",
        ],
    );
    let object = folder.json("explain tank.yaml run.csv /level@20s", 0);
    assert_eq!((&object["decision"], object["verdict"].as_str()), (&Value::Null, Some("healthy")));
    assert_eq!(
        (object["against"].as_array().unwrap().len(), object["for"].as_array().unwrap().len()),
        (0, 2)
    );
    // Before anything was compared.
    let text = folder.ends("explain tank.yaml run.csv /level@0 --inject drop:/pressure@0s..3s", 0).stdout;
    tells(&text, &["/level was ", "at 0.000 s"]);
    let alone = "shsa: 1\nvariables: { level: { unit: m } }\nsignals: { /level: { variable: level } }\n";
    folder.write("alone.yaml", alone);
    let text = folder.ends("explain alone.yaml run.csv /level@20s --svg alone.svg", 0).stdout;
    tells(
        &text,
        &[
            "/level was unknown at 20.000 s",
            "No comparison is evidence about /level",
            "No comparison is evidence about /level: no other way",
        ],
    );
    assert!(folder.read("alone.svg").contains("shsa-strong"));
}

#[test]
fn a_time_after_a_decision_explains_what_stood() {
    let folder = tank::folder();
    let first = folder.json("explain tank.yaml run.csv /level", 0);
    for question in ["/level@50s", "/level@31500ms"] {
        let object = folder.json(&format!("explain tank.yaml run.csv {question}"), 0);
        let is_later = first["time_s"].as_f64() <= Some(31.5) || question == "/level@50s";
        assert!(!is_later || object["against"] == first["against"], "{question}");
    }
    let text = folder.ends("explain tank.yaml run.csv /level@50s", 0).stdout;
    tells(&text, &["At 50.000 s this decision stood: failed, 2 comparisons against it."]);
}

#[test]
fn a_signal_that_recovers_is_reported_to_be_trusted_again() {
    let folder = tank::folder();
    let text = folder.ends("explain tank.yaml run.csv /pressure --inject bias=6:/pressure@5s..15s", 0).stdout;
    tells(
        &text,
        &[
            "/pressure was found to have failed at ",
            "What followed\n",
            " restored\n      every comparison with it agrees again",
        ],
    );
    let list = folder.json("explain tank.yaml run.csv --inject bias=6:/pressure@5s..15s", 0);
    let restored = list["decisions"].as_array().unwrap().iter().find(|it| it["kind"] == "restored").unwrap();
    let number = restored["number"].as_u64().unwrap();
    let faults = "--inject bias=6:/pressure@5s..15s";
    let text = folder.ends(&format!("explain tank.yaml run.csv {faults} --decision {number}"), 0).stdout;
    tells(&text, &["/pressure was trusted again at ", "Evidence for it"]);
}

#[test]
fn a_decision_about_a_need_leads_to_the_signal() {
    let folder = tank::folder();
    let text = folder.ends("explain tank.yaml run.csv --decision 2", 0).stdout;
    tells(
        &text,
        &["level was substituted at ", "after what was decided about /level", "Evidence against it"],
    );
    folder.refuses(
        "explain tank.yaml run.csv --decision 3",
        &["there is no decision 3: the run has 2 decisions"],
    );
    folder.refuses("explain tank.yaml run.csv --decision 0", &["there is no decision 0"]);
}

#[test]
fn a_journal_explains_as_its_run_does() {
    let folder = tank::folder();
    folder.ends("replay tank.yaml run.csv --inject bias=6:/pressure@5s..15s --journal run.journal", 0);
    let direct =
        folder.ends("explain tank.yaml run.csv /pressure --inject bias=6:/pressure@5s..15s --svg a.svg", 0);
    let replayed = folder.ends("explain tank.yaml run.journal /pressure --svg b.svg", 0);
    assert_eq!(direct.stdout, replayed.stdout);
    assert_eq!(folder.read("a.svg"), folder.read("b.svg"));
    folder.refuses(
        "explain tank.yaml run.journal /level --inject drop:/level",
        &["a journal is replayed as it was"],
    );
}

#[test]
fn a_model_that_changes_is_followed() {
    let folder = tank::folder();
    folder.write("change.yaml", WITHOUT_VOLUME);
    let text =
        folder.ends("explain tank.yaml run.csv /level --reload change.yaml@10s --svg out.svg", 0).stdout;
    tells(&text, &["/level was suspected", "No evidence distinguishes it from /pressure"]);
    tells(&folder.read("out.svg"), &["/pressure by hydrostatic", "suspected 3"]);
    let text = folder.ends("explain tank.yaml run.csv /volume@5s --reload change.yaml@10s", 0).stdout;
    tells(&text, &["/volume was healthy at 5.000 s"]);
    folder.refuses(
        "explain tank.yaml run.csv /volume@20s --reload change.yaml@10s",
        &["has no signal '/volume'"],
    );
}

#[test]
fn drawings_and_pages_show_the_bands() {
    let folder = tank::folder();
    let made = "--svg out.svg --html out.html --window 30s";
    folder.ends(&format!("explain tank.yaml run.csv /level {made}"), 0);
    let svg = folder.read("out.svg");
    tells(
        &svg,
        &[
            "<svg ",
            "level: /level was found to have failed",
            "level (m)",
            "onset 30 s",
            "failed 3",
            "/volume by cylinder",
            "comparisons with /level disagree",
        ],
    );
    let page = folder.read("out.html");
    tells(
        &page,
        &["<!DOCTYPE html>", "<svg ", "Over time", "Evidence against it", "Other candidates", "tank.yaml"],
    );
    for outside in ["<script", "src=", "href=", "@import", "url("] {
        assert!(!page.contains(outside), "{outside}");
    }
    folder.refuses("explain tank.yaml run.csv --svg out.svg", &["name the signal that is to be drawn"]);
    folder.refuses("explain tank.yaml run.csv /level --svg tank.yaml", &["is in use by this run already"]);
    assert_eq!(folder.read("tank.yaml"), tank::MODEL);
}

#[test]
fn a_story_is_explained() {
    let story =
        PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../stories/01-dead-but-looks-alive.yaml"));
    let folder = Folder::new();
    folder.write("story.yaml", std::fs::read(story).unwrap());
    let text = folder.ends("explain story.yaml /room/a", 0).stdout;
    tells(
        &text,
        &[
            "/room/a was found to have failed at 3",
            "/room/b: ruled out",
            "it must move and agree in every comparison",
        ],
    );
    let output = folder.ends("test story.yaml", 0).stdout;
    let list = folder.json("explain story.yaml", 0);
    for decision in list["decisions"].as_array().unwrap() {
        tells(&output, &[decision["because"].as_str().unwrap()]);
    }
    folder.refuses("explain story.yaml --inject drop:/room/a", &["a story is told as it is written"]);
}

#[test]
fn wrong_questions_are_reported() {
    let folder = tank::folder();
    folder.refuses("explain tank.yaml run.csv /levle", &["no signal '/levle'; did you mean '/level'?"]);
    folder.refuses("explain tank.yaml run.csv /levle@20s", &["did you mean '/level'?"]);
    folder.refuses("explain tank.yaml run.csv /level@soon", &["'soon' has no unit of time"]);
    folder.refuses("explain tank.yaml run.csv /level@99s", &["the run ends at 59.000 s, before 99.000 s"]);
    folder.refuses("explain tank.yaml", &["give a journal or recordings after the model"]);
    folder.refuses("explain tank.yaml none.csv", &["none.csv cannot be read"]);
    folder.refuses("explain tank.yaml run.csv /level --decision 1", &["not about both"]);
    folder.refuses("explain none.yaml run.csv /level", &["none.yaml"]);
    folder.refuses("explain tank.yaml run.csv /level --window long", &["'long' has no unit of time"]);
}

/// Three compasses of a vehicle that turns through north; one is off by 40 degrees from 30 s on.
fn compasses() -> Folder {
    let folder = Folder::new();
    let compass =
        |name: &str| format!("  {name}: {{ variable: heading, unit: deg, rate: 2 Hz, value_error: 2 }}\n");
    let signals: String = ["a", "b", "c"].into_iter().map(compass).collect();
    folder.write(
        "north.yaml",
        format!(
            "shsa: 1\nvariables:\n  heading: {{ unit: deg, wraps: 360 deg, max_rate: 100 deg/s }}\nsignals:\n{signals}"
        ),
    );
    let line = |step: u32| {
        let heading = 330.0 + f64::from(step) * 0.5;
        let lie = if step >= 60 { 40.0 } else { 0.0 };
        let headings = [heading, heading + 1.0, heading + lie].map(|value: f64| value.rem_euclid(360.0));
        format!("{:.1},{},{},{}\n", f64::from(step) * 0.5, headings[0], headings[1], headings[2])
    };
    folder.write("run.csv", format!("time,a,b,c\n{}", (0..120).map(line).collect::<String>()));
    folder
}

#[test]
fn what_wraps_is_reported_in_one_turn_and_drawn_without_a_jump() {
    let folder = compasses();
    let object = folder.json("explain north.yaml run.csv c", 0);
    let against = object["against"].as_array().unwrap();
    assert!(!against.is_empty(), "{object}");
    for comparison in against {
        for (_, lo, hi) in [side(&comparison["own"]), side(&comparison["other"])] {
            assert!((-2.0..=362.0).contains(&lo) && hi - lo < 40.0, "{comparison}");
        }
    }
    folder.ends("explain north.yaml run.csv c --window 60s --svg north.svg", 0);
    let drawn = folder.read("north.svg");
    assert!(drawn.contains("after 360.0 deg values are the same again"), "{drawn}");
    // All bands lie between 328 and 430 degrees; a jump back would reach down to 0.
    assert!(drawn.contains(">420<") && !drawn.contains(">100<"), "{drawn}");
}

/// The drift of 3 mK/s begins at 60 s, and is found at 99.5 s: the drawing begins before the one and goes on after the other.
#[test]
fn the_drawing_of_a_drift_begins_before_it() {
    let story =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../../stories/04-a-drift-is-found-before-values-disagree.yaml");
    let folder = Folder::new();
    folder.ends(&format!("explain {story} /bath/a --svg drift.svg"), 0);
    let drawn = folder.read("drift.svg");
    tells(&drawn, &["failed 99.5 s", ">50</text>", ">150</text>"]);
}
