//! Knowledge bases as the thesis's Prolog facts.

use shsa_core::expression::{Node, Symbol, parse_equation};
use shsa_core::knowledge::{Id, KnowledgeBase, Relation, RelationId, VariableId};
use std::fmt::Write;

use super::losses::{self, described};
use super::names::Taken;
use super::statements;

/// A text in another form, and the parts of the knowledge base that it lacks.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// The text, which ends with a line feed.
    pub text: String,
    /// The losses, one per line.
    pub losses: Vec<String>,
}

/// The rules for substitutions, with which every export ends.
pub(super) const RULES: &str = include_str!("rules.pl");

/// Reserved words of Python that could be names of ours.
const KEYWORDS: [&str; 28] = [
    "as", "assert", "async", "await", "break", "class", "continue", "def", "del", "elif", "else", "except",
    "finally", "for", "from", "global", "import", "in", "is", "lambda", "nonlocal", "pass", "raise",
    "return", "try", "while", "with", "yield",
];

/// Writes `function/3`, `implementation/2` and `itomsOf/2`, with values in SI, and rules: the query `substitution(speed, S)` in
/// SWI-Prolog gives all substitutions.
///
/// A relation keeps its name for the variable before the `=` of its equation. For another output, the name of the variable
/// follows the name of the relation. A relation of structure only keeps one name. The value of a constant is among its itoms.
/// Time: linear in the knowledge base.
#[must_use]
pub fn write(knowledge: &KnowledgeBase) -> Written {
    let mut writer = Writer { knowledge, text: String::new(), losses: Vec::new(), taken: Taken::default() };
    writer.text += "% Relations: function(output, relation, [inputs]).\n";
    for id in knowledge.relations().ids() {
        writer.taken.unique(&knowledge.relations()[id].name);
    }
    let relations: Vec<Direction> =
        knowledge.relations().ids().flat_map(|id| writer.directions(id)).collect();
    for direction in &relations {
        writer.function(direction);
    }
    writer.implementations(&relations);
    writer.itoms();
    writer.text += RULES;
    writer.losses.extend(losses::of(knowledge, |_| true));
    Written { text: writer.text, losses: writer.losses }
}

/// One output of a relation.
struct Direction {
    relation: RelationId,
    output: VariableId,
    name: String,
}

struct Writer<'k> {
    knowledge: &'k KnowledgeBase,
    text: String,
    losses: Vec<String>,
    taken: Taken,
}

impl Writer<'_> {
    fn variable(&self, id: VariableId) -> &str {
        &self.knowledge.variables()[id].name
    }

    fn line(&mut self, line: &str) {
        self.text += line;
        self.text += "\n";
    }

    /// The outputs of a relation, first the left side of its equation.
    fn directions(&mut self, id: RelationId) -> Vec<Direction> {
        let relation = &self.knowledge.relations()[id];
        let mut outputs = relation.outputs.clone();
        if let Some(at) = self.named_output(relation) {
            outputs.swap(0, at);
        }
        let mut directions = Vec::new();
        for (at, output) in outputs.into_iter().enumerate() {
            let own = at == 0 || relation.formulas.is_empty();
            let name = if own {
                relation.name.clone()
            } else {
                self.taken.unique(&format!("{}_{}", relation.name, self.variable(output)))
            };
            directions.push(Direction { relation: id, output, name });
        }
        directions
    }

    /// The index, among the outputs, of the variable before the `=`.
    fn named_output(&self, relation: &Relation) -> Option<usize> {
        let Node::Name(name) = parse_equation(&relation.text).ok()?.lhs.node else { return None };
        relation.outputs.iter().position(|&output| self.variable(output) == name)
    }

    fn function(&mut self, direction: &Direction) {
        let relation = &self.knowledge.relations()[direction.relation];
        let inputs: Vec<String> =
            relation.needs(direction.output).map(|input| atom(self.variable(input))).collect();
        let output = atom(self.variable(direction.output));
        self.line(&format!("function({output}, {}, [{}]).", atom(&direction.name), inputs.join(", ")));
    }

    fn implementations(&mut self, directions: &[Direction]) {
        self.text += "\n% Their code, over values in SI units.\n";
        let mut lost: Vec<(String, String)> = Vec::new();
        for direction in directions {
            let relation = &self.knowledge.relations()[direction.relation];
            match self.code(relation, direction.output) {
                Some(Ok(code)) => {
                    self.line(&format!("implementation({}, {}).", atom(&direction.name), string(&code)));
                }
                Some(Err(why)) => lost.push((why, direction.name.clone())),
                None => {}
            }
        }
        lost.sort_by(|one, other| one.0.cmp(&other.0));
        for group in lost.chunk_by(|one, other| one.0 == other.0) {
            let names: Vec<&str> = group.iter().map(|(_, name)| name.as_str()).collect();
            let why = group.first().map_or("", |(why, _)| why);
            self.losses.push(format!("the formula of {}: {why}", described("relation", &names)));
        }
    }

    /// The code of one output; `None` for structure only, an error with the reason why there is none.
    fn code(&self, relation: &Relation, output: VariableId) -> Option<Result<String, String>> {
        let formula = relation.formula(output)?;
        if relation.condition.is_some() {
            return Some(Err("it holds under a condition, which a fact cannot say".to_owned()));
        }
        let variables = relation.inputs.iter().chain([&output]).map(|&id| self.variable(id));
        if let Some(keyword) = variables.clone().find(|name| KEYWORDS.contains(name)) {
            return Some(Err(format!("`{keyword}` is a word of Python")));
        }
        let name = |symbol: Symbol| format!("{}.v", self.variable(VariableId::from_index(symbol.0 as usize)));
        let expression = statements::expression(formula, &name);
        Some(
            expression
                .map(|text| format!("{}.v = {text}", self.variable(output)))
                .map_err(|what| format!("{what} has no like in it")),
        )
    }

    fn itoms(&mut self) {
        self.text += "\n% What provides variables: itomsOf(variable, [names]).\n";
        for (id, variable) in self.knowledge.variables().enumerate() {
            let names: Vec<String> = match variable.constant {
                Some(value) => vec![format!("{:?}", value.midpoint())],
                None => self
                    .knowledge
                    .carriers(id)
                    .iter()
                    .map(|&signal| itom(&self.knowledge.signals()[signal].name))
                    .collect(),
            };
            if !names.is_empty() {
                self.line(&format!("itomsOf({}, [{}]).", atom(&variable.name), names.join(", ")));
            }
        }
    }
}

/// A name as an atom, in quotes unless it begins in lower case.
fn atom(name: &str) -> String {
    let mut chars = name.chars();
    let is_plain = chars.next().is_some_and(|c| c.is_ascii_lowercase())
        && chars.all(|c| c.is_ascii_alphanumeric() || c == '_');
    if is_plain { name.to_owned() } else { quoted(name, '\'') }
}

/// The name of a signal: an atom, or a string, as topics are.
fn itom(name: &str) -> String {
    if atom(name) == name { name.to_owned() } else { string(name) }
}

fn string(text: &str) -> String {
    quoted(text, '"')
}

fn quoted(text: &str, quote: char) -> String {
    let mut quoted = String::from(quote);
    for c in text.chars() {
        match c {
            '\\' => quoted += "\\\\",
            '\n' => quoted += "\\n",
            '\t' => quoted += "\\t",
            _ if c == quote => quoted.extend(['\\', c]),
            _ if c.is_control() => {
                let _ = write!(quoted, "\\x{:x}\\", u32::from(c));
            }
            _ => quoted.push(c),
        }
    }
    quoted.push(quote);
    quoted
}
