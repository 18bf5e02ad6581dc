//! Relations over time.

use super::shape::heading;
use crate::worlds::course::Course;
use crate::worlds::unit::{LENGTH, SPEED, TURN};
use crate::worlds::world::World;
use shsa_lab::calibration::Chance;
use std::f64::consts::TAU;
use std::sync::Arc;

/// A span of a few periods of the usual sensor, in whole milliseconds.
fn span(world: &World, chance: &mut Chance, least: f64, most: f64) -> f64 {
    let span = (least + (most - least) * chance.share()) / world.tempo_hz;
    (1e3 * span).ceil() / 1e3
}

pub(super) fn delay(world: &mut World, chance: &mut Chance) {
    let cause = world.add_free(chance, LENGTH, 10.0, 8.0);
    let span = span(world, chance, 0.3, 10.0);
    let of = world.course(cause);
    let course: Course = Arc::new(move |time| of(time - span));
    let effect = world.add(LENGTH, course.clone());
    world.relate(effect, &format!("delay(${cause}, {span:?} s)"), course);
}

pub(super) fn rate(world: &mut World, chance: &mut Chance) {
    rate_of(world, chance, None);
}

/// A speed and the derivative of a way, which may be counted from 0 again at some time; returns the way.
fn rate_of(world: &mut World, chance: &mut Chance, restart: Option<f64>) -> Option<usize> {
    let middle = [restart.map_or(0.0, |_| 2.2), 3.0][chance.below(2)];
    let speed = world.add_waves(chance, SPEED, middle, 2.0);
    let waves = world.variables[speed].waves.clone()?;
    let gone: Course = Arc::new(move |time| waves.integral(time));
    let shown = restart.map_or_else(|| gone.clone(), |restart| counted(gone.clone(), restart));
    let way = world.add(LENGTH, shown);
    world.variables[way].steps = restart.is_some();
    let window = span(world, chance, 6.0, 30.0);
    let right = mean_rate(gone, window);
    let error = world.off_centre(speed, &right);
    let relation = world.relate(speed, &format!("derivative(${way}, {window:?} s)"), right);
    relation.only_for.push(speed);
    relation.error = error;
    sense_way(world, chance, way, 2.0 * window);
    Some(way)
}

/// What shows the way since a time; before that, it was far already.
fn counted(way: Course, restart: f64) -> Course {
    Arc::new(move |time| way(time) - way(if time < restart { -20.0 * restart } else { restart }))
}

pub(super) fn counter(world: &mut World, chance: &mut Chance) {
    let restart = world.seconds * (0.1 + 0.8 * chance.share());
    let Some(way) = rate_of(world, chance, Some(restart)) else { return };
    for signal in world.signals.iter_mut().filter(|it| it.variable == way) {
        signal.keys = "counter: true".to_owned();
    }
}

/// What is computed over a window is about its middle.
fn mean_rate(course: Course, window: f64) -> Course {
    Arc::new(move |time| (course(time + 0.5 * window) - course(time - 0.5 * window)) / window)
}

impl World {
    /// How far a value of the middle of a window, or the mean of few values, is from what is computed over the window: by what the
    /// variable changes in half of the time between two values, and by its curvature.
    fn off_centre(&self, variable: usize, right: &Course) -> f64 {
        let gap = 1.0 / (0.25 * self.tempo_hz);
        let course = self.course(variable);
        let times = (0..=1000).map(|at| self.seconds * f64::from(at) / 1000.0);
        let off = times.map(|time| (right(time) - course(time)).abs()).fold(0.0, f64::max);
        1.05 * off + 0.5 * self.steepest(variable) * gap + 1e-9
    }
}

/// Sensors of what has gone far, as exact as a derivative needs them.
fn sense_way(world: &mut World, chance: &mut Chance, way: usize, size: f64) {
    world.sense(chance, way, 1..3);
    let exact = 0.05 * size / world.size(way);
    for signal in world.signals.iter_mut().filter(|it| it.variable == way) {
        signal.error = (exact * signal.error.0, exact * signal.error.1);
    }
}

pub(super) fn offset(world: &mut World, chance: &mut Chance) {
    rate(world, chance);
    let before = world.clone();
    for signal in world.signals.iter_mut().filter(|it| before.variables[it.variable].dimension == LENGTH) {
        let most = before.size(signal.variable) * (0.01 + 2.0 * chance.share());
        // The drift of a window is about as large as the rest of the error, or a tenth, or nothing.
        let rest = signal.error.1 - signal.error.0;
        let period = [1e9, TAU * most * 20.0 / (rest * before.tempo_hz), before.seconds][chance.below(3)];
        signal.offset = Some((most, period.max(before.seconds)));
        signal.error = (signal.error.0 - most, signal.error.1 + most);
    }
}

pub(super) fn turning(world: &mut World, chance: &mut Chance) {
    let heading = heading(world, chance);
    let course = world.course(heading);
    let step = 1e-4 * world.seconds;
    let of = course.clone();
    let turn = world.add(TURN, Arc::new(move |time| (of(time + step) - of(time - step)) / (2.0 * step)));
    let window = span(world, chance, 6.0, 30.0);
    let right = mean_rate(course, window);
    let error = world.off_centre(turn, &right);
    let relation = world.relate(turn, &format!("derivative(${heading}, {window:?} s)"), right);
    relation.only_for.push(turn);
    relation.error = error;
    let size = world.size(turn) * window;
    sense_way(world, chance, heading, size);
}

pub(super) fn mean(world: &mut World, chance: &mut Chance) {
    let fast = world.add_waves(chance, LENGTH, 10.0, 8.0);
    let Some(waves) = world.variables[fast].waves.clone() else { return };
    let window = span(world, chance, 6.0, 30.0);
    let of = waves.clone();
    let course: Course = mean_rate(Arc::new(move |time| of.integral(time)), window);
    let slow = world.add(LENGTH, course.clone());
    // The mean of few values is uncertain by what changes in half of the time between two of them.
    let gap = 1.0 / (0.25 * world.tempo_hz);
    let relation = world.relate(slow, &format!("moving_mean(${fast}, {window:?} s)"), course);
    relation.error = 0.5 * waves.steepest() * gap;
    relation.only_for.push(slow);
}

pub(super) fn mean_over(world: &mut World, chance: &mut Chance) {
    let variable = world.add_waves(chance, LENGTH, 10.0, 8.0);
    world.sense(chance, variable, 2..4);
    for at in 0..world.signals.len() {
        if world.signals[at].variable == variable && chance.below(2) == 0 {
            let window = span(world, chance, 0.5, 8.0);
            world.signals[at].mean_over = window;
            world.signals[at].delay = [0.0, 0.5 * window][chance.below(2)];
        }
    }
}

pub(super) fn previous(world: &mut World, chance: &mut Chance) {
    let speed = world.add_waves(chance, SPEED, 1.0, 2.0);
    let Some(waves) = world.variables[speed].waves.clone() else { return };
    let of = waves.clone();
    let way = world.add(LENGTH, Arc::new(move |time| of.integral(time)));
    // A step is no longer than two periods of the slowest sensor.
    let step = 2.0 / (0.25 * world.tempo_hz);
    let off = move |time: f64| waves.integral(time - step) + waves.at(time) * step - waves.integral(time);
    let steepest = world.steepest(speed);
    let relation = world.relate(way, &format!("previous(${way}) + ${speed} * dt"), world.course(way));
    relation.only_for.push(way);
    relation.error = 0.55 * steepest * step * step;
    relation.off = Arc::new(move |time| Some(off(time)));
}
