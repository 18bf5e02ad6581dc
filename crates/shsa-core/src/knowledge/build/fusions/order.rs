//! The order of fusions: one that reads an output of another comes after it.

use crate::knowledge::build::problems::Problems;
use crate::knowledge::draft::{FusionDraft, Text};
use crate::knowledge::{IdVec, Signal, SignalId};
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::format;
use alloc::vec::Vec;

/// The drafts in that order; those that do not depend on each other stay in the order of the file. Fusions that read what is computed
/// from their own outputs are reported, and left out together with those that read them. Time: O(n log n) in the drafts, A. B. Kahn
/// 1962, doi:10.1145/368996.369025.
pub(super) fn ordered(
    problems: &mut Problems,
    drafts: &[FusionDraft],
    made: &BTreeMap<&str, usize>,
) -> Vec<usize> {
    let before: Vec<BTreeSet<usize>> = drafts
        .iter()
        .map(|draft| read(draft).filter_map(|it| made.get(it.text.as_str()).copied()).collect())
        .collect();
    let mut after: Vec<Vec<usize>> = drafts.iter().map(|_| Vec::new()).collect();
    for (place, sources) in before.iter().enumerate() {
        for source in sources {
            after.get_mut(*source).into_iter().for_each(|it| it.push(place));
        }
    }
    let mut waiting: Vec<usize> = before.iter().map(BTreeSet::len).collect();
    let mut free: BTreeSet<usize> =
        waiting.iter().enumerate().filter(|(_, count)| **count == 0).map(|(place, _)| place).collect();
    let mut order = Vec::new();
    while let Some(place) = free.pop_first() {
        order.push(place);
        for next in after.get(place).into_iter().flatten() {
            let Some(count) = waiting.get_mut(*next) else { continue };
            *count -= 1;
            if *count == 0 {
                free.insert(*next);
            }
        }
    }
    report_cycles(problems, drafts, &before, &order.iter().copied().collect());
    order
}

/// The fusion that computes each output; one with the name of a signal of the model is none.
pub(super) fn outputs<'d>(
    drafts: &'d [FusionDraft],
    signals: &IdVec<SignalId, Signal>,
) -> BTreeMap<&'d str, usize> {
    let is_signal = |name: &str| signals.ids().any(|id| signals[id].name == name);
    let all = drafts.iter().enumerate();
    let named =
        all.flat_map(|(place, draft)| draft.outputs.iter().map(move |it| (it.name.text.as_str(), place)));
    named.filter(|(name, _)| !is_signal(name)).collect()
}

/// The names of the signals that a fusion reads.
fn read(draft: &FusionDraft) -> impl Iterator<Item = &Text> {
    draft.inputs.iter().map(|it| &it.name).chain(draft.controls.iter().map(|(_, signal)| signal))
}

/// Goes from each fusion that could not be placed to one that it waits for, until one comes twice.
fn report_cycles(
    problems: &mut Problems,
    drafts: &[FusionDraft],
    before: &[BTreeSet<usize>],
    placed: &BTreeSet<usize>,
) {
    let mut seen = placed.clone();
    for first in 0..drafts.len() {
        let (mut path, mut at) = (Vec::new(), first);
        while seen.insert(at) {
            path.push(at);
            let source = before.get(at).and_then(|it| it.iter().find(|it| !placed.contains(it)));
            at = source.copied().unwrap_or(at);
        }
        if let Some(begin) = path.iter().position(|place| *place == at) {
            report(problems, drafts, path.get(begin..).unwrap_or(&[]));
        }
    }
}

/// Reports fusions of which each reads the next one, and the last one the first.
fn report(problems: &mut Problems, drafts: &[FusionDraft], cycle: &[usize]) {
    let names: Vec<&str> =
        cycle.iter().filter_map(|place| Some(drafts.get(*place)?.name.text.as_str())).collect();
    let Some(draft) = cycle.first().and_then(|place| drafts.get(*place)) else { return };
    let message = match names.as_slice() {
        [name] => format!("fusion `{name}` reads its own output"),
        [name, ..] => {
            let round = names.iter().chain([name]).map(|name| format!("`{name}`")).collect::<Vec<_>>();
            format!("fusions read each other: {}", round.join(" reads "))
        }
        [] => return,
    };
    problems.error(&draft.name, message, "let the first of them read signals only");
}
