//! The meaning of the signs, in a line below the drawing: only of those that occur.

use super::MARGIN;
use super::block::{State, badge, need, signal};
use crate::graph::{Graph, Link};
use crate::sheet::{Sheet, px, width_of};

/// The height of a line of the legend.
const LINE: f64 = 28.0;
/// The room between two entries.
const APART: f64 = 22.0;
/// The least width of the legend below a narrow drawing.
const NARROW: f64 = 460.0;

/// A sign and its meaning.
struct Entry {
    /// The width of the sign.
    width: f64,
    text: &'static str,
    draw: fn(&mut Sheet, f64, f64),
}

/// Draws the legend below a drawing of this width that ends at `top`; returns the size of both.
pub(super) fn draw(sheet: &mut Sheet, graph: &Graph<'_>, links: &[Link], width: f64, top: f64) -> (f64, f64) {
    let (mut x, mut y) = (MARGIN, top + LINE / 2.0);
    let mut widest = width;
    for entry in entries(graph, links) {
        let text = width_of(entry.text, 12.0);
        if x > MARGIN && x + entry.width + 8.0 + text > MARGIN + width.max(NARROW) {
            (x, y) = (MARGIN, y + LINE);
        }
        (entry.draw)(sheet, x, y);
        x += entry.width + if entry.width > 0.0 { 8.0 } else { 0.0 };
        sheet.text(format_args!("class=\"shsa-note\" x=\"{}\" y=\"{}\"", px(x), px(y + 4.0)), entry.text);
        x += text;
        widest = widest.max(x - MARGIN);
        x += APART;
    }
    (widest, y + LINE / 2.0)
}

fn entries(graph: &Graph<'_>, links: &[Link]) -> Vec<Entry> {
    let knowledge = graph.knowledge;
    let constant = |id| knowledge.variables()[id].constant.is_some();
    let variables = || knowledge.variables().ids();
    let signals = || knowledge.signals().ids();
    let relations = || knowledge.relations().iter();
    let entries = [
        (
            variables().any(|id| !graph.is_provided(id)),
            Entry { width: 30.0, text: "variable", draw: |sheet, x, y| ellipse(sheet, "", x, y) },
        ),
        (
            variables().any(|id| graph.is_provided(id) && !constant(id)),
            Entry {
                width: 30.0,
                text: "provided",
                draw: |sheet, x, y| ellipse(sheet, " shsa-provided", x, y),
            },
        ),
        (
            variables().any(constant),
            Entry {
                width: 30.0,
                text: "constant",
                draw: |sheet, x, y| ellipse(sheet, " shsa-constant", x, y),
            },
        ),
        (
            relations().any(|relation| !relation.formulas.is_empty()),
            Entry { width: 26.0, text: "relation", draw: |sheet, x, y| rectangle(sheet, "", x, y) },
        ),
        (
            relations().any(|relation| relation.formulas.is_empty()),
            Entry {
                width: 26.0,
                text: "relation, structure only",
                draw: |sheet, x, y| rectangle(sheet, " shsa-structure", x, y),
            },
        ),
        (
            links.iter().any(|link| link.makes && link.reads),
            Entry { width: 40.0, text: "usable in both directions", draw: both },
        ),
        (
            signals().any(|id| !graph.is_lost(id)),
            Entry { width: 26.0, text: "signal", draw: |sheet, x, y| pill(sheet, State::Usual, x, y) },
        ),
        (
            signals().any(|id| graph.is_lost(id)),
            Entry { width: 26.0, text: "lost signal", draw: |sheet, x, y| pill(sheet, State::Lost, x, y) },
        ),
        (
            !knowledge.needs().is_empty(),
            Entry { width: 26.0, text: "needed as", draw: |sheet, x, y| need(sheet, "", "", (x, y)) },
        ),
        (
            variables().any(|id| graph.is_chosen(id)),
            Entry { width: 44.0, text: "chosen, by steps", draw: chosen },
        ),
    ];
    entries.into_iter().filter_map(|(occurs, entry)| occurs.then_some(entry)).collect()
}

fn ellipse(sheet: &mut Sheet, look: &str, x: f64, y: f64) {
    let (cx, cy) = (px(x + 15.0), px(y));
    sheet.put(format_args!(
        "<ellipse class=\"shsa-variable{look}\" cx=\"{cx}\" cy=\"{cy}\" rx=\"15\" ry=\"8.5\"/>"
    ));
    if look == " shsa-constant" {
        sheet
            .put(format_args!("<ellipse class=\"shsa-ring\" cx=\"{cx}\" cy=\"{cy}\" rx=\"11.5\" ry=\"5\"/>"));
    }
}

fn rectangle(sheet: &mut Sheet, look: &str, x: f64, y: f64) {
    let (x, y) = (px(x), px(y - 8.0));
    sheet.put(format_args!(
        "<rect class=\"shsa-relation{look}\" x=\"{x}\" y=\"{y}\" width=\"26\" height=\"16\" rx=\"3\"/>"
    ));
}

fn pill(sheet: &mut Sheet, state: State, x: f64, y: f64) {
    signal(sheet, "", "", (x, y), state);
}

fn both(sheet: &mut Sheet, x: f64, y: f64) {
    let (from, to, cy) = (px(x + 7.0), px(x + 33.0), px(y));
    let (left, right, top, bottom) = (px(x), px(x + 40.0), px(y - 3.6), px(y + 3.6));
    let (inner_left, inner_right) = (px(x + 8.0), px(x + 32.0));
    sheet.put(format_args!(
        "<path class=\"shsa-link\" d=\"M{from} {cy}H{to}\"/>\
         <path class=\"shsa-head\" d=\"M{left} {cy}L{inner_left} {top}V{bottom}ZM{right} {cy}L{inner_right} {top}V{bottom}Z\"/>"
    ));
}

fn chosen(sheet: &mut Sheet, x: f64, y: f64) {
    let (from, to, cy) = (px(x + 9.0), px(x + 34.0), px(y));
    let (tip, top, bottom) = (px(x + 44.0), px(y - 5.4), px(y + 5.4));
    let base = px(x + 32.0);
    sheet.put(format_args!(
        "<path class=\"shsa-link shsa-chosen\" d=\"M{from} {cy}H{to}\"/>\
         <path class=\"shsa-chosen-fill\" d=\"M{tip} {cy}L{base} {top}V{bottom}Z\"/>"
    ));
    badge(sheet, "1", (x + 9.0, y));
}
