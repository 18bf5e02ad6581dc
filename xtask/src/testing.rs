//! Every test of the workspace, and how many there were in all.

use crate::command;
use anyhow::{Result, bail};
use serde_json::Value;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};
use std::thread;

/// What some tests look at, beside the project; without it they say `SKIPPED` and look at nothing.
const BESIDE: [&str; 2] = ["data", "reference"];

/// What the closing lines of the test programs add up to.
#[derive(Debug, Default, PartialEq)]
struct Total {
    passed: u64,
    failed: u64,
    ignored: u64,
}

/// Programs that mostly wait for real time to pass: they run beside those that compute.
const WAITING: [&str; 7] = ["live", "chaos", "mqtt", "zenoh", "zenoh_quiet", "ros2", "memory"];

/// Leaves the processor to others.
const GIVING_WAY: [&str; 3] = ["nice", "-n", "10"];

/// A built test program.
#[derive(Debug, PartialEq)]
struct Program {
    /// Of its target: `live`, `shsa_core`.
    name: String,
    executable: PathBuf,
    /// The folder of its crate, where cargo runs it too.
    folder: PathBuf,
}

/// What is still to be run, and what has come out.
struct Queue {
    waiting: Vec<Program>,
    computing: Vec<Program>,
    total: Total,
    failed: Vec<String>,
}

/// Runs all tests, those after a failed one too; closes with their number.
///
/// # Errors
/// When one fails, or does not build.
pub(crate) fn run() -> Result<()> {
    let (waiting, computing) = built()?.into_iter().partition(|it| WAITING.contains(&it.name.as_str()));
    let queue = Mutex::new(Queue { waiting, computing, total: Total::default(), failed: Vec::new() });
    thread::scope(|scope| {
        scope.spawn(|| {
            // In real time: what computes beside them gives way.
            work(&queue, &[], |it| it.waiting.pop());
            work(&queue, &GIVING_WAY, |it| it.computing.pop());
        });
        work(&queue, &GIVING_WAY, |it| it.computing.pop());
    });
    let Queue { mut total, mut failed, .. } = queue.into_inner().unwrap_or_else(PoisonError::into_inner);
    let documents = ["cargo", "test", "--workspace", "--locked", "--no-fail-fast", "--doc"];
    if let Err(problem) = command::relay(&documents, |line| total.add(line)) {
        failed.push(problem.to_string());
    }
    for absent in absent(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared")) {
        println!(
            "not shown: tests that need ../shared/{absent} skipped (see SKIPPED above), and count as passed"
        );
    }
    for name in &failed {
        println!("failed: {name}");
    }
    println!("tests: {} passed, {} failed, {} skipped", total.passed, total.failed, total.ignored);
    if !failed.is_empty() {
        bail!("tests failed");
    }
    Ok(())
}

/// Builds all test programs.
fn built() -> Result<Vec<Program>> {
    let line = [
        "cargo",
        "test",
        "--workspace",
        "--locked",
        "--no-run",
        "--message-format",
        "json-render-diagnostics",
    ];
    let messages = command::output(&line)?;
    Ok(messages.lines().filter_map(program).collect())
}

/// The test program that a message of cargo is about; `None` for all other messages.
fn program(message: &str) -> Option<Program> {
    let message: Value = serde_json::from_str(message).ok()?;
    let is_test = message["profile"]["test"].as_bool()?;
    let program = Program {
        name: message["target"]["name"].as_str()?.to_owned(),
        executable: message["executable"].as_str()?.into(),
        folder: Path::new(message["manifest_path"].as_str()?).parent()?.to_owned(),
    };
    is_test.then_some(program)
}

/// Runs one program after the other; shows what each printed when it has ended, so that nothing is mixed.
/// `under` is the beginning of the line that runs each.
fn work(queue: &Mutex<Queue>, under: &[&str], next: impl Fn(&mut Queue) -> Option<Program>) {
    let lock = || queue.lock().unwrap_or_else(PoisonError::into_inner);
    loop {
        let Some(program) = next(&mut lock()) else { return };
        let line: Vec<&OsStr> =
            under.iter().map(OsStr::new).chain([program.executable.as_os_str()]).collect();
        let output = Command::new(line[0]).args(&line[1..]).current_dir(&program.folder).output();
        let mut queue = lock();
        println!("-- {}", program.executable.display());
        let Ok(output) = output else {
            queue.failed.push(program.name);
            continue;
        };
        let printed = String::from_utf8_lossy(&output.stdout);
        println!("{printed}{}", String::from_utf8_lossy(&output.stderr));
        printed.lines().for_each(|line| queue.total.add(line));
        if !output.status.success() {
            queue.failed.push(format!("{}: {}", program.name, output.status));
        }
    }
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
    fn test_programs_are_among_the_messages_of_cargo() {
        let message = |test: bool| {
            let target = r#"{"name": "live", "kind": ["test"]}"#;
            format!(
                r#"{{"reason": "compiler-artifact", "manifest_path": "/w/crates/a/Cargo.toml", "target": {target},
                    "profile": {{"test": {test}}}, "executable": "/w/target/live-1"}}"#
            )
        };
        let live = Program {
            name: "live".into(),
            executable: "/w/target/live-1".into(),
            folder: "/w/crates/a".into(),
        };
        assert_eq!(program(&message(true)), Some(live));
        assert_eq!(program(&message(false)), None);
        assert_eq!(program(r#"{"reason": "build-finished", "success": true}"#), None);
        assert_eq!(program("a line of something else"), None);
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
