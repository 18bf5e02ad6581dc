//! The argument of an assurance case as SVG: the claims on the left, their evidence on the right.

use super::layers::{Edge, Layout, Route, Size, TooManyBends, layout};
use super::sheet::{Rule, Sheet, escaped, fitted, px, width_of};
use super::svg::{MARGIN, TooLarge, moved, route};
use crate::case::{Argument, Kind, Node, words};
use shsa_core::assurance::Verdict;

const TEXT: f64 = 12.0;
const STATE: f64 = 11.0;
/// The widest line, and the most lines of a node.
const MOST_WIDTH: f64 = 210.0;
const MOST_LINES: usize = 4;
const LINE: f64 = 15.0;
const PADDING: f64 = 10.0;
/// The horizontal offset of the slanted sides of a strategy.
const LEAN: f64 = 12.0;

/// Goals are boxes, strategies are slanted, solutions are round; the verdict of a node is written in it.
const RULES: [Rule; 9] = [
    Rule {
        class: "node",
        light: "fill:#fff;stroke:#57606a;stroke-width:1.2",
        dark: "fill:#15181d;stroke:#a0aab5",
    },
    Rule { class: "given", light: "stroke:#1a7f37;stroke-width:2", dark: "stroke:#57ab5a" },
    Rule {
        class: "open",
        light: "stroke:#9a6700;stroke-width:2;stroke-dasharray:6 3",
        dark: "stroke:#d9b84a",
    },
    Rule {
        class: "circular",
        light: "stroke:#9a6700;stroke-width:2;stroke-dasharray:2 3",
        dark: "stroke:#d9b84a",
    },
    Rule {
        class: "refused",
        light: "stroke:#b3261e;stroke-width:2;stroke-dasharray:3 2",
        dark: "stroke:#ff8a80",
    },
    Rule { class: "said", light: "fill:#1d232b;font-size:12px;text-anchor:middle", dark: "fill:#e4e8ee" },
    Rule { class: "stands", light: "fill:#57606a;font-size:11px;text-anchor:middle", dark: "fill:#a0aab5" },
    Rule { class: "support", light: "fill:none;stroke:#8c959f;stroke-width:1.3", dark: "stroke:#77818c" },
    Rule { class: "tip", light: "fill:#6b747e;stroke:none", dark: "fill:#929ca7" },
];

/// The argument as a complete SVG, which begins with `<svg`. Long texts are cut; tooltips hold the full texts.
///
/// Time: that of a layered layout.
///
/// # Errors
/// When there are too many links to follow.
pub fn argument(argument: &Argument) -> Result<String, TooLarge> {
    let shapes: Vec<Shape<'_>> = argument.nodes.iter().map(Shape::new).collect();
    let sizes: Vec<Size> = shapes.iter().map(Shape::size).collect();
    let supports = argument.nodes.iter().enumerate();
    let edges: Vec<Edge> = supports
        .flat_map(|(from, node)| node.supported_by.iter().map(move |&to| Edge { from, to, weight: 1.0 }))
        .collect();
    let placed = layout(&sizes, &edges).map_err(|TooManyBends(count, most)| TooLarge {
        what: "bends in its links",
        count,
        most,
    })?;
    let layout = moved(placed);
    let mut sheet = Sheet::new();
    for (edge, route) in edges.iter().zip(&layout.routes) {
        link(&mut sheet, &shapes, &layout, *edge, route);
    }
    for (shape, &centre) in shapes.iter().zip(&layout.centres) {
        shape.draw(&mut sheet, centre);
    }
    let size = (layout.size.0 + 2.0 * MARGIN, layout.size.1 + 2.0 * MARGIN);
    let claim = argument.nodes.first().map_or("", |node| &node.text);
    let description = format!("Assurance case: {claim}: {}.", words::verdict(argument.state()));
    Ok(sheet.finish("shsa-case", &RULES, size, "Assurance case", &description))
}

/// A link to a supporting node, with its arrowhead there.
fn link(sheet: &mut Sheet, shapes: &[Shape<'_>], layout: &Layout, edge: Edge, way: &Route) {
    let (Some(left), Some(right)) = (layout.centres.get(way.left), layout.centres.get(way.right)) else {
        return;
    };
    let half = |at: usize| shapes.get(at).map_or(0.0, |shape| shape.half.0);
    let (from, to) = ((left.0 + half(way.left), left.1), (right.0 - half(way.right), right.1));
    sheet.put(format_args!("<path class=\"shsa-support\" d=\"{}\"/>", route::path(way, from, to)));
    let (tip, length) = if way.right == edge.to { (to, -7.0) } else { (from, 7.0) };
    let (x, y) = tip;
    let (base, top, bottom) = (px(x + length), px(y - 3.5), px(y + 3.5));
    sheet.put(format_args!("<path class=\"shsa-tip\" d=\"M{} {}L{base} {top}V{bottom}Z\"/>", px(x), px(y)));
}

/// A node ready for layout.
struct Shape<'a> {
    node: &'a Node,
    lines: Vec<String>,
    half: (f64, f64),
}

impl<'a> Shape<'a> {
    fn new(node: &'a Node) -> Shape<'a> {
        let lines = wrapped(&node.text);
        let widest =
            lines.iter().map(|line| width_of(line, TEXT)).fold(width_of("circular", STATE) + 20.0, f64::max);
        let side = if node.kind == Kind::Goal { PADDING } else { PADDING + LEAN };
        let height = (lines.len() as f64 + 1.0) * LINE + PADDING;
        Shape { node, lines, half: (widest / 2.0 + side, height / 2.0) }
    }

    fn size(&self) -> Size {
        Size { width: 2.0 * self.half.0, above: self.half.1, below: self.half.1 }
    }

    fn draw(&self, sheet: &mut Sheet, (x, y): (f64, f64)) {
        let state = words::verdict(self.node.state);
        let (width, height) = self.half;
        sheet.put(format_args!("<g><title>{}: {state}</title>", escaped(&self.node.text)));
        match self.node.kind {
            Kind::Strategy => sheet.put(format_args!(
                "<path class=\"shsa-node shsa-{state}\" d=\"M{} {}H{}L{} {}H{}Z\"/>",
                px(x - width + LEAN),
                px(y - height),
                px(x + width),
                px(x + width - LEAN),
                px(y + height),
                px(x - width)
            )),
            Kind::Goal | Kind::Solution => sheet.put(format_args!(
                "<rect class=\"shsa-node shsa-{state}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"{}\"/>",
                px(x - width),
                px(y - height),
                px(2.0 * width),
                px(2.0 * height),
                px(if self.node.kind == Kind::Goal { 2.0 } else { height })
            )),
        }
        let first = y - height + PADDING / 2.0 + LINE - 3.0;
        for (number, line) in self.lines.iter().enumerate() {
            let at = first + number as f64 * LINE;
            sheet.text(format_args!("class=\"shsa-said\" x=\"{}\" y=\"{}\"", px(x), px(at)), line);
        }
        let at = first + self.lines.len() as f64 * LINE;
        let stands = format!("{} {state}", sign(self.node.state));
        sheet.text(format_args!("class=\"shsa-stands\" x=\"{}\" y=\"{}\"", px(x), px(at)), &stands);
        sheet.put(format_args!("</g>"));
    }
}

/// The sign beside a verdict.
const fn sign(verdict: Verdict) -> char {
    match verdict {
        Verdict::Holds => '\u{2713}',
        Verdict::Open => '?',
        Verdict::Circular => '\u{21bb}',
        Verdict::Refused => '\u{2717}',
    }
}

/// A text wrapped into lines that fit.
fn wrapped(text: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width_of(line, TEXT) + width_of(word, TEXT) + 4.0 <= MOST_WIDTH => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(fitted(word, TEXT, MOST_WIDTH)),
        }
    }
    if lines.len() > MOST_LINES {
        lines.truncate(MOST_LINES);
        if let Some(last) = lines.last_mut() {
            *last = format!("{}\u{2026}", fitted(last, TEXT, MOST_WIDTH - 14.0).trim_end_matches('\u{2026}'));
        }
    }
    lines
}
