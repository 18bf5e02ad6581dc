//! What a fusion declares and its method does not use.
//!
//! A method is changed by one word, so a key that another method uses is no error. A part of the model that does not count is a
//! warning, as the estimates are other ones than the model says; a setting that does not count is a note.

use shsa_core::expression::parse_expression;
use shsa_core::knowledge::{Diagnostic, FusionDraft, FusionMethod, FusionStateDraft, Severity, Text};

use crate::problem;

const CHANGE: &str = "choose a filter such as `kalman`, or leave it away";

/// All that the method of a fusion does not use, in the order of the keys.
pub(super) fn unused(draft: &FusionDraft) -> Vec<Diagnostic> {
    let is_named =
        |(name, _): &(&str, FusionMethod)| draft.method.as_ref().is_some_and(|it| it.text == *name);
    let Some((word, method)) = FusionMethod::NAMES.into_iter().find(is_named) else { return Vec::new() };
    let mut found = Vec::new();
    if method.is_direct() {
        draft.states.iter().for_each(|state| found.extend(of_state(word, draft, state)));
        found.extend(draft.controls.iter().filter_map(|(name, _)| of_control(word, draft, name)));
    }
    found.extend(settings(draft, method).filter_map(|(key, text, is_used, users)| {
        let text = text.filter(|_| !is_used)?;
        let message = format!("`{word}` does not use `{key}`");
        Some(diagnostic(Severity::Note, text, &message, &format!("{users} it")))
    }));
    found
}

/// Transitions, and noise that is not constant, do not count without a model of the states.
fn of_state(word: &str, draft: &FusionDraft, state: &FusionStateDraft) -> Vec<Diagnostic> {
    let name = &state.name.text;
    let transition = state.transition.as_ref().filter(|text| text.text.trim() != *name).map(|text| {
        let message = format!("`{word}` has no model of the states, and ignores the transition of `{name}`");
        diagnostic(Severity::Warning, text, &message, CHANGE)
    });
    let noise = state.noise.as_ref().filter(|text| !is_constant(draft, text)).map(|text| {
        let message = format!("`{word}` has no model of the states, and takes this noise of `{name}` for 0");
        diagnostic(Severity::Warning, text, &message, "write a number, or choose a filter such as `kalman`")
    });
    transition.into_iter().chain(noise).collect()
}

/// A control input that only transitions and noise of states name.
fn of_control(word: &str, draft: &FusionDraft, name: &Text) -> Option<Diagnostic> {
    let of_inputs = draft.inputs.iter().filter_map(|it| it.noise.as_ref());
    let of_outputs = draft.outputs.iter().filter_map(|it| it.value.as_ref());
    let is_used = of_inputs.chain(of_outputs).any(|text| names(text, &name.text));
    let message =
        format!("`{word}` has no model of the states, and ignores the control input `{}`", name.text);
    (!is_used).then(|| diagnostic(Severity::Warning, name, &message, CHANGE))
}

/// Whether a formula names no state and no control input.
fn is_constant(draft: &FusionDraft, text: &Text) -> bool {
    let states = draft.states.iter().map(|state| &state.name);
    !states.chain(draft.controls.iter().map(|(name, _)| name)).any(|name| names(text, &name.text))
}

/// Whether a formula names this; not one that cannot be read, which is reported elsewhere.
fn names(text: &Text, name: &str) -> bool {
    parse_expression(&text.text).is_ok_and(|formula| !formula.places_of(name).is_empty())
}

/// The settings that some methods do not use: the key, what is written, whether the method uses it, and which methods do.
fn settings(
    draft: &FusionDraft,
    method: FusionMethod,
) -> impl Iterator<Item = (&'static str, Option<&Text>, bool, &'static str)> {
    let is_on = |text: &&Text| text.text != "none";
    let is_filter = !method.is_direct();
    let has_window = matches!(method, FusionMethod::Average | FusionMethod::Median);
    let has_particles = method == FusionMethod::Particle;
    let gate = draft.gate.as_ref().filter(is_on);
    let witnesses = draft.witnesses.as_ref().filter(is_on);
    const FILTERS: &str = "Kalman and particle filters use";
    let of_fusion = [
        ("gate", gate, is_filter, FILTERS),
        ("witnesses", witnesses, is_filter, FILTERS),
        (
            "faulty",
            draft.faulty.as_ref(),
            method.is_of_intervals(),
            "`marzullo`, `schmid` and `brooks_iyengar` use",
        ),
        ("window", draft.window.as_ref(), has_window, "`average` and `median` use"),
        ("particles", draft.particles.as_ref(), has_particles, "`particle` uses"),
        ("seed", draft.seed.as_ref(), has_particles, "`particle` uses"),
    ];
    let confidences = draft.outputs.iter().map(move |output| {
        let is_used = !method.is_of_intervals();
        ("confidence", output.confidence.as_ref(), is_used, "methods that do not intersect intervals use")
    });
    of_fusion.into_iter().chain(confidences)
}

fn diagnostic(severity: Severity, text: &Text, message: &str, help: &str) -> Diagnostic {
    Diagnostic { severity, ..problem(text.place, message, Some(help)) }
}
