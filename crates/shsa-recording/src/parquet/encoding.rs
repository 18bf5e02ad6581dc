//! The encodings of Parquet: plain, by dictionary, as differences, in runs.
//!
//! Format: <https://github.com/apache/parquet-format/blob/master/Encodings.md>.

use super::bytes::Bytes;
use super::cells::{Cell, Cells, Runs};
use super::description::{Column, Meaning, Physical};
use std::ops::Range;

/// The days from the Julian epoch to 1970.
const JULIAN_1970: i64 = 2_440_588;
const DAY_NS: i64 = 86_400_000_000_000;

/// A whole number as a value of the column.
#[inline]
fn whole(column: &Column, whole: i64) -> Cell {
    match (column.meaning, column.physical) {
        (Meaning::Decimal(parts), _) => Cell::Number(whole as f64 / parts),
        (Meaning::Unsigned, Physical::I32) => Cell::Whole(whole & 0xffff_ffff),
        (Meaning::Unsigned, _) if whole < 0 => Cell::Number(whole.cast_unsigned() as f64),
        (Meaning::Moment { step_ns, .. }, _) => whole.checked_mul(step_ns).map_or(Cell::Missing, Cell::Whole),
        _ => Cell::Whole(whole),
    }
}

/// Adds bytes as a value of the column: a decimal number, or a text.
fn push_bytes(cells: &mut Cells, column: &Column, bytes: &[u8]) -> Option<()> {
    let parts = match (column.meaning, bytes.first_chunk()) {
        (Meaning::Decimal(parts), _) => parts,
        (Meaning::Half, Some(half)) => {
            return cells.push(Cell::Number(half_number(u16::from_le_bytes(*half))), 1);
        }
        _ => return cells.push_text(bytes),
    };
    let sign = if bytes.first().is_some_and(|first| *first >= 0x80) { -1.0 } else { 0.0 };
    let number = bytes.iter().fold(sign, |number, byte| number * 256.0 + f64::from(*byte));
    cells.push(Cell::Number(number / parts), 1)
}

/// A floating-point number of 16 bits: the sign, 5 bits of the exponent, 10 of the fraction (IEEE 754 binary16).
fn half_number(bits: u16) -> f64 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f64::from(bits & 0x3ff));
    sign * match exponent {
        0 => fraction * 2.0_f64.powi(-24),
        0x1f if fraction == 0.0 => f64::INFINITY,
        0x1f => f64::NAN,
        _ => (1024.0 + fraction) * 2.0_f64.powi(exponent - 25),
    }
}

/// Whether the values of a column all take the same number of bytes, or a bit each.
pub(super) fn has_width(column: &Column) -> bool {
    !matches!(column.physical, Physical::Bytes | Physical::Fixed(_))
}

/// Reads values that are stored one after the other.
pub(super) fn plain(bytes: &mut Bytes<'_>, column: &Column, count: usize, cells: &mut Cells) -> Option<()> {
    // A value takes a bit at least; otherwise values of no length would be read without end.
    if count.div_ceil(8) > bytes.0.len() {
        return None;
    }
    if has_width(column) {
        plain_numbers(bytes, column, count, cells)?;
        return (!cells.is_full).then_some(());
    }
    for _ in 0..count {
        let length = match column.physical {
            Physical::Fixed(length) => length,
            _ => bytes.u32()?,
        };
        push_bytes(cells, column, bytes.take(length)?)?;
    }
    Some(())
}

/// Reads values of the same width.
pub(super) fn plain_numbers(
    bytes: &mut Bytes<'_>,
    column: &Column,
    count: usize,
    to: &mut impl Extend<Cell>,
) -> Option<()> {
    match column.physical {
        Physical::Bool => {
            let bits = bytes.take(count.div_ceil(8))?;
            let bit = |at: usize| bits.get(at / 8).is_some_and(|byte| byte >> (at % 8) & 1 == 1);
            to.extend((0..count).map(|at| Cell::Whole(bit(at).into())));
        }
        Physical::I32 => {
            to.extend(words(bytes, count)?.iter().map(|it| whole(column, i32::from_le_bytes(*it).into())));
        }
        Physical::I64 => {
            to.extend(words(bytes, count)?.iter().map(|it| whole(column, i64::from_le_bytes(*it))));
        }
        Physical::I96 => to.extend(words(bytes, count)?.iter().map(moment)),
        Physical::F32 => {
            to.extend(words(bytes, count)?.iter().map(|it| Cell::Number(f32::from_le_bytes(*it).into())));
        }
        Physical::F64 => {
            to.extend(words(bytes, count)?.iter().map(|it| Cell::Number(f64::from_le_bytes(*it))));
        }
        Physical::Bytes | Physical::Fixed(_) => return None,
    }
    Some(())
}

/// The bytes of each value of a column; `None` where these differ, or are fewer than one.
pub(super) fn width(column: &Column) -> Option<usize> {
    match column.physical {
        Physical::I32 | Physical::F32 => Some(4),
        Physical::I64 | Physical::F64 => Some(8),
        Physical::I96 => Some(12),
        Physical::Bool | Physical::Bytes | Physical::Fixed(_) => None,
    }
}

/// The next so many words.
fn words<'a, const WIDTH: usize>(bytes: &mut Bytes<'a>, count: usize) -> Option<&'a [[u8; WIDTH]]> {
    Some(bytes.take(count.checked_mul(WIDTH)?)?.as_chunks().0)
}

/// A time as the nanoseconds of the day and the number of the day.
fn moment(word: &[u8; 12]) -> Cell {
    let (Some(of_day), Some(day)) = (word.first_chunk(), word.last_chunk()) else { return Cell::Missing };
    let day = i64::from(i32::from_le_bytes(*day)) - JULIAN_1970;
    let since = day.checked_mul(DAY_NS).and_then(|ns| ns.checked_add(i64::from_le_bytes(*of_day)));
    since.map_or(Cell::Missing, Cell::Whole)
}

/// Reads values whose bytes are stored apart: all first ones, then all second ones.
pub(super) fn split(bytes: &mut Bytes<'_>, column: &Column, count: usize, cells: &mut Cells) -> Option<()> {
    let width = match column.physical {
        Physical::I32 | Physical::F32 => 4,
        Physical::I64 | Physical::F64 => 8,
        Physical::Fixed(width) => width,
        Physical::Bool | Physical::I96 | Physical::Bytes => return None,
    };
    let all = bytes.take(count.checked_mul(width)?)?;
    let whole = (0..count).flat_map(|value| (0..width).map(move |at| at * count + value));
    let joined: Vec<u8> = whole.map_while(|at| all.get(at).copied()).collect();
    plain(&mut Bytes(&joined), column, count, cells)
}

/// Reads values by their indices in a dictionary.
pub(super) fn of_dictionary(
    bytes: &mut Bytes<'_>,
    dictionary: &[Cell],
    count: usize,
    cells: &mut Cells,
) -> Option<()> {
    let width = bytes.byte()?;
    let numbers = runs(bytes, width, count)?;
    numbers
        .list
        .iter()
        .try_for_each(|(number, times)| cells.push(*dictionary.get(*number as usize)?, *times as usize))
}

/// The most runs of different numbers in a page, which take 32 MiB.
const RUNS_MAX: usize = 1 << 22;

/// Reads values by their indices in a dictionary of so many values: the indices, all of which are in it.
pub(super) fn numbers(bytes: &mut Bytes<'_>, dictionary: usize, count: usize) -> Option<Vec<u32>> {
    let mut numbers = Vec::with_capacity(count);
    if count > 0 {
        let width = bytes.byte()?;
        each_run(bytes, width, count, &mut |run| {
            match run {
                Run::Same(number, times) => numbers.resize(numbers.len() + times, number),
                Run::Packed(packed) => numbers.extend(packed.map(|number| number as u32)),
            }
            Some(())
        })?;
    }
    let are_known = numbers.iter().all(|number| (*number as usize) < dictionary);
    are_known.then_some(numbers)
}

/// Reads small numbers in runs of one number, or packed in `width` bits each.
pub(super) fn runs(bytes: &mut Bytes<'_>, width: u8, count: usize) -> Option<Runs<u32>> {
    let mut numbers = Runs::default();
    each_run(bytes, width, count, &mut |run| {
        let mut push = |number, times| {
            numbers.push(number, times);
            (numbers.list.len() <= RUNS_MAX).then_some(())
        };
        match run {
            Run::Same(number, times) => push(number, times),
            Run::Packed(mut packed) => packed.try_for_each(|number| push(number as u32, 1)),
        }
    })?;
    Some(numbers)
}

/// Small numbers that are stored together.
enum Run<'a> {
    /// A number, and how often it follows itself.
    Same(u32, usize),
    /// Different numbers.
    Packed(Unpacked<'a>),
}

/// Passes on small numbers as [`runs`] reads them.
fn each_run(
    bytes: &mut Bytes<'_>,
    width: u8,
    count: usize,
    pass: &mut impl FnMut(Run<'_>) -> Option<()>,
) -> Option<()> {
    if width > 32 {
        return None;
    }
    let mut left = count;
    while left > 0 {
        let head = bytes.varint()?;
        let length = usize::try_from(head >> 1).ok()?;
        let is_packed = head & 1 == 1;
        let times = if is_packed { length.saturating_mul(8) } else { length }.min(left);
        left -= times;
        if width == 0 {
            pass(Run::Same(0, times))?;
        } else if is_packed {
            let packed = length.checked_mul(usize::from(width))?;
            // The last run may be shorter than stated where no more values follow.
            let taken = bytes.take(packed.min(bytes.0.len()))?;
            pass(Run::Packed(Unpacked::of(taken, width.into(), times)?))?;
        } else {
            let value = bytes.take(usize::from(width).div_ceil(8))?;
            let value = value.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte));
            pass(Run::Same(value, times))?;
        }
    }
    Some(())
}

/// Numbers packed in `width` bits each, at most 64, the lowest bit first.
struct Unpacked<'a> {
    bytes: &'a [u8],
    width: usize,
    mask: u64,
    places: Range<usize>,
}

impl<'a> Unpacked<'a> {
    /// So many numbers; `None` where the bytes are too few.
    fn of(bytes: &'a [u8], width: usize, count: usize) -> Option<Unpacked<'a>> {
        if width.checked_mul(count)?.div_ceil(8) > bytes.len() {
            return None;
        }
        let mask = if width >= 64 { u64::MAX } else { (1 << width) - 1 };
        Some(Unpacked { bytes, width, mask, places: 0..count })
    }
}

impl Iterator for Unpacked<'_> {
    type Item = u64;

    #[inline]
    fn next(&mut self) -> Option<u64> {
        let bit = self.places.next()? * self.width;
        let (first, shift) = (bit / 8, bit % 8);
        let rest = self.bytes.get(first..).unwrap_or_default();
        Some(match rest.first_chunk() {
            Some(word) if self.width + shift <= 64 => u64::from_le_bytes(*word) >> shift & self.mask,
            _ => (wide(rest) >> shift) as u64 & self.mask,
        })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        self.places.size_hint()
    }
}

/// The first nine bytes, or as many as there are, as a number.
fn wide(bytes: &[u8]) -> u128 {
    let taken = bytes.get(..bytes.len().min(9)).unwrap_or_default();
    taken.iter().rev().fold(0, |wide, byte| wide << 8 | u128::from(*byte))
}

/// Reads whole numbers stored as differences.
pub(super) fn differences(bytes: &mut Bytes<'_>, most: usize) -> Option<Vec<i64>> {
    let (block, parts) = (usize::try_from(bytes.varint()?).ok()?, usize::try_from(bytes.varint()?).ok()?);
    let total = usize::try_from(bytes.varint()?).ok()?;
    let mut last = bytes.zigzag()?;
    if total > most
        || block == 0
        || block > 1 << 20
        || parts == 0
        || parts > 512
        || !block.is_multiple_of(parts)
    {
        return None;
    }
    let mut numbers = Vec::with_capacity(total);
    if total > 0 {
        numbers.push(last);
    }
    while numbers.len() < total {
        let least = bytes.zigzag()?;
        let widths = bytes.take(parts)?;
        for width in widths.iter().map(|width| usize::from(*width)) {
            let left = total - numbers.len();
            if left == 0 {
                break;
            }
            let part = block / parts;
            if width > 64 {
                return None;
            }
            let packed = bytes.take((width * part).div_ceil(8).min(bytes.0.len()))?;
            for above in Unpacked::of(packed, width, part.min(left))? {
                last = last.wrapping_add(least).wrapping_add(above.cast_signed());
                numbers.push(last);
            }
        }
    }
    Some(numbers)
}

/// Reads whole numbers stored as differences, as values of the column.
pub(super) fn of_differences(
    bytes: &mut Bytes<'_>,
    column: &Column,
    most: usize,
    cells: &mut Cells,
) -> Option<()> {
    let is_narrow = column.physical == Physical::I32;
    for number in differences(bytes, most)? {
        let number = if is_narrow { i64::from(number as i32) } else { number };
        cells.push(whole(column, number), 1)?;
    }
    Some(())
}

/// Reads texts: their lengths as differences, then all letters. With `has_prefixes`, each text shares a prefix with the one
/// before.
pub(super) fn texts(
    bytes: &mut Bytes<'_>,
    column: &Column,
    most: usize,
    has_prefixes: bool,
    cells: &mut Cells,
) -> Option<()> {
    let prefixes = if has_prefixes { differences(bytes, most)? } else { Vec::new() };
    let mut before: Vec<u8> = Vec::new();
    for (at, length) in differences(bytes, most)?.into_iter().enumerate() {
        let prefix = prefixes.get(at).map_or(Some(0), |prefix| usize::try_from(*prefix).ok())?;
        if prefix > before.len() {
            return None;
        }
        before.truncate(prefix);
        before.extend_from_slice(bytes.take(usize::try_from(length).ok()?)?);
        push_bytes(cells, column, &before)?;
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_numbers() {
        for (bits, expected) in [
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x7bff, 65_504.0),
            (0x0001, 5.960_464_477_539_063e-8),
            (0x3555, 0.333_251_953_125),
            (0xfc00, f64::NEG_INFINITY),
        ] {
            assert_eq!(half_number(bits), expected);
        }
        assert!(half_number(0x7e00).is_nan());
    }
}
