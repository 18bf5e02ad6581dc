//! An index of elements by their names.

use super::ids::Id;
use alloc::vec::Vec;

/// Finds elements by name. The index holds no names: the caller gives the name of each element.
///
/// Sorted by a hash of the name, then the name, then the id, with a directory of the hash's first bits. A lookup takes constant
/// time for usual names, and logarithmic time at worst, so that names with equal hashes cannot slow it down. No list is in the
/// order of the hash. Twelve to sixteen bytes an element.
#[derive(Clone, Debug)]
pub(crate) struct Index<I> {
    /// The first entry of each prefix of the hash.
    starts: Vec<u32>,
    /// How far a hash is shifted right for the directory.
    shift: u32,
    entries: Vec<(u32, I)>,
}

impl<I: Id> Index<I> {
    /// The index of the ids below `count`, by their names. Time: `n log n` for `n` elements.
    pub(crate) fn new<'n>(count: usize, name: impl Fn(I) -> &'n str) -> Self {
        let mut entries: Vec<(u32, I)> =
            (0..count).map(I::from_index).map(|id| (hash(name(id)), id)).collect();
        entries.sort_unstable();
        for same in entries.chunk_by_mut(|a, b| a.0 == b.0).filter(|same| same.len() > 1) {
            same.sort_unstable_by(|a, b| name(a.1).cmp(name(b.1)).then_with(|| a.1.cmp(&b.1)));
        }
        let shift = (count.leading_zeros() + u32::BITS).saturating_sub(usize::BITS).clamp(1, u32::BITS - 1);
        let buckets = (u32::MAX >> shift) + 1;
        let mut starts = Vec::with_capacity(buckets as usize + 1);
        let mut at = 0;
        for bucket in 0..buckets {
            starts.push(at as u32);
            at += entries.iter().skip(at).take_while(|(hash, _)| hash >> shift == bucket).count();
        }
        starts.push(entries.len() as u32);
        Index { starts, shift, entries }
    }

    /// The first element of a name.
    pub(crate) fn find<'n>(&self, wanted: &str, name: impl Fn(I) -> &'n str) -> Option<I> {
        let key = hash(wanted);
        let bucket = (key >> self.shift) as usize;
        let from = *self.starts.get(bucket)? as usize;
        let to = *self.starts.get(bucket + 1)? as usize;
        let entries = self.entries.get(from..to)?;
        let before = |&(hash, id): &(u32, I)| hash < key || hash == key && name(id) < wanted;
        let &(hash, id) = entries.get(entries.partition_point(before))?;
        (hash == key && name(id) == wanted).then_some(id)
    }

    /// The elements whose name an earlier element has, each with the first element of that name.
    pub(crate) fn repeated<'n>(&self, name: impl Fn(I) -> &'n str) -> Vec<(I, I)> {
        let mut found = Vec::new();
        let mut first: Option<(u32, I)> = None;
        for &(hash, id) in &self.entries {
            match first {
                Some((before, of)) if before == hash && name(of) == name(id) => found.push((of, id)),
                _ => first = Some((hash, id)),
            }
        }
        found.sort_unstable_by_key(|&(_, id)| id);
        found
    }
}

impl<I: Id> Default for Index<I> {
    fn default() -> Self {
        Index::new(0, |_| "")
    }
}

/// The hash 1a of Fowler, Noll and Vo, mixed so that its first bits are usable for the directory.
fn hash(name: &str) -> u32 {
    let add = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    let hash = name.bytes().fold(0xcbf2_9ce4_8422_2325, add);
    ((hash ^ hash >> 29).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::knowledge::VariableId;
    use alloc::collections::BTreeMap;
    use alloc::format;
    use alloc::string::String;

    /// Compares the index with a map of names.
    #[track_caller]
    fn check(names: &[String]) {
        let name = |id: VariableId| names[id.index()].as_str();
        let index = Index::new(names.len(), name);
        let mut first = BTreeMap::new();
        let mut repeated = Vec::new();
        for (id, name) in names.iter().enumerate() {
            let known = *first.entry(name).or_insert(id);
            if known != id {
                repeated.push((known, id));
            }
        }
        for (wanted, &id) in &first {
            assert_eq!(index.find(wanted, name), Some(VariableId::from_index(id)));
        }
        let absent = names.iter().map(|name| format!("{name}'")).filter(|name| !first.contains_key(name));
        assert!(absent.into_iter().all(|absent| index.find(&absent, name).is_none()));
        let found = index.repeated(name);
        assert_eq!(found.iter().map(|(a, b)| (a.index(), b.index())).collect::<Vec<_>>(), repeated);
    }

    #[test]
    fn names_find_their_first_element() {
        for count in [0, 1, 2, 3, 7, 64, 1000, 5000] {
            check(&(0..count).map(|at| format!("v{at}")).collect::<Vec<_>>());
            check(&(0..count).map(|at| format!("v{}", at % 17)).collect::<Vec<_>>());
            check(&(0..count).map(|at| format!("v{}", at * at % 1009)).collect::<Vec<_>>());
        }
        check(&["", "a", "", "ä", "a"].map(String::from));
    }
}
