//! How the sensors of a world are, whatever it is made of.

use crate::worlds::course::between;
use crate::worlds::sensor::Pattern;
use crate::worlds::unit::TEMPERATURE;
use crate::worlds::world::{Signal, Variable, World};
use shsa_lab::calibration::Chance;

/// Changes each signal with a probability of two thirds, and at least one.
fn most(world: &mut World, chance: &mut Chance, change: impl Fn(&mut Signal, &mut Chance)) {
    let first = chance.below(world.signals.len());
    for (at, signal) in world.signals.iter_mut().enumerate() {
        if at == first || chance.below(3) > 0 {
            change(signal, chance);
        }
    }
}

pub(super) fn delays(world: &mut World, chance: &mut Chance) {
    most(world, chance, |signal, chance| {
        let side = [1.0, 1.0, -1.0][chance.below(3)];
        signal.delay += side * between(chance, 0.1, 6.0) / signal.rate_hz;
    });
}

pub(super) fn stamps(world: &mut World, chance: &mut Chance) {
    most(world, chance, |signal, chance| {
        let size = between(chance, 0.05, 3.0) / signal.rate_hz;
        signal.time_error = [(-size, size), (0.0, size), (-size, 0.0), (0.2 * size, size)][chance.below(4)];
    });
}

pub(super) fn lost(world: &mut World, chance: &mut Chance) {
    world.has_losses = true;
    let seconds = world.seconds;
    most(world, chance, |signal, chance| {
        signal.schedule.lost = [0.0, 0.1, 0.5, 0.8][chance.below(4)];
        let from = seconds * chance.share();
        signal.schedule.gaps.push((from, from + seconds * between(chance, 0.01, 0.4)));
    });
}

pub(super) fn bursts(world: &mut World, chance: &mut Chance) {
    world.has_losses = true;
    most(world, chance, |signal, chance| {
        if signal.schedule.at.is_empty() {
            signal.schedule.packet = (between(chance, 1.5, 12.0) / signal.rate_hz).min(LATEST_S);
        }
    });
}

/// The longest undeclared latency: stamps that are further behind mean a wrong clock.
const LATEST_S: f64 = 5.0;

pub(super) fn late(world: &mut World, chance: &mut Chance) {
    world.has_losses = true;
    most(world, chance, |signal, chance| {
        if signal.schedule.at.is_empty() {
            let late = (between(chance, 0.2, 10.0) / signal.rate_hz).min(LATEST_S);
            signal.schedule.latency = (late, late * 1.02);
        }
    });
}

pub(super) fn unordered(world: &mut World, chance: &mut Chance) {
    world.has_losses = true;
    most(world, chance, |signal, chance| {
        signal.schedule.latency.1 = (between(chance, 0.5, 4.0) / signal.rate_hz).min(LATEST_S);
        signal.schedule.in_order = false;
        signal.schedule.doubled = [0.0, 0.2][chance.below(2)];
    });
}

pub(super) fn hold(world: &mut World, chance: &mut Chance) {
    // Without a largest rate, what stands does not change until the next value.
    world.is_rated = true;
    let is_vector: Vec<bool> = world.variables.iter().map(|it| it.is_vector).collect();
    most(world, chance, |signal, _| signal.holds |= !is_vector[signal.variable] && signal.mean_over == 0.0);
}

pub(super) fn on_change(world: &mut World, chance: &mut Chance) {
    // Who speaks rarely tells and is trusted again late.
    world.has_losses = true;
    let before = world.clone();
    most(world, chance, |signal, chance| {
        let variable = &before.variables[signal.variable];
        let is_usual = !variable.is_vector && signal.mean_over == 0.0 && signal.schedule.at.is_empty();
        if !is_usual || variable.wraps.is_some() {
            return;
        }
        signal.holds = true;
        signal.declares_rate = false;
        let period = 1.0 / signal.rate_hz;
        let course = &variable.courses[0];
        // It looks each period, and what it sends takes a while.
        let lasts = period + signal.schedule.latency.1 + signal.schedule.packet;
        let moves = |from: f64, value: f64| {
            let times = (0..=16).map(|at| from + lasts * f64::from(at) / 16.0);
            times.map(|time| (course(time) - value).abs()).fold(0.0, f64::max)
        };
        let moments: Vec<f64> =
            (0..(before.seconds / period) as usize).map(|at| (at as f64 + 0.5) * period).collect();
        let fastest = moments.iter().map(|at| moves(*at, course(*at))).fold(0.0, f64::max);
        signal.dead_band = (before.size(signal.variable) * between(chance, 0.02, 0.6)).max(1.1 * fastest);
        let mut sent = f64::INFINITY;
        for moment in moments {
            if moves(moment, sent) > 0.99 * signal.dead_band {
                sent = course(moment);
                signal.schedule.at.push((1e9 * moment).round() * 1e-9);
            }
        }
    });
}

pub(super) fn saturates(world: &mut World, chance: &mut Chance) {
    // A witness at its end knows nothing of a fault.
    world.has_losses = true;
    for variable in 0..world.variables.len() {
        let (lo, hi) = world.extremes(variable);
        let room = world.size(variable) * between(chance, 0.1, 3.0);
        let own = &mut world.variables[variable];
        if own.range.is_none() && own.wraps.is_none() {
            own.range = Some((lo - room, hi + room));
        }
    }
    let before = world.clone();
    most(world, chance, |signal, chance| {
        let (lo, hi) = before.extremes(signal.variable);
        let end = |chance: &mut Chance| lo + (hi - lo) * chance.share();
        let (one, other) = (end(chance), end(chance));
        let ends = [(one, f64::INFINITY), (f64::NEG_INFINITY, one), (one.min(other), one.max(other))];
        if before.variables[signal.variable].wraps.is_none() && signal.mean_over == 0.0 {
            signal.ends = Some(ends[chance.below(3)]);
        }
    });
}

pub(super) fn noise(world: &mut World, chance: &mut Chance) {
    // Statistics look closer than the neighbours of a sample bound it.
    world.is_rated = true;
    most(world, chance, |signal, chance| {
        let half = 0.5 * (signal.error.1 - signal.error.0);
        let share = between(chance, 0.1, 0.4);
        signal.error = (-half, half);
        signal.noise = Some(share * half);
        signal.pattern = Pattern::Normal(share);
    });
}

pub(super) fn relative(world: &mut World, chance: &mut Chance) {
    // A share of what wraps, or of degrees, means little.
    let has_share = |it: &Variable| it.wraps.is_none() && it.dimension != TEMPERATURE;
    let has_share: Vec<bool> = world.variables.iter().map(has_share).collect();
    most(world, chance, |signal, chance| {
        if !has_share[signal.variable] {
            return;
        }
        let half = 0.5 * (signal.error.1 - signal.error.0);
        signal.error = (-half, half);
        signal.share = between(chance, 0.001, 0.2);
    });
}

pub(super) fn scaled(world: &mut World, chance: &mut Chance) {
    most(world, chance, |signal, chance| {
        let scale = between(chance, 1e-3, 10.0) * [1.0, -1.0][chance.below(2)];
        signal.scaling = Some((scale, 100.0 * (chance.share() - 0.5)));
    });
}

pub(super) fn copies(world: &mut World, chance: &mut Chance) {
    for _ in 0..1 + chance.below(2) {
        let of = chance.below(world.signals.len());
        let copy = Signal { copies: Some(of), ..world.signals[of].clone() };
        world.signals.push(copy);
    }
}

pub(super) fn causes(world: &mut World, chance: &mut Chance) {
    for cause in 0..1 + chance.below(2) {
        most(world, chance, |signal, _| signal.causes.push(cause));
    }
}

pub(super) fn rates(world: &mut World, chance: &mut Chance) {
    let tempo = world.tempo_hz;
    // Slower ones only where a declared rate bounds the truth between their values.
    let slowest = if world.is_rated { 0.03 } else { 0.25 };
    most(world, chance, |signal, chance| {
        signal.rate_hz = (tempo * between(chance, slowest, 30.0)).clamp(0.05, 200.0);
    });
}
