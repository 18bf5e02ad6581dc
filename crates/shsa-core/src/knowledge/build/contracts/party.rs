//! Resolves the party that a demand addresses: a provider of an input, the producer of a signal, a platform, this program, or all
//! consumers.

use super::Reader;
use crate::knowledge::VariableId;
use crate::knowledge::contract::{CONSUMER, ContractId, HEALER, PLATFORM, Party, Subject};
use crate::knowledge::draft::{DemandDraft, Text};
use crate::unit::nearest;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

impl Reader<'_, '_> {
    /// The party that a demand asks, and the type of service.
    pub(super) fn party(
        &mut self,
        draft: &DemandDraft,
        runs_on: Option<ContractId>,
    ) -> Option<(Party, String)> {
        let Some(of) = &draft.of else { return self.usual_party(draft, runs_on) };
        if of.text == PLATFORM {
            if runs_on.is_none() {
                self.problems.error(
                    of,
                    "nothing says what it runs on",
                    "write `runs_on:` with the name of a platform",
                );
            }
            return Some((Party::Contract(runs_on?), PLATFORM.to_string()));
        }
        if of.text == "consumers" {
            return Some((Party::Consumers, CONSUMER.to_string()));
        }
        if let Some(&id) = self.names.get(of.text.as_str()) {
            let service = if of.text == HEALER { HEALER } else { PLATFORM };
            return Some((Party::Contract(id), service.to_string()));
        }
        if let Some(signal) = self.knowledge.signal(&of.text) {
            let variable = self.knowledge.signals()[signal].variable;
            return Some((Party::Producer(signal), self.knowledge.variables()[variable].name.clone()));
        }
        self.provider(of)
    }

    /// The provider of a variable: of an input of the relation, or of the needed variable.
    fn provider(&mut self, of: &Text) -> Option<(Party, String)> {
        let inputs = self.inputs();
        let name = |id: VariableId| self.knowledge.variables()[id].name.as_str();
        let found = self.knowledge.variable(&of.text).filter(|variable| inputs.contains(variable));
        if found.is_none() {
            let signals = self.knowledge.signals().iter().map(|signal| signal.name.as_str());
            let words = [PLATFORM, "consumers"].into_iter();
            let known = inputs.iter().map(|&id| name(id)).chain(self.names.keys().copied()).chain(words);
            let near = nearest(&of.text, known.chain(signals)).map(|near| format!("did you mean `{near}`?"));
            let usual =
                "name an input of the relation, a signal, a platform, `platform`, `consumers` or `shsa`";
            let message = format!("`{}` is nobody who could be asked here", of.text);
            self.problems.error(of, message, near.unwrap_or_else(|| usual.to_string()));
        }
        found.map(|variable| (Party::Provider(variable), name(variable).to_string()))
    }

    /// The variables whose providers can be asked without naming a signal.
    fn inputs(&self) -> Vec<VariableId> {
        match self.subject {
            Subject::Relation(id) => self.knowledge.relations()[id].inputs.clone(),
            Subject::Need(id) => Vec::from([self.knowledge.needs()[id].variable]),
            _ => Vec::new(),
        }
    }

    /// The party of a demand that names none: the provider of the only input, else the platform.
    fn usual_party(&mut self, draft: &DemandDraft, runs_on: Option<ContractId>) -> Option<(Party, String)> {
        let inputs = self.inputs();
        let outputs = match self.subject {
            Subject::Relation(id) => self.knowledge.relations()[id].outputs.as_slice(),
            _ => &[],
        };
        let read: Vec<VariableId> = match outputs {
            [only] => inputs.iter().copied().filter(|input| input != only).collect(),
            _ => inputs,
        };
        match (read.as_slice(), runs_on) {
            ([only], _) => {
                let name = self.knowledge.variables()[*only].name.clone();
                Some((Party::Provider(*only), name))
            }
            ([], Some(platform)) => Some((Party::Contract(platform), PLATFORM.to_string())),
            _ => {
                let message = format!("`{}` does not say who is asked", draft.name.text);
                self.problems.error(
                    &draft.name,
                    message,
                    "write `of:` with an input, a signal or `platform`",
                );
                None
            }
        }
    }
}
