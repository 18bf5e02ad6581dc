//! True values over time.

use shsa_lab::calibration::Chance;
use std::f64::consts::TAU;
use std::sync::Arc;

/// A quantity in SI over the seconds of a world.
pub(super) type Course = Arc<dyn Fn(f64) -> f64 + Send + Sync>;

/// Sine waves about a middle: what can be integrated and differentiated exactly.
#[derive(Clone, Debug)]
pub(super) struct Waves {
    pub(super) middle: f64,
    /// Size, angular frequency, phase.
    terms: Vec<(f64, f64, f64)>,
}

impl Waves {
    /// One or two waves that together stay within `size` of the middle, none faster than `shortest` seconds a period.
    pub(super) fn random(chance: &mut Chance, middle: f64, size: f64, shortest: f64, longest: f64) -> Waves {
        let share = 0.3 + 0.7 * chance.share();
        let wave = |share: f64, chance: &mut Chance| {
            (share * size, TAU / between(chance, shortest, longest), TAU * chance.share())
        };
        let terms = vec![wave(share, chance), wave(1.0 - share, chance)];
        Waves { middle, terms }
    }

    pub(super) fn at(&self, time: f64) -> f64 {
        self.middle
            + self.terms.iter().map(|(size, speed, phase)| size * (speed * time + phase).sin()).sum::<f64>()
    }

    pub(super) fn integral(&self, time: f64) -> f64 {
        let wave = |(size, speed, phase): &(f64, f64, f64)| -size / speed * (speed * time + phase).cos();
        self.middle * time + self.terms.iter().map(wave).sum::<f64>()
    }

    /// The largest rate of change.
    pub(super) fn steepest(&self) -> f64 {
        self.terms.iter().map(|(size, speed, _)| (size * speed).abs()).sum()
    }

    pub(super) fn course(&self) -> Course {
        let waves = self.clone();
        Arc::new(move |time| waves.at(time))
    }
}

/// A number between two others, its logarithm uniform.
pub(super) fn between(chance: &mut Chance, low: f64, high: f64) -> f64 {
    low * (high / low).powf(chance.share())
}

/// Rises and falls at one rate.
fn triangle(turns: f64) -> f64 {
    4.0 * (turns - (turns + 0.5).floor()).abs() - 1.0
}

/// Of -1 to 1: rests, ramps to another level, rests.
fn ramps(turns: f64) -> f64 {
    (3.0 * triangle(turns)).clamp(-1.0, 1.0)
}

/// Goes to and fro within `size` of the middle: as waves, at one rate, or from rest to rest; or it stands still.
pub(super) fn free(chance: &mut Chance, middle: f64, size: f64, shortest: f64, longest: f64) -> Course {
    let (period, phase) = (between(chance, shortest, longest), chance.share());
    match chance.below(8) {
        0 => Arc::new(move |_| middle),
        1 | 2 => Arc::new(move |time| middle + size * triangle(time / period + phase)),
        3 => Arc::new(move |time| middle + size * ramps(time / period + phase)),
        _ => Waves::random(chance, middle, size, shortest, longest).course(),
    }
}

/// One of these levels for a while, then another one; and when it changes.
pub(super) fn levels(chance: &mut Chance, levels: &[f64], period: f64, seconds: f64) -> (Course, Vec<f64>) {
    let mut steps: Vec<(f64, f64)> = Vec::new();
    let mut time = f64::NEG_INFINITY;
    while time < seconds {
        steps.push((time, levels[chance.below(levels.len())]));
        let next = time.max(-period) + period * (0.5 + chance.share());
        // In whole nanoseconds, as stamps are.
        time = (1e9 * next).round() * 1e-9;
    }
    let times = steps.iter().map(|step| step.0.max(0.0)).filter(|it| *it < seconds).collect();
    (Arc::new(move |time| steps[steps.partition_point(|step| step.0 <= time).max(1) - 1].1), times)
}
