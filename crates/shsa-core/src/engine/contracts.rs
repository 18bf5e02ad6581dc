//! Contracts in the engine: their evidence is read before any value is published, and an operator may override them for a time.

use super::instruments::{Attested, Instruments};
use super::message::{EventKind, Output};
use super::operator::{Refusal, find_need};
use super::{Engine, Event};
use crate::assurance::{Assurance, Override};
use crate::interval::Truth;
use crate::knowledge::{
    Contract, ContractId, EvidenceSource, IdVec, KnowledgeBase, NeedId, SignalId, Watched,
};
use crate::order::Order;
use crate::reason::Reason;
use crate::substitution::Way;
use crate::time::{Span, Time};
use alloc::boxed::Box;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// The contracts of a running engine; absent where no need demands anything.
#[derive(Debug)]
pub(super) struct Contracts {
    pub(super) assurance: Assurance,
    /// Signals with an observation since evidence was last read, and whether each signal has one.
    updated: Vec<SignalId>,
    is_updated: IdVec<SignalId, bool>,
    /// Evidence from operators.
    pub(super) attested: Attested,
}

impl Contracts {
    /// The contracts of a model; `None` where no need demands anything.
    pub(super) fn of(knowledge: &KnowledgeBase) -> Option<Box<Contracts>> {
        let assurance = Assurance::new(knowledge)?;
        let count = knowledge.signals().len();
        Some(Box::new(Contracts {
            assurance,
            updated: Vec::with_capacity(count),
            is_updated: IdVec::filled(count, |_| false),
            attested: Attested::new(),
        }))
    }

    /// Notes an observation of a signal.
    pub(super) fn note_value(&mut self, signal: SignalId) {
        if !core::mem::replace(&mut self.is_updated[signal], true) {
            self.updated.push(signal);
        }
    }
}

impl Engine {
    /// Reads the evidence that may have changed; returns whether other sources may be admissible now.
    pub(super) fn follow_evidence(&mut self, now: Time) -> bool {
        let Engine { contracts, knowledge, monitor, judge, ledger, providers, outputs, .. } = self;
        let Some(contracts) = contracts else { return false };
        let is_updated = |signal| contracts.is_updated[signal];
        let attested = Some(&contracts.attested);
        let instruments = Instruments { knowledge, monitor, judge, ledger, attested, now };
        let mut has_changed = false;
        for provider in providers.iter_mut() {
            let (is_changed, event) = provider.follow_evidence(&is_updated, &instruments);
            has_changed |= is_changed;
            outputs.extend(event.map(Output::Event));
        }
        let Contracts { updated, is_updated, .. } = &mut **contracts;
        updated.drain(..).for_each(|signal| is_updated[signal] = false);
        has_changed
    }

    /// Chooses the source of each need under contract again.
    pub(super) fn replan_under_contract(&mut self, now: Time) {
        let (providers, outputs, mut situation) = self.situation(now, None);
        situation.is_about_contracts = true;
        for provider in providers.iter_mut().filter(|provider| provider.is_under_contract()) {
            outputs.extend(provider.replan(&situation).map(Output::Event));
        }
    }

    /// Overrides the contract of a need for a time, and reports the override with the operator's reason.
    pub(super) fn override_contract(
        &mut self,
        order: &Order,
        name: &str,
        lasts: Span,
        because: &str,
        now: Time,
    ) -> Result<Option<Reason>, Refusal> {
        let need = find_need(&self.knowledge, name)?;
        if lasts <= Span::ZERO || because.trim().is_empty() {
            let reason = Reason::CannotObey { order: order.clone() };
            return Err(Refusal::new(reason, Reason::OverrideNeeds));
        }
        let order = Override { until: now + lasts, because: String::from(because) };
        if !self.providers[need].set_aside(Some(order), now) {
            let reason = Reason::NothingDemanded { need: String::from(name) };
            return Err(Refusal::new(reason, Reason::NothingToDo));
        }
        let reason =
            Reason::ContractOverridden { need: String::from(name), lasts, because: String::from(because) };
        self.report_overridden(need, reason.clone(), now);
        Ok(Some(reason))
    }

    /// Resumes an override from before a change of the model or a restart, for the rest of its time.
    pub(super) fn keep_override(
        &mut self,
        name: &str,
        left: Span,
        because: &str,
        now: Time,
    ) -> Result<(), Refusal> {
        let need = find_need(&self.knowledge, name)?;
        let order = Override { until: now + left, because: String::from(because) };
        if left > Span::ZERO && self.providers[need].set_aside(Some(order), now) {
            return Ok(());
        }
        let over = Reason::OverrideOver { need: String::from(name) };
        Err(Refusal::new(over, Reason::NothingToDo))
    }

    /// Whether contracts let a source be the only one of a need.
    pub(super) fn check_contract(&mut self, need: NeedId, way: &Way, now: Time) -> Result<(), Refusal> {
        let (providers, _, situation) = self.situation(now, None);
        let refused = providers[need].refuses(way, &situation);
        refused.map_or(Ok(()), |because| Err(Refusal::new(because, Reason::OverrideFirst)))
    }

    /// Ends an override; returns whether there was one.
    pub(super) fn end_override(&mut self, need: NeedId, now: Time) -> bool {
        let was_overridden = self.providers[need].overridden().is_some();
        if was_overridden {
            self.providers[need].set_aside(None, now);
            let name = String::from(self.knowledge.need_name(need));
            self.report_overridden(need, Reason::OverrideOver { need: name }, now);
        }
        was_overridden
    }

    fn report_overridden(&mut self, need: NeedId, reason: Reason, now: Time) {
        let variable = Some(self.knowledge.needs()[need].variable);
        let event = Event::new(now, EventKind::Refused, variable, reason.into());
        self.outputs.push_back(Output::Event(Event { need: Some(need), ..event }));
    }

    /// Takes a piece of evidence from an operator: `contract/evidence`.
    pub(super) fn attest(&mut self, name: &str, holds: bool) -> Result<Option<Reason>, Refusal> {
        let names = attestable(&self.knowledge);
        let Some(contracts) = self.contracts.as_mut().filter(|_| names.iter().any(|known| known == name))
        else {
            let reason = Reason::NoEvidence { name: String::from(name) };
            return Err(Refusal::unknown(reason, name, names.iter().map(String::as_str)));
        };
        contracts.attested.insert(String::from(name), holds);
        let evidence = String::from(name);
        Ok(Some(if holds { Reason::Attested { evidence } } else { Reason::Denied { evidence } }))
    }

    /// Whether a piece of evidence of a contract holds now, where a way serves the need.
    ///
    /// Complexity: O(1), but for verdicts, agreement and availability: linear in the comparisons of the signal, and in the ways
    /// of its variable.
    #[must_use]
    pub fn observed(&self, contract: ContractId, watched: &Watched, way: &Way) -> Truth {
        let Engine { knowledge, monitor, judge, ledger, contracts, .. } = self;
        let attested = contracts.as_ref().map(|contracts| &contracts.attested);
        let now = self.now.unwrap_or_default();
        Instruments { knowledge, monitor, judge, ledger, attested, now }.read(contract, watched, way).truth
    }

    /// The orders of operators about contracts that are in force.
    pub(super) fn orders_about_contracts(&self) -> impl Iterator<Item = Order> + '_ {
        let attested_orders = self.contracts.iter().flat_map(|contracts| &contracts.attested);
        let attested_orders = attested_orders
            .map(|(evidence, holds)| Order::Attest { evidence: evidence.clone(), holds: *holds });
        let now = self.now.unwrap_or_default();
        let overridden = self.providers.enumerate().filter_map(move |(need, provider)| {
            let Override { until, because } = provider.overridden()?.clone();
            let need = self.knowledge.needs()[need].signal.clone();
            Some(Order::Override { need, lasts: (until - now).max(Span::ZERO), because })
        });
        attested_orders.chain(overridden)
    }
}

/// The names of the evidence that an operator can give.
fn attestable(knowledge: &KnowledgeBase) -> Vec<String> {
    let of = |contract: &Contract| {
        let attested_orders = contract.evidence.iter().filter(|it| it.source == EvidenceSource::Attested);
        attested_orders.map(|it| format!("{}/{}", contract.name, it.name)).collect::<Vec<_>>()
    };
    knowledge.contracts().rows().iter().flat_map(of).collect()
}
