//! Stretches in which one of two ways leaves the other, as no other stretch does: a fault in what should be healthy.

use super::Work;
use super::pair::{Block, PairFit};
use crate::comparison::Watched;
use crate::order::median;
use shsa_core::knowledge::SignalId;
use shsa_core::time::Time;

/// In a stretch like that, two ways are apart by more than this many times the most of all other time.
const TIMES: f64 = 5.0;

/// No more than one in so many blocks may look like that: what is more frequent is no exception.
const ONE_IN: usize = 10;

/// Fewer blocks say nothing about what is usual.
const FEWEST_BLOCKS: usize = 20;

/// A time before the split that is not taken as healthy.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// Since when, by reception.
    pub from: Time,
    /// Until when, this moment excluded.
    pub to: Time,
    /// The signals of the way that leaves what it says otherwise.
    pub signals: Vec<SignalId>,
    /// How far it is from the other way, in SI.
    pub apart: f64,
    /// How far the two are apart at most in all other time, in SI.
    pub usual: f64,
}

impl Work<'_> {
    /// The stretches before the split that look like faults; those of several pairs that meet are one.
    ///
    /// A manoeuvre moves both ways; what is left out is only where one way says what it never says otherwise, or varies
    /// as it never does, and the other does not.
    pub(super) fn unhealthy(&self, watched: &Watched) -> Vec<Stretch> {
        let mut found: Vec<Stretch> =
            (0..watched.comparisons.len()).flat_map(|at| self.unhealthy_of(watched, at)).collect();
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
        all
    }

    fn unhealthy_of(&self, watched: &Watched, at: usize) -> Vec<Stretch> {
        let pair = PairFit::new(self, watched, at, None);
        let early = self.before_split(&watched.comparisons[at]);
        let middle = median(early.iter().map(|it| it.value - it.known));
        let blocks = pair.blocks(early, middle);
        let most = blocks.len() / ONE_IN;
        let Some(is_odd) = odd(&blocks, most).filter(|_| blocks.len() >= FEWEST_BLOCKS) else {
            return Vec::new();
        };
        let usual = (blocks.iter().zip(&is_odd))
            .filter(|(_, odd)| !**odd)
            .map(|(it, _)| it.apart)
            .fold(0.0, f64::max);
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
            // A block more on either side: it may have begun there, or not yet have ended.
            from: block.from - pair.block,
            to: block.from + pair.block.times(2),
            signals: signals.clone(),
            apart,
            usual,
        };
        odd.iter().map(stretch).collect()
    }
}

/// The blocks that are no part of the rest: the fewest that are furthest apart, each run of them with one that is by far
/// further apart than all others are; `None` when there are none, or more than `most`.
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

/// Which blocks are further apart than `usual`, with those beside them that fade in and out: while the furthest of all
/// others is next to one of them.
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
