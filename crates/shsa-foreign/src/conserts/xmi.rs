//! The `.model` files of safeTbox: one certificate per configuration; references are paths of positions.

use super::raw::{Promise, Raw, text};
use super::statement;
use super::xml::{self, Element};
use shsa_core::knowledge::{Place, Text};
use shsa_model::reader::Reader;

/// Reads the certificates of all configurations.
pub(super) fn read(reader: &mut Reader, source: &str) -> Vec<Raw> {
    let Some(root) = xml::read(reader, source) else { return Vec::new() };
    let system = name_of(&root).to_owned();
    let configurations: Vec<&Element> = root.all("configurations").collect();
    if configurations.is_empty() {
        reader.note(root.place, "no configuration", "a `.model` file has `configurations` with a `conSert`");
    }
    let several = configurations.len() > 1;
    let mut all = Vec::new();
    for (at, element) in configurations.into_iter().enumerate() {
        let name = if several { format!("{system}/{}", name_of(element)) } else { system.clone() };
        all.push(configuration(reader, at, element, name));
    }
    all
}

fn name_of(element: &Element) -> &str {
    element.get("name").map_or("", |name| name.text.as_str())
}

fn configuration(reader: &mut Reader, at: usize, element: &Element, name: String) -> Raw {
    let mut raw = Raw { name, ..Raw::default() };
    let path = format!("//@configurations.{at}/@conSert");
    for consert in element.all("conSert") {
        let id = |kind: &str, at: usize, place: Place| text(format!("{path}/@{kind}.{at}"), place);
        for (kind, promises) in [("guarantees", &mut raw.guarantees), ("demands", &mut raw.demands)] {
            let all = consert.all(kind).enumerate();
            promises.extend(all.map(|(at, element)| promise(id(kind, at, element.place), element)));
        }
        for (at, element) in consert.all("runtimeEvidence").enumerate() {
            let within = element.get("description").and_then(|words| statement::bound(&words.text));
            let within = within.map(|(_, range, _)| range);
            let id = id("runtimeEvidence", at, element.place);
            raw.evidence.push((id, name_of(element).to_owned(), within));
        }
        for (at, element) in consert.all("gates").enumerate() {
            let kind = element.get("gateType").map_or("AND", |kind| kind.text.as_str());
            if !matches!(kind, "AND" | "OR") {
                reader.note(element.place, &format!("`{kind}` is no type of a gate"), "`AND` or `OR`");
            }
            raw.gates.push((id("gates", at, element.place), kind != "OR"));
        }
        for element in consert.all("guaranteePropagations") {
            match (element.get("sourceElement"), element.get("targetElement")) {
                (Some(from), Some(to)) => raw.arrows.push((from.clone(), to.clone())),
                _ => reader.note(
                    element.place,
                    "an arrow without an end",
                    "give sourceElement and targetElement",
                ),
            }
        }
        let invariant = consert.all("invariant").next();
        raw.invariant = invariant.map(|element| text(format!("{path}/@invariant"), element.place));
    }
    raw.provided = services(element, "providedServices", "guarantees");
    raw.required = services(element, "requiredServices", "demands");
    raw
}

fn services(element: &Element, kind: &str, key: &str) -> Vec<(String, Vec<Text>)> {
    let read = |service: &Element| {
        let of = service.all("functionalServiceType").next().map_or("", name_of).to_owned();
        let list = service.get(key);
        let names =
            list.into_iter().flat_map(|list| list.text.split_whitespace().map(|it| text(it, list.place)));
        (of, names.collect())
    };
    element.all(kind).map(read).collect()
}

fn promise(id: Text, element: &Element) -> Promise {
    let level = element.all("integrityLevel").next();
    let level = level.and_then(|level| level.get("asilLevel")).and_then(|level| level.text.split_once('_'));
    let level = level.map(|(scale, level)| (scale.to_owned(), level.to_owned()));
    let property = |it: &Element| {
        let mode = it.all("safetyPropertyType").next().and_then(|kind| statement::failure(name_of(kind)));
        it.all("refinement").next().map(|words| statement::property(name_of(words), mode))
    };
    let properties = element.all("safetyProperties").filter_map(property).collect();
    Promise { id, name: name_of(element).to_owned(), level, properties }
}
