//! A knowledge base for Graphviz (<https://graphviz.org/doc/info/lang.html>), for sizes and layouts that are not drawn here.

use super::graph::{Direction, Graph, Link, Marks, constant};
use shsa_core::knowledge::{Id, KnowledgeBase, RelationId, SignalId, VariableId};

/// The knowledge base as a graph in the DOT language.
///
/// Relations are boxes, variables ellipses (filled when provided, with a double line when constant), signals notes; arrowheads
/// show the directions in which a relation is usable. The chosen substitution has thicker lines and numbers. Time: linear in the
/// text, except for relations with many outputs.
#[must_use]
pub fn dot(knowledge: &KnowledgeBase, marks: &Marks) -> String {
    let graph = Graph::new(knowledge, marks);
    let mut lines = vec![
        "digraph knowledge {".to_owned(),
        "  graph [rankdir=LR, fontname=\"sans-serif\"];".to_owned(),
        "  node [fontname=\"sans-serif\", fontsize=11];".to_owned(),
        "  edge [arrowsize=0.7];".to_owned(),
    ];
    lines.extend(knowledge.variables().ids().map(|id| variable(&graph, id)));
    lines.extend(knowledge.relations().ids().map(|id| relation(&graph, id)));
    lines.extend(graph.links().iter().map(edge));
    lines.extend(knowledge.signals().ids().map(|id| signal(&graph, id)));
    lines.extend(knowledge.needs().enumerate().map(|(id, need)| {
        let node = format!("n{}", id.index());
        let (name, variable) = (quoted(&need.signal), need.variable.index());
        format!(
            "  {node} [shape=cds, style=bold, label={name}];\n  v{variable} -> {node} [style=dashed, arrowhead=none];"
        )
    }));
    lines.push("}\n".to_owned());
    lines.join("\n")
}

fn variable(graph: &Graph<'_>, id: VariableId) -> String {
    let variable = &graph.knowledge.variables()[id];
    let label =
        constant(variable).map_or(variable.name.clone(), |value| format!("{}\n{value}", variable.name));
    let fill = if graph.is_provided(id) { ", style=filled, fillcolor=\"#dcebf7\"" } else { "" };
    let rings = if variable.constant.is_some() { ", peripheries=2" } else { "" };
    let width = if graph.is_chosen(id) { CHOSEN } else { "" };
    let (label, tooltip) = (quoted(&label), quoted(&graph.variable_description(id)));
    format!("  v{} [shape=ellipse, label={label}, tooltip={tooltip}{fill}{rings}{width}];", id.index())
}

fn relation(graph: &Graph<'_>, id: RelationId) -> String {
    let relation = &graph.knowledge.relations()[id];
    let numbers = graph.numbers(id);
    let name =
        numbers.as_ref().map_or(relation.name.clone(), |numbers| format!("{numbers}: {}", relation.name));
    let style = if relation.formulas.is_empty() { ", style=dashed" } else { "" };
    let width = if numbers.is_some() { CHOSEN } else { "" };
    let (label, tooltip) = (quoted(&name), quoted(&graph.relation_description(id)));
    format!("  r{} [shape=box, label={label}, tooltip={tooltip}{style}{width}];", id.index())
}

/// The attributes of chosen nodes and edges.
const CHOSEN: &str = ", penwidth=3, color=\"#0068a8\"";

fn edge(link: &Link) -> String {
    let (variable, relation) = (format!("v{}", link.variable.index()), format!("r{}", link.relation.index()));
    let (from, to, direction) = match (link.flow, link.makes && link.reads) {
        (Direction::Make, both) => (relation, variable, if both { "both" } else { "forward" }),
        (Direction::Read, both) => (variable, relation, if both { "both" } else { "forward" }),
    };
    let width = if link.chosen.is_some() { CHOSEN } else { "" };
    format!("  {from} -> {to} [dir={direction}{width}];")
}

fn signal(graph: &Graph<'_>, id: SignalId) -> String {
    let signal = &graph.knowledge.signals()[id];
    let style = if graph.is_lost(id) { ", style=dashed, color=\"#b3261e\"" } else { "" };
    let lost = if graph.is_lost(id) { "lost: " } else { "" };
    let (label, tooltip) = (quoted(&format!("{lost}{}", signal.name)), quoted(&graph.signal_description(id)));
    let (node, variable) = (id.index(), signal.variable.index());
    format!(
        "  s{node} [shape=note, fontsize=9, label={label}, tooltip={tooltip}{style}];\n  \
         s{node} -> v{variable} [style=dotted, arrowhead=none];"
    )
}

/// A text in quotes. Graphviz has no escape for a backslash in names, but shows `\\` as one in labels; line ends
/// become centred line breaks.
fn quoted(text: &str) -> String {
    let mut safe = String::from("\"");
    for char in text.chars() {
        match char {
            '"' => safe.push_str("\\\""),
            '\\' => safe.push_str("\\\\"),
            '\n' => safe.push_str("\\n"),
            char if char.is_control() => safe.push('\u{fffd}'),
            // Graphviz decodes HTML entities in every label.
            '&' => safe.push_str("&amp;"),
            char => safe.push(char),
        }
    }
    safe.push('"');
    safe
}
