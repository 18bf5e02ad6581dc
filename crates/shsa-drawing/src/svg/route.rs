//! The links: curves between the columns, with arrowheads at the inputs and outputs of relations.

use super::block::Block;
use crate::graph::{Direction, Graph, Link};
use crate::layers::{Layout, Route};
use crate::sheet::{Sheet, px};

/// The length of an arrowhead, and of that of a chosen link.
const HEAD: f64 = 8.0;
const CHOSEN_HEAD: f64 = 12.0;
/// The distance of links that end on one side of a node, if there is room.
const PORTS_APART: f64 = 9.0;

/// Draws all links; the chosen ones come last, so that they lie on top.
pub(super) fn draw(
    sheet: &mut Sheet,
    graph: &Graph<'_>,
    links: &[Link],
    blocks: &[Block<'_>],
    layout: &Layout,
) {
    let starts =
        ports(blocks, layout, |route| (route.left, route.bends.first().map(|bend| bend.y), route.right));
    let ends =
        ports(blocks, layout, |route| (route.right, route.bends.last().map(|bend| bend.y), route.left));
    let drawn = links.iter().zip(&layout.routes).zip(starts.iter().zip(&ends));
    let (chosen, usual): (Vec<_>, Vec<_>) = drawn.partition(|((link, _), _)| link.chosen.is_some());
    for ((link, route), (&start, &end)) in usual.into_iter().chain(chosen) {
        // Every route leaves its left node to the right, and enters its right node from the left.
        let (left, right) = (layout.centres[route.left], layout.centres[route.right]);
        let from = (left.0 + blocks[route.left].reach(start), left.1 + start);
        let to = (right.0 - blocks[route.right].reach(end), right.1 + end);
        draw_link(sheet, link, route.left == graph.variable_node(link.variable), route, from, to);
    }
}

/// The vertical offset of each end of a route from the middle of its node; ends on one side are in the order of their
/// destinations.
fn ports(
    blocks: &[Block<'_>],
    layout: &Layout,
    end: impl Fn(&Route) -> (usize, Option<f64>, usize),
) -> Vec<f64> {
    let mut at_node: Vec<Vec<(f64, usize)>> = vec![Vec::new(); blocks.len()];
    for (number, route) in layout.routes.iter().enumerate() {
        let (node, bend, other) = end(route);
        at_node[node].push((bend.unwrap_or(layout.centres[other].1), number));
    }
    let mut ports = vec![0.0; layout.routes.len()];
    for (block, mut routes) in blocks.iter().zip(at_node) {
        routes.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let last = routes.len().saturating_sub(1) as f64;
        let step = PORTS_APART.min((2.0 * block.half.1 - 12.0) / last.max(1.0));
        for (place, (_, number)) in routes.into_iter().enumerate() {
            ports[number] = (place as f64 - last / 2.0) * step;
        }
    }
    ports
}

fn draw_link(
    sheet: &mut Sheet,
    link: &Link,
    variable_left: bool,
    route: &Route,
    from: (f64, f64),
    to: (f64, f64),
) {
    let (at_left, at_right) = if variable_left { (link.makes, link.reads) } else { (link.reads, link.makes) };
    // The arrowheads of a chosen link; a link that is usable in both directions has a smaller head at its other end.
    let used_left = link.chosen.map(|chosen| (chosen == Direction::Make) == variable_left);
    let (head_left, head_right) = (head_of(used_left == Some(true)), head_of(used_left == Some(false)));
    let start = if at_left { from.0 + head_left.1 - 1.0 } else { from.0 };
    let end = if at_right { to.0 - head_right.1 + 1.0 } else { to.0 };
    let look = if link.chosen.is_some() { " shsa-chosen" } else { "" };
    let path = path(route, (start, from.1), (end, to.1));
    sheet.put(format_args!("<path class=\"shsa-link{look}\" d=\"{path}\"/>"));
    if at_left {
        head(sheet, head_left.0, from, head_left.1);
    }
    if at_right {
        head(sheet, head_right.0, to, -head_right.1);
    }
}

/// The class and length of an arrowhead.
fn head_of(used: bool) -> (&'static str, f64) {
    if used { ("shsa-chosen-fill", CHOSEN_HEAD) } else { ("shsa-head", HEAD) }
}

/// A path that is straight along the columns that it passes and curved between them.
pub(crate) fn path(route: &Route, from: (f64, f64), to: (f64, f64)) -> String {
    let mut path = format!("M{} {}", px(from.0), px(from.1));
    let (mut x, mut y) = (route.exit_x.max(from.0), from.1);
    if x > from.0 {
        path += &format!("H{}", px(x));
    }
    let entry_x = route.entry_x.min(to.0);
    let stops = route.bends.iter().map(|bend| (bend.left_x, bend.right_x, bend.y));
    for (left, right, height) in stops.chain([(entry_x, to.0, to.1)]) {
        let middle = px((x + left) / 2.0);
        path += &match (height - y).abs() < 0.5 {
            true => format!("L{} {}", px(left), px(height)),
            false => format!("C{middle} {} {middle} {} {} {}", px(y), px(height), px(left), px(height)),
        };
        if right > left {
            path += &format!("H{}", px(right));
        }
        (x, y) = (right, height);
    }
    path
}

/// A triangle with its tip at a point; a positive `length` points to the left.
fn head(sheet: &mut Sheet, class: &str, (x, y): (f64, f64), length: f64) {
    let (base, half) = (px(x + length), length.abs() * 0.45);
    let (top, bottom) = (px(y - half), px(y + half));
    sheet.put(format_args!("<path class=\"{class}\" d=\"M{} {}L{base} {top}V{bottom}Z\"/>", px(x), px(y)));
}
