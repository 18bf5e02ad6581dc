//! The program alone: one file that needs no library of the machine, linked with the C library musl, whose licence (MIT) allows it.

use super::{built, put};
use crate::command;
use anyhow::{Context, Result, bail, ensure};
use std::fs;
use std::path::Path;

/// The system of the targets whose programs need nothing else.
const SYSTEM: &str = "unknown-linux-musl";

/// Builds the program for this machine's processor, starts it where nothing else is, and puts it into `out`.
///
/// # Errors
/// When the target or its compiler of C is absent, the program does not build, is not alone, or does not start.
pub(super) fn write(out: &Path) -> Result<()> {
    let target = target(&command::output(&["rustc", "--version", "--verbose"])?)?;
    if !command::succeeds(&["musl-gcc", "--version"]) {
        bail!("a compiler of C for musl is absent: `apt-get install musl-tools`");
    }
    command::run(&["rustup", "target", "add", &target])?;
    let program = built(Some(&target))?;
    ensure!(!has_loader(&fs::read(&program)?), "{} needs libraries of the machine", program.display());
    let to = out.join("shsa");
    put(&program, &to, 0o755)?;
    starts(&to)?;
    println!("{}", to.display());
    Ok(())
}

/// The target for the processor of this machine, from what the compiler says of itself.
fn target(reported: &str) -> Result<String> {
    let host =
        reported.lines().find_map(|line| line.strip_prefix("host: ")).context("a compiler without a host")?;
    let (processor, _) = host.split_once('-').context("a host without a processor")?;
    Ok(format!("{processor}-{SYSTEM}"))
}

/// Whether an ELF file of 64 bits asks for a loader of libraries, in a program header of the type PT_INTERP (3).
fn has_loader(elf: &[u8]) -> bool {
    let number = |at: usize, length: usize| -> Option<usize> {
        let bytes = elf.get(at..at.checked_add(length)?)?;
        Some(bytes.iter().rev().fold(0, |sum, byte| sum << 8 | usize::from(*byte)))
    };
    let headers = || Some((number(32, 8)?, number(54, 2)?, number(56, 2)?));
    let Some((first, size, count)) = headers() else { return false };
    (0..count).any(|place| first.checked_add(place * size).and_then(|at| number(at, 4)) == Some(3))
}

/// Starts the program; in a folder with nothing else where this is allowed.
fn starts(program: &Path) -> Result<()> {
    let empty = program.with_file_name("alone");
    put(program, &empty.join("shsa"), 0o755)?;
    let [folder, program] = [&empty, program].map(|path| path.display().to_string());
    let line = match command::succeeds(&["chroot", "/", "true"]) {
        true => vec!["chroot", &folder, "/shsa", "--version"],
        false => vec![&*program, "--version"],
    };
    command::run(&line)?;
    Ok(fs::remove_dir_all(&empty)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::env;

    #[test]
    fn the_target_is_of_the_processor() {
        let reported = "rustc 1.95.0\nhost: aarch64-unknown-linux-gnu\nrelease: 1.95.0\n";
        assert_eq!(target(reported).unwrap(), "aarch64-unknown-linux-musl");
        assert!(target("rustc 1.95.0").is_err());
    }

    /// This test itself is linked with libraries, and what is no program asks for none.
    #[test]
    fn a_loader_is_found() {
        assert!(has_loader(&fs::read(env::current_exe().unwrap()).unwrap()));
        assert!(!has_loader(b"") && !has_loader(&[0xFF; 64]));
    }
}
