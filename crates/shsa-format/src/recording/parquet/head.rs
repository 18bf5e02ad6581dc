//! The head of a page: how many values it has, and how they are stored.

use super::thrift::Struct;

/// The head of a page.
pub(super) struct Head {
    pub(super) kind: i64,
    pub(super) values: usize,
    pub(super) encoding: i64,
    pub(super) packed: usize,
    pub(super) unpacked: usize,
    /// For pages of the second version: the lengths of the repetition and definition levels, which are not compressed, and
    /// whether the values are compressed.
    pub(super) levels: Option<(usize, usize, bool)>,
}

impl Head {
    /// From the structure at the begin of a page; `None` where it is none of a page.
    pub(super) fn of(page: &Struct<'_>) -> Option<Head> {
        let size = |whole: Option<i64>| usize::try_from(whole?).ok();
        let kind = page.whole(1)?;
        let (about, encoding) = match kind {
            0 => (page.structure(5)?, 2),
            2 => (page.structure(7)?, 2),
            3 => (page.structure(8)?, 4),
            // A page of another kind has no values.
            _ => {
                return Some(Head {
                    kind,
                    values: 0,
                    encoding: 0,
                    packed: size(page.whole(3))?,
                    unpacked: 0,
                    levels: None,
                });
            }
        };
        let levels = match kind {
            3 => Some((size(about.whole(6))?, size(about.whole(5))?, about.bool(7).unwrap_or(true))),
            _ => None,
        };
        Some(Head {
            kind,
            values: size(about.whole(1))?,
            encoding: about.whole(encoding)?,
            packed: size(page.whole(3))?,
            unpacked: size(page.whole(2))?,
            levels,
        })
    }
}
