//! The least and the greatest value of a formula over intervals, where interval arithmetic overestimates.
//!
//! A formula that rises with a variable has its least value at the variable's lower bound. Bounds of the derivatives tell where it
//! rises or falls; then the variable is known, the derivatives by the others become narrower, and so on. Where the formula neither
//! only rises nor only falls, its value lies around that in the middle by no more than the slopes allow (the mean value form), and
//! the interval is taken apart: at its bounds where the formula is linear in it, else into halves, the part that may hold the least
//! value first. The least of what bounds the parts bounds the whole.
//!
//! Source: R. E. Moore, R. B. Kearfott, M. J. Cloud, "Introduction to Interval Analysis", 2009, chapter 6,
//! doi:10.1137/1.9780898717716.

use super::tape::Tape;
use crate::interval::Interval;
use alloc::vec;
use alloc::vec::Vec;

/// By what share of the range each bound may be off: both together by less than a twentieth.
const SHARE: f64 = 0.02;
/// Steps for each bound, some hundred microseconds. A formula that rises or falls in each variable goes three times through its
/// steps, each division of an interval up to six times.
const MOST_STEPS: usize = 4_000;
/// Parts that wait to be taken apart.
const MOST_PARTS: usize = 24;

/// The memory of searches, allocated once.
#[derive(Clone, Debug, Default)]
pub(super) struct Workspace {
    values: Vec<Interval>,
    by_step: Vec<Interval>,
    by_leaf: Vec<Interval>,
    /// The leaves over which the formula is examined, and their middles in a part.
    whole: Vec<Interval>,
    centre: Vec<Interval>,
    /// The parts, one behind the other, with what is known of each.
    parts: Vec<Interval>,
    known: Vec<Part>,
}

/// A part of the whole that may hold the least value.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    /// No value in this part is less.
    least: f64,
    /// The leaf to take apart next.
    split: usize,
}

/// What a search has found so far.
#[derive(Clone, Copy)]
struct Found {
    side: Side,
    /// The least bound among parts that are not examined further.
    settled: f64,
    /// About the least value that is taken; both searches stop where the rest does not matter beside the range.
    taken: f64,
    /// The number of waiting parts.
    count: usize,
    /// The number of steps made.
    steps: usize,
}

/// Which extreme is searched for.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Least,
    Greatest,
}

impl Side {
    /// The value as one whose least is searched for.
    fn turned(self, value: Interval) -> Interval {
        if self == Side::Least { value } else { -value }
    }
}

impl Workspace {
    /// Memory for the largest of these tapes.
    pub(super) fn new<'t>(tapes: impl Iterator<Item = &'t Tape> + Clone) -> Workspace {
        let steps = tapes.clone().map(Tape::len).max().unwrap_or(0);
        let leaves = tapes.map(|tape| tape.leaves().len()).max().unwrap_or(0);
        let room = |count: usize| vec![Interval::EMPTY; count];
        Workspace {
            values: room(steps),
            by_step: room(steps),
            by_leaf: room(leaves),
            whole: room(leaves),
            centre: room(leaves),
            parts: room(leaves * MOST_PARTS),
            known: vec![Part::default(); if leaves > 0 { MOST_PARTS } else { 0 }],
        }
    }

    /// An interval that holds the formula's values for all values of its leaves, which are given by their places; no wider than
    /// `natural`, which does.
    ///
    /// Time: about [`MOST_STEPS`] for each bound. Allocates nothing.
    pub(super) fn enclose(
        &mut self,
        tape: &Tape,
        natural: Interval,
        leaves: impl Iterator<Item = Interval>,
    ) -> Interval {
        self.whole.iter_mut().zip(leaves).for_each(|(own, leaf)| *own = leaf);
        let is_examined = tape.leaves().iter().zip(&self.whole).all(|(_, over)| over.is_bounded());
        if natural.is_empty() || !is_examined || is_settled(tape, &self.whole) {
            return natural;
        }
        let mut greatest = self.begun(tape, Side::Greatest);
        let mut least = self.begun(tape, Side::Least);
        self.finish(tape, &mut least, greatest.taken);
        if greatest.count > 0 {
            greatest = self.begun(tape, Side::Greatest);
            self.finish(tape, &mut greatest, least.taken);
        }
        natural.intersection(Interval::new(least.settled, -greatest.settled))
    }

    /// Examines the whole.
    fn begun(&mut self, tape: &Tape, side: Side) -> Found {
        let mut found = Found { side, settled: f64::INFINITY, taken: f64::INFINITY, count: 0, steps: 0 };
        self.parts.iter_mut().zip(&self.whole).for_each(|(own, whole)| *own = *whole);
        self.examine(tape, &mut found, f64::NEG_INFINITY);
        found
    }

    /// Takes parts apart until the least value is known well enough beside what is taken on the other side.
    fn finish(&mut self, tape: &Tape, found: &mut Found, opposite: f64) {
        loop {
            let waiting =
                self.known.get(..found.count).unwrap_or(&[]).iter().map(|part| part.least).enumerate();
            let lowest = waiting.min_by(|one, other| one.1.total_cmp(&other.1));
            let Some((at, least)) = lowest.filter(|(_, least)| *least < found.settled) else { return };
            let range = -opposite - found.taken;
            let is_known = found.taken - least <= SHARE * range;
            if is_known || found.steps >= MOST_STEPS || found.count == MOST_PARTS {
                found.settled = least;
                return;
            }
            self.take_apart(tape, found, at);
        }
    }

    /// Replaces a waiting part by two that together hold its least value.
    fn take_apart(&mut self, tape: &Tape, found: &mut Found, at: usize) {
        let Some(&Part { least, split }) = self.known.get(at) else { return };
        let (count, last) = (tape.leaves().len(), found.count - 1);
        // The part becomes the last one, and the one behind it its copy.
        self.known.swap(at, last);
        for leaf in 0..count {
            self.parts.swap(at * count + leaf, last * count + leaf);
        }
        self.parts.copy_within(last * count..(last + 1) * count, (last + 1) * count);
        let over = self.parts.get(last * count + split).copied().unwrap_or(Interval::EMPTY);
        let is_linear = tape.leaves().get(split).is_some_and(|leaf| leaf.is_linear);
        let middle = over.midpoint();
        let (one, other) = match is_linear {
            true => (Interval::point(over.lo()), Interval::point(over.hi())),
            false => (Interval::new(over.lo(), middle), Interval::new(middle, over.hi())),
        };
        for (part, over) in [(last, one), (last + 1, other)] {
            self.parts.get_mut(part * count + split).into_iter().for_each(|own| *own = over);
        }
        found.count = last;
        self.examine(tape, found, least);
        self.parts.copy_within((last + 1) * count..(last + 2) * count, found.count * count);
        self.examine(tape, found, least);
    }

    /// Examines the part behind the waiting ones: it waits, too, or is settled. `least` bounds it.
    fn examine(&mut self, tape: &Tape, found: &mut Found, mut least: f64) {
        let count = tape.leaves().len();
        let Workspace { values, by_step, by_leaf, whole, centre, parts, known } = self;
        let Some(part) = parts.get_mut(found.count * count..(found.count + 1) * count) else { return };
        let is_smooth = loop {
            found.steps += tape.len();
            let value = found.side.turned(tape.forwards(part, values));
            least = least.max(value.lo());
            if value.is_empty() || least >= found.settled {
                return;
            }
            if is_settled(tape, part) {
                found.settled = least;
                found.taken = found.taken.min(least);
                return;
            }
            found.steps += tape.len();
            if !tape.backwards(values, by_step, by_leaf) {
                break false;
            }
            by_leaf.iter_mut().for_each(|slope| *slope = found.side.turned(*slope));
            if !moved_to_ends(part, by_leaf) {
                break true;
            }
        };
        let mut split = (0, f64::NEG_INFINITY);
        centre.iter_mut().zip(&*part).for_each(|(own, over)| *own = *over);
        let mut around = Interval::new(0.0, 0.0);
        for (at, leaf) in tape.leaves().iter().enumerate() {
            let (Some(over), Some(middle), Some(slope)) = (part.get(at), centre.get_mut(at), by_leaf.get(at))
            else {
                continue;
            };
            if !leaf.is_repeated || over.is_point() {
                continue;
            }
            *middle = Interval::point(over.midpoint());
            around = around + *slope * (*over - *middle);
            let size = match is_smooth {
                true => slope.magnitude() * over.width(),
                false => over.width() / whole.get(at).map_or(1.0, |whole| whole.width()),
            };
            split = if size > split.1 { (at, size) } else { split };
        }
        found.steps += tape.len();
        let middle = found.side.turned(tape.forwards(centre, values));
        found.taken = found.taken.min(middle.lo());
        if is_smooth {
            least = least.max((middle + around).lo());
        }
        known.get_mut(found.count).into_iter().for_each(|part| *part = Part { least, split: split.0 });
        found.count += 1;
    }
}

/// Whether interval arithmetic is exact over these leaves: all that are used in several places are single numbers.
fn is_settled(tape: &Tape, leaves: &[Interval]) -> bool {
    tape.leaves().iter().zip(leaves).all(|(leaf, over)| !leaf.is_repeated || over.is_point())
}

/// Moves each leaf in which the formula only rises or only falls to the end of its least value; returns whether there is one.
fn moved_to_ends(part: &mut [Interval], slopes: &[Interval]) -> bool {
    let mut is_moved = false;
    for (over, slope) in part.iter_mut().zip(slopes).filter(|(over, _)| !over.is_point()) {
        if slope.lo() >= 0.0 {
            *over = Interval::point(over.lo());
        } else if slope.hi() <= 0.0 {
            *over = Interval::point(over.hi());
        } else {
            continue;
        }
        is_moved = true;
    }
    is_moved
}
