//! Values of other shapes: curves by points, one of several values, what wraps, and lists.

use crate::worlds::course::{Course, Waves, levels};
use crate::worlds::unit::{ANGLE, LENGTH, RATIO, SPEED, TURN, VOLTAGE};
use crate::worlds::world::World;
use shsa_lab::calibration::Chance;
use std::f64::consts::TAU;
use std::sync::Arc;

/// A characteristic curve over a share of 0 to 1, once in three times with a turn.
pub(super) fn table(world: &mut World, chance: &mut Chance) {
    let size = 0.1 + 0.35 * chance.share();
    let share = world.add_free(chance, RATIO, 0.5, size);
    let rising = [(0.0, 3.2), (0.1, 3.5), (0.6, 3.75), (1.0, 4.2)];
    let turning = [(0.0, 3.2), (0.3, 4.0), (0.6, 3.5), (1.0, 4.2)];
    let points = if chance.below(3) == 0 { turning } else { rising };
    let written: Vec<String> = points.iter().map(|(x, y)| format!("[{:?} %, {y} V]", 100.0 * x)).collect();
    let of = world.course(share);
    let course: Course = Arc::new(move |time| interpolated(&points, of(time)));
    let voltage = world.add(VOLTAGE, course.clone());
    world.relate(voltage, &format!("table(${share}, {})", written.join(", ")), course);
    // Inverses ask where the argument can be.
    world.variables[share].range = Some((0.0, 1.0));
}

fn interpolated(points: &[(f64, f64)], x: f64) -> f64 {
    let at = points.partition_point(|it| it.0 <= x).clamp(1, points.len() - 1);
    let ((x0, y0), (x1, y1)) = (points[at - 1], points[at]);
    y0 + (y1 - y0) * (x - x0) / (x1 - x0)
}

/// A speed behind one of several gears.
pub(super) fn gears(world: &mut World, chance: &mut Chance) {
    world.has_steps = true;
    let size = 2.0 + 8.0 * chance.share();
    let speed = world.add_free(chance, SPEED, 12.0, size);
    let ratios = [12.0, 7.0, 4.5];
    let (gear, _) = levels(chance, &ratios, 0.2 * world.seconds, world.seconds);
    let of = world.course(speed);
    let course: Course = Arc::new(move |time| 0.1 * gear(time) * of(time));
    let engine = world.add(TURN, course.clone());
    world.variables[engine].steps = true;
    world.relate(engine, &format!("one_of(12, 7, 4.5) * 0.1 rad/m * ${speed}"), course);
}

/// A heading that turns for good or to and fro, no faster than its sensors can tell.
pub(super) fn heading(world: &mut World, chance: &mut Chance) -> usize {
    // A fiftieth of a turn between two values of the slowest sensor.
    let fastest = TAU * 0.02 * 0.25 * world.tempo_hz;
    let (shortest, longest) = world.periods();
    let (middle, size) = if chance.below(2) == 0 { (0.5, 0.45) } else { (0.0, 0.9) };
    let turn = Waves::random(chance, middle * fastest, size * fastest, shortest, longest);
    let (start, of) = (TAU * chance.share(), turn.clone());
    let heading = world.add(ANGLE, Arc::new(move |time| start + of.integral(time)));
    let own = &mut world.variables[heading];
    own.wraps = Some(TAU);
    own.range = (chance.below(2) == 0).then_some((-0.5 * TAU, 0.5 * TAU));
    own.max_rate = world.is_rated.then_some(fastest);
    heading
}

/// The difference of two angles, without whole turns.
fn turned(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

pub(super) fn wraps(world: &mut World, chance: &mut Chance) {
    let first = heading(world, chance);
    world.sense(chance, first, 1..4);
    if chance.below(3) == 0 {
        return;
    }
    let of = world.course(first);
    let course: Course = Arc::new(move |time| of(time) + 0.07);
    let second = world.add(ANGLE, course.clone());
    let (wraps, max_rate) = (Some(TAU), world.variables[first].max_rate);
    let own = &mut world.variables[second];
    (own.wraps, own.max_rate) = (wraps, max_rate);
    world.relate(second, &format!("${first} + 0.07 rad"), course);
}

/// A heading, and its parts north and east.
pub(super) fn atan2(world: &mut World, chance: &mut Chance) {
    let heading = heading(world, chance);
    let of = world.course(heading);
    let part = |world: &mut World, function: fn(f64) -> f64| {
        let of = of.clone();
        world.add(LENGTH, Arc::new(move |time| 20.0 * function(of(time))))
    };
    let (north, east) = (part(world, f64::cos), part(world, f64::sin));
    if chance.below(2) == 0 {
        let (x, y, of) = (world.course(north), world.course(east), of.clone());
        let relation = world.relate(heading, &format!("atan2(${east}, ${north})"), of.clone());
        relation.off = Arc::new(move |time| Some(turned(y(time).atan2(x(time)) - of(time))));
    } else {
        let of = world.course(north);
        world.relate(north, &format!("20 m * cos(${heading})"), of);
    }
}

/// A list of three to eight lengths, and what is read from it.
pub(super) fn vector(world: &mut World, chance: &mut Chance) {
    let count = 3 + chance.below(6);
    let elements: Vec<Course> = (0..count)
        .map(|_| {
            let one = world.add_free(chance, LENGTH, 10.0, 6.0);
            let course = world.course(one);
            world.variables.pop();
            course
        })
        .collect();
    let list = world.add(LENGTH, elements[0].clone());
    let own = &mut world.variables[list];
    (own.courses, own.is_vector) = (elements.clone(), true);
    type Read = fn(&[f64]) -> f64;
    let reads: [(&str, Read); 7] = [
        ("min(#)", |it| it.iter().copied().fold(f64::INFINITY, f64::min)),
        ("max(#)", |it| it.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
        ("mean(#)", |it| it.iter().sum::<f64>() / it.len() as f64),
        ("norm(#)", |it| it.iter().map(|it| it * it).sum::<f64>().sqrt()),
        ("#[1]", |it| it[1]),
        ("min(#[1..3])", |it| it[1].min(it[2])),
        ("sum(2 * # - 1 m)", |it| it.iter().map(|it| 2.0 * it - 1.0).sum()),
    ];
    for _ in 0..1 + chance.below(2) {
        let (formula, read) = reads[chance.below(reads.len())];
        let elements = elements.clone();
        let course: Course = Arc::new(move |time| {
            let values: Vec<f64> = elements.iter().map(|it| it(time)).collect();
            read(&values)
        });
        let number = world.add(LENGTH, course.clone());
        world.relate(number, &formula.replace('#', &format!("${list}")), course);
    }
}
