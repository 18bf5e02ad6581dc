//! The error of a need while one of three sensors or more lies, beside the median of these sensors.

use super::fault::{FORMS, Fault, inject};
use super::kinds::{Kind, world};
use super::readings::Reading;
use super::watch::{Finding, ORIGIN, Run, Watched, Wrong, known, run, seconds};
use super::world::World;
use super::written::Names;
use crate::voter::{Errors, PERIODS, SHARES, median, moments};
use shsa_core::engine::{Publication, PublishedValue, Quality};
use shsa_core::knowledge::Id;

/// The errors by the form and the size of the fault.
#[derive(Clone, Default)]
pub(super) struct Voters([[Errors; SHARES.len()]; FORMS.len()]);

impl Voters {
    pub(super) fn join(&mut self, other: &Voters) {
        let pairs = self.0.iter_mut().flatten().zip(other.0.iter().flatten());
        pairs.for_each(|(own, other)| own.add(*other));
    }

    /// See [`Errors::is_right`].
    pub(super) fn is_right(&self) -> bool {
        self.sum().is_right()
    }

    fn sum(&self) -> Errors {
        let mut sum = Errors::default();
        self.0.iter().flatten().for_each(|it| sum.add(*it));
        sum
    }

    /// One line for each form and size, and one for all.
    pub(super) fn lines(&self, as_json: bool) -> String {
        let row = |(form, row): (usize, &[Errors; SHARES.len()])| {
            let name = format!("{:?}", FORMS[form]).to_lowercase();
            row.map(|it| it)
                .into_iter()
                .zip(SHARES)
                .filter(|(it, _)| !it.is_empty())
                .map(|(it, share)| it.line(&format!("{name} {share}"), as_json))
                .collect::<Vec<_>>()
        };
        let mut lines: Vec<String> = self.0.iter().enumerate().flat_map(row).collect();
        lines.push(self.sum().line("all", as_json));
        lines.join("\n")
    }
}

/// Watches a need while one of at least three sensors of its variable lies; `None` where a world has no such need.
///
/// # Errors
/// The generator has written a model that is none.
pub(super) fn watch(kinds: &[&Kind], seed: u64, voters: &mut Voters) -> anyhow::Result<Option<Watched>> {
    let (mut world, mut chance) = world(kinds, seed, 2.0);
    let sound = world.readings(&mut chance);
    let Some((need, sensors)) = voted(&world) else { return Ok(None) };
    let liar = sensors[chance.below(sensors.len())];
    let Some(hidden) = world.hidden(liar).filter(|_| world.untrue(&sound).is_none()) else { return Ok(None) };
    let (form, share) = (chance.below(FORMS.len()), chance.below(SHARES.len()));
    let side = if chance.below(2) == 0 { 1.0 } else { -1.0 };
    let (from, to) = (0.4 * world.seconds, 0.8 * world.seconds);
    let size = side * SHARES[share] * hidden;
    let fault = Fault { signal: liar, form: FORMS[form], size, from, to };
    let readings = inject(&world, &mut chance, &sound, fault);
    world.needs[need].max_width = Some(2.0 * hidden);
    let run = run(&world, known(&world)?, &readings, Names::Plain, ORIGIN);
    let counts = [run.publications.len(), 0, 0];
    let faults = vec![fault.told()];
    let mut watched = Watched { world, readings, untrue: None, counts, findings: Vec::new(), faults };
    let scene = Scene { watched: &watched, run: &run, need, sensors: &sensors, hidden };
    voters.0[form][share].add(scene.errors(fault));
    watched.findings = scene.far_off();
    Ok(Some(watched))
}

/// A need of a number that does not wrap, and the sensors of its variable; `None` without at least three.
fn voted(world: &World) -> Option<(usize, Vec<usize>)> {
    let sensors = |variable: usize| {
        let is_sensor = |it: &usize| {
            let signal = &world.signals[*it];
            signal.variable == variable && signal.copies.is_none()
        };
        (0..world.signals.len()).filter(is_sensor).collect::<Vec<_>>()
    };
    let needs = world.needs.iter().enumerate();
    needs
        .filter(|(_, it)| {
            let variable = &world.variables[it.variable];
            variable.wraps.is_none() && !variable.is_vector
        })
        .map(|(at, it)| (at, sensors(it.variable)))
        .find(|(_, sensors)| sensors.len() >= 3)
}

/// A need beside its voter.
struct Scene<'s> {
    watched: &'s Watched,
    run: &'s Run,
    need: usize,
    sensors: &'s [usize],
    hidden: f64,
}

impl Scene<'_> {
    fn variable(&self) -> usize {
        self.watched.world.needs[self.need].variable
    }

    fn truth(&self, time: f64) -> f64 {
        self.watched.world.variables[self.variable()].courses[0](time)
    }

    /// The values of the need.
    fn published(&self) -> impl Iterator<Item = (&Publication, f64)> {
        self.run.publications.iter().filter(|it| it.need.index() == self.need).filter_map(|it| {
            match &it.value {
                PublishedValue::Scalar(value) => Some((it, value.midpoint())),
                PublishedValue::Vector(_) => None,
            }
        })
    }

    fn errors(&self, fault: Fault) -> Errors {
        let mut errors = Errors::default();
        for time in moments(fault.from, fault.to) {
            let Some(median) = self.median(time) else { continue };
            let off = |value: f64| (value - self.truth(time)) / self.hidden;
            errors.take(self.value(time).map(off), off(median));
        }
        errors
    }

    /// The latest value of the need, unless it is too old.
    fn value(&self, time: f64) -> Option<f64> {
        let (latest, value) = self.published().take_while(|(it, _)| seconds(it.time) <= time).last()?;
        let age = time - seconds(latest.validity.to);
        (age <= self.watched.world.needs[self.need].max_age).then_some(value)
    }

    /// The median of the latest values of the sensors.
    fn median(&self, time: f64) -> Option<f64> {
        median(self.sensors.iter().filter_map(|it| self.latest(*it, time)).collect())
    }

    fn latest(&self, sensor: usize, time: f64) -> Option<f64> {
        let world = &self.watched.world;
        let signal = &world.signals[sensor];
        let is_own = |it: &&Reading| it.signal == sensor && it.received as f64 <= time * 1e9;
        let latest = self.watched.readings.iter().filter(is_own).max_by_key(|it| it.stamp)?;
        let is_new = time - latest.at <= PERIODS / signal.rate_hz;
        is_new.then(|| world.meant(signal, latest.values[0]))
    }

    /// Good values that are further off than the need allows.
    fn far_off(&self) -> Vec<Finding> {
        let most = self.watched.world.needs[self.need].max_width.unwrap_or(f64::INFINITY);
        let is_far = |(it, value): &(&Publication, f64)| {
            let centre = seconds(it.validity.centre());
            it.quality == Quality::Good && (value - self.truth(centre)).abs() > most
        };
        let told = |(it, value): (&Publication, f64)| Finding {
            wrong: Wrong::FarOff,
            time_s: seconds(it.time),
            signal: None,
            text: format!("{value} beside {}", self.truth(seconds(it.validity.centre()))),
        };
        self.published().filter(is_far).map(told).collect()
    }
}
