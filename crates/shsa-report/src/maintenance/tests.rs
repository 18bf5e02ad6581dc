//! Tests of the report against what was injected.

use super::*;
use crate::{Source, Style};
use shsa_format::story;
use std::path::Path;

fn run(faults: &str) -> Run {
    let text = format!(
        r#"
story: Three sensors
why: Each is lost at times that are known.
model:
  shsa: 1
  variables: {{ v: {{ unit: m/s }} }}
  specifications: {{ slow: {{ always: v < 50 m/s, properties: {{ prior: 0.5 }} }} }}
  signals:
    /a: {{ variable: v, rate: 10 Hz, value_error: 0.1 }}
    /b: {{ variable: v, rate: 10 Hz, value_error: 0.1 }}
    /c: {{ variable: v, rate: 10 Hz, value_error: 0.1 }}
  needs: {{ v: {{ max_age: 1 s }} }}
trace:
  duration: 100 s
  truth: {{ v: "5 m/s + 60 m/s * max(min((t - 90 s) * 10 / 1 s, 1), 0)" }}
  signals: {{ /a: {{ value: v }}, /b: {{ value: v }}, /c: {{ value: v }} }}
  faults: [{faults}]
expect:
  - {{ never: refused, between: [0 s, 100 s] }}
"#
    );
    let loaded = story::load(&text, "three.yaml", Path::new("."));
    let story = loaded.story.unwrap_or_else(|| panic!("{}", loaded.report.render(false)));
    let source = Source::of_story(&story);
    Run::of(&source.eras, source.span, shsa_core::engine::Options::default(), |run, given| {
        run.give(given);
        Ok::<(), std::convert::Infallible>(())
    })
    .unwrap()
}

/// The sum of stretches: each begins as a silence is noticed, within a second, and ends after a probation of at most 6 s.
#[track_caller]
fn is_near(found: Span, stretches: &[f64]) {
    let (seconds, count) = (stretches.iter().sum::<f64>(), stretches.len() as f64);
    assert!((-count..6.0 * count).contains(&(found.seconds() - seconds)), "{found:?} is not {seconds} s");
}

#[test]
fn times_without_a_spare_are_those_in_which_all_others_were_lost() {
    let first = run(r#""drop:/a@10s..40s", "drop:/b@20s..40s", "bias=3:/c@60s..70s""#);
    let second = run(r#""drop:/b@50s..", "drop:/c@60s..80s""#);
    let runs = [first, second];
    let report = Maintenance::of(&runs).unwrap();
    assert_eq!(report.needs[0].redundancy.survives, Some(2));
    is_near(report.needs[0].redundancy.bare, &[20.0, 20.0]);
    assert_eq!(report.needs[0].unserved, Span::ZERO);
    let of = |name: &str| report.signals.iter().find(|it| it.name == name).unwrap();
    is_near(of("/a").restores, &[20.0]);
    is_near(of("/b").restores, &[20.0, 20.0]);
    is_near(of("/c").restores, &[20.0]);
    is_near(of("/b").away, &[20.0, 50.0]);
    assert_eq!(report.signals[0].name, "/b");
    assert_eq!((of("/c").count(EventKind::Failed), of("/c").count(EventKind::Silent)), (1, 1));
    assert_eq!((of("/b").now(), of("/c").now()), ("silent", "trusted"));
    // The plant is too fast in both.
    assert_eq!(of("relation slow").count(EventKind::Failed), 2);
    assert!(report.text(Style::PLAIN).starts_with("Look at /b first"));
    assert_eq!(report.json()["signals"][0]["silent"], 2);
    assert!(report.page("three.yaml").contains("<td>/b</td>"));
}

#[test]
fn what_takes_the_only_source_counts_as_not_served() {
    let runs = [run(r#""drop:/a@10s..40s", "drop:/b@10s..40s", "drop:/c@20s..40s""#)];
    let report = Maintenance::of(&runs).unwrap();
    is_near(report.needs[0].unserved, &[20.0]);
    is_near(report.needs[0].redundancy.bare, &[30.0]);
}
