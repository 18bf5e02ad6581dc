//! The model of a healer, and its changes: by an operator's order, and by the parts of others.

use super::Healer;
use crate::bindings::Bindings;
use crate::error::RuntimeError;
use crate::execution::Execution;
use crate::inputs::Inputs;
use crate::outlet::Outlet;
use crate::wiring::Takeover;
use shsa_bridge::{Bridge, BridgeError, Offered};
use shsa_core::knowledge::{Draft, IdVec, KnowledgeBase, NeedId, SignalId};
use shsa_core::time::Time;
use shsa_format::drive::{Era, Given};
use shsa_model::live::Written;
use shsa_model::write;
use std::collections::BTreeSet;
use std::fs;
use std::sync::Arc;

impl Healer {
    /// Writes down who has given an order that was carried out.
    pub(in super::super) fn ordered(&mut self, now: Time, by: &str, done: &str) {
        self.files.input_log.ordered(now, by, done);
    }

    /// The bindings of its model; `serving` gives the signal that serves a need now.
    fn bindings(
        &self,
        knowledge: &KnowledgeBase,
        serving: impl Fn(NeedId) -> Option<SignalId>,
    ) -> Result<Bindings, RuntimeError> {
        Bindings::new(knowledge, &self.output_options, &self.carriers, serving, self.bus)
    }

    /// Binds the engine's present model to the bus; returns the topics that the bus refuses, with the reasons.
    ///
    /// # Errors
    /// When the model does not fit the bus; all models but the first were checked before.
    pub(super) fn connect(
        &mut self,
        bridge: &mut dyn Bridge,
    ) -> Result<Vec<(Arc<str>, BridgeError)>, RuntimeError> {
        let knowledge = self.engine.knowledge();
        let serving = |need| {
            let source = self.engine.need_status(need).source?;
            knowledge.signal(source.way()?)
        };
        let bindings = self.bindings(knowledge, serving).or_else(|_| self.bindings(knowledge, |_| None))?;
        let Bindings { inputs, outlets, takeovers, carriers } = bindings;
        self.heard = heard(&outlets, &inputs).filter(|_| self.hears).collect();
        let names = inputs.topics().cloned().chain(self.heard.keys().map(|name| Arc::from(&**name)));
        let subscribed = names.map(|topic: Arc<str>| (topic.clone(), bridge.subscribe(&topic, None)));
        let refused = subscribed.filter_map(|(topic, done)| Some((topic, done.err()?))).collect();
        let before = std::mem::take(&mut self.outlets);
        for outlet in outlets.iter() {
            let same = before.iter().find(|before| before.topic() == outlet.topic());
            self.outlets.push(same.map_or_else(|| outlet.clone(), |before| outlet.succeeding(before)));
        }
        let offered: Vec<Offered<'_>> = self.outlets.iter().map(Outlet::offered).collect();
        bridge.offer(&self.name, &offered);
        let mut taken = std::mem::take(&mut self.takeovers);
        for takeover in takeovers {
            let same = taken.iter().position(|before| takeover.is_same(before)).map(|at| taken.remove(at));
            self.takeovers.push(match same {
                Some(before) => takeover.succeeding(before),
                None => takeover,
            });
        }
        self.leaving.extend(taken.into_iter().filter(Takeover::is_silencing));
        self.backlog.clear();
        self.withheld = IdVec::filled(knowledge.needs().len(), |_| None);
        self.executions.clear();
        for _ in knowledge.needs() {
            self.executions.push(Execution::new()?);
        }
        if let Some(workers) = &mut self.workers {
            workers.renew(knowledge)?;
        }
        (self.inputs, self.carriers) = (inputs, carriers);
        Ok(refused)
    }

    /// Replaces the model by the present content of its file; returns the names of the needs that it lacks. It may lack some only by
    /// `force`: a file that is cut off reads as a model without needs.
    ///
    /// # Errors
    /// What is wrong with the new model; nothing has changed then.
    pub(in super::super) fn reload(&mut self, force: bool, now: Time) -> Result<Vec<String>, String> {
        let Some(path) = &self.path else { return Err(format!("the model {} is in no file", self.name)) };
        let name = path.display().to_string();
        let text = fs::read_to_string(path).map_err(|error| format!("{name}: {error}"))?;
        self.change(&name, &text, force, now)
    }

    /// Applies a change of the model, or a whole new model; returns the names of the needs that are no more, if `may_lack` allows it.
    ///
    /// # Errors
    /// What is wrong with the new model; nothing has changed then.
    pub(in super::super) fn change(
        &mut self,
        name: &str,
        text: &str,
        may_lack: bool,
        now: Time,
    ) -> Result<Vec<String>, String> {
        let mut own = self.own.clone();
        if let Some(own) = &mut own {
            own.change(Written { name, text }).map_err(|report| report.render(false))?;
        }
        let lost = self.adopt(name, text, may_lack, now)?;
        self.own = own;
        Ok(lost)
    }

    /// The model without the parts of others.
    pub(in super::super) fn own(&self) -> &Draft {
        self.own.as_ref().unwrap_or(&self.live).draft()
    }

    /// The version of the model without the parts of others; each change gives another one.
    pub(in super::super) fn version(&self) -> u64 {
        self.own.as_ref().unwrap_or(&self.live).knowledge().version()
    }

    /// Replaces the model by its own one with parts of others.
    ///
    /// # Errors
    /// What is wrong with the joined model; nothing has changed then.
    pub(in super::super) fn join(&mut self, whole: &Draft, now: Time) -> Result<(), String> {
        let text = write::yaml(whole);
        if text == write::yaml(self.live.draft()) {
            return Ok(());
        }
        let own = self.own.clone().unwrap_or_else(|| self.live.clone());
        self.adopt("parts", &text, true, now)?;
        self.own = (text != write::yaml(own.draft())).then_some(own);
        Ok(())
    }

    /// Replaces the model; returns the names of the needs that it lacks, if `may_lack` allows it.
    fn adopt(&mut self, name: &str, text: &str, may_lack: bool, now: Time) -> Result<Vec<String>, String> {
        let mut live = self.live.clone();
        live.change(Written { name, text }).map_err(|report| report.render(false))?;
        let lost = lost(self.live.knowledge(), live.knowledge());
        if !may_lack && !lost.is_empty() {
            let lost = lost.join(", ");
            return Err(format!(
                "{name}: this model has no need {lost} any more, so nothing would serve it; \
                 order {{\"order\": \"reload\", \"force\": true}} if that is meant"
            ));
        }
        self.bindings(live.knowledge(), |_| None).map_err(|error| error.chain())?;
        let change = Some((name.to_owned(), text.to_owned()));
        let era = Era { from: now, knowledge: live.knowledge().clone(), change, inputs: Vec::new() };
        self.files.input_log.record(Given::Era(&era));
        self.engine.reload(era.knowledge, now);
        self.live = live;
        Ok(lost)
    }
}

/// The names of needs that a new model lacks.
fn lost(before: &KnowledgeBase, after: &KnowledgeBase) -> Vec<String> {
    let names: BTreeSet<&str> = after.needs().iter().map(|need| &*need.signal).collect();
    let needs = before.needs().iter().filter(|need| !names.contains(&*need.signal));
    needs.map(|need| need.signal.clone()).collect()
}

/// The needs by their names, without those under whose name a source publishes.
fn heard(outlets: &IdVec<NeedId, Outlet>, inputs: &Inputs) -> impl Iterator<Item = (String, NeedId)> {
    let plain = |name: &str| name.trim_matches('/').to_owned();
    let sources: BTreeSet<String> = inputs.topics().map(|topic| plain(topic)).collect();
    let needs = outlets.enumerate().map(|(id, outlet)| (outlet.topic().to_owned(), id));
    needs.filter(move |(topic, _)| !sources.contains(&plain(topic)))
}
