//! The candidate ways of some substitutions: with their choices of signals, and each measurement once.

use crate::knowledge::{KnowledgeBase, SignalId, SignalSet, VariableId};
use crate::monitor::rests_on;
use crate::substitution::{Substitution, Way};
use alloc::collections::BTreeSet;
use alloc::vec::Vec;

/// The largest number of substitutions, and of ways, considered for one variable.
pub(super) const MOST_SEARCHED: usize = 256;

/// The considered ways of some substitutions, and the number of all.
pub(super) fn candidates(knowledge: &KnowledgeBase, substitutions: &[&Substitution]) -> (Vec<Way>, usize) {
    let counts = |substitution: &&Substitution| choices(knowledge, substitution);
    let counts: Vec<usize> = substitutions.iter().map(counts).collect();
    let possible = counts.iter().fold(0_usize, |sum, count| sum.saturating_add(*count));
    let mut ways: Vec<Way> = Vec::new();
    let mut left = MOST_SEARCHED;
    for (number, (substitution, count)) in substitutions.iter().zip(&counts).enumerate() {
        if substitution.steps.is_empty() {
            // Every signal is included, however many there are.
            ways.extend(spread(knowledge, substitution, *count));
            continue;
        }
        // Each substitution gets its share, and the unused shares of others.
        let share = (left / (substitutions.len() - number)).max(1).min(*count);
        left = left.saturating_sub(share);
        ways.extend(spread(knowledge, substitution, share));
    }
    let all = ways.len() == possible;
    let ways = one_each(knowledge, ways);
    let possible = if all { ways.len() } else { possible };
    (ways, possible)
}

/// The number of choices of one signal for each source.
fn choices(knowledge: &KnowledgeBase, substitution: &Substitution) -> usize {
    let options = |source: &VariableId| match knowledge.variables()[*source].constant {
        Some(_) => 1,
        None => knowledge.carriers(*source).iter().filter(|&&signal| stands(knowledge, signal)).count(),
    };
    substitution.sources.iter().map(options).fold(1_usize, usize::saturating_mul)
}

/// Whether a signal is the first of its variable that carries its measurement.
pub(super) fn stands(knowledge: &KnowledgeBase, signal: SignalId) -> bool {
    let variable = knowledge.signals()[signal].variable;
    let mut carriers = knowledge.carriers(variable).iter();
    let witness = knowledge.witness(signal);
    carriers.find(|&&other| knowledge.witness(other) == witness) == Some(&signal)
}

/// At most `count` choices of a substitution: all of them; or half from the start of the order, and half in which every signal
/// takes a turn and the choices share no signals, as far as possible.
fn spread(knowledge: &KnowledgeBase, substitution: &Substitution, count: usize) -> Vec<Way> {
    let usable = |signal| stands(knowledge, signal);
    if choices(knowledge, substitution) <= count {
        let mut ways = Way::choices(knowledge, substitution, usable, count);
        // In file order, as the rows of a table and so the comparisons are.
        ways.sort_by(|one, other| one.signals.cmp(&other.signals));
        return ways;
    }
    let columns: Vec<Vec<Option<SignalId>>> =
        substitution.sources.iter().map(|&source| column(knowledge, source)).collect();
    let turn = |turn: usize| -> Vec<Option<SignalId>> {
        columns.iter().filter_map(|column| column.iter().cycle().nth(turn).copied()).collect()
    };
    let mut seen: BTreeSet<Vec<Option<SignalId>>> = BTreeSet::new();
    let mut ways = Way::choices(knowledge, substitution, usable, count / 2);
    ways.iter().for_each(|way| _ = seen.insert(way.signals.clone()));
    let way = |signals| Way { substitution: substitution.clone(), signals };
    ways.extend((0..count.div_ceil(2)).map(turn).filter(|signals| seen.insert(signals.clone())).map(way));
    ways
}

/// The signals of a source, the best rated first; none for a constant.
fn column(knowledge: &KnowledgeBase, source: VariableId) -> Vec<Option<SignalId>> {
    if knowledge.variables()[source].constant.is_some() {
        return Vec::from([None]);
    }
    let carriers = knowledge.carriers(source).iter().copied();
    let mut carriers: Vec<SignalId> = carriers.filter(|&signal| stands(knowledge, signal)).collect();
    knowledge.utility().sort_signals(knowledge, &mut carriers);
    carriers.into_iter().map(Some).collect()
}

/// Removes a way with a second name of a measurement when an earlier way rests on the same measurements.
fn one_each(knowledge: &KnowledgeBase, ways: Vec<Way>) -> Vec<Way> {
    let other_name = |way: &Way| way.inputs().any(|signal| knowledge.witness(signal) != signal);
    if !ways.iter().any(other_name) {
        return ways;
    }
    let mut seen: BTreeSet<SignalSet> = BTreeSet::new();
    let mut own: BTreeSet<SignalSet> = BTreeSet::new();
    ways.iter().filter(|way| !other_name(way)).for_each(|way| _ = own.insert(rests_on(knowledge, way)));
    let mut is_new = |way: &Way| {
        let rests_on = rests_on(knowledge, way);
        !own.contains(&rests_on) && seen.insert(rests_on)
    };
    ways.into_iter().filter(|way| !other_name(way) || is_new(way)).collect()
}
