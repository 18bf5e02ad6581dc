//! The common content of both forms of the thesis's knowledge bases, and its draft.

use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, NeedDraft, PropertyDrafts, RelationDraft, SignalDraft, Text, VariableDraft,
};
use shsa_message::source;
use std::collections::{BTreeMap, BTreeSet};

use super::Taken;
use super::formulas::{self, Candidates};
use super::names::{self, Names};
use super::notes::Notes;
use super::settle;

/// A knowledge base of the thesis.
#[derive(Default)]
pub(super) struct Sketch {
    pub(super) relations: Vec<Sketched>,
    /// Variables, which may occur in no relation.
    pub(super) variables: Vec<Text>,
    /// Constants with their values.
    pub(super) constants: Vec<(Text, Text)>,
    /// Variables with the signals that carry them.
    pub(super) signals: Vec<(Text, Text)>,
    /// The needed variables, with the names under which they are published.
    pub(super) needs: Vec<(Text, Option<Text>)>,
    /// Numbers of variables and relations: the element, the property and the value.
    pub(super) properties: Vec<(Text, Text, Text)>,
    /// Numbers of signals: the signal, the property and the value.
    pub(super) signal_properties: Vec<(Text, Text, Text)>,
    /// Signals with their rates in observations per second.
    pub(super) rates: Vec<(Text, Text)>,
}

/// A relation with its directions.
pub(super) struct Sketched {
    pub(super) name: Text,
    pub(super) directions: Vec<Direction>,
    /// The code for all directions together.
    pub(super) code: Option<Text>,
}

/// An output of a relation.
#[derive(Clone)]
pub(super) struct Direction {
    pub(super) output: Text,
    pub(super) inputs: Vec<Text>,
    /// The code that computes the output.
    pub(super) code: Option<Text>,
    /// The condition of the computation.
    pub(super) constraint: Option<Text>,
}

impl Direction {
    /// The variables that the direction reads besides its output, each once.
    fn reads(&self) -> BTreeSet<&str> {
        self.inputs
            .iter()
            .map(|input| input.text.as_str())
            .filter(|input| *input != self.output.text)
            .collect()
    }
}

/// The draft of a sketch. Time: linear in the sketch, except for names and for the check of translated formulas.
pub(super) fn taken(sketch: Sketch, mut notes: Notes) -> Taken {
    let mut maker = Maker { names: Names::default(), notes: &mut notes, candidates: Vec::new() };
    let mut draft = maker.draft(&sketch);
    let candidates = std::mem::take(&mut maker.candidates);
    if notes.found.iter().all(|found| found.severity != shsa_core::knowledge::Severity::Error) {
        settle::settle(&mut draft, candidates, &mut notes);
    }
    Taken { draft, problems: notes.found, rewritten: notes.rewritten }
}

struct Maker<'n> {
    names: Names,
    notes: &'n mut Notes,
    /// The formulas of each relation of the draft, the best first.
    candidates: Vec<Candidates>,
}

impl Maker<'_> {
    fn draft(&mut self, sketch: &Sketch) -> Draft {
        self.collect(sketch);
        let constants: BTreeSet<&str> = sketch.constants.iter().map(|(name, _)| name.text.as_str()).collect();
        let relations = self.relations(sketch, &constants);
        let vectors: BTreeSet<String> =
            self.candidates.iter().flat_map(|candidates| candidates.vectors.iter().cloned()).collect();
        let mut draft = Draft {
            variables: self.variables(&constants, &vectors),
            constants: sketch
                .constants
                .iter()
                .map(|(name, value)| (self.text(name), Bounds::One(value.clone())))
                .collect(),
            relations,
            signals: self.signals(sketch, &constants),
            needs: self.needs(sketch, &constants),
            ..Draft::default()
        };
        self.properties(sketch, &mut draft);
        draft
    }

    /// Our name of a variable, at its place.
    fn text(&self, name: &Text) -> Text {
        Text { text: self.names.find(&name.text).unwrap_or(&name.text).to_owned(), place: name.place }
    }

    fn collect(&mut self, sketch: &Sketch) {
        let directions = sketch.relations.iter().flat_map(|relation| &relation.directions);
        let of_relations =
            directions.flat_map(|direction| std::iter::once(&direction.output).chain(&direction.inputs));
        let others = sketch.variables.iter().chain(sketch.constants.iter().map(|(name, _)| name));
        let others = others.chain(sketch.signals.iter().map(|(name, _)| name));
        for name in of_relations.chain(others).chain(sketch.needs.iter().map(|(name, _)| name)) {
            self.names.add(name);
        }
        for (name, ours) in self.names.all() {
            if *ours != name.text {
                let message =
                    format!("`{}` cannot be a variable's name in a formula: it becomes `{ours}`", name.text);
                self.notes.warn(name, message, "");
            }
        }
    }

    fn variables(&self, constants: &BTreeSet<&str>, vectors: &BTreeSet<String>) -> Vec<VariableDraft> {
        let free = self.names.all().iter().filter(|(name, _)| !constants.contains(name.text.as_str()));
        free.map(|(name, ours)| VariableDraft {
            name: Text { text: ours.clone(), place: name.place },
            shape: vectors.contains(ours).then(|| Text { text: "vector".to_owned(), place: name.place }),
            ..VariableDraft::default()
        })
        .collect()
    }

    fn signals(&mut self, sketch: &Sketch, constants: &BTreeSet<&str>) -> Vec<SignalDraft> {
        let mut taken = names::Taken::default();
        let mut seen = BTreeSet::new();
        let mut signals = Vec::new();
        for (variable, name) in &sketch.signals {
            if !seen.insert((&variable.text, &name.text)) {
                continue;
            }
            if constants.contains(variable.text.as_str()) {
                let message =
                    format!("`{}` is a constant: its signal `{}` is left out", variable.text, name.text);
                self.notes.warn(name, message, "");
                continue;
            }
            let own = taken.unique(&name.text);
            let source = (own != name.text).then(|| name.clone());
            let found = source.as_ref().map(|source: &Text| source.text.as_str());
            signals.push(SignalDraft {
                source_parts: source::parts(&own, found),
                name: Text { text: own, place: name.place },
                variable: Some(self.text(variable)),
                source,
                ..SignalDraft::default()
            });
        }
        signals
    }

    fn needs(&mut self, sketch: &Sketch, constants: &BTreeSet<&str>) -> Vec<NeedDraft> {
        let mut seen = BTreeSet::new();
        let mut needs = Vec::new();
        for (variable, signal) in &sketch.needs {
            if constants.contains(variable.text.as_str()) || !seen.insert(&variable.text) {
                let what = signal.as_ref().unwrap_or(variable);
                let message =
                    format!("`{}` needs no further name: `{}` is left out", variable.text, what.text);
                self.notes.warn(what, message, "a model publishes a needed variable under one name");
                continue;
            }
            needs.push(NeedDraft {
                variable: self.text(variable),
                signal: signal.clone(),
                ..NeedDraft::default()
            });
        }
        needs
    }

    fn relations(&mut self, sketch: &Sketch, constants: &BTreeSet<&str>) -> Vec<RelationDraft> {
        let mut taken = names::Taken::default();
        let mut relations = Vec::new();
        for sketched in &sketch.relations {
            let mut directions = Vec::new();
            for direction in &sketched.directions {
                if constants.contains(direction.output.text.as_str()) {
                    let output = &direction.output;
                    let message = format!(
                        "`{}` is a constant: `{}` need not compute it",
                        output.text, sketched.name.text
                    );
                    self.notes.warn(output, message, "this direction of the relation is left out");
                } else {
                    directions.push(direction.clone());
                }
            }
            if let ([], Some(code)) = (sketched.directions.as_slice(), &sketched.code) {
                let message =
                    format!("no function belongs to relation `{}`: its code is left out", sketched.name.text);
                self.notes.warn(code, message, "");
            }
            if !directions.is_empty() {
                let named = taken.unique(&sketched.name.text);
                let name = Text { text: named, place: sketched.name.place };
                self.relation(&name, sketched, &directions, &mut taken, &mut relations);
            }
        }
        relations
    }

    /// Adds one relation, or one for each direction when these differ in their inputs or code.
    fn relation(
        &mut self,
        name: &Text,
        sketched: &Sketched,
        directions: &[Direction],
        taken: &mut names::Taken,
        relations: &mut Vec<RelationDraft>,
    ) {
        if let ([first, _, ..], Some(code)) = (directions, &sketched.code)
            && is_one(directions)
        {
            let output = directions.iter().find(|direction| formulas::assigns(code, &direction.output.text));
            let direction = Direction { code: Some(code.clone()), ..output.unwrap_or(first).clone() };
            let candidates = formulas::candidates(self.notes, &self.names, name, &direction);
            self.push(relations, name.clone(), directions, candidates);
            return;
        }
        let own: Vec<Candidates> = directions
            .iter()
            .map(|direction| {
                let code = direction.code.clone().or_else(|| sketched.code.clone());
                formulas::candidates(self.notes, &self.names, name, &Direction { code, ..direction.clone() })
            })
            .collect();
        let all_formulas = own.iter().all(|candidates| !candidates.equations.is_empty());
        if directions.len() == 1 || is_one(directions) && !all_formulas {
            let candidates = if directions.len() == 1 { own.into_iter().next() } else { None };
            self.push(relations, name.clone(), directions, candidates.unwrap_or_default());
            return;
        }
        let mut names = Vec::new();
        for (direction, candidates) in directions.iter().zip(own) {
            let split = taken.unique(&format!("{}_{}", name.text, direction.output.text));
            names.push(split.clone());
            let name = Text { text: split, place: name.place };
            self.push(relations, name, std::slice::from_ref(direction), candidates);
        }
        let message = format!(
            "the directions of relation `{}` have formulas or inputs of their own: it becomes {}",
            name.text,
            names.join(", ")
        );
        self.notes.warn(name, message, "");
    }

    /// Adds a relation that is structure only so far.
    fn push(
        &mut self,
        relations: &mut Vec<RelationDraft>,
        name: Text,
        directions: &[Direction],
        candidates: Candidates,
    ) {
        let outputs = directions.iter().map(|direction| self.text(&direction.output)).collect();
        let mut seen = BTreeSet::new();
        let inputs = directions.iter().flat_map(|direction| &direction.inputs);
        let inputs = inputs.filter(|input| seen.insert(&input.text)).map(|input| self.text(input)).collect();
        let body = BodyDraft::Structure { outputs, inputs };
        let properties = PropertyDrafts::new();
        relations.push(RelationDraft {
            name,
            body,
            directions: None,
            condition: None,
            error: None,
            learn: Vec::new(),
            properties,
        });
        self.candidates.push(candidates);
    }

    fn properties(&mut self, sketch: &Sketch, draft: &mut Draft) {
        let constants: BTreeSet<String> = draft.constants.iter().map(|(name, _)| name.text.clone()).collect();
        let mut places: BTreeMap<String, Vec<&mut PropertyDrafts>> = BTreeMap::new();
        for variable in &mut draft.variables {
            places.entry(variable.name.text.clone()).or_default().push(&mut variable.properties);
        }
        let mut of_signals: BTreeMap<String, &mut SignalDraft> =
            draft.signals.iter_mut().map(|signal| (signal.name.text.clone(), signal)).collect();
        let mut of_relations: BTreeMap<u32, Vec<&mut PropertyDrafts>> = BTreeMap::new();
        for relation in &mut draft.relations {
            of_relations.entry(relation.name.place.from).or_default().push(&mut relation.properties);
        }
        let named: BTreeMap<&str, u32> = sketch
            .relations
            .iter()
            .map(|relation| (relation.name.text.as_str(), relation.name.place.from))
            .collect();
        for (element, key, value) in &sketch.properties {
            let variable = self.names.find(&element.text);
            let found = variable.and_then(|ours| places.get_mut(ours));
            let found = found.or_else(|| of_relations.get_mut(named.get(element.text.as_str())?));
            match found {
                Some(lists) => lists.iter_mut().for_each(|list| list.push((key.clone(), value.clone()))),
                None if variable.is_some_and(|ours| constants.contains(ours)) => {
                    let message = format!("`{}` is a constant, which has no `{}`", element.text, key.text);
                    self.notes.warn(element, message, "it is left out");
                }
                None => self.nothing(element, &key.text),
            }
        }
        for (signal, key, value) in &sketch.signal_properties {
            match of_signals.get_mut(&signal.text) {
                Some(found) => found.properties.push((key.clone(), value.clone())),
                None => self.nothing(signal, &key.text),
            }
        }
        for (signal, rate) in &sketch.rates {
            match of_signals.get_mut(&signal.text) {
                Some(found) => {
                    found.rate = Some(Text { text: format!("{} Hz", rate.text), place: rate.place })
                }
                None => self.nothing(signal, "rate"),
            }
        }
    }

    fn nothing(&mut self, element: &Text, key: &str) {
        let message = format!("nothing here is called `{}`: its `{key}` is left out", element.text);
        self.notes.warn(element, message, "");
    }
}

/// Whether each direction reads all variables of the others, as the directions of one equation do.
fn is_one(directions: &[Direction]) -> bool {
    let all: BTreeSet<&str> =
        directions.iter().flat_map(|direction| &direction.inputs).map(|input| input.text.as_str()).collect();
    directions.iter().all(|direction| {
        let reads = direction.reads();
        let output = direction.output.text.as_str();
        reads.len() + usize::from(all.contains(output)) == all.len()
    })
}
