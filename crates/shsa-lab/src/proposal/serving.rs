//! Which relations let something stand in for what serves a need: as few of the proposed ones as do it.

use super::{Proposal, Proposals, Subject, changed};
use crate::LabError;
use shsa_core::analysis::{Options, Tolerance, tolerances};
use shsa_core::knowledge::{KnowledgeBase, NeedId, SignalSet};

/// What learned relations do for a need.
#[derive(Clone, Debug)]
pub struct Serving {
    /// The name under which the need is published.
    pub need: String,
    /// Its variable.
    pub variable: String,
    /// Whether the model knows the variable as it is.
    pub is_served: bool,
    /// The signals whose single loss fails the need in the model as it is, in file order.
    pub single_points: Vec<String>,
    /// Those left with the relations that [`Proposals::serve`] keeps.
    pub left: Vec<String>,
    /// The names of these relations; empty where the proposals do nothing for the need.
    pub relations: Vec<String>,
}

/// How badly a need is served: whether its variable is unknown, and how many single losses fail it.
type Lack = (bool, usize);

impl Proposals {
    /// Keeps the fewest relations with which as little as possible fails a need, and the inactive ones of its variable, which the
    /// model does not get. `need` is the name of a variable or of a publication.
    ///
    /// Relations that explain less are left out first. Time: an analysis of the need for each proposal.
    ///
    /// # Errors
    /// When the model has no such need, or cannot be loaded again.
    pub fn serve(&mut self, subject: &Subject, need: &str) -> Result<Serving, LabError> {
        let live = changed(subject, "")?;
        let knowledge = live.knowledge();
        let id = need_named(knowledge, need)?;
        let before = tolerance(knowledge, id);
        let mut kept: Vec<usize> = (0..self.all.len()).filter(|at| self.all[*at].is_active()).collect();
        let with = |kept: &[usize], all: &[Proposal]| -> Result<Tolerance, LabError> {
            let entries: String = kept.iter().map(|at| all[*at].entry()).collect();
            let change = if entries.is_empty() { entries } else { format!("relations:\n{entries}") };
            let live = changed(subject, &change)?;
            let id = need_named(live.knowledge(), need)?;
            Ok(tolerance(live.knowledge(), id))
        };
        let best = with(&kept, &self.all)?;
        if lack(&best) == lack(&before) {
            kept.clear();
        }
        let mut by_error = kept.clone();
        by_error.sort_by(|one, other| {
            let worst = |at: &usize| self.all[*at].relation.score.worst();
            worst(other).total_cmp(&worst(one))
        });
        for left_out in by_error {
            let fewer: Vec<usize> = kept.iter().copied().filter(|at| *at != left_out).collect();
            if lack(&with(&fewer, &self.all)?) == lack(&best) {
                kept = fewer;
            }
        }
        let after = with(&kept, &self.all)?;
        let variable = knowledge.variables()[knowledge.needs()[id].variable].name.clone();
        let serving = Serving {
            need: knowledge.needs()[id].signal.clone(),
            is_served: before.known,
            single_points: names(knowledge, &before.single_points),
            left: names(knowledge, &after.single_points),
            relations: kept.iter().map(|at| self.all[*at].name.clone()).collect(),
            variable,
        };
        self.keep(&serving);
        let entries: String = self.all.iter().filter(|it| it.is_active()).map(Proposal::entry).collect();
        self.after = match entries.is_empty() {
            true => self.before,
            false => super::worth(changed(subject, &format!("relations:\n{entries}"))?.knowledge()),
        };
        Ok(serving)
    }

    fn keep(&mut self, serving: &Serving) {
        self.all.retain(|it| match it.is_active() {
            true => serving.relations.contains(&it.name),
            false => it.variables.contains(&serving.variable),
        });
    }
}

fn lack(tolerance: &Tolerance) -> Lack {
    (!tolerance.known, tolerance.single_points.len())
}

fn tolerance(knowledge: &KnowledgeBase, need: NeedId) -> Tolerance {
    let options = Options { addition_steps: 0, only_runnable: true, ..Options::default() };
    tolerances(knowledge, &SignalSet::new(), options)[need].clone()
}

fn names(knowledge: &KnowledgeBase, signals: &SignalSet) -> Vec<String> {
    signals.iter().map(|signal| knowledge.signals()[signal].name.clone()).collect()
}

fn need_named(knowledge: &KnowledgeBase, name: &str) -> Result<NeedId, LabError> {
    let variable = |id: NeedId| &knowledge.variables()[knowledge.needs()[id].variable].name;
    let mut ids = knowledge.needs().ids();
    ids.find(|id| knowledge.needs()[*id].signal == name || variable(*id) == name).ok_or_else(|| {
        let known: Vec<&str> = knowledge.needs().ids().map(|id| variable(id).as_str()).collect();
        let known = if known.is_empty() { "it has none".to_owned() } else { known.join(", ") };
        LabError::Unfit(format!("the model has no need `{name}`; its needs: {known}"))
    })
}
