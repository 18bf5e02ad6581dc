//! The ways that may serve one need, each with its certificates composed, under the evidence of now.
//!
//! Evidence that several ways rest on is read once. What changes is derived again by itself; nothing is allocated for that.

mod assessed;
mod decision;

use super::assured::{Admitted, Assured, Ground};
use super::{Assessment, Assurance, EvidenceId, Lacking, Verdict};
use crate::interval::Truth;
use crate::knowledge::{
    ContractId, EvidenceSource, KnowledgeBase, Measure, NeedId, Policy, SignalId, Watched,
};
use crate::substitution::Way;
use crate::time::{Span, Time};
use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;
use assessed::Assessed;
use core::borrow::Borrow;

/// How often certificates are evaluated to find out why something is refused.
const MOST_EVALUATIONS: usize = 1_000;

/// What is known of a piece of evidence at a moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading {
    /// Whether it is so.
    pub truth: Truth,
    /// When the passing of time alone may change that; [`Time::MAX`] where it does not.
    pub until: Time,
}

impl Reading {
    /// Nothing is known.
    pub const UNKNOWN: Reading = Reading::lasting(Truth::Unknown);

    /// What time alone does not change.
    #[must_use]
    pub const fn lasting(truth: Truth) -> Reading {
        Reading { truth, until: Time::MAX }
    }
}

/// Reads a piece of evidence of a contract, while a way serves the need.
pub type Read<'r> = &'r (dyn Fn(ContractId, &Watched, &Way) -> Reading + Sync);

/// What contracts say of the ways that may serve a need. By default nothing is demanded, and everything is admitted.
#[derive(Debug, Default)]
pub struct Assessments(Option<Box<Demanded>>);

/// An operator lets out what a contract refuses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Override {
    /// Until when.
    pub until: Time,
    /// Why, in the operator's words.
    pub because: String,
}

/// How far those who observe the system trust a way, whatever contracts say; the best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Trust {
    /// It is.
    Trusted,
    /// Its signals have just come back.
    Returning,
    /// Nothing speaks against it any more, and nothing for it.
    Unproven,
    /// It may be wrong, or is asked about by order only.
    Doubted,
}

/// What a need demands, and who gives it.
#[derive(Debug)]
struct Demanded {
    need: NeedId,
    policy: Policy,
    /// For how long what was met may be unknown.
    grace: Span,
    ways: Vec<Assessed>,
    pieces: Vec<Piece>,
    /// Where the way stands that serves the need.
    running: Option<usize>,
    overridden: Option<Override>,
    /// When something changes though nothing comes; [`Time::MAX`] where nothing does.
    due: Time,
}

/// A way that does not meet what is demanded.
#[derive(Clone, Debug, PartialEq)]
pub struct Refused {
    /// The way.
    pub way: Way,
    /// Of which kind the reason is.
    pub verdict: Verdict,
    /// Minimal sets of what would have to change, of which one would do.
    pub lacking: Vec<Vec<Lacking>>,
}

/// A piece of evidence, with the ways that rest on it.
#[derive(Debug)]
struct Piece {
    contract: ContractId,
    watched: Watched,
    /// The way that it is about.
    of: Option<usize>,
    reading: Reading,
    /// Where it stands in the certificates of ways.
    places: Vec<(usize, EvidenceId)>,
}

impl Piece {
    /// Whether it may have changed: its signal has spoken, its time has come, or nothing tells when it does.
    fn is_due(&self, has_spoken: &dyn Fn(SignalId) -> bool, now: Time) -> bool {
        match self.watched.source {
            EvidenceSource::Signal(
                signal,
                Measure::Rate | Measure::Age | Measure::Width | Measure::Value,
            ) => self.reading.until <= now || has_spoken(signal),
            EvidenceSource::Signal(..) | EvidenceSource::Source(_) | EvidenceSource::Told => true,
        }
    }

    /// Whether it is the same: what two contracts measure alike is one piece, what is told them is not.
    fn is(&self, contract: ContractId, watched: &Watched, of: Option<usize>) -> bool {
        let own = &self.watched;
        let is_told = own.source == EvidenceSource::Told;
        (own.source, self.of, own.within, own.max_age)
            == (watched.source, of, watched.within, watched.max_age)
            && (!is_told || (self.contract, &own.name) == (contract, &watched.name))
    }
}

impl Assessments {
    /// Of a need, no way of which is known yet.
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
                due: Time::MAX,
            })
        }))
    }

    /// Whether anything is demanded.
    #[must_use]
    pub fn is_demanding(&self) -> bool {
        self.0.is_some()
    }

    /// What may serve now; `None` where a contract forbids it, or where the way was not asked about.
    ///
    /// Complexity: linear in the ways that were asked about.
    pub fn admit<W: Borrow<Way>>(&self, way: W) -> Option<Assured<'_, W>> {
        let admitted = match &self.0 {
            None => Admitted::default(),
            Some(demanded) => demanded.of(way.borrow())?.admitted?,
        };
        Some(Assured::new(way, admitted))
    }

    /// The verdict on a way that was asked about.
    #[must_use]
    pub fn assessment(&self, way: &Way) -> Option<Assessment> {
        self.0.as_ref()?.of(way).map(|assessed| assessed.assessment)
    }

    /// Why a way does not meet what is demanded: the minimal sets of what would have to change; `None` where it does, or was not
    /// asked about.
    #[must_use]
    pub fn refused(&self, way: &Way) -> Option<Refused> {
        self.0.as_ref()?.of(way).filter(|it| it.assessment.verdict != Verdict::Holds).map(Assessed::refused)
    }

    /// Whether it is not known of some way whether it meets what is demanded.
    #[must_use]
    pub fn is_any_open(&self) -> bool {
        let is_open = |it: &Assessed| it.assessment.verdict == Verdict::Open;
        self.0.as_ref().is_some_and(|demanded| demanded.ways.iter().any(is_open))
    }

    /// These ways, the best first, are those that would serve: of those before the first that meets what is demanded it is news
    /// when they do not.
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
        }
    }

    /// Preferred ways that do not meet what is demanded, each once when that begins, and not again before it has been `calm`; of
    /// what is not known, when that has lasted too long.
    pub fn untold(&mut self, calm: Span, now: Time) -> Vec<Refused> {
        let Some(demanded) = &mut self.0 else { return Vec::new() };
        let grace = demanded.grace;
        let untold = |it: &mut Assessed| {
            let is_due = it.told_at(grace).is_some_and(|at| at <= now);
            let is_calm = it.told.is_none_or(|told| now - told >= calm);
            if !is_due || !is_calm {
                return None;
            }
            (it.is_news, it.told) = (false, Some(now));
            Some(it.refused())
        };
        demanded.ways.iter_mut().filter_map(untold).collect()
    }

    /// How an operator has overridden the contract.
    #[must_use]
    pub fn overridden(&self) -> Option<&Override> {
        self.0.as_ref()?.overridden.as_ref()
    }

    /// What is refused goes out all the same for a time, at the level that it has; whether anything is demanded at all.
    pub fn override_by(&mut self, order: Override, now: Time) -> bool {
        let Some(demanded) = &mut self.0 else { return false };
        demanded.overridden = Some(order);
        demanded.admit_all(now);
        true
    }

    /// What is refused is refused again.
    pub fn withdraw_override(&mut self) {
        self.0.iter_mut().for_each(|demanded| demanded.overridden = None);
    }

    /// Which way serves the need from now on.
    pub fn run(&mut self, way: Option<&Way>) {
        if let Some(demanded) = &mut self.0 {
            demanded.running = way.and_then(|way| demanded.place(way));
        }
    }

    /// Asks about ways: composes the certificates of those that are new. [`Assessments::settle`] must follow.
    ///
    /// Complexity: that of composing; the evidence of all ways is indexed anew where one is new.
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

    /// Decides while nothing is known of any evidence.
    pub fn begin(&mut self, knowledge: &KnowledgeBase) {
        let Some(demanded) = &mut self.0 else { return };
        demanded.index(knowledge);
        demanded.admit_all(Time::MIN);
    }

    /// Goes on from before a change of the knowledge base: what met its demands then and is not known to now goes on for as long as
    /// that may be unknown. `way` is what served then, and what it is called now.
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
        // Where nothing was demanded before, nothing was missing.
        let (has_held, open_since) = old.map_or((true, None), |it| (has_held(it), it.open_since));
        let running = demanded.running.and_then(|at| demanded.ways.get_mut(at));
        running.into_iter().for_each(|it| (it.has_held, it.open_since) = (has_held, open_since));
    }

    /// Forgets the ways that were not asked about since the last time, but for the one that serves.
    pub fn forget(&mut self) {
        self.0.iter_mut().for_each(|demanded| demanded.forget());
    }

    /// Reads the evidence of all ways.
    pub fn settle(&mut self, knowledge: &KnowledgeBase, read: Read<'_>, now: Time) {
        let Some(demanded) = &mut self.0 else { return };
        demanded.index(knowledge);
        demanded.follow(&|_| true, read, now);
    }

    /// Reads the evidence that may have changed: of signals that have spoken, and what time changes. Whether a way is admitted
    /// otherwise than before.
    ///
    /// Complexity: linear in the pieces of evidence, and in what rests on those that have changed; allocates nothing.
    pub fn follow(&mut self, has_spoken: &dyn Fn(SignalId) -> bool, read: Read<'_>, now: Time) -> bool {
        self.0.as_mut().is_some_and(|demanded| demanded.follow(has_spoken, read, now))
    }

    /// When something changes though nothing comes.
    #[inline]
    #[must_use]
    pub fn deadline(&self) -> Option<Time> {
        self.0.as_ref().map(|demanded| demanded.due)
    }
}
