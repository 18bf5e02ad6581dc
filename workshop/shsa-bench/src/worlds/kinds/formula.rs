//! Formulas without a past.

use crate::worlds::unit::{
    AREA, CURRENT, Dimension, LENGTH, POWER, RATIO, SPEED, TEMPERATURE, TIME, VOLTAGE,
};
use crate::worlds::world::World;
use shsa_lab::calibration::Chance;

/// An input: its dimension, and the least and greatest value for which the formula has a value.
type Input = (Dimension, f64, f64);

/// A formula: `#0` is its first input.
struct Form {
    formula: &'static str,
    inputs: &'static [Input],
    output: Dimension,
    compute: fn(&[f64]) -> f64,
}

const fn form(
    output: Dimension,
    formula: &'static str,
    inputs: &'static [Input],
    compute: fn(&[f64]) -> f64,
) -> Form {
    Form { formula, inputs, output, compute }
}

const ANY: Input = (LENGTH, -20.0, 20.0);
const AWAY: Input = (LENGTH, 3.0, 30.0);
const SHARE: Input = (RATIO, 0.2, 3.0);
const TURNED: Input = (super::super::unit::ANGLE, -0.9, 0.9);

const SUMS: &[Form] = &[
    form(LENGTH, "#0 + #1", &[ANY, ANY], |it| it[0] + it[1]),
    form(LENGTH, "#0 - #1", &[ANY, ANY], |it| it[0] - it[1]),
    form(LENGTH, "2 * #0 - 0.5 * #1 + 3 m", &[ANY, ANY], |it| 2.0 * it[0] - 0.5 * it[1] + 3.0),
    form(LENGTH, "(#0 + #1 + #2) / 3", &[ANY, ANY, ANY], |it| (it[0] + it[1] + it[2]) / 3.0),
    form(LENGTH, "mean(#0, #1)", &[ANY, ANY], |it| 0.5 * (it[0] + it[1])),
    form(LENGTH, "-#0", &[ANY], |it| -it[0]),
    form(LENGTH, "sum(#0, #0, #1)", &[ANY, ANY], |it| 2.0 * it[0] + it[1]),
];

const PRODUCTS: &[Form] = &[
    form(AREA, "#0 * #1", &[ANY, AWAY], |it| it[0] * it[1]),
    form(AREA, "#0 * #1", &[ANY, ANY], |it| it[0] * it[1]),
    form(SPEED, "#0 / #1", &[ANY, (TIME, 2.0, 20.0)], |it| it[0] / it[1]),
    form(POWER, "#0 * #1", &[(VOLTAGE, 5.0, 15.0), (CURRENT, -4.0, 4.0)], |it| it[0] * it[1]),
    form(CURRENT, "#0 / #1", &[(POWER, 10.0, 90.0), (VOLTAGE, 5.0, 15.0)], |it| it[0] / it[1]),
    form(RATIO, "#0 / (#0 + #1)", &[AWAY, AWAY], |it| it[0] / (it[0] + it[1])),
    form(AREA, "#0 * (#0 - #1)", &[AWAY, ANY], |it| it[0] * (it[0] - it[1])),
];

const POWERS: &[Form] = &[
    form(AREA, "#0^2", &[ANY], |it| it[0] * it[0]),
    form(AREA, "#0^2", &[AWAY], |it| it[0] * it[0]),
    form(LENGTH, "sqrt(#0)", &[(AREA, 1.0, 90.0)], |it| it[0].sqrt()),
    form(LENGTH, "abs(#0)", &[ANY], |it| it[0].abs()),
    form(LENGTH, "#0^3 / (40 m^2)", &[ANY], |it| it[0].powi(3) / 40.0),
    form(RATIO, "root(#0, 3)", &[SHARE], |it| it[0].cbrt()),
    form(LENGTH, "hypot(#0, #1)", &[ANY, ANY], |it| it[0].hypot(it[1])),
    form(AREA, "#0^2 - #1^2", &[AWAY, ANY], |it| it[0] * it[0] - it[1] * it[1]),
];

const CURVES: &[Form] = &[
    form(RATIO, "exp(-#0)", &[SHARE], |it| (-it[0]).exp()),
    form(RATIO, "ln(#0)", &[SHARE], |it| it[0].ln()),
    form(RATIO, "log10(#0 + 1)", &[SHARE], |it| (it[0] + 1.0).log10()),
    form(RATIO, "sin(#0)", &[TURNED], |it| it[0].sin()),
    form(RATIO, "cos(#0)", &[TURNED], |it| it[0].cos()),
    form(LENGTH, "#0 * tan(#1)", &[AWAY, TURNED], |it| it[0] * it[1].tan()),
    form(RATIO, "atan(#0) / (1 rad)", &[SHARE], |it| it[0].atan()),
    form(RATIO, "2^#0", &[SHARE], |it| it[0].exp2()),
];

const EXTREMES: &[Form] = &[
    form(LENGTH, "min(#0, #1)", &[ANY, ANY], |it| it[0].min(it[1])),
    form(LENGTH, "max(#0, #1)", &[ANY, ANY], |it| it[0].max(it[1])),
    form(LENGTH, "max(#0, 2 m)", &[ANY], |it| it[0].max(2.0)),
    form(LENGTH, "min(max(#0, -2 m), #1)", &[ANY, AWAY], |it| it[0].max(-2.0).min(it[1])),
    form(LENGTH, "median(#0, #1, #2)", &[ANY, ANY, ANY], |it| {
        it[0].min(it[1]).max(it[0].max(it[1]).min(it[2]))
    }),
    form(LENGTH, "if(#0 > 1 m, 2 * #0 - 1 m, #0)", &[ANY], |it| it[0].max(2.0 * it[0] - 1.0)),
    form(LENGTH, "either(sqrt(#0), #1)", &[(AREA, -20.0, 20.0), ANY], |it| it[1]),
    form(LENGTH, "within(#0, 0 m, inf) + #1", &[AWAY, ANY], |it| it[0] + it[1]),
];

const BOUNDED: &[Form] = &[
    form(LENGTH, "#0 * interval(0.9, 1.1)", &[AWAY], |it| 1.1 * it[0] * (1.0 - 1e-7)),
    form(LENGTH, "#0 + plusminus(0.4 m)", &[ANY], |it| it[0] - 0.4 * (1.0 - 1e-7)),
    form(LENGTH, "#0 * slip + #1", &[AWAY, ANY], |it| 0.9 * (1.0 + 1e-7) * it[0] + it[1]),
    form(LENGTH, "bent(#0)", &[ANY], |it| 1.3 * it[0] + 0.05 * it[0] * it[0]),
];

const AFFINES: &[Form] = &[
    form(TEMPERATURE, "0.25 * #0 + 0.75 * #1", &[WARM, WARM], |it| 0.25 * it[0] + 0.75 * it[1]),
    form(POWER, "40 W/K * (#0 - #1)", &[WARM, WARM], |it| 40.0 * (it[0] - it[1])),
    form(TEMPERATURE, "#0 + 3 K", &[WARM], |it| it[0] + 3.0),
    form(TEMPERATURE, "max(#0, #1)", &[WARM, WARM], |it| it[0].max(it[1])),
    form(TEMPERATURE, "(#0 + #1 + #2) / 3", &[WARM, WARM, WARM], |it| (it[0] + it[1] + it[2]) / 3.0),
];
const WARM: Input = (TEMPERATURE, 253.0, 313.0);

/// Adds one of these relations, over variables that are there, or new ones.
fn related(world: &mut World, chance: &mut Chance, forms: &[Form]) {
    let form = &forms[chance.below(forms.len())];
    let mut of: Vec<usize> = Vec::new();
    for input in form.inputs {
        let variable = fitting(world, chance, *input, &of).unwrap_or_else(|| {
            let (dimension, low, high) = *input;
            let size = 0.5 * (high - low) * (0.05 + 0.9 * chance.share());
            let middle = low + size + (high - low - 2.0 * size) * chance.share();
            world.add_free(chance, dimension, middle, size)
        });
        of.push(variable);
    }
    let mut formula = form.formula.to_owned();
    for (at, variable) in of.iter().enumerate() {
        formula = formula.replace(&format!("#{at}"), &format!("${variable}"));
    }
    for (name, entry) in [
        ("slip", ("constants", "slip: [0.9, 1.0]")),
        ("bent", ("functions", "bent(x): 1.3 * x + x^2 * (0.05 / (1 m))")),
    ] {
        if formula.contains(name) && !world.entries.iter().any(|it| it.1 == entry.1) {
            world.entries.push((entry.0, entry.1.to_owned()));
        }
    }
    world.relate_computed(chance, form.output, &formula, &of, form.compute);
}

/// A variable that is there and may be this input, once in two times.
fn fitting(
    world: &World,
    chance: &mut Chance,
    (dimension, low, high): Input,
    but: &[usize],
) -> Option<usize> {
    let fits = |at: &usize| {
        let variable = &world.variables[*at];
        let (lo, hi) = world.extremes(*at);
        let rest = 0.02 * (hi - lo);
        let is_plain = !variable.is_vector && variable.wraps.is_none() && !variable.steps;
        is_plain
            && variable.dimension == dimension
            && lo - rest >= low
            && hi + rest <= high
            && !but.contains(at)
    };
    let all: Vec<usize> = (0..world.variables.len()).filter(fits).collect();
    (!all.is_empty() && chance.below(2) == 0).then(|| all[chance.below(all.len())])
}

pub(super) fn redundant(world: &mut World, chance: &mut Chance) {
    let middle = [0.0, 5.0, 100.0][chance.below(3)];
    let variable = world.add_free(chance, LENGTH, middle, 4.0);
    world.sense(chance, variable, 2..5);
}

pub(super) fn sum(world: &mut World, chance: &mut Chance) {
    related(world, chance, SUMS);
}

pub(super) fn product(world: &mut World, chance: &mut Chance) {
    related(world, chance, PRODUCTS);
}

pub(super) fn power(world: &mut World, chance: &mut Chance) {
    related(world, chance, POWERS);
}

pub(super) fn curve(world: &mut World, chance: &mut Chance) {
    related(world, chance, CURVES);
}

pub(super) fn extreme(world: &mut World, chance: &mut Chance) {
    related(world, chance, EXTREMES);
}

pub(super) fn bounds(world: &mut World, chance: &mut Chance) {
    related(world, chance, BOUNDED);
}

pub(super) fn affine(world: &mut World, chance: &mut Chance) {
    related(world, chance, AFFINES);
}

pub(super) fn chain(world: &mut World, chance: &mut Chance) {
    for _ in 0..2 + chance.below(3) {
        let forms = [SUMS, SUMS, PRODUCTS, POWERS, EXTREMES][chance.below(5)];
        related(world, chance, forms);
    }
}
