//! Every test of the workspace, and how many there were in all.

use crate::command;
use anyhow::Result;

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
    println!("tests: {} passed, {} failed, {} skipped", total.passed, total.failed, total.ignored);
    outcome
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
