//! Reasons in words: a sentence for each code of [`Reason`], its arguments in the units of the model.
//!
//! All texts for people that programs print and publish are made here. The core gives codes and arguments only, so that another
//! language needs only another table of sentences.

mod sentences;

use sentences::SENTENCES;
use shsa_core::engine::Refusal;
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::reason::{
    Amount, Argument, Candidate, Joint, Probability, Proof, Range, Reason, Reasons, ServedBy,
};
use shsa_core::time::Span;

/// The most names in a list of a few.
const FEW: usize = 3;

/// All reasons of a decision, as one text.
#[must_use]
pub fn reasons(reasons: &Reasons) -> String {
    let mut text = String::new();
    for clause in reasons.clauses() {
        if !text.is_empty() {
            text.push_str(between(clause.joint));
        }
        text.push_str(&reason(&clause.reason));
    }
    text
}

/// The text between a reason and the one before it.
#[must_use]
pub fn between(joint: Joint) -> &'static str {
    match joint {
        Joint::Next => "; ",
        Joint::Namely => ": ",
        Joint::And => ", and ",
        Joint::Also => ", ",
        Joint::With => " ",
    }
}

/// One reason.
#[must_use]
pub fn reason(reason: &Reason) -> String {
    filled(sentence(reason.code()).unwrap_or_default(), &reason.arguments())
}

/// The sentence of a code: `{x}` stands for the argument `x`, and `{x:h}` for it in the manner `h`.
#[must_use]
pub fn sentence(code: &str) -> Option<&'static str> {
    SENTENCES.iter().find(|(known, _)| *known == code).map(|(_, sentence)| *sentence)
}

/// Why an order cannot be obeyed, and the possible alternatives.
#[must_use]
pub fn refusal(refusal: &Refusal) -> String {
    format!("{}{}{}", reasons(&refusal.reason), between(Joint::Next), reasons(&refusal.help))
}

/// The source of a need: the name of a way, or the form of publication while no source is trusted.
#[must_use]
pub fn served_by(served_by: &ServedBy) -> String {
    match served_by {
        ServedBy::Way(name) => name.clone(),
        ServedBy::Hull(ways) => format!("hull of {}", ways.join("; ")),
        ServedBy::Agreeing { count, ways } => {
            format!("what {count} of {} hold possible: {}", ways.len(), ways.join("; "))
        }
        ServedBy::LastTrusted => "the last trusted value".to_owned(),
    }
}

/// An interval in SI, in the unit of its variable.
#[must_use]
pub fn interval(knowledge: &KnowledgeBase, variable: VariableId, value: Interval) -> String {
    range(&Range::of(knowledge, variable, value))
}

/// A difference of values in SI, in the unit of their variable.
#[must_use]
pub fn difference(knowledge: &KnowledgeBase, variable: VariableId, difference: f64) -> String {
    amount(&Amount::of(knowledge, variable, difference))
}

/// A span with the unit that suits it.
#[must_use]
pub fn span(length: Span) -> String {
    match length.seconds() {
        seconds if seconds.abs() < 1.0 => format!("{:.0} ms", seconds * 1e3),
        seconds if seconds.abs() < 100.0 => format!("{seconds:.1} s"),
        seconds => format!("{seconds:.0} s"),
    }
}

/// A span of hours or days; a shorter one as [`span`].
#[must_use]
pub fn long_span(length: Span) -> String {
    match length.seconds() / 3600.0 {
        hours if hours < 1.0 => span(length),
        hours if hours < 100.0 => format!("{hours:.1} h"),
        hours => format!("{:.0} days", hours / 24.0),
    }
}

/// A sentence with its arguments.
fn filled(sentence: &str, arguments: &[(&'static str, Argument)]) -> String {
    let mut text = String::new();
    let mut rest = sentence;
    while let Some((before, opened)) = rest.split_once('{') {
        let Some((place, after)) = opened.split_once('}') else { break };
        let (name, manner) = place.split_once(':').unwrap_or((place, ""));
        text.push_str(before);
        if let Some((_, argument)) = arguments.iter().find(|(known, _)| *known == name) {
            text.push_str(&shown(argument, manner));
        }
        rest = after;
    }
    text + rest
}

fn shown(argument: &Argument, manner: &str) -> String {
    let list = |items: Vec<String>| items.join(", ");
    match argument {
        Argument::Name(name) => name.clone(),
        Argument::Names(names) if manner == "few" => few(names),
        Argument::Names(names) => names.join(", "),
        Argument::Span(length) if manner == "long" => long_span(*length),
        Argument::Span(length) => span(*length),
        Argument::Count(1) if manner == "times" => "once".to_owned(),
        Argument::Count(count) if manner == "times" => format!("{count} times"),
        Argument::Count(count) => count.to_string(),
        Argument::Number(number) => number.to_string(),
        Argument::Probability(share) => probability(*share),
        Argument::Range(value) => range(value),
        Argument::Amount(value) => amount(value),
        Argument::Subject(subject) => subject.to_string(),
        Argument::Subjects(subjects) => list(subjects.iter().map(ToString::to_string).collect()),
        Argument::Order(order) => order.to_string(),
        Argument::Orders(orders) => list(orders.iter().map(|order| format!("`{order}`")).collect()),
        Argument::ServedBy(it) => served_by(it),
        Argument::Candidate(source) => candidate(source),
        Argument::Candidates(sources) => sources.iter().map(candidate).collect::<Vec<_>>().join(", then "),
    }
}

/// The first of some names, and the number of the others.
fn few(names: &[String]) -> String {
    let named = names.get(..FEW.min(names.len())).unwrap_or_default().join(", ");
    match names.len().saturating_sub(FEW) {
        0 => named,
        more => format!("{named} and {more} more"),
    }
}

/// A probability with two digits, and never 1.
fn probability(Probability(share): Probability) -> String {
    match share {
        share if share >= 0.9995 => "above 0.999".to_owned(),
        share if !(0.095..0.995).contains(&share) => format!("{share:.3}"),
        share => format!("{share:.2}"),
    }
}

fn range(Range { lo, hi, unit }: &Range) -> String {
    let unit = unit.as_ref().map_or(String::new(), |unit| format!(" {unit}"));
    format!("{}..{}{unit}", number(*lo), number(*hi))
}

fn amount(Amount { value, unit }: &Amount) -> String {
    match unit {
        Some(unit) => format!("{} {unit}", number(*value)),
        None => number(*value),
    }
}

/// With four significant digits, without an exponent where that is short.
fn number(value: f64) -> String {
    match libm::floor(libm::log10(value.abs())) {
        m if !m.is_finite() => "0".to_owned(),
        m if (-4.0..4.0).contains(&m) => format!("{value:.*}", (3.0 - m) as usize),
        m if (4.0..9.0).contains(&m) => format!("{value:.0}"),
        _ => format!("{value:.3e}"),
    }
}

fn candidate(Candidate { source, utility, proof }: &Candidate) -> String {
    let proof = proof.as_ref().map_or(String::new(), proven);
    format!("{source} (utility {utility:.3}{proof})")
}

fn proven(Proof { agreement, error, availability }: &Proof) -> String {
    let percent = |share: &Option<f64>| {
        share.map_or("an unknown share".to_owned(), |share| format!("{:.1} %", 100.0 * share))
    };
    let distance = error.as_ref().map_or(String::new(), |error| format!(", {} off", amount(error)));
    match (agreement, availability) {
        (None, None) => ", not proven".to_owned(),
        _ => format!(
            ", agreed in {}{distance}, there {} of the time",
            percent(agreement),
            percent(availability)
        ),
    }
}

#[cfg(test)]
pub(crate) mod tests;
