//! Values of JSON: numbers, lists, stamps, and what is compared with a text.

use super::members::Members;
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_message::json::{Kind, Place, descend, elements, unescaped};
use shsa_message::number::float;
use shsa_message::path::{Step, is_text};
use shsa_message::stamp as stamps;

/// The place of the member at these steps in a JSON text.
pub(super) fn at(text: &str, steps: &[Step]) -> Option<Place> {
    let mut members = Members::default();
    let member = members.add(steps)?;
    members.find(text.as_bytes()).place(member)
}

/// The numbers at these steps within each element of a list, or that of one element; what is absent there is not-a-number.
pub(super) fn of_each(text: &str, list: Place, steps: &[Step], element: Option<usize>) -> Option<RawValue> {
    let mut items: Vec<Option<f64>> = Vec::new();
    if list.kind != Kind::List {
        return None;
    }
    elements(text, list, |_, item| {
        let place = descend(text, item, steps).filter(|place| place.kind != Kind::Null);
        items.push(place.map_or(Some(f64::NAN), |place| number(text, place)));
        true
    });
    of_items(items, element)
}

fn of_items(items: Vec<Option<f64>>, element: Option<usize>) -> Option<RawValue> {
    match element {
        Some(index) => items.get(index).copied().flatten().map(RawValue::Number),
        None => items.into_iter().collect::<Option<_>>().map(RawValue::Vector),
    }
}

/// The number or the list of numbers at a place, or one element of the list.
pub(super) fn value(text: &str, place: Place, element: Option<usize>) -> Option<RawValue> {
    let mut items: Vec<Option<f64>> = Vec::new();
    match (place.kind, element) {
        (Kind::List, _) => elements(text, place, |_, item| {
            // JSON writes not-a-number as null.
            items.push(if item.kind == Kind::Null { Some(f64::NAN) } else { number(text, item) });
            true
        }),
        (_, None) => return number(text, place).map(RawValue::Number),
        _ => return None,
    }
    of_items(items, element)
}

fn number(text: &str, place: Place) -> Option<f64> {
    match place.kind {
        Kind::Number | Kind::Text => float(place.of(text)).or_else(|| float(place.of(text).trim())),
        Kind::True => Some(1.0),
        Kind::False => Some(0.0),
        Kind::Null | Kind::List | Kind::Object => None,
    }
}

/// A stamp from a number, a text, or an object of seconds and nanoseconds.
pub(super) fn stamp(text: &str, place: Place, step: Option<Span>) -> Option<Time> {
    let member = |names: &[&str]| {
        let found = names.iter().find_map(|name| {
            at(place.of(text), &[Step::Key((*name).to_owned())])
                .map(|found| found.of(place.of(text)).parse::<i64>().ok())
        });
        found.flatten()
    };
    match place.kind {
        Kind::Number => stamps::number(place.of(text), step).map(|(time, _)| time),
        Kind::Text => stamps::text(place.of(text), step).map(|(time, _)| time),
        Kind::Object => {
            let seconds = member(&["sec", "secs", "seconds"])?;
            let nanoseconds = member(&["nsec", "nanosec", "nsecs", "nanos"])?;
            seconds.checked_mul(1_000_000_000)?.checked_add(nanoseconds).map(Time)
        }
        _ => None,
    }
}

/// Compares the value at a place with a text: `Some(None)` where it is equal; for a list, the index of the first equal element.
pub(super) fn find(text: &str, place: Place, asked: &str) -> Option<Option<usize>> {
    let says = |place: Place| match place.kind {
        Kind::Text => is_text(&unescaped(place.of(text)), asked),
        Kind::List | Kind::Object => false,
        _ => is_text(place.of(text), asked),
    };
    if place.kind != Kind::List {
        return says(place).then_some(None);
    }
    let mut found = None;
    elements(text, place, |index, item| {
        found = says(item).then_some(index);
        found.is_none()
    });
    found.map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_message::path::Path;

    #[track_caller]
    fn check(text: &str, path: &str, element: Option<usize>, expected: &str) {
        let list = at(text, &[]).unwrap();
        let found = of_each(text, list, &Path::parse(path).unwrap().steps, element);
        assert_eq!(format!("{found:?}"), expected);
    }

    #[test]
    fn what_is_in_each_element_is_a_list() {
        let list = r#"[{"pose": {"x": 1.5}}, {"pose": {"x": null}}, {"pose": [2]}, {"pose": {"x": "3"}}]"#;
        check(list, "pose.x", None, "Some(Vector([1.5, NaN, NaN, 3.0]))");
        check(list, "pose.x", Some(3), "Some(Number(3.0))");
        check(list, "pose", None, "None");
        check("[]", "x", None, "Some(Vector([]))");
        check("{}", "x", None, "None");
    }
}
