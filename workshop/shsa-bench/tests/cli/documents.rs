//! The commands by which the documents say that their figures were made.

use std::path::Path;
use std::process::Command;

use super::PROGRAM;

/// The arguments of each call of `shsa-bench` in a page: in code within a line, and in indented blocks.
fn calls(page: &str) -> Vec<&str> {
    let within = page.split('`').skip(1).step_by(2);
    let indented = page.lines().filter_map(|line| line.strip_prefix("    "));
    within.chain(indented).filter_map(|it| it.strip_prefix("shsa-bench ")).collect()
}

/// `--help` behind the arguments ends a command after it has read them.
#[test]
fn every_command_of_the_documents_has_valid_arguments() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).expect("there are documents") {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|it| it != "md") {
            continue;
        }
        for call in calls(&std::fs::read_to_string(&path).expect("a page is text")) {
            let line = format!("\"$0\" {call} --help");
            let run = Command::new("sh").args(["-c", &line, PROGRAM]).output().expect("a shell starts");
            assert!(run.status.success(), "{path:?}: {call:?}\n{}", String::from_utf8_lossy(&run.stderr));
            count += 1;
        }
    }
    assert!(count >= 18, "{count} commands");
}
