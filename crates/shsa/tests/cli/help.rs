//! Help with examples that work, versions, completions.

use crate::folder::Folder;

/// The first page of the help: groups of commands.
const LISTED: [&str; 22] = [
    "demo",
    "doctor",
    "studio",
    "draft",
    "check",
    "analyze",
    "info",
    "replay",
    "explain",
    "calibrate",
    "learn",
    "campaign",
    "run",
    "top",
    "scan",
    "journal",
    "maintenance",
    "service",
    "model",
    "test",
    "plan",
    "assure",
];

/// The commands that are not on the first page, and those below `shsa model` and `shsa journal`.
const OTHERS: [&str; 9] = [
    "completions",
    "man",
    "model convert",
    "model join",
    "model part",
    "model fmt",
    "model patch",
    "model schema",
    "journal verify",
];

fn commands() -> impl Iterator<Item = &'static str> {
    LISTED.into_iter().chain(OTHERS)
}

/// The example in the help of a command.
#[track_caller]
fn example(command: &str) -> String {
    let help = Folder::new().ends(&format!("{command} --help"), 0).stdout;
    let line = help.lines().find(|line| line.starts_with("Example: shsa "));
    line.unwrap_or_else(|| panic!("no example in: {help}")).trim_start_matches("Example: shsa ").to_owned()
}

/// The lines of the first page that have a name at their begin.
fn listed() -> Vec<String> {
    let page = Folder::new().ends("--help", 0).stdout;
    let commands = page.split("Start:").nth(1).unwrap().split("Options:").next().unwrap();
    let lines = commands.lines().filter_map(|line| line.strip_prefix("  "));
    lines.filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect()
}

#[test]
fn help_of_every_command_has_an_example() {
    assert_eq!(listed(), LISTED);
    for command in commands() {
        // The example of a group is that of a command in it.
        assert!(example(command).starts_with(command));
    }
    example("");
}

#[test]
fn the_first_page_has_groups_and_names_what_it_leaves_out() {
    let page = Folder::new().ends("--help", 0).stdout;
    let headings = page.lines().filter(|line| line.ends_with(':') && !line.starts_with(' '));
    assert_eq!(headings.collect::<Vec<_>>(), ["Start:", "Recordings:", "Live:", "Models:", "Options:"]);
    for words in ["shsa man FOLDER", "shsa completions SHELL", "Exit status: 0 done;"] {
        assert!(page.contains(words), "no {words} in {page}");
    }
    assert!(page.lines().count() <= 50 && page.lines().all(|line| line.chars().count() <= 100), "{page}");
}

/// Options of one command first, then the files that it writes; how recordings are read stands last.
#[test]
fn options_stand_under_headings_with_reading_last() {
    for command in ["replay", "explain", "assure", "calibrate", "learn", "campaign", "doctor"] {
        let help = Folder::new().ends(&format!("{command} --help"), 0).stdout;
        let headings: Vec<&str> =
            help.lines().filter(|line| line.ends_with(':') && !line.starts_with(' ')).collect();
        let at = |heading: &str| headings.iter().position(|it| *it == heading);
        let (options, output, reading) = (at("Options:"), at("Output files:"), at("Reading recordings:"));
        assert!(options.is_some() && options < output && output < reading, "{command}: {headings:?}");
        assert!(headings[reading.unwrap() + 1..].iter().all(|it| !it.starts_with("Out")), "{headings:?}");
    }
}

/// Runs the examples that need only the models of the project.
#[test]
fn examples_of_the_help_work() {
    // Beside the project's files, so that what an example writes is not among them.
    let folder = Folder::new();
    for part in ["models", "stories"] {
        let own = format!("{}/../../{part}", env!("CARGO_MANIFEST_DIR"));
        std::os::unix::fs::symlink(own, folder.path(part)).unwrap();
    }
    for command in ["check", "plan", "explain", "test", "model", "help"] {
        let output = folder.command(&example(command)).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn help_fits_the_screen() {
    for command in commands() {
        let help = Folder::new().ends(&format!("{command} --help"), 0).stdout;
        let widest = help.lines().max_by_key(|line| line.chars().count()).unwrap();
        assert!(widest.chars().count() <= 110, "{widest}");
    }
}

#[test]
fn the_version_is_reported() {
    let reported = Folder::new().ends("--version", 0).stdout;
    assert_eq!(reported, concat!("shsa ", env!("CARGO_PKG_VERSION"), "\n"));
}

#[test]
fn completions_for_the_common_shells() {
    for (shell, sign) in [("bash", "_shsa()"), ("zsh", "#compdef shsa"), ("fish", "complete -c shsa")] {
        let script = Folder::new().ends(&format!("completions {shell}"), 0).stdout;
        assert!(script.contains(sign), "{shell}: {}", script.lines().next().unwrap_or_default());
        let names = commands().flat_map(str::split_whitespace);
        names.for_each(|name| assert!(script.contains(name), "{shell}: {name}"));
    }
    Folder::new().refuses("completions tcsh", &["possible values", "bash"]);
}

#[test]
fn models_are_laid_out_and_checked() {
    let untidy = "shsa: 1\nvariables:\n    x: {unit: m}  # known\n";
    let folder = Folder::with(&[
        ("one.yaml", untidy.as_bytes()),
        ("two.yaml", b"shsa: 1\n"),
        ("three.yaml", b"shsa: [\n"),
    ]);
    assert_eq!(folder.ends("model fmt --check one.yaml two.yaml", 1).stdout, "one.yaml\n");
    assert_eq!(folder.read("one.yaml"), untidy);
    // All or none.
    assert_eq!(folder.ends("model fmt one.yaml three.yaml", 2).stdout, "");
    assert_eq!(folder.read("one.yaml"), untidy);
    assert_eq!(folder.ends("model fmt one.yaml two.yaml", 0).stdout, "one.yaml\n");
    assert_eq!(folder.read("one.yaml"), "shsa: 1\nvariables:\n  x: { unit: m }  # known\n");
    assert_eq!(folder.ends("model fmt --check one.yaml two.yaml", 0).stdout, "");
}

#[test]
fn every_command_has_a_manual_page() {
    let folder = Folder::new();
    folder.ends("man pages", 0);
    for command in commands() {
        let name = format!("shsa-{}", command.replace(' ', "-"));
        let page = std::fs::read_to_string(folder.path("pages").join(format!("{name}.1"))).unwrap();
        assert!(page.contains(&format!(".TH {name} 1")) && page.contains("Example: shsa"), "{page}");
    }
    let all = std::fs::read_to_string(folder.path("pages/shsa.1")).unwrap();
    LISTED.iter().for_each(|command| assert!(all.contains(command), "{command}"));
    assert!(!folder.path("pages/shsa-story.1").exists(), "an old name has a page");
    folder.refuses("man", &["<FOLDER>"]);
}

#[test]
fn usage_errors_have_status_2() {
    Folder::new().refuses("", &["Usage: shsa <COMMAND>"]);
    Folder::new().refuses("chek model.yaml", &["check"]);
    Folder::new().refuses("plan tank.yaml", &["<VARIABLE>", "Usage"]);
    Folder::new().refuses("demo rovr", &["rover"]);
    Folder::new().refuses("demo", &["<NAME>"]);
}
