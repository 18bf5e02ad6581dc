//! The head of a page: how many values it has, and how they are stored.

use super::bytes::Bytes;
use super::thrift;

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

/// The numbers of a head by their fields: its own, and those about its kind.
#[derive(Default)]
struct Numbers {
    own: [Option<i64>; 4],
    about: [Option<i64>; 8],
}

impl Numbers {
    /// Takes a number of the structure in this field, 0 for the head itself; of two in the same field the first counts.
    fn see(&mut self, within: i64, field: i64, number: i64) {
        let kind = self.own[1];
        let list = match (within, kind) {
            (0, _) => self.own.as_mut_slice(),
            (5, Some(0)) | (7, Some(2)) | (8, Some(3)) => self.about.as_mut_slice(),
            _ => return,
        };
        let place = usize::try_from(field).ok().and_then(|field| list.get_mut(field));
        if let Some(place) = place {
            place.get_or_insert(number);
        }
    }
}

impl Head {
    /// The head at the begin of a page; `None` where the bytes are none.
    pub(super) fn read(bytes: &mut Bytes<'_>) -> Option<Head> {
        let mut numbers = Numbers::default();
        thrift::pass(bytes, &mut |within, field, number| numbers.see(within, field, number))?;
        let Numbers { own: [_, kind, unpacked, packed], about } = numbers;
        let size = |number: Option<i64>| usize::try_from(number?).ok();
        let (kind, packed) = (kind?, size(packed)?);
        let (encoding, levels) = match kind {
            0 | 2 => (about[2]?, None),
            3 => {
                let is_packed = about[7].is_none_or(|is_packed| is_packed != 0);
                (about[4]?, Some((size(about[6])?, size(about[5])?, is_packed)))
            }
            // A page of another kind has no values.
            _ => return Some(Head { kind, values: 0, encoding: 0, packed, unpacked: 0, levels: None }),
        };
        Some(Head { kind, values: size(about[1])?, encoding, packed, unpacked: size(unpacked)?, levels })
    }
}
