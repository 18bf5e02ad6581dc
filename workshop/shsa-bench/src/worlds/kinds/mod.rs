//! The kinds of worlds: what relations, conditions and sensors a model can have, each by a name.

mod formula;
mod shape;
mod past;
mod condition;
mod fused;
mod sensing;

use super::world::World;
use shsa_lab::calibration::Chance;

/// When a kind adds its part to a world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Step {
    /// Before there is anything.
    Tempo,
    /// Variables, relations, and sensors of special forms.
    Structure,
    /// After all variables have sensors: how these are, and signals made of them.
    Sensing,
    /// Signals that are made of others, as these are then.
    Copies,
}

/// A kind of worlds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    pub(super) name: &'static str,
    /// What it adds.
    pub(super) about: &'static str,
    step: Step,
    add: fn(&mut World, &mut Chance),
}

const fn structure(name: &'static str, about: &'static str, add: fn(&mut World, &mut Chance)) -> Kind {
    Kind { name, about, step: Step::Structure, add }
}

const fn sensing(name: &'static str, about: &'static str, add: fn(&mut World, &mut Chance)) -> Kind {
    Kind { name, about, step: Step::Sensing, add }
}

const fn copies(name: &'static str, about: &'static str, add: fn(&mut World, &mut Chance)) -> Kind {
    Kind { name, about, step: Step::Copies, add }
}

const fn tempo(name: &'static str, about: &'static str, add: fn(&mut World, &mut Chance)) -> Kind {
    Kind { name, about, step: Step::Tempo, add }
}

/// All kinds.
pub(super) const KINDS: &[Kind] = &[
    structure("redundant", "two to four sensors of one variable", formula::redundant),
    structure("sum", "sums, differences and means", formula::sum),
    structure("product", "products and quotients", formula::product),
    structure("power", "powers, roots and magnitudes, also about zero", formula::power),
    structure("curve", "exponentials, logarithms and trigonometry", formula::curve),
    structure("extreme", "min, max, median, if and either", formula::extreme),
    structure("bounds", "constants between bounds, plusminus and interval", formula::bounds),
    structure("chain", "relations of relations", formula::chain),
    structure("affine", "temperatures in degrees", formula::affine),
    structure("table", "characteristic curves that rise, or turn", shape::table),
    structure("gears", "one of several ratios, changing", shape::gears),
    structure("wraps", "headings that turn over north, and offsets of them", shape::wraps),
    structure("atan2", "a heading of two parts, and the parts of a heading", shape::atan2),
    structure("vector", "lists of numbers and what is read from them", shape::vector),
    structure("delay", "what follows another later", past::delay),
    structure("rate", "a speed and the derivative of a way", past::rate),
    structure("offset", "the same of sensors that are off by much, and change exactly", past::offset),
    structure("counter", "the same of counters that begin anew", past::counter),
    structure("turning", "a turn rate and the derivative of a heading", past::turning),
    structure("mean", "a moving mean", past::mean),
    structure("mean_over", "sensors that give means over a time", past::mean_over),
    structure("previous", "dead reckoning", past::previous),
    structure("when", "a relation that holds only under a condition", condition::when),
    structure(
        "when_inverse",
        "the same, used for the variable of its condition, too",
        condition::when_inverse,
    ),
    structure("specification", "what is always so, or is so again and again", condition::specification),
    structure("switch", "steps that are sent on change", condition::switch),
    structure("fusion", "intervals of several sensors: marzullo, schmid, brooks_iyengar", fused::fusion),
    structure("filter", "Kalman filters, averages and medians", fused::filter),
    structure("learned", "a resistance that changes slowly", fused::learned),
    sensing("delays", "declared delays of content", sensing::delays),
    sensing("stamps", "errors of time stamps, at their bounds", sensing::stamps),
    sensing("lost", "values that do not come, singly and for a while", sensing::lost),
    sensing("bursts", "values that come in packets", sensing::bursts),
    sensing("late", "values that come late", sensing::late),
    sensing("unordered", "values that overtake each other, or come twice", sensing::unordered),
    sensing("hold", "polled values that stand until the next one", sensing::hold),
    sensing("on_change", "values that are sent when they have left a dead band", sensing::on_change),
    sensing("saturates", "sensors that cannot show all that is possible", sensing::saturates),
    sensing("noise", "declared noise", sensing::noise),
    sensing("relative", "errors in per cent", sensing::relative),
    sensing("scaled", "counts of converters, with offsets", sensing::scaled),
    copies("copies", "signals that are derived from others", sensing::copies),
    sensing("causes", "devices that several signals share", sensing::causes),
    sensing("rates", "rates that differ a thousandfold", sensing::rates),
    tempo("slow", "0.05 to 0.5 Hz", |world, chance| world.set_tempo(chance, 0.05, 0.5)),
    tempo("fast", "20 to 200 Hz", |world, chance| world.set_tempo(chance, 20.0, 200.0)),
    tempo("rated", "every variable declares its largest rate", |world, _| world.is_rated = true),
    tempo("unrated", "no variable does", |world, _| world.is_rated = false),
];

/// The kind of a name.
pub(super) fn kind(name: &str) -> Option<&'static Kind> {
    KINDS.iter().find(|it| it.name == name)
}

/// The world with this number of these kinds together, so many times as long as usual.
pub(super) fn world(kinds: &[&Kind], seed: u64, longer: f64) -> (World, Chance) {
    let mut chance = Chance::new(hash(kinds, seed));
    let mut world = World::empty(&mut chance, longer);
    let mut kinds: Vec<&Kind> = kinds.to_vec();
    kinds.sort_by_key(|it| it.step);
    let structures = kinds.partition_point(|it| it.step < Step::Sensing);
    let (before, after) = kinds.split_at(structures);
    for kind in before {
        (kind.add)(&mut world, &mut chance);
    }
    if world.variables.is_empty() {
        formula::redundant(&mut world, &mut chance);
    }
    world.sense_rest(&mut chance);
    for kind in after {
        (kind.add)(&mut world, &mut chance);
    }
    world.declare(&mut chance);
    (world, chance)
}

/// Fowler, Noll and Vo's hash of names and a seed, so that a world does not depend on the order of the list of kinds.
fn hash(kinds: &[&Kind], seed: u64) -> u64 {
    let names = kinds.iter().flat_map(|it| it.name.bytes().chain([b' ']));
    let bytes = names.chain(seed.to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}
