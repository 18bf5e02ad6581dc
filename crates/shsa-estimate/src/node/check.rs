//! Checks of a fusion by algebra: whether it can be set up, and which states its inputs observe.
//!
//! States are observed if the derivatives of the measurements along a run, by the initial states, have full rank (the
//! observability matrix of R. E. Kalman 1960; for nonlinear systems along a trajectory: R. Hermann, A. Krener 1977,
//! doi:10.1109/TAC.1977.1101601). Formulas may have no derivative at a special point, such as a bearing at rest, so the run
//! begins next to the initial state. Some states show only where others move, as the offset of a sensor where a curve is steep and
//! where it is flat: so the run goes on for an hour and a half, and what noise moves, and an input shows in proportion, moves.

use super::{build, noise};
use crate::continuous::Continuous;
use crate::matrix::Matrix;
use crate::system::System;
use nalgebra::SVD;
use shsa_core::knowledge::{Diagnostic, Fusion, FusionMethod, FusionState, KnowledgeBase, Place, Severity};

/// Seconds between two points of the run: long enough to show what grows with time.
const STEP_S: f64 = 1.0;
/// After a step for each state this many steps follow, each so many times as long as the one before.
const LONG_STEPS: i32 = 7;
const LONGER: f64 = 4.0;
/// How far a state is moved at each step, in its initial deviations.
const MOVES: [f64; 4] = [0.7, -0.4, 0.5, -0.9];
/// Singular values below this share of the largest count as zero.
const RANK: f64 = 1e-9;
/// A state is unobserved if its part in the null space exceeds this.
const SHARE: f64 = 1e-6;
/// The loss of each input is examined for up to this many inputs.
const MOST: usize = 64;

/// All problems of the fusions of a knowledge base, and the inputs that their states depend on; the knowledge base has passed its
/// own checks. Time: for each fusion that of 65 decompositions of matrices of n columns.
#[must_use]
pub fn check(knowledge: &KnowledgeBase) -> Vec<Diagnostic> {
    knowledge.fusions().iter().flat_map(|fusion| of_fusion(knowledge, fusion)).collect()
}

fn of_fusion(knowledge: &KnowledgeBase, fusion: &Fusion) -> Vec<Diagnostic> {
    if let Err(error) = build::method(knowledge, fusion) {
        let message = format!("fusion `{}` cannot be set up: {error}", fusion.name);
        return vec![diagnostic(
            Severity::Error,
            fusion.places.name,
            message,
            "choose another method, or change its model",
        )];
    }
    let mut found = noise::below_zero(knowledge, fusion);
    found.extend(without_noise(fusion));
    let Some(Observability { never, without }) = observability(knowledge, fusion) else { return found };
    found.extend(never.iter().map(|state| of_state(fusion, *state)));
    for (lost, states) in without.iter().enumerate().filter(|(_, states)| !states.is_empty()) {
        let Some(input) = fusion.inputs.get(lost) else { continue };
        let names = states.iter().filter_map(|state| fusion.states.get(*state));
        let names: Vec<String> = names.map(|state| format!("`{}`", state.name)).collect();
        let place = fusion.places.inputs.get(lost).copied().unwrap_or(fusion.places.name);
        let (signal, listed) = (&knowledge.signals()[input.signal].name, names.join(", "));
        let message = format!("without `{signal}` nothing observes {listed}");
        let help = match names.as_slice() {
            [_] => "its uncertainty grows then: a second input that measures it would hold it",
            _ => "their uncertainty grows then: a second input that measures them would hold them",
        };
        found.push(diagnostic(Severity::Note, place, message, help));
    }
    found
}

/// Which states of a fusion its inputs observe; states by their places, ascending.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Observability {
    /// States that all inputs together do not observe.
    pub never: Vec<usize>,
    /// For each of the first 64 inputs, in their order: the states that only it observes.
    pub without: Vec<Vec<usize>>,
}

/// Which states a fusion's inputs observe, all together and without each one; `None` when its model cannot be set up. Time: that
/// of 65 decompositions of matrices of n columns.
#[must_use]
pub fn observability(knowledge: &KnowledgeBase, fusion: &Fusion) -> Option<Observability> {
    let mut system = build::system(knowledge, fusion, false).ok()?;
    let never = unobserved(&mut system, fusion, &|_| true);
    let mut without = |lost: usize| {
        let mut states = unobserved(&mut system, fusion, &|input| input != lost);
        states.retain(|state| !never.contains(state));
        states
    };
    let without = (0..fusion.inputs.len().min(MOST)).map(&mut without).collect();
    Some(Observability { never, without })
}

/// Warnings of the states of a particle filter that no noise moves: their particles get no new values.
fn without_noise(fusion: &Fusion) -> Vec<Diagnostic> {
    if fusion.method != FusionMethod::Particle {
        return Vec::new();
    }
    let is_still = |place: usize| {
        let moved_by = fusion.moved_by(place);
        moved_by.iter().all(|it| {
            let noise = fusion.states.get(*it).and_then(|state| state.noise.as_constant());
            noise.is_some_and(|noise| noise.value == 0.0)
        })
    };
    let still = fusion.states.iter().enumerate().filter(|(place, _)| is_still(*place));
    let warning = |(place, state): (usize, &FusionState)| {
        let message = format!(
            "`{}` has no `noise`: its particles get no new values but those that are made up to keep them apart, and what it says is wide \
             where few are left",
            state.name
        );
        let place = fusion.places.states.get(place).copied().unwrap_or(fusion.places.name);
        diagnostic(
            Severity::Warning,
            place,
            message,
            "give it the `noise` of its changes, or take a Kalman filter",
        )
    };
    still.map(warning).collect()
}

fn of_state(fusion: &Fusion, state: usize) -> Diagnostic {
    let name = fusion.states.get(state).map_or("", |it| it.name.as_str());
    let place = fusion.places.states.get(state).copied().unwrap_or(fusion.places.name);
    let outcome = match fusion.method {
        FusionMethod::Particle => {
            "its particles get fewer ancestors, so in the long run it looks more certain than it is"
        }
        _ => "it stays as uncertain as it was at first, or becomes more so",
    };
    let message = format!("nothing observes `{name}`: {outcome}");
    diagnostic(Severity::Warning, place, message, "add an input that it shows in, or leave the state away")
}

fn diagnostic(severity: Severity, place: Place, message: String, help: &str) -> Diagnostic {
    Diagnostic { severity, place, span: None, message, help: Some(help.to_owned()) }
}

/// The states that these inputs do not observe, ascending.
pub(super) fn unobserved(
    system: &mut Continuous,
    fusion: &Fusion,
    is_used: &dyn Fn(usize) -> bool,
) -> Vec<usize> {
    let n = fusion.states.len();
    let scale: Vec<f64> =
        fusion.states.iter().map(|it| if it.spread > 0.0 { it.spread } else { 1.0 }).collect();
    let beside = |(place, it): (usize, &FusionState)| {
        it.initial + it.spread.min(1.0) * (0.31 + 0.17 * (place % 5) as f64)
    };
    let mut state: Vec<f64> = fusion.states.iter().enumerate().map(beside).collect();
    let mut next = vec![0.0; n];
    let controls: Vec<f64> = (0..fusion.controls.len()).map(|place| 0.23 + 0.11 * place as f64).collect();
    let mut since = Matrix::identity(n, n);
    let mut jacobian = Matrix::zeros(n, n);
    let mut gradient = vec![0.0; n];
    let mut rows: Vec<f64> = Vec::new();
    let moving = moving(system, fusion, &state, is_used);
    let long = (1..=LONG_STEPS).map(|power| STEP_S * LONGER.powi(power));
    for (step, seconds) in std::iter::repeat_n(STEP_S, n + 1).chain(long).enumerate() {
        for input in (0..fusion.inputs.len()).filter(|input| is_used(*input)) {
            system.gradient(input, &state, &controls, &mut gradient);
            let row = since.tr_mul(&Matrix::from_column_slice(n, 1, &gradient));
            let row: Vec<f64> = row.iter().zip(&scale).map(|(it, scale)| it * scale).collect();
            let length = row.iter().map(|it| it * it).sum::<f64>().sqrt();
            if length > 0.0 && length.is_finite() {
                rows.extend(row.iter().map(|it| it / length));
            }
        }
        system.linearised(&state, &controls, seconds, &mut next, &mut jacobian);
        since = &jacobian * since;
        state.copy_from_slice(&next);
        if since.iter().any(|it| !it.is_finite()) {
            break;
        }
        let far = MOVES.get(step % MOVES.len()).copied().unwrap_or(0.0);
        let moved = state.iter_mut().zip(&fusion.states).zip(&moving).filter(|(_, is_moving)| **is_moving);
        moved.for_each(|((state, model), _)| *state += far * model.spread);
    }
    hidden(&rows, n)
}

/// Which states have noise, and the same slope in some input here and elsewhere: that they move is seen.
fn moving(
    system: &mut Continuous,
    fusion: &Fusion,
    state: &[f64],
    is_used: &dyn Fn(usize) -> bool,
) -> Vec<bool> {
    let elsewhere: Vec<f64> =
        state.iter().zip(&fusion.states).map(|(state, model)| state + 0.37 * model.spread).collect();
    let controls = vec![0.29; fusion.controls.len()];
    let (mut here, mut there) = (vec![0.0; state.len()], vec![0.0; state.len()]);
    let mut moving = vec![false; state.len()];
    for input in (0..fusion.inputs.len()).filter(|input| is_used(*input)) {
        system.gradient(input, state, &controls, &mut here);
        system.gradient(input, &elsewhere, &controls, &mut there);
        for (moving, (one, other)) in moving.iter_mut().zip(here.iter().zip(&there)) {
            *moving |= *one != 0.0 && (one - other).abs() <= RANK * one.abs();
        }
    }
    let is_driven = |it: &FusionState| it.noise.as_constant().is_none_or(|noise| noise.value > 0.0);
    moving.iter().zip(&fusion.states).map(|(moving, state)| *moving && is_driven(state)).collect()
}

/// The columns that have a part in the null space of a matrix, given row by row.
fn hidden(rows: &[f64], n: usize) -> Vec<usize> {
    if rows.is_empty() {
        return (0..n).collect();
    }
    let gram = Matrix::from_row_slice(rows.len() / n, n, rows);
    // At least square, so that all directions are among the singular vectors.
    let padded = gram.clone().resize_vertically(gram.nrows().max(n), 0.0);
    let SVD { v_t, singular_values, .. } = padded.svd(false, true);
    let Some(v_t) = v_t else { return Vec::new() };
    let largest = singular_values.iter().fold(0.0, |most: f64, it| most.max(*it));
    let is_null = |place: usize| singular_values.get(place).is_none_or(|it| *it <= RANK * largest);
    let nulls: Vec<usize> = (0..v_t.nrows()).filter(|place| is_null(*place)).collect();
    let share = |state: usize| {
        nulls.iter().map(|null| v_t.get((*null, state)).map_or(0.0, |it| it * it)).sum::<f64>()
    };
    (0..n).filter(|state| share(*state) > SHARE).collect()
}
