//! Quantities of two models that may be the same under different names: proposed, and equated on request.

use anyhow::{Context, bail};
use shsa_core::knowledge::{Draft, KnowledgeBase, Variable, VariableId};
use shsa_core::unit::Dimension;
use std::collections::BTreeSet;
use std::io::{BufRead, IsTerminal, Write, stderr, stdin};

/// Two variables of a joined model, each of one part only.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Pair {
    pub(super) one: String,
    pub(super) other: String,
}

impl Pair {
    /// Reads `velocity=speed`.
    ///
    /// # Errors
    /// When there are not two names.
    pub(super) fn read(text: &str) -> Result<Pair, String> {
        match text.split_once('=') {
            Some((one, other)) if !one.trim().is_empty() && !other.trim().is_empty() => {
                Ok(Pair { one: one.trim().to_owned(), other: other.trim().to_owned() })
            }
            _ => Err("write the names of two variables, as velocity=speed".to_owned()),
        }
    }

    /// The change of the model that equates both. Units are converted, as in every equation.
    pub(super) fn change(&self) -> String {
        let Pair { one, other } = self;
        format!("relations: {{ {one}_is_{other}: \"{one} = {other}\" }}\n")
    }

    fn is_of(&self, one: &str, other: &str) -> bool {
        (self.one == one && self.other == other) || (self.one == other && self.other == one)
    }
}

/// Pairs that count in the same kind of unit, and that no relation ties: each the only such pair of its two models, or alike in a word
/// of their names. Time: O(variables squared).
pub(super) fn candidates(whole: &KnowledgeBase, parts: &[Draft], known: &[Pair]) -> Vec<Pair> {
    let names: Vec<BTreeSet<&str>> =
        parts.iter().map(|part| part.variables.iter().map(|it| it.name.text.as_str()).collect()).collect();
    let own = |at: usize| {
        let is_own = |name: &&&str| names.iter().filter(|it| it.contains(**name)).count() == 1;
        names[at].iter().filter(is_own).copied().collect::<Vec<&str>>()
    };
    let mut found = Vec::new();
    for (first, second) in (0..parts.len()).flat_map(|one| (one + 1..parts.len()).map(move |it| (one, it))) {
        let (ones, others) = (own(first), own(second));
        let alike: Vec<(&str, &str)> = ones
            .iter()
            .flat_map(|one| others.iter().map(move |other| (*one, *other)))
            .filter(|(one, other)| are_comparable(whole, one, other))
            .collect();
        let is_only =
            |one: &str, other: &str| alike.iter().filter(|it| it.0 == one || it.1 == other).count() == 1;
        for (one, other) in &alike {
            let is_known = known.iter().any(|it| it.is_of(one, other));
            if !is_known && (is_only(one, other) || share_a_word(one, other)) {
                found.push(Pair { one: (*one).to_owned(), other: (*other).to_owned() });
            }
        }
    }
    found
}

fn are_comparable(whole: &KnowledgeBase, one: &str, other: &str) -> bool {
    let Some((one_id, other_id)) = whole.variable(one).zip(whole.variable(other)) else { return false };
    let (one, other) = (&whole.variables()[one_id], &whole.variables()[other_id]);
    let dimension = |it: &Variable| it.unit.as_ref().map(|unit| unit.dimension);
    let is_measured = dimension(one).is_some_and(|it| it != Dimension::PLAIN);
    let overlap = one.range.zip(other.range).is_none_or(|(one, other)| one.overlaps(other));
    is_measured
        && dimension(one) == dimension(other)
        && (one.shape, one.wraps) == (other.shape, other.wraps)
        && one.constant.is_none()
        && other.constant.is_none()
        && overlap
        && !are_tied(whole, one_id, other_id)
}

/// Whether a relation is about both.
fn are_tied(whole: &KnowledgeBase, one: VariableId, other: VariableId) -> bool {
    whole.relations().iter().any(|relation| {
        let of = |id: VariableId| {
            let reads = |&output: &VariableId| relation.needs(output).any(|it| it == id);
            relation.outputs.contains(&id) || relation.outputs.iter().any(reads)
        };
        of(one) && of(other)
    })
}

fn share_a_word(one: &str, other: &str) -> bool {
    let words = |name: &'_ str| -> BTreeSet<String> {
        let parts = name.split(|it: char| !it.is_alphabetic()).filter(|it| it.chars().count() > 2);
        parts.map(str::to_lowercase).collect()
    };
    !words(one).is_disjoint(&words(other))
}

/// Asks on a terminal which of these are the same; elsewhere says how to tell.
///
/// # Errors
/// When the terminal cannot be read.
pub(super) fn confirmed(whole: &KnowledgeBase, proposed: Vec<Pair>) -> anyhow::Result<Vec<Pair>> {
    let can_ask = stdin().is_terminal() && stderr().is_terminal();
    let mut same = Vec::new();
    for pair in proposed {
        let unit = |name: &str| {
            let id = whole.variable(name)?;
            whole.variables()[id].unit.as_ref().map(ToString::to_string)
        };
        let Pair { one, other } = &pair;
        let shown = |name: &str| format!("`{name}` ({})", unit(name).unwrap_or_default());
        let mut output = stderr().lock();
        if !can_ask {
            let (one_shown, other_shown) = (shown(one), shown(other));
            writeln!(
                output,
                "note: {one_shown} and {other_shown} are two quantities here; if they are the same: --same {one}={other}"
            )?;
            continue;
        }
        write!(output, "Are {} and {} the same quantity? [no] ", shown(one), shown(other))?;
        output.flush()?;
        let mut answer = String::new();
        if stdin().lock().read_line(&mut answer).context("cannot read the answer")? == 0 {
            break;
        }
        match answer.trim() {
            "y" | "yes" => same.push(pair),
            "" | "n" | "no" => {}
            other => bail!("`{other}` is no answer: write yes or no"),
        }
    }
    Ok(same)
}
