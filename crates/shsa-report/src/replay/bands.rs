//! The bands of a need: all ways of its variable over the whole replay, and the published values.

use super::Part;
use super::picture::{NeedRecord, VariableRecord, WayRecord};
use crate::events::is_accusation;
use shsa_core::engine::EventKind;
use shsa_core::time::Time;
use shsa_drawing::{Axis, Band, Mark, Timeline};
use shsa_format::text::counted;
use std::collections::BTreeSet;

/// The most ways that are drawn, of those that rest on an accused signal and of others: more cannot be told apart in a drawing.
const MOST_ACCUSED: usize = 2;
const MOST_OTHERS: usize = 4;
/// The most marks.
const MOST_MARKS: usize = 12;

pub(super) fn chart(part: &Part<'_>, need: &NeedRecord, variable: &VariableRecord) -> Timeline {
    let known = part.run.engine.knowledge();
    let unit = known.variable(&variable.name).and_then(|id| known.variables()[id].unit.as_ref());
    let shown = |value: f64| unit.map_or(value, |unit| unit.from_si(value));
    let origin = part.origin();
    let band = |way: &WayRecord, is_accused: bool| Band {
        name: way.name.clone(),
        is_accused,
        slices: way.values.slices(origin, shown),
    };
    let accused = accused(part);
    let rests = |way: &&WayRecord| way.rests_on.iter().any(|signal| accused.contains(&**signal));
    let received = || variable.ways.iter().filter(|way| !way.values.is_empty());
    let published = Band {
        name: format!("published as {}", need.signal),
        is_accused: false,
        slices: need.values.slices(origin, shown),
    };
    let bands: Vec<Band> = std::iter::once(published)
        .chain(received().filter(rests).take(MOST_ACCUSED).map(|way| band(way, true)))
        .chain(received().filter(|way| !rests(way)).take(MOST_OTHERS).map(|way| band(way, false)))
        .collect();
    let left_out = received().count() + variable.more_ways + 1 - bands.len();
    let mut notes = vec!["each place holds the least and the most that was said there".to_owned()];
    if left_out > 0 {
        notes.push(format!("{} of knowing {} not drawn", counted(left_out, "more way"), variable.name));
    }
    let unit = unit.map_or(String::new(), |unit| format!(" ({unit})"));
    let seconds = |time: Time| (time - origin).seconds();
    Timeline {
        title: format!("{}: what was said, and what was published", variable.name),
        span: (seconds(part.run.first), seconds(part.run.last)),
        y: Axis { label: format!("{}{unit}", variable.name), ..Axis::default() },
        bands,
        shaded: variable.conflicts.get().iter().map(|each| (seconds(each.from), seconds(each.to))).collect(),
        shade: "two ways of knowing disagree".to_owned(),
        marks: marks(part, need, variable),
        notes,
    }
}

/// The signals that were accused in a run.
fn accused<'r>(part: &Part<'r>) -> BTreeSet<&'r str> {
    let events = part.run.events_with_models().filter(|(_, event)| is_accusation(event));
    events.filter_map(|(known, event)| Some(&*known.signals()[event.signal?].name)).collect()
}

/// Decisions about the need, or about a signal of one of its ways.
fn marks(part: &Part<'_>, need: &NeedRecord, variable: &VariableRecord) -> Vec<Mark> {
    let matters = |signal: &str| variable.ways.iter().any(|way| way.rests_on.iter().any(|it| it == signal));
    part.run
        .events_with_models()
        .filter(|(known, event)| match (event.signal, event.need) {
            (_, Some(id)) => known.needs()[id].signal == need.signal,
            (Some(signal), None) => {
                event.kind != EventKind::Suspected && matters(&known.signals()[signal].name)
            }
            (None, None) => false,
        })
        .take(MOST_MARKS)
        .map(|(_, event)| Mark { at: part.since(event.time), name: event.kind.name().to_owned() })
        .collect()
}
