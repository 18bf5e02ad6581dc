//! The coordinates: nodes as near to the heights of their neighbours as their order and sizes allow.

use super::order::Columns;
use super::{Bend, Edge, Part, Route, Size};

/// The least room between two nodes of a column.
const NODES_APART: f64 = 20.0;
/// The least room between an edge and its vertical neighbours.
const EDGES_APART: f64 = 11.0;
/// The room between columns, which grows with the number of edges that turn there.
const COLUMNS_APART: f64 = 52.0;
const MOST_APART: f64 = 130.0;
const APART_EACH_EDGE: f64 = 2.5;
/// A bend of an edge pulls more strongly than a node, so that long edges become straight.
const STRAIGHT: f64 = 24.0;
/// The number of passes in both directions over all columns.
const ROUNDS: usize = 30;

/// Nodes with their places, from (0, 0) on.
pub(super) fn place(columns: &Columns, nodes: &[usize], edges: &[(usize, &Edge)], sizes: &[Size]) -> Part {
    let heights = Heights::new(columns, nodes, edges, sizes).settled();
    let bands = bands(columns, nodes, sizes);
    let top = top(&heights, nodes, sizes);
    let y = |at: usize| heights.y[at] - top;
    let mut column_of = vec![0; heights.y.len()];
    for (number, column) in columns.columns.iter().enumerate() {
        column.iter().for_each(|&at| column_of[at] = number);
    }
    let middle = |at: usize| (bands[column_of[at]].0 + bands[column_of[at]].1) / 2.0;
    let centres: Vec<(usize, (f64, f64))> =
        nodes.iter().enumerate().map(|(at, &node)| (node, (middle(at), y(at)))).collect();
    let number = |node: usize| nodes.binary_search(&node).unwrap_or_default();
    let route = |(&(edge, ends), chain): (&(usize, &Edge), &Vec<usize>)| {
        let turned = column_of[number(ends.from)] > column_of[number(ends.to)];
        let (left, right) = if turned { (ends.to, ends.from) } else { (ends.from, ends.to) };
        let bend = |&at: &usize| {
            let (left_x, right_x) = bands[column_of[at]];
            Bend { left_x, right_x, y: y(at) }
        };
        let (exit_x, entry_x) = (bands[column_of[number(left)]].1, bands[column_of[number(right)]].0);
        (edge, Route { left, right, exit_x, bends: chain.iter().map(bend).collect(), entry_x })
    };
    let routes = edges.iter().zip(&columns.chains).map(route).collect();
    let bottom = (0..heights.y.len()).map(|at| y(at) + heights.sizes[at].below).fold(0.0, f64::max);
    Part { centres, routes, size: (bands.last().map_or(0.0, |band| band.1), bottom) }
}

/// The left and the right end of each column.
fn bands(columns: &Columns, nodes: &[usize], sizes: &[Size]) -> Vec<(f64, f64)> {
    let mut bands = Vec::new();
    let mut x = 0.0;
    for column in &columns.columns {
        let widths = column.iter().filter_map(|&at| nodes.get(at)).map(|&node| sizes[node].width);
        let width = widths.fold(0.0, f64::max);
        bands.push((x, x + width));
        let turning = column.iter().map(|&at| columns.right[at].len()).sum::<usize>() as f64;
        x += width + (COLUMNS_APART + turning * APART_EACH_EDGE).min(MOST_APART);
    }
    bands
}

fn top(heights: &Heights<'_>, nodes: &[usize], sizes: &[Size]) -> f64 {
    let tops = nodes.iter().enumerate().map(|(at, &node)| heights.y[at] - sizes[node].above);
    let bends = heights.y.get(nodes.len()..).unwrap_or_default().iter().copied();
    tops.chain(bends).fold(f64::MAX, f64::min)
}

/// The heights of nodes and bends during the placement.
struct Heights<'a> {
    columns: &'a Columns,
    sizes: Vec<Size>,
    /// The neighbours that pull each node, with their strengths.
    left: Vec<Vec<(usize, f64)>>,
    right: Vec<Vec<(usize, f64)>>,
    y: Vec<f64>,
    /// The number of nodes; bends follow.
    nodes: usize,
}

impl<'a> Heights<'a> {
    fn new(columns: &'a Columns, nodes: &[usize], edges: &[(usize, &Edge)], sizes: &[Size]) -> Heights<'a> {
        let count = columns.left.len();
        let bend = Size { width: 0.0, above: 0.0, below: 0.0 };
        let of = |at: usize| nodes.get(at).map_or(bend, |&node| sizes[node]);
        let mut heights = Heights {
            columns,
            sizes: (0..count).map(of).collect(),
            left: vec![Vec::new(); count],
            right: vec![Vec::new(); count],
            y: vec![0.0; count],
            nodes: nodes.len(),
        };
        let number = |node: usize| nodes.binary_search(&node).unwrap_or_default();
        for ((_, edge), chain) in edges.iter().zip(&columns.chains) {
            let (from, to) = (number(edge.from), number(edge.to));
            let begins = columns.right[from].iter().any(|next| chain.first().unwrap_or(&to) == next);
            let (from, to) = if begins { (from, to) } else { (to, from) };
            let ends: Vec<usize> = [from].into_iter().chain(chain.iter().copied()).chain([to]).collect();
            for pair in ends.windows(2) {
                let bends = pair.iter().filter(|at| **at >= nodes.len()).count() as f64;
                let pull = edge.weight * (1.0 + bends * STRAIGHT);
                heights.right[pair[0]].push((pair[1], pull));
                heights.left[pair[1]].push((pair[0], pull));
            }
        }
        heights
    }

    /// The least distance between the centres of two vertical neighbours.
    fn apart(&self, upper: usize, lower: usize) -> f64 {
        let both_nodes = upper < self.nodes && lower < self.nodes;
        let gap = if both_nodes { NODES_APART } else { EDGES_APART };
        self.sizes[upper].below + gap + self.sizes[lower].above
    }

    fn settled(mut self) -> Heights<'a> {
        for column in &self.columns.columns {
            let mut y = 0.0;
            for (at, &node) in column.iter().enumerate() {
                y += if at == 0 { 0.0 } else { self.apart(column[at - 1], node) };
                self.y[node] = y;
            }
        }
        let last = self.columns.columns.len();
        for round in 0..ROUNDS {
            // The first half pulls from one side, which gives a shape; the second half from both, which evens it out.
            let both = round >= ROUNDS / 2;
            for column in 0..last {
                self.settle(column, true, both);
            }
            for column in (0..last).rev() {
                self.settle(column, both, true);
            }
        }
        self.straighten();
        self
    }

    /// Gives the bends of each edge one height as far as their vertical neighbours leave room: an edge with few steps is easier
    /// to follow than one with many small steps.
    fn straighten(&mut self) {
        let rooms = Neighbours::of(self.columns, self.y.len());
        for chain in &self.columns.chains {
            let mut rest = chain.as_slice();
            while !rest.is_empty() {
                let (count, lowest, highest) = self.run(rest, &rooms);
                let (run, after) = rest.split_at(count);
                let mean = run.iter().map(|&bend| self.y[bend]).sum::<f64>() / count as f64;
                let ends = [self.left[run[0]].first(), self.right[run[count - 1]].first()];
                let mut near = ends.into_iter().flatten().map(|&(end, _)| self.y[end]);
                // At the height of its neighbour the edge needs no step.
                let level = near.find(|y| (lowest..=highest).contains(y)).unwrap_or(mean);
                run.iter().for_each(|&bend| self.y[bend] = level.clamp(lowest, highest));
                rest = after;
            }
        }
    }

    /// The number of the first bends that have room at one height, at least 1, and the range of that height.
    fn run(&self, bends: &[usize], rooms: &Neighbours) -> (usize, f64, f64) {
        let (mut count, mut lowest, mut highest) = (0, f64::MIN, f64::MAX);
        for &bend in bends {
            let above = rooms.above[bend].map_or(f64::MIN, |above| self.y[above] + self.apart(above, bend));
            let below = rooms.below[bend].map_or(f64::MAX, |below| self.y[below] - self.apart(bend, below));
            // A bend without room keeps its height: heights are rounded.
            let (above, below) = (above.min(self.y[bend]), below.max(self.y[bend]));
            if count > 0 && above.max(lowest) > below.min(highest) {
                break;
            }
            (count, lowest, highest) = (count + 1, lowest.max(above), highest.min(below));
        }
        (count, lowest, highest)
    }

    /// Moves the members of a column as near as possible to the heights to which they are pulled, in the sense of least squares,
    /// and keeps their order and distances: isotonic regression by pooling adjacent violators.
    fn settle(&mut self, column: usize, of_left: bool, of_right: bool) {
        let Some(column) = self.columns.columns.get(column) else { return };
        let mut pools: Vec<Pool> = Vec::new();
        let (mut offset, mut offsets) = (0.0, Vec::new());
        for (at, &node) in column.iter().enumerate() {
            offset += if at == 0 { 0.0 } else { self.apart(column[at - 1], node) };
            offsets.push(offset);
            let (wanted, weight) = self.wanted(node, of_left, of_right);
            let mut pool = Pool { sum: (wanted - offset) * weight, weight, count: 1 };
            while let Some(above) = pools.pop_if(|above| above.mean() > pool.mean()) {
                pool = Pool {
                    sum: above.sum + pool.sum,
                    weight: above.weight + pool.weight,
                    count: above.count + pool.count,
                };
            }
            pools.push(pool);
        }
        let means = pools.iter().flat_map(|pool| std::iter::repeat_n(pool.mean(), pool.count));
        for ((&node, offset), mean) in column.iter().zip(offsets).zip(means) {
            self.y[node] = mean + offset;
        }
    }

    /// The height to which the neighbours pull, and the strength; without neighbours the present height, weakly.
    fn wanted(&self, node: usize, of_left: bool, of_right: bool) -> (f64, f64) {
        let left = self.left[node].iter().filter(|_| of_left);
        let right = self.right[node].iter().filter(|_| of_right);
        let (sum, weight) = left
            .chain(right)
            .fold((0.0, 0.0), |(sum, weight), &(near, pull)| (sum + self.y[near] * pull, weight + pull));
        if weight > 0.0 { (sum / weight, weight) } else { (self.y[node], 0.01) }
    }
}

/// The neighbours of each node in its column.
struct Neighbours {
    above: Vec<Option<usize>>,
    below: Vec<Option<usize>>,
}

impl Neighbours {
    fn of(columns: &Columns, count: usize) -> Neighbours {
        let mut neighbours = Neighbours { above: vec![None; count], below: vec![None; count] };
        for pair in columns.columns.iter().flat_map(|column| column.windows(2)) {
            neighbours.below[pair[0]] = Some(pair[1]);
            neighbours.above[pair[1]] = Some(pair[0]);
        }
        neighbours
    }
}

/// Neighbours that touch and so move together.
struct Pool {
    sum: f64,
    weight: f64,
    count: usize,
}

impl Pool {
    fn mean(&self) -> f64 {
        self.sum / self.weight
    }
}
