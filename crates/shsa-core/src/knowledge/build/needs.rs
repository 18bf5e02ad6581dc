//! Checks needs, and whether each of them can be served at all.

use super::learning::Learning;
use super::problems::Problems;
use super::quantity::{self, Kind};
use super::variables::Variables;
use crate::knowledge::draft::{NeedDraft, Place, Source, Text};
use crate::knowledge::index::Index;
use crate::knowledge::rows::Rows;
use crate::knowledge::{
    ISOLATIONS, Id, IdVec, KnowledgeBase, Need, NeedId, RelationId, Signal, SignalId, Switching, VariableId,
    WhenUnsure, integrity_level,
};
use crate::time::Span;
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::format;
use alloc::vec::Vec;

/// A need whose variable no rated signal carries accepts values of this age.
const UNRATED_AGE: Span = Span::from_millis(1_000);
/// The smallest default age: three periods of a 10 Hz sensor, the usual rate of slow sensors.
const LEAST_AGE: Span = Span::from_millis(300);

/// Where a need is declared, and its variable.
pub(super) struct Needed {
    at: Place,
    variable: VariableId,
}

/// Reads needs; a need of an unknown variable is left out.
pub(super) fn build(
    problems: &mut Problems,
    source: &mut dyn Source,
    variables: &Variables,
    signals: &IdVec<SignalId, Signal>,
) -> (IdVec<NeedId, Need>, Vec<Needed>) {
    let mut needs: IdVec<NeedId, Need> = IdVec::new();
    let mut published = Vec::new();
    let mut needed = Vec::new();
    let ages = usual_ages(signals);
    source.needs(&mut |draft| {
        draft.signal.iter().for_each(|name| problems.printable(name));
        if let Some(need) = need(problems, draft, variables, &ages) {
            needed.push(Needed { at: draft.variable.place, variable: need.variable });
            published.push(Place::from(draft.signal.as_ref().unwrap_or(&draft.variable)));
            needs.push(need);
        }
    });
    check_published(problems, &needs, &published, signals);
    (needs, needed)
}

/// Reports needs that are published under the name of another need or of a signal.
fn check_published(
    problems: &mut Problems,
    needs: &IdVec<NeedId, Need>,
    published: &[Place],
    signals: &IdVec<SignalId, Signal>,
) {
    let name = |id: NeedId| needs[id].signal.as_str();
    let index = Index::new(needs.len(), name);
    let mut own = IdVec::filled(needs.len(), |_: NeedId| false);
    let mut read: IdVec<NeedId, Option<&str>> = IdVec::filled(needs.len(), |_| None);
    for signal in signals {
        if let Some(id) = index.find(&signal.name, name) {
            own[id] = true;
        }
        if let Some(id) = index.find(signal.topic(), name) {
            read[id] = Some(&signal.name);
        }
    }
    for (id, &at) in needs.ids().zip(published) {
        let name = name(id);
        if index.find(name, |id| needs[id].signal.as_str()) != Some(id) {
            let message = format!("two needs are published as `{name}`");
            problems.error(at, message, "give each need a name of its own");
        } else if own[id] {
            let message = format!("`{name}` is also the name of a signal");
            let help = "where the failed source may still speak, publish under another name";
            problems.warn(at, message, help);
        } else if let Some(signal) = read[id] {
            let message = format!("signal `{signal}` reads `{name}`, which this need publishes");
            let help = "a substitute is no evidence: leave that signal out, or publish elsewhere";
            problems.error(at, message, help);
        }
    }
}

/// Reports the needs that no signal, constant or chain of relations provides even when everything is healthy.
///
/// `undecided`: variables that invalid relations name; a correction may make them providable.
pub(super) fn check_providable(
    problems: &mut Problems,
    needed: &[Needed],
    knowledge: &KnowledgeBase,
    undecided: &BTreeSet<VariableId>,
) {
    let known = providable(knowledge, undecided, None);
    for Needed { at, variable } in needed {
        let name = &knowledge.variables()[*variable].name;
        if knowledge.learned().iter().any(|it| it.variable == *variable) {
            let help = "need what its relation computes, or take the variable out of `learn`";
            problems.error(*at, format!("`{name}` is learned, and what is learned is not published"), help);
        } else if !known[*variable] {
            let help = "add a signal that carries it, or a relation whose inputs are provided";
            problems.error(*at, format!("nothing can provide `{name}`"), help);
        }
    }
}

/// Warns of learned variables whose relation has no values, as nothing provides one of its other variables.
///
/// `undecided`: variables that invalid relations name; a correction may make them providable.
pub(super) fn check_fitted(
    problems: &mut Problems,
    learning: &[Learning],
    knowledge: &KnowledgeBase,
    undecided: &BTreeSet<VariableId>,
) {
    for Learning { name, variable, relation } in learning {
        // What only this relation provides rests on the learned variable itself.
        let known = providable(knowledge, undecided, Some(*relation));
        let fitted =
            knowledge.learned().iter().find(|it| (it.variable, it.relation) == (*variable, *relation));
        let symbols = fitted.map(|it| it.formula.symbols()).unwrap_or_default();
        let mut read = symbols.into_iter().map(|it| VariableId::from_index(it.0 as usize));
        if let Some(missing) = read.find(|id| known.find(*id) == Some(&false)) {
            let missing = &knowledge.variables()[missing].name;
            let message = format!("`{}` is never learned: nothing can provide `{missing}`", name.text);
            problems.warn(
                name,
                message,
                "add a signal that carries it, or a relation whose inputs are provided",
            );
        }
    }
}

/// The variables that are provided, given, or computable from these, but for one relation: the least fixpoint.
///
/// Time and space: linear in the edges of the relations.
pub(super) fn providable(
    knowledge: &KnowledgeBase,
    given: &BTreeSet<VariableId>,
    without: Option<RelationId>,
) -> IdVec<VariableId, bool> {
    let variables = knowledge.variables();
    let mut known = IdVec::filled(variables.len(), |id| knowledge.is_provided(id) || given.contains(&id));
    let mut missing = IdVec::filled(knowledge.relations().len(), |id| match without {
        Some(out) if out == id => usize::MAX,
        _ => knowledge.relations()[id].inputs.len(),
    });
    let inputs = knowledge.relations().enumerate().map(|(id, relation)| (id, relation.inputs.as_slice()));
    let read = inputs.flat_map(|(id, inputs)| inputs.iter().map(move |&input| (input, id)));
    let readers = Rows::grouped(variables.len(), read);
    let mut open: Vec<VariableId> = variables.ids().filter(|&id| known[id]).collect();
    let mut ready: Vec<_> = knowledge.relations().ids().filter(|&id| missing[id] <= 1).collect();
    loop {
        while let Some(id) = ready.pop() {
            for &output in &knowledge.relations()[id].outputs {
                let complete =
                    missing[id] == 0 || knowledge.relations()[id].inputs.binary_search(&output).is_ok();
                if complete && !known[output] {
                    known[output] = true;
                    open.push(output);
                }
            }
        }
        let Some(variable) = open.pop() else { return known };
        for &id in readers.row(variable) {
            missing[id] -= 1;
            if missing[id] <= 1 {
                ready.push(id);
            }
        }
    }
}

fn need(
    problems: &mut Problems,
    draft: &NeedDraft,
    variables: &Variables,
    ages: &BTreeMap<VariableId, Span>,
) -> Option<Need> {
    let variable = variables.look_up(problems, &draft.variable);
    let unit = variable.and_then(|id| variables.list[id].unit.as_ref());
    let max_width = draft.max_width.as_ref();
    let usual = Switching::default();
    let mut time = |text: Option<&Text>| text.and_then(|text| quantity::span(problems, text));
    let max_age = time(draft.max_age.as_ref());
    let hold = time(draft.hold.as_ref()).unwrap_or(usual.hold);
    let probation = time(draft.probation.as_ref()).unwrap_or(usual.probation);
    let blend = time(draft.blend.as_ref()).unwrap_or(usual.blend);
    let hysteresis = draft.hysteresis.as_ref().and_then(|text| share(problems, text));
    let max_width = max_width.and_then(|text| width(problems, text, unit));
    let integrity = draft.integrity.as_ref().and_then(|text| integrity(problems, text));
    let min_rate_hz = draft.min_rate.as_ref().and_then(|text| quantity::frequency(problems, text));
    let when_unsure = draft.when_unsure.as_ref().and_then(|text| unsure(problems, text));
    let is_isolated = draft.isolation.as_ref().is_some_and(|text| isolation(problems, text));
    let variable = variable?;
    let healed = || format!("/healed/{}", draft.variable.text);
    Some(Need {
        variable,
        signal: draft.signal.as_ref().map_or_else(healed, |text| text.text.clone()),
        max_age: max_age.or_else(|| ages.get(&variable).copied()).unwrap_or(UNRATED_AGE),
        max_width,
        integrity,
        min_rate_hz,
        // Without a largest width, readers may ignore the bounds and use the middle, which is wrong while one source is faulty.
        when_unsure: when_unsure.unwrap_or(match max_width {
            Some(_) => WhenUnsure::Hull,
            None => WhenUnsure::Unstated,
        }),
        switching: Switching { hold, probation, blend, hysteresis: hysteresis.unwrap_or(usual.hysteresis) },
        is_isolated,
    })
}

/// The longest silence of the fastest rated signal of a variable, and at least [`LEAST_AGE`].
fn usual_ages(signals: &IdVec<SignalId, Signal>) -> BTreeMap<VariableId, Span> {
    let mut ages = BTreeMap::new();
    for signal in signals {
        let Some(silence) = signal.timeout else { continue };
        let age = ages.entry(signal.variable).or_insert(Span::MAX);
        *age = silence.max(LEAST_AGE).min(*age);
    }
    ages
}

fn width(problems: &mut Problems, text: &Text, unit: Option<&crate::unit::Unit>) -> Option<f64> {
    let width = quantity::quantity(problems, text, unit, Kind::Difference)?;
    if width <= 0.0 {
        problems.error(text, "a largest width is above 0", "leave `max_width` away when every width will do");
        return None;
    }
    Some(width)
}

fn share(problems: &mut Problems, text: &Text) -> Option<f64> {
    let share = quantity::number(problems, text)?;
    if share < 0.0 {
        problems.error(text, format!("`{}` is negative", text.text), "write a share like `5 %` or `0.05`");
        return None;
    }
    Some(share)
}

fn integrity(problems: &mut Problems, text: &Text) -> Option<char> {
    if integrity_level(&text.text).is_some() {
        return text.text.chars().next();
    }
    let message = format!("`{}` is no integrity level", text.text);
    problems.error(text, message, "write `A`, `B`, `C` or `D`, the highest");
    None
}

fn unsure(problems: &mut Problems, text: &Text) -> Option<WhenUnsure> {
    let found = WhenUnsure::ALL.into_iter().find(|choice| choice.name() == text.text);
    if found.is_none() {
        let message =
            format!("`{}` is nothing that can be done when it is not known which source lies", text.text);
        problems.error(text, message, "write `hull`, `last` or `withhold`");
    }
    found
}

/// Whether substitutes are computed in processes of their own.
fn isolation(problems: &mut Problems, text: &Text) -> bool {
    let found = ISOLATIONS.into_iter().find(|(name, _)| *name == text.text);
    if found.is_none() {
        let message = format!("`{}` is no place where substitutes are computed", text.text);
        problems.error(text, message, "write `process` or `engine`, which is usual");
    }
    found.is_some_and(|(_, is_isolated)| is_isolated)
}
