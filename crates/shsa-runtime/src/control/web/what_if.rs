//! What would serve each need of a model without some signals, and what each further loss would bring.
//!
//! A need under contract is served by what its contract admits. Evidence about a lost signal is unknown then; all other evidence is
//! as it should be.

use serde_json::{Map, Value, json};
use shsa_core::analysis::Prospect;
use shsa_core::assurance::{Admitted, Assurance};
use shsa_core::engine::WhatIf;
use shsa_core::knowledge::{KnowledgeBase, NeedId, SignalId};
use shsa_core::plan::Graph;
use shsa_core::substitution::Way;
use std::collections::BTreeSet;

/// The most losses of one signal that are listed for each need.
const MOST_LOSSES: usize = 200;

/// A model with what is planned ahead for its needs, and what contracts would admit.
pub(super) struct Examined {
    planned: WhatIf,
    /// The needs under contract.
    prospects: Vec<Prospect>,
}

/// What would serve a need.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Served {
    pub(super) way: Way,
    utility: f64,
    /// What contracts say; `None` for a need that demands nothing.
    contract: Option<Contract>,
}

/// What contracts say of a way.
#[derive(Clone, Debug, PartialEq)]
enum Contract {
    /// It would serve.
    Admitted(Admitted),
    /// They admit no way: the need would be withheld.
    Refused,
}

impl Served {
    /// Whether contracts let it serve.
    pub(super) fn is_admitted(&self) -> bool {
        self.contract != Some(Contract::Refused)
    }

    fn json(&self, knowledge: &KnowledgeBase) -> Value {
        let mut row = json!({ "words": self.way.describe(knowledge), "utility": self.utility });
        match self.contract {
            None => {}
            Some(Contract::Refused) => row["refused"] = json!(true),
            Some(Contract::Admitted(Admitted { ground, level })) => {
                let scales = knowledge.contracts().scales();
                row["admitted"] = json!(ground.name());
                row["level"] = json!(level.map(|level| scales.written(level)));
            }
        }
        row
    }
}

impl Examined {
    /// Plans ahead as an engine does. Complexity: that of [`WhatIf::new`], and of a [`Prospect`] for each need under contract.
    pub(super) fn new(knowledge: KnowledgeBase) -> Examined {
        let graph = Graph::new(&knowledge);
        let assurance = Assurance::new(&knowledge);
        let under_contract = assurance.iter().flat_map(|assurance| {
            let needs = knowledge.needs().ids().filter(|&need| assurance.demands(need));
            needs.map(|need| Prospect::new(&knowledge, assurance, &graph, need))
        });
        let prospects = under_contract.collect();
        Examined { planned: WhatIf::new(knowledge), prospects }
    }

    pub(super) fn knowledge(&self) -> &KnowledgeBase {
        self.planned.knowledge()
    }

    /// What would serve a need without these signals; `None` where nothing could.
    pub(super) fn best(&self, need: NeedId, lost: &[SignalId]) -> Option<Served> {
        let mut ways = self.planned.ways(need, lost).into_iter();
        let Some(prospect) = self.prospect(need) else {
            return ways.next().map(|(way, utility)| Served { way, utility, contract: None });
        };
        let serving = prospect.serving_without(self.knowledge(), lost);
        let found = serving.and_then(|serving| Some((prospect.ways.get(serving.way)?, serving.admitted)));
        match found {
            Some((candidacy, admitted)) => {
                let known = ways.find(|(way, _)| *way == candidacy.way);
                let utility = known.map_or(candidacy.utility, |(_, utility)| utility);
                let contract = Some(Contract::Admitted(admitted));
                Some(Served { way: candidacy.way.clone(), utility, contract })
            }
            None => {
                ways.next().map(|(way, utility)| Served { way, utility, contract: Some(Contract::Refused) })
            }
        }
    }

    fn prospect(&self, need: NeedId) -> Option<&Prospect> {
        self.prospects.iter().find(|prospect| prospect.need == need)
    }

    /// By need: what would serve it without some signals, and what each further loss would bring.
    ///
    /// # Errors
    /// The name of a signal that the model does not have.
    pub(super) fn answer(&self, lost: &[String]) -> Result<Value, String> {
        let knowledge = self.knowledge();
        let find =
            |name: &String| knowledge.signal(name).ok_or_else(|| format!("the model has no signal '{name}'"));
        let lost: Vec<SignalId> = lost.iter().map(find).collect::<Result<_, _>>()?;
        let needs = knowledge.needs().ids();
        let needs = needs.map(|need| (knowledge.need_name(need).to_owned(), self.of_need(need, &lost)));
        Ok(Value::Object(needs.collect::<Map<_, _>>()))
    }

    fn of_need(&self, need: NeedId, lost: &[SignalId]) -> Value {
        let knowledge = self.knowledge();
        let now = self.best(need, lost);
        let further = self.matters(need).into_iter().filter(|signal| !lost.contains(signal));
        let further = further.take(MOST_LOSSES).map(|signal| {
            let then = self.best(need, &[lost, &[signal]].concat());
            json!({
                "signal": knowledge.signals()[signal].name,
                "changes": then != now,
                "then": then.map(|then| then.json(knowledge)),
            })
        });
        json!({
            "variable": knowledge.variables()[knowledge.needs()[need].variable].name,
            "whole": self.best(need, &[]).map(|whole| whole.json(knowledge)),
            "now": now.as_ref().map(|now| now.json(knowledge)),
            "further": further.collect::<Vec<_>>(),
        })
    }

    /// The signals whose loss alone can make a difference to a need: for its ways, or for what its contract observes.
    fn matters(&self, need: NeedId) -> BTreeSet<SignalId> {
        let observed = self.prospect(need).into_iter().flat_map(|prospect| &prospect.losses);
        let observed = observed.map(|(signal, _)| *signal);
        self.planned.matters(need).iter().copied().chain(observed).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What would serve the need of `models/stop.yaml` without some signals.
    #[track_caller]
    fn check(lost: &[&str], expected: Value) {
        let text = include_str!("../../../../../models/stop.yaml");
        let model = Examined::new(shsa_model::load(text, "stop.yaml").knowledge);
        let lost: Vec<String> = lost.iter().map(|&name| name.to_owned()).collect();
        let mut now = model.answer(&lost).unwrap()["dmin"]["now"].take();
        if let Some(now) = now.as_object_mut() {
            now.remove("utility");
        }
        assert_eq!(now, expected);
    }

    #[test]
    fn a_loss_shows_what_contracts_admit_then() {
        check(&[], json!({ "words": "/lidar/nearest", "admitted": "met", "level": "SIL 2" }));
        let both = json!({
            "words": "/sonar/nearest, /camera/nearest by together",
            "admitted": "met",
            "level": "SIL 2",
        });
        check(&["/lidar/nearest"], both);
        // One of the two alone could serve, but has SIL 1 only.
        let refused = json!({ "words": "/camera/nearest by by_camera", "refused": true });
        check(&["/lidar/nearest", "/sonar/nearest"], refused);
        check(&["/lidar/nearest", "/sonar/nearest", "/camera/nearest"], Value::Null);
        // The computer that stops may have no time for it.
        check(&["/computer/idle"], json!({ "words": "/lidar/nearest", "refused": true }));
    }

    #[test]
    fn a_signal_that_only_evidence_is_about_is_among_the_further_losses() {
        let text = include_str!("../../../../../models/stop.yaml");
        let model = Examined::new(shsa_model::load(text, "stop.yaml").knowledge);
        let answer = model.answer(&[]).unwrap();
        let further = answer["dmin"]["further"].as_array().unwrap();
        let idle = further.iter().find(|loss| loss["signal"] == "/computer/idle").unwrap();
        assert_eq!((&idle["changes"], &idle["then"]["refused"]), (&json!(true), &json!(true)));
    }
}
