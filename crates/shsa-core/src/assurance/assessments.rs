//! The ways that may serve one need, each with its composed certificates, under the current evidence.
//!
//! Evidence on which several ways rest is read once. Only what rests on changed evidence is derived again, without allocating.

mod assessed;
mod decision;

use super::assured::{Admitted, Assured, Ground};
use super::reading::{Read, Reading};
use super::{Assessment, Assurance, Bounds, EvidenceId, Lacking, Verdict};
use crate::knowledge::{
    ContractId, EvidenceSource, KnowledgeBase, Measure, NeedId, Policy, SignalId, Watched,
};
use crate::substitution::Way;
use crate::time::{Span, Time};
use crate::trust::Trust;
use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;
use assessed::Assessed;
use core::borrow::Borrow;

/// How many evaluations of certificates the search for the reasons of a refusal may take.
const MOST_EVALUATIONS: usize = 1_000;

/// The contracts' verdicts on the ways that may serve a need. By default nothing is demanded, and every way is admitted.
#[derive(Debug, Default)]
pub struct Assessments(Option<Box<Demanded>>);

/// The order of an operator that lets values out which a contract refuses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Override {
    /// When the override ends.
    pub until: Time,
    /// The operator's reason, in the operator's words.
    pub because: String,
}

/// The demands of a need, and the ways that may meet them.
#[derive(Debug)]
struct Demanded {
    need: NeedId,
    policy: Policy,
    /// For how long demands that were met may become unknown before the way is refused.
    grace: Span,
    ways: Vec<Assessed>,
    pieces: Vec<Piece>,
    /// The index of the way that serves the need.
    running: Option<usize>,
    overridden: Option<Override>,
    /// What can be given at best; made by the first search under contract.
    bounds: Option<Box<Bounds>>,
    /// When an admission changes without an input; [`Time::MAX`] where none does.
    due: Time,
}

/// A way that does not meet the demands.
#[derive(Clone, Debug, PartialEq)]
pub struct Refused {
    /// The way.
    pub way: Way,
    /// The kind of the reason.
    pub verdict: Verdict,
    /// Minimal sets of demands and evidence that would have to change; one of the sets is enough.
    pub lacking: Vec<Vec<Lacking>>,
}

/// A piece of evidence, with the ways that rest on it.
#[derive(Debug)]
struct Piece {
    contract: ContractId,
    watched: Watched,
    /// The index of the way that the evidence is about; `None` for evidence that is not about one way.
    of: Option<usize>,
    reading: Reading,
    /// The ways whose certificates use the evidence, with its id in each.
    places: Vec<(usize, EvidenceId)>,
}

impl Piece {
    /// Whether the evidence may have changed: its signal has a new value, its time has come, or no input announces its changes.
    fn is_due(&self, has_spoken: &dyn Fn(SignalId) -> bool, now: Time) -> bool {
        match self.watched.source {
            EvidenceSource::Signal(
                signal,
                Measure::Rate | Measure::Age | Measure::Width | Measure::Value,
            ) => self.reading.until <= now || has_spoken(signal),
            _ => true,
        }
    }

    /// Whether two pieces are the same. Two contracts that measure alike share a piece; an operator's statement belongs to one
    /// contract.
    fn is(&self, contract: ContractId, watched: &Watched, of: Option<usize>) -> bool {
        let own = &self.watched;
        let is_attested = own.source == EvidenceSource::Attested;
        (own.source, self.of, own.within, own.max_age)
            == (watched.source, of, watched.within, watched.max_age)
            && (!is_attested || (self.contract, &own.name) == (contract, &watched.name))
    }
}

impl Assessments {
    /// The assessments of a need, without a way yet.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase, assurance: Option<&Assurance>, need: NeedId) -> Assessments {
        let demanding = assurance.filter(|assurance| assurance.demands(need));
        Assessments(demanding.map(|_| {
            Box::new(Demanded {
                need,
                policy: Assurance::policy(knowledge, need),
                grace: knowledge.needs()[need].max_age,
                ways: Vec::new(),
                pieces: Vec::new(),
                running: None,
                overridden: None,
                bounds: None,
                due: Time::MAX,
            })
        }))
    }

    /// Whether the need demands anything.
    #[must_use]
    pub fn is_demanding(&self) -> bool {
        self.0.is_some()
    }

    /// Admits a way; `None` where a contract refuses it, or where the way was not considered.
    ///
    /// Complexity: linear in the considered ways.
    pub fn admit<W: Borrow<Way>>(&self, way: W) -> Option<Assured<'_, W>> {
        let admitted = match &self.0 {
            None => Admitted::default(),
            Some(demanded) => demanded.of(way.borrow())?.admitted?,
        };
        Some(Assured::new(way, admitted))
    }

    /// The assessment of a considered way; `None` for any other.
    #[must_use]
    pub fn assessment(&self, way: &Way) -> Option<Assessment> {
        self.0.as_ref()?.of(way).map(|assessed| assessed.assessment)
    }

    /// Why a way does not meet the demands, by minimal sets of what would have to change. `None` where the way meets them, or was
    /// not considered.
    #[must_use]
    pub fn refused(&self, way: &Way) -> Option<Refused> {
        self.0.as_ref()?.of(way).filter(|it| it.assessment.verdict != Verdict::Holds).map(Assessed::refused)
    }

    /// Whether the verdict on some way is open, because evidence is unknown.
    #[must_use]
    pub fn is_any_open(&self) -> bool {
        let is_open = |it: &Assessed| it.assessment.verdict == Verdict::Open;
        self.0.as_ref().is_some_and(|demanded| demanded.ways.iter().any(is_open))
    }

    /// Stores which ways would serve the need, the best first. Each refusal of a way before the first that meets the demands is
    /// reported. While it is unknown of the serving way whether it still meets them, no refusal of a lesser way is reported.
    pub fn prefer(&mut self, ways: &[Way]) {
        let Some(demanded) = &mut self.0 else { return };
        demanded.ways.iter_mut().for_each(|it| it.is_preferred = false);
        for way in ways {
            let place = demanded.place(way);
            let Some(assessed) = place.and_then(|at| demanded.ways.get_mut(at)) else { continue };
            if assessed.assessment.verdict == Verdict::Holds {
                break;
            }
            assessed.is_preferred = true;
            if assessed.admitted.is_some_and(|it| it.ground == Ground::Lapsing) {
                break;
            }
        }
    }

    /// The preferred ways that do not meet the demands and have to be reported. A refusal is reported once when it begins, and
    /// not again within `calm`; an open verdict is reported once it has lasted too long.
    pub fn due_refusals(&mut self, calm: Span, now: Time) -> Vec<Refused> {
        let Some(demanded) = &mut self.0 else { return Vec::new() };
        let grace = demanded.grace;
        let due_refusals = |it: &mut Assessed| {
            let is_due = it.report_due_at(grace).is_some_and(|at| at <= now);
            let is_calm = it.reported.is_none_or(|reported| now - reported >= calm);
            if !is_due || !is_calm {
                return None;
            }
            (it.is_news, it.reported) = (false, Some(now));
            Some(it.refused())
        };
        demanded.ways.iter_mut().filter_map(due_refusals).collect()
    }

    /// The operator's override of the contract; `None` where there is none.
    #[must_use]
    pub fn overridden(&self) -> Option<&Override> {
        self.0.as_ref()?.overridden.as_ref()
    }

    /// Lets refused ways be admitted for a time, at the level that they have. Returns whether the need demands anything.
    pub fn override_by(&mut self, order: Override, now: Time) -> bool {
        let Some(demanded) = &mut self.0 else { return false };
        demanded.overridden = Some(order);
        demanded.admit_all(now);
        true
    }

    /// Ends the override.
    pub fn withdraw_override(&mut self) {
        self.0.iter_mut().for_each(|demanded| demanded.overridden = None);
    }

    /// Sets the way that serves the need.
    pub fn run(&mut self, way: Option<&Way>) {
        if let Some(demanded) = &mut self.0 {
            demanded.running = way.and_then(|way| demanded.place(way));
        }
    }

    /// Considers ways: composes the certificates of new ones. [`Assessments::settle`] must follow.
    ///
    /// Complexity: that of composing; with a new way, the evidence of all ways is indexed anew.
    pub fn consider<'w>(
        &mut self,
        knowledge: &KnowledgeBase,
        assurance: Option<&Assurance>,
        ways: impl Iterator<Item = (&'w Way, Trust)>,
    ) {
        let (Some(demanded), Some(assurance)) = (&mut self.0, assurance) else { return };
        for (way, trust) in ways {
            match demanded.place(way).and_then(|at| demanded.ways.get_mut(at)) {
                Some(known) if known.is_kept => known.trust = known.trust.min(trust),
                Some(known) => {
                    (known.is_kept, known.is_candidate, known.trust) = (true, true, trust);
                }
                None => {
                    let composition = assurance.compose(knowledge, demanded.need, way);
                    demanded.ways.push(Assessed::new(way.clone(), trust, composition));
                }
            }
        }
    }

    /// What can be given at best under the current evidence; `None` where nothing is demanded.
    ///
    /// Complexity: that of [`Assurance::bounds`] at the first call, later that of [`Bounds::read`].
    pub fn bounds(
        &mut self,
        knowledge: &KnowledgeBase,
        assurance: &Assurance,
        read: Read<'_>,
    ) -> Option<&Bounds> {
        let demanded = self.0.as_mut()?;
        let need = demanded.need;
        let bounds = demanded.bounds.get_or_insert_with(|| Box::new(assurance.bounds(knowledge, need)));
        bounds.read(knowledge, read);
        Some(bounds)
    }

    /// Decides while all evidence is unknown.
    pub fn begin(&mut self, knowledge: &KnowledgeBase) {
        let Some(demanded) = &mut self.0 else { return };
        demanded.index(knowledge);
        demanded.admit_all(Time::MIN);
    }

    /// Takes over from before a change of the knowledge base. A way that met its demands before, and whose evidence is unknown
    /// now, goes on for as long as its evidence may be unknown. `way` is the way that served, with its old and its new ids.
    pub fn go_on(
        &mut self,
        knowledge: &KnowledgeBase,
        assurance: Option<&Assurance>,
        before: &Assessments,
        way: Option<(&Way, &Way)>,
    ) {
        self.consider(knowledge, assurance, way.into_iter().map(|(_, way)| (way, Trust::Trusted)));
        let Some(demanded) = &mut self.0 else { return };
        demanded.overridden = before.overridden().cloned();
        let Some((old, way)) = way else { return };
        demanded.running = demanded.place(way);
        let old = before.0.as_ref().and_then(|demanded| demanded.of(old));
        let has_held =
            |it: &Assessed| it.admitted.is_some_and(|it| matches!(it.ground, Ground::Met | Ground::Lapsing));
        // Without demands before the change, nothing was unmet.
        let (has_held, open_since) = old.map_or((true, None), |it| (has_held(it), it.open_since));
        let running = demanded.running.and_then(|at| demanded.ways.get_mut(at));
        running.into_iter().for_each(|it| (it.has_held, it.open_since) = (has_held, open_since));
    }

    /// Drops the ways that were not considered since the last call, except the one that serves.
    pub fn forget(&mut self) {
        self.0.iter_mut().for_each(|demanded| demanded.forget());
    }

    /// Reads the evidence of all ways.
    pub fn settle(&mut self, knowledge: &KnowledgeBase, read: Read<'_>, now: Time) {
        let Some(demanded) = &mut self.0 else { return };
        demanded.index(knowledge);
        demanded.follow(&|_| true, read, now);
    }

    /// Reads the evidence that may have changed: that of signals with new values, and evidence that time changes. Returns whether
    /// the admission of a way has changed.
    ///
    /// Complexity: linear in the pieces of evidence, and in what rests on those that have changed; allocates nothing.
    pub fn follow(&mut self, has_spoken: &dyn Fn(SignalId) -> bool, read: Read<'_>, now: Time) -> bool {
        self.0.as_mut().is_some_and(|demanded| demanded.follow(has_spoken, read, now))
    }

    /// When an admission may change without an input.
    #[inline]
    #[must_use]
    pub fn deadline(&self) -> Option<Time> {
        self.0.as_ref().map(|demanded| demanded.due)
    }
}
