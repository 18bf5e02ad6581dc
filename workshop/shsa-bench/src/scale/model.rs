//! A large model: a plant of many loosely coupled subsystems.
//!
//! A subsystem has 60 variables, of which 38 are measured, 100 relations and a need. A relation computes a variable from
//! two or three of the next ones; one in ten also reads a measured variable of another subsystem; one in fifty is an
//! equation, usable in all directions, so there are cycles; the others are structure only, with a cost.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::io::{self, Write};

/// The description of the models in the document.
pub(super) const DESCRIPTION: &str = "Each model is a plant of subsystems: 100 relations, 60 variables (38 of them \
    measured) and a need each. Relations compute a variable from two or three of the next ones; one in ten reads another \
    subsystem, too; one in fifty is an equation, solved for all its variables; the others are structure only, with a cost.";

/// Relations of a subsystem.
const RELATIONS: usize = 100;
/// Variables of a subsystem.
const VARIABLES: usize = 60;
/// The first of the variables that no relation computes.
const LEAVES: usize = 45;
/// Of the variables that relations compute, every second one is measured, too.
const MEASURED: usize = 2;
/// The largest distance between the output of a relation and its inputs.
const REACH: usize = 14;

/// Writes a model of about `relations` relations as JSON; the same seed gives the same bytes.
pub(super) fn write(out: &mut impl Write, relations: usize, seed: u64) -> io::Result<()> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let count = (relations / RELATIONS).max(1);
    out.write_all(b"{\"shsa\": 1")?;
    section(out, "variables", count, |subsystem, entries| {
        entries.extend((0..VARIABLES).map(|at| variable(&mut random, subsystem, at)));
    })?;
    section(out, "relations", count, |subsystem, entries| {
        entries.extend((0..RELATIONS).map(|at| relation(&mut random, count, subsystem, at)));
    })?;
    section(out, "signals", count, |subsystem, entries| {
        entries.extend((0..VARIABLES).filter(is_measured).map(|at| signal(&mut random, subsystem, at)));
    })?;
    section(out, "needs", count, |subsystem, entries| {
        entries.push(format!("\"u{subsystem}_v0\": {{\"max_age\": \"300 ms\"}}"));
    })?;
    out.write_all(b"}\n")
}

fn section(
    out: &mut impl Write,
    name: &str,
    subsystems: usize,
    mut entries_of: impl FnMut(usize, &mut Vec<String>),
) -> io::Result<()> {
    write!(out, ",\n\"{name}\": {{")?;
    let mut entries = Vec::new();
    for subsystem in 0..subsystems {
        entries_of(subsystem, &mut entries);
        for (at, entry) in entries.drain(..).enumerate() {
            write!(out, "{}\n{entry}", if subsystem + at == 0 { "" } else { "," })?;
        }
    }
    out.write_all(b"}")
}

fn is_measured(at: &usize) -> bool {
    *at >= LEAVES || at.is_multiple_of(MEASURED)
}

fn variable(random: &mut ChaCha8Rng, subsystem: usize, at: usize) -> String {
    if at.is_multiple_of(4) {
        let accuracy = random.random_range(80..100);
        return format!("\"u{subsystem}_v{at}\": {{\"properties\": {{\"accuracy\": 0.{accuracy}}}}}");
    }
    format!("\"u{subsystem}_v{at}\": {{}}")
}

fn relation(random: &mut ChaCha8Rng, subsystems: usize, subsystem: usize, at: usize) -> String {
    let output = at % LEAVES;
    let mut inputs: Vec<usize> = Vec::new();
    while inputs.len() < 2 + at % 2 {
        let input = (output + 1 + random.random_range(0..REACH)).min(VARIABLES - 1);
        if !inputs.contains(&input) {
            inputs.push(input);
        }
    }
    let mut names: Vec<String> = inputs.iter().map(|input| format!("u{subsystem}_v{input}")).collect();
    if at % 50 == 49 {
        return format!("\"u{subsystem}_r{at}\": \"u{subsystem}_v{output} = {}\"", names.join(" + "));
    }
    let other = random.random_range(0..subsystems);
    if at % 10 == 3 && other != subsystem {
        names.push(format!("u{other}_v{}", random.random_range(LEAVES..VARIABLES)));
    }
    let cost = random.random_range(1..10);
    format!(
        "\"u{subsystem}_r{at}\": {{\"output\": \"u{subsystem}_v{output}\", \"inputs\": [\"{}\"], \"properties\": {{\"cost\": {cost}}}}}",
        names.join("\", \"")
    )
}

fn signal(random: &mut ChaCha8Rng, subsystem: usize, at: usize) -> String {
    let accuracy = random.random_range(50..100);
    format!(
        "\"/u{subsystem}/v{at}\": {{\"variable\": \"u{subsystem}_v{at}\", \"rate\": \"10 Hz\", \"value_error\": 0.1, \"properties\": {{\"accuracy\": 0.{accuracy}}}}}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_has_what_it_says_and_nothing_wrong() {
        let mut text = Vec::new();
        write(&mut text, 1_000, 1).unwrap();
        let loaded = shsa_model::load(std::str::from_utf8(&text).unwrap(), "m.json");
        assert_eq!(loaded.report.render(false), "");
        let knowledge = loaded.knowledge;
        let sizes = [knowledge.variables().len(), knowledge.relations().len(), knowledge.signals().len()];
        assert_eq!((sizes, knowledge.needs().len()), ([600, 1_000, 380], 10));
        let mut again = Vec::new();
        write(&mut again, 1_000, 1).unwrap();
        assert_eq!(text, again);
    }
}
