//! Models in parts, for example one for each subsystem: takes out a part with all that it needs, and joins parts again.
//!
//! A repeated description must have the same meaning: blanks, digits (`1.0` and `1`) and units of the same amount may differ.
//! Only a variable may be described in pieces, which complete each other.

mod fields;

use super::change::{Section, function_name};
use super::contract::HEALER;
use super::draft::{
    BodyDraft, ContractDraft, Draft, FusionDraft, NeedDraft, Place, Text, UtilityDraft, VariableDraft,
};
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use fields::{
    Clash, Fields, constant_fields, contract_fields, different, function_fields, fusion_fields, need_fields,
    relation_fields, signal_fields, utility_fields, variable_fields,
};

/// Two parts that contradict each other about one name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Contradiction {
    /// The name in the later part.
    pub place: Place,
    /// The name in the earlier part.
    pub earlier: Place,
    /// The difference, in one line.
    pub message: String,
}

/// Joins parts, in their order; equal descriptions are kept once.
///
/// Places tell the parts apart: for parts from different files, the reader makes the places different. Time: O(n log n) in the
/// elements.
///
/// # Errors
/// Every contradiction between two parts. [`build()`](super::build()) checks the whole.
pub fn join(parts: &[Draft]) -> Result<Draft, Vec<Contradiction>> {
    let mut joint = Joint::default();
    for part in parts {
        joint.add(part);
    }
    let found = joint.ledger.found;
    if found.is_empty() { Ok(joint.whole) } else { Err(found) }
}

/// The part of a model with these names (of variables, constants, functions, relations, signals and needs), and all elements that
/// these refer to.
///
/// A relation brings the variables, constants and functions that it names; a signal brings its variable and the signals that it
/// is derived from; a need brings its variable. A variable brings its signals and needs. Elements stay in file order, so joining
/// parts that cover all names gives the whole. Time: O(n log n) in the length of the draft.
///
/// # Errors
/// The names that are not in the model.
pub fn part(draft: &Draft, names: &[&str]) -> Result<Draft, Vec<String>> {
    let wanted: BTreeSet<&str> = names.iter().copied().collect();
    let known: BTreeSet<&str> = all_names(draft).map(|(_, name)| name).collect();
    let unknown: Vec<String> = wanted.difference(&known).map(|name| (*name).to_string()).collect();
    if !unknown.is_empty() {
        return Err(unknown);
    }
    let index: BTreeMap<(Section, &str), usize> = indexed(draft);
    let mut taken: BTreeSet<(Section, usize)> = BTreeSet::new();
    let mut open: Vec<(Section, usize)> = index
        .iter()
        .filter(|((_, name), _)| wanted.contains(name))
        .map(|((section, _), &at)| (*section, at))
        .collect();
    open.extend(about_variables(draft, &wanted));
    while let Some((section, at)) = open.pop() {
        if taken.insert((section, at)) {
            needed(draft, section, at, |section, name| {
                open.extend(index.get(&(section, name)).map(|&at| (section, at)))
            });
        }
    }
    Ok(taken_out(draft, &taken))
}

fn all_names(draft: &Draft) -> impl Iterator<Item = (Section, &str)> {
    let variables = draft.variables.iter().map(|it| (Section::Variables, it.name.text.as_str()));
    let constants = draft.constants.iter().map(|it| (Section::Constants, it.0.text.as_str()));
    let functions = draft.functions.iter().map(|it| (Section::Functions, function_name(&it.0.text)));
    let relations = draft.relations.iter().map(|it| (Section::Relations, it.name.text.as_str()));
    let signals = draft.signals.iter().map(|it| (Section::Signals, it.name.text.as_str()));
    let fusions = draft.fusions.iter().map(|it| (Section::Fusions, it.name.text.as_str()));
    let needs = draft.needs.iter().map(|it| (Section::Needs, it.variable.text.as_str()));
    let platform = draft.platform.iter().map(|it| (Section::Platform, it.name.text.as_str()));
    let contracts = draft.contracts.iter().map(|it| (Section::Contracts, it.name.text.as_str()));
    let elements = variables.chain(constants).chain(functions).chain(relations).chain(signals);
    elements.chain(fusions).chain(needs).chain(platform).chain(contracts)
}

/// The places of all names in their sections.
fn indexed(draft: &Draft) -> BTreeMap<(Section, &str), usize> {
    let mut next: BTreeMap<Section, usize> = BTreeMap::new();
    let mut index = BTreeMap::new();
    for (section, name) in all_names(draft) {
        let at = next.entry(section).or_default();
        index.entry((section, name)).or_insert(*at);
        *at += 1;
    }
    index
}

/// The signals and needs of these variables.
fn about_variables(draft: &Draft, wanted: &BTreeSet<&str>) -> Vec<(Section, usize)> {
    let is_wanted = |name: Option<&Text>| name.is_some_and(|name| wanted.contains(name.text.as_str()));
    let signals = draft.signals.iter().enumerate().filter(|(_, it)| is_wanted(it.variable.as_ref()));
    let needs = draft.needs.iter().enumerate().filter(|(_, it)| is_wanted(Some(&it.variable)));
    let signals = signals.map(|(at, _)| (Section::Signals, at));
    signals.chain(needs.map(|(at, _)| (Section::Needs, at))).collect()
}

/// Visits every name that an element refers to, with its possible sections.
fn needed<'d>(draft: &'d Draft, section: Section, at: usize, mut visit: impl FnMut(Section, &'d str)) {
    let mut formula = |text: &'d Text| {
        for word in text.text.split(|c: char| !c.is_alphanumeric() && c != '_') {
            visit(Section::Variables, word);
            visit(Section::Constants, word);
            visit(Section::Functions, word);
        }
    };
    match section {
        Section::Variables | Section::Constants => {}
        Section::Functions => draft.functions.iter().skip(at).take(1).for_each(|(_, body)| formula(body)),
        Section::Relations => {
            let Some(relation) = draft.relations.get(at) else { return };
            match &relation.body {
                BodyDraft::Equation(text) => formula(text),
                BodyDraft::Structure { outputs, inputs } => {
                    outputs.iter().chain(inputs).for_each(&mut formula)
                }
                BodyDraft::Specification(specification) => {
                    formula(&relation.name);
                    specification.texts().for_each(&mut formula);
                }
            }
            relation.condition.iter().chain(relation.directions.iter().flatten()).for_each(formula);
            visit(Section::Contracts, &relation.name.text);
            visit(Section::Contracts, HEALER);
        }
        Section::Signals => {
            let Some(signal) = draft.signals.get(at) else { return };
            signal.variable.iter().for_each(|name| visit(Section::Variables, &name.text));
            signal.variable.iter().for_each(|name| visit(Section::Constants, &name.text));
            signal.derived_from.iter().for_each(|name| visit(Section::Signals, &name.text));
            visit(Section::Contracts, &signal.name.text);
        }
        Section::Fusions => {
            let Some(fusion) = draft.fusions.get(at) else { return };
            let outputs = fusion.outputs.iter().flat_map(|it| [&it.value, &it.variable]);
            let states = fusion.states.iter().flat_map(|it| [&it.transition, &it.noise]);
            let inputs = fusion.inputs.iter().flat_map(|it| [&it.measures, &it.noise]);
            outputs.chain(states).chain(inputs).flatten().for_each(&mut formula);
            fusion.states.iter().for_each(|it| formula(&it.name));
            fusion.inputs.iter().for_each(|it| formula(&it.name));
            fusion.inputs.iter().for_each(|it| visit(Section::Signals, &it.name.text));
            fusion.controls.iter().for_each(|(_, signal)| visit(Section::Signals, &signal.text));
            let read = fusion.inputs.iter().map(|it| &it.name).chain(fusion.controls.iter().map(|it| &it.1));
            for name in read {
                let makes = |it: &&FusionDraft| it.outputs.iter().any(|it| it.name.text == name.text);
                let maker = draft.fusions.iter().find(makes);
                maker.iter().for_each(|it| visit(Section::Fusions, &it.name.text));
            }
        }
        Section::Needs => {
            let Some(need) = draft.needs.get(at) else { return };
            visit(Section::Variables, &need.variable.text);
            visit(Section::Constants, &need.variable.text);
            need.signal.iter().chain([&need.variable]).for_each(|name| visit(Section::Contracts, &name.text));
        }
        Section::Platform => {
            draft.platform.iter().skip(at).take(1).for_each(|it| of_contract(it, &mut visit))
        }
        Section::Contracts => {
            draft.contracts.iter().skip(at).take(1).for_each(|it| of_contract(it, &mut visit))
        }
    }
}

/// Visits the names of a contract: its subject, its platform, the parties of its demands, and the observed signals.
fn of_contract<'d>(contract: &'d ContractDraft, mut visit: impl FnMut(Section, &'d str)) {
    let asked = contract.asks.iter().filter_map(|asked| asked.of.as_ref());
    let observed = contract.evidence.iter().flat_map(|(_, text)| text.text.split([' ', ',']));
    let names = asked.chain([&contract.name]).chain(&contract.runs_on).map(|name| name.text.as_str());
    for name in names.chain(observed) {
        [Section::Relations, Section::Signals, Section::Needs, Section::Platform]
            .into_iter()
            .for_each(|section| visit(section, name));
    }
}

fn taken_out(draft: &Draft, taken: &BTreeSet<(Section, usize)>) -> Draft {
    fn kept<T: Clone>(list: &[T], section: Section, taken: &BTreeSet<(Section, usize)>) -> Vec<T> {
        list.iter()
            .enumerate()
            .filter(|(at, _)| taken.contains(&(section, *at)))
            .map(|(_, it)| it.clone())
            .collect()
    }
    Draft {
        variables: kept(&draft.variables, Section::Variables, taken),
        constants: kept(&draft.constants, Section::Constants, taken),
        functions: kept(&draft.functions, Section::Functions, taken),
        relations: kept(&draft.relations, Section::Relations, taken),
        signals: kept(&draft.signals, Section::Signals, taken),
        fusions: kept(&draft.fusions, Section::Fusions, taken),
        needs: kept(&draft.needs, Section::Needs, taken),
        platform: kept(&draft.platform, Section::Platform, taken),
        contracts: kept(&draft.contracts, Section::Contracts, taken),
        utility: draft.utility.clone(),
    }
}

/// The joined parts.
#[derive(Default)]
struct Joint {
    whole: Draft,
    ledger: Ledger,
}

/// The places of names, and the contradictions.
#[derive(Default)]
struct Ledger {
    places: BTreeMap<(Section, String), usize>,
    found: Vec<Contradiction>,
}

impl Joint {
    fn add(&mut self, part: &Draft) {
        let Joint { whole, ledger } = self;
        for draft in &part.variables {
            match ledger.place(Section::Variables, &draft.name.text, whole.variables.len()) {
                None => whole.variables.push(draft.clone()),
                Some(at) => {
                    whole.variables.iter_mut().skip(at).take(1).for_each(|known| ledger.merge(known, draft))
                }
            }
        }
        ledger.add(Section::Constants, &mut whole.constants, &part.constants, |it| &it.0, constant_fields);
        ledger.add(Section::Functions, &mut whole.functions, &part.functions, |it| &it.0, function_fields);
        ledger.add(Section::Relations, &mut whole.relations, &part.relations, |it| &it.name, relation_fields);
        ledger.add(Section::Signals, &mut whole.signals, &part.signals, |it| &it.name, signal_fields);
        ledger.add(Section::Fusions, &mut whole.fusions, &part.fusions, |it| &it.name, fusion_fields);
        ledger.need(&mut whole.needs, &part.needs);
        ledger.add(Section::Platform, &mut whole.platform, &part.platform, |it| &it.name, contract_fields);
        ledger.add(Section::Contracts, &mut whole.contracts, &part.contracts, |it| &it.name, contract_fields);
        match (&whole.utility, &part.utility) {
            (None, other) => whole.utility.clone_from(other),
            (Some(one), Some(other)) => ledger.rate(one, other),
            (Some(_), None) => {}
        }
    }
}

impl Ledger {
    /// The place of a known name; a new name gets the place `next`.
    fn place(&mut self, section: Section, name: &str, next: usize) -> Option<usize> {
        let key = (section, name.to_string());
        let known = self.places.get(&key).copied();
        if known.is_none() {
            self.places.insert(key, next);
        }
        known
    }

    fn add<T: Clone>(
        &mut self,
        section: Section,
        whole: &mut Vec<T>,
        part: &[T],
        name: impl Fn(&T) -> &Text,
        fields: impl Fn(&T) -> Fields,
    ) {
        for element in part {
            let text = name(element);
            let key = if section == Section::Functions { function_name(&text.text) } else { &text.text };
            let Some(at) = self.place(section, key, whole.len()) else {
                whole.push(element.clone());
                continue;
            };
            let Some(known) = whole.get(at) else { continue };
            let clashes = different(&fields(known), &fields(element), |_, _| true);
            self.note(section, name(known), text, &clashes);
        }
    }

    /// Several parts may need one variable, each under its own name.
    fn need(&mut self, whole: &mut Vec<NeedDraft>, part: &[NeedDraft]) {
        let published = |it: &NeedDraft| it.signal.as_ref().map(|name| name.text.clone());
        for need in part {
            let is_same =
                |it: &&NeedDraft| it.variable.text == need.variable.text && published(it) == published(need);
            let Some(known) = whole.iter().find(is_same) else {
                whole.push(need.clone());
                continue;
            };
            let clashes = different(&need_fields(known), &need_fields(need), |_, _| true);
            self.note(Section::Needs, &known.variable, &need.variable, &clashes);
        }
    }

    /// A variable may be described in pieces.
    fn merge(&mut self, known: &mut VariableDraft, other: &VariableDraft) {
        let both_given = |one: &str, other: &str| !one.is_empty() && !other.is_empty();
        let clashes = different(&variable_fields(known), &variable_fields(other), both_given);
        self.note(Section::Variables, &known.name, &other.name, &clashes);
        let VariableDraft { unit, shape, range, max_rate, wraps, properties, .. } = other.clone();
        known.unit = known.unit.take().or(unit);
        known.shape = known.shape.take().or(shape);
        known.range = known.range.take().or(range);
        known.max_rate = known.max_rate.take().or(max_rate);
        known.wraps = known.wraps.take().or(wraps);
        if known.properties.is_empty() {
            known.properties = properties;
        }
    }

    fn rate(&mut self, one: &UtilityDraft, other: &UtilityDraft) {
        let clashes = different(&utility_fields(one), &utility_fields(other), |_, _| true);
        if !clashes.is_empty() {
            let message = format!("two parts rate differently: {}", described(&clashes));
            self.found.push(Contradiction { place: place(other), earlier: place(one), message });
        }
    }

    fn note(&mut self, section: Section, known: &Text, other: &Text, clashes: &[Clash]) {
        if clashes.is_empty() {
            return;
        }
        let (what, name) = (section.singular(), &known.text);
        let message = format!("two parts describe {what} `{name}` differently: {}", described(clashes));
        self.found.push(Contradiction { place: other.place, earlier: known.place, message });
    }
}

fn described(clashes: &[Clash]) -> String {
    let shown = |words: &str| if words.is_empty() { "nothing".to_string() } else { format!("`{words}`") };
    let clash = |(key, one, other): &Clash| format!("{key}: {} and {}", shown(one), shown(other));
    clashes.iter().map(clash).collect::<Vec<_>>().join("; ")
}

fn place(draft: &UtilityDraft) -> Place {
    match draft {
        UtilityDraft::Named(text) | UtilityDraft::Own { at: text, .. } => text.place,
    }
}
