//! Whether an accused signal is right in another unit: a meter that is read in kW and sends W since its update.

use crate::alignment::{Jump, Sample};
use crate::interval::Interval;
use crate::knowledge::{KnowledgeBase, SignalId};
use crate::monitor::{Evidence, Monitor, Residual, WatchedWay};
use crate::numbers::IN_A_ROW;
use crate::reason::Reason;
use crate::unit::Unit;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// Units that people confuse with others of their dimension.
const MISTAKEN: [&str; 60] = [
    "m", "km", "cm", "mm", "ft", "inch", "mi", "nmi", "m/s", "km/h", "mph", "kn", "ft/s", "rad", "deg",
    "rad/s", "deg/s", "rpm", "Hz", "degC", "K", "degF", "Pa", "hPa", "kPa", "bar", "psi", "mmHg", "W", "kW",
    "MW", "J", "kJ", "Wh", "kWh", "MWh", "V", "mV", "A", "mA", "Ah", "mAh", "kg", "g", "lb", "l", "m^3",
    "l/s", "l/min", "l/h", "m^3/s", "m^3/h", "s", "ms", "min", "h", "%", "ppm", "1/s", "1/min",
];

/// What units are multiplied by in mistake.
const FACTORS: [f64; 7] = [-1.0, 10.0, 0.1, 100.0, 0.01, 1000.0, 0.001];

/// A unit in which values may have been sent.
struct Candidate {
    /// The SI values of its one, as a difference, and of its zero.
    scale: f64,
    zero: f64,
    name: String,
}

/// The unit in which the latest values of a signal that others contradict agree with these; `None` where no or more than one does.
/// O(pairs of the signal).
pub(super) fn right_unit<'p>(
    knowledge: &KnowledgeBase,
    monitor: &Monitor,
    against: impl Iterator<Item = &'p Residual>,
    signal: SignalId,
) -> Option<Reason> {
    let is_own = |way: &WatchedWay| way.computation.way().direct() == Some(signal);
    let mut compared: Vec<(Interval, Interval)> = Vec::new();
    for pair in against {
        let (Some(one), Some(other)) = (monitor.way(pair.way), monitor.way(pair.other)) else { continue };
        let (own, other) = if is_own(one) { (one, other) } else { (other, one) };
        if !is_own(own) || other.is_range() || other.rests_on.contains(signal) {
            continue;
        }
        let beside = |sample: &Sample| {
            let expected = other.in_turn(other.about(sample.validity).value()?, sample.value);
            (!expected.overlaps(sample.value)).then_some((sample.value, expected))
        };
        compared.extend(own.outputs.newest_first().take(IN_A_ROW as usize).filter_map(beside));
    }
    // One may be right by chance.
    if compared.len() > 1 { only_right(knowledge, signal, &compared) } else { None }
}

/// The unit in which a value that has jumped could have followed the one before.
pub(super) fn unit_of_jump(
    knowledge: &KnowledgeBase,
    signal: SignalId,
    evidence: Evidence,
) -> Option<Reason> {
    let Evidence::TooFast(Jump { from, to, within, max_rate }) = evidence else { return None };
    only_right(knowledge, signal, &[(to, from.widened(max_rate * within.seconds()))])
}

/// The only unit in which all values of a signal are what was expected beside each.
fn only_right(
    knowledge: &KnowledgeBase,
    signal: SignalId,
    compared: &[(Interval, Interval)],
) -> Option<Reason> {
    let declared = knowledge.signals()[signal].unit.as_ref()?;
    let is_right = |candidate: &Candidate| {
        let read = |value: f64| candidate.zero + candidate.scale * declared.from_si(value);
        let in_unit = |value: Interval| {
            let (one, other) = (read(value.lo()), read(value.hi()));
            Interval::new(one.min(other), one.max(other))
        };
        compared.iter().all(|(value, expected)| in_unit(*value).overlaps(*expected))
    };
    let mut right = candidates(declared).into_iter().filter(is_right);
    let found = right.next()?;
    right.all(|other| is_same(&other, &found)).then_some(Reason::RightIn { unit: found.name })
}

/// Units that a value of a declared one may have, named ones first.
fn candidates(declared: &Unit) -> Vec<Candidate> {
    let candidate = |unit: &Unit, name: &str| Candidate {
        scale: unit.to_si_difference(1.0),
        zero: unit.to_si(0.0),
        name: name.to_string(),
    };
    let own = candidate(declared, "");
    let named = MISTAKEN.iter().filter_map(|name| Some((Unit::parse(name).ok()?, *name)));
    let named = named.filter(|(unit, _)| unit.dimension == declared.dimension);
    let named = named.map(|(unit, name)| candidate(&unit, name));
    let multiple = |factor: &f64| Candidate {
        scale: own.scale * factor,
        zero: 0.0,
        name: format!("{factor} {declared}"),
    };
    // A multiple of degrees has another zero, too: nobody takes it for one.
    let multiples = FACTORS.iter().filter(|_| !declared.is_affine()).map(multiple);
    named.chain(multiples).filter(|it| !is_same(it, &own)).collect()
}

fn is_same(one: &Candidate, other: &Candidate) -> bool {
    let near = |one: f64, other: f64| (one - other).abs() <= 1e-9 * one.abs().max(other.abs());
    near(one.scale, other.scale) && near(one.zero, other.zero)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::knowledge::{Draft, Id, SignalDraft, Text, VariableDraft, build};
    use proptest::prelude::*;

    fn knowledge(unit: &str) -> KnowledgeBase {
        let text = |text: &str| Text { text: text.to_string(), ..Text::default() };
        let unit = || Some(text(unit));
        build(&Draft {
            variables: [VariableDraft { name: text("v"), unit: unit(), ..VariableDraft::default() }].into(),
            signals: [SignalDraft { name: text("s"), variable: Some(text("v")), ..SignalDraft::default() }]
                .into(),
            ..Draft::default()
        })
        .0
    }

    proptest! {
        /// A value that was sent in another unit is told by that one, or by none where the errors leave several open.
        #[test]
        fn no_other_unit_is_named(
            declared in prop::sample::select(&MISTAKEN[..]),
            (sent, size) in (any::<prop::sample::Index>(), 1e-4..0.1_f64),
            truths in prop::collection::vec(0.5..40.0_f64, 2..5),
        ) {
            let declared_unit = Unit::parse(declared).unwrap();
            let all = candidates(&declared_unit);
            let sent = &all[sent.index(all.len())];
            let compared: Vec<(Interval, Interval)> = truths.iter().map(|truth| {
                let si = sent.zero + sent.scale * truth;
                let read = declared_unit.to_si(*truth);
                let around = |value: f64| Interval::new(value - size * value.abs(), value + size * value.abs());
                (around(read), around(si))
            }).collect();
            match only_right(&knowledge(declared), SignalId::from_index(0), &compared) {
                Some(Reason::RightIn { unit }) => {
                    let same = candidates(&declared_unit).into_iter().find(|it| is_same(it, sent)).unwrap();
                    prop_assert_eq!(unit, same.name);
                }
                other => prop_assert!(other.is_none() && size > 1e-3, "{declared} {}: {other:?}", sent.name),
            }
        }
    }
}
