//! How a signal is wrong in a stretch: the simplest form that explains what it says by what the others say.

use crate::order::{mean, median, quantile, sorted};

/// A simple form is right where it leaves this share of what the best form leaves.
const NEARLY: f64 = 1.5;

/// It must leave less than this share of what is wrong.
const EXPLAINS: f64 = 0.5;

/// Factors between units that people mix up, with words; the offset is added after the factor.
const UNITS: [(f64, f64, &str); 25] = [
    (-1.0, 0.0, "the sign is turned"),
    (1000.0, 0.0, "a factor of 1000, as between m and mm"),
    (1e-3, 0.0, "a factor of 0.001, as between mm and m"),
    (100.0, 0.0, "a factor of 100, as between m and cm, or a share and per cent"),
    (0.01, 0.0, "a factor of 0.01, as between cm and m, or per cent and a share"),
    (10.0, 0.0, "a factor of 10"),
    (0.1, 0.0, "a factor of 0.1"),
    (3.6, 0.0, "a factor of 3.6, as between m/s and km/h"),
    (1.0 / 3.6, 0.0, "a factor of 1/3.6, as between km/h and m/s"),
    (60.0, 0.0, "a factor of 60, as between minutes and seconds"),
    (1.0 / 60.0, 0.0, "a factor of 1/60, as between seconds and minutes"),
    (180.0 / std::f64::consts::PI, 0.0, "a factor of 57.3, as between radians and degrees"),
    (std::f64::consts::PI / 180.0, 0.0, "a factor of 1/57.3, as between degrees and radians"),
    (1.8, 32.0, "as between degrees Celsius and Fahrenheit"),
    (1.0 / 1.8, -32.0 / 1.8, "as between degrees Fahrenheit and Celsius"),
    (1.0, 273.15, "273.15 more, as between degrees Celsius and kelvin"),
    (1.0, -273.15, "273.15 less, as between kelvin and degrees Celsius"),
    (1.0 / 0.3048, 0.0, "a factor of 3.28, as between metres and feet"),
    (0.3048, 0.0, "a factor of 0.3048, as between feet and metres"),
    (2.236_936, 0.0, "a factor of 2.237, as between m/s and miles an hour"),
    (1.0 / 2.236_936, 0.0, "a factor of 0.447, as between miles an hour and m/s"),
    (1.943_844, 0.0, "a factor of 1.944, as between m/s and knots"),
    (1.0 / 1.943_844, 0.0, "a factor of 0.514, as between knots and m/s"),
    (9.806_65, 0.0, "a factor of 9.807, as between g and m/s^2"),
    (1.0 / 9.806_65, 0.0, "a factor of 0.102, as between m/s^2 and g"),
];

/// How near to a factor between units the fitted one must be, as a share of it.
const NEAR: f64 = 0.03;

/// How a signal is wrong. Amounts are in the signal's own unit.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// It says so much more.
    Offset(f64),
    /// It says so many times what it should.
    Scale(f64),
    /// What it says too much grows by so much a second.
    Drift(f64),
    /// It stands at this value.
    Frozen(f64),
    /// It scatters with this deviation.
    Noisy(f64),
    /// This share of its values is off, by this much.
    Spikes {
        /// The share of the values.
        share: f64,
        /// The middle size of what they are off by.
        size: f64,
    },
    /// It says what was true so many seconds before.
    Delayed(f64),
    /// It says what this other column should say.
    Swapped(usize),
    /// It is in another unit: a factor, an offset, and which units these are between.
    Unit(f64, f64, &'static str),
    /// There are no values.
    Silent,
    /// Values that are far outside of all others; so many of them, such as this one.
    Impossible(usize, f64),
    /// It is off by so much, as a root mean square, in no simple way.
    Off(f64),
}

/// What a signal says and should say at some moments, in its own unit.
#[derive(Clone, Debug, Default)]
pub(super) struct Said {
    pub(super) times: Vec<f64>,
    pub(super) own: Vec<f64>,
    pub(super) expected: Vec<f64>,
    /// What the difference usually is.
    pub(super) usual: f64,
    /// The share of its values that repeat the one before in the remaining time.
    pub(super) repeated: f64,
}

impl Said {
    /// How it is wrong; `earlier` gives what it should say some seconds before each moment.
    pub(super) fn kind(&self, delays_s: &[f64], earlier: &dyn Fn(f64) -> Vec<f64>) -> Kind {
        let errors = self.errors();
        let all = size(&errors);
        if let Some(value) = self.stands() {
            return Kind::Frozen(value);
        }
        let (factor, _, of_line) = line(&self.expected, &self.own);
        let unit = self.unit(factor);
        if let Some((factor, offset, words, left)) = unit
            && left <= 0.3 * all
            && left <= (NEARLY * of_line).max(3.0 * self.usual * factor.abs())
        {
            return Kind::Unit(factor, offset, words);
        }
        if let Some(kind) = self.spikes(&errors) {
            return kind;
        }
        let middle = median(errors.iter().copied());
        let of_offset = size(&errors.iter().map(|it| it - middle).collect::<Vec<_>>());
        let through = self.expected.iter().zip(&self.own).map(|it| it.0 * it.1).sum::<f64>()
            / self.expected.iter().map(|it| it * it).sum::<f64>();
        let of_scale =
            size(&self.expected.iter().zip(&self.own).map(|it| it.1 - through * it.0).collect::<Vec<_>>());
        let (slope, _, of_drift) = line(&self.times, &errors);
        let delayed = |lag_s: &f64| {
            let earlier = earlier(*lag_s);
            let left: Vec<f64> =
                self.own.iter().zip(&earlier).map(|(own, it)| own - it).filter(|it| it.is_finite()).collect();
            (if left.len() * 2 > self.own.len() { size(&left) } else { f64::INFINITY }, *lag_s)
        };
        let (of_delay, lag_s) = delays_s
            .iter()
            .map(delayed)
            .min_by(|one, other| one.0.total_cmp(&other.0))
            .unwrap_or((f64::INFINITY, 0.0));
        let forms = [
            (of_offset, Kind::Offset(middle)),
            (of_scale, Kind::Scale(through)),
            (of_delay, Kind::Delayed(lag_s)),
            (of_drift, Kind::Drift(slope)),
        ];
        let best = forms.iter().map(|it| it.0).fold(f64::INFINITY, f64::min);
        let is_right = |it: &&(f64, Kind)| it.0 <= (NEARLY * best).max(self.usual) && it.0 <= EXPLAINS * all;
        match forms.iter().find(is_right) {
            Some((_, kind)) => kind.clone(),
            None if self.is_rough(&errors) => Kind::Noisy(of_offset),
            None => Kind::Off(all),
        }
    }

    fn errors(&self) -> Vec<f64> {
        self.own.iter().zip(&self.expected).map(|(own, expected)| own - expected).collect()
    }

    /// The value at which it stands for nearly all of the stretch, though it should move, and else does.
    fn stands(&self) -> Option<f64> {
        let value = median(self.own.iter().copied());
        let same = self.own.iter().filter(|it| **it == value).count() as f64 / self.own.len().max(1) as f64;
        let moves = |of: &[f64]| {
            let sorted = sorted(of.iter().copied());
            quantile(&sorted, 0.9).unwrap_or(0.0) - quantile(&sorted, 0.1).unwrap_or(0.0)
        };
        (same > 0.9
            && self.own.len() > 4
            && (self.repeated < 0.5 || moves(&self.expected) > 2.0 * self.usual))
            .then_some(value)
    }

    /// The known factor that is nearest, with what it leaves.
    fn unit(&self, fitted: f64) -> Option<(f64, f64, &'static str, f64)> {
        let left = |(factor, offset, words): &(f64, f64, &'static str)| {
            let left: Vec<f64> =
                self.own.iter().zip(&self.expected).map(|(own, it)| own - factor * it - offset).collect();
            (*factor, *offset, *words, size(&left))
        };
        let is_near = |it: &(f64, f64, &'static str, f64)| {
            let through = self
                .own
                .iter()
                .zip(&self.expected)
                .map(|(own, expected)| (own - it.1) * expected)
                .sum::<f64>()
                / self.expected.iter().map(|it| it * it).sum::<f64>();
            (through / it.0 - 1.0).abs() < NEAR || (fitted / it.0 - 1.0).abs() < NEAR
        };
        UNITS.iter().map(left).filter(is_near).min_by(|one, other| one.3.total_cmp(&other.3))
    }

    fn spikes(&self, errors: &[f64]) -> Option<Kind> {
        let most = 4.0 * self.usual;
        let off: Vec<f64> = errors.iter().map(|it| it.abs()).filter(|it| *it > most).collect();
        let share = off.len() as f64 / errors.len().max(1) as f64;
        let near = sorted(errors.iter().map(|it| it.abs()));
        let is_else_sound = quantile(&near, 0.5).unwrap_or(0.0) <= 2.0 * self.usual;
        let runs = errors.windows(2).filter(|it| it[0].abs() > most && it[1].abs() > most).count();
        let is_single = off.len() > 2 * runs || off.len() == 1;
        (share < 0.4 && !off.is_empty() && is_else_sound && is_single)
            .then(|| Kind::Spikes { share, size: median(off.iter().copied()) })
    }

    /// Whether errors change from one moment to the next.
    fn is_rough(&self, errors: &[f64]) -> bool {
        let middle = mean(errors);
        let all: f64 = errors.iter().map(|it| (it - middle).powi(2)).sum();
        let next: f64 = errors.windows(2).map(|it| (it[0] - middle) * (it[1] - middle)).sum();
        next < 0.5 * all
    }
}

/// The root of the mean square.
pub(super) fn size(values: &[f64]) -> f64 {
    (values.iter().map(|it| it * it).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The line through pairs, with what it leaves: factor, offset, root mean square.
fn line(x: &[f64], y: &[f64]) -> (f64, f64, f64) {
    let (at, of) = (mean(x), mean(y));
    let both: f64 = x.iter().zip(y).map(|it| (it.0 - at) * (it.1 - of)).sum();
    let own: f64 = x.iter().map(|it| (it - at).powi(2)).sum();
    let factor = if own > 0.0 { both / own } else { 0.0 };
    let left: Vec<f64> = x.iter().zip(y).map(|it| it.1 - of - factor * (it.0 - at)).collect();
    (factor, of - factor * at, size(&left))
}
