//! A queue that gives the room of a backlog back while it is worked off.
//!
//! The room of a `VecDeque` stays as large as it ever was, and grows by doubling: behind each block that was outgrown a hole is
//! left. After a stall, the queues of all topics together would keep many times the memory that they need from then on.

use std::collections::VecDeque;

/// The number of items that a chunk has room for.
const CHUNK: usize = 32;

/// First in, first out, in chunks. While no more than a chunk waits, nothing is allocated; beyond, one chunk for each 32 items.
/// A chunk whose items were taken is given back, and so is the last one of a backlog: it was allocated when most waited, and would
/// keep the top of the heap from being given back to the system. All operations are O(1).
#[derive(Clone, Debug)]
pub(crate) struct Backlog<T> {
    /// The oldest items.
    first: VecDeque<T>,
    /// The following ones; all of these chunks are full but the last one.
    more: VecDeque<VecDeque<T>>,
    /// Whether more than a chunk has waited since the queue was empty.
    is_outgrown: bool,
}

impl<T> Backlog<T> {
    pub(crate) const fn new() -> Backlog<T> {
        Backlog { first: VecDeque::new(), more: VecDeque::new(), is_outgrown: false }
    }

    pub(crate) fn len(&self) -> usize {
        let full = self.more.len().saturating_sub(1) * CHUNK;
        self.first.len() + full + self.more.back().map_or(0, VecDeque::len)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.first.is_empty()
    }

    /// The oldest item.
    pub(crate) fn front(&self) -> Option<&T> {
        self.first.front()
    }

    pub(crate) fn push_back(&mut self, item: T) {
        let last = self.more.back_mut().unwrap_or(&mut self.first);
        if last.len() < CHUNK {
            return last.push_back(item);
        }
        let mut chunk = VecDeque::with_capacity(CHUNK);
        chunk.push_back(item);
        self.more.push_back(chunk);
        self.is_outgrown = true;
    }

    /// Takes the oldest item.
    pub(crate) fn pop_front(&mut self) -> Option<T> {
        let item = self.first.pop_front()?;
        if self.first.is_empty() {
            match self.more.pop_front() {
                Some(next) => self.first = next,
                None if self.is_outgrown => *self = Backlog::new(),
                None => {}
            }
        }
        Some(item)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A `VecDeque` is the oracle.
        #[test]
        fn it_is_a_queue(steps in prop::collection::vec((any::<bool>(), 0..3 * CHUNK), 0..50)) {
            let (mut backlog, mut queue, mut count) = (Backlog::new(), VecDeque::new(), 0);
            for (grows, by) in steps {
                for _ in 0..by {
                    if grows {
                        count += 1;
                        backlog.push_back(count);
                        queue.push_back(count);
                    } else {
                        prop_assert_eq!(backlog.pop_front(), queue.pop_front());
                    }
                    let seen = (backlog.len(), backlog.is_empty(), backlog.front());
                    prop_assert_eq!(seen, (queue.len(), queue.is_empty(), queue.front()));
                }
            }
        }
    }
}
