//! Knowledge bases as ontologies.

use super::super::losses;
use super::super::prolog::Written;
use super::{OWN, RDFS, SCHEMAS, SOSA, SSN};
use oxrdf::vocab::rdf;
use oxrdf::{Literal, NamedNode, Term, Triple};
use oxttl::TurtleSerializer;
use oxttl::turtle::WriterTurtleSerializer;
use shsa_core::expression::{Formula, Symbol, is_reserved};
use shsa_core::knowledge::{Cause, KnowledgeBase, Relation, Shape, Signal, Variable, VariableId};
use std::fmt::Write;
use std::io;

const SCHEMA: &str = SCHEMAS[0];
/// What an ontology keeps of all that [`losses::of`] names.
const KEPT: [&str; 2] = ["the unit", "what is shared"];

/// Writes a knowledge base as an ontology in Turtle. Time: linear in the knowledge base.
///
/// # Errors
/// None is known: the text goes into memory.
pub fn write(knowledge: &KnowledgeBase) -> io::Result<Written> {
    let mut serializer = TurtleSerializer::new();
    for (prefix, iri) in [("rdfs", RDFS), ("schema", SCHEMA), ("shsa", OWN), ("sosa", SOSA), ("ssn", SSN)] {
        serializer = serializer.with_prefix(prefix, iri).map_err(io::Error::other)?;
    }
    let mut writer = Writer { knowledge, to: serializer.for_writer(Vec::new()) };
    for variable in knowledge.variables().iter() {
        writer.variable(variable)?;
    }
    for (id, signal) in knowledge.signals().enumerate() {
        // A computed signal is lost with its fusion.
        if !knowledge.is_computed(id) {
            writer.signal(signal)?;
        }
    }
    for cause in knowledge.causes().iter() {
        writer.cause(cause)?;
    }
    for relation in knowledge.relations().iter() {
        for &output in &relation.outputs {
            writer.procedure(relation, output)?;
        }
    }
    let text = String::from_utf8(writer.to.finish()?).map_err(io::Error::other)?;
    let mut losses = losses::of(knowledge, |what| !KEPT.contains(&what));
    let conditions = knowledge.relations().iter().filter(|relation| relation.condition.is_some());
    let own = knowledge.relations().iter().filter(|relation| calls_own_function(&relation.text));
    losses.extend(losses::one(
        "the equation with an own function",
        "relation",
        own.map(|it| it.name.as_str()).collect(),
    ));
    let more = knowledge.relations().iter().filter(|relation| reads_more_than_its_equation(relation));
    losses.extend(losses::one(
        "the equation under a condition on other variables",
        "relation",
        more.map(|it| it.name.as_str()).collect(),
    ));
    losses.extend(losses::one("the condition", "relation", conditions.map(|it| it.name.as_str()).collect()));
    Ok(Written { text, losses })
}

struct Writer<'k> {
    knowledge: &'k KnowledgeBase,
    to: WriterTurtleSerializer<Vec<u8>>,
}

impl Writer<'_> {
    fn say(&mut self, subject: &NamedNode, predicate: NamedNode, object: impl Into<Term>) -> io::Result<()> {
        self.to.serialize_triple(&Triple::new(subject.clone(), predicate, object))
    }

    /// The first triples of an element.
    fn begin(&mut self, subject: &NamedNode, class: &str, name: &str) -> io::Result<()> {
        self.say(subject, rdf::TYPE.into_owned(), word(SOSA, class))?;
        self.say(subject, word(RDFS, "label"), Literal::new_simple_literal(name))
    }

    fn variable(&mut self, variable: &Variable) -> io::Result<()> {
        let subject = named("variable", &variable.name);
        self.begin(&subject, "ObservableProperty", &variable.name)?;
        if let Some(unit) = variable.unit.as_ref().map(ToString::to_string).filter(|unit| unit != "1") {
            self.say(&subject, word(SCHEMA, "unitText"), Literal::new_simple_literal(unit))?;
        }
        if variable.shape == Shape::Vector {
            self.say(&subject, word(OWN, "shape"), Literal::new_simple_literal("vector"))?;
        }
        if let Some(value) = variable.constant {
            let value = variable.unit.as_ref().map_or(value, |unit| unit.from_si_interval(value));
            self.say(&subject, word(SCHEMA, "value"), Literal::from(value.midpoint()))?;
        }
        Ok(())
    }

    fn signal(&mut self, signal: &Signal) -> io::Result<()> {
        let subject = named("signal", &signal.name);
        self.begin(&subject, "Sensor", &signal.name)?;
        let observed = self.named(signal.variable);
        self.say(&subject, word(SOSA, "observes"), observed)
    }

    fn cause(&mut self, cause: &Cause) -> io::Result<()> {
        let subject = named("cause", &cause.name);
        self.begin(&subject, "Platform", &cause.name)?;
        for &signal in &cause.signals {
            let hosted = named("signal", &self.knowledge.signals()[signal].name);
            self.say(&subject, word(SOSA, "hosts"), hosted)?;
        }
        Ok(())
    }

    /// One output of a relation.
    fn procedure(&mut self, relation: &Relation, output: VariableId) -> io::Result<()> {
        let name = format!("{}:{}", relation.name, self.knowledge.variables()[output].name);
        let subject = named("relation", &name);
        self.begin(&subject, "Procedure", &relation.name)?;
        for input in relation.needs(output) {
            let input = self.named(input);
            self.say(&subject, word(SSN, "hasInput"), input)?;
        }
        let output = self.named(output);
        self.say(&subject, word(SSN, "hasOutput"), output)?;
        let is_whole = !calls_own_function(&relation.text) && !reads_more_than_its_equation(relation);
        if !relation.formulas.is_empty() && is_whole {
            let equation = Literal::new_simple_literal(&relation.text);
            self.say(&subject, word(OWN, "equation"), equation)?;
        }
        Ok(())
    }

    fn named(&self, variable: VariableId) -> NamedNode {
        named("variable", &self.knowledge.variables()[variable].name)
    }
}

/// Whether an equation calls a function of the model, which an ontology lacks.
fn calls_own_function(equation: &str) -> bool {
    let before = equation.match_indices('(').filter_map(|(at, _)| equation.get(..at));
    let called =
        before.filter_map(|text| text.trim_end().rsplit(|c: char| !c.is_alphanumeric() && c != '_').next());
    called.filter(|name| !name.is_empty()).any(|name| !is_reserved(name))
}

/// Whether the condition reads variables that are not in the equation: from the equation alone, nobody would know that they are needed.
fn reads_more_than_its_equation(relation: &Relation) -> bool {
    let read: Vec<Symbol> = relation.condition.iter().flat_map(Formula::symbols).collect();
    relation.outputs.iter().any(|&output| {
        let computed = relation.formula(output).map(Formula::symbols).unwrap_or_default();
        read.iter().any(|symbol| *symbol != output.symbol() && !computed.contains(symbol))
    })
}

/// A word of a vocabulary.
fn word(vocabulary: &str, word: &str) -> NamedNode {
    NamedNode::new_unchecked(format!("{vocabulary}{word}"))
}

/// The name of an element: each byte that may not stand in an IRI is written as `%` and two digits.
fn named(kind: &str, name: &str) -> NamedNode {
    let mut iri = format!("urn:shsa:{kind}:");
    for byte in name.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~/:@".contains(&byte) {
            iri.push(char::from(byte));
        } else {
            let _ = write!(iri, "%{byte:02X}");
        }
    }
    NamedNode::new_unchecked(iri)
}
