//! The column of each node: right of the nodes that it follows from, and near its neighbours.

use super::Edge;

/// The column of each node, from 0; the ends of an edge are in different columns.
pub(super) fn ranks(count: usize, edges: &[Edge]) -> Vec<usize> {
    let graph = Acyclic::of(count, edges);
    let order = graph.order();
    let mut ranks = vec![0; count];
    for &node in &order {
        ranks[node] = graph.before[node].iter().map(|&from| ranks[from] + 1).max().unwrap_or(0);
    }
    graph.tighten(&order, &mut ranks);
    ranks
}

/// The edges, some of them reversed.
struct Acyclic {
    before: Vec<Vec<usize>>,
    after: Vec<Vec<usize>>,
}

impl Acyclic {
    /// Reverses each edge that would close a cycle with earlier edges.
    fn of(count: usize, edges: &[Edge]) -> Acyclic {
        let mut graph = Acyclic { before: vec![Vec::new(); count], after: vec![Vec::new(); count] };
        let mut seen = vec![0; count];
        for (at, edge) in edges.iter().enumerate() {
            let turned = graph.reaches(edge.to, edge.from, at + 1, &mut seen);
            let (from, to) = if turned { (edge.to, edge.from) } else { (edge.from, edge.to) };
            graph.after[from].push(to);
            graph.before[to].push(from);
        }
        graph
    }

    /// Whether there is a path; `seen` holds the number of the last search that visited each node.
    fn reaches(&self, from: usize, to: usize, search: usize, seen: &mut [usize]) -> bool {
        let mut open = vec![from];
        while let Some(node) = open.pop() {
            if node == to {
                return true;
            }
            if std::mem::replace(&mut seen[node], search) != search {
                open.extend(&self.after[node]);
            }
        }
        false
    }

    /// All nodes in topological order.
    fn order(&self) -> Vec<usize> {
        let mut missing: Vec<usize> = self.before.iter().map(Vec::len).collect();
        let mut order: Vec<usize> = (0..missing.len()).filter(|&node| missing[node] == 0).collect();
        let mut next = 0;
        while let Some(&node) = order.get(next) {
            for &after in &self.after[node] {
                missing[after] -= 1;
                if missing[after] == 0 {
                    order.push(after);
                }
            }
            next += 1;
        }
        order
    }

    /// Moves each node to the side with more neighbours, as far as its neighbours allow.
    fn tighten(&self, order: &[usize], ranks: &mut [usize]) {
        // Each move makes edges shorter, so the loop ends; the bound keeps it fast.
        for _ in 0..64 {
            let mut moved = false;
            for &node in order.iter().rev() {
                let (before, after) = (&self.before[node], &self.after[node]);
                let lowest = before.iter().map(|&from| ranks[from] + 1).max();
                let highest = after.iter().map(|&to| ranks[to] - 1).min();
                let best = match (before.len().cmp(&after.len()), lowest, highest) {
                    (std::cmp::Ordering::Less, _, Some(highest)) => highest,
                    (std::cmp::Ordering::Greater, Some(lowest), _) => lowest,
                    _ => ranks[node],
                };
                moved |= best != ranks[node];
                ranks[node] = best;
            }
            if !moved {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(count: usize, edges: &[(usize, usize)], expected: &[usize]) {
        let edges: Vec<Edge> = edges.iter().map(|&(from, to)| Edge { from, to, weight: 1.0 }).collect();
        assert_eq!(ranks(count, &edges), expected);
    }

    #[test]
    fn nodes_follow_what_they_rest_on() {
        check(3, &[(0, 1), (1, 2)], &[0, 1, 2]);
        check(3, &[(2, 1), (1, 0)], &[2, 1, 0]);
    }

    #[test]
    fn an_edge_that_closes_a_cycle_is_turned() {
        check(3, &[(0, 1), (1, 2), (2, 0)], &[0, 1, 2]);
    }

    #[test]
    fn a_late_source_stands_near_its_only_user() {
        check(5, &[(0, 1), (1, 2), (2, 3), (4, 3)], &[0, 1, 2, 3, 2]);
    }
}
