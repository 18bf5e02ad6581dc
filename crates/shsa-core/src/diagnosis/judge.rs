//! The verdict on each signal over time: suspect, failed, and trusted again.
//!
//! A signal has failed when it belongs to every smallest explanation of all conflicts, whatever the comparisons
//! that are still undecided will say. For the other signals of these explanations, the judge first waits for the
//! comparisons that may yet decide, for a bounded time; then they are suspect. What a failed signal
//! explains is no evidence about others. A signal is trusted again after it has moved and every comparison that
//! speaks about it has agreed for the probation time. Without a comparison there is no verdict: unknown is not healthy.

use super::explain::{Finding, explain};
use crate::interval::Interval;
use crate::knowledge::{IdVec, KnowledgeBase, Lineage, SignalId, SignalSet};
use crate::monitor::{Monitor, Pair, Relationship};
use crate::time::{Span, Time};
use alloc::vec::Vec;

/// What is thought of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// No independent witness speaks about it.
    Unknown,
    /// An independent witness agrees with it.
    Healthy,
    /// It may be faulty, or others are.
    Suspect,
    /// It is faulty.
    Failed,
}

/// A change of verdict.
#[derive(Clone, Debug, PartialEq)]
pub enum Decision {
    /// The signal is faulty: it belongs to every smallest explanation.
    Failed(SignalId),
    /// These signals explain the conflicts equally well; the set is the whole choice.
    Suspected(SignalId, SignalSet),
    /// The signal is trusted again.
    Cleared(SignalId),
    /// A signal whose own readings had shown a fault is trusted again, after this probation.
    Recovered(SignalId, Span),
}

/// Settings of the judge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JudgeOptions {
    /// How long all evidence must speak for a signal before it is trusted again.
    pub probation: Span,
    /// Prior fault probability of a signal whose properties give no `prior`.
    pub prior: f64,
}

impl Default for JudgeOptions {
    fn default() -> JudgeOptions {
        JudgeOptions { probation: Span::from_millis(5_000), prior: 0.01 }
    }
}

/// A signal that is accused again within this many of its probations has relapsed.
const RELAPSE_PROBATIONS: i64 = 4;
/// Probation doubles at most so often: with 5 s, to 5 minutes.
const MOST_RELAPSES: u32 = 6;

#[derive(Clone, Copy, Debug, Default)]
struct Standing {
    /// Suspect or failed.
    verdict: Option<Verdict>,
    /// Whether it was the only one accused: it explains disagreements as a failed signal does.
    alone: bool,
    /// Since when all evidence speaks for it.
    clean_since: Option<Time>,
    /// When it was last trusted again, and how often it was accused again soon after: each time doubles its probation.
    cleared: Option<Time>,
    relapses: u32,
    /// What it said when it was accused. While it still says the same, it is the plant that came back to it.
    said: Option<Interval>,
    /// Its own readings have shown the fault: no comparison is needed to accuse or to clear it.
    convicted: bool,
}

/// Decides on signals from the pairs of a monitor.
#[derive(Debug)]
pub struct Judge {
    options: JudgeOptions,
    priors: IdVec<SignalId, f64>,
    /// Each signal with all that it is derived from.
    origins: IdVec<SignalId, SignalSet>,
    standings: IdVec<SignalId, Standing>,
    /// Signals whose own readings have shown a fault since the last review.
    convicted: SignalSet,
    /// When to look again without a change of evidence.
    next_review: Option<Time>,
}

impl Judge {
    /// For the signals of a knowledge base.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase, options: JudgeOptions) -> Judge {
        let prior = |signal: SignalId| {
            knowledge.signals()[signal].properties.get("prior").copied().unwrap_or(options.prior)
        };
        let count = knowledge.signals().len();
        Judge {
            options,
            priors: IdVec::filled(count, prior),
            origins: IdVec::filled(count, |signal| knowledge.origins(signal)),
            standings: IdVec::filled(count, |_| Standing::default()),
            convicted: SignalSet::new(),
            next_review: None,
        }
    }

    /// Goes on with the verdicts before a change of the knowledge base. `compared` are the signals of all comparisons that
    /// go on: a verdict that no such comparison could ever clear is dropped, and so is that on a signal which means
    /// something else now. Gives the signals whose verdicts were dropped, and whether each is described anew.
    pub fn inherit(&mut self, old: &Judge, lineage: &Lineage, compared: &SignalSet) -> Vec<(SignalId, bool)> {
        self.next_review = old.next_review;
        let mut dropped = Vec::new();
        for (id, standing) in old.standings.enumerate() {
            let Some(namesake) = lineage.namesake(id) else { continue };
            match lineage.signal(id) {
                Some(signal)
                    if standing.verdict.is_none() || standing.convicted || compared.contains(signal) =>
                {
                    self.standings[signal] = *standing;
                    if standing.convicted {
                        // What contradicted it may be gone.
                        self.next_review = Some(Time::MIN);
                    }
                }
                same if standing.verdict.is_some() => dropped.push((namesake, same.is_none())),
                _ => {}
            }
        }
        dropped
    }

    /// When [`Judge::review`] must be called although no relationship has changed.
    #[must_use]
    pub fn next_review(&self) -> Option<Time> {
        self.next_review
    }

    /// Whether neither a signal nor anything that it is derived from is suspect or failed.
    #[must_use]
    pub fn trusts(&self, signal: SignalId) -> bool {
        self.origins[signal].iter().all(|origin| self.standings[origin].verdict.is_none())
    }

    /// Whether a signal has failed by its verdict.
    #[must_use]
    pub fn has_failed(&self, signal: SignalId) -> bool {
        self.standings[signal].verdict == Some(Verdict::Failed)
    }

    /// Since when all evidence has spoken for a signal that is suspect or failed.
    #[must_use]
    pub fn clean_since(&self, signal: SignalId) -> Option<Time> {
        self.standings[signal].clean_since
    }

    /// What is thought of a signal now.
    #[must_use]
    pub fn verdict(&self, signal: SignalId, monitor: &Monitor, now: Time) -> Verdict {
        let witnessed = || {
            monitor.pairs().iter().any(|pair| {
                pair.relationship(now) == Relationship::Agree && self.bears_witness(monitor, pair, signal)
            })
        };
        match self.standings[signal].verdict {
            Some(verdict) => verdict,
            None if witnessed() => Verdict::Healthy,
            None => Verdict::Unknown,
        }
    }

    /// Whether one way of a pair rests on the signal, the other on nothing that the signal comes from, and no failed
    /// signal is in it.
    fn bears_witness(&self, monitor: &Monitor, pair: &Pair, signal: SignalId) -> bool {
        let rests = |index| monitor.way(index).map(|way| &way.rests_on);
        let (Some(one), Some(other)) = (rests(pair.way), rests(pair.other)) else { return false };
        let origins = &self.origins[signal];
        let speaks = (one.contains(signal) && !other.meets(origins))
            || (other.contains(signal) && !one.meets(origins));
        speaks && !self.is_explained(pair, Some(signal))
    }

    /// A signal's own readings show that it is faulty, so that what it is compared with is not to blame. It is trusted again
    /// after its readings and every comparison with it have spoken for it for the probation time. Whether that is news.
    pub fn convict(&mut self, signal: SignalId, now: Time) -> bool {
        if self.standings[signal].verdict == Some(Verdict::Failed) {
            self.standings[signal].clean_since = None;
            return false;
        }
        let relapses = self.relapses(signal, now);
        let Standing { cleared, .. } = self.standings[signal];
        let verdict = Some(Verdict::Failed);
        let convicted =
            Standing { verdict, alone: true, relapses, cleared, convicted: true, ..Standing::default() };
        self.standings[signal] = convicted;
        self.convicted.insert(signal);
        true
    }

    /// Takes all evidence in. Complexity: O(pairs) while nothing is in conflict and nobody is accused.
    pub fn review(&mut self, monitor: &Monitor, now: Time) -> Vec<Decision> {
        let mut decisions = Vec::new();
        self.next_review = None;
        self.accuse(monitor, now, &mut decisions);
        self.clear(monitor, now, &mut decisions);
        decisions
    }

    fn accuse(&mut self, monitor: &Monitor, now: Time, decisions: &mut Vec<Decision>) {
        let conflicts: Vec<&Pair> = self.open_pairs(monitor, now, Relationship::Conflict).collect();
        if conflicts.is_empty() {
            return;
        }
        let mut sets: Vec<SignalSet> = conflicts.iter().map(|pair| pair.signals.clone()).collect();
        let candidates = self.explanations(monitor, &sets, now);
        sets.extend(self.open_pairs(monitor, now, Relationship::Undecided).map(|pair| pair.signals.clone()));
        let rivals = self.explanations(monitor, &sets, now);
        let accused = union(&candidates);
        let certain = |signal: &SignalId| candidates.iter().chain(&rivals).all(|set| set.contains(*signal));
        let (failed, rest): (SignalSet, SignalSet) = (accused.iter().filter(certain).collect(), accused);
        failed.iter().for_each(|signal| self.set((monitor, now), signal, Verdict::Failed, None, decisions));
        let open =
            |signal: &SignalId| !failed.contains(*signal) && self.disagrees_otherwise(*signal, &conflicts);
        let rest: SignalSet = rest.iter().filter(open).collect();
        let about_rest = conflicts.iter().filter(|pair| pair.signals.meets(&rest));
        let Some(onset) = about_rest.map(|pair| pair.onset(now)).min() else { return };
        if !self.is_settled(monitor, &rest, onset, now) {
            return;
        }
        // What is still undecided after the wait names nobody, but it speaks for those who do not disagree at all.
        let likely = |set: &&SignalSet| rivals.iter().any(|rival| rival.covers(set));
        let likely: SignalSet = candidates.iter().filter(likely).flat_map(SignalSet::iter).collect();
        let accused: SignalSet =
            rest.iter().filter(|signal| likely.is_empty() || likely.contains(*signal)).collect();
        for signal in accused.iter() {
            let choice = rivals_of(signal, &accused, &sets);
            self.set((monitor, now), signal, Verdict::Suspect, Some(choice), decisions);
        }
    }

    /// The smallest explanations of conflicts.
    fn explanations(&self, monitor: &Monitor, conflicts: &[SignalSet], now: Time) -> Vec<SignalSet> {
        let agrees = |pair: &&Pair| pair.relationship(now) == Relationship::Agree;
        let support = |signal| {
            monitor.pairs().iter().filter(agrees).filter(|pair| pair.signals.contains(signal)).count()
        };
        match explain(conflicts, |signal| self.priors[signal], support) {
            Finding::Consistent => Vec::new(),
            Finding::Clear(candidate) => Vec::from([candidate.signals]),
            Finding::Ambiguous(all) => all.into_iter().map(|candidate| candidate.signals).collect(),
        }
    }

    /// Whether all comparisons that speak about the accused have had the time to show a conflict that began at
    /// `onset`, or the wait for them is over.
    fn is_settled(&mut self, monitor: &Monitor, accused: &SignalSet, onset: Time, now: Time) -> bool {
        let open = |pair: &&Pair| {
            pair.signals.meets(accused)
                && !self.is_explained(pair, None)
                && match pair.relationship(now) {
                    Relationship::Undecided => true,
                    Relationship::Agree => pair.is_building() || !pair.window.confirmed_since(onset),
                    Relationship::Conflict | Relationship::Unknown => false,
                }
        };
        let Some(latency) = monitor.pairs().iter().filter(open).map(|pair| pair.latency()).max() else {
            return true;
        };
        let deadline = onset + latency.times(2);
        if now >= deadline {
            return true;
        }
        self.look_again(deadline);
        false
    }

    fn set(
        &mut self,
        (monitor, now): (&Monitor, Time),
        signal: SignalId,
        verdict: Verdict,
        choice: Option<SignalSet>,
        decisions: &mut Vec<Decision>,
    ) {
        if self.standings[signal].verdict >= Some(verdict) {
            return;
        }
        let said = said(monitor, signal);
        let alone = choice.as_ref().is_none_or(|choice| choice.len() == 1);
        let before = self.standings[signal];
        let relapses = self.relapses(signal, now);
        self.standings[signal] = Standing {
            verdict: Some(verdict),
            alone,
            clean_since: None,
            said,
            relapses,
            cleared: before.cleared,
            convicted: false,
        };
        decisions.push(match choice {
            None => Decision::Failed(signal),
            Some(choice) => Decision::Suspected(signal, choice),
        });
    }

    /// How often in a row a signal has been accused soon after it was trusted again, when it is accused now.
    fn relapses(&self, signal: SignalId, now: Time) -> u32 {
        let before = self.standings[signal];
        let soon = |cleared: Time| now - cleared <= self.probation(before.relapses).times(RELAPSE_PROBATIONS);
        match (before.verdict, before.cleared) {
            (Some(_), _) => before.relapses,
            (None, Some(cleared)) if soon(cleared) => (before.relapses + 1).min(MOST_RELAPSES),
            _ => 0,
        }
    }

    fn clear(&mut self, monitor: &Monitor, now: Time, decisions: &mut Vec<Decision>) {
        let culprit = |decision: &Decision| match decision {
            Decision::Failed(signal) => Some(*signal),
            Decision::Suspected(..) | Decision::Cleared(_) | Decision::Recovered(..) => None,
        };
        let mut culprits = core::mem::take(&mut self.convicted);
        culprits.extend(&decisions.iter().filter_map(culprit).collect());
        for signal in self.standings.ids() {
            let Some(verdict) = self.standings[signal].verdict else { continue };
            if !self.is_clean(monitor, signal, now) {
                self.standings[signal].clean_since = None;
                if self.standings[signal].convicted {
                    self.await_staleness(monitor, signal, now);
                }
                continue;
            }
            let since = *self.standings[signal].clean_since.get_or_insert(now);
            // Only a culprit that it was compared with explains why it was suspected.
            let compared = |pair: &Pair| pair.signals.contains(signal) && pair.signals.meets(&culprits);
            let explained = verdict == Verdict::Suspect && monitor.pairs().iter().any(compared);
            let Standing { relapses, convicted, .. } = self.standings[signal];
            let probation = self.probation(relapses);
            let over = since + probation;
            if explained || now >= over {
                self.standings[signal] = Standing { cleared: Some(now), relapses, ..Standing::default() };
                decisions.push(match convicted {
                    true => Decision::Recovered(signal, probation),
                    false => Decision::Cleared(signal),
                });
            } else {
                self.look_again(over);
            }
        }
    }

    fn probation(&self, relapses: u32) -> Span {
        self.options.probation.times(1 << relapses.min(MOST_RELAPSES))
    }

    /// Whether the signal has moved since it was accused, every comparison that speaks about it agrees, there is one (unless
    /// its own readings have accused it), and its readings are sound.
    fn is_clean(&self, monitor: &Monitor, signal: SignalId, now: Time) -> bool {
        let before = self.standings[signal].said;
        if before.is_some() && before == said(monitor, signal) {
            return false;
        }
        let mut witnessed = self.standings[signal].convicted;
        for pair in monitor.pairs() {
            if !pair.signals.contains(signal) || self.is_explained(pair, Some(signal)) {
                continue;
            }
            match pair.relationship(now) {
                Relationship::Unknown => {}
                Relationship::Agree => witnessed |= self.bears_witness(monitor, pair, signal),
                Relationship::Undecided | Relationship::Conflict => return false,
            }
        }
        witnessed && monitor.watch().absence(signal).is_none() && monitor.detectors().fault(signal).is_none()
    }

    /// Looks again when the first comparison with a signal that needs no witness is stale.
    fn await_staleness(&mut self, monitor: &Monitor, signal: SignalId, now: Time) {
        let pairs = monitor.pairs().iter().filter(|pair| pair.signals.contains(signal));
        let stale = pairs.filter_map(|pair| pair.window.stale_at()).filter(|at| *at > now).min();
        stale.into_iter().for_each(|at| self.look_again(at));
    }

    fn look_again(&mut self, at: Time) {
        self.next_review = Some(self.next_review.map_or(at, |earlier| earlier.min(at)));
    }

    /// Pairs in a relationship that no failed signal explains.
    fn open_pairs<'s, 'm: 's>(
        &'s self,
        monitor: &'m Monitor,
        now: Time,
        relationship: Relationship,
    ) -> impl Iterator<Item = &'m Pair> + 's {
        monitor
            .pairs()
            .iter()
            .filter(move |pair| pair.relationship(now) == relationship && !self.is_explained(pair, None))
    }

    /// Whether a failed signal other than `except` is in the pair.
    fn is_explained(&self, pair: &Pair, except: Option<SignalId>) -> bool {
        let has_failed = |signal| self.standings[signal].verdict == Some(Verdict::Failed);
        pair.signals.iter().any(|signal| Some(signal) != except && has_failed(signal))
    }

    /// Whether a signal disagrees with something else than signals that were accused alone.
    fn disagrees_otherwise(&self, signal: SignalId, conflicts: &[&Pair]) -> bool {
        let claimed =
            |pair: &Pair| pair.signals.iter().any(|other| other != signal && self.standings[other].alone);
        conflicts.iter().any(|pair| pair.signals.contains(signal) && !claimed(pair))
    }
}

/// What a signal says now, when it is a number.
fn said(monitor: &Monitor, signal: SignalId) -> Option<Interval> {
    monitor.ports()[signal].newest().map(|sample| sample.value)
}

/// The accused that conflicts connect with a signal: one of them is to blame.
fn rivals_of(signal: SignalId, accused: &SignalSet, conflicts: &[SignalSet]) -> SignalSet {
    let mut connected = SignalSet::from_iter([signal]);
    for _ in conflicts {
        let before = connected.len();
        for conflict in conflicts.iter().filter(|conflict| conflict.meets(accused)) {
            if conflict.meets(&connected) {
                connected.extend(conflict);
            }
        }
        if connected.len() == before {
            break;
        }
    }
    connected.iter().filter(|signal| accused.contains(*signal)).collect()
}

fn union(sets: &[SignalSet]) -> SignalSet {
    let mut all = SignalSet::new();
    sets.iter().for_each(|set| all.extend(set));
    all
}
