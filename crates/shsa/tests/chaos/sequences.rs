//! Random sequences of faults of the environment, by seed: each one must end with the need served.
//!
//! CI runs a few. `SHSA_SEEDS=1..100 cargo test -p shsa --test chaos sequences -- --nocapture` runs these seeds, for a minute
//! each, six at a time.

mod draw;
mod replayed;

use crate::real;
use crate::row::{Scenario, beside_others, shown};
use crate::world::{Judgement, Setting, World};
use draw::Dice;
use std::path::Path;
use std::sync::Mutex;
use std::{env, panic, thread};

const SCENARIO: Scenario = Scenario {
    number: 30,
    name: "random sequences of faults",
    done: "publishers killed, suspended, lying, frozen, drifting, off by an hour, repeating themselves, babbling, holding messages \
           back; Mosquitto killed; `shsa run` suspended; its disk full: one after the other and at the same time",
    promised: "each ends with the need served from sound sources within 10 s of the last fault; no value that is `Good` is wrong \
               meanwhile; the journal replays to the same decisions",
};
/// Without `SHSA_SEEDS`: the seeds, and the time in which faults begin, seconds.
const FEW: (std::ops::RangeInclusive<u64>, f64) = (1..=4, 20.0);
/// With `SHSA_SEEDS`: the time in which faults begin.
const LONG: f64 = 50.0;
/// The number of sequences that run at the same time.
const BESIDE: usize = 6;
/// The longest time from the last fault's end until the need is served from sound sources, seconds.
const RECOVERY: f64 = 10.0;

/// The result of a sequence.
struct Summary {
    faults: usize,
    judgement: Judgement,
    decisions: usize,
    replayed: usize,
}

#[test]
fn every_random_sequence_of_faults_ends_well() {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let (seeds, span) = seeds();
    let queue = Mutex::new(seeds.clone());
    let ended = Mutex::new(Vec::new());
    let work = || {
        while let Some(seed) = { queue.lock().unwrap().next() } {
            let end = panic::catch_unwind(|| sequence(seed, span, &python));
            ended.lock().unwrap().push((seed, end.ok()));
        }
    };
    thread::scope(|scope| (0..BESIDE).for_each(|_| drop(scope.spawn(work))));
    let ended = ended.into_inner().unwrap();
    let failed: Vec<u64> = ended.iter().filter(|(_, end)| end.is_none()).map(|(seed, _)| *seed).collect();
    assert!(failed.is_empty(), "{} of {} sequences failed: {failed:?}", failed.len(), ended.len());
    let results: Vec<&Summary> = ended.iter().filter_map(|(_, result)| result.as_ref()).collect();
    let sum = |of: fn(&Summary) -> usize| results.iter().map(|result| of(result)).sum::<usize>();
    let slowest = results.iter().filter_map(|it| it.judgement.recovery).fold(0.0, f64::max);
    SCENARIO.seen(&format!(
        "seeds {} to {}: {} faults; of {} values at the consumer no `Good` one was wrong or of before, {} of who stood in; served again at the latest \
         {} after the last fault; {} of {} decisions came again when the journals were replayed (all, where there was no hole); the broker took \
         {} at most",
        seeds.start(),
        seeds.end(),
        sum(|it| it.faults),
        sum(|it| it.judgement.values),
        sum(|it| it.judgement.wrong_substitutes.len()),
        shown(slowest),
        sum(|it| it.replayed),
        sum(|it| it.decisions),
        shown(results.iter().map(|it| it.judgement.slowest).fold(0.0, f64::max)),
    ));
}

/// The seeds of `SHSA_SEEDS`, as `1..100`, else a few; and the time in which faults begin.
fn seeds() -> (std::ops::RangeInclusive<u64>, f64) {
    let Ok(text) = env::var("SHSA_SEEDS") else { return FEW };
    let (first, last) = text.split_once("..").expect("SHSA_SEEDS=FIRST..LAST");
    (first.parse().unwrap()..=last.parse().unwrap(), LONG)
}

/// Runs the sequence of a seed.
fn sequence(seed: u64, span: f64, python: &Path) -> Summary {
    let mut dice = Dice(seed);
    let faults = draw::faults(&mut dice, span);
    let mut world = World::start(Setting::drawn(&mut dice), python);
    world.settle();
    let (_, begun) = world.seen();
    let drawn: String = faults.iter().map(|fault| format!("\n  {fault}")).collect();
    eprintln!("sequence {seed} of {} faults begins", faults.len());
    world.live_through(&faults);
    let (_, last) = world.seen();
    let judgement = world.until_served(begun, last, 2.0 * RECOVERY);
    world.until_trusted();
    let remains = world.close();
    let story = || format!("sequence {seed}:{drawn}\n{}", replayed::story(&remains.decisions));
    assert_eq!(remains.status, Some(0), "{}", story());
    let wrong = judgement.wrong.join("\n");
    assert!(wrong.is_empty(), "`Good` and wrong:\n{wrong}\n{}", story());
    assert!(judgement.recovery.is_some_and(|time| time <= RECOVERY), "{:?}: {}", judgement.recovery, story());
    let replayed = replayed::same(&remains).unwrap_or_else(|why| panic!("{why}\n{}", story()));
    eprintln!("sequence {seed} ended: {judgement:?}");
    Summary { faults: faults.len(), judgement, decisions: replayed.1, replayed: replayed.0 }
}
