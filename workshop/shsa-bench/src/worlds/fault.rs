//! Faults of sensors, and by how much these make them err.

use super::readings::Reading;
use super::world::World;
use shsa_lab::calibration::Chance;

/// The form of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    Bias,
    /// Grows until it is three times as large as it has to be.
    Drift,
    Scale,
    Stuck,
    Noise,
    Drop,
    /// Values are of some time ago, with fresh stamps.
    Late,
}

pub(super) const FORMS: [Form; 7] =
    [Form::Bias, Form::Drift, Form::Scale, Form::Stuck, Form::Noise, Form::Drop, Form::Late];

/// A fault of a signal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fault {
    pub(super) signal: usize,
    pub(super) form: Form,
    /// In SI, with its sign.
    pub(super) size: f64,
    /// In seconds.
    pub(super) from: f64,
    pub(super) to: f64,
}

impl Fault {
    pub(super) fn told(&self) -> String {
        format!("s{} {:?} {:.3} from {:.1} to {:.1} s", self.signal, self.form, self.size, self.from, self.to)
    }
}

/// The readings with a fault; copies of the faulty signal err with it.
pub(super) fn inject(world: &World, chance: &mut Chance, readings: &[Reading], fault: Fault) -> Vec<Reading> {
    let is_of =
        |it: &Reading| is_wrong(world, it.signal, fault.signal) && (fault.from..fault.to).contains(&it.at);
    let first = readings.iter().find(|it| it.signal == fault.signal && it.at >= fault.from);
    let mut all: Vec<Reading> = Vec::new();
    for reading in readings {
        if !is_of(reading) {
            all.push(reading.clone());
        } else if fault.form != Form::Drop {
            all.push(Reading { values: wrong(world, chance, reading, fault, first), ..reading.clone() });
        }
    }
    all
}

/// Whether a signal errs with a faulty one: it is this, or copied from it.
pub(super) fn is_wrong(world: &World, signal: usize, liar: usize) -> bool {
    let copies = || world.signals.get(signal).and_then(|it| it.copies);
    signal == liar || copies().is_some_and(|of| is_wrong(world, of, liar))
}

fn wrong(
    world: &World,
    chance: &mut Chance,
    reading: &Reading,
    fault: Fault,
    first: Option<&Reading>,
) -> Vec<f64> {
    let signal = &world.signals[reading.signal];
    let since = (reading.at - fault.from) / (fault.to - fault.from);
    let one = |(element, raw): (usize, &f64)| {
        let sound = world.meant(signal, *raw);
        let ago = 40.0 / signal.rate_hz;
        let si = match fault.form {
            Form::Bias => sound + fault.size,
            Form::Drift => sound + 3.0 * fault.size * since,
            Form::Scale => sound * (1.0 + fault.size / middle(world, signal.variable)),
            Form::Stuck => {
                first.map_or(sound, |it| world.meant(&world.signals[fault.signal], it.values[element]))
            }
            Form::Noise => sound + 2.0 * fault.size * (2.0 * chance.share() - 1.0),
            Form::Late => {
                sound - world.content(signal, element, reading.at)
                    + world.content(signal, element, reading.at - ago)
            }
            Form::Drop => sound,
        };
        world.raw(signal, si)
    };
    reading.values.iter().enumerate().map(one).collect()
}

/// The middle of a variable's values, away from zero.
fn middle(world: &World, variable: usize) -> f64 {
    let (lo, hi) = world.extremes(variable);
    let middle = 0.5 * (lo + hi);
    if middle.abs() > 0.1 * (hi - lo) { middle } else { hi - lo }
}

impl World {
    /// How many readings of a signal err by at least this much while a fault lasts, and how many there are.
    pub(super) fn far_off(&self, readings: &[Reading], fault: Fault, least: f64) -> (usize, usize) {
        let signal = &self.signals[fault.signal];
        let variable = &self.variables[signal.variable];
        let during = |it: &&Reading| it.signal == fault.signal && (fault.from..fault.to).contains(&it.at);
        let is_off = |it: &&Reading| {
            it.values.iter().enumerate().any(|(element, raw)| {
                let off = self.meant(signal, *raw) - self.content(signal, element, it.at);
                let off = variable.wraps.map_or(off, |turn| off - turn * (off / turn).round());
                off.abs() >= least
            })
        };
        let all = readings.iter().filter(during);
        (all.clone().filter(is_off).count(), all.count())
    }
}
