//! The stable driver's command: `cargo run -p shsa-fuzz --release -- intervals --seconds 10`.

use anyhow::{Context, Result, bail};
use clap::Parser;
use shsa_fuzz::{TARGETS, Target, driver};
use std::fs;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Feeds changed seeds to a target, or the given files once.
#[derive(Parser)]
struct Arguments {
    /// What to fuzz.
    #[arg(value_parser = TARGETS.iter().map(|target| target.name).collect::<Vec<_>>())]
    target: String,
    /// Inputs to feed instead of random ones: what an earlier run has kept, say.
    files: Vec<PathBuf>,
    /// How long to go on.
    #[arg(long, default_value_t = 10)]
    seconds: u64,
    /// Another number gives other inputs, the same number the same.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let target = TARGETS.iter().find(|target| target.name == arguments.target).context("no such target")?;
    if arguments.files.is_empty() {
        search(target, arguments.seed, Duration::from_secs(arguments.seconds))
    } else {
        arguments.files.iter().try_for_each(|file| repeat(target, file))
    }
}

fn search(target: &Target, seed: u64, time: Duration) -> Result<()> {
    let start = Instant::now();
    match driver::fuzz(target, seed, |_| start.elapsed() >= time) {
        Ok(summary) => {
            let driver::Summary { inputs, slowest } = summary;
            println!("{}: {inputs} inputs in {time:?}, the slowest took {slowest:.1?}", target.name);
            Ok(())
        }
        Err((input, how)) => {
            let path = driver::keep(target, &input).context("keeping the input")?;
            bail!("{}: {how}; the input is kept: `{} {}`", target.name, target.name, path.display())
        }
    }
}

fn repeat(target: &Target, file: &PathBuf) -> Result<()> {
    let input = fs::read(file).with_context(|| format!("reading {}", file.display()))?;
    match driver::feed(target, &input) {
        Ok(elapsed) => println!("{}: fine, in {elapsed:.1?}", file.display()),
        Err(how) => bail!("{}: {how}", file.display()),
    }
    Ok(())
}
