//! The argument for one guarantee: goals, strategies between them, and solutions at the end.

use super::words;
use shsa_core::assurance::{
    DemandId, Evaluation, EvidenceId, GuaranteeId, Quantifier, System, Tree, Verdict,
};
use shsa_core::knowledge::CONSUMER;
use std::collections::BTreeMap;

/// Deeper nodes stay undeveloped: no reader needs them, and a file from an untrusted source may nest deeply.
pub const MOST_NODES: usize = 1_000;

/// The kind of a node of an argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A claim.
    Goal,
    /// A step from claims to a claim; not all of the claims need to hold.
    Strategy,
    /// Evidence.
    Solution,
}

/// A node of an argument.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Node {
    /// The kind of the node.
    pub kind: Kind,
    /// The text of the node.
    pub text: String,
    /// The present verdict.
    pub state: Verdict,
    /// The indices of the supporting nodes. Supported and supporting nodes form no cycle.
    pub supported_by: Vec<usize>,
    /// Whether no node supports it: a goal that is not met, or that would support itself.
    pub is_undeveloped: bool,
}

/// The argument for one guarantee; the first node is its claim.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Argument {
    /// Without a cycle.
    pub nodes: Vec<Node>,
}

/// The subject of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Element {
    Guarantee(GuaranteeId),
    Demand(DemandId),
    Evidence(EvidenceId),
}

impl Argument {
    /// The argument for a guarantee under an evaluation; `observed` states a piece of evidence in words.
    ///
    /// Time: linear in the number of nodes, at most [`MOST_NODES`].
    #[must_use]
    pub fn new(
        system: &System,
        evaluation: &Evaluation,
        root: GuaranteeId,
        observed: &dyn Fn(EvidenceId) -> String,
    ) -> Argument {
        let mut builder = Builder::new(system, evaluation, observed);
        builder.element(Element::Guarantee(root));
        Argument { nodes: builder.nodes }
    }

    /// The argument for a claim that any of several guarantees supports. The nodes of one system and the same guarantees are the
    /// same, in the same order, under every evaluation; only their kinds and verdicts differ.
    ///
    /// Time: linear in the number of nodes, at most [`MOST_NODES`].
    #[must_use]
    pub fn of_any(
        system: &System,
        evaluation: &Evaluation,
        claim: &str,
        guarantees: &[GuaranteeId],
        observed: &dyn Fn(EvidenceId) -> String,
    ) -> Argument {
        let mut builder = Builder::new(system, evaluation, observed);
        let verdicts = guarantees.iter().map(|&id| evaluation.guarantee(system, id));
        let state = verdicts.min().unwrap_or(Verdict::Refused);
        let top = builder.put(Kind::Goal, claim.to_owned(), state);
        let modes: Vec<Vec<usize>> =
            guarantees.iter().map(|&id| vec![builder.element(Element::Guarantee(id))]).collect();
        builder.nodes[top].is_undeveloped = modes.is_empty();
        if !modes.is_empty() {
            builder.nodes[top].supported_by = builder.one_of(1, modes);
        }
        Argument { nodes: builder.nodes }
    }

    /// The verdict on the claim.
    #[must_use]
    pub fn state(&self) -> Verdict {
        self.nodes.first().map_or(Verdict::Refused, |node| node.state)
    }
}

struct Builder<'a> {
    system: &'a System,
    evaluation: &'a Evaluation,
    observed: &'a dyn Fn(EvidenceId) -> String,
    nodes: Vec<Node>,
    known: BTreeMap<Element, usize>,
    /// The elements that are being developed.
    open: Vec<Element>,
}

impl<'a> Builder<'a> {
    fn new(
        system: &'a System,
        evaluation: &'a Evaluation,
        observed: &'a dyn Fn(EvidenceId) -> String,
    ) -> Builder<'a> {
        let (nodes, known, open) = (Vec::new(), BTreeMap::new(), Vec::new());
        Builder { system, evaluation, observed, nodes, known, open }
    }

    fn put(&mut self, kind: Kind, text: String, state: Verdict) -> usize {
        let node = Node { kind, text, state, supported_by: Vec::new(), is_undeveloped: false };
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    fn undeveloped(&mut self, text: String, state: Verdict) -> usize {
        let node = self.put(Kind::Goal, text, state);
        self.nodes[node].is_undeveloped = true;
        node
    }

    fn element(&mut self, element: Element) -> usize {
        let (text, state) = self.claim(element);
        if self.open.contains(&element) {
            return self.undeveloped(format!("{text} (it would rest on itself)"), state);
        }
        if let Some(&known) = self.known.get(&element) {
            return known;
        }
        if self.nodes.len() >= MOST_NODES {
            return self.undeveloped(format!("{text} (not developed here)"), state);
        }
        let node = match element {
            Element::Evidence(_) => self.evidence(text, state),
            Element::Guarantee(_) | Element::Demand(_) => self.put(Kind::Goal, text, state),
        };
        self.known.insert(element, node);
        self.open.push(element);
        let support = match element {
            Element::Guarantee(id) => self.condition(&self.system.certificates().guarantees[id].when.clone()),
            Element::Demand(id) => self.offers(id),
            Element::Evidence(_) => Vec::new(),
        };
        self.open.pop();
        let is_goal = self.nodes[node].kind == Kind::Goal;
        self.nodes[node].is_undeveloped |= is_goal && support.is_empty();
        self.nodes[node].supported_by = support;
        node
    }

    /// The node of a piece of evidence: a solution when the evidence holds, else an undeveloped goal.
    fn evidence(&mut self, text: String, state: Verdict) -> usize {
        if state == Verdict::Holds {
            self.put(Kind::Solution, text, state)
        } else {
            self.undeveloped(text, state)
        }
    }

    /// The claim of an element and its verdict.
    fn claim(&self, element: Element) -> (String, Verdict) {
        let (rows, system, now) = (self.system.certificates(), self.system, self.evaluation);
        match element {
            Element::Guarantee(id) => {
                let row = &rows.guarantees[id];
                let (who, what) =
                    (&rows.services[row.service].name, words::statement(&rows.scales, &row.statement));
                let text = match (row.statement.service.as_str(), row.name.as_str()) {
                    (CONSUMER, "served") => format!("{who} is given all that it asks"),
                    _ => format!("{who} gives {}: {what}", row.name),
                };
                (text, now.guarantee(system, id))
            }
            Element::Demand(id) => {
                let row = &rows.demands[id];
                let of: Vec<&str> = row.of.iter().map(|&of| rows.services[of].name.as_str()).collect();
                let of = if of.is_empty() { "nobody".to_owned() } else { of.join(", ") };
                let who = &rows.services[row.service].name;
                let what = words::statement(&rows.scales, &row.statement);
                (format!("{who} asks {} of {of}: {what}", row.name), now.demand(system, id))
            }
            Element::Evidence(id) => {
                let state = match now.truth(id) {
                    truth if truth.is_true() => Verdict::Holds,
                    truth if truth.is_false() => Verdict::Refused,
                    _ => Verdict::Open,
                };
                ((self.observed)(id), state)
            }
        }
    }

    /// The nodes that support a condition; all of them are needed.
    fn condition(&mut self, tree: &Tree) -> Vec<usize> {
        match tree {
            Tree::All(parts) if parts.is_empty() => {
                vec![self.put(
                    Kind::Solution,
                    "its maker states it without a condition".to_owned(),
                    Verdict::Holds,
                )]
            }
            Tree::All(parts) => {
                let mut found: Vec<usize> = Vec::new();
                for part in parts.iter().filter(|part| !matches!(part, Tree::All(inner) if inner.is_empty()))
                {
                    let nodes = self.condition(part);
                    found.extend(nodes.into_iter().filter(|node| !found.contains(node)).collect::<Vec<_>>());
                }
                if found.is_empty() { self.condition(&Tree::ALWAYS) } else { found }
            }
            Tree::Any(parts) => self.choice(1, parts),
            Tree::AtLeast(needed, parts) => self.choice(*needed, parts),
            Tree::Demand(id) => vec![self.element(Element::Demand(*id))],
            Tree::Evidence(id) => vec![self.element(Element::Evidence(*id))],
        }
    }

    fn choice(&mut self, needed: u32, parts: &[Tree]) -> Vec<usize> {
        let groups: Vec<Vec<usize>> = parts.iter().map(|part| self.condition(part)).collect();
        self.one_of(needed, groups)
    }

    /// A strategy over groups of nodes, of which `needed` must hold.
    fn one_of(&mut self, needed: u32, groups: Vec<Vec<usize>>) -> Vec<usize> {
        if groups.is_empty() {
            let text = "what is claimed to be redundant shares something here".to_owned();
            return vec![self.undeveloped(text, Verdict::Refused)];
        }
        if let [only] = groups.as_slice() {
            return only.clone();
        }
        let branches: Vec<usize> = groups.into_iter().map(|group| self.together(group)).collect();
        let state = self.reached(needed, &branches);
        let text = if needed == 1 {
            "one of these is enough".to_owned()
        } else {
            format!("{needed} of these are enough")
        };
        let node = self.put(Kind::Strategy, text, state);
        self.nodes[node].supported_by = branches;
        vec![node]
    }

    /// One node for a group of nodes that must all hold.
    fn together(&mut self, group: Vec<usize>) -> usize {
        if let [only] = group.as_slice() {
            return *only;
        }
        let state = group.iter().map(|&node| self.nodes[node].state).max().unwrap_or(Verdict::Holds);
        let node = self.put(Kind::Strategy, "all of these".to_owned(), state);
        self.nodes[node].supported_by = group;
        node
    }

    /// The verdict of a choice: of the `needed` best branches the worst.
    fn reached(&self, needed: u32, branches: &[usize]) -> Verdict {
        let mut states: Vec<Verdict> = branches.iter().map(|&node| self.nodes[node].state).collect();
        states.sort_unstable();
        match needed.checked_sub(1) {
            None => Verdict::Holds,
            Some(at) => states.get(at as usize).copied().unwrap_or(Verdict::Refused),
        }
    }

    /// The nodes of the guarantees that may meet a demand.
    fn offers(&mut self, id: DemandId) -> Vec<usize> {
        let row = self.system.certificates().demands[id].clone();
        let matches: Vec<GuaranteeId> = self.system.matches(id).collect();
        let service = |id: GuaranteeId| self.system.certificates().guarantees[id].service;
        let services = match row.quantifier {
            Quantifier::Any if matches.is_empty() => return Vec::new(),
            Quantifier::Any => vec![None],
            Quantifier::All if row.of.is_empty() => {
                return vec![self.put(
                    Kind::Solution,
                    "nobody has to: it is a constant".to_owned(),
                    Verdict::Holds,
                )];
            }
            Quantifier::All => row.of.iter().copied().map(Some).collect(),
        };
        let mut support = Vec::new();
        for of in services {
            let own = matches.iter().copied().filter(|&id| of.is_none_or(|of| service(id) == of));
            let own: Vec<GuaranteeId> = own.collect();
            let groups =
                own.into_iter().map(|id| vec![self.element(Element::Guarantee(id))]).collect::<Vec<_>>();
            match groups.is_empty() {
                true => support.push(
                    self.undeveloped("one of them guarantees nothing of it".to_owned(), Verdict::Refused),
                ),
                false => support.extend(self.one_of(1, groups)),
            }
        }
        support
    }
}
