//! Conversions (`CC`): from the number in a record to the value.

use super::algebra::Algebra;
use super::block::{Block, Blocks};

/// The most values of a conversion table.
const VALUES_MAX: usize = 1 << 16;

/// The most conversions within each other.
const DEPTH_MAX: usize = 4;

/// The conversion from the number in the record to the value.
#[derive(Clone, Debug)]
pub(super) enum Conversion {
    None,
    Linear {
        offset: f64,
        factor: f64,
    },
    Rational([f64; 6]),
    Algebra(Box<Algebra>),
    /// Pairs of a number and its value; between two pairs, the value is interpolated or that of the nearest pair.
    Table {
        pairs: Vec<(f64, f64)>,
        is_interpolated: bool,
    },
    /// Numbers from and to, with the value of each; and the value of all other numbers.
    Ranges {
        ranges: Vec<(Range, f64)>,
        other: f64,
    },
    /// Texts, of which only the number in the record can be compared.
    Texts,
    /// Numbers from and to, of which some are converted to numbers and others to texts, which are no value; and the conversion of
    /// all other numbers.
    Parts {
        parts: Vec<(Range, Option<Conversion>)>,
        other: Option<Box<Conversion>>,
    },
    /// Not computed here, for this reason.
    Refused(String),
}

/// Numbers from and to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    from: f64,
    to: f64,
    /// Whether the upper limit belongs to it: in a channel of whole numbers.
    is_closed: bool,
}

impl Range {
    fn contains(self, raw: f64) -> bool {
        // A range of one number is that number.
        let is_below = raw < self.to || raw == self.to && (self.is_closed || self.from == self.to);
        self.from <= raw && is_below
    }
}

impl Conversion {
    /// Reads the conversion of a channel with numbers of this kind.
    pub(super) fn of(block: &Block, blocks: &mut Blocks<'_>, is_float: bool) -> Conversion {
        Conversion::within(block, blocks, is_float, 0)
    }

    fn within(block: &Block, blocks: &mut Blocks<'_>, is_float: bool, depth: usize) -> Conversion {
        let count = usize::from(block.u16(6)).min(VALUES_MAX);
        let values: Vec<f64> = (0..count).map(|at| block.f64(24 + 8 * at)).collect();
        let range = |from: f64, to: f64| Range { from, to, is_closed: !is_float };
        match (block.u8(0), values.as_slice()) {
            (0, _) => Conversion::None,
            (1, [offset, factor, ..]) => Conversion::Linear { offset: *offset, factor: *factor },
            (2, [a, b, c, d, e, f, ..]) => Conversion::Rational([*a, *b, *c, *d, *e, *f]),
            (3, _) => match Algebra::of(&blocks.text(block.link(4))) {
                Ok(algebra) => Conversion::Algebra(Box::new(algebra)),
                Err(problem) => Conversion::Refused(problem),
            },
            (kind @ (4 | 5), values) => {
                let pairs = values.as_chunks::<2>().0.iter().map(|[from, to]| (*from, *to)).collect();
                Conversion::Table { pairs, is_interpolated: kind == 4 }
            }
            (6, values) => {
                let (ranges, other) = values.as_chunks::<3>();
                let ranges = ranges.iter().map(|[from, to, value]| (range(*from, *to), *value)).collect();
                Conversion::Ranges { ranges, other: other.first().copied().unwrap_or(f64::NAN) }
            }
            (7, values) => {
                let keys = values.iter().map(|value| range(*value, *value)).collect();
                Conversion::parts(keys, block, blocks, depth, is_float)
            }
            (8, values) => {
                let keys = values.as_chunks::<2>().0.iter().map(|[from, to]| range(*from, *to)).collect();
                Conversion::parts(keys, block, blocks, depth, is_float)
            }
            (11, _) => Conversion::Texts,
            (kind, _) => Conversion::Refused(format!("a conversion of kind {kind} is not computed here")),
        }
    }

    /// A table whose entries are texts or conversions.
    fn parts(
        keys: Vec<Range>,
        block: &Block,
        blocks: &mut Blocks<'_>,
        depth: usize,
        is_float: bool,
    ) -> Conversion {
        let count = keys.len();
        let mut inner = |at: usize| {
            let found = blocks.of_name(block.link(4 + at), b"CC").ok().filter(|_| block.link(4 + at) != 0)?;
            let too_deep = || Conversion::Refused("conversions within each other are too deep".to_owned());
            Some(match depth < DEPTH_MAX {
                true => Conversion::within(&found, blocks, is_float, depth + 1),
                false => too_deep(),
            })
        };
        let parts: Vec<_> = keys.into_iter().enumerate().map(|(at, key)| (key, inner(at))).collect();
        let other = inner(count);
        let all = parts.iter().filter_map(|(_, part)| part.as_ref()).chain(&other);
        let mut numbers = all.filter(|part| !matches!(part, Conversion::Texts)).peekable();
        if numbers.peek().is_none() {
            return Conversion::Texts;
        }
        match numbers.find_map(Conversion::refused) {
            Some(problem) => Conversion::Refused(problem.to_owned()),
            None => Conversion::Parts { parts, other: other.map(Box::new) },
        }
    }

    /// Why the conversion is not computed here; `None` where it is.
    pub(super) fn refused(&self) -> Option<&str> {
        match self {
            Conversion::Refused(problem) => Some(problem),
            _ => None,
        }
    }

    /// The value of a number in the record; `None` where it has none.
    pub(super) fn apply(&self, raw: f64) -> Option<f64> {
        Some(match self {
            Conversion::None | Conversion::Texts => raw,
            Conversion::Linear { offset, factor } => offset + factor * raw,
            Conversion::Rational([a, b, c, d, e, f]) => {
                (a * raw * raw + b * raw + c) / (d * raw * raw + e * raw + f)
            }
            Conversion::Algebra(algebra) => return algebra.apply(raw),
            Conversion::Table { pairs, is_interpolated } => return looked_up(pairs, raw, *is_interpolated),
            Conversion::Ranges { ranges, other } => {
                let found = ranges.iter().find(|(range, _)| range.contains(raw));
                found.map_or(*other, |(_, value)| *value)
            }
            Conversion::Parts { parts, other } => {
                let found = parts.iter().find(|(range, _)| range.contains(raw));
                let part = found.map_or(other.as_deref(), |(_, part)| part.as_ref());
                return part.filter(|part| !matches!(part, Conversion::Texts))?.apply(raw);
            }
            Conversion::Refused(_) => return None,
        })
    }
}

/// The value in a table of ascending numbers; beyond its ends, the value of the end.
fn looked_up(pairs: &[(f64, f64)], raw: f64, is_interpolated: bool) -> Option<f64> {
    let at = pairs.partition_point(|(from, _)| *from <= raw);
    let (before, behind) = (at.checked_sub(1).and_then(|at| pairs.get(at)), pairs.get(at));
    Some(match (before, behind) {
        (Some((from, low)), Some((to, high))) if is_interpolated => {
            low + (raw - from) / (to - from) * (high - low)
        }
        (Some((from, low)), Some((to, high))) => {
            if raw - from <= to - raw {
                *low
            } else {
                *high
            }
        }
        (Some((_, value)), None) | (None, Some((_, value))) => *value,
        (None, None) => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(conversion: &Conversion, raw: f64, expected: Option<f64>) {
        assert_eq!(conversion.apply(raw), expected);
    }

    #[test]
    fn numbers_are_converted() {
        check(&Conversion::Linear { offset: -40.0, factor: 0.5 }, 100.0, Some(10.0));
        check(&Conversion::Rational([0.0, 1.0, 2.0, 0.0, 0.0, 4.0]), 6.0, Some(2.0));
        let pairs = vec![(0.0, 0.0), (10.0, 1.0), (20.0, 5.0)];
        let table = |is_interpolated| Conversion::Table { pairs: pairs.clone(), is_interpolated };
        for (raw, between, nearest) in
            [(-1.0, 0.0, 0.0), (10.0, 1.0, 1.0), (16.0, 3.4, 5.0), (99.0, 5.0, 5.0)]
        {
            check(&table(true), raw, Some(between));
            check(&table(false), raw, Some(nearest));
        }
        check(&Conversion::Table { pairs: Vec::new(), is_interpolated: true }, 1.0, None);
    }

    #[test]
    fn an_upper_limit_belongs_to_ranges_of_whole_numbers_only() {
        let range = |from, to, is_closed| Range { from, to, is_closed };
        let ranges = |is_closed| Conversion::Ranges {
            ranges: vec![(range(0.0, 10.0, is_closed), 7.0), (range(10.0, 20.0, is_closed), 8.0)],
            other: 9.0,
        };
        check(&ranges(true), 10.0, Some(7.0));
        check(&ranges(false), 10.0, Some(8.0));
        check(&ranges(false), 20.0, Some(9.0));
    }

    #[test]
    fn a_text_among_numbers_is_no_value() {
        let one = Range { from: 255.0, to: 255.0, is_closed: false };
        let linear = Conversion::Linear { offset: 0.0, factor: 0.1 };
        let parts = Conversion::Parts { parts: vec![(one, None)], other: Some(Box::new(linear)) };
        check(&parts, 255.0, None);
        check(&parts, 20.0, Some(2.0));
    }
}
