//! Names of earlier versions do what the new ones do: the same output and exit status, and one line more on standard error.

use crate::folder::Folder;
use crate::tank;

const STORY: &str = include_str!("../../../../stories/02-fallback-by-value.yaml");

fn folder() -> Folder {
    let folder = tank::folder();
    folder.write("story.yaml", STORY);
    folder.write("part.yaml", "shsa: 1\nvariables: { spare: { unit: m } }\n");
    folder.write("change.yaml", "signals: { /level: { variable: level, rate: 1 Hz } }\n");
    folder
}

/// Runs the old and the new form; returns what both print on standard output.
#[track_caller]
fn same(folder: &Folder, old: &str, new: &str) -> String {
    let (earlier, now) = (folder.run(old), folder.run(new));
    assert_eq!((earlier.status, &earlier.stdout), (now.status, &now.stdout), "{old}: {}", earlier.stderr);
    let (note, rest) = earlier.stderr.split_once('\n').unwrap();
    assert!(note.starts_with("note: `shsa ") && note.contains("` is now `shsa "), "{note}");
    assert_eq!(rest, now.stderr, "{old}");
    now.stdout
}

#[test]
fn old_names_do_what_the_new_ones_do() {
    let folder = folder();
    for (old, new) in [
        ("story story.yaml", "test story.yaml"),
        ("convert tank.yaml --to json", "model convert tank.yaml --to json"),
        ("convert tank.yaml --to prolog", "model convert tank.yaml --to prolog"),
        ("join tank.yaml part.yaml", "model join tank.yaml part.yaml"),
        ("part tank.yaml level", "model part tank.yaml level"),
        ("fmt --check tank.yaml", "model fmt --check tank.yaml"),
        ("patch tank.yaml change.yaml", "model patch tank.yaml change.yaml"),
        ("schema", "model schema"),
        ("monitor tank.yaml level --observations run.csv", "replay tank.yaml run.csv --compare level"),
        (
            "monitor tank.yaml level --observations run.csv --mode thesis --median 3 --json",
            "replay tank.yaml run.csv --compare level --mode thesis --median 3 --json",
        ),
        // Errors are the same, too.
        ("story none.yaml", "test none.yaml"),
        ("part tank.yaml nothing", "model part tank.yaml nothing"),
    ] {
        same(&folder, old, new);
    }
}

#[test]
fn init_is_a_draft_that_replaces_no_file() {
    let folder = folder();
    folder.ends("draft run.csv -o now.yaml --yes", 0);
    let earlier = folder.ends("init run.csv --yes", 0);
    assert_eq!(folder.read("model.yaml"), folder.read("now.yaml"));
    assert!(earlier.stderr.starts_with("note: `shsa init` is now `shsa draft`"), "{}", earlier.stderr);
    folder.refuses("init run.csv --yes", &["model.yaml exists"]);
}

#[test]
fn signals_of_a_recording_are_still_listed() {
    let ended = folder().ends("info run.csv --signals", 0);
    assert!(
        ended.stdout.starts_with("variables:\n") && ended.stdout.contains("\nsignals:\n"),
        "{}",
        ended.stdout
    );
    assert!(ended.stderr.starts_with("note: `shsa info --signals` is now `shsa draft`"), "{}", ended.stderr);
}

#[test]
fn old_names_are_not_listed_and_their_help_names_the_new_form() {
    let folder = Folder::new();
    let page = folder.ends("--help", 0).stdout;
    for (old, new) in
        [("story", "test"), ("convert", "model convert"), ("monitor", "replay --compare VARIABLE")]
    {
        assert!(!page.lines().any(|line| line.trim_start().starts_with(old)), "{page}");
        let help = folder.ends(&format!("{old} --help"), 0).stdout;
        assert!(help.starts_with(&format!("`shsa {old}` is now `shsa {new}`")), "{help}");
    }
}
