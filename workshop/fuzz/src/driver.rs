//! A fuzzing driver for every toolchain: changes seeds at random, reproducibly, and keeps an input that breaks a promise.

use crate::Target;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The longest input in bytes.
const LENGTH_MAX: usize = 4096;
/// A longer processor time for one input is an error like a panic, because all work must be bounded.
const DURATION_MAX: Duration = Duration::from_secs(1);
/// Bytes that are special to readers.
const BYTES: &[u8] = b"\0\x01\x7f\x80\xff \t\n\r\"'#%()*+,-./0123456789:;<=>?@[]^_eEnN{|}~";

/// Reproducible random numbers: splitmix64.
pub struct Random(u64);

impl Random {
    /// The sequence of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Random {
        Random(seed)
    }

    /// A number below `end`; 0 when `end` is 0.
    pub fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        usize::try_from((mixed ^ (mixed >> 31)) % end.max(1) as u64).unwrap_or(0)
    }
}

/// A seed with one to eight changes.
pub fn mutated(seeds: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    let mut input = pick(seeds, random);
    for _ in 0..=random.below(8) {
        change(&mut input, seeds, random);
    }
    input.truncate(LENGTH_MAX);
    input
}

fn change(input: &mut Vec<u8>, seeds: &[Vec<u8>], random: &mut Random) {
    let start = random.below(input.len() + 1);
    let end = start + random.below(input.len() - start + 1);
    let byte = BYTES[random.below(BYTES.len())];
    match random.below(6) {
        0 => input.insert(start, byte),
        1 => input[start..end].iter_mut().take(1).for_each(|old| *old = byte),
        2 => input[start..end].iter_mut().take(1).for_each(|old| *old ^= 1 << random.below(8)),
        3 => drop(input.drain(start..end)),
        4 => input.extend_from_within(start..end),
        _ => drop(input.splice(start..end, pick(seeds, random))),
    }
}

fn pick(seeds: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    seeds.get(random.below(seeds.len())).cloned().unwrap_or_default()
}

/// Feeds one input; returns the processor time it took.
///
/// # Errors
/// When the target panicked or took too long; the text tells which.
pub fn feed(target: &Target, input: &[u8]) -> Result<Duration, String> {
    let start = processor_time();
    catch_unwind(AssertUnwindSafe(|| (target.run)(input))).map_err(|_| "it panicked".to_owned())?;
    let elapsed = processor_time().saturating_sub(start);
    if elapsed > DURATION_MAX { Err(format!("it took {elapsed:.1?}")) } else { Ok(elapsed) }
}

/// The processor time of this thread: other work on the machine does not count.
fn processor_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    let nanoseconds = u32::try_from(time.tv_nsec).unwrap_or(0);
    Duration::new(u64::try_from(time.tv_sec).unwrap_or(0), nanoseconds)
}

/// The result of a run without an error.
#[derive(Default)]
pub struct Summary {
    /// The number of inputs.
    pub inputs: u64,
    /// The longest time for an input.
    pub slowest: Duration,
}

/// Feeds the seeds, then changed seeds until `done` holds for the number of inputs.
///
/// # Errors
/// The first input that breaks a promise, and the reason.
pub fn fuzz(target: &Target, seed: u64, done: impl Fn(u64) -> bool) -> Result<Summary, (Vec<u8>, String)> {
    let seeds = (target.seeds)();
    let mut random = Random::new(seed);
    let mut summary = Summary::default();
    let mut inputs = seeds.iter().cloned().chain(std::iter::repeat_with(|| mutated(&seeds, &mut random)));
    while let Some(input) = inputs.next().filter(|_| !done(summary.inputs)) {
        let elapsed = feed(target, &input).map_err(|how| (input, how))?;
        summary.slowest = summary.slowest.max(elapsed);
        summary.inputs += 1;
    }
    Ok(summary)
}

/// Keeps an input that breaks a promise, in a file named after its content.
///
/// # Errors
/// When the file cannot be written.
pub fn keep(target: &Target, input: &[u8]) -> io::Result<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("artifacts").join(target.name);
    fs::create_dir_all(&folder)?;
    let mut hasher = DefaultHasher::new();
    input.hash(&mut hasher);
    let path = folder.join(format!("{:016x}", hasher.finish()));
    fs::write(&path, input)?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TARGETS;

    #[test]
    fn every_target_survives() {
        for target in TARGETS {
            let summary = fuzz(target, 1, |inputs| inputs == 500);
            let summary = summary.unwrap_or_else(|(input, how)| panic!("{}: {how}: {input:x?}", target.name));
            assert_eq!(summary.inputs, 500);
        }
    }

    #[test]
    fn a_broken_promise_is_found() {
        let run = |input: &[u8]| assert!(!input.contains(&b'{'), "no braces");
        let target = Target { name: "braces", run, seeds: || vec![b"plain".to_vec()] };
        let (input, how) = fuzz(&target, 1, |inputs| inputs == 10_000).err().unwrap();
        assert!(input.contains(&b'{'));
        assert_eq!(how, "it panicked");
    }

    #[test]
    fn a_seed_repeats_its_inputs() {
        let inputs = |seed| {
            let mut random = Random::new(seed);
            (0..100).map(|_| mutated(&[b"abc".to_vec(), b"1 + 2".to_vec()], &mut random)).collect::<Vec<_>>()
        };
        assert_eq!(inputs(1), inputs(1));
        assert_ne!(inputs(1), inputs(2));
    }
}
