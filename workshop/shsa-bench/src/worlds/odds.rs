//! What printed probabilities are worth: how often signals are faulty that were printed as faulty with a probability.

use super::fault::{Fault, Form, inject};
use super::kinds::{Kind, world};
use super::watch::{ORIGIN, known, run, seconds};
use super::written::Names;
use shsa_core::engine::EventKind;
use shsa_core::knowledge::Id;
use shsa_drawing::{Axis, Chart, Point, Scale, Series};

/// Verdicts of one tenth of probability: count, sum of probabilities, right ones.
pub(super) type Tenths = [(usize, f64, usize); 10];

/// The probabilities of a fault that signals declare: some sensors are worse than others.
const PRIORS: [f64; 4] = [0.002, 0.01, 0.05, 0.2];
/// How often signals are drawn until one or two are faulty.
const DRAWS: usize = 1000;

/// The verdicts in a world in which one or two signals lie, drawn by the probabilities that they declare.
///
/// # Errors
/// The generator has written a model that is none.
pub(super) fn watch(kinds: &[&Kind], seed: u64, tenths: &mut Tenths) -> anyhow::Result<()> {
    let (mut world, mut chance) = world(kinds, seed, 2.0);
    let sound = world.readings(&mut chance);
    if world.untrue(&sound).is_some() {
        return Ok(());
    }
    let priors: Vec<f64> = world.signals.iter().map(|_| PRIORS[chance.below(PRIORS.len())]).collect();
    for (signal, prior) in world.signals.iter_mut().zip(&priors) {
        signal.keys = format!("properties: {{ prior: {prior} }}");
    }
    let draw = |_| {
        (0..priors.len())
            .filter(|it| world.signals[*it].copies.is_none() && chance.share() < priors[*it])
            .collect()
    };
    let Some(liars) = (0..DRAWS).map(draw).find(|it: &Vec<usize>| matches!(it.len(), 1 | 2)) else {
        return Ok(());
    };
    let (from, to) = (0.4 * world.seconds, world.seconds);
    let mut readings = sound;
    for liar in &liars {
        let Some(hidden) = world.hidden(*liar) else { return Ok(()) };
        let side = if chance.below(2) == 0 { 1.0 } else { -1.0 };
        let size = side * hidden * (1.2 + 2.0 * chance.share());
        readings =
            inject(&world, &mut chance, &readings, Fault { signal: *liar, form: Form::Bias, size, from, to });
    }
    let run = run(&world, known(&world)?, &readings, Names::Plain, ORIGIN);
    for event in run.events.iter().filter(|it| matches!(it.kind, EventKind::Suspected | EventKind::Failed)) {
        let (Some(signal), Some(probability)) = (event.signal, event.probability) else { continue };
        if signal.index() < world.signals.len() && seconds(event.time) >= from {
            let tenth = &mut tenths[((10.0 * probability) as usize).min(9)];
            tenth.0 += 1;
            tenth.1 += probability;
            tenth.2 +=
                usize::from(liars.iter().any(|it| super::fault::is_wrong(&world, signal.index(), *it)));
        }
    }
    Ok(())
}

/// The share of right verdicts over what was printed, by tenths, with the deviation that so many verdicts leave.
pub(super) fn chart(tenths: &Tenths) -> Chart {
    let point = |(count, sum, right): &(usize, f64, usize)| {
        let all = *count as f64;
        let (x, y) = (sum / all, *right as f64 / all);
        let deviation = (x * (1.0 - x) / all).sqrt();
        Point { x, low: (y - deviation).max(0.0), y, high: (y + deviation).min(1.0) }
    };
    let points = tenths.iter().filter(|it| it.0 > 0).map(point).collect();
    let line = [0.0, 1.0].map(|at| Point { x: at, low: at, y: at, high: at });
    let axis = |label: &str| Axis { label: label.to_owned(), unit: String::new(), scale: Scale::Linear };
    Chart {
        title: "Verdicts by their printed probability".to_owned(),
        x: axis("printed probability"),
        y: axis("share of right verdicts"),
        series: vec![
            Series { name: "verdicts".to_owned(), points },
            Series { name: "as printed".to_owned(), points: line.to_vec() },
        ],
    }
}
