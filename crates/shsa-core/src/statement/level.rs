//! Integrity levels: ordered scales, each of its own. Nothing converts one into another.

use alloc::borrow::ToOwned;
use alloc::string::String;
use alloc::vec::Vec;

/// A scale of levels, numbered in the order of addition.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ScaleId(u32);

/// The scales of the standards: name, and levels, the lowest first.
///
/// ISO 26262 (ASIL; QM is ordinary quality), IEC 61508 (SIL), ISO 13849-1 (PL), DO-178C (DAL), ISO 25119 (AgPL).
pub const STANDARD_SCALES: [(&str, &[&str]); 5] = [
    ("asil", &["QM", "A", "B", "C", "D"]),
    ("sil", &["1", "2", "3", "4"]),
    ("pl", &["a", "b", "c", "d", "e"]),
    ("dal", &["E", "D", "C", "B", "A"]),
    ("agpl", &["a", "b", "c", "d", "e"]),
];

/// An integrity level: a place on one scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Level {
    /// The level's scale.
    pub scale: ScaleId,
    /// The number of lower levels on the scale.
    pub rank: u32,
}

impl Level {
    /// Whether the level is on the same scale and at least as high.
    #[must_use]
    pub fn reaches(self, demanded: Level) -> bool {
        self.scale == demanded.scale && self.rank >= demanded.rank
    }
}

/// A scale: its name and its levels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Scale {
    /// The scale's name in files.
    pub name: String,
    /// The levels, the lowest first.
    pub levels: Vec<String>,
}

/// All scales that certificates may use.
#[derive(Clone, Debug, PartialEq)]
pub struct Scales {
    rows: Vec<Scale>,
}

impl Scales {
    /// No scales.
    #[must_use]
    pub const fn new() -> Scales {
        Scales { rows: Vec::new() }
    }

    /// The scales of [`STANDARD_SCALES`].
    #[must_use]
    pub fn standard() -> Scales {
        let mut scales = Scales::new();
        for (name, levels) in STANDARD_SCALES {
            scales.add(name, levels.iter().map(|&level| level.to_owned()).collect());
        }
        scales
    }

    /// Adds a scale, its lowest level first.
    pub fn add(&mut self, name: &str, levels: Vec<String>) -> ScaleId {
        let id = ScaleId(u32::try_from(self.rows.len()).unwrap_or(u32::MAX));
        self.rows.push(Scale { name: name.to_owned(), levels });
        id
    }

    /// The scale of an id that may belong to other scales.
    #[must_use]
    pub fn get(&self, scale: ScaleId) -> Option<&Scale> {
        self.rows.get(scale.0 as usize)
    }

    /// The scale of a name, without regard to case.
    #[must_use]
    pub fn named(&self, name: &str) -> Option<ScaleId> {
        self.iter().find(|(_, scale)| scale.name.eq_ignore_ascii_case(name)).map(|(id, _)| id)
    }

    /// A level by the names of its scale and its own.
    #[must_use]
    pub fn level(&self, scale: &str, level: &str) -> Option<Level> {
        let scale = self.named(scale)?;
        let rank = self.get(scale)?.levels.iter().position(|known| known == level)?;
        Some(Level { scale, rank: u32::try_from(rank).ok()? })
    }

    /// The name of a level, without its scale's; empty for a level of other scales.
    #[must_use]
    pub fn level_name(&self, level: Level) -> &str {
        let scale = self.get(level.scale);
        scale.and_then(|scale| scale.levels.get(level.rank as usize)).map_or("", String::as_str)
    }

    /// The rank of a level, if it is on the scale of this name.
    #[must_use]
    pub fn rank_on(&self, scale: &str, level: Level) -> Option<u32> {
        self.get(level.scale).filter(|own| own.name == scale).map(|_| level.rank)
    }

    /// A level with its scale, as models write it: `SIL 2`; empty for a level of other scales.
    #[must_use]
    pub fn written(&self, level: Level) -> String {
        let Some(scale) = self.get(level.scale) else { return String::new() };
        let name = if scale.name == "agpl" { String::from("AgPL") } else { scale.name.to_uppercase() };
        [&name, " ", self.level_name(level)].concat()
    }

    /// All scales, in order.
    pub fn iter(&self) -> impl Iterator<Item = (ScaleId, &Scale)> {
        (0..).map(ScaleId).zip(&self.rows)
    }
}

impl Default for Scales {
    fn default() -> Self {
        Scales::standard()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(given: (&str, &str), demanded: (&str, &str), expected: bool) {
        let scales = Scales::standard();
        let level = |(scale, level)| scales.level(scale, level).unwrap();
        assert_eq!(level(given).reaches(level(demanded)), expected);
    }

    #[test]
    fn levels_are_written_with_their_scale() {
        let scales = Scales::standard();
        for text in ["SIL 2", "ASIL QM", "PL d", "AgPL c", "DAL A"] {
            let (scale, level) = text.split_once(' ').unwrap();
            assert_eq!(scales.written(scales.level(scale, level).unwrap()), text);
        }
    }

    #[test]
    fn higher_levels_of_the_same_scale_reach() {
        check(("asil", "B"), ("asil", "A"), true);
        check(("asil", "QM"), ("asil", "A"), false);
        check(("dal", "A"), ("dal", "B"), true);
        check(("dal", "D"), ("dal", "C"), false);
        check(("pl", "e"), ("agpl", "a"), false);
        check(("sil", "4"), ("asil", "QM"), false);
    }
}
