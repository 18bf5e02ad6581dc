//! Conditions, requirements, and what steps.

use crate::worlds::course::levels;
use crate::worlds::unit::LENGTH;
use crate::worlds::world::World;
use shsa_lab::calibration::Chance;
use std::sync::Arc;

/// A relation that holds only above a limit of its input, and is used for its output; or of another variable.
pub(super) fn when(world: &mut World, chance: &mut Chance) {
    let is_forward = chance.below(2) == 0;
    world.has_steps = chance.below(2) == 0;
    let output = conditional(world, chance, is_forward);
    if is_forward && let Some(relation) = world.relations.last_mut() {
        relation.only_for.push(output);
    }
}

/// A relation that holds only above a limit of its input, and is used for this, too.
pub(super) fn when_inverse(world: &mut World, chance: &mut Chance) {
    world.has_steps = chance.below(2) == 0;
    conditional(world, chance, true);
}

/// Where the condition does not hold, the truth is far from the relation.
fn conditional(world: &mut World, chance: &mut Chance, is_by_input: bool) -> usize {
    let input = world.add_free(chance, LENGTH, 2.0, 10.0);
    let gate = if is_by_input { input } else { world.add_free(chance, LENGTH, 0.0, 5.0) };
    let (of, above) = (world.course(input), world.course(gate));
    let steps = world.has_steps;
    let course = {
        let (of, above) = (of.clone(), above.clone());
        move |time| match above(time) {
            it if it > 1.0 => 2.0 * of(time),
            it if steps => 2.0 * of(time) + 30.0 + it,
            it => 2.0 * of(time) + 9.0 * (1.0 - it),
        }
    };
    let output = world.add(LENGTH, Arc::new(course.clone()));
    world.variables[output].steps = steps;
    let right = of.clone();
    let relation = world.relate(output, &format!("2 * ${input}"), right);
    relation.when = Some(format!("${gate} > 1 m"));
    relation.off = Arc::new(move |time| (above(time) > 1.0).then(|| 2.0 * of(time) - course(time)));
    output
}

/// A bound that the truth touches, and one that it passes again and again.
pub(super) fn specification(world: &mut World, chance: &mut Chance) {
    let variable = world.add_waves(chance, LENGTH, 10.0, 8.0);
    world.sense(chance, variable, 1..3);
    let (lo, hi) = world.extremes(variable);
    // Samples miss the peaks by less than a hundredth.
    let rest = 0.01 * (hi - lo);
    let at = world.entries.len();
    let line = match chance.below(3) {
        0 => format!("spec{at}: ${variable} <= {:?} m", hi + rest),
        1 => format!(
            "spec{at}: {{ always: \"${variable} >= {:?} m\", when: \"${variable} < {:?} m\" }}",
            lo - rest,
            hi
        ),
        _ => format!(
            "spec{at}: {{ eventually: \"${variable} > {:?} m\", within: {:?} s }}",
            lo - rest,
            0.2 * world.seconds
        ),
    };
    world.entries.push(("specifications", line));
}

/// Something that is in one of several positions: one sensor sends each change, others are polled.
pub(super) fn switch(world: &mut World, chance: &mut Chance) {
    let positions = [1.0, 2.0, 5.0, 9.0];
    let (course, times) = levels(chance, &positions, 0.1 * world.seconds, world.seconds);
    let variable = world.add(LENGTH, course);
    world.variables[variable].steps = true;
    world.sense(chance, variable, 1..4);
    if let Some(signal) = world.signals.iter_mut().find(|it| it.variable == variable) {
        signal.holds = true;
        signal.schedule.at = times;
        signal.declares_rate = false;
    }
}
