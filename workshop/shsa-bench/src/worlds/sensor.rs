//! How a sound sensor errs in value and time, and when its values come.

use shsa_lab::calibration::Chance;

/// How the errors of a sensor follow each other. All lie within the declared bounds, most of them on these.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pattern {
    None,
    /// Always at the upper or the lower bound.
    Constant(bool),
    Alternating,
    Uniform,
    TwoPoints,
    /// From bound to bound with this period in seconds.
    Square(f64),
    Wandering(f64),
    /// Now and then at a bound.
    Spikes,
    /// At the bound towards which the truth does not go, as with friction.
    Lagging,
    /// Normal with this share of the bound as standard deviation.
    Normal(f64),
}

impl Pattern {
    /// A random pattern; those with periods relate to the length of the world.
    pub(super) fn random(chance: &mut Chance, seconds: f64) -> Pattern {
        let period = seconds * (0.02 + 0.5 * chance.share());
        match chance.below(10) {
            0 => Pattern::None,
            1 | 2 => Pattern::Constant(chance.below(2) == 0),
            3 => Pattern::Alternating,
            4 => Pattern::Uniform,
            5 => Pattern::TwoPoints,
            6 => Pattern::Square(period),
            7 => Pattern::Wandering(period),
            8 => Pattern::Spikes,
            _ => Pattern::Lagging,
        }
    }

    /// The error of a value as a place between the bounds, from -1 to 1; `rises` says where the truth goes.
    pub(super) fn at(self, chance: &mut Chance, number: usize, time: f64, rises: bool) -> f64 {
        let side = |is_up: bool| if is_up { 1.0 } else { -1.0 };
        match self {
            Pattern::None => 0.0,
            Pattern::Constant(is_up) => side(is_up),
            Pattern::Alternating => side(number.is_multiple_of(2)),
            Pattern::Uniform => 2.0 * chance.share() - 1.0,
            Pattern::TwoPoints => side(chance.below(2) == 0),
            Pattern::Square(period) => side((time / period).rem_euclid(1.0) < 0.5),
            Pattern::Wandering(period) => (time / period * std::f64::consts::TAU).sin(),
            Pattern::Spikes if chance.below(20) == 0 => side(chance.below(2) == 0),
            Pattern::Spikes => 0.0,
            Pattern::Lagging => side(rises),
            Pattern::Normal(share) => (share * chance.normal()).clamp(-1.0, 1.0),
        }
    }
}

/// When the values of a sensor come.
#[derive(Clone, Debug, Default)]
pub(super) struct Schedule {
    /// The largest shift of a measurement, as a share of the period.
    pub(super) jitter: f64,
    /// The share of values that are lost.
    pub(super) lost: f64,
    /// Seconds from and to between which no value comes.
    pub(super) gaps: Vec<(f64, f64)>,
    /// The least and the greatest time from the measurement to the reception, beside the delay.
    pub(super) latency: (f64, f64),
    /// Values are received together, in packets of so many seconds; 0 for at once.
    pub(super) packet: f64,
    /// Whether no value overtakes another.
    pub(super) in_order: bool,
    /// The moments at which values are sent, where these do not follow a rate.
    pub(super) at: Vec<f64>,
    /// The share of values that come twice.
    pub(super) doubled: f64,
}

impl Schedule {
    /// The moments of measurement in a world of so many seconds.
    pub(super) fn moments(&self, chance: &mut Chance, rate_hz: f64, seconds: f64) -> Vec<f64> {
        if !self.at.is_empty() {
            return self.at.clone();
        }
        let phase = chance.share();
        let count = (seconds * rate_hz - phase).max(0.0) as usize;
        let mut moment = |at: usize| {
            let shift = self.jitter * (chance.share() - 0.5);
            let is_lost = chance.share() < self.lost;
            // In whole nanoseconds, as stamps are.
            let time = (1e9 * (at as f64 + phase + shift) / rate_hz).round() * 1e-9;
            let is_in = |gap: &(f64, f64)| (gap.0..gap.1).contains(&time);
            (time >= 0.0 && !is_lost && !self.gaps.iter().any(is_in)).then_some(time)
        };
        (0..count).filter_map(&mut moment).collect()
    }

    /// When a value that is ready at this time is received.
    pub(super) fn received(&self, chance: &mut Chance, ready: f64) -> f64 {
        let (least, greatest) = self.latency;
        let sent = if self.packet > 0.0 { (ready / self.packet).ceil() * self.packet } else { ready };
        sent + least + (greatest - least) * chance.share()
    }
}
