//! Lists of different lengths in one vector, one list for each id.

use super::ids::Id;
use alloc::vec::Vec;
use core::marker::PhantomData;

/// A list for each id, in four bytes an id and the items, without an allocation for each list.
#[derive(Clone, Debug)]
pub(crate) struct Rows<I, T> {
    starts: Vec<u32>,
    items: Vec<T>,
    kind: PhantomData<I>,
}

impl<I: Id, T: Id> Rows<I, T> {
    /// Groups pairs: the list of an id has the second of each of its pairs, in their order; `count` lists.
    ///
    /// Time and space: linear in lists and pairs; iterates twice over the pairs.
    pub(crate) fn grouped(count: usize, pairs: impl Iterator<Item = (I, T)> + Clone) -> Self {
        let mut starts = Vec::from([0]);
        starts.resize(count + 1, 0_u32);
        for (id, _) in pairs.clone() {
            if let Some(next) = starts.get_mut(id.index() + 1) {
                *next += 1;
            }
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        let mut items = Vec::new();
        items.resize(sum as usize, T::from_index(0));
        let mut free = starts.clone();
        for (id, item) in pairs {
            let Some(at) = free.get_mut(id.index()) else { continue };
            if let Some(place) = items.get_mut(*at as usize) {
                *place = item;
            }
            *at += 1;
        }
        Rows { starts, items, kind: PhantomData }
    }
}

impl<I: Id, T> Rows<I, T> {
    /// Appends the list of the next id.
    pub(crate) fn push(&mut self, items: impl Iterator<Item = T>) {
        self.items.extend(items);
        self.starts.push(self.items.len() as u32);
    }

    /// The list of an id; empty for an unknown id.
    pub(crate) fn row(&self, id: I) -> &[T] {
        self.between(self.bounds(id))
    }

    /// Where the list of an id begins and ends.
    pub(crate) fn bounds(&self, id: I) -> (u32, u32) {
        let start = self.starts.get(id.index()).copied().unwrap_or_default();
        (start, self.starts.get(id.index() + 1).copied().unwrap_or(start))
    }

    /// The list between two bounds.
    pub(crate) fn between(&self, (start, end): (u32, u32)) -> &[T] {
        self.items.get(start as usize..end as usize).unwrap_or_default()
    }

    /// The list of an id, mutable.
    pub(crate) fn row_mut(&mut self, id: I) -> &mut [T] {
        let (start, end) = self.bounds(id);
        self.items.get_mut(start as usize..end as usize).unwrap_or_default()
    }
}

impl<I, T> Default for Rows<I, T> {
    fn default() -> Self {
        Rows { starts: Vec::from([0]), items: Vec::new(), kind: PhantomData }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::knowledge::{RelationId, VariableId};
    use alloc::vec;

    #[test]
    fn pairs_are_grouped_in_their_order() {
        let pairs = [(2, 7), (0, 1), (2, 3), (9, 9)];
        let pairs = pairs.map(|(a, b)| (VariableId::from_index(a), RelationId::from_index(b)));
        let rows = Rows::grouped(3, pairs.into_iter());
        let row = |at| rows.row(VariableId::from_index(at)).iter().map(|id| id.index()).collect::<Vec<_>>();
        assert_eq!([row(0), row(1), row(2), row(3)], [vec![1], vec![], vec![7, 3], vec![]]);
    }
}
