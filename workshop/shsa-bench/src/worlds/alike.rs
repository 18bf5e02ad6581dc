//! The same system written down otherwise: it is judged in the same way.

use super::faulty::{Liars, posed};
use super::kinds::Kind;
use super::readings::Reading;
use super::watch::{Finding, ORIGIN, Watched, Wrong, knowledge, run};
use super::world::{Signal, World};
use super::written::{Names, Order};
use shsa_core::engine::EventKind;
use shsa_lab::calibration::Chance;

/// What is changed of the system's description.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    Names,
    Order,
    Units,
    Origin,
    /// Another system beside it.
    Unrelated,
    /// A signal that is derived from another one.
    Copy,
}

pub(super) const CHANGES: [Change; 6] =
    [Change::Names, Change::Order, Change::Units, Change::Origin, Change::Unrelated, Change::Copy];

/// A verdict: nanoseconds, the kind of event, the signal.
type Told = (i64, EventKind, usize);

/// How differently a world with one fault is judged after each change. `None` where no fault could be found.
///
/// # Errors
/// The generator has written a model that is none.
pub(super) fn watch(kinds: &[&Kind], seed: u64) -> anyhow::Result<Option<Watched>> {
    let Some((world, readings, _)) = posed(kinds, seed, Liars::One) else { return Ok(None) };
    let first = told(&world, &world, &readings, Names::Plain, Order::Written, ORIGIN)?;
    let mut findings = Vec::new();
    for change in CHANGES {
        let mut chance = Chance::new(seed);
        let other = otherwise(&world, &mut chance, &readings, change)?;
        if let Some(text) = difference(&first, &other, change) {
            findings.push(Finding {
                wrong: Wrong::Otherwise,
                time_s: 0.0,
                signal: None,
                text: format!("{change:?}: {text}"),
            });
        }
    }
    Ok(Some(Watched { world, readings, untrue: None, counts: [0; 3], findings, faults: Vec::new() }))
}

/// The verdicts on the signals of the first world after a change.
fn otherwise(
    world: &World,
    chance: &mut Chance,
    readings: &[Reading],
    change: Change,
) -> anyhow::Result<Vec<Told>> {
    let mut other = world.clone();
    let mut names = Names::Plain;
    let mut order = Order::Written;
    let mut origin = ORIGIN;
    let mut given = readings.to_vec();
    match change {
        Change::Names => names = Names::Other,
        Change::Order => order = Order::Reverse,
        // Some other day, not in whole seconds.
        Change::Origin => origin = 86_400_123_456_789,
        Change::Units => {
            for variable in &mut other.variables {
                variable.unit = (variable.unit + 1) % variable.dimension.len();
            }
            for signal in &mut other.signals {
                signal.unit = (signal.unit + 1) % world.variables[signal.variable].dimension.len();
            }
            for reading in &mut given {
                let (old, new) = (&world.signals[reading.signal], &other.signals[reading.signal]);
                reading.values =
                    reading.values.iter().map(|it| other.raw(new, world.meant(old, *it))).collect();
            }
        }
        Change::Unrelated => {
            let variable = other.add_free(chance, super::unit::LENGTH, 5.0, 2.0);
            other.sense(chance, variable, 3..4);
            other.variables[variable].max_rate = Some(1.02 * other.steepest(variable) + 1e-9);
            let more = other.readings(chance).into_iter().filter(|it| it.signal >= world.signals.len());
            given.extend(more);
        }
        Change::Copy => {
            let of = chance.below(world.signals.len());
            let copy = Signal { copies: Some(of), ..world.signals[of].clone() };
            other.signals.push(copy);
            let signal = world.signals.len();
            let copies =
                readings.iter().filter(|it| it.signal == of).map(|it| Reading { signal, ..it.clone() });
            given.extend(copies);
        }
    }
    given.sort_by_key(|it| (it.received, it.signal, it.stamp));
    told(world, &other, &given, names, order, origin)
}

/// The verdicts on the signals of a world.
fn told(
    world: &World,
    other: &World,
    readings: &[Reading],
    names: Names,
    order: Order,
    origin: i64,
) -> anyhow::Result<Vec<Told>> {
    let knowledge = knowledge(&other.model(names, order))?;
    let run = run(other, knowledge, readings, names, origin);
    let signals = run.engine.knowledge().signals();
    let number = |name: &str| (0..world.signals.len()).find(|it| names.signal(*it) == name);
    let of = |event: &shsa_core::engine::Event| {
        let signal = number(&signals[event.signal?].name)?;
        event.kind.accuses().then_some((event.time.0 - origin, event.kind, signal))
    };
    let mut all: Vec<Told> = run.events.iter().filter_map(of).collect();
    all.sort_unstable_by_key(|it| (it.0, it.2, it.1));
    Ok(all)
}

/// The first difference. Where two inputs change places, or others come between, verdicts fall at other moments: then only their
/// order on each signal counts.
fn difference(first: &[Told], other: &[Told], change: Change) -> Option<String> {
    let is_timed = !matches!(change, Change::Order | Change::Unrelated | Change::Copy);
    let seen = |all: &[Told]| -> Vec<Told> {
        let mut all: Vec<Told> = all.iter().map(|it| if is_timed { *it } else { (0, it.1, it.2) }).collect();
        all.sort_by_key(|it| (it.2, it.0));
        all
    };
    let (first, other) = (seen(first), seen(other));
    let place =
        first.iter().zip(&other).position(|(one, two)| one != two).unwrap_or(first.len().min(other.len()));
    let at = |all: &[Told]| {
        all.get(place).map_or("nothing more".to_owned(), |it| {
            format!("s{} {} at {:.6} s", it.2, it.1.name(), it.0 as f64 * 1e-9)
        })
    };
    (first != other).then(|| {
        format!("{} verdicts beside {}: {} beside {}", other.len(), first.len(), at(&other), at(&first))
    })
}
