//! Estimators, and what is learned.

use crate::worlds::course::Course;
use crate::worlds::unit::{CURRENT, LENGTH, RESISTANCE, VOLTAGE};
use crate::worlds::world::World;
use shsa_lab::calibration::Chance;
use std::sync::Arc;

/// A variable with three or four sensors.
fn sensed(world: &mut World, chance: &mut Chance) -> usize {
    let variable = world.add_waves(chance, LENGTH, 10.0, 5.0);
    world.sense(chance, variable, 3..5);
    variable
}

/// Adds an estimator over all sensors of a variable, whose state changes as fast as the variable.
fn estimate(world: &mut World, variable: usize, method: &str) {
    let steepest = world.steepest(variable);
    let at = world.entries.len();
    let inputs: Vec<String> = (0..world.signals.len())
        .filter(|it| world.signals[*it].variable == variable)
        .map(|it| format!("\"@{it}\""))
        .collect();
    // Over the time between two values of the slowest sensor, noise of a second grows with the root of time.
    let gap = 1.0 / (0.25 * world.tempo_hz);
    let noise = steepest * gap.sqrt() + 1e-6;
    world.entries.push((
        "fusion",
        format!(
            "fused{at}: {{ method: {method}, states: {{ state{at}: {{ unit: m, initial: 10 m, spread: 20 m, noise: {noise:?} m }} }}, inputs: {{ {} }}, outputs: {{ fused/{at}: {{ value: state{at}, variable: ${variable} }} }}, unknown_after: {:?} s }}",
            inputs.iter().map(|it| format!("{it}: {{ measures: state{at} }}")).collect::<Vec<_>>().join(", "),
            (3.0 * gap).max(2.0),
        ),
    ));
}

pub(super) fn fusion(world: &mut World, chance: &mut Chance) {
    let variable = sensed(world, chance);
    estimate(world, variable, ["marzullo", "schmid", "brooks_iyengar"][chance.below(3)]);
}

pub(super) fn filter(world: &mut World, chance: &mut Chance) {
    let variable = sensed(world, chance);
    let methods = ["average", "median", "confidence", "kalman", "unscented_kalman", "huber", "student"];
    estimate(world, variable, methods[chance.below(methods.len())]);
}

pub(super) fn learned(world: &mut World, chance: &mut Chance) {
    let rest = world.add_free(chance, VOLTAGE, 12.0, 0.5);
    let current = world.add_free(chance, CURRENT, 20.0, 18.0);
    let slope = 1e-3 / world.seconds;
    let resistance = world.add(RESISTANCE, Arc::new(move |time| 0.02 + slope * time));
    let own = &mut world.variables[resistance];
    own.range = Some((0.01, 0.04));
    own.max_rate = Some(1.01 * slope);
    let (of, by, resists) = (world.course(rest), world.course(current), world.course(resistance));
    let course: Course = Arc::new(move |time| of(time) - resists(time) * by(time));
    let voltage = world.add(VOLTAGE, course.clone());
    let relation = world.relate(voltage, &format!("${rest} - ${resistance} * ${current}"), course);
    relation.learns = Some(resistance);
}
