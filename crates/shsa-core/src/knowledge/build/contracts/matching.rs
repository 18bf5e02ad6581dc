//! Checks that demands can be met and guarantees are demanded, whichever source serves a need.

use super::super::problems::Problems;
use crate::knowledge::contract::{
    Asked, Contract, ContractId, Contracts, Given, HEALER, Party, Policy, Subject,
};
use crate::knowledge::draft::ContractDraft;
use crate::knowledge::{IdVec, KnowledgeBase, RelationId, SignalId, VariableId};
use crate::statement::{Level, Statement};
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// Whether a guarantee meets a demand, or a lower level of it that the policy of who asks lets out.
fn is_taken(asking: &Contract, asked: &Asked, given: &Given) -> bool {
    let scale = |statement: &Statement| statement.level.map(|level| level.scale);
    let any_level = || Statement { level: None, ..asked.statement.clone() };
    given.statement.meets(&asked.statement)
        || asking.policy != Policy::Stop
            && scale(&given.statement) == scale(&asked.statement)
            && given.statement.meets(&any_level())
}

/// Reports demands that no guarantee can meet, and guarantees that nothing demands.
///
/// Time: the demands times the guarantees of their possible providers.
pub(super) fn check(
    problems: &mut Problems,
    knowledge: &KnowledgeBase,
    contracts: &Contracts,
    drafts: &[&ContractDraft],
) {
    let market = Market { knowledge, contracts };
    let mut is_wanted = IdVec::filled(
        contracts.rows().len(),
        |id: ContractId| alloc::vec![false; contracts.rows()[id].gives.len()],
    );
    for ((id, contract), draft) in contracts.rows().enumerate().zip(drafts) {
        for asked in &contract.asks {
            let offers = market.offers(id, asked);
            for (of, at, _) in offers.iter().filter(|(_, _, given)| is_taken(contract, asked, given)) {
                if let Some(wanted) = is_wanted[*of].get_mut(*at) {
                    *wanted = true;
                }
            }
            if !market.can_be_met(id, asked, &offers) {
                let at = draft.asks.iter().find(|it| it.name.text == asked.name);
                let at = at.map_or(&draft.name, |it| &it.name);
                let (message, help) = market.why(asked, &offers);
                problems.warn(at, message, help);
            }
        }
    }
    for ((id, contract), draft) in contracts.rows().enumerate().zip(drafts) {
        for (given, _) in contract.gives.iter().zip(&is_wanted[id]).filter(|(_, wanted)| !**wanted) {
            if market.serves_by_itself(contract) {
                continue;
            }
            let at =
                draft.gives.iter().find(|it| it.name.text == given.name).map_or(&draft.name, |it| &it.name);
            problems.note(
                at,
                format!("nothing demands `{}` of `{}`", given.name, contract.name),
                String::new(),
            );
        }
    }
}

/// Guarantees, each with its contract and its place there.
type Offers<'c> = Vec<(ContractId, usize, &'c Given)>;

/// All guarantees and demands.
pub(super) struct Market<'a> {
    pub(super) knowledge: &'a KnowledgeBase,
    pub(super) contracts: &'a Contracts,
}

impl<'a> Market<'a> {
    /// The guarantees of this type of service by the contracts that may be asked.
    fn offers(&self, of: ContractId, asked: &Asked) -> Offers<'a> {
        let mut offers = Vec::new();
        let service = &asked.statement.service;
        let mut add = |id: ContractId| {
            let gives = self.contracts.rows()[id].gives.iter().enumerate();
            offers.extend(
                gives.filter(|(_, given)| given.statement.service == *service).map(|(at, it)| (id, at, it)),
            );
        };
        match asked.of {
            Party::Provider(variable) => {
                let providers = self.providers(variable).filter(|id| *id != of);
                providers.for_each(&mut add);
            }
            Party::Producer(signal) => {
                self.contracts.of(Subject::Signal(signal)).into_iter().for_each(&mut add)
            }
            Party::Contract(id) => add(id),
            Party::Consumers => {
                let rows = self.contracts.rows().enumerate();
                let needs = rows.filter(|(_, row)| matches!(row.subject, Subject::Need(_)));
                needs.map(|(id, _)| id).for_each(&mut add);
            }
        }
        offers
    }

    /// The contracts of all that may provide a variable.
    fn providers(&self, variable: VariableId) -> impl Iterator<Item = ContractId> + '_ {
        let carriers = self.knowledge.carriers(variable).iter().map(|&id| Subject::Signal(id));
        let producers = self.knowledge.producers(variable).iter().map(|&id| Subject::Relation(id));
        carriers.chain(producers).filter_map(|subject| self.contracts.of(subject))
    }

    /// Whether a demand is met without a guarantee, and the guarantees, by contract and place, that meet it.
    pub(super) fn meets(&self, of: ContractId, asked: &Asked) -> (bool, Vec<(ContractId, usize)>) {
        let asking = &self.contracts.rows()[of];
        let taken = self.offers(of, asked).into_iter().filter(|(_, _, given)| is_taken(asking, asked, given));
        (self.is_met_by_shorthand(of, asked), taken.map(|(id, at, _)| (id, at)).collect())
    }

    fn can_be_met(&self, of: ContractId, asked: &Asked, offers: &Offers<'_>) -> bool {
        let offered = offers.iter().any(|(_, _, given)| given.statement.meets(&asked.statement));
        offered || self.is_met_by_shorthand(of, asked)
    }

    /// Whether an element without a contract can meet a demand: a constant, a signal by its `integrity`, a relation that passes
    /// on the level of its inputs.
    fn is_met_by_shorthand(&self, of: ContractId, asked: &Asked) -> bool {
        let Statement { level, properties, .. } = &asked.statement;
        let is_level_only = properties.is_empty();
        let signal = |id: SignalId| {
            let own = self.contracts.integrity(&self.knowledge.signals()[id].properties);
            self.contracts.of(Subject::Signal(id)).is_none()
                && level.is_none_or(|level| own.is_some_and(|own| own.reaches(level)))
        };
        let relation = |id: RelationId| {
            let own = &self.knowledge.relations()[id].properties;
            self.contracts.of(Subject::Relation(id)).is_none()
                && self.contracts.rows()[of].subject != Subject::Relation(id)
                && level.is_none_or(|level| self.contracts.passes_on(own, level))
        };
        match asked.of {
            Party::Provider(variable) if self.knowledge.variables()[variable].constant.is_some() => true,
            Party::Provider(variable) => {
                let carried = self.knowledge.carriers(variable).iter().any(|&id| signal(id));
                is_level_only
                    && (carried || self.knowledge.producers(variable).iter().any(|&id| relation(id)))
            }
            Party::Producer(id) => is_level_only && signal(id),
            Party::Consumers => {
                !self.contracts.rows().iter().any(|row| matches!(row.subject, Subject::Need(_)))
            }
            Party::Contract(_) => false,
        }
    }

    /// Why a demand can never be met, explained by the nearest guarantee.
    fn why(&self, asked: &Asked, offers: &Offers<'_>) -> (String, String) {
        let scales = self.contracts.scales();
        let message = |why: String| format!("nothing can ever meet `{}`: {why}", asked.name);
        if offers.is_empty() {
            let service = &asked.statement.service;
            let help = match asked.of {
                Party::Contract(_) => "write what it gives under `gives`",
                Party::Consumers => "write what needs give under their contracts",
                _ => "give its signals or relations a contract with `gives`",
            };
            return (message(format!("nobody guarantees anything of `{service}`")), help.to_string());
        }
        let says: Vec<_> =
            offers.iter().filter(|(_, _, given)| given.statement.says(&asked.statement)).collect();
        let best = says.iter().filter_map(|(id, _, given)| Some((given.statement.level?, *id))).max();
        match (best, asked.statement.level) {
            (Some((level, id)), Some(wanted)) if level.scale != wanted.scale => {
                let why = self.levels(level, id, wanted);
                (message(why), "nothing converts one scale into another: state both in one".to_string())
            }
            (Some((level, id)), Some(wanted)) => (
                message(self.levels(level, id, wanted)),
                "ask for less, or show that more is given".to_string(),
            ),
            (None, Some(wanted)) if !says.is_empty() => {
                let why = format!("it is given without a level, and {} is asked", scales.written(wanted));
                (message(why), "state the level of the guarantee".to_string())
            }
            _ => (
                message(self.unmet_property(asked, offers)),
                "compare names, directions and bounds of both".to_string(),
            ),
        }
    }

    fn levels(&self, level: Level, of: ContractId, wanted: Level) -> String {
        let scales = self.contracts.scales();
        let name = &self.contracts.rows()[of].name;
        format!("`{name}` gives {} at most, and {} is asked", scales.written(level), scales.written(wanted))
    }

    /// The first demanded property that the nearest guarantee lacks.
    fn unmet_property(&self, asked: &Asked, offers: &Offers<'_>) -> String {
        let wanted = &asked.statement.properties;
        let met = |given: &Given| {
            wanted.iter().filter(|it| given.statement.properties.iter().any(|own| own.meets(it))).count()
        };
        // Of equals the first, as the file lists the best first.
        let nearest = offers.iter().rev().max_by_key(|(_, _, given)| (met(given), given.statement.level));
        let Some((id, _, given)) = nearest else { return String::new() };
        let missing = wanted.iter().find(|it| !given.statement.properties.iter().any(|own| own.meets(it)));
        let Some(missing) = missing else { return "no guarantee has all of it".to_string() };
        let name = &self.contracts.rows()[*id].name;
        match given.statement.properties.iter().any(|own| own.name == missing.name) {
            true => format!("`{name}` guarantees less, or something else, of `{}`", missing.name),
            false => format!("`{name}` guarantees nothing of `{}`", missing.name),
        }
    }

    /// Whether a contract's guarantees need no demand: those of a need's consumer and of this program.
    fn serves_by_itself(&self, contract: &Contract) -> bool {
        matches!(contract.subject, Subject::Need(_)) || contract.name == HEALER
    }
}
