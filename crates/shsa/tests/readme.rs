//! The README's story is what the command prints.

use std::process::Command;

/// The lines of the README's console block of a command, without the command itself.
fn shown<'a>(readme: &'a str, command: &str) -> Vec<&'a str> {
    let block = readme.split_once(&format!("$ {command}\n")).expect("the README shows the command").1;
    block.split_once("```").expect("the block ends").0.lines().collect()
}

#[test]
fn the_story_in_the_readme_is_what_the_command_prints() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let readme = std::fs::read_to_string(format!("{root}/README.md")).expect("there is a README");
    let story = "stories/02-fallback-by-value.yaml";
    let run = Command::new(env!("CARGO_BIN_EXE_shsa")).current_dir(root).args(["story", story]).output();
    let run = run.expect("the command starts");
    let printed = String::from_utf8(run.stdout).expect("it prints text");
    let mut printed = printed.lines();
    for line in shown(&readme, &format!("shsa story {story}")) {
        let found = line == "..." || printed.any(|printed| printed == line);
        assert!(found, "the README shows a line that the command does not print, or not there:\n{line}");
    }
    assert!(run.status.success());
}
