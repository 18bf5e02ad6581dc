//! Signals that repeat another one with its noise, exactly or but for rounding: they are no independent witnesses.

use crate::learning::least_squares::solve;
use crate::learning::rounded;
use crate::learning::shape::Copied;
use crate::learning::signal::Seen;

/// The relative rounding of written numbers.
const ROUNDED: f64 = 2e-6;

/// A signal that moves by less than this many roundings equals others by chance.
const BEYOND_ROUNDING: f64 = 100.0;

/// Signals with fewer different values, and fewer changes between these, equal others by chance.
const LEAST_VALUES: usize = 50;
const LEAST_CHANGES: usize = 15;

/// How many values are compared before all of them.
const SAMPLES: usize = 64;

/// What the comparisons of a signal with each other one need of its values.
struct Shape {
    signal: usize,
    /// The indices of the smallest and of the largest value.
    extremes: [usize; 2],
    /// The largest size of a value.
    largest: f64,
    /// Whether it has enough different values or changes.
    is_varied: bool,
    /// The step to which its values are rounded; 0 where there is none.
    step: f64,
}

impl Shape {
    /// The shape of a signal's values; `None` where there are too few. Time: O(n log n).
    fn of(signal: usize, values: &[f64]) -> Option<Shape> {
        if values.len() < LEAST_VALUES {
            return None;
        }
        let by_value = |one: &usize, other: &usize| values[*one].total_cmp(&values[*other]);
        let extremes = [(0..values.len()).min_by(by_value)?, (0..values.len()).max_by(by_value)?];
        let largest = values.iter().map(|it| it.abs()).fold(0.0, f64::max);
        let is_varied = changes(values) >= LEAST_CHANGES || different(values) >= LEAST_VALUES;
        Some(Shape { signal, extremes, largest, is_varied, step: rounded::step(values) })
    }
}

/// All copies; of two signals with the same values, the later one counts as the copy; of two that differ by rounding, the coarser one.
///
/// Time: O(signals^2), and O(n) for each two signals that look alike.
pub(crate) fn all(seen: &Seen<'_>) -> Vec<Copied> {
    let shape = |signal: usize| Shape::of(signal, seen.curves[signal].values());
    let shapes: Vec<Shape> = (0..seen.signals.len()).filter_map(shape).collect();
    let mut copies: Vec<Copied> = Vec::new();
    for (at, shape) in shapes.iter().enumerate().filter(|(_, shape)| shape.is_varied) {
        let is_original = |it: &&Shape| copies.iter().all(|copy| copy.signal != it.signal);
        if let Some(copy) = shapes[..at].iter().filter(is_original).find_map(|of| copied(seen, shape, of)) {
            copies.iter_mut().filter(|it| it.of == copy.signal).for_each(|it| it.follow(&copy));
            copies.push(copy);
        }
    }
    copies
}

fn copied(seen: &Seen<'_>, shape: &Shape, original: &Shape) -> Option<Copied> {
    let (own, other) = (&seen.curves[shape.signal], &seen.curves[original.signal]);
    let have_one_length = own.values().len() == other.values().len();
    if !have_one_length || !look_alike(seen, shape, original) || own.times() != other.times() {
        return None;
    }
    exact(seen, shape, original)
        .or_else(|| rounded::of(seen, (shape.signal, shape.step), (original.signal, original.step)))
}

/// A copy that differs by the digits of written numbers alone.
fn exact(seen: &Seen<'_>, shape: &Shape, original: &Shape) -> Option<Copied> {
    let (own, other) = (&seen.curves[shape.signal], &seen.curves[original.signal]);
    let columns = [other.values().to_vec(), vec![1.0; other.values().len()]];
    let numbers = solve(&columns, own.values(), |_| true)?;
    let (factor, offset) = (numbers[0], numbers[1]);
    let rounded = ROUNDED * (shape.largest + factor.abs() * original.largest);
    let is_exact = |(own, other): (&f64, &f64)| (own - factor * other - offset).abs() <= rounded;
    let is_copy = own.values().iter().zip(other.values()).all(is_exact)
        && crate::order::variance(own.values()).sqrt() > BEYOND_ROUNDING * rounded;
    is_copy.then_some(Copied { signal: shape.signal, of: original.signal, factor, offset })
}

/// Whether some values lie on the line through the original's extremes. A copy is within a rounding of its own line everywhere, so it
/// is within two of this one; twice that is allowed, as the factors of the two lines differ a little.
fn look_alike(seen: &Seen<'_>, shape: &Shape, original: &Shape) -> bool {
    let (own, other) = (seen.curves[shape.signal].values(), seen.curves[original.signal].values());
    let [least, most] = original.extremes;
    let factor = (own[most] - own[least]) / (other[most] - other[least]);
    let offset = own[least] - factor * other[least];
    let rounded = ROUNDED * (shape.largest + factor.abs() * original.largest)
        + 0.5 * (shape.step + factor.abs() * original.step);
    let mut samples = own.iter().zip(other).step_by(own.len().div_ceil(SAMPLES));
    samples.all(|(own, other)| (own - factor * other - offset).abs() <= 4.0 * rounded)
}

/// The number of different values.
fn different(values: &[f64]) -> usize {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.dedup();
    sorted.len()
}

/// How often a value differs from the one before.
fn changes(values: &[f64]) -> usize {
    values.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::Chance;
    use crate::learning::signal::Signal;
    use proptest::prelude::*;
    use shsa_core::unit::Unit;

    fn depth(time: f64) -> f64 {
        10.0 + 3.0 * (time / 40.0).sin() + (time / 13.0).cos()
    }

    fn signal(unit: Option<&str>, step: f64, value: impl FnMut(f64) -> f64) -> Signal {
        let round = |value: f64| (value / step).round() * step;
        let values = (0..600).map(f64::from).map(value).map(round);
        let points = values.enumerate().map(|(at, value)| (at as f64, value)).collect();
        Signal { name: "one".to_owned(), unit: unit.map(|it| Unit::parse(it).unwrap()), points }
    }

    /// The copy and its original among two signals.
    #[track_caller]
    fn check(signals: [Signal; 2], expected: &[(usize, usize)]) {
        let found = all(&Seen::new(&signals));
        assert_eq!(found.iter().map(|it| (it.signal, it.of)).collect::<Vec<_>>(), expected, "{found:?}");
    }

    #[test]
    fn one_measurement_in_two_units_is_a_copy_of_the_finer_one() {
        let feet = |unit| signal(unit, 0.1, |time| depth(time) / 0.3048);
        let metres = |unit| signal(unit, 0.01, depth);
        check([feet(Some("ft")), metres(Some("m"))], &[(0, 1)]);
        check([metres(Some("m")), feet(Some("ft"))], &[(1, 0)]);
        check([feet(None), metres(None)], &[(0, 1)]);
        check([metres(Some("m")), signal(Some("m"), 0.1, depth)], &[(1, 0)]);
        let fahrenheit = signal(None, 0.1, |time| 1.8 * depth(time) + 32.0);
        check([metres(None), fahrenheit], &[(1, 0)]);
    }

    /// One measurement as two displays show it, with noise of their own: units, steps in the unit of the second one, and whether digits
    /// are cut off or rounded.
    #[derive(Clone, Debug)]
    struct Shown {
        units: [&'static str; 2],
        are_known: bool,
        steps: [f64; 2],
        is_cut: bool,
        is_single: bool,
        noise: f64,
        waves: [f64; 4],
        seed: u64,
    }

    impl Shown {
        fn signals(&self) -> [Signal; 2] {
            let mut chance = Chance::new(self.seed);
            let units = self.units.map(|it| Unit::parse(it).unwrap());
            let [one, two, offset, size] = self.waves;
            let coarse = self.steps[0] + self.steps[1];
            let value = |time: f64| {
                coarse
                    * (offset
                        + size * ((time / one).sin() + 0.5 * (time / two).cos() + 0.1 * (time / 3.1).sin()))
            };
            [0, 1].map(|at| {
                let step = self.steps[at] * units[1].scale / units[at].scale;
                let points = (0..700).map(f64::from).map(|time| {
                    let measured = value(time) + self.noise * coarse * chance.normal();
                    let steps = units[at].from_si(units[1].to_si(measured)) / step;
                    let written = step * if self.is_cut { steps.floor() } else { steps.round() };
                    (time, if self.is_single { f64::from(written as f32) } else { written })
                });
                let unit = self.are_known.then(|| units[at].clone());
                Signal { name: format!("shown_{at}"), unit, points: points.collect() }
            })
        }
    }

    /// Steps that differ by their size: 0.001 and 0.05, say.
    fn shown(noise: f64) -> impl Strategy<Value = Shown> {
        let units = prop::sample::select(vec![
            ["m", "ft"],
            ["ft", "m"],
            ["m", "m"],
            ["degC", "degF"],
            ["degF", "degC"],
            ["m/s", "km/h"],
            ["kPa", "psi"],
            ["rad", "deg"],
            ["km/h", "m/s"],
        ]);
        let steps = (1..=3_i32, 1.6..30.0_f64, any::<bool>()).prop_map(|(tens, ratio, is_first)| {
            let fine = 0.1_f64.powi(tens);
            if is_first { [fine * ratio, fine] } else { [fine, fine * ratio] }
        });
        let waves = [30.0..90.0_f64, 11.0..25.0_f64, -200.0..200.0_f64, 20.0..200.0_f64];
        (units, any::<bool>(), steps, any::<[bool; 2]>(), waves, any::<u64>()).prop_map(
            move |(units, are_known, steps, [is_cut, is_single], waves, seed)| Shown {
                units,
                are_known,
                steps,
                is_cut,
                is_single,
                noise,
                waves,
                seed,
            },
        )
    }

    proptest! {
        #[test]
        fn two_displays_of_one_measurement_are_a_copy_of_the_finer_one(shown in shown(0.0)) {
            let coarse = usize::from(shown.steps[1] > shown.steps[0]);
            let found = all(&Seen::new(&shown.signals()));
            prop_assert_eq!(found.iter().map(|it| (it.signal, it.of)).collect::<Vec<_>>(), [(coarse, 1 - coarse)]);
        }

        #[test]
        fn noise_beyond_rounding_shows_two_sensors(shown in shown(0.5)) {
            prop_assert_eq!(all(&Seen::new(&shown.signals())), []);
        }
    }

    #[test]
    fn two_sensors_are_no_copies() {
        let mut chance = Chance::new(1);
        let mut chance = || chance.share() - 0.5;
        let mut noisy = |unit, step, factor: f64, noise: f64| {
            signal(unit, step, |time| (depth(time) + 3.5 * noise * chance()) * factor)
        };
        check([noisy(Some("m"), 0.01, 1.0, 0.005), noisy(Some("m"), 0.01, 1.0, 0.005)], &[]);
        check([noisy(Some("m"), 0.01, 1.0, 0.02), noisy(Some("ft"), 0.1, 1.0 / 0.3048, 0.02)], &[]);
        check([noisy(Some("m"), 0.01, 1.0, 0.0), noisy(Some("m"), 0.1, 1.013, 0.0)], &[]);
        check([noisy(None, 0.01, 1.0, 0.0), noisy(None, 0.1, 2.7, 0.0)], &[]);
    }
}
