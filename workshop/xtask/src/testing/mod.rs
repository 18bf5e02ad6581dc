//! Builds, lints and documents the workspace, runs every test, and counts them.

mod build;
mod stalls;
mod total;

use crate::{needs, wasm};
use anyhow::{Result, anyhow, bail};
use build::{Built, Program};
use stalls::Stalls;
use std::env;
use std::ffi::OsStr;
use std::mem;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, ScopedJoinHandle};
use std::time::Instant;
use total::Total;

/// Folders beside the project that some tests use; without them, these tests print `SKIPPED`.
const BESIDE: [&str; 2] = ["data", "reference"];

/// Programs that mostly wait for real time: they run at the same time as those that compute.
const WAITING: [&str; 10] =
    ["live", "demos", "chaos", "mqtt", "sparkplug", "zenoh", "zenoh_quiet", "ros2", "dds", "memory"];

/// How many tests of a program run at a time. Those that mostly wait, in the program that takes longest, need more than one a core.
const THREADS: [(&str, &str); 1] = [("live", "3")];

/// Programs that take longest: they begin before others that could, so that the last one to end is a short one.
const LONG: [&str; 3] = ["recordings", "live", "chaos"];

/// Crates whose tests run a program, which may not be built yet when they are: they wait for it.
const LATE: [(&str, &str); 4] =
    [("shsa", "shsa"), ("shsa-bench", "shsa"), ("shsa-demos", "shsa"), ("ratchet", "instructions")];

/// From where random cases are drawn, so that what passed once passes again. `cargo test` draws new ones each time.
const SEED: (&str, &str) = ("PROPTEST_RNG_SEED", "20190415");

/// How often a test is run that fails while the machine stalls.
const ATTEMPTS: u32 = 3;

/// Runs a command with lower priority.
const GIVING_WAY: [&str; 3] = ["nice", "-n", "10"];

/// The programs still to be run, and the results so far.
#[derive(Default)]
struct Queue {
    waiting: Vec<Program>,
    computing: Vec<Program>,
    /// Programs that wait for another one.
    late: Vec<Program>,
    /// The names of those that tests run.
    commands: Vec<String>,
    /// Whether no further program will be added.
    is_complete: bool,
    /// Whether the tests will not run, as something that they need is absent.
    is_cancelled: bool,
    total: Total,
    failed: Vec<String>,
    /// Tests that failed while the machine stalled, each to be run again alone.
    again: Vec<Again>,
}

/// A test that is to be run again.
struct Again {
    executable: PathBuf,
    folder: PathBuf,
    test: String,
}

impl Queue {
    /// Marks the queue as complete. Programs that wait for one that did not build fail by themselves.
    fn complete(&mut self) {
        self.is_complete = true;
        self.release();
    }

    /// Takes in what was built.
    fn take(&mut self, built: Built) {
        match built {
            Built::Test(program) => self.add(program),
            Built::Command(name) => {
                self.commands.push(name);
                self.release();
            }
        }
    }

    /// Lets the programs run that wait for nothing any more.
    fn release(&mut self) {
        for program in mem::take(&mut self.late) {
            self.add(program);
        }
    }

    fn add(&mut self, program: Program) {
        let is_awaited = |command: &str| !self.is_complete && !self.commands.iter().any(|it| it == command);
        let is_late =
            LATE.iter().any(|(krate, command)| program.folder.ends_with(krate) && is_awaited(command));
        let list = if is_late {
            &mut self.late
        } else if WAITING.contains(&program.name.as_str()) {
            &mut self.waiting
        } else {
            &mut self.computing
        };
        // Programs are taken from the end.
        let at = if LONG.contains(&program.name.as_str()) { list.len() } else { 0 };
        list.insert(at, program);
    }
}

/// A queue that is filled and emptied by different threads.
#[derive(Default)]
struct Shared {
    queue: Mutex<Queue>,
    changed: Condvar,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the queue, and notifies the waiting threads.
    fn change(&self, change: impl FnOnce(&mut Queue)) {
        change(&mut self.lock());
        self.changed.notify_all();
    }

    /// The next program; `None` once the queue is complete and empty.
    fn next(&self, mut take: impl FnMut(&mut Queue) -> Option<Program>) -> Option<Program> {
        let mut queue = self.lock();
        loop {
            let program = take(&mut queue);
            if program.is_some() || queue.is_complete {
                return program;
            }
            queue = self.changed.wait(queue).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// Runs all tests, also after a failure, each program as soon as it is built; ends with their number. What they need is installed
/// beside the first builds.
///
/// # Errors
/// When something that the tests need is absent, a test fails or does not build, or clippy or the documentation has a
/// warning.
pub(crate) fn run(with_packages: bool) -> Result<()> {
    let shared = Shared::default();
    let stalls = Stalls::watch();
    let other = thread::scope(|scope| {
        let built = scope.spawn(|| {
            let pass = |built| shared.change(|queue| queue.take(built));
            let built = build::all(|| shared.lock().is_cancelled, pass);
            shared.change(Queue::complete);
            built
        });
        if let Err(absent) = needs::provide_for_tests() {
            shared.change(|queue| queue.is_cancelled = true);
            return Err(absent);
        }
        // These need real time, so builds and computing tests beside them have a lower priority. Two of them leave room for a
        // third program, as they mostly wait.
        scope.spawn(|| work(&shared, &[], Some(&stalls), |it| it.waiting.pop()));
        scope.spawn(|| {
            work(&shared, &[], Some(&stalls), |it| it.waiting.pop());
            work(&shared, &GIVING_WAY, None, |it| it.computing.pop());
        });
        scope.spawn(|| work(&shared, &GIVING_WAY, None, |it| it.computing.pop()));
        let built = joined(built);
        // The last programs mostly wait, which leaves time for these.
        let benches = build::benches();
        let examples = build::examples(|line| shared.change(|queue| queue.total.add(line)));
        let add = |line: &str| shared.change(|queue| queue.total.add(line));
        let packages = if with_packages { wasm::test(add) } else { wasm::skip(add) };
        Ok([built, benches, examples, packages])
    })?;
    let Queue { mut total, mut failed, again, .. } =
        shared.queue.into_inner().unwrap_or_else(PoisonError::into_inner);
    for test in again {
        failed.extend(run_again(&test, &stalls, &mut total));
    }
    failed.extend(other.into_iter().filter_map(Result::err).map(|problem| problem.to_string()));
    for absent in absent(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared")) {
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

/// The result of a thread.
fn joined(thread: ScopedJoinHandle<'_, Result<()>>) -> Result<()> {
    thread.join().unwrap_or_else(|_| Err(anyhow!("a part of the checks panicked")))
}

/// Runs one program after the other, and shows the output of each after its end, so that outputs do not mix. `under` is the
/// beginning of each command line. With `stalls`, the programs need real time: what fails while the machine stalls is run again at the
/// end.
fn work(
    shared: &Shared,
    under: &[&str],
    stalls: Option<&Stalls>,
    mut take: impl FnMut(&mut Queue) -> Option<Program>,
) {
    while let Some(program) = shared.next(&mut take) {
        let line: Vec<&OsStr> =
            under.iter().map(OsStr::new).chain([program.executable.as_os_str()]).collect();
        let began = Instant::now();
        let mut command = Command::new(line[0]);
        command.args(&line[1..]).current_dir(&program.folder);
        if env::var_os(SEED.0).is_none() {
            command.env(SEED.0, SEED.1);
        }
        command.envs(THREADS.iter().filter(|it| it.0 == program.name).map(|it| ("RUST_TEST_THREADS", it.1)));
        let output = command.output();
        shared.change(|queue| {
            println!("-- {} in {} s", program.executable.display(), began.elapsed().as_secs());
            let Ok(output) = output else {
                queue.failed.push(program.name);
                return;
            };
            let printed = String::from_utf8_lossy(&output.stdout);
            println!("{printed}{}", String::from_utf8_lossy(&output.stderr));
            printed.lines().for_each(|line| queue.total.add(line));
            if output.status.success() {
                return;
            }
            let failed: Vec<String> = printed.lines().filter_map(failed_test).collect();
            match stalls.and_then(|stalls| stalls.longest_since(began)) {
                Some(stall) if !failed.is_empty() => {
                    println!(
                        "the machine stalled for {:.1} s: run again at the end: {failed:?}",
                        stall.as_secs_f64()
                    );
                    queue.total.failed = queue.total.failed.saturating_sub(failed.len() as u64);
                    let (executable, folder) = (&program.executable, &program.folder);
                    queue.again.extend(failed.into_iter().map(|test| Again {
                        executable: executable.clone(),
                        folder: folder.clone(),
                        test,
                    }));
                }
                _ => queue.failed.push(format!("{}: {}", program.name, output.status)),
            }
        });
    }
}

/// Runs a test alone, and once more where the machine stalls in its time; returns what is to be told of a failure.
fn run_again(again: &Again, stalls: &Stalls, total: &mut Total) -> Option<String> {
    for attempt in 1..=ATTEMPTS {
        let began = Instant::now();
        let mut command = Command::new(&again.executable);
        let output = command.args(["--exact", &again.test]).current_dir(&again.folder).output();
        let Ok(output) = output else { break };
        let printed = String::from_utf8_lossy(&output.stdout);
        println!("-- {} alone\n{printed}{}", again.test, String::from_utf8_lossy(&output.stderr));
        let is_last = attempt == ATTEMPTS || stalls.longest_since(began).is_none();
        if output.status.success() || is_last {
            printed.lines().for_each(|line| total.add(line));
            return (!output.status.success()).then(|| format!("{}: {}", again.test, output.status));
        }
    }
    Some(again.test.clone())
}

/// The test of which a line says that it failed (`test outage::told ... FAILED`).
fn failed_test(line: &str) -> Option<String> {
    line.strip_prefix("test ")?.strip_suffix(" ... FAILED").map(str::to_owned)
}

/// The missing ones of the folders beside the project.
fn absent(shared: &Path) -> impl Iterator<Item = &'static str> + '_ {
    BESIDE.into_iter().filter(move |folder| !shared.join(folder).is_dir())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_beside_the_project_is_reported() {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        assert_eq!(absent(&here.join("src")).collect::<Vec<_>>(), BESIDE);
    }

    #[test]
    fn a_program_runs_as_soon_as_it_may() {
        let program = |name: &str, folder: &str| Program {
            name: name.into(),
            executable: "/w/target/x".into(),
            folder: Path::new("/w/crates").join(folder),
        };
        let shared = Shared::default();
        for (name, folder) in
            [("live", "shsa"), ("cli", "shsa-bench"), ("ceilings", "ratchet"), ("all", "shsa-core")]
        {
            let program = program(name, folder);
            shared.change(|queue| queue.take(Built::Test(program)));
        }
        let next = |shared: &Shared| shared.next(|it| it.computing.pop()).map(|program| program.name);
        assert_eq!(next(&shared).as_deref(), Some("all"));
        thread::scope(|scope| {
            let waits = scope.spawn(|| next(&shared));
            shared.change(|queue| queue.take(Built::Command("shsa".into())));
            assert_eq!(waits.join().unwrap().as_deref(), Some("cli"));
        });
        shared.change(|queue| queue.take(Built::Command("instructions".into())));
        assert_eq!(next(&shared).as_deref(), Some("ceilings"));
        shared.change(Queue::complete);
        assert_eq!(next(&shared), None);
        assert_eq!(shared.lock().waiting.len(), 1);
    }

    #[test]
    fn what_fails_in_a_stall_is_run_again() {
        let folder = std::env::temp_dir().join(format!("xtask-testing-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let script = folder.join("program");
        // Fails at its first run, as a test in a stall, and again at its second one.
        let text = "#!/bin/sh\nif [ \"$(cat runs | wc -l)\" -ge 2 ]; then echo 'test result: ok. 1 passed; 0 failed'; exit 0; fi\n\
                    echo >> runs; echo 'test b ... ok'; echo 'test a ... FAILED'; echo 'test result: FAILED. 1 passed; 1 failed'; exit 101\n";
        std::fs::write(&script, text).unwrap();
        std::fs::write(folder.join("runs"), "").unwrap();
        let shared = Shared::default();
        let program = Program { name: "live".into(), executable: script.clone(), folder: folder.clone() };
        shared.change(|queue| queue.take(Built::Test(program)));
        shared.change(Queue::complete);
        let allowed = Command::new("chmod").args(["+x".as_ref(), script.as_os_str()]).status().unwrap();
        assert!(allowed.success());
        work(&shared, &[], Some(&Stalls::always()), |it| it.waiting.pop());
        let queue = shared.queue.into_inner().unwrap();
        assert_eq!(queue.total, Total { passed: 1, ..Total::default() });
        assert_eq!((queue.failed.len(), queue.again.len()), (0, 1));
        let mut total = queue.total;
        assert_eq!(run_again(&queue.again[0], &Stalls::always(), &mut total), None);
        assert_eq!(total, Total { passed: 2, ..Total::default() });
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn long_programs_begin_first() {
        let mut queue = Queue { commands: vec!["shsa".into()], ..Queue::default() };
        for name in ["cli", "recordings", "readme"] {
            queue.add(Program { name: name.into(), executable: "/x".into(), folder: "/w/shsa".into() });
        }
        let taken = std::iter::from_fn(|| queue.computing.pop()).map(|program| program.name);
        assert_eq!(taken.collect::<Vec<_>>(), ["recordings", "cli", "readme"]);
    }

    #[test]
    fn what_failed_is_read_from_its_line() {
        assert_eq!(failed_test("test car::a_wheel ... FAILED").as_deref(), Some("car::a_wheel"));
        assert_eq!(failed_test("test car::a_wheel ... ok"), None);
        assert_eq!(failed_test("test result: FAILED. 73 passed; 2 failed; 0 ignored"), None);
    }
}
