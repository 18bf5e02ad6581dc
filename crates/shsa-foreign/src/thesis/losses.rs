//! What a knowledge base has that another form cannot express.

use shsa_core::knowledge::{KnowledgeBase, Shape, Signal, Utility, ValueError, Variable};
use shsa_core::time::Span;
use std::collections::BTreeSet;
use std::fmt::Write;

/// The most names in the report of a loss.
const MOST_NAMES: usize = 3;

/// What a form loses besides formulas, one a line; `is_lost` says of each kind whether it is. Time: linear in the knowledge base.
pub(super) fn of(knowledge: &KnowledgeBase, is_lost: impl Fn(&str) -> bool) -> Vec<String> {
    let mut losses = Vec::new();
    let mut lose = |what: &str, kind: &str, names: Vec<&str>| {
        losses.extend(one(what, kind, names).filter(|_| is_lost(what)));
    };
    let variables = knowledge.variables();
    let names = |is: &dyn Fn(&Variable) -> bool| {
        variables.iter().filter(|variable| is(variable)).map(|variable| variable.name.as_str()).collect()
    };
    lose(
        "the unit",
        "variable",
        names(&|variable| variable.unit.as_ref().is_some_and(|unit| unit.to_string() != "1")),
    );
    lose("the range", "variable", names(&|variable| variable.range.is_some()));
    lose("the largest rate of change", "variable", names(&|variable| variable.max_rate.is_some()));
    lose("the turn", "variable", names(&|variable| variable.wraps.is_some()));
    lose("the properties", "variable", names(&|variable| !variable.properties.is_empty()));
    let inexact = |variable: &Variable| variable.constant.is_some_and(|value| value.lo() != value.hi());
    lose("the bounds", "constant", names(&inexact));
    let relations = knowledge.relations().iter().filter(|relation| !relation.properties.is_empty());
    lose("the properties", "relation", relations.map(|relation| relation.name.as_str()).collect());
    let signals = |is: &dyn Fn(&Signal) -> bool| {
        // A computed signal is lost with its fusion.
        let measured = knowledge.signals().enumerate().filter(|(id, _)| !knowledge.is_computed(*id));
        let found = measured.filter(|(_, signal)| is(signal));
        found.map(|(_, signal)| signal.name.as_str()).collect::<Vec<_>>()
    };
    lose("the source", "signal", signals(&|signal| signal.source != signal.name));
    lose("the scale and offset", "signal", signals(&|signal| signal.scaling.is_some()));
    lose("the errors, rate and delays", "signal", signals(&is_timed));
    let has_limits = |signal: &Signal| {
        let variable = &variables[signal.variable];
        let limits = (signal.limits.range, signal.limits.max_rate);
        variable.shape == Shape::Scalar && limits != (variable.range, variable.max_rate)
    };
    lose("the limits", "signal", signals(&has_limits));
    lose("the origin", "signal", signals(&|signal| !signal.derived_from.is_empty()));
    let sharing = knowledge.causes().iter().flat_map(|cause| &cause.signals).collect::<BTreeSet<_>>();
    let sharing = sharing.into_iter().map(|&signal| knowledge.signals()[signal].name.as_str());
    lose("what is shared", "signal", sharing.collect());
    lose("the properties", "signal", signals(&|signal| !signal.properties.is_empty()));
    let fusions = knowledge.fusions().iter().map(|fusion| fusion.name.as_str());
    lose("all that is said", "fusion", fusions.collect());
    let needs: Vec<&str> =
        knowledge.needs().iter().map(|need| variables[need.variable].name.as_str()).collect();
    lose("the name and demands", "need", needs);
    if !matches!(knowledge.utility(), Utility::Norm) {
        losses.push("how substitutions are rated".to_owned());
    }
    losses
}

/// The loss of something that elements with these names have; `None` where there are none.
pub(super) fn one(what: &str, kind: &str, names: Vec<&str>) -> Option<String> {
    (!names.is_empty()).then(|| format!("{what} of {}", described(kind, &names)))
}

fn is_timed(signal: &Signal) -> bool {
    let usual = ValueError::default();
    let zero = Span::ZERO;
    let is_late = signal.time_error != (zero, zero) || signal.delay != zero || signal.timeout.is_some();
    is_late
        || signal.mean_over != zero
        || signal.limits.max_delay.is_some()
        || signal.value_error != usual
        || signal.noise.is_some()
        || signal.rate_hz.is_some()
}

/// `signal a`, `signals a, b`, `signals a, b, c and 4 more`.
pub(super) fn described(kind: &str, names: &[&str]) -> String {
    let mut text = format!(
        "{kind}{} {}",
        if names.len() == 1 { "" } else { "s" },
        names.iter().take(MOST_NAMES).copied().collect::<Vec<_>>().join(", ")
    );
    if names.len() > MOST_NAMES {
        let _ = write!(text, " and {} more", names.len() - MOST_NAMES);
    }
    text
}
