//! The evidence behind accusations, kept for the live page.

use crate::healer::Healer;
use serde_json::Value;
use shsa_core::engine::{Event, Evidence};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::time::Time;
use std::collections::VecDeque;

/// Puts the evidence about the signal of a decision into words; times in them count from the given one.
pub type Explainer = Box<dyn Fn(&KnowledgeBase, Time, &Evidence, &Event) -> Value + Send>;

/// The accusations whose evidence is kept.
const KEPT: usize = 100;

/// In a monitor with more comparisons the evidence is not collected: it would delay the next decision.
const MOST_COMPARISONS: usize = 4_096;

/// The evidence of the latest accusations, by the numbers of the decisions.
pub(super) struct Explained {
    explainer: Option<Explainer>,
    began: Time,
    kept: VecDeque<(u64, Value)>,
}

impl Explained {
    /// Nothing is kept without an explainer. Times count from `began`.
    pub(super) fn new(explainer: Option<Explainer>, began: Time) -> Explained {
        Explained { explainer, began, kept: VecDeque::new() }
    }

    /// Keeps the evidence for a decision of this number, if it accuses a signal. Call it before the next input.
    pub(super) fn keep(&mut self, number: u64, healer: &Healer, event: &Event) {
        let (Some(explainer), Some(signal)) = (&self.explainer, event.signal) else { return };
        let (engine, known) = (healer.engine(), healer.reported_model());
        let is_small = engine.monitor().residuals().len() <= MOST_COMPARISONS;
        if !event.kind.accuses() || !is_small || known.version() != engine.knowledge().version() {
            return;
        }
        if self.kept.len() == KEPT {
            self.kept.pop_front();
        }
        let evidence = engine.evidence(signal, event.time);
        self.kept.push_back((number, explainer(known, self.began, &evidence, event)));
    }

    /// The evidence for the decision of this number; `None` if it accuses no signal, or is kept no longer.
    pub(super) fn of(&self, number: u64) -> Option<&Value> {
        self.kept.iter().find(|(kept, _)| *kept == number).map(|(_, evidence)| evidence)
    }
}
