//! Reads the settings of a fusion.

use crate::knowledge::FusionSettings;
use crate::knowledge::build::problems::Problems;
use crate::knowledge::build::quantity;
use crate::knowledge::draft::{FusionDraft, Text};
use crate::time::Span;
use alloc::format;
use core::ops::RangeInclusive;

/// The default horizon: longer than the delays of most buses.
const HORIZON: Span = Span::from_millis(500);
/// Vehicles bridge tunnels and blocked wheels by a dead reckoning of some seconds.
const UNKNOWN_AFTER: Span = Span::from_millis(2_000);
/// The share of healthy measurements that the gate accepts by default.
const GATE: f64 = 0.999;
const WINDOW: f64 = 5.0;
const PARTICLES: f64 = 1_000.0;
/// The smallest and largest number of moments that are kept.
const MOMENTS: (f64, f64) = (8.0, 512.0);

/// Every setting with its default; `None` when one is wrong.
pub(super) fn settings(problems: &mut Problems, draft: &FusionDraft) -> Option<FusionSettings> {
    let period = match &draft.period {
        None => Some(None),
        Some(text) => positive(problems, text).map(Some),
    };
    let horizon = match &draft.horizon {
        None => Some(HORIZON),
        Some(text) => quantity::span(problems, text),
    };
    let unknown_after = match &draft.unknown_after {
        None => Some(UNKNOWN_AFTER),
        Some(text) => positive(problems, text),
    };
    let gate = gate(problems, draft.gate.as_ref());
    let faulty = count(problems, draft.faulty.as_ref(), 1.0, 0.0..=63.0);
    let window = count(problems, draft.window.as_ref(), WINDOW, 1.0..=1_000.0);
    let particles = count(problems, draft.particles.as_ref(), PARTICLES, 2.0..=100_000.0);
    let seed = count(problems, draft.seed.as_ref(), 1.0, 0.0..=1e15);
    Some(FusionSettings {
        period: period?,
        horizon: horizon?,
        moments: 1,
        unknown_after: unknown_after?,
        gate: gate?,
        faulty: faulty? as usize,
        window: window? as usize,
        particles: particles? as usize,
        seed: seed? as u64,
    })
}

/// The number of moments within the horizon, estimated generously from the number of values in a second.
pub(super) fn moments(horizon: Span, pace: f64) -> usize {
    (1.5 * pace * horizon.seconds() + MOMENTS.0).min(MOMENTS.1) as usize
}

/// Whether inputs are predicted by the others.
pub(super) fn has_witnesses(problems: &mut Problems, draft: &FusionDraft) -> bool {
    match draft.witnesses.as_ref().map(|text| (text, text.text.as_str())) {
        None | Some((_, "all")) => true,
        Some((_, "none")) => false,
        Some((text, word)) => {
            problems.error(text, format!("`{word}` is neither `all` nor `none`"), "write `witnesses: none`");
            false
        }
    }
}

fn positive(problems: &mut Problems, text: &Text) -> Option<Span> {
    let read = quantity::span(problems, text)?;
    if read == Span::ZERO {
        problems.error(text, "this time is above 0", "write a time like `300 ms`, or leave it away");
        return None;
    }
    Some(read)
}

fn gate(problems: &mut Problems, text: Option<&Text>) -> Option<Option<f64>> {
    match text {
        None => Some(Some(GATE)),
        Some(text) if text.text == "none" => Some(None),
        Some(text) => share(problems, text).map(Some),
    }
}

/// A share above 0 and below 1.
pub(super) fn share(problems: &mut Problems, text: &Text) -> Option<f64> {
    let read = quantity::number(problems, text)?;
    if read > 0.0 && read < 1.0 {
        return Some(read);
    }
    problems.error(text, format!("`{}` is no share between 0 and 1", text.text), "write it like `99 %`");
    None
}

fn count(
    problems: &mut Problems,
    text: Option<&Text>,
    usual: f64,
    within: RangeInclusive<f64>,
) -> Option<f64> {
    let Some(text) = text else { return Some(usual) };
    let read = quantity::number(problems, text)?;
    if within.contains(&read) && libm::floor(read) == read {
        return Some(read);
    }
    let (least, most) = within.into_inner();
    problems.error(text, format!("`{}` is no whole number from {least} to {most}", text.text), "");
    None
}
