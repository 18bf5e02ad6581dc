//! Finds stretches in which one of two ways deviates as in no other stretch: a fault in data that should be healthy.

use super::PairFit;
use super::scales::Compared;
use crate::calibration::comparison::Comparison;
use crate::order::median;
use shsa_core::knowledge::SignalId;
use shsa_core::time::{Span, Time};

/// The most blocks of a session,
const MOST_BLOCKS: i64 = 64;
/// with at least this many comparisons in each.
const COMPARISONS: i64 = 16;
/// In an unhealthy stretch, two ways differ by more than this many times their largest difference in all other time.
const TIMES: f64 = 5.0;

/// At most one block in this many may be unhealthy: frequent deviations are no exception.
const ONE_IN: usize = 10;

/// Fewer blocks do not show what is usual.
const FEWEST_BLOCKS: usize = 20;

/// An unhealthy stretch of the fitted part.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// The session, from 0.
    pub session: usize,
    /// The first reception.
    pub from: Time,
    /// The end, exclusive, by reception.
    pub to: Time,
    /// The signals of the way that leaves its usual values.
    pub signals: Vec<SignalId>,
    /// Its largest difference to the other way, SI.
    pub apart: f64,
    /// The largest difference in all other time, SI.
    pub usual: f64,
}

/// The unhealthy stretches of a session; overlapping ones of several pairs are joined.
///
/// A manoeuvre moves both ways. A stretch is unhealthy only if one way has values, or a variation, that it never has otherwise,
/// and the other way has not.
pub(super) fn unhealthy(pairs: &[PairFit], compared: &Compared, session: usize) -> Vec<Stretch> {
    let of = |(pair, compared): (&PairFit, &Vec<Vec<Comparison>>)| {
        compared.get(session).map_or(Vec::new(), |compared| unhealthy_of(pair, compared))
    };
    let mut found: Vec<Stretch> = pairs.iter().zip(compared).flat_map(of).collect();
    found.sort_by_key(|stretch| (stretch.from, stretch.to));
    let mut all: Vec<Stretch> = Vec::new();
    for stretch in found {
        match all.last_mut().filter(|last| stretch.from <= last.to) {
            Some(last) => {
                last.to = last.to.max(stretch.to);
                last.signals.extend(stretch.signals);
                last.signals.sort_unstable();
                last.signals.dedup();
            }
            None => all.push(stretch),
        }
    }
    all.iter_mut().for_each(|it| it.session = session);
    all
}

fn unhealthy_of(pair: &PairFit, compared: &[Comparison]) -> Vec<Stretch> {
    let middle = median(compared.iter().map(|it| it.value - it.known));
    let (blocks, length) = blocks(compared, middle);
    let most = blocks.len() / ONE_IN;
    let Some(is_odd) = odd(&blocks, most).filter(|_| blocks.len() >= FEWEST_BLOCKS) else {
        return Vec::new();
    };
    let usual =
        (blocks.iter().zip(&is_odd)).filter(|(_, odd)| !**odd).map(|(it, _)| it.apart).fold(0.0, f64::max);
    let of =
        |odd: bool| blocks.iter().zip(&is_odd).filter(move |(_, it)| **it == odd).map(|(block, _)| block);
    let (odd, others): (Vec<&Block>, Vec<&Block>) = (of(true).collect(), of(false).collect());
    let is_wild = |values: fn(&Block) -> (f64, f64)| {
        let hull = |blocks: &[&Block]| {
            blocks
                .iter()
                .map(|block| values(block))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |all, it| (all.0.min(it.0), all.1.max(it.1)))
        };
        let varies = |blocks: &[&Block]| {
            blocks.iter().map(|block| values(block)).map(|(lo, hi)| hi - lo).fold(0.0, f64::max)
        };
        let (own, usual) = (hull(&odd), hull(&others));
        own.0 < usual.0 || own.1 > usual.1 || varies(&odd) > varies(&others)
    };
    let signals = match (is_wild(|block| block.value), is_wild(|block| block.known)) {
        (true, false) => &pair.one.1,
        (false, true) => &pair.other.1,
        _ => return Vec::new(),
    };
    let apart = odd.iter().map(|block| block.apart).fold(0.0, f64::max);
    let stretch = |block: &&Block| Stretch {
        session: 0,
        // The fault may have begun in the block before, or last into the block after.
        from: block.from - length,
        to: block.from + length.times(2),
        signals: signals.clone(),
        apart,
        usual,
    };
    odd.iter().map(stretch).collect()
}

/// The values of two ways in a block of time.
#[derive(Clone, Copy, Debug)]
struct Block {
    from: Time,
    /// The second largest difference: a single large one is a matter of tails.
    apart: f64,
    largest: f64,
    /// The lowest and the highest value of the one way, and of the other.
    value: (f64, f64),
    known: (f64, f64),
}

impl Block {
    fn take(&mut self, apart: f64, value: f64, known: f64) {
        self.apart = self.apart.max(apart.min(self.largest));
        self.largest = self.largest.max(apart);
        self.value = (self.value.0.min(value), self.value.1.max(value));
        self.known = (self.known.0.min(known), self.known.1.max(known));
    }
}

/// Divides comparisons into blocks, for ways with the median difference `middle`; returns the blocks and their length.
fn blocks(compared: &[Comparison], middle: f64) -> (Vec<Block>, Span) {
    let ends = compared.first().zip(compared.last());
    let Some((first, last)) = ends else { return (Vec::new(), Span(1)) };
    let lasts = last.received - first.received;
    let length = Span((lasts.0 / MOST_BLOCKS).max(lasts.0 / compared.len() as i64 * COMPARISONS).max(1));
    let mut blocks: Vec<Block> = Vec::new();
    for it in compared {
        let from = first.received + length.times((it.received - first.received).0 / length.0);
        let apart = (it.value - it.known - middle).abs();
        match blocks.last_mut().filter(|last| last.from == from) {
            Some(block) => block.take(apart, it.value, it.known),
            None => blocks.push(Block {
                from,
                apart: 0.0,
                largest: apart,
                value: (it.value, it.value),
                known: (it.known, it.known),
            }),
        }
    }
    (blocks, length)
}

/// The outlying blocks: the smallest number of most different blocks such that each run of them contains one far above all other
/// blocks. `None` when there are none, or more than `most`.
fn odd(blocks: &[Block], most: usize) -> Option<Vec<bool>> {
    let mut order: Vec<usize> = (0..blocks.len()).collect();
    order.sort_by(|&one, &other| blocks[other].apart.total_cmp(&blocks[one].apart));
    let is_far = |count: &usize| {
        let usual = blocks[order[*count]].apart;
        let is_above = |block: &Block| block.apart > usual;
        let runs = blocks.chunk_by(|one, next| is_above(one) == is_above(next));
        let mut above = runs.filter(|run| run.first().is_some_and(is_above)).peekable();
        usual > 0.0
            && above.peek().is_some()
            && above.all(|run| run.iter().any(|it| it.apart > TIMES * usual))
    };
    let count = (1..=most.min(blocks.len().saturating_sub(1))).find(is_far)?;
    Some(grown(blocks, blocks[order[count]].apart, most))
}

/// The blocks above `usual`, extended by neighbours in which the deviation fades in and out: as long as the largest of the other
/// blocks is next to one of them.
fn grown(blocks: &[Block], usual: f64, most: usize) -> Vec<bool> {
    let mut is_odd: Vec<bool> = blocks.iter().map(|block| block.apart > usual).collect();
    let mut count = is_odd.iter().filter(|odd| **odd).count();
    while count < most {
        let others = (0..blocks.len()).filter(|&at| !is_odd[at]);
        let Some(next) = others.max_by(|&one, &other| blocks[one].apart.total_cmp(&blocks[other].apart))
        else {
            break;
        };
        let beside = [next.checked_sub(1), Some(next + 1)].into_iter().flatten();
        if !beside.into_iter().any(|at| is_odd.get(at) == Some(&true)) {
            break;
        }
        is_odd[next] = true;
        count += 1;
    }
    is_odd
}
