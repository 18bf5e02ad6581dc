//! The order within each column, with few crossings of edges.

use super::Edge;
use std::collections::BTreeMap;

/// The number of sweeps over all columns; more rarely help.
const SWEEPS: usize = 24;
/// With more nodes and bends than this, neighbours are not swapped one by one, which would take long.
const MOST_SWAPPED: usize = 4_000;

/// The columns of a connected part: its nodes, then its bends, by number.
pub(super) struct Columns {
    /// From left to right, each from top to bottom.
    pub(super) columns: Vec<Vec<usize>>,
    /// The position of each node in its column.
    position: Vec<usize>,
    /// Neighbours in the column to the left.
    pub(super) left: Vec<Vec<usize>>,
    /// Neighbours in the column to the right.
    pub(super) right: Vec<Vec<usize>>,
    /// The bends of each edge, from left to right.
    pub(super) chains: Vec<Vec<usize>>,
}

impl Columns {
    /// Columns in the order of a walk along the edges, so that connected nodes begin near each other.
    pub(super) fn new(nodes: &[usize], edges: &[(usize, &Edge)], ranks: &[usize]) -> Columns {
        let number: BTreeMap<usize, usize> = nodes.iter().enumerate().map(|(at, &node)| (node, at)).collect();
        let first = nodes.iter().map(|&node| ranks[node]).min().unwrap_or(0);
        let mut rank: Vec<usize> = nodes.iter().map(|&node| ranks[node] - first).collect();
        let mut chains = Vec::new();
        let mut joined = Vec::new();
        for (_, edge) in edges {
            let (from, to) = (number[&edge.from], number[&edge.to]);
            let (from, to) = if rank[from] < rank[to] { (from, to) } else { (to, from) };
            let chain: Vec<usize> =
                (rank[from] + 1..rank[to]).zip(rank.len()..).map(|(_, bend)| bend).collect();
            rank.extend(rank[from] + 1..rank[to]);
            let ends: Vec<usize> = [from].into_iter().chain(chain.iter().copied()).chain([to]).collect();
            joined.extend(ends.windows(2).map(|pair| (pair[0], pair[1])));
            chains.push(chain);
        }
        let mut columns = Columns {
            columns: vec![Vec::new(); rank.iter().max().map_or(0, |last| last + 1)],
            position: vec![0; rank.len()],
            left: vec![Vec::new(); rank.len()],
            right: vec![Vec::new(); rank.len()],
            chains,
        };
        for (from, to) in joined {
            columns.right[from].push(to);
            columns.left[to].push(from);
        }
        for node in columns.walk() {
            columns.columns[rank[node]].push(node);
        }
        columns.renumber();
        columns
    }

    /// All nodes and bends in the order of a depth-first walk.
    fn walk(&self) -> Vec<usize> {
        let count = self.left.len();
        let (mut seen, mut order) = (vec![false; count], Vec::new());
        for first in 0..count {
            let mut open = vec![first];
            while let Some(node) = open.pop() {
                if !std::mem::replace(&mut seen[node], true) {
                    order.push(node);
                    open.extend(self.right[node].iter().chain(&self.left[node]).rev());
                }
            }
        }
        order
    }

    fn renumber(&mut self) {
        for column in &self.columns {
            for (at, &node) in column.iter().enumerate() {
                self.position[node] = at;
            }
        }
    }

    /// Orders the columns by the mean positions of neighbours in both directions, and keeps the best order.
    pub(super) fn untangle(&mut self) {
        let small = self.left.len() <= MOST_SWAPPED;
        let mut best = (self.crossings(), self.columns.clone());
        let mut idle = 0;
        for sweep in 0..SWEEPS {
            self.sweep(sweep % 2 == 0);
            if small {
                self.swap_neighbours();
            }
            let crossings = self.crossings();
            idle = if crossings < best.0 { 0 } else { idle + 1 };
            if crossings < best.0 {
                best = (crossings, self.columns.clone());
            }
            if best.0 == 0 || idle == 6 {
                break;
            }
        }
        self.columns = best.1;
        self.renumber();
    }

    fn sweep(&mut self, rightwards: bool) {
        let count = self.columns.len();
        for step in 1..count {
            let at = if rightwards { step } else { count - 1 - step };
            let mut keyed: Vec<(f64, usize)> =
                self.columns[at].iter().map(|&node| (self.mean(node, rightwards), node)).collect();
            keyed.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (place, (_, node)) in keyed.into_iter().enumerate() {
                self.columns[at][place] = node;
                self.position[node] = place;
            }
        }
    }

    /// The mean place of a node's neighbours on one side; for a node without neighbours there, its own place.
    fn mean(&self, node: usize, of_left: bool) -> f64 {
        let neighbours = if of_left { &self.left[node] } else { &self.right[node] };
        match neighbours.len() {
            0 => self.position[node] as f64,
            count => neighbours.iter().map(|&near| self.position[near] as f64).sum::<f64>() / count as f64,
        }
    }

    /// Swaps vertical neighbours as long as this removes crossings.
    fn swap_neighbours(&mut self) {
        for _ in 0..8 {
            let mut swapped = false;
            for column in 0..self.columns.len() {
                for upper in 1..self.columns[column].len() {
                    let (a, b) = (self.columns[column][upper - 1], self.columns[column][upper]);
                    if self.pair_crossings(b, a) < self.pair_crossings(a, b) {
                        self.columns[column].swap(upper - 1, upper);
                        (self.position[a], self.position[b]) = (upper, upper - 1);
                        swapped = true;
                    }
                }
            }
            if !swapped {
                return;
            }
        }
    }

    /// The number of crossings between the edges of two nodes of a column when `upper` is above `lower`.
    fn pair_crossings(&self, upper: usize, lower: usize) -> usize {
        let crossed = |of: &[Vec<usize>]| -> usize {
            let mut below: Vec<usize> = of[lower].iter().map(|&near| self.position[near]).collect();
            below.sort_unstable();
            let over = |&near: &usize| below.partition_point(|&place| place < self.position[near]);
            of[upper].iter().map(over).sum()
        };
        crossed(&self.left) + crossed(&self.right)
    }

    /// All crossings between neighbouring columns, counted with a Fenwick tree in O(e log n).
    fn crossings(&self) -> usize {
        let between = |pair: &[Vec<usize>]| {
            let mut places: Vec<(usize, usize)> = Vec::new();
            for &node in &pair[0] {
                places.extend(self.right[node].iter().map(|&to| (self.position[node], self.position[to])));
            }
            places.sort_unstable();
            inversions(places.into_iter().map(|(_, right)| right), pair[1].len())
        };
        self.columns.windows(2).map(between).sum()
    }
}

/// How many pairs of values below `count` stand in descending order.
fn inversions(values: impl Iterator<Item = usize>, count: usize) -> usize {
    let mut tree = vec![0; count + 1];
    let (mut inversions, mut seen) = (0, 0);
    for value in values {
        // The number of earlier values that are not larger.
        let (mut at, mut smaller) = (value + 1, 0);
        while at > 0 {
            smaller += tree[at];
            at &= at - 1;
        }
        inversions += seen - smaller;
        seen += 1;
        let mut at = value + 1;
        while at <= count {
            tree[at] += 1;
            at += at & at.wrapping_neg();
        }
    }
    inversions
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn inversions_are_those_of_all_pairs(values in prop::collection::vec(0_usize..12, 0..40)) {
            let pairs = (0..values.len()).flat_map(|a| (a + 1..values.len()).map(move |b| (a, b)));
            let slow = pairs.filter(|&(a, b)| values[a] > values[b]).count();
            prop_assert_eq!(inversions(values.iter().copied(), 12), slow);
        }

        #[test]
        fn untangling_never_tangles(edges in prop::collection::vec((0_usize..8, 8_usize..16), 1..30)) {
            let edges: Vec<Edge> = edges.into_iter().map(|(from, to)| Edge { from, to, weight: 1.0 }).collect();
            let nodes: Vec<usize> = (0..16).collect();
            let ranks: Vec<usize> = nodes.iter().map(|node| node / 8).collect();
            let edges: Vec<(usize, &Edge)> = edges.iter().enumerate().collect();
            let mut columns = Columns::new(&nodes, &edges, &ranks);
            let before = columns.crossings();
            columns.untangle();
            prop_assert!(columns.crossings() <= before);
            let mut all: Vec<usize> = columns.columns.concat();
            all.sort_unstable();
            prop_assert_eq!(all, nodes);
        }
    }

    #[test]
    fn a_tangled_pair_is_untangled() {
        let edges = [(0, 3), (1, 2)].map(|(from, to)| Edge { from, to, weight: 1.0 });
        let edges: Vec<(usize, &Edge)> = edges.iter().enumerate().collect();
        let mut columns = Columns::new(&[0, 1, 2, 3], &edges, &[0, 0, 1, 1]);
        columns.untangle();
        assert_eq!(columns.crossings(), 0);
    }
}
