//! The vectors of a running model as the live page draws them: each thinned to a profile, with its extremes.
//!
//! A profile is made when a page looks, and never else. One look takes only some vectors in turn, so that no decision waits for many
//! of them, or for long ones.

use crate::healer::Healer;
use crate::outlet::Outlet;
use serde_json::{Map, Value, json};
use shsa_bridge::Quality;
use shsa_core::interval::Interval;
use shsa_core::knowledge::{NeedId, Shape, SignalId};
use shsa_core::time::{Span, Time};
use shsa_core::unit::Unit;
use std::ops::Range;

/// The most bins of a profile.
const MOST_BINS: usize = 181;
/// The most vectors that one look takes, and the most elements of all of them; a single vector may be longer.
const MOST_VECTORS: usize = 16;
const MOST_ELEMENTS: usize = 1 << 17;

/// The tables of the profiles: of signals and of needs.
pub(super) const TABLES: [&str; 2] = ["signal_profiles", "need_profiles"];

/// A vector of the model.
struct Vector<'h> {
    /// Its place in [`TABLES`].
    table: usize,
    name: &'h str,
    unit: Option<&'h Unit>,
    /// The latest elements, SI; none where there is no vector now.
    elements: &'h [Interval],
}

/// The profiles of this turn by table and name. The profile of a silent signal and of an unserved need is null.
pub(super) fn tables(healer: &Healer, turn: u64, now: Time) -> Vec<(&'static str, Map<String, Value>)> {
    let vectors: Vec<Vector<'_>> = of_signals(healer).chain(of_needs(healer, now)).collect();
    let lengths: Vec<usize> = vectors.iter().map(|vector| vector.elements.len()).collect();
    let seen = vectors.get(in_turn(&lengths, turn)).unwrap_or_default();
    let rows = |table| {
        let seen = seen.iter().filter(move |vector| vector.table == table);
        seen.map(|it| (it.name.to_owned(), profile(it.elements, it.unit))).collect::<Map<_, _>>()
    };
    let tables = TABLES.into_iter().enumerate().map(|(table, name)| (name, rows(table)));
    tables.filter(|(_, rows)| !rows.is_empty()).collect()
}

fn of_signals(healer: &Healer) -> impl Iterator<Item = Vector<'_>> {
    let (engine, knowledge) = (healer.engine(), healer.engine().knowledge());
    let elements = move |id: SignalId| {
        let port = &engine.monitor().ports()[id];
        let newest = port.moment(0).filter(|_| engine.absence(id).is_none())?;
        port.vector_at(newest, Span::ZERO)
    };
    let signals = knowledge.signals().enumerate();
    let signals = signals.filter(|(_, it)| knowledge.variables()[it.variable].shape == Shape::Vector);
    signals.map(move |(id, signal)| Vector {
        table: 0,
        name: &signal.name,
        unit: signal.unit.as_ref(),
        elements: elements(id).unwrap_or_default(),
    })
}

fn of_needs(healer: &Healer, now: Time) -> impl Iterator<Item = Vector<'_>> {
    let knowledge = healer.engine().knowledge();
    let is_vector =
        move |need: NeedId| knowledge.variables()[knowledge.needs()[need].variable].shape == Shape::Vector;
    let outlets = healer.outlets().filter(move |(need, _)| is_vector(*need));
    outlets.map(move |(_, outlet): (NeedId, &Outlet)| Vector {
        table: 1,
        name: outlet.key(),
        unit: outlet.variable().1,
        elements: if outlet.quality(now) == Quality::Bad { &[] } else { outlet.elements() },
    })
}

/// The vectors of a look. Neighbours form groups within the bounds of a look; each group has every `n`-th turn. O(vectors).
fn in_turn(lengths: &[usize], turn: u64) -> Range<usize> {
    let mut groups: Vec<Range<usize>> = Vec::new();
    let mut elements = 0_usize;
    for (at, length) in lengths.iter().enumerate() {
        elements = elements.saturating_add(*length);
        match groups.last_mut() {
            Some(group) if group.len() < MOST_VECTORS && elements <= MOST_ELEMENTS => group.end = at + 1,
            _ => {
                elements = *length;
                groups.push(at..at + 1);
            }
        }
    }
    let at = turn.checked_rem(groups.len() as u64).unwrap_or(0);
    usize::try_from(at).ok().and_then(|at| groups.get(at).cloned()).unwrap_or(0..0)
}

/// What a vector, or a part of it, holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Content {
    /// How many elements have a value.
    known: usize,
    /// How many are beyond every bound: infinite readings, as of a beam that meets nothing.
    above: usize,
    below: usize,
    /// Encloses the elements with a value.
    hull: Option<Interval>,
    /// The places of the least and the greatest middle, with these.
    least: Option<Extreme>,
    greatest: Option<Extreme>,
}

/// An extreme of the middles of the elements.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Extreme {
    value: f64,
    at: usize,
}

impl Content {
    /// Takes in the element at this place.
    fn add(&mut self, at: usize, element: Interval) {
        if element.is_bounded() {
            let value = element.lo().midpoint(element.hi());
            self.known += 1;
            self.hull = Some(self.hull.map_or(element, |hull| hull.hull(element)));
            if self.least.is_none_or(|least| value < least.value) {
                self.least = Some(Extreme { value, at });
            }
            if self.greatest.is_none_or(|greatest| value > greatest.value) {
                self.greatest = Some(Extreme { value, at });
            }
        } else if !element.is_empty() {
            self.above += usize::from(element.hi() == f64::INFINITY);
            self.below += usize::from(element.lo() == f64::NEG_INFINITY);
        }
    }

    /// Takes in the content of the next part.
    fn join(&mut self, part: &Content) {
        self.known += part.known;
        self.above += part.above;
        self.below += part.below;
        self.hull = self.hull.into_iter().chain(part.hull).reduce(Interval::hull);
        self.least = first(self.least, part.least, |one, other| one <= other);
        self.greatest = first(self.greatest, part.greatest, |one, other| one >= other);
    }
}

/// The one of two extremes that comes first in an order.
fn first(one: Option<Extreme>, other: Option<Extreme>, order: fn(f64, f64) -> bool) -> Option<Extreme> {
    let both = one.into_iter().chain(other);
    both.reduce(|one, other| if order(one.value, other.value) { one } else { other })
}

/// A vector thinned to at most [`MOST_BINS`] bins of neighbours; null without elements. O(elements).
///
/// `bins` has for each bin the bounds of all its elements with a value; where there is none, 1 or -1 for elements beyond every bound,
/// else null. `min` and `max` are the extreme middles with their places, from 0. Values are in `unit`, rounded to a thousandth of
/// their spread.
fn profile(elements: &[Interval], unit: Option<&Unit>) -> Value {
    if elements.is_empty() {
        return Value::Null;
    }
    let bins = bins(elements);
    let mut whole = Content::default();
    bins.iter().for_each(|bin| whole.join(bin));
    let shown = |si: f64| unit.map_or(si, |unit| unit.from_si(si));
    let [lo, hi] = whole.hull.map_or([0.0; 2], |hull| [shown(hull.lo()), shown(hull.hi())]);
    let scale = decimal_scale(lo, hi);
    let rounded = |si: f64| round(shown(si), scale);
    let extreme = |it: Option<Extreme>| it.map(|it| json!([rounded(it.value), it.at]));
    let bin = |bin: &Content| match bin {
        Content { hull: Some(hull), .. } => json!([rounded(hull.lo()), rounded(hull.hi())]),
        Content { above: 1.., .. } => json!(1),
        Content { below: 1.., .. } => json!(-1),
        _ => Value::Null,
    };
    json!({
        "count": elements.len(),
        "known": whole.known,
        "beyond": whole.above + whole.below,
        "min": extreme(whole.least),
        "max": extreme(whole.greatest),
        "bins": bins.iter().map(bin).collect::<Vec<_>>(),
    })
}

/// The contents of the bins, which differ in length by at most one element.
fn bins(elements: &[Interval]) -> Vec<Content> {
    let count = elements.len().min(MOST_BINS);
    let start = |bin: usize| bin * elements.len() / count;
    let content = |bin: usize| {
        let range = start(bin)..start(bin + 1);
        let mut content = Content::default();
        range.clone().zip(elements.get(range).unwrap_or_default()).for_each(|(at, it)| content.add(at, *it));
        content
    };
    (0..count).map(content).collect()
}

/// The power of ten of which multiples are at most a thousandth of this spread apart; of equal values, of their size.
fn decimal_scale(lo: f64, hi: f64) -> i32 {
    let spread = if hi > lo { hi - lo } else { lo.abs() };
    if spread > 0.0 && spread.is_finite() { spread.log10().floor() as i32 - 3 } else { 0 }
}

/// A value as the nearest multiple of a power of ten; as it is where that is not a number.
fn round(value: f64, scale: i32) -> f64 {
    let rounded = match 10_f64.powi(scale.saturating_abs()) {
        // A division by a power of ten gives the number with the fewest decimals.
        power if scale < 0 => (value * power).round() / power,
        power => (value / power).round() * power,
    };
    if rounded.is_finite() { rounded } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The profile of these readings with an error of 0.1, as a port encloses them.
    fn of(readings: &[f64]) -> Value {
        let enclosed = |&reading: &f64| match reading {
            _ if reading.is_nan() => Interval::EMPTY,
            f64::INFINITY => Interval::new(f64::MAX, f64::INFINITY),
            f64::NEG_INFINITY => Interval::new(f64::NEG_INFINITY, f64::MIN),
            _ => Interval::new(reading - 0.1, reading + 0.1),
        };
        profile(&readings.iter().map(enclosed).collect::<Vec<_>>(), None)
    }

    #[test]
    fn a_short_vector_is_shown_element_by_element() {
        let (nan, inf) = (f64::NAN, f64::INFINITY);
        let expected = json!({
            "count": 6, "known": 3, "beyond": 2, "min": [0.5, 3], "max": [4.0, 4],
            "bins": [[1.9, 2.1], null, 1, [0.4, 0.6], [3.9, 4.1], -1],
        });
        assert_eq!(of(&[2.0, nan, inf, 0.5, 4.0, -inf]), expected);
        assert_eq!(of(&[]), Value::Null);
        let nothing =
            json!({ "count": 1, "known": 0, "beyond": 0, "min": null, "max": null, "bins": [null] });
        assert_eq!(of(&[nan]), nothing);
    }

    #[test]
    fn values_are_in_the_unit_and_as_exact_as_a_drawing_needs() {
        let metres = [1.234_567, 2.0].map(Interval::point);
        let unit = Unit::parse("cm").unwrap();
        let profile = profile(&metres, Some(&unit));
        assert_eq!(profile["bins"], json!([[123.46, 123.46], [200.0, 200.0]]));
        assert_eq!(round(123_456.0, 2), 123_500.0);
        assert_eq!(round(f64::MAX, -5), f64::MAX);
        assert_eq!(decimal_scale(0.0, 0.0), 0);
    }

    #[test]
    fn the_longest_vectors_keep_their_spikes() {
        let mut readings = vec![5.0; 100_000];
        (readings[73_123], readings[40_001]) = (1.0, 9.0);
        let profile = of(&readings);
        assert_eq!((&profile["min"], &profile["max"]), (&json!([1.0, 73_123]), &json!([9.0, 40_001])));
        let bins = profile["bins"].as_array().unwrap();
        assert_eq!((bins.len(), bins.iter().filter(|bin| **bin == json!([4.9, 5.1])).count()), (181, 179));
        assert!(bins.contains(&json!([0.9, 5.1])) && bins.contains(&json!([4.9, 9.1])), "{profile}");
        assert!(profile.to_string().len() < 4_000, "{profile}");
    }

    #[test]
    fn every_vector_has_its_turn_and_no_look_takes_too_many_elements() {
        let looks = |lengths: &[usize]| (0..6).map(|turn| in_turn(lengths, turn)).collect::<Vec<_>>();
        assert_eq!(looks(&[]), vec![0..0; 6]);
        assert_eq!(looks(&[181; 4]), vec![0..4; 6]);
        assert_eq!(looks(&[181; 40]), [0..16, 16..32, 32..40, 0..16, 16..32, 32..40]);
        assert_eq!(looks(&[100_000, 10, 100_000, usize::MAX])[..3], [0..2, 2..3, 3..4]);
    }

    #[test]
    fn every_element_is_in_a_bin() {
        for count in 1..1_000 {
            let elements: Vec<_> = (0..count).map(|at| Interval::point(f64::from(at))).collect();
            let bins = bins(&elements);
            assert_eq!(bins.len(), elements.len().min(MOST_BINS));
            let bounds: Vec<_> = bins.iter().filter_map(|bin| bin.hull).collect();
            assert!(bounds.windows(2).all(|pair| pair[0].hi() + 1.0 == pair[1].lo()), "{count}");
            let ends = [bounds[0].lo(), bounds[bounds.len() - 1].hi()];
            assert_eq!(ends, [0.0, f64::from(count - 1)]);
        }
    }
}
