//! Whether the formulas of noise can be below 0, by the ranges of the variables.

use shsa_core::expression::{Formula, Symbol};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Diagnostic, Fusion, KnowledgeBase, Place, Severity};

/// A warning for each noise of a fusion that can be below 0. The formulas are bounded by intervals, so one that names a variable
/// twice may be reported and be above 0 after all.
pub(super) fn below_zero(knowledge: &KnowledgeBase, fusion: &Fusion) -> Vec<Diagnostic> {
    let range = |symbol: Symbol| range(knowledge, fusion, symbol);
    let states = fusion.states.iter().zip(&fusion.places.states);
    let of_states = states.map(|(state, place)| (&state.noise, state.name.as_str(), *place));
    let inputs = fusion.inputs.iter().zip(&fusion.places.inputs);
    let of_inputs = inputs.filter_map(|(input, place)| {
        Some((input.noise.as_ref()?, knowledge.signals()[input.signal].name.as_str(), *place))
    });
    of_states
        .chain(of_inputs)
        .filter_map(|(noise, name, place)| warning(noise, name, place, &range))
        .collect()
}

fn warning(
    noise: &Formula,
    name: &str,
    place: Place,
    range: &dyn Fn(Symbol) -> Option<Interval>,
) -> Option<Diagnostic> {
    let least = noise.bounds(range).lo();
    let how_far = if least.is_finite() { format!(", down to {least} in SI") } else { String::new() };
    (least < 0.0).then(|| Diagnostic {
        severity: Severity::Warning,
        place,
        span: None,
        message: format!("the noise of `{name}` can be below 0{how_far}, and a standard deviation cannot"),
        help: Some(
            "write `abs(..)`, or `max(.., 0.1)` with the least noise, or give its variables a `range`; below 0 its magnitude counts"
                .to_owned(),
        ),
    })
}

/// The range of a state or control input, SI: that of the variable of its name, or of its signal.
fn range(knowledge: &KnowledgeBase, fusion: &Fusion, symbol: Symbol) -> Option<Interval> {
    let place = symbol.0 as usize;
    match fusion.states.get(place) {
        Some(state) => knowledge.variables()[knowledge.variable(&state.name)?].range,
        None => {
            let signal = fusion.controls.get(place - fusion.states.len())?;
            knowledge.signals()[*signal].limits.range
        }
    }
}
