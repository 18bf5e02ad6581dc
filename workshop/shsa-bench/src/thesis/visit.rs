//! A plain breadth-first visit of the nodes that a search can reach: the cost of looking at each node once.
//!
//! The marks and the queue are kept between visits, like those of the compared searches: initialising a mark for each node of the
//! graph would cost more than visiting the reachable ones.

use shsa_core::knowledge::{Id, KnowledgeBase, VariableId};

/// The links of a graph as flat lists, and the marks of one visit.
pub(super) struct Visit {
    provided: Vec<bool>,
    /// Where the links of each variable, then of each relation, begin.
    starts: Vec<u32>,
    links: Vec<u32>,
    seen: Vec<u32>,
    round: u32,
    queue: Vec<u32>,
}

impl Visit {
    /// Flattens a knowledge base: variables come before relations, a variable is linked to the relations that can
    /// produce it, and a relation to what it reads.
    pub(super) fn new(knowledge: &KnowledgeBase) -> Visit {
        let variables = knowledge.variables().len();
        let (mut starts, mut links) = (vec![0], Vec::new());
        for variable in knowledge.variables().ids() {
            links.extend(knowledge.producers(variable).iter().map(|r| (variables + r.index()) as u32));
            starts.push(links.len() as u32);
        }
        for relation in knowledge.relations() {
            links.extend(relation.inputs.iter().map(|input| input.index() as u32));
            starts.push(links.len() as u32);
        }
        Visit {
            provided: knowledge.variables().ids().map(|v| knowledge.is_provided(v)).collect(),
            seen: vec![0; starts.len()],
            starts,
            links,
            round: 0,
            queue: Vec::new(),
        }
    }

    /// The number of nodes that can be reached from `root` without passing a provided variable; a provided root is passed.
    pub(super) fn run(&mut self, root: VariableId) -> usize {
        self.round += 1;
        self.queue.clear();
        let root = root.index();
        self.reach(root as u32);
        let mut next = 0;
        while let Some(&node) = self.queue.get(next) {
            next += 1;
            let node = node as usize;
            if node != root && self.provided.get(node) == Some(&true) {
                continue;
            }
            let (Some(&start), Some(&end)) = (self.starts.get(node), self.starts.get(node + 1)) else {
                continue;
            };
            for at in start as usize..end as usize {
                if let Some(&link) = self.links.get(at) {
                    self.reach(link);
                }
            }
        }
        next
    }

    #[inline]
    fn reach(&mut self, node: u32) {
        let Some(seen) = self.seen.get_mut(node as usize) else { return };
        if *seen != self.round {
            *seen = self.round;
            self.queue.push(node);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::generate::{Branching, Tree};
    use super::*;

    #[test]
    fn everything_above_provided_variables_is_visited_once() {
        let tree = Tree {
            branch: 2,
            depth: 6,
            branching: Branching::Complete,
            availability: None,
            costs: false,
            both_ways: true,
        };
        let reached = |tree: Tree, root| Visit::new(&tree.generate(3)).run(VariableId::from_index(root));
        assert_eq!(reached(tree, 0), 127);
        // The root is not provided, and two relations lead to four variables that are.
        assert_eq!(reached(Tree { availability: Some(1.0), ..tree }, 0), 7);
    }
}
