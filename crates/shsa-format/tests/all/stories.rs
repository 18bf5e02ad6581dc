//! Every story under `stories/` is met, is the same at every run, and the example of its README is one of them.

use shsa_core::engine::Options;
use shsa_format::drive::{Given, Run};
use shsa_format::story::{self, Outcome, Story};
use std::convert::Infallible;
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../stories")
}

fn paths() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder()).expect("the folder of stories");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "yaml"));
    paths.sort();
    paths
}

#[track_caller]
fn load(path: &Path) -> Story {
    let loaded = story::load_file(path);
    let report = loaded.report.without_notes().render(false);
    assert!(report.is_empty(), "{report}");
    loaded.story.expect("a story without problems")
}

/// The expectations that are not met, in words.
fn unmet(outcome: &Outcome) -> String {
    let line = |check: &story::Check| {
        format!("  line {}: {}\n    found: {}\n", check.line, check.expected, check.found)
    };
    outcome.checks.iter().filter(|check| !check.met).map(line).collect()
}

#[test]
fn all_stories_come_true() {
    let mut wrong = String::new();
    let paths = paths();
    for path in &paths {
        let outcome = load(path).run();
        if !outcome.is_met() {
            wrong += &format!("{}\n{}", path.display(), unmet(&outcome));
        }
    }
    assert!(paths.len() >= 11 && wrong.is_empty(), "{} stories\n{wrong}", paths.len());
}

/// The page of the decision logic is short, and each of its rules names stories that show it.
#[test]
fn the_decision_logic_is_a_page_of_stories() {
    let design = include_str!("../../../../DESIGN.md");
    let page = design
        .split("## The decision logic on one page\n")
        .nth(1)
        .and_then(|rest| rest.split("\n## ").next());
    let page = page.expect("the page").trim();
    assert!(page.lines().count() <= 40);
    let rules = page
        .split("\n\n")
        .nth(1)
        .expect("the rules")
        .split("\n")
        .filter(|line| !line.starts_with(' '))
        .count();
    let named = |rule: &str| -> Vec<String> {
        let words = rule.split('`').skip(1).step_by(2);
        words.filter(|word| word.starts_with(|it: char| it.is_ascii_digit())).map(str::to_owned).collect()
    };
    let mut shown = 0;
    for number in 1..=rules {
        let rule = page.split(&format!("\n{number}. ")).nth(1).expect("a rule");
        let rule = rule.split(&format!("\n{}. ", number + 1)).next().unwrap_or(rule);
        let stories = named(rule);
        assert!(!stories.is_empty(), "rule {number} has no story");
        for story in stories {
            assert!(load(&folder().join(format!("{story}.yaml"))).run().is_met(), "{story}");
            shown += 1;
        }
    }
    assert!(rules >= 10 && shown >= 20, "{rules} rules, {shown} stories");
}

#[test]
fn a_story_runs_the_same_every_time() {
    let story = load(&folder().join("08-no-flapping.yaml"));
    let (one, other) = (story.run(), story.run());
    assert_eq!(one.run.events, other.run.events);
    assert_eq!(one.run.publications, other.run.publications);
    assert!(!one.run.events.is_empty() && !one.run.publications.is_empty());
}

#[test]
fn the_example_of_the_readme_comes_true() {
    let readme = std::fs::read_to_string(folder().join("README.md")).expect("the README of the stories");
    let example =
        readme.split("```yaml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("an example");
    let loaded = story::load(example, "README.md", &folder());
    let report = loaded.report.render(false);
    assert!(report.is_empty(), "{report}");
    let outcome = loaded.story.expect("a story without problems").run();
    assert!(outcome.is_met(), "{}", unmet(&outcome));
}

#[test]
fn the_journal_of_a_story_gives_the_same_events() {
    let names = [
        "01-dead-but-looks-alive.yaml",
        "15-a-model-changed-while-it-runs.yaml",
        "26-cleared-by-the-operator.yaml",
        "26-forbidden-is-not-used.yaml",
        "26-forced-is-never-replaced.yaml",
    ];
    for name in names {
        let story = load(&folder().join(name));
        let give = |run: &mut Run, given: Given<'_>| -> Result<(), Infallible> {
            run.give(given);
            Ok(())
        };
        let Ok(run) = Run::of(&story.journal(), None, Options::default(), give);
        let events = |run: &Run| run.events.iter().map(|event| (event.time, event.kind)).collect::<Vec<_>>();
        assert!(!run.events.is_empty());
        assert_eq!(events(&run), events(&story.run().run), "{name}");
    }
}

/// Noise of other seeds changes no outcome of the stories that are shown as demonstrations.
#[test]
fn the_shown_stories_hold_for_twenty_seeds() {
    let names = [
        "02-every-way-to-the-steering-angle.yaml",
        "04-a-room-and-its-heating.yaml",
        "04-a-tank-and-its-flows.yaml",
        "25-the-vote-of-three.yaml",
        "28-a-car-loses-its-speed.yaml",
        "28-a-platoon-over-a-bad-link.yaml",
        "28-sonar-and-camera-together.yaml",
    ];
    for name in names {
        let text = std::fs::read_to_string(folder().join(name)).expect("the story");
        for seed in 1..=20 {
            let seeded = text.replacen("\ntrace:\n", &format!("\ntrace:\n  seed: {seed}\n"), 1);
            assert_ne!(seeded, text);
            let story = story::load(&seeded, name, &folder()).story.expect("no errors");
            let outcome = story.run();
            assert!(outcome.is_met(), "{name}, seed {seed}: {}", unmet(&outcome));
        }
    }
}
