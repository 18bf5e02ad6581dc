//! Whatever is done to a sealed journal is found.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use shsa_core::engine::{Input, Order, Subject};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;
use shsa_format::drive::Given;
use shsa_format::journal::examination::{Place, Problem, Verification, examine, verify};
use shsa_format::journal::seal::{Seal, end};
use shsa_format::journal::{JournalWriter, read_journal};
use shsa_model::live::{Live, Written};

const MODEL: &str =
    "{shsa: 1, variables: {x: {}}, signals: {a: {variable: x}, b: {variable: x}}, needs: {x: {signal: /x}}}";

fn live() -> Live {
    Live::load(Written { name: "m.yaml", text: MODEL }).expect("a model").0
}

/// Stands in for a signature, so that these tests need no key: any function of the bytes is one to the examination.
fn signature(signed: &[u8]) -> [u8; 64] {
    let mut signature = [7; 64];
    signature.iter_mut().zip(signed.iter().rev()).for_each(|(digit, byte)| *digit = !byte);
    signature
}

fn input(random: &mut ChaCha8Rng, knowledge: &KnowledgeBase, time: Time) -> Input {
    let mut number = || f64::from(random.next_u32() % 10_000) / 16.0;
    let value = match time.0 % 5 {
        0 => return Input::Tick(time),
        1 => return Input::Order { time, order: Order::Forbid(Subject::Signal("a".to_owned())) },
        2 => RawValue::Vector(vec![number(), number(), f64::NAN]),
        3 => RawValue::Interval { lo: number(), hi: f64::INFINITY },
        _ => RawValue::Number(number()),
    };
    let signal =
        knowledge.signal(if random.next_u32().is_multiple_of(2) { "a" } else { "b" }).expect("a signal");
    Input::Observation(Observation { signal, stamp: time, received: time, value })
}

/// The files of a sealed journal, each with this number of inputs and a signature at its end.
fn journal(seed: u64, files: u64, inputs: i64) -> Vec<Vec<u8>> {
    let (live, mut random) = (live(), ChaCha8Rng::seed_from_u64(seed));
    let knowledge = live.knowledge();
    let (mut after, mut all) = (None, Vec::new());
    for file in 0..files {
        let mut writer = JournalWriter::new(Vec::new(), knowledge).expect("a head");
        let head = std::mem::take(writer.output_mut());
        for at in 0..inputs {
            let time = Time(1_000 * i64::try_from(file).expect("few") + at);
            let input = input(&mut random, knowledge, time);
            writer.record(Given::Input(&input)).expect("a line");
            if let Input::Order { time, .. } = input {
                writer.ordered(time, "10.0.0.7", "forbid a").expect("a line");
            }
        }
        let mut sealed = Vec::new();
        let begun = Seal::write_head(after, file + 3, &head, &mut sealed);
        let written = begun.write(&writer.into_output(), &mut sealed);
        after = Some(written.write_signature(&signature(&written.signed()), &mut sealed));
        all.push(sealed);
    }
    all
}

fn verified(files: &[impl AsRef<[u8]>]) -> Verification {
    let check = |signed: &[u8], shown: &[u8; 64]| signature(signed) == *shown;
    let examined = files.iter().map(|file| examine(file.as_ref(), Some(&check)).expect("readable"));
    verify(&examined.collect::<Vec<_>>())
}

fn is_clean(found: &Verification) -> bool {
    found.finding.is_none() && found.cuts.is_empty() && found.unsigned == 0
}

/// The lines of a file, each with its end.
fn lines(file: &[u8]) -> Vec<&[u8]> {
    file.split_inclusive(|byte| *byte == b'\n').collect()
}

#[track_caller]
fn refuse(files: &[Vec<u8>], at: usize, changed: &[u8], what: &str) {
    if files[at] == changed {
        return;
    }
    let all: Vec<&[u8]> =
        files.iter().enumerate().map(|(k, it)| if k == at { changed } else { it }).collect();
    assert!(
        !is_clean(&verified(&all)),
        "{what} in file {at} is not found:\n{}",
        String::from_utf8_lossy(changed)
    );
}

#[test]
fn each_changed_removed_inserted_or_moved_byte_is_found() {
    let files = journal(1, 2, 6);
    assert!(is_clean(&verified(&files)), "{:?}", verified(&files));
    for (at, file) in files.iter().enumerate() {
        for place in 0..file.len() {
            for bit in 0..8 {
                let mut changed = file.clone();
                changed[place] ^= 1 << bit;
                refuse(&files, at, &changed, &format!("bit {bit} of byte {place}"));
            }
            let (front, back) = file.split_at(place);
            refuse(&files, at, &[front, &back[1..]].concat(), &format!("removed byte {place}"));
            refuse(&files, at, &[front, &back[..1], back].concat(), &format!("doubled byte {place}"));
        }
        let lines = lines(file);
        for line in 0..lines.len() {
            let (front, back) = (lines[..line].concat(), lines[line..].concat());
            refuse(&files, at, &[&*front, lines[line], &back].concat(), &format!("doubled line {line}"));
            refuse(
                &files,
                at,
                &[&*front, &lines[line + 1..].concat()].concat(),
                &format!("removed line {line}"),
            );
            if line + 1 < lines.len() {
                let mut moved = lines.clone();
                moved.swap(line, line + 1);
                refuse(&files, at, &moved.concat(), &format!("line {line} after the next"));
            }
        }
    }
}

/// How many random changes are tried; `SHSA_SEEDS=0..1000000` tries as many.
fn tries() -> u64 {
    let given = std::env::var("SHSA_SEEDS").ok();
    let to = given.and_then(|it| it.rsplit_once("..").and_then(|(_, to)| to.parse().ok()));
    to.unwrap_or(500)
}

/// A file with a random change: bytes overwritten, removed or inserted; lines removed, copied or moved, also from another file.
fn tampered(random: &mut ChaCha8Rng, file: &[u8], other: &[u8]) -> Vec<u8> {
    let mut below = |most: usize| random.next_u32() as usize % most.max(1);
    let (kind, at, length) = (below(7), below(file.len()), 1 + below(40));
    let upto = file.len().min(at + length);
    let mut lines = lines(file);
    let (line, place) = (below(lines.len()), below(lines.len()));
    match kind {
        0 => [&file[..at], &[below(256) as u8], &file[at + 1..]].concat(),
        1 => [&file[..at], &file[upto..]].concat(),
        2 => [&file[..at], &other[at.min(other.len())..upto.min(other.len())], &file[at..]].concat(),
        3 => {
            lines.swap(line, place);
            lines.concat()
        }
        4 => {
            lines.remove(line);
            lines.concat()
        }
        5 => {
            lines.insert(place, lines[line]);
            lines.concat()
        }
        _ => {
            let others = other.split_inclusive(|byte| *byte == b'\n');
            lines.insert(place, others.take(line + 1).last().unwrap_or_default());
            lines.concat()
        }
    }
}

#[test]
fn random_tampering_is_found() {
    let (files, mut random) = (journal(2, 3, 60), ChaCha8Rng::seed_from_u64(3));
    assert!(is_clean(&verified(&files)));
    for number in 0..tries() {
        let at = random.next_u32() as usize % files.len();
        let changed = tampered(&mut random, &files[at], &files[(at + 1) % files.len()]);
        refuse(&files, at, &changed, &format!("tampering {number}"));
    }
}

#[track_caller]
fn check(files: &[impl AsRef<[u8]>], at: usize, line: usize, problem: &Problem) {
    let finding = verified(files).finding;
    let found = finding.as_ref().map(|(file, place, problem)| (*file, place.line, problem));
    assert_eq!(found, Some((at, line, problem)));
}

#[test]
fn what_is_found_has_its_place_and_its_reason() {
    let files = journal(4, 3, 6);
    let with = |at: usize, lines: &[&[u8]]| {
        let mut all = files.clone();
        all[at] = lines.concat();
        all
    };
    let [first, second] = [lines(&files[0]), lines(&files[1])];
    let changed = first[4].to_ascii_uppercase();
    check(&with(0, &[&first[..4], &[&*changed], &first[5..]].concat()), 0, 5, &Problem::Unsealed);
    let offset = first[..2].concat().len() as u64;
    let altered = String::from_utf8_lossy(first[2]).replacen(':', ": ", 1);
    let altered = with(0, &[&first[..2], &[altered.as_bytes()], &first[3..]].concat());
    check(&altered, 0, 3, &Problem::Changed);
    assert_eq!(verified(&altered).finding.map(|it| it.1), Some(Place { line: 3, offset }));
    check(&with(0, &[&first[..3], &[second[2]], &first[3..]].concat()), 0, 4, &Problem::Inserted);
    check(&with(0, &[&first[..3], &first[4..]].concat()), 0, 4, &Problem::Changed);
    check(&with(0, &first[..5]), 0, 5, &Problem::Shortened);
    check(&[&files[0], &files[2]], 1, 1, &Problem::Missing(4));
    check(&[&files[0], &files[2], &files[0]], 2, 1, &Problem::Twice(3));
    check(&[b"{\"journal\":\"shsa-journal-1\",\"signals\":[]}\n"], 0, 1, &Problem::Unsealed);
}

#[test]
fn files_are_put_in_their_order_and_the_first_may_have_earlier_ones() {
    let files = journal(5, 4, 6);
    let found = verified(&[&files[3], &files[1], &files[2]]);
    assert!(is_clean(&found), "{found:?}");
    assert_eq!(found.order, [1, 2, 0]);
    let (number, seal) = end(&*files[3]).expect("readable").expect("sealed");
    assert_eq!((number, seal), (6, found.end));
}

#[test]
fn a_journal_that_ends_in_a_power_cut_verifies_up_to_there() {
    let file = journal(6, 1, 6).remove(0);
    let last = lines(&file).last().expect("lines").len();
    let (whole, begin) = (lines(&file).len() as u64, file.len() - last);
    for length in begin + 1..file.len() {
        for zeros in [0, 100] {
            let cut = [&file[..length], &vec![0; zeros]].concat();
            let found = verified(&[cut]);
            // All of it but the end of its line, and then zeros, is no record that was cut off.
            let is_odd = length + 1 == file.len() && zeros > 0;
            assert_eq!(found.finding.is_some(), is_odd, "{found:?}");
            let place = Place { line: lines(&file).len(), offset: begin as u64 };
            assert_eq!(found.cuts, if is_odd { vec![] } else { vec![(0, place)] });
            assert_eq!((found.records, found.unsigned), (whole - 1, whole - 1));
        }
    }
    // A run goes on after the last whole record.
    let (_, seal) = end(&file[..file.len() - 3]).expect("readable").expect("sealed");
    assert_eq!(seal, verified(&[&file[..begin]]).end);
}

#[test]
fn a_signature_of_another_key_is_found_and_what_is_not_signed_is_counted() {
    let files = journal(7, 2, 6);
    let examined: Vec<_> =
        files.iter().map(|file| examine(&**file, Some(&|_, _| false)).expect("readable")).collect();
    let (at, place, problem) = verify(&examined).finding.expect("a finding");
    assert_eq!((at, place.line, problem), (0, lines(&files[0]).len(), Problem::Signature));
    let unsigned = lines(&files[1]).len() - 1;
    let shortened = lines(&files[1])[..unsigned].concat();
    let found = verified(&[&files[0], &shortened]);
    assert_eq!((found.finding, found.unsigned), (None, unsigned as u64));
}

#[test]
fn a_sealed_journal_replays_as_the_same_without_seals() {
    let (live, mut random) = (live(), ChaCha8Rng::seed_from_u64(8));
    let mut writer = JournalWriter::new(Vec::new(), live.knowledge()).expect("a head");
    let head = std::mem::take(writer.output_mut());
    for at in 0..50 {
        writer.record(Given::Input(&input(&mut random, live.knowledge(), Time(at)))).expect("a line");
    }
    let (lines, mut sealed) = (writer.into_output(), Vec::new());
    let seal = Seal::write_head(None, 1, &head, &mut sealed).write(&lines, &mut sealed);
    let _end = seal.write_signature(&[1; 64], &mut sealed);
    let plain = read_journal(&[head, lines].concat()[..], live.clone()).expect("a journal");
    let read = read_journal(&sealed[..], live).expect("a journal");
    assert_eq!(read.damage, None);
    assert_eq!(format!("{:?}", read.eras[0].inputs), format!("{:?}", plain.eras[0].inputs));
}
