//! The `shsa` command under measurement, and what a process costs while it runs.

use crate::processor::{memory_bytes, spent_seconds};
use anyhow::{Context, bail};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Time between two readings of the memory.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// The path of `shsa`: from the environment variable `SHSA`, else beside this program.
///
/// # Errors
/// When the file does not exist.
pub(crate) fn shsa() -> anyhow::Result<PathBuf> {
    let named = std::env::var_os("SHSA").map(PathBuf::from);
    let beside = || Ok(std::env::current_exe().context("cannot find this program")?.with_file_name("shsa"));
    let program: PathBuf = named.map_or_else(beside, anyhow::Ok)?;
    if !program.exists() {
        bail!(
            "{} is absent: build it (cargo build --release -p shsa), or name it in SHSA",
            program.display()
        );
    }
    Ok(program)
}

/// The costs of a process.
pub(crate) struct Watched {
    /// Seconds from its start to its end.
    pub(crate) seconds: f64,
    /// Seconds on processors, of all threads.
    pub(crate) processor_seconds: f64,
    /// Resident memory: seconds since the start of the process, bytes.
    pub(crate) memory: Vec<(f64, f64)>,
}

impl Watched {
    /// The largest resident memory.
    pub(crate) fn peak_bytes(&self) -> f64 {
        self.memory.iter().map(|(_, bytes)| *bytes).fold(f64::NAN, f64::max)
    }
}

/// Runs a command, whose standard output must go elsewhere than to a pipe, and records its memory until it ends.
///
/// # Errors
/// When the command cannot be started, or ends with another status than 0.
pub(crate) fn watch(command: &mut Command) -> anyhow::Result<Watched> {
    let began = Instant::now();
    let mut child = command.stderr(Stdio::inherit()).spawn().context("cannot start shsa")?;
    let who = child.id().to_string();
    let (mut memory, mut processor_seconds) = (Vec::new(), f64::NAN);
    let ended = loop {
        processor_seconds = spent_seconds(&who).unwrap_or(processor_seconds);
        if let Some(ended) = child.try_wait()? {
            break ended;
        }
        memory.push((began.elapsed().as_secs_f64(), memory_bytes(&who, "VmRSS")));
        thread::sleep(LOOK_EVERY);
    };
    let seconds = began.elapsed().as_secs_f64();
    if !ended.success() {
        bail!("{command:?} ended with {ended}");
    }
    // A process that has just ended reports no memory.
    memory.retain(|(_, bytes)| *bytes > 0.0);
    Ok(Watched { seconds, processor_seconds, memory })
}
