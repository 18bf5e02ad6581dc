//! The range of an axis, its ticks, and the texts of their values.

use super::{Axis, Scale};
use crate::number::number;

/// Larger values are not shown: differences and ratios of shown values must stay finite.
const LARGEST: f64 = 1e100;

/// The SI prefixes for thousands, from 10^-12 to 10^12.
const PREFIXES: [(f64, &str); 9] = [
    (1e12, "T"),
    (1e9, "G"),
    (1e6, "M"),
    (1e3, "k"),
    (1.0, ""),
    (1e-3, "m"),
    (1e-6, "µ"),
    (1e-9, "n"),
    (1e-12, "p"),
];

/// An axis with the range that it shows.
pub(super) struct Range<'a> {
    axis: &'a Axis,
    low: f64,
    high: f64,
    /// The distance of ticks on a linear axis.
    step: f64,
}

/// A place on an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tick {
    pub(super) value: f64,
    /// Minor ticks have a fainter line and no text.
    pub(super) major: bool,
}

impl Axis {
    /// Whether the axis can show a value.
    pub(super) fn shows(&self, value: f64) -> bool {
        value.abs() <= LARGEST && (self.scale == Scale::Linear || value >= 1.0 / LARGEST)
    }

    /// The range of `values`, all of which the axis can show, with round ends and about `count` ticks.
    pub(super) fn range(&self, values: impl Iterator<Item = f64>, count: f64) -> Range<'_> {
        let ends = |ends: Option<(f64, f64)>, value: f64| {
            Some(ends.map_or((value, value), |(low, high)| (low.min(value), high.max(value))))
        };
        let (low, high) = values.fold(None, ends).unwrap_or((1.0, 1.0));
        match self.scale {
            Scale::Log => self.logarithmic(low, high),
            Scale::Linear => self.linear(low, high, count),
        }
    }

    /// The range from `low` to `high` exactly, on a linear axis; about `count` ticks.
    pub(super) fn exact(&self, low: f64, high: f64, count: f64) -> Range<'_> {
        let size = low.abs().max(high.abs());
        // Bounds that are closer than the precision of their size get some room.
        let room = if high - low > 1e-9 * size { 0.0 } else { (1e-6 * size).max(0.5) };
        let (low, high) = (low - room, high + room);
        Range { axis: self, low, high, step: round_step((high - low) / count) }
    }

    fn logarithmic(&self, low: f64, high: f64) -> Range<'_> {
        let (low, high) = if low < high { (low, high) } else { (low / 2.0, high * 2.0) };
        // 3 % of room on each side, so that no marker lies on the frame.
        let room = (high / low).powf(0.03);
        Range { axis: self, low: low / room, high: high * room, step: 1.0 }
    }

    fn linear(&self, low: f64, high: f64, count: f64) -> Range<'_> {
        // The axis begins at zero when zero is near: otherwise a change by half looks like a change by all.
        let (low, high) = if low >= 0.0 && low < 0.6 * high { (0.0, high) } else { (low, high) };
        let room = if low < high { 0.0 } else { (0.5 * low.abs()).max(0.5) };
        let (low, high) = (low - room, high + room);
        let step = round_step((high - low) / count);
        Range { axis: self, low: (low / step).floor() * step, high: (high / step).ceil() * step, step }
    }
}

/// 1, 2 or 5 times a power of ten, at least `step`.
fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let round = [1.0, 2.0, 5.0].map(|digit| digit * power).into_iter().find(|round| *round >= step);
    round.unwrap_or(10.0 * power)
}

impl Range<'_> {
    /// The relative position of a value: 0 at the low end, 1 at the high end; values outside get the nearest end.
    pub(super) fn share(&self, value: f64) -> f64 {
        let share = match self.axis.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Log => (value.max(self.low) / self.low).ln() / (self.high / self.low).ln(),
        };
        share.clamp(0.0, 1.0)
    }

    /// All ticks in the range, ascending.
    pub(super) fn ticks(&self) -> Vec<Tick> {
        match self.axis.scale {
            Scale::Linear => {
                // A tolerance, so that an end that is a tick stays one after rounding.
                let first = (self.low / self.step - 1e-6).ceil();
                let last = (self.high / self.step + 1e-6).floor();
                let tick = |n: u32| Tick { value: (first + f64::from(n)) * self.step, major: true };
                (0..=(last - first).max(0.0) as u32).map(tick).collect()
            }
            Scale::Log => self.logarithmic_ticks(),
        }
    }

    fn logarithmic_ticks(&self) -> Vec<Tick> {
        let decades = (self.high / self.low).log10();
        // Each decade, or each second, third ...: about ten texts at most.
        let every = (decades / 9.0).ceil().max(1.0) as i32;
        let (first, last) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
        let is_major = |exponent: i32, digit: u32| match digit {
            1 => exponent.rem_euclid(every) == 0,
            2 | 5 => decades < 1.6,
            _ => decades < 0.5,
        };
        let digits = if decades <= 7.0 { 1..=9 } else { 1..=1 };
        let tick = |exponent: i32, digit: u32| Tick {
            value: f64::from(digit) * 10f64.powi(exponent),
            major: is_major(exponent, digit),
        };
        let ticks =
            (first..=last).flat_map(|exponent| digits.clone().map(move |digit| tick(exponent, digit)));
        ticks.filter(|tick| (self.low..=self.high).contains(&tick.value)).collect()
    }

    /// The text of a value beside its tick or in a tooltip, with its unit.
    pub(super) fn written(&self, value: f64) -> String {
        let unit = self.axis.unit.as_str();
        let magnitude = value.abs();
        let prefixed = |&&(size, _): &&(f64, &str)| magnitude >= size * 0.999_999;
        match unit {
            "" => number(value),
            "%" => format!("{} %", number(value)),
            _ if magnitude == 0.0 => format!("0 {unit}"),
            // Thousands of seconds are written in seconds.
            "s" if magnitude >= 1.0 => format!("{} s", number(value)),
            _ => {
                let (size, prefix) = PREFIXES.iter().find(prefixed).unwrap_or(&(1e-12, "p"));
                format!("{} {prefix}{unit}", number(value / size))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(unit: &str, scale: Scale) -> Axis {
        Axis { label: String::new(), unit: unit.into(), scale }
    }

    #[track_caller]
    fn check(unit: &str, scale: Scale, (low, high): (f64, f64), expected: &str) {
        let axis = axis(unit, scale);
        let range = axis.range([low, high].into_iter(), 5.0);
        let majors: Vec<String> =
            range.ticks().iter().filter(|tick| tick.major).map(|tick| range.written(tick.value)).collect();
        assert_eq!(majors.join(" | "), expected);
        for value in [low, high] {
            assert!((0.0..=1.0).contains(&range.share(value)));
        }
    }

    #[test]
    fn linear_ticks_are_round() {
        check("", Scale::Linear, (0.0, 10.0), "0 | 2 | 4 | 6 | 8 | 10");
        check("", Scale::Linear, (3.0, 47_000.0), "0 | 10,000 | 20,000 | 30,000 | 40,000 | 50,000");
        check("%", Scale::Linear, (97.2, 99.9), "97 % | 98 % | 99 % | 100 %");
        check("", Scale::Linear, (-0.3, 0.3), "−0.4 | −0.2 | 0 | 0.2 | 0.4");
        check("m", Scale::Linear, (0.0, 0.0), "−600 mm | −400 mm | −200 mm | 0 m | 200 mm | 400 mm | 600 mm");
    }

    #[test]
    fn logarithmic_ticks_are_powers_of_ten() {
        check("s", Scale::Log, (2e-6, 30.0), "10 µs | 100 µs | 1 ms | 10 ms | 100 ms | 1 s | 10 s");
        check("B", Scale::Log, (1e6, 8e8), "1 MB | 10 MB | 100 MB");
        check("", Scale::Log, (1e3, 1e6), "1,000 | 10,000 | 100,000 | 1,000,000");
        check("", Scale::Log, (1.0, 20.0), "1 | 2 | 5 | 10 | 20");
        check("s", Scale::Log, (1.0, 40_000.0), "1 s | 10 s | 100 s | 1,000 s | 10,000 s");
        check("", Scale::Log, (1e-9, 1e12), "10⁻⁹ | 10⁻⁶ | 0.001 | 1 | 1,000 | 1,000,000 | 10⁹ | 10¹²");
    }

    #[test]
    fn any_showable_range_has_few_ticks() {
        let values = [1e-100, 1e-20, 1.0, 1.0 + f64::EPSILON, 1e16, 1e16 + 2.0, 1e100];
        for scale in [Scale::Linear, Scale::Log] {
            let axis = axis("s", scale);
            for low in values {
                for high in values.into_iter().filter(|high| *high >= low) {
                    let range = axis.range([low, high].into_iter(), 6.0);
                    let majors = range.ticks().iter().filter(|tick| tick.major).count();
                    assert!(majors <= 14 && range.ticks().len() < 220, "{low} to {high}: {majors}");
                    assert!(range.share(low) <= range.share(high));
                }
            }
        }
    }
}
