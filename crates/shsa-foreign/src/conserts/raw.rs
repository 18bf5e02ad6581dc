//! A certificate as a file writes it: by names, in any order; conditions are arrows between the names.

use shsa_core::assurance::{
    Certificates, Demand, DemandId, Evidence, EvidenceId, Guarantee, MAX_DEPTH, Quantifier, Service,
    ServiceKind, Tree,
};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Place, Text};
use shsa_core::statement::{Level, Property, Scales, Statement};
use shsa_model::reader::Reader;
use std::collections::BTreeMap;

/// The most nodes in the conditions of a certificate; a gate counts at each use.
const MAX_NODES: usize = 100_000;

/// The content of a file about one certificate. All ids share one name space.
#[derive(Default)]
pub(super) struct Raw {
    pub(super) name: String,
    pub(super) guarantees: Vec<Promise>,
    pub(super) demands: Vec<Promise>,
    pub(super) evidence: Vec<(Text, String, Option<Interval>)>,
    /// The gates by id; `true` when all inputs must hold, `false` when one is enough.
    pub(super) gates: Vec<(Text, bool)>,
    /// Source and target.
    pub(super) arrows: Vec<(Text, Text)>,
    pub(super) provided: Vec<(String, Vec<Text>)>,
    pub(super) required: Vec<(String, Vec<Text>)>,
    /// The condition of all guarantees.
    pub(super) invariant: Option<Text>,
}

/// A guarantee or a demand.
pub(super) struct Promise {
    pub(super) id: Text,
    pub(super) name: String,
    pub(super) level: Option<(String, String)>,
    pub(super) properties: Vec<Property>,
}

#[derive(Clone, Copy)]
enum Node {
    Guarantee,
    Demand(DemandId),
    Evidence(EvidenceId),
    Gate(bool),
}

/// The conditions of a certificate.
struct Conditions<'r> {
    nodes: BTreeMap<String, Node>,
    /// The sources of the arrows to a node.
    from: BTreeMap<&'r str, Vec<&'r Text>>,
    left: usize,
}

impl Raw {
    /// The rows of one service. Undefined names are reported and left out; in a condition they never hold.
    pub(super) fn certificates(&self, reader: &mut Reader) -> Certificates {
        let mut rows = Certificates::default();
        let service = rows.services.push(Service { name: self.name.clone(), kind: ServiceKind::Application });
        let mut nodes = BTreeMap::new();
        for (id, name, within) in &self.evidence {
            let row = Evidence { name: name.clone(), service, within: *within, max_age: None };
            define(reader, &mut nodes, id, Node::Evidence(rows.evidence.push(row)));
        }
        for promise in &self.demands {
            let of = self.types(&self.required, promise).next().unwrap_or_default();
            let statement = promise.statement(reader, &rows.scales, of);
            let (name, quantifier) = (promise.name.clone(), Quantifier::Any);
            let row = Demand { name, service, statement, of: Vec::new(), quantifier };
            define(reader, &mut nodes, &promise.id, Node::Demand(rows.demands.push(row)));
        }
        self.gates.iter().for_each(|(id, all)| define(reader, &mut nodes, id, Node::Gate(*all)));
        self.guarantees.iter().for_each(|it| define(reader, &mut nodes, &it.id, Node::Guarantee));
        self.check_services(reader);
        let mut conditions = Conditions { nodes, from: BTreeMap::new(), left: MAX_NODES };
        for (from, to) in &self.arrows {
            conditions.arrow(reader, from, to, self.invariant.as_ref());
        }
        let invariant = self.invariant.as_ref().map(|id| conditions.leading_to(reader, id, true, 0));
        for promise in &self.guarantees {
            let own = conditions.leading_to(reader, &promise.id, true, 0);
            let when = invariant.clone().map_or(own.clone(), |invariant| Tree::All(vec![invariant, own]));
            let types: Vec<&str> = self.types(&self.provided, promise).collect();
            for of in if types.is_empty() { vec![""] } else { types } {
                let statement = promise.statement(reader, &rows.scales, of);
                rows.guarantees.push(Guarantee {
                    name: promise.name.clone(),
                    service,
                    statement,
                    when: when.clone(),
                });
            }
        }
        rows
    }

    /// The types of the services that name a promise.
    fn types<'r>(
        &self,
        services: &'r [(String, Vec<Text>)],
        promise: &Promise,
    ) -> impl Iterator<Item = &'r str> + use<'r> {
        let id = promise.id.text.clone();
        let names = move |(_, names): &&(String, Vec<Text>)| names.iter().any(|name| name.text == id);
        services.iter().filter(names).map(|(of, _)| of.as_str())
    }

    /// Names that a service takes and nothing defines: whoever relies on the service gets them from nobody.
    fn check_services(&self, reader: &mut Reader) {
        let mut check = |services: &[(String, Vec<Text>)], known: &[Promise], what: &str| {
            for name in services.iter().flat_map(|(_, names)| names) {
                if !known.iter().any(|promise| promise.id.text == name.text) {
                    let help = format!("write it under `{what}s`, or take it off this service");
                    reader.warn(name.place, &format!("no {what} `{}` is defined", name.text), &help);
                }
            }
        };
        check(&self.provided, &self.guarantees, "guarantee");
        check(&self.required, &self.demands, "demand");
    }
}

fn define(reader: &mut Reader, nodes: &mut BTreeMap<String, Node>, id: &Text, node: Node) {
    if nodes.insert(id.text.clone(), node).is_some() {
        let help = "evidence, demands, guarantees and gates share one name space";
        reader.note(id.place, &format!("`{}` is defined twice", id.text), help);
    }
}

impl Promise {
    fn statement(&self, reader: &mut Reader, scales: &Scales, of: &str) -> Statement {
        let level = self.level.as_ref().and_then(|(scale, level)| {
            let found: Option<Level> = scales.level(scale, level);
            if found.is_none() {
                reader.note(self.id.place, &format!("no level {level} of {scale}"), "such as ASIL_D");
            }
            found
        });
        Statement { service: of.to_owned(), level, properties: self.properties.clone() }
    }
}

impl<'r> Conditions<'r> {
    fn arrow(&mut self, reader: &mut Reader, from: &'r Text, to: &'r Text, invariant: Option<&Text>) {
        let starts = self.nodes.get(&from.text).is_some_and(|node| !matches!(node, Node::Guarantee));
        let ends = matches!(self.nodes.get(&to.text), Some(Node::Guarantee | Node::Gate(_)));
        let ends = ends || invariant.is_some_and(|id| id.text == to.text);
        let help = "a condition leads from evidence, a demand or a gate to a gate or a guarantee";
        if !starts {
            let message = format!("no evidence, demand or gate `{}` is defined", from.text);
            reader.note(from.place, &message, help);
        }
        if !ends {
            reader.note(to.place, &format!("no gate or guarantee `{}` is defined", to.text), help);
        }
        // A condition with an undefined name cannot hold: the arrow stays.
        self.from.entry(&to.text).or_default().push(from);
    }

    /// The condition of a node: all of its sources, or one of them.
    fn leading_to(&mut self, reader: &mut Reader, node: &Text, all: bool, depth: u32) -> Tree {
        let from = self.from.get(node.text.as_str()).cloned().unwrap_or_default();
        let mut parts = Vec::new();
        for leaf in from {
            if depth + 1 >= MAX_DEPTH || self.left == 0 {
                self.left = 0;
                let help = "a gate must not lead to itself, by whatever way";
                reader.note(leaf.place, &format!("the condition of `{}` never ends", node.text), help);
                return Tree::Any(Vec::new());
            }
            self.left -= 1;
            parts.push(match self.nodes.get(&leaf.text).copied() {
                Some(Node::Demand(id)) => Tree::Demand(id),
                Some(Node::Evidence(id)) => Tree::Evidence(id),
                Some(Node::Gate(all)) => self.leading_to(reader, leaf, all, depth + 1),
                Some(Node::Guarantee) | None => Tree::Any(Vec::new()),
            });
        }
        match (parts.len(), all) {
            (1, _) => parts.remove(0),
            (_, true) => Tree::All(parts),
            (_, false) => Tree::Any(parts),
        }
    }
}

/// A text at a place.
pub(super) fn text(text: impl Into<String>, place: Place) -> Text {
    Text { text: text.into(), place }
}
