//! A layered layout: nodes in columns, from known values on the left to derived ones on the right.
//!
//! The four steps of Sugiyama, Tagawa, Toda, "Methods for Visual Understanding of Hierarchical System Structures", 1981
//! (doi:10.1109/TSMC.1981.4308636): edges are reversed until there is no cycle, nodes are assigned to columns, columns are
//! ordered for few crossings, nodes are placed. Connected parts are laid out separately and packed in rows.

mod rank;
mod order;
mod place;

use order::Columns;

/// The room between connected parts.
const APART: f64 = 36.0;
/// The largest width of a row of parts, unless one part alone is wider.
const ROW: f64 = 1100.0;
/// The most bends of a layout: with more, a drawing is unreadable and takes long.
const MOST_BENDS: usize = 20_000;

/// The room of a node around its centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Size {
    /// The width, half of it on each side.
    pub(super) width: f64,
    /// The extent above the centre.
    pub(super) above: f64,
    /// The extent below the centre.
    pub(super) below: f64,
}

/// An edge between two different nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    /// The left node, unless the edge would close a cycle with earlier edges.
    pub(super) from: usize,
    /// The node on the right.
    pub(super) to: usize,
    /// The weight of keeping the edge straight.
    pub(super) weight: f64,
}

/// The places of all nodes and edges.
#[derive(Debug, Default)]
pub(super) struct Layout {
    /// The centre of each node.
    pub(super) centres: Vec<(f64, f64)>,
    /// The route of each edge.
    pub(super) routes: Vec<Route>,
    /// Width and height of the whole.
    pub(super) size: (f64, f64),
}

/// The route of an edge from its left node to its right one.
#[derive(Clone, Debug, Default)]
pub(super) struct Route {
    /// The node at its left end.
    pub(super) left: usize,
    /// The node at its right end.
    pub(super) right: usize,
    /// The x at which it leaves the column of its left node.
    pub(super) exit_x: f64,
    /// The columns that it passes.
    pub(super) bends: Vec<Bend>,
    /// The x at which it enters the column of its right node.
    pub(super) entry_x: f64,
}

/// A column that an edge passes at one height.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bend {
    pub(super) left_x: f64,
    pub(super) right_x: f64,
    pub(super) y: f64,
}

/// The edges pass more columns than a drawing can show: the number of bends, and the most that are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TooManyBends(pub(super) usize, pub(super) usize);

/// Lays out nodes of given sizes.
///
/// Time: for n nodes and e edges O(e (n + e)) to find cycles, then O(b log b) for b nodes and bends, a bounded
/// number of times.
pub(super) fn layout(sizes: &[Size], edges: &[Edge]) -> Result<Layout, TooManyBends> {
    let ranks = rank::ranks(sizes.len(), edges);
    let spans = edges.iter().map(|edge| ranks[edge.from].abs_diff(ranks[edge.to]));
    let bends = spans.map(|span| span.saturating_sub(1)).sum();
    if bends > MOST_BENDS {
        return Err(TooManyBends(bends, MOST_BENDS));
    }
    let mut layout = Layout {
        centres: vec![(0.0, 0.0); sizes.len()],
        routes: vec![Route::default(); edges.len()],
        size: (0.0, 0.0),
    };
    let parts = parts(sizes.len(), edges);
    let drawn: Vec<Part> = parts.into_iter().map(|nodes| Part::of(nodes, sizes, edges, &ranks)).collect();
    pack(drawn, &mut layout);
    Ok(layout)
}

/// The nodes of each connected part, ascending; larger parts first.
fn parts(count: usize, edges: &[Edge]) -> Vec<Vec<usize>> {
    let mut neighbours = vec![Vec::new(); count];
    for edge in edges {
        neighbours[edge.from].push(edge.to);
        neighbours[edge.to].push(edge.from);
    }
    let mut seen = vec![false; count];
    let mut parts = Vec::new();
    for first in 0..count {
        let (mut part, mut open) = (Vec::new(), vec![first]);
        while let Some(node) = open.pop() {
            if !std::mem::replace(&mut seen[node], true) {
                part.push(node);
                open.extend(&neighbours[node]);
            }
        }
        part.sort_unstable();
        if !part.is_empty() {
            parts.push(part);
        }
    }
    parts.sort_by_key(|part| std::cmp::Reverse(part.len()));
    parts
}

/// A connected part, placed from (0, 0) on.
struct Part {
    centres: Vec<(usize, (f64, f64))>,
    routes: Vec<(usize, Route)>,
    size: (f64, f64),
}

impl Part {
    fn of(nodes: Vec<usize>, sizes: &[Size], edges: &[Edge], ranks: &[usize]) -> Part {
        let is_here = |edge: &Edge| nodes.binary_search(&edge.from).is_ok();
        let edges: Vec<(usize, &Edge)> = edges.iter().enumerate().filter(|(_, edge)| is_here(edge)).collect();
        let mut columns = Columns::new(&nodes, &edges, ranks);
        columns.untangle();
        place::place(&columns, &nodes, &edges, sizes)
    }
}

/// Packs parts into rows, in their order.
fn pack(parts: Vec<Part>, layout: &mut Layout) {
    let widest = parts.iter().map(|part| part.size.0).fold(ROW, f64::max);
    let (mut x, mut y, mut height) = (0.0, 0.0, 0.0_f64);
    for part in parts {
        if x > 0.0 && x + part.size.0 > widest {
            (x, y, height) = (0.0, y + height + APART, 0.0);
        }
        for (node, (part_x, part_y)) in part.centres {
            layout.centres[node] = (x + part_x, y + part_y);
        }
        for (edge, mut route) in part.routes {
            route.exit_x += x;
            route.entry_x += x;
            for bend in &mut route.bends {
                *bend = Bend { left_x: bend.left_x + x, right_x: bend.right_x + x, y: bend.y + y };
            }
            layout.routes[edge] = route;
        }
        layout.size = (layout.size.0.max(x + part.size.0), layout.size.1.max(y + part.size.1));
        height = height.max(part.size.1);
        x += part.size.0 + APART;
    }
}

#[cfg(test)]
mod tests;
