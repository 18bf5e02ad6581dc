//! A node with its attachments: a variable with its signals and needs, or a relation with its equation.

use super::MOST_EQUATIONS;
use crate::graph::{Graph, constant};
use crate::layers::Size;
use crate::sheet::{Sheet, escaped, fitted, px, width_of};
use shsa_core::knowledge::{RelationId, SignalId, VariableId};

const NAME: f64 = 13.0;
const SMALL: f64 = 11.0;
/// The widest texts.
const MOST_NAME: f64 = 190.0;
const MOST_TAG: f64 = 180.0;
const MOST_EQUATION: f64 = 250.0;
/// Half the height of an ellipse, of a box, and of a box with an equation.
const ELLIPSE: f64 = 17.0;
const BOX: f64 = 14.0;
const EQUATION_BOX: f64 = 22.0;
/// The height of a tag, and the distance of two tags.
const TAG: f64 = 17.0;
const TAG_STEP: f64 = 20.0;
/// The most signals that are drawn at a variable; the others are counted.
const MOST_SIGNALS: usize = 6;

/// A node ready for layout.
pub(super) struct Block<'a> {
    what: What<'a>,
    name: String,
    /// Half the size of the body, where links end.
    pub(super) half: (f64, f64),
    /// The width of the whole.
    width: f64,
}

enum What<'a> {
    Variable { id: VariableId, above: Vec<Tag<'a>>, below: Vec<Tag<'a>> },
    Relation { id: RelationId, equation: Option<String> },
}

/// A small text at a variable.
enum Tag<'a> {
    Need(&'a str),
    Value(String),
    Signal(SignalId, &'a str),
    More(usize),
}

impl Tag<'_> {
    fn text(&self) -> String {
        match self {
            Tag::Need(name) | Tag::Signal(_, name) => fitted(name, SMALL, MOST_TAG),
            Tag::Value(value) => format!("= {value}"),
            Tag::More(count) => format!("and {count} more"),
        }
    }

    fn width(&self) -> f64 {
        width_of(&self.text(), SMALL) + if matches!(self, Tag::Value(_)) { 14.0 } else { 26.0 }
    }
}

/// All nodes, variables first.
pub(super) fn blocks<'a>(graph: &Graph<'a>) -> Vec<Block<'a>> {
    let knowledge = graph.knowledge;
    let variables = knowledge.variables().ids().map(|id| variable(graph, id));
    variables.chain(knowledge.relations().ids().map(|id| relation(graph, id))).collect()
}

fn variable<'a>(graph: &Graph<'a>, id: VariableId) -> Block<'a> {
    let variable = &graph.knowledge.variables()[id];
    let above: Vec<Tag> = graph.needs(id).iter().map(|need| Tag::Need(&need.signal)).collect();
    let mut below: Vec<Tag> = constant(variable).map(Tag::Value).into_iter().collect();
    let mut signals = graph.knowledge.carriers(id).to_vec();
    let more = signals.len().saturating_sub(MOST_SIGNALS);
    if more > 0 {
        signals.sort_by_key(|&signal| !graph.is_lost(signal));
        signals.truncate(MOST_SIGNALS);
    }
    below.extend(
        signals.into_iter().map(|signal| Tag::Signal(signal, &graph.knowledge.signals()[signal].name)),
    );
    below.extend((more > 0).then_some(Tag::More(more)));
    let name = fitted(&variable.name, NAME, MOST_NAME);
    let half = (((width_of(&name, NAME) + 36.0) / 2.0).max(34.0), ELLIPSE);
    let tags = above.iter().chain(&below).map(Tag::width).fold(0.0, f64::max);
    Block { what: What::Variable { id, above, below }, name, half, width: (2.0 * half.0).max(tags) }
}

fn relation<'a>(graph: &Graph<'a>, id: RelationId) -> Block<'a> {
    let relation = &graph.knowledge.relations()[id];
    let shown = !relation.text.is_empty() && graph.knowledge.relations().len() <= MOST_EQUATIONS;
    let equation = shown.then(|| fitted(&relation.text, SMALL, MOST_EQUATION));
    let name = fitted(&relation.name, NAME, MOST_NAME);
    let widest = width_of(&name, NAME).max(equation.as_ref().map_or(0.0, |text| width_of(text, SMALL)));
    let half = ((widest + 20.0) / 2.0, if equation.is_some() { EQUATION_BOX } else { BOX });
    Block { what: What::Relation { id, equation }, name, half, width: 2.0 * half.0 }
}

impl Block<'_> {
    /// The room of the node.
    pub(super) fn size(&self) -> Size {
        let tags = |tags: &[Tag]| tags.len() as f64 * TAG_STEP;
        let (above, below) = match &self.what {
            What::Variable { above, below, .. } => (tags(above), tags(below)),
            What::Relation { .. } => (0.0, 0.0),
        };
        Size { width: self.width, above: self.half.1 + above, below: self.half.1 + below }
    }

    /// The half width of the body, `dy` above or below its middle.
    pub(super) fn reach(&self, dy: f64) -> f64 {
        match self.what {
            What::Variable { .. } => self.half.0 * (1.0 - (dy / self.half.1).powi(2)).max(0.0).sqrt(),
            What::Relation { .. } => self.half.0,
        }
    }

    pub(super) fn draw(&self, sheet: &mut Sheet, graph: &Graph<'_>, (x, y): (f64, f64)) {
        match &self.what {
            What::Variable { id, above, below } => {
                sheet.put(format_args!("<g><title>{}</title>", escaped(&graph.variable_description(*id))));
                self.draw_variable(sheet, graph, *id, (x, y));
                sheet.put(format_args!("</g>"));
                for (tag, step) in above.iter().zip(1_u32..) {
                    tag.draw(
                        sheet,
                        graph,
                        (x, y - ELLIPSE - 3.0 - f64::from(step) * TAG_STEP + TAG_STEP - TAG / 2.0),
                    );
                }
                for (tag, step) in below.iter().zip(0_u32..) {
                    tag.draw(sheet, graph, (x, y + ELLIPSE + 3.0 + f64::from(step) * TAG_STEP + TAG / 2.0));
                }
            }
            What::Relation { id, equation } => {
                sheet.put(format_args!("<g><title>{}</title>", escaped(&graph.relation_description(*id))));
                self.draw_relation(sheet, graph, *id, equation.as_deref(), (x, y));
                sheet.put(format_args!("</g>"));
            }
        }
    }

    fn draw_variable(&self, sheet: &mut Sheet, graph: &Graph<'_>, id: VariableId, (x, y): (f64, f64)) {
        let constant = graph.knowledge.variables()[id].constant.is_some();
        let look = match (constant, graph.is_provided(id)) {
            (true, _) => " shsa-constant",
            (false, true) => " shsa-provided",
            (false, false) => "",
        };
        let chosen = if graph.is_chosen(id) { " shsa-chosen" } else { "" };
        let (cx, cy, rx, ry) = (px(x), px(y), px(self.half.0), px(self.half.1));
        sheet.put(format_args!(
            "<ellipse class=\"shsa-variable{look}{chosen}\" cx=\"{cx}\" cy=\"{cy}\" rx=\"{rx}\" ry=\"{ry}\"/>"
        ));
        if constant {
            let (rx, ry) = (px(self.half.0 - 3.5), px(self.half.1 - 3.5));
            sheet.put(format_args!(
                "<ellipse class=\"shsa-ring\" cx=\"{cx}\" cy=\"{cy}\" rx=\"{rx}\" ry=\"{ry}\"/>"
            ));
        }
        sheet.text(format_args!("class=\"shsa-name\" x=\"{cx}\" y=\"{}\"", px(y + 4.5)), &self.name);
    }

    fn draw_relation(
        &self,
        sheet: &mut Sheet,
        graph: &Graph<'_>,
        id: RelationId,
        equation: Option<&str>,
        (x, y): (f64, f64),
    ) {
        let numbers = graph.numbers(id);
        let structure = graph.knowledge.relations()[id].formulas.is_empty();
        let structure = if structure { " shsa-structure" } else { "" };
        let chosen = if numbers.is_some() { " shsa-chosen" } else { "" };
        let (left, top) = (x - self.half.0, y - self.half.1);
        let (width, height) = (px(2.0 * self.half.0), px(2.0 * self.half.1));
        sheet.put(format_args!(
            "<rect class=\"shsa-relation{structure}{chosen}\" x=\"{}\" y=\"{}\" width=\"{width}\" height=\"{height}\" \
             rx=\"3\"/>",
            px(left),
            px(top)
        ));
        let name_y = if equation.is_some() { y - 3.5 } else { y + 4.5 };
        let at = format!("x=\"{}\" y=\"{}\"", px(x), px(name_y));
        sheet.text(format_args!("class=\"shsa-name shsa-strong\" {at}"), &self.name);
        if let Some(equation) = equation {
            let at = format!("x=\"{}\" y=\"{}\"", px(x), px(y + 13.0));
            sheet.text(format_args!("class=\"shsa-formula\" {at}"), equation);
        }
        if let Some(numbers) = numbers {
            badge(sheet, &numbers, (left, top));
        }
    }
}

/// The numbers of a relation in the order of computation.
pub(super) fn badge(sheet: &mut Sheet, numbers: &str, (x, y): (f64, f64)) {
    let half = (width_of(numbers, SMALL) / 2.0 + 5.0).max(9.0);
    let (left, top, width) = (px(x - half), px(y - 9.0), px(2.0 * half));
    sheet.put(format_args!(
        "<rect class=\"shsa-chosen-fill\" x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"18\" rx=\"9\"/>"
    ));
    sheet.text(format_args!("class=\"shsa-chosen-text\" x=\"{}\" y=\"{}\"", px(x), px(y + 4.0)), numbers);
}

impl Tag<'_> {
    fn draw(&self, sheet: &mut Sheet, graph: &Graph<'_>, middle: (f64, f64)) {
        let text = self.text();
        match self {
            Tag::Need(name) => {
                let title = format!("needed as {name}");
                need(sheet, &title, &text, (middle.0 - self.width() / 2.0, middle.1));
            }
            Tag::Signal(id, _) => {
                let state = match (graph.is_lost(*id), graph.is_source(*id)) {
                    (true, _) => State::Lost,
                    (false, true) => State::Chosen,
                    (false, false) => State::Usual,
                };
                let left = (middle.0 - self.width() / 2.0, middle.1);
                signal(sheet, &graph.signal_description(*id), &text, left, state);
            }
            Tag::Value(_) | Tag::More(_) => {
                let (x, y) = (px(middle.0), px(middle.1 + 4.0));
                sheet.text(
                    format_args!("class=\"shsa-tag\" text-anchor=\"middle\" x=\"{x}\" y=\"{y}\""),
                    &text,
                );
            }
        }
    }
}

/// The state of a signal.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum State {
    Usual,
    Chosen,
    Lost,
}

/// A pill with a dot for an available signal, or a cross for a lost one.
pub(super) fn signal(sheet: &mut Sheet, title: &str, text: &str, (left, y): (f64, f64), state: State) {
    let width = width_of(text, SMALL) + 26.0;
    let look = match state {
        State::Usual => "",
        State::Chosen => " shsa-chosen shsa-thin",
        State::Lost => " shsa-lost",
    };
    sheet.put(format_args!(
        "<g><title>{}</title><rect class=\"shsa-signal{look}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"{}\"/>",
        escaped(title),
        px(left),
        px(y - TAG / 2.0),
        px(width),
        px(TAG),
        px(TAG / 2.0),
    ));
    let (x, cy) = (left + 10.0, px(y));
    match state {
        State::Lost => {
            let (from, to, top, bottom) = (px(x - 3.0), px(x + 3.0), px(y - 3.0), px(y + 3.0));
            sheet.put(format_args!(
                "<path class=\"shsa-cross\" d=\"M{from} {top}L{to} {bottom}M{from} {bottom}L{to} {top}\"/>"
            ));
        }
        State::Usual | State::Chosen => {
            let fill = if state == State::Chosen { "shsa-chosen-fill" } else { "shsa-head" };
            sheet.put(format_args!("<circle class=\"{fill}\" cx=\"{}\" cy=\"{cy}\" r=\"3\"/>", px(x)));
        }
    }
    let struck = if state == State::Lost { " text-decoration=\"line-through\"" } else { "" };
    let at = format!("x=\"{}\" y=\"{}\"", px(left + 18.0), px(y + 4.0));
    sheet.text(format_args!("class=\"shsa-tag\"{struck} {at}"), text);
    sheet.put(format_args!("</g>"));
}

/// A dark tag with a target: a need.
pub(super) fn need(sheet: &mut Sheet, title: &str, text: &str, (left, y): (f64, f64)) {
    let width = width_of(text, SMALL) + 26.0;
    sheet.put(format_args!(
        "<g><title>{}</title><rect class=\"shsa-need\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"3\"/>",
        escaped(title),
        px(left),
        px(y - TAG / 2.0),
        px(width),
        px(TAG),
    ));
    let (x, cy) = (px(left + 11.0), px(y));
    sheet.put(format_args!(
        "<circle class=\"shsa-signal\" cx=\"{x}\" cy=\"{cy}\" r=\"4.5\"/>\
         <circle class=\"shsa-need\" cx=\"{x}\" cy=\"{cy}\" r=\"2\"/>"
    ));
    let at = format!("x=\"{}\" y=\"{}\"", px(left + 20.0), px(y + 4.0));
    sheet.text(format_args!("class=\"shsa-need-text\" {at}"), text);
    sheet.put(format_args!("</g>"));
}
