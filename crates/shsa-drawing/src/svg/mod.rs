//! A knowledge base as SVG: known variables on the left, derived ones on the right.

mod block;
pub(super) mod route;
mod legend;

use super::graph::{Direction, Graph, Link, Marks};
use super::layers::{Edge, Layout, Size, TooManyBends, layout};
use super::sheet::{Rule, Sheet};
use block::Block;
use shsa_core::knowledge::KnowledgeBase;

/// The room around the whole.
pub(super) const MARGIN: f64 = 16.0;
/// The most nodes of a drawing: with more, it is unreadable and takes long.
const MOST_NODES: usize = 2_000;
const MOST_LINKS: usize = 8_000;
/// With more relations than this, equations are shown in tooltips only.
const MOST_EQUATIONS: usize = 60;

/// Colour carries no information alone: provided variables are filled, the chosen substitution is thick and numbered, lost
/// signals are dashed and crossed out.
const RULES: [Rule; 21] = [
    Rule {
        class: "variable",
        light: "fill:#fff;stroke:#57606a;stroke-width:1.2",
        dark: "fill:#15181d;stroke:#a0aab5",
    },
    Rule { class: "provided", light: "fill:#d8e9f7;stroke:#2f6f9f", dark: "fill:#1d3a52;stroke:#79b8e8" },
    Rule { class: "constant", light: "fill:#ececec;stroke:#57606a", dark: "fill:#2d333b;stroke:#a0aab5" },
    Rule { class: "ring", light: "fill:none;stroke:#57606a;stroke-width:1", dark: "stroke:#a0aab5" },
    Rule {
        class: "relation",
        light: "fill:#fdf6e6;stroke:#8a6a00;stroke-width:1.2",
        dark: "fill:#2c2614;stroke:#d9b84a",
    },
    Rule { class: "structure", light: "stroke-dasharray:5 3", dark: "" },
    Rule { class: "name", light: "fill:#1d232b;text-anchor:middle", dark: "fill:#e4e8ee" },
    Rule { class: "strong", light: "font-weight:600", dark: "" },
    Rule { class: "formula", light: "fill:#57606a;font-size:11px;text-anchor:middle", dark: "fill:#a0aab5" },
    Rule {
        class: "signal",
        light: "fill:#fff;stroke:#8c959f;stroke-width:1",
        dark: "fill:#15181d;stroke:#77818c",
    },
    Rule { class: "tag", light: "fill:#3f4650;font-size:11px", dark: "fill:#c3cad2" },
    Rule { class: "need", light: "fill:#3f4650;stroke:none", dark: "fill:#c9d0d8" },
    Rule { class: "need-text", light: "fill:#fff;font-size:11px", dark: "fill:#15181d" },
    Rule { class: "link", light: "fill:none;stroke:#8c959f;stroke-width:1.3", dark: "stroke:#77818c" },
    Rule { class: "head", light: "fill:#6b747e;stroke:none", dark: "fill:#929ca7" },
    Rule { class: "chosen", light: "stroke:#0068a8;stroke-width:3", dark: "stroke:#5ab0f0" },
    Rule { class: "cross", light: "stroke:#b3261e;stroke-width:2", dark: "stroke:#ff8a80" },
    Rule { class: "thin", light: "stroke-width:1.8", dark: "" },
    Rule { class: "chosen-fill", light: "fill:#0068a8;stroke:none", dark: "fill:#5ab0f0" },
    Rule {
        class: "chosen-text",
        light: "fill:#fff;font-size:11px;font-weight:700;text-anchor:middle",
        dark: "fill:#15181d",
    },
    Rule { class: "lost", light: "stroke:#b3261e;stroke-dasharray:3 2", dark: "stroke:#ff8a80" },
];

/// A knowledge base that is too large to be drawn as SVG here.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "a drawing with {count} {what} is beyond the limit of {most}: write DOT, and let Graphviz draw it (`sfdp -Tsvg`)"
)]
pub struct TooLarge {
    /// The kind of element that exceeds the limit.
    pub what: &'static str,
    /// The number of these elements.
    pub count: usize,
    /// The limit.
    pub most: usize,
}

/// The knowledge base as a complete SVG, which begins with `<svg`.
///
/// Relations are boxes, variables ellipses (filled when provided, with a double line when constant), signals small and below
/// their variable, needs above it; arrowheads show the directions in which a relation is usable. Long names are cut; tooltips
/// hold the full names. Time: that of a layered layout, below a second for 1,000 nodes.
///
/// # Errors
/// When there are more than 2,000 variables and relations, or too many links to follow.
pub fn svg(knowledge: &KnowledgeBase, marks: &Marks) -> Result<String, TooLarge> {
    let within = |what, count, most| if count > most { Err(TooLarge { what, count, most }) } else { Ok(()) };
    let nodes = knowledge.variables().len() + knowledge.relations().len();
    within("variables and relations", nodes, MOST_NODES)?;
    let graph = Graph::new(knowledge, marks);
    let mut links = graph.links();
    within("links between variables and relations", links.len(), MOST_LINKS)?;
    // In a cycle, the chosen links keep their direction first, then those that have only one direction.
    links.sort_by_key(|link| (link.chosen.is_none(), link.makes && link.reads));
    let blocks = block::blocks(&graph);
    let sizes: Vec<Size> = blocks.iter().map(Block::size).collect();
    let edges: Vec<Edge> = links.iter().map(|link| edge(&graph, link)).collect();
    let placed = layout(&sizes, &edges).map_err(|TooManyBends(count, most)| TooLarge {
        what: "bends in its links",
        count,
        most,
    })?;
    Ok(drawn(&graph, &links, &blocks, &moved(placed)))
}

fn edge(graph: &Graph<'_>, link: &Link) -> Edge {
    let (variable, relation) = (graph.variable_node(link.variable), graph.relation_node(link.relation));
    let (from, to) = match link.flow {
        Direction::Read => (variable, relation),
        Direction::Make => (relation, variable),
    };
    Edge { from, to, weight: if link.chosen.is_some() { 4.0 } else { 1.0 } }
}

/// The layout with a margin to the left and above.
pub(super) fn moved(mut layout: Layout) -> Layout {
    for centre in &mut layout.centres {
        *centre = (centre.0 + MARGIN, centre.1 + MARGIN);
    }
    for route in &mut layout.routes {
        route.exit_x += MARGIN;
        route.entry_x += MARGIN;
        for bend in &mut route.bends {
            bend.left_x += MARGIN;
            bend.right_x += MARGIN;
            bend.y += MARGIN;
        }
    }
    layout
}

fn drawn(graph: &Graph<'_>, links: &[Link], blocks: &[Block<'_>], layout: &Layout) -> String {
    let mut sheet = Sheet::new();
    route::draw(&mut sheet, graph, links, blocks, layout);
    for (block, &centre) in blocks.iter().zip(&layout.centres) {
        block.draw(&mut sheet, graph, centre);
    }
    let below = layout.size.1 + 2.0 * MARGIN;
    let (width, height) = legend::draw(&mut sheet, graph, links, layout.size.0, below);
    let size = (width + 2.0 * MARGIN, height + MARGIN);
    sheet.finish("shsa-graph", &RULES, size, "Knowledge base", &graph.description())
}
