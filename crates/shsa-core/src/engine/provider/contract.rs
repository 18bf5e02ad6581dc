//! Asks contracts which sources may serve a need, and reports their refusals.

use super::super::instruments::Instruments;
use super::super::message::{Event, EventKind};
use super::situation::{Situation, Succession};
use super::sources::MOST_NAMED;
use super::{Forced, Provider};
use crate::assurance::{Admitted, Assurance, Ground, Lacking, Override, Refused, Verdict};
use crate::knowledge::{KnowledgeBase, SignalId, Watched};
use crate::monitor::{Monitor, WayIndex};
use crate::reason::{Joint, Reason, Reasons};
use crate::substitution::Way;
use crate::time::Time;
use crate::trust::Trust;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// The largest number of sets of lacking evidence that an event lists for one source.
const MOST_SETS: usize = 3;

/// The assessment of a need's source by the contract.
#[derive(Clone, Debug, PartialEq)]
pub struct NeedAssurance {
    /// Ground and level of the admission; `None` while no admitted source serves the need.
    pub admitted: Option<Admitted>,
    /// The verdict on the present source.
    pub verdict: Option<Verdict>,
    /// What the verdict lacks, where it does not hold: sets of evidence or demands, of which one suffices.
    pub lacking: Vec<Vec<Lacking>>,
    /// Until when an operator has overridden the contract.
    pub overridden: Option<Time>,
}

impl Provider {
    /// Begins with the sources that need no evidence, as no evidence is known yet.
    pub(super) fn begin_under_contract(&mut self, knowledge: &KnowledgeBase, assurance: Option<&Assurance>) {
        let Provider { sources, contracts, .. } = self;
        let all = sources.all().iter().map(|source| (&source.way, Trust::Trusted));
        contracts.consider(knowledge, assurance, all);
        contracts.begin(knowledge);
        let may_hold = |way: &&Way| {
            let assessment = contracts.assessment(way);
            assessment.is_some_and(|it| matches!(it.verdict, Verdict::Holds | Verdict::Open))
        };
        let preferred = sources.ways().find(may_hold).cloned();
        sources.keep(|way| contracts.admit(way).is_some());
        sources.preferred = preferred;
    }

    /// A source from before a change of the model goes on until the evidence about it is known again.
    pub(super) fn inherit_contract(&mut self, old: &Provider, change: &Succession<'_>) {
        if !self.contracts.is_demanding() {
            return;
        }
        let (knowledge, assurance) = (change.situation.knowledge, change.situation.assurance());
        let was_admitted = |way: &&Way| old.contracts.admit(*way).is_some();
        let before = old.state.way().filter(was_admitted);
        let way = before.and_then(|way| way.succeeded(change.lineage));
        self.contracts.go_on(knowledge, assurance, &old.contracts, before.zip(way.as_ref()));
    }

    /// Reads the evidence that may have changed. Returns whether the admission of a source has changed; reports an override that
    /// is over.
    pub(in super::super) fn follow_evidence(
        &mut self,
        is_updated: &dyn Fn(SignalId) -> bool,
        instruments: &Instruments<'_>,
    ) -> (bool, Option<Event>) {
        if !self.contracts.is_demanding() {
            return (false, None);
        }
        let &Instruments { knowledge, now, .. } = instruments;
        let read = |contract, watched: &Watched, way: &Way| instruments.read(contract, watched, way);
        let was_overridden = self.contracts.overridden().is_some();
        let has_changed = self.contracts.follow(is_updated, &read, now);
        let is_over = was_overridden && self.contracts.overridden().is_none();
        let event = is_over.then(|| {
            let need = String::from(knowledge.need_name(self.settings.need));
            self.event(knowledge, EventKind::Refused, Reason::OverrideOver { need }, now)
        });
        (has_changed || is_over, event)
    }

    /// Whether the need demands anything of contracts.
    pub(in super::super) fn is_under_contract(&self) -> bool {
        self.contracts.is_demanding()
    }

    /// The operator's override of the contract.
    pub(in super::super) fn overridden(&self) -> Option<&Override> {
        self.contracts.overridden()
    }

    /// Overrides the refusals of the contract, or ends that (`None`). Returns whether the need demands anything.
    pub(in super::super) fn set_aside(&mut self, order: Option<Override>, now: Time) -> bool {
        match order {
            Some(order) => self.contracts.override_by(order, now),
            None => {
                self.contracts.withdraw_override();
                self.contracts.is_demanding()
            }
        }
    }

    /// Whether a source may be admitted once more is known of the evidence.
    pub(super) fn may_be_admitted_yet(&self) -> bool {
        self.contracts.is_any_open()
    }

    /// The admission of the present source.
    pub(super) fn admitted(&self) -> Option<Admitted> {
        let way = self.state.way()?;
        self.contracts.admit(way).map(|assured| assured.admitted())
    }

    /// The admission of a stand-in.
    pub(super) fn admitted_stand_in(&self, monitor: &Monitor, index: WayIndex) -> Option<Admitted> {
        let way = monitor.way(index)?.computation.way();
        self.contracts.admit(way).map(|assured| assured.admitted())
    }

    /// Admits the source that is ordered for the need; else returns why contracts refuse it.
    pub(super) fn admit_forced(&mut self, situation: &Situation<'_>) -> Result<(), Reasons> {
        let Some(Forced { way, .. }) = self.forced.as_ref().filter(|_| self.contracts.is_demanding()) else {
            return Ok(());
        };
        situation.assess_one(&mut self.contracts, way);
        match self.contracts.admit(way) {
            Some(_) => Ok(()),
            None => Err(self.why_not(situation.knowledge, way).unwrap_or_default()),
        }
    }

    /// Why contracts refuse a way that serves by order; `None` where they admit it.
    pub(in super::super) fn refuses(&mut self, way: &Way, situation: &Situation<'_>) -> Option<Reasons> {
        if !self.contracts.is_demanding() {
            return None;
        }
        let serving = self.state.way().cloned();
        situation.assess_one(&mut self.contracts, way);
        let is_refused = self.contracts.admit(way).is_none();
        let why = is_refused.then(|| self.why_not(situation.knowledge, way)).flatten();
        self.contracts.run(serving.as_ref());
        why
    }

    /// Why contracts do not admit the present source any more; `None` where they do.
    pub(super) fn why_not_admitted(&self, knowledge: &KnowledgeBase) -> Option<Reasons> {
        let way = self.state.way().filter(|way| self.contracts.admit(*way).is_none())?;
        self.why_not(knowledge, way)
    }

    fn why_not(&self, knowledge: &KnowledgeBase, way: &Way) -> Option<Reasons> {
        let refused = self.contracts.refused(way)?;
        let because = Reasons::from(Reason::NotAdmitted { source: way.describe(knowledge) });
        Some(lacking(because.then(Joint::Namely, verdict(&refused)), &refused.lacking))
    }

    /// The reason that contracts admit no source, where that is why the need is not served.
    pub(super) fn why_none_admitted(&self) -> Option<Reasons> {
        let is_served = self.state.serving().is_some() || !self.sources.all().is_empty();
        (self.contracts.is_demanding() && !is_served).then(|| Reason::NoneAdmitted.into())
    }

    /// Reports which preferred sources contracts refuse, once each time; where evidence is unknown, only after the longest age of
    /// a value.
    pub(super) fn report_not_admitted(&mut self, knowledge: &KnowledgeBase, now: Time) -> Option<Event> {
        let calm = self.settings.switching.probation;
        let due_refusals = self.contracts.due_refusals(calm, now);
        if due_refusals.is_empty() {
            return None;
        }
        let need = String::from(knowledge.need_name(self.settings.need));
        let mut because = Reasons::from(Reason::ContractForbids { need });
        let mut joint = Joint::Namely;
        for refused in due_refusals.iter().take(MOST_NAMED) {
            let source = Reasons::from(Reason::ShortSource { source: refused.way.describe(knowledge) });
            let shortfall = lacking(source.then(Joint::Namely, verdict(refused)), &refused.lacking);
            because = because.then(joint, shortfall);
            joint = Joint::Next;
        }
        if let Some(more) = due_refusals.len().checked_sub(MOST_NAMED).filter(|more| *more > 0) {
            because = because.then(Joint::Next, Reason::MoreSources { count: more as u64 });
        }
        if let Some(all_the_same) = self.goes_out_all_the_same(knowledge) {
            because = because.then(Joint::Next, all_the_same);
        }
        Some(self.event(knowledge, EventKind::Refused, because, now))
    }

    fn goes_out_all_the_same(&self, knowledge: &KnowledgeBase) -> Option<Reason> {
        let Admitted { ground, level } = self.admitted()?;
        let level = level.map(|level| knowledge.contracts().scales().written(level));
        match ground {
            Ground::Degraded | Ground::Warned | Ground::Overridden => {
                Some(Reason::GoesOutAllTheSame { level: level.unwrap_or_else(|| String::from("no level")) })
            }
            Ground::Undemanded | Ground::Met | Ground::Lapsing => None,
        }
    }

    /// The assessment of the present service by the contract.
    pub(super) fn assurance(&self) -> Option<NeedAssurance> {
        if !self.contracts.is_demanding() {
            return None;
        }
        let way = self.state.way().or(self.sources.preferred.as_ref());
        let assessment = way.and_then(|way| self.contracts.assessment(way));
        Some(NeedAssurance {
            admitted: self.admitted(),
            verdict: assessment.map(|assessment| assessment.verdict),
            lacking: way.and_then(|way| self.contracts.refused(way)).map(|it| it.lacking).unwrap_or_default(),
            overridden: self.contracts.overridden().map(|order| order.until),
        })
    }
}

/// The reason's kind.
fn verdict(refused: &Refused) -> Reason {
    match refused.verdict {
        Verdict::Holds | Verdict::Refused => Reason::DemandRefused,
        Verdict::Open => Reason::DemandOpen,
        Verdict::Circular => Reason::DemandCircular,
    }
}

/// The sets of what would have to change, the smallest first.
fn lacking(because: Reasons, sets: &[Vec<Lacking>]) -> Reasons {
    sets.iter().take(MOST_SETS).fold(because, |because, set| {
        let leaves = set.iter().map(|leaf| format!("{}: {}", leaf.subject, leaf.name)).collect();
        because.then(Joint::With, Reason::WouldNeed { leaves })
    })
}
