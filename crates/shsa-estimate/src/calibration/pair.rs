//! What one pair of ways needs, and how it fares later.

use super::calm::calm_width;
use super::lasting::lasting_step;
use super::{Work, quantile, sorted};
use crate::comparison::{Comparison, Watched};
use crate::delay::Delay;
use crate::order::{Support, median, rarely_exceeded, spread};
use shsa_core::knowledge::{RelationId, SignalId, VariableId};
use shsa_core::monitor::{Debounce, WatchedWay};
use shsa_core::time::{Span, Time};

/// Blocks that the time before the split is cut into, at most.
const MOST_BLOCKS: i64 = 64;

/// A block lasts at least this many windows, so that what is in two of them hangs together little.
const WINDOWS_IN_BLOCK: i64 = 4;

/// Tails are followed to what happens once in so many times of what is fitted, and no further: half a minute is asked about an
/// hour, not about a day.
const MOST_TIMES_OF_RECORDING: f64 = 100.0;

/// What is nearer than this share of the values is not told apart: single precision, in which many sources send, has no more.
const RESOLUTION: f64 = f32::EPSILON as f64;

/// A bias counts as seen when it brings this share of the windows into conflict.
const SEEN: f64 = 0.95;

/// Two ways of knowing a variable, all values in SI.
#[derive(Clone, Debug)]
pub struct PairFit {
    /// What both know.
    pub variable: VariableId,
    /// The relations and the signals of the slower way, whose rhythm the comparisons have.
    pub one: (Vec<RelationId>, Vec<SignalId>),
    /// Those of the other.
    pub other: (Vec<RelationId>, Vec<SignalId>),
    /// Comparisons before the split and after it.
    pub compared: (usize, usize),
    /// The median of the first minus the second.
    pub offset: f64,
    /// Where the first minus the second lies in the middle between what it needs above and what it needs below, as far as
    /// that is among the middle half of its values: a tail to one side is no offset.
    pub middle: f64,
    /// The mean distance of their difference from its median.
    pub spread: f64,
    /// That as a share of how much the first itself varies; above about a half, nothing shows that the two tell the same.
    pub unexplained: f64,
    /// By how much the first is later than the second, in seconds, and what share of the spread is left then; `None`
    /// when no delay explains a part of it.
    pub late: Option<(f64, f64)>,
    /// How much wider the two must be together than without any error.
    pub needed: f64,
    /// The smallest bias that 95 % of the windows would show with just that width, in the worst quarter of the time before the
    /// split.
    pub(super) shows: f64,
    /// What that rests on; `None` without comparisons.
    pub support: Option<Support>,
    /// How long one of the blocks is, of which the support counts.
    pub block: Span,
    /// How much wider the fitted errors make them.
    pub given: f64,
    /// How often the two came into conflict after the split, with the fitted errors.
    pub conflicts: usize,
    /// The smallest bias of one of them that brings 95 % of the later windows into conflict.
    pub smallest_bias: Option<f64>,
    /// The smallest one that is an alarm when it lasts, by what many comparisons say together, and how long it must last;
    /// `None` when that is not smaller.
    pub lasting_bias: Option<(f64, Span)>,
    k: usize,
    n: usize,
    /// How long a time each comparison tells about.
    window: Span,
}

impl PairFit {
    pub(super) fn new(work: &Work<'_>, watched: &Watched, number: usize, delay: Option<Delay>) -> PairFit {
        let pair = &watched.monitor.pairs()[number];
        let all = &watched.comparisons[number];
        let early = work.before_split(all);
        let (one, other) = watched.sides(pair);
        let declared = one.computation.timing().period;
        let period = declared.unwrap_or_else(|| usual_period(early));
        let (n, k) = Debounce::default().window(period);
        let (k, n) = (k as usize, n as usize);
        let differences: Vec<f64> = early.iter().map(|it| it.value - it.known).collect();
        let values: Vec<f64> = early.iter().map(|it| it.value).collect();
        let (spread, of_values) = (spread(&differences), spread(&values));
        let duration = early
            .first()
            .zip(early.last())
            .map_or(Span::ZERO, |(first, last)| last.received - first.received);
        let block = Span((duration.0 / MOST_BLOCKS).max(period.times(WINDOWS_IN_BLOCK * n as i64).0).max(1));
        // What is rarer than once in a hundred such recordings, no tail tells.
        let supported = block.seconds() / (MOST_TIMES_OF_RECORDING * duration.seconds()).max(1e-9);
        let wanted = work.options.false_alarms_per_hour / 3600.0 * block.seconds();
        let probability = wanted.max(supported).clamp(1e-12, 0.5);
        let bound = |distance: Distance| {
            rarely_exceeded(
                &block_maxima(early, block, (k, n), distance),
                probability,
                work.options.confidence,
            )
        };
        let (above, below) = (bound(|it| it.above), bound(|it| it.below));
        let middle = above.zip(below).map_or(0.0, |((above, _), (below, _))| 0.5 * (above - below));
        let ordered = sorted(differences.iter().copied());
        let quarter = |share| quantile(&ordered, share).unwrap_or(0.0);
        let middle = middle.clamp(quarter(0.25), quarter(0.75));
        let bound = bound(EITHER);
        let largest = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let resolved = |bound: f64| if bound > 0.0 { bound.max(RESOLUTION * largest) } else { 0.0 };
        let needed = bound.map_or(0.0, |(bound, _)| resolved(bound));
        let window = one.computation.timing().window;
        let needed = calm_width(early, window, needed);
        PairFit {
            variable: one.variable(),
            one: side(one),
            other: side(other),
            compared: (early.len(), all.len() - early.len()),
            offset: median(differences.iter().copied()),
            middle,
            spread,
            unexplained: if of_values > 0.0 { spread / of_values } else { f64::INFINITY },
            late: delay.map(|delay| (delay.late_s, delay.left)),
            needed,
            shows: quarters(early)
                .filter_map(|part| shown(part, (k, n)))
                .reduce(f64::max)
                .map_or(0.0, |apart| needed + apart),
            support: bound.map(|(_, support)| support),
            block,
            given: 0.0,
            conflicts: 0,
            smallest_bias: None,
            lasting_bias: None,
            k,
            n,
            window,
        }
    }

    /// Counts conflicts after the split, and finds what bias would show, with ways that are this much wider.
    pub(super) fn test(&mut self, work: &Work<'_>, all: &[Comparison], given: f64) {
        let late = &all[work.before_split(all).len()..];
        self.given = given;
        let window = (self.k, self.n);
        let in_conflict: Vec<bool> =
            windows(late, window, EITHER).map(|(_, needed)| needed > given).collect();
        let begins = in_conflict.windows(2).filter(|pair| !pair[0] && pair[1]).count();
        self.conflicts = begins + usize::from(in_conflict.first() == Some(&true));
        self.smallest_bias = shown(late, window).map(|apart| given + apart);
        self.lasting_bias =
            self.smallest_bias.and_then(|bias| lasting_step(all, work.split, self.window, given, bias));
    }
}

/// What two ways said in a block of time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub(super) from: Time,
    /// The largest distance that a window of comparisons has.
    pub(super) apart: f64,
    /// The lowest and highest values of the one and of the other way.
    pub(super) value: (f64, f64),
    pub(super) known: (f64, f64),
}

impl PairFit {
    /// The blocks of comparisons, of ways that differ by `middle` all the time.
    pub(super) fn blocks(&self, comparisons: &[Comparison], middle: f64) -> Vec<Block> {
        let moved: Vec<Comparison> = comparisons
            .iter()
            .map(|it| Comparison { above: it.above - middle, below: it.below + middle, ..*it })
            .collect();
        let Some(start) = moved.first().map(|first| first.received) else { return Vec::new() };
        let mut blocks: Vec<Block> = Vec::new();
        for (comparison, apart) in windows(&moved, (self.k, self.n), EITHER) {
            let from = start + self.block.times((comparison.received - start).0 / self.block.0);
            let (value, known) = (comparison.value, comparison.known);
            match blocks.last_mut().filter(|last| last.from == from) {
                Some(block) => {
                    block.apart = block.apart.max(apart);
                    block.value = (block.value.0.min(value), block.value.1.max(value));
                    block.known = (block.known.0.min(known), block.known.1.max(known));
                }
                None => blocks.push(Block { from, apart, value: (value, value), known: (known, known) }),
            }
        }
        blocks
    }
}

/// The relations and the signals of a way.
fn side(way: &WatchedWay) -> (Vec<RelationId>, Vec<SignalId>) {
    let way = way.computation.way();
    (way.substitution.relations(), way.inputs().collect())
}

fn usual_period(comparisons: &[Comparison]) -> Span {
    let gaps = comparisons.windows(2).map(|pair| (pair[1].received - pair[0].received).seconds());
    Span::from_seconds(median(gaps).max(1e-3))
}

/// How far apart two ways are, to one side or to either.
type Distance = fn(&Comparison) -> f64;

/// To either side.
const EITHER: Distance = |it| it.above.max(it.below);

/// How much wider the two must be so that fewer than `k` of the last `n` comparisons disagree: the `k`th largest distance.
fn windows(
    comparisons: &[Comparison],
    (k, n): (usize, usize),
    distance: Distance,
) -> impl Iterator<Item = (&Comparison, f64)> {
    comparisons.iter().enumerate().map(move |(at, last)| {
        let recent = &comparisons[(at + 1).saturating_sub(n)..=at];
        let distances = sorted(recent.iter().map(distance));
        let needed = distances.len().checked_sub(k).map_or(f64::NEG_INFINITY, |rank| distances[rank]);
        (last, needed)
    })
}

fn quarters(comparisons: &[Comparison]) -> std::slice::Chunks<'_, Comparison> {
    comparisons.chunks(comparisons.len().div_ceil(4).max(1))
}

/// How much closer than touching the two ways are at most in all but 5 % of the windows, to the worse side; `None` without
/// a window.
fn shown(comparisons: &[Comparison], window: (usize, usize)) -> Option<f64> {
    let low = |distance: Distance| {
        let told = windows(comparisons, window, distance).map(|(_, it)| it).filter(|it| it.is_finite());
        quantile(&sorted(told), 1.0 - SEEN).map(|low| -low)
    };
    low(|it| it.above).zip(low(|it| it.below)).map(|(one, other)| one.max(other))
}

/// The largest need in each block of time that has any.
fn block_maxima(
    comparisons: &[Comparison],
    block: Span,
    window: (usize, usize),
    distance: Distance,
) -> Vec<f64> {
    let Some(start) = comparisons.first().map(|first| first.received) else { return Vec::new() };
    let mut maxima: Vec<(i64, f64)> = Vec::new();
    for (comparison, needed) in windows(comparisons, window, distance).filter(|(_, it)| it.is_finite()) {
        let number = (comparison.received - start).0 / block.0;
        match maxima.last_mut().filter(|(last, _)| *last == number) {
            Some((_, largest)) => *largest = largest.max(needed),
            None => maxima.push((number, needed)),
        }
    }
    maxima.into_iter().map(|(_, largest)| largest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_core::time::Validity;

    #[test]
    fn a_bump_that_is_shorter_than_the_window_asks_for_nothing() {
        let comparison = |at: i64, above: f64| Comparison {
            received: Time(at),
            validity: Validity::at(Time(at)),
            value: 0.0,
            known: 0.0,
            above,
            below: -above,
            width: 0.0,
        };
        let all: Vec<Comparison> =
            (0..12).map(|at| comparison(at, if at == 5 { 9.0 } else { -1.0 / (at + 1) as f64 })).collect();
        // 2 of 4: the second largest distance, to whichever side.
        let needed: Vec<f64> = windows(&all, (2, 4), EITHER).map(|(_, needed)| needed).collect();
        assert_eq!(needed[0], f64::NEG_INFINITY);
        assert!(needed[5..9].iter().all(|needed| (0.0..1.0).contains(needed)), "{needed:?}");
        assert_eq!(block_maxima(&all, Span(6), (2, 4), EITHER), [0.5, 0.25]);
    }
}
