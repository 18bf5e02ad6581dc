//! Which ways are admitted now: evidence is read, certificates are assessed, and the policy decides.

use super::{Assessed, Demanded, Piece, Read, Reading};
use crate::assurance::{Admitted, Assessment, Ground, Verdict};
use crate::knowledge::{EvidenceSource, KnowledgeBase, Policy, SignalId};
use crate::statement::Level;
use crate::substitution::Way;
use crate::time::{Span, Time};
use crate::trust::Trust;
use alloc::vec::Vec;

impl Demanded {
    pub(super) fn place(&self, way: &Way) -> Option<usize> {
        let is_running = |at: &usize| self.ways.get(*at).is_some_and(|it| it.way == *way);
        self.running.filter(is_running).or_else(|| self.ways.iter().position(|it| it.way == *way))
    }

    pub(super) fn of(&self, way: &Way) -> Option<&Assessed> {
        self.ways.get(self.place(way)?)
    }

    /// Keeps the considered ways and the one that serves.
    pub(super) fn forget(&mut self) {
        let running = self.running.and_then(|at| self.ways.get(at)).map(|it| it.way.clone());
        self.ways.retain(|it| it.is_kept || Some(&it.way) == running.as_ref());
        self.ways.iter_mut().for_each(|it| it.is_candidate = core::mem::take(&mut it.is_kept));
        self.running = running.and_then(|way| self.ways.iter().position(|it| it.way == way));
    }

    /// Finds the evidence that several ways share.
    pub(super) fn index(&mut self, knowledge: &KnowledgeBase) {
        self.pieces.clear();
        for (at, assessed) in self.ways.iter().enumerate() {
            for (id, contract, watched) in assessed.composition.evidence(knowledge) {
                let of = matches!(watched.source, EvidenceSource::Source(_)).then_some(at);
                match self.pieces.iter_mut().find(|piece| piece.is(contract, watched, of)) {
                    Some(known) => known.places.push((at, id)),
                    None => self.pieces.push(Piece {
                        contract,
                        watched: watched.clone(),
                        of,
                        reading: Reading::UNKNOWN,
                        places: Vec::from([(at, id)]),
                    }),
                }
            }
        }
    }

    pub(super) fn follow(
        &mut self,
        has_spoken: &dyn Fn(SignalId) -> bool,
        read: Read<'_>,
        now: Time,
    ) -> bool {
        let Demanded { ways, pieces, .. } = self;
        for piece in pieces.iter_mut().filter(|piece| piece.is_due(has_spoken, now)) {
            let about = piece.of.or(piece.places.first().map(|&(at, _)| at)).and_then(|at| ways.get(at));
            let Some(about) = about else { continue };
            piece.reading = read(piece.contract, &piece.watched, &about.way);
            for &(at, id) in &piece.places {
                let Some(assessed) = ways.get_mut(at) else { continue };
                let Assessed { composition, evaluation, is_stale, .. } = assessed;
                if evaluation.truth(id) != piece.reading.truth {
                    evaluation.set(composition.system(), id, piece.reading.truth);
                    *is_stale = true;
                }
            }
        }
        ways.iter_mut().filter(|it| it.is_stale).for_each(|it| it.assess(now));
        self.admit_all(now)
    }

    /// Decides which ways are admitted; returns whether an admission has changed.
    pub(super) fn admit_all(&mut self, now: Time) -> bool {
        if self.overridden.as_ref().is_some_and(|order| order.until <= now) {
            self.overridden = None;
        }
        let mut has_changed = false;
        for at in 0..self.ways.len() {
            let ground = self.ways.get(at).and_then(|it| self.ground(at, it, now));
            let Some(assessed) = self.ways.get_mut(at) else { continue };
            let admitted = ground.map(|ground| Admitted { ground, level: assessed.assessment.level });
            has_changed |= admitted != assessed.admitted;
            assessed.admitted = admitted;
        }
        self.due = self.next(now);
        has_changed
    }

    /// The best that candidates give which are trusted at least as much as a way: whether one of them meets the demands, and the
    /// highest level among those that do, or among all where none does.
    fn best(&self, trust: Trust) -> (bool, Option<Level>) {
        let trusted =
            || self.ways.iter().filter(|it| it.is_candidate && it.trust <= trust).map(|it| it.assessment);
        let any_holds = trusted().any(|it| it.verdict == Verdict::Holds);
        let among = trusted().filter(|it| !any_holds || it.verdict == Verdict::Holds);
        (any_holds, among.filter_map(|it| it.level).max())
    }

    /// The ground on which a way is admitted; `None` where it is refused.
    fn ground(&self, at: usize, assessed: &Assessed, now: Time) -> Option<Ground> {
        let Assessment { verdict, level, .. } = assessed.assessment;
        let (any_holds, highest) = self.best(assessed.trust);
        let (is_highest, is_running) = (level == highest, self.running == Some(at));
        match verdict {
            Verdict::Holds if self.policy != Policy::Degrade || is_highest => return Some(Ground::Met),
            Verdict::Open if is_running => {
                let lapses = assessed.lapses(self.grace);
                if lapses.is_some_and(|until| now <= until) {
                    return Some(Ground::Lapsing);
                }
            }
            _ => {}
        }
        match self.policy {
            _ if verdict == Verdict::Holds => None,
            _ if self.overridden.is_some() => (!any_holds || is_running).then_some(Ground::Overridden),
            Policy::Warn => (!any_holds || is_running).then_some(Ground::Warned),
            Policy::Degrade => (!any_holds && is_highest && level.is_some()).then_some(Ground::Degraded),
            Policy::Stop => None,
        }
    }

    fn next(&self, now: Time) -> Time {
        let evidence = self.pieces.iter().map(|piece| piece.reading.until);
        let running = self.running.and_then(|at| self.ways.get(at));
        let lapses = running.and_then(|it| it.lapses(self.grace)).map(|until| until + Span(1));
        let reports = self.ways.iter().filter_map(|it| it.report_due_at(self.grace));
        let all =
            evidence.chain(lapses).chain(reports).chain(self.overridden.as_ref().map(|order| order.until));
        all.filter(|at| *at > now).min().unwrap_or(Time::MAX)
    }
}
