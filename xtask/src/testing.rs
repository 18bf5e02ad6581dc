//! Every test of the workspace, and how many there were in all.

use crate::command;
use anyhow::Result;
use std::path::Path;

/// What some tests look at, beside the project; without it they say `SKIPPED` and look at nothing.
const BESIDE: [&str; 2] = ["data", "reference"];

/// What the closing lines of the test programs add up to.
#[derive(Debug, Default, PartialEq)]
struct Total {
    passed: u64,
    failed: u64,
    ignored: u64,
}

/// Runs all tests, those after a failed one too; closes with their number.
///
/// # Errors
/// When one fails, or does not build.
pub(crate) fn run() -> Result<()> {
    let mut total = Total::default();
    let line = ["cargo", "test", "--workspace", "--locked", "--no-fail-fast"];
    let outcome = command::relay(&line, |line| total.add(line));
    for absent in absent(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared")) {
        println!(
            "not shown: tests that need ../shared/{absent} skipped (see SKIPPED above), and count as passed"
        );
    }
    println!("tests: {} passed, {} failed, {} skipped", total.passed, total.failed, total.ignored);
    outcome
}

/// Which of the folders beside the project are not there.
fn absent(shared: &Path) -> impl Iterator<Item = &'static str> + '_ {
    BESIDE.into_iter().filter(move |folder| !shared.join(folder).is_dir())
}

impl Total {
    /// Adds a closing line (`test result: ok. 3 passed; 0 failed; 1 ignored; ..`); any other line adds nothing.
    fn add(&mut self, line: &str) {
        let Some((_, counts)) = line.strip_prefix("test result: ").and_then(|rest| rest.split_once(". "))
        else {
            return;
        };
        for (count, what) in counts.split("; ").filter_map(|count| count.split_once(' ')) {
            let count = count.parse().unwrap_or(0);
            match what {
                "passed" => self.passed += count,
                "failed" => self.failed += count,
                "ignored" => self.ignored += count,
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_beside_the_project_is_told() {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        assert_eq!(absent(&here.join("src")).collect::<Vec<_>>(), BESIDE);
    }

    #[test]
    fn closing_lines_add_up() {
        let mut total = Total::default();
        for line in [
            "running 3 tests",
            "test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.01s",
            "test result: FAILED. 20 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.01s",
        ] {
            total.add(line);
        }
        assert_eq!(total, Total { passed: 23, failed: 2, ignored: 1 });
    }
}
