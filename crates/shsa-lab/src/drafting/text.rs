//! A draft as a model file, with the figures behind each decision in comments.

use super::{About, Because, Columns, Drafted, Facts, Group, Member, Role};
use crate::learning::{Signal, formula};
use crate::naming::{fine, number, quoted, unique};
use shsa_core::expression::is_reserved;
use shsa_core::unit::Unit;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// How many times as fast as seen a variable may change, and how many longest gaps are silence.
const FASTER: f64 = 2.0;
const GAPS: f64 = 3.0;

/// The least share of repeated values that is worth a comment.
const STANDS: f64 = 0.5;

/// The model file of a draft, made from recordings with these names; it is valid. Comments give the figures behind each decision.
#[must_use]
pub fn model_text(read: &Columns, drafted: &Drafted, recordings: &str) -> String {
    let names = variable_names(read, drafted);
    let mut text = format!(
        "# Drafted by `shsa draft` from {recordings}. To be completed by hand: commented lines are guesses or need a decision.\n\
         # Next: `shsa calibrate` fits the tolerances, `shsa learn` finds relations, `shsa analyze` tells what the model can do.\n\
         shsa: 1\n\nvariables:\n"
    );
    for (group, name) in drafted.groups.iter().zip(&names) {
        text += &variable(read, drafted, group, name);
    }
    text += &rates(read, drafted, &names);
    text += "\nsignals:\n";
    for (group, name) in drafted.groups.iter().zip(&names) {
        for member in &group.members {
            text += &signal(read, drafted, group, member, name);
        }
    }
    text += &copies(read, drafted, &names);
    text += &left_out(read, drafted);
    text += &needs(drafted, &names);
    text
}

/// The needs; where none are known, a commented example.
fn needs(drafted: &Drafted, names: &[String]) -> String {
    let mut text = "\n# What must stay available, under which name and how fresh:\n".to_owned();
    let line = |group: usize, max_age: &str| {
        let name = &names[group];
        format!("  {name}: {{ signal: /served/{name}, max_age: {max_age} }}\n")
    };
    if drafted.needs.is_empty() {
        text += "# needs:\n";
        text.extend(drafted.most_measured().map(|group| format!("# {}", line(group, "1 s"))));
        return text;
    }
    text += "needs:\n";
    text.extend(drafted.needs.iter().map(|need| line(need.group, &need.max_age)));
    text
}

/// The names of the groups' variables: what their members have in common, else that of the first member.
#[must_use]
pub fn variable_names(read: &Columns, drafted: &Drafted) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let name = |group: &Group| {
        let first = &group.members[0];
        let kind = &read.columns[first.column].kind;
        let is_common = group.members.len() > 1
            && group.members.iter().filter(|it| read.columns[it.column].kind == *kind).count() > 1
            && !kind.is_empty();
        let name = if is_common { kind.clone() } else { read.about[first.column].variable.clone() };
        unique(&usable(&name), &mut taken)
    };
    drafted.groups.iter().map(name).collect()
}

/// A name that formulas can use.
fn usable(name: &str) -> String {
    /// Words that readers of YAML take for something else.
    const YAML: [&str; 7] = ["null", "yes", "no", "on", "off", "y", "n"];
    if is_reserved(name) || YAML.contains(&name) { format!("{name}_value") } else { name.to_owned() }
}

fn variable(read: &Columns, drafted: &Drafted, group: &Group, name: &str) -> String {
    let first = group.members[0].column;
    let about = &read.about[first];
    let unit = unit(read, first);
    let facts: Vec<&Facts> =
        group.members.iter().filter_map(|it| drafted.facts[it.column].as_ref()).collect();
    let Some(own) = drafted.facts[first].as_ref() else { return String::new() };
    let mut keys: Vec<String> = unit.iter().map(|unit| format!("unit: {}", unit_text(unit))).collect();
    if own.wraps {
        let turn = read.columns[first].turn.unwrap_or(360.0);
        keys.push(format!("wraps: {}", number(turn)));
    }
    let ratio = |member: &Member| scale(read, member.column) / scale(read, first);
    let alike =
        group.members.iter().zip(&facts).filter(|(member, _)| self::unit(read, member.column) == unit);
    let (low, high) =
        alike.fold(own.range, |(low, high), (_, it)| (low.min(it.range.0), high.max(it.range.1)));
    let drifts = facts.iter().any(|it| it.drifts);
    let width = high - low;
    let range = format!("range: [{}, {}]", fine(low - width, width), fine(high + width, width));
    let fastest = group.members.iter().zip(&facts).map(|(member, it)| it.fastest * ratio(member));
    let fastest = fastest.fold(0.0, f64::max);
    let is_choice = own.levels.is_some();
    if !drifts && !own.wraps && !is_choice {
        keys.push(range.clone());
    }
    if fastest > 0.0 && !is_choice {
        keys.push(format!("max_rate: {}", number(FASTER * fastest)));
    }
    let mut comments = vec![format!("{} to {} seen", fine(low, width), fine(high, width))];
    if fastest > 0.0 && !is_choice {
        comments.push(format!("at most {} a second beyond the noise", number(fastest)));
    }
    match (&unit, &about.declared_unit, about.guessed_unit) {
        (None, Some(described), _) => comments.push(format!("unit: {described}?")),
        (None, None, Some(guess)) => comments.push(format!("unit: {guess}? guessed from the name")),
        _ => {}
    }
    let glitches: Vec<(f64, f64)> = facts.iter().flat_map(|it| it.glitches.iter().copied()).collect();
    if let Some((time_s, value)) = glitches.first() {
        let (value, time_s) = (number(*value), number(*time_s));
        comments.push(match glitches.len() {
            1 => format!("without a glitch: {value} at {time_s} s"),
            count => format!("without {count} values that are glitches, the first {value} at {time_s} s"),
        });
    }
    if drifts {
        comments.push(format!("it drifts, so the range of another hour is another one: {range}"));
    }
    if let Some(levels) = &own.levels {
        let levels: Vec<String> = levels.iter().map(|it| number(*it)).collect();
        comments.push(format!("a choice: only {}", levels.join(", ")));
    }
    format!("  {name}: {{ {} }}   # {}\n", keys.join(", "), comments.join("; ")).replace("{  }", "{}")
}

fn signal(read: &Columns, drafted: &Drafted, group: &Group, member: &Member, variable: &str) -> String {
    let about = &read.about[member.column];
    let Some(facts) = drafted.facts[member.column].as_ref() else { return String::new() };
    let first = &read.about[group.members[0].column].signal;
    let mut text = String::new();
    let apart = format!(
        "{} of the spread of {first}, {} in 95 % of the time, offset {}",
        percent(member.share),
        number(member.apart),
        number(member.offset)
    );
    let why = match member.because {
        Because::First => None,
        Because::Equal => Some(format!("equal to {first}: apart by {apart}")),
        Because::Named => Some(format!("by its name the same as {first}: apart by {apart}")),
    };
    let _cannot_fail = why.map(|why| writeln!(text, "  # {why}"));
    if facts.repeated > STANDS && facts.levels.is_none() {
        let _cannot_fail = writeln!(
            text,
            "  # {} of the values repeat the one before: it is renewed every {} s, or it is rounded. `hold: true` if it stands.",
            percent(facts.repeated),
            number(facts.stands_s)
        );
    }
    if let Some(band) = facts.dead_band.filter(|_| facts.levels.is_none()) {
        let band = number(band);
        let _cannot_fail = writeln!(
            text,
            "  # It is sent on change: no value is nearer than about {band} to the one before."
        );
    }
    let tolerance = tolerance(read, group, member, facts);
    let keys = [
        format!("variable: {variable}"),
        source(about),
        unit(read, member.column).map_or(String::new(), |unit| format!("unit: {}", unit_text(&unit))),
        if facts.period_s > 0.0 && facts.dead_band.is_none() {
            format!("rate: {} Hz", number(1.0 / facts.period_s))
        } else {
            String::new()
        },
        if tolerance > 0.0 { format!("value_error: {}", number(tolerance)) } else { String::new() },
        if member.delay_s > 0.0 {
            format!("delay: {} ms", number(1e3 * member.delay_s))
        } else {
            String::new()
        },
        match facts.dead_band {
            _ if facts.levels.is_some() => "hold: true".to_owned(),
            Some(band) => format!("hold: {}, timeout: {}", number(band), timeout(facts)),
            None => format!("timeout: {}", timeout(facts)),
        },
    ];
    let keys: Vec<String> = keys.into_iter().filter(|it| !it.is_empty()).collect();
    let noise =
        if facts.levels.is_some() { String::new() } else { format!("noise {}, ", number(facts.noise)) };
    let _cannot_fail = writeln!(
        text,
        "  {}: {{ {} }}   # {} values, {noise}at most {} s apart",
        quoted_if_needed(&about.signal),
        keys.join(", "),
        facts.count,
        number(facts.gap_s)
    );
    text
}

/// A first tolerance: what lies between it and the others, and its noise.
fn tolerance(read: &Columns, group: &Group, member: &Member, facts: &Facts) -> f64 {
    let own = scale(read, member.column);
    let apart = |it: &Member| (1.2 * it.apart + it.offset.abs()) * scale(read, it.column) / own;
    let others = group.members.iter().filter(|it| it.because != Because::First);
    let shared = match member.because {
        Because::First => others.map(|it| 0.5 * apart(it)).fold(0.0, f64::max),
        _ => apart(member),
    };
    if facts.levels.is_some() { 0.0 } else { shared + facts.tolerance() }
}

pub(super) fn timeout(facts: &Facts) -> String {
    let most = (GAPS * facts.gap_s).max(5.0 * facts.period_s).max(0.1);
    if most < 1.0 { format!("{} ms", number(1e3 * most)) } else { format!("{} s", number(most)) }
}

/// Candidates of relations between a quantity and its rate.
fn rates(read: &Columns, drafted: &Drafted, names: &[String]) -> String {
    if drafted.rates.is_empty() {
        return String::new();
    }
    let signals: Vec<Signal> = read.columns.iter().map(|it| it.signal.clone()).collect();
    let name = |column: usize| {
        let group = drafted.groups.iter().position(|it| it.members.iter().any(|it| it.column == column));
        group.map_or(String::new(), |group| names[group].clone())
    };
    let mut text =
        "\n# Candidates: rates of one another; `shsa learn` fits and tests relations.\n# relations:\n"
            .to_owned();
    for (at, relation) in drafted.rates.iter().enumerate() {
        let formula = formula(&signals, relation, &name);
        let worst = percent(relation.score.worst());
        let _cannot_fail = writeln!(text, "#   rate_{}: {formula}   # {worst} unexplained", at + 1);
    }
    text
}

/// Copies: signals of the variable of their original where they only add an offset, else of one of their own.
fn copies(read: &Columns, drafted: &Drafted, names: &[String]) -> String {
    let mut text = String::new();
    for (column, role) in drafted.roles.iter().enumerate() {
        let Role::Copy(copy) = role else { continue };
        let (about, original) = (&read.about[column], &read.about[copy.of]);
        let group = drafted.groups.iter().position(|it| it.members.iter().any(|it| it.column == copy.of));
        let Some((group, facts)) = group.zip(drafted.facts[column].as_ref()) else { continue };
        let is_same = (copy.factor - 1.0).abs() < 1e-6 && same_dimension(read, column, copy.of);
        let factor = number(copy.factor * scale(read, copy.of) / scale(read, column));
        let times = if factor == "1" { String::new() } else { format!("{factor} * ") };
        let plus = match copy.offset / scale(read, column) {
            offset if offset.abs() < facts.tolerance() => String::new(),
            offset => format!(" {} {}", if offset < 0.0 { "-" } else { "+" }, number(offset.abs())),
        };
        let described = format!("{times}{}{plus}", original.signal);
        let unit = unit(read, column).map_or(String::new(), |it| format!(", unit: {}", unit_text(&it)));
        let offset = match (copy.offset - zero(read, copy.of) + zero(read, column)) / scale(read, column) {
            offset if offset.abs() > facts.tolerance() => format!(", offset: {}", number(-offset)),
            _ => String::new(),
        };
        let _cannot_fail = writeln!(
            text,
            "  {}{}: {{ variable: {}, {}{unit}{offset}, rate: {} Hz, value_error: {}, timeout: {}, derived_from: [{}] }}   # all {} values are {described}",
            if is_same { "" } else { "# " },
            quoted_if_needed(&about.signal),
            if is_same { &names[group] } else { &about.variable },
            source(about),
            number(1.0 / facts.period_s),
            number(facts.tolerance()),
            timeout(facts),
            quoted_if_needed(&original.signal),
            facts.count,
        );
    }
    if text.is_empty() {
        text
    } else {
        format!("  # Computed from other signals: no witnesses about them.\n{text}")
    }
}

/// What is no signal, with the reason.
fn left_out(read: &Columns, drafted: &Drafted) -> String {
    let mut lines = Vec::new();
    for (column, role) in drafted.roles.iter().enumerate() {
        let about = &read.about[column];
        let facts = drafted.facts[column].as_ref();
        let reason = match role {
            Role::Constant => facts
                .map_or("fewer than two values".to_owned(), |it| format!("always {}", number(it.range.0))),
            Role::Untimed => "its times do not advance: it is written once, and is no signal".to_owned(),
            Role::Clock => "it grows evenly with time: a clock or a counter".to_owned(),
            Role::RunningMaximum(of) => format!("the largest value of {} so far", read.about[*of].signal),
            Role::Copy(_) | Role::Signal => continue,
        };
        lines.push(format!("#   {}: {reason}\n", about.source));
    }
    lines.extend(read.left_out.iter().map(|(source, reason)| format!("#   {source}: {reason}\n")));
    if lines.is_empty() { String::new() } else { format!("\n# Left out:\n{}", lines.concat()) }
}

fn source(about: &About) -> String {
    format!("source: {}", quoted(&about.source))
}

fn unit(read: &Columns, column: usize) -> Option<Unit> {
    read.columns[column].signal.unit.clone()
}

fn unit_text(unit: &Unit) -> String {
    let text = unit.to_string();
    let is_plain = text.chars().all(|it| it.is_ascii_alphanumeric() || "/^*°".contains(it));
    let is_number = text.chars().all(|it| it.is_ascii_digit());
    if is_plain && !is_number { text } else { quoted(&text) }
}

fn scale(read: &Columns, column: usize) -> f64 {
    unit(read, column).map_or(1.0, |unit| unit.scale)
}

/// The SI value of the zero of the column's unit.
fn zero(read: &Columns, column: usize) -> f64 {
    unit(read, column).map_or(0.0, |unit| unit.offset)
}

fn same_dimension(read: &Columns, one: usize, other: usize) -> bool {
    let dimension = |column: usize| unit(read, column).map(|unit| unit.dimension);
    dimension(one) == dimension(other)
}

fn quoted_if_needed(name: &str) -> String {
    let is_plain = name.chars().all(|it| it.is_ascii_alphanumeric() || it == '_')
        && name.starts_with(|it: char| it.is_ascii_alphabetic())
        && usable(name) == name;
    if is_plain { name.to_owned() } else { quoted(name) }
}

fn percent(share: f64) -> String {
    format!("{} %", number(100.0 * share))
}
