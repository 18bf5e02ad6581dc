//! The known units and prefixes, and the search for the nearest known name.
//!
//! Sizes after the SI brochure (BIPM, 9th edition, 2019) and, for the others, the international yard and pound agreement of 1959;
//! bytes after IEC 80000-13. `t` (tonne) and `in` are left out: the first is the name of time in many models, the second a common
//! word.

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::f64::consts::PI;

use super::Dimension;

/// The size of one unit: `over / under` coherent SI units, and the SI value of its zero.
#[derive(Clone, Copy)]
pub(super) struct Size {
    pub(super) dimension: Dimension,
    pub(super) over: f64,
    pub(super) under: f64,
    pub(super) offset: f64,
}

struct Row {
    names: &'static [&'static str],
    exponents: [i8; 9],
    over: f64,
    under: f64,
    offset: f64,
    prefixed: bool,
}

/// A unit that takes SI prefixes.
const fn si(names: &'static [&'static str], exponents: [i8; 9]) -> Row {
    Row { names, exponents, over: 1.0, under: 1.0, offset: 0.0, prefixed: true }
}

/// A unit of another size that takes no prefix.
const fn sized(names: &'static [&'static str], exponents: [i8; 9], over: f64, under: f64) -> Row {
    Row { names, exponents, over, under, offset: 0.0, prefixed: false }
}

/// A unit of another size that takes prefixes nevertheless.
const fn scaled(names: &'static [&'static str], exponents: [i8; 9], over: f64, under: f64) -> Row {
    Row { names, exponents, over, under, offset: 0.0, prefixed: true }
}

const fn shifted(names: &'static [&'static str], over: f64, under: f64, offset: f64) -> Row {
    Row { names, exponents: KELVIN, over, under, offset, prefixed: false }
}

const PLAIN: [i8; 9] = [0; 9];
const METRE: [i8; 9] = [1, 0, 0, 0, 0, 0, 0, 0, 0];
const KILOGRAM: [i8; 9] = [0, 1, 0, 0, 0, 0, 0, 0, 0];
const SECOND: [i8; 9] = [0, 0, 1, 0, 0, 0, 0, 0, 0];
const KELVIN: [i8; 9] = [0, 0, 0, 0, 1, 0, 0, 0, 0];
const RADIAN: [i8; 9] = [0, 0, 0, 0, 0, 0, 0, 1, 0];
const SPEED: [i8; 9] = [1, 0, -1, 0, 0, 0, 0, 0, 0];
const VOLUME: [i8; 9] = [3, 0, 0, 0, 0, 0, 0, 0, 0];
const PRESSURE: [i8; 9] = [-1, 1, -2, 0, 0, 0, 0, 0, 0];
const ENERGY: [i8; 9] = [2, 1, -2, 0, 0, 0, 0, 0, 0];
const POWER: [i8; 9] = [2, 1, -3, 0, 0, 0, 0, 0, 0];
const DATA: [i8; 9] = [0, 0, 0, 0, 0, 0, 0, 0, 1];
const CHARGE: [i8; 9] = [0, 0, 1, 1, 0, 0, 0, 0, 0];

const ROWS: [Row; 62] = [
    si(&["m"], METRE),
    si(&["s"], SECOND),
    si(&["A"], [0, 0, 0, 1, 0, 0, 0, 0, 0]),
    si(&["K"], KELVIN),
    si(&["mol"], [0, 0, 0, 0, 0, 1, 0, 0, 0]),
    si(&["cd"], [0, 0, 0, 0, 0, 0, 1, 0, 0]),
    si(&["rad"], RADIAN),
    si(&["Hz"], [0, 0, -1, 0, 0, 0, 0, 0, 0]),
    si(&["N"], [1, 1, -2, 0, 0, 0, 0, 0, 0]),
    si(&["Nm"], ENERGY),
    si(&["Pa"], PRESSURE),
    si(&["J", "Ws"], ENERGY),
    si(&["W", "VA"], POWER),
    si(&["C", "As"], CHARGE),
    si(&["V"], [2, 1, -3, -1, 0, 0, 0, 0, 0]),
    si(&["ohm", "Ohm", "\u{3a9}", "\u{2126}"], [2, 1, -3, -2, 0, 0, 0, 0, 0]),
    si(&["F"], [-2, -1, 4, 2, 0, 0, 0, 0, 0]),
    si(&["S"], [-2, -1, 3, 2, 0, 0, 0, 0, 0]),
    si(&["Wb", "Vs"], [2, 1, -2, -1, 0, 0, 0, 0, 0]),
    si(&["T"], [0, 1, -2, -1, 0, 0, 0, 0, 0]),
    si(&["H"], [2, 1, -2, -2, 0, 0, 0, 0, 0]),
    si(&["lm"], [0, 0, 0, 0, 0, 0, 1, 0, 0]),
    si(&["lx"], [-2, 0, 0, 0, 0, 0, 1, 0, 0]),
    scaled(&["g"], KILOGRAM, 1.0, 1e3),
    scaled(&["l", "L"], VOLUME, 1.0, 1e3),
    scaled(&["bar"], PRESSURE, 1e5, 1.0),
    scaled(&["Wh", "VAh"], ENERGY, 3600.0, 1.0),
    scaled(&["Ah"], CHARGE, 3600.0, 1.0),
    sized(&["min"], SECOND, 60.0, 1.0),
    sized(&["h"], SECOND, 3600.0, 1.0),
    sized(&["d"], SECOND, 86_400.0, 1.0),
    sized(&["deg", "°"], RADIAN, PI, 180.0),
    sized(&["arcmin"], RADIAN, PI, 10_800.0),
    sized(&["arcsec"], RADIAN, PI, 648_000.0),
    sized(&["rev"], RADIAN, 2.0 * PI, 1.0),
    sized(&["rpm"], [0, 0, -1, 0, 0, 0, 0, 1, 0], PI, 30.0),
    sized(&["%"], PLAIN, 1.0, 100.0),
    sized(&["‰", "permille"], PLAIN, 1.0, 1e3),
    sized(&["ppm"], PLAIN, 1.0, 1e6),
    sized(&["ppb"], PLAIN, 1.0, 1e9),
    sized(&["kph", "kmh"], SPEED, 1e3, 3600.0),
    sized(&["mph"], SPEED, 1_609_344.0, 3_600_000.0),
    sized(&["kn"], SPEED, 1852.0, 3600.0),
    sized(&["inch"], METRE, 254.0, 10_000.0),
    sized(&["ft"], METRE, 3048.0, 10_000.0),
    sized(&["yd"], METRE, 9144.0, 10_000.0),
    sized(&["mi"], METRE, 1_609_344.0, 1000.0),
    sized(&["nmi"], METRE, 1852.0, 1.0),
    sized(&["lb"], KILOGRAM, 45_359_237.0, 1e8),
    sized(&["psi"], PRESSURE, 44_482_216_152_605.0, 6_451_600_000.0),
    sized(&["atm"], PRESSURE, 101_325.0, 1.0),
    sized(&["mmHg"], PRESSURE, 133_322_387_415.0, 1e9),
    // Rows of their own instead of prefixes: `dB` is no tenth of a byte.
    sized(&["B"], DATA, 1.0, 1.0),
    sized(&["kB"], DATA, 1e3, 1.0),
    sized(&["MB"], DATA, 1e6, 1.0),
    sized(&["GB"], DATA, 1e9, 1.0),
    sized(&["KiB"], DATA, 1024.0, 1.0),
    sized(&["MiB"], DATA, 1_048_576.0, 1.0),
    sized(&["GiB"], DATA, 1_073_741_824.0, 1.0),
    scaled(&["bit"], DATA, 1.0, 8.0),
    shifted(&["degC", "°C", "℃", "celsius"], 1.0, 1.0, 273.15),
    shifted(&["degF", "°F"], 5.0, 9.0, 459.67 * 5.0 / 9.0),
];

const PREFIXES: [(&str, f64, f64); 14] = [
    ("da", 10.0, 1.0),
    ("h", 100.0, 1.0),
    ("k", 1e3, 1.0),
    ("M", 1e6, 1.0),
    ("G", 1e9, 1.0),
    ("T", 1e12, 1.0),
    ("d", 1.0, 10.0),
    ("c", 1.0, 100.0),
    ("m", 1.0, 1e3),
    ("u", 1.0, 1e6),
    ("\u{b5}", 1.0, 1e6),
    ("\u{3bc}", 1.0, 1e6),
    ("n", 1.0, 1e9),
    ("p", 1.0, 1e12),
];

/// The names of each unit, and whether it takes a prefix.
pub fn known() -> impl Iterator<Item = (&'static [&'static str], bool)> {
    ROWS.iter().map(|row| (row.names, row.prefixed))
}

/// The prefixes and their factors: a number to multiply with, and one to divide by.
#[must_use]
pub const fn prefixes() -> [(&'static str, f64, f64); 14] {
    PREFIXES
}

/// The size of a unit by its name, with or without a prefix; a whole name goes before a prefixed one (`min`).
pub(super) fn look_up(name: &str) -> Option<Size> {
    let whole = ROWS.iter().find(|row| row.names.contains(&name));
    if let Some(row) = whole {
        return Some(size(row, 1.0, 1.0));
    }
    PREFIXES.iter().find_map(|(prefix, over, under)| {
        let base = name.strip_prefix(prefix)?;
        let row = ROWS.iter().find(|row| row.prefixed && row.names.contains(&base))?;
        Some(size(row, *over, *under))
    })
}

fn size(row: &Row, over: f64, under: f64) -> Size {
    Size {
        dimension: Dimension::of(row.exponents),
        over: row.over * over,
        under: row.under * under,
        offset: row.offset,
    }
}

/// Whether this is the name of a unit, with or without a prefix.
pub(crate) fn is_unit_name(name: &str) -> bool {
    look_up(name).is_some()
}

/// Whether a unit's name may hold this character.
pub(crate) fn is_unit_char(c: char) -> bool {
    c.is_ascii_alphabetic()
        || matches!(c, '_' | '%' | '‰' | '°' | '℃' | '\u{b5}' | '\u{3bc}' | '\u{3a9}' | '\u{2126}')
}

/// Words that people write for units, and the units.
const WORDS: [(&str, &str); 16] = [
    ("meter", "m"),
    ("metre", "m"),
    ("sec", "s"),
    ("second", "s"),
    ("minute", "min"),
    ("hour", "h"),
    ("degree", "deg"),
    ("radian", "rad"),
    ("volt", "V"),
    ("amp", "A"),
    ("ampere", "A"),
    ("watt", "W"),
    ("kelvin", "K"),
    ("percent", "%"),
    ("in", "inch"),
    ("foot", "ft"),
];

/// The known unit nearest to a misspelt one, with and without the prefixes.
pub(super) fn nearest_unit(name: &str) -> Option<String> {
    let is_word = |(word, _): &&(&str, &str)| {
        let singular = name.strip_suffix(['s', 'S']).unwrap_or(name);
        word.eq_ignore_ascii_case(name) || word.eq_ignore_ascii_case(singular)
    };
    if let Some((_, unit)) = WORDS.iter().find(is_word) {
        return Some((*unit).to_owned());
    }
    let whole = ROWS.iter().flat_map(|row| row.names.iter().copied());
    let common =
        ["km", "cm", "mm", "ms", "kg", "kPa", "hPa", "mbar", "kWh", "kW", "mAh", "mV", "mA", "kHz", "mrad"];
    let near = nearest(name, whole.chain(common));
    near.map(str::to_owned).or_else(|| {
        let (prefix, base) =
            PREFIXES.iter().find_map(|(prefix, ..)| Some((prefix, name.strip_prefix(prefix)?)))?;
        let prefixed = ROWS.iter().filter(|row| row.prefixed).flat_map(|row| row.names.iter().copied());
        nearest(base, prefixed).map(|near| format!("{prefix}{near}"))
    })
}

/// The known word nearest to `word`, when few enough letters differ (a third of them, at least one) or only the case does.
///
/// The first one wins a tie. Time: the lengths of both words multiplied, per known word; a word of more than 64 characters is
/// near to no other.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = word.chars().count();
    if length > 64 {
        return None;
    }
    let allowed = (length / 3).max(1);
    let mut best: Option<(usize, &str)> = None;
    for candidate in known {
        let distance = if candidate.eq_ignore_ascii_case(word) { 0 } else { distance(word, candidate) };
        let near =
            distance <= allowed && (distance < length || candidate.chars().count() > 1 && distance < 2);
        if near && best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// Edits (insertion, deletion, replacement, swap of neighbours) from one word to the other.
///
/// Damerau (doi:10.1145/363958.363994) in the restricted form that edits no letter twice.
fn distance(from: &str, to: &str) -> usize {
    let letters: Vec<char> = to.chars().take(80).collect();
    let mut before: Vec<usize> = Vec::new();
    let mut above: Vec<usize> = (0..=letters.len()).collect();
    let mut previous = None;
    for (row, letter) in from.chars().enumerate() {
        let mut current = Vec::with_capacity(above.len());
        current.push(row + 1);
        for (column, other) in letters.iter().enumerate() {
            let at = |line: &[usize], place: usize| line.get(place).copied().unwrap_or(usize::MAX / 2);
            let replaced = at(&above, column) + usize::from(letter != *other);
            let mut least = replaced.min(at(&above, column + 1) + 1).min(at(&current, column) + 1);
            let swapped = column > 0 && previous == Some(*other) && letters.get(column - 1) == Some(&letter);
            if swapped {
                least = least.min(at(&before, column - 1) + 1);
            }
            current.push(least);
        }
        before = core::mem::replace(&mut above, current);
        previous = Some(letter);
    }
    above.last().copied().unwrap_or(0)
}

/// All names without prefixes.
#[cfg(test)]
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    ROWS.iter().flat_map(|row| row.names.iter().copied())
}
