//! How what is accused is trusted again: by evidence, never by its absence.
//!
//! * What comparisons have accused is trusted again when the comparisons that have spoken against it agree, one of them at
//!   least, and no other disagrees, for the probation time. Where something else has been found to be faulty that is in all of
//!   them, nothing speaks against it any more: it is trusted at once.
//! * What its own readings have convicted needs a witness that has agreed since, or must have come back to where it could have
//!   got to from its last reading that was sound. Once comparisons have contradicted it, only they can clear it. Who looks at
//!   its changes alone is no witness that it is back.
//! * Where nothing speaks against it any more and nothing for it, it is unproven: nobody knows. It may serve where nothing else
//!   is left, and what it gives is uncertain. What has failed by comparisons does not: it is contradicted, though nobody
//!   repeats it.
//!
//! A signal that usually moves stays suspect while it repeats the value with which it was accused: a value that stands still is
//! right now and then.

use super::evidence::{rests_on, rests_on_any};
use super::{Component, ComponentState, Decision, Ground, Proof, Record, Review, Testimony, Verdict};
use crate::knowledge::SignalId;
use crate::monitor::{Residual, ResidualState};
use alloc::collections::BTreeSet;
use core::ops::Bound;

/// How many comparisons that have spoken against one thing are remembered.
pub(super) const MOST_GROUNDS: usize = 64;

/// What the evidence says about something that is accused.
enum Weighed {
    /// A comparison speaks against it, or may yet, or its readings do.
    Against(Option<Ground>),
    /// Nothing speaks against it, and nothing for it. Whether all that has spoken against it agrees again, but looks at its changes
    /// alone.
    Silent { is_appeased: bool },
    /// What has spoken against it agrees again.
    For(Proof),
    /// What else has failed explains all that has spoken against it.
    Groundless,
}

/// What the comparisons that have spoken against something say now.
#[derive(Default)]
struct Grounds {
    agree: usize,
    /// Those that agree, but would agree beside a lasting offset as well.
    appeased: usize,
    silent: usize,
    explained: usize,
    /// Whether another one bears witness.
    witnessed: bool,
}

impl<T: Testimony> Review<'_, T> {
    /// Looks whether anything that is accused is trusted again.
    pub(super) fn clear(&mut self) {
        let culprit = |decision: &Decision| match decision {
            Decision::Failed(blame) => Some(blame.component),
            _ => None,
        };
        let mut culprits = core::mem::take(&mut self.judge.failed_by_detector);
        culprits.extend(self.decisions.iter().filter_map(culprit));
        let mut next = self.judge.standings.keys().next().copied();
        while let Some(component) = next {
            let after = (Bound::Excluded(component), Bound::Unbounded);
            next = self.judge.standings.range(after).next().map(|(component, _)| *component);
            if self.judge.accusation(component).is_none() {
                continue;
            }
            let decision = match self.weigh(component) {
                Weighed::Against(ground) => self.hear_against(component, ground),
                Weighed::Silent { is_appeased } => self.hear_nothing(component, is_appeased),
                Weighed::For(proof) => self.hear_for(component, proof, &culprits),
                Weighed::Groundless => Some(self.acquit(component)),
            };
            self.decisions.extend(decision);
        }
    }

    fn hear_against(&mut self, component: Component, ground: Option<Ground>) -> Option<Decision> {
        self.await_staleness(component);
        let state_of = self.judge.standings.get_mut(&component)?;
        (state_of.clean_since, state_of.quiet_since) = (None, None);
        let ground = ground?;
        // While it is where it could not be, that is no news.
        state_of.record.contradicted |=
            state_of.record.failed_by_detector && is_home(self.evidence, component);
        let was_unproven = core::mem::take(&mut state_of.record.unproven);
        let grounds = self.judge.grounds.entry(component).or_default();
        if grounds.len() < MOST_GROUNDS {
            grounds.insert(ground);
        }
        was_unproven.then_some(Decision::Contradicted(component))
    }

    fn hear_nothing(&mut self, component: Component, is_appeased: bool) -> Option<Decision> {
        let grounds = self.judge.grounds.get(&component);
        let is_contradicted = !is_appeased && grounds.is_some_and(|grounds| !grounds.is_empty());
        let state_of = self.judge.standings.get_mut(&component)?;
        state_of.clean_since = None;
        let since = *state_of.quiet_since.get_or_insert(self.now);
        let may_serve = match state_of.record.verdict {
            Some(Verdict::Failed) => state_of.record.failed_by_detector && !is_contradicted,
            _ => true,
        };
        if state_of.record.unproven || !may_serve {
            return None;
        }
        let probation = self.judge.probation(self.judge.state_of(component).record.relapses);
        if self.now < since + probation {
            self.judge.look_again(since + probation);
            return None;
        }
        self.judge.standings.get_mut(&component)?.record.unproven = true;
        Some(Decision::Unproven(component, probation))
    }

    fn hear_for(
        &mut self,
        component: Component,
        proof: Proof,
        culprits: &BTreeSet<Component>,
    ) -> Option<Decision> {
        let evidence = self.evidence;
        let before = self.judge.state_of(component);
        let since = before.clean_since.unwrap_or(self.now);
        // Only a culprit that it was compared with explains why it was suspected.
        let compared =
            |pair: &Residual| rests_on(evidence, pair, component) && rests_on_any(evidence, pair, culprits);
        let explained =
            before.record.verdict == Some(Verdict::Suspect) && evidence.pairs().iter().any(compared);
        let probation = self.judge.probation(before.record.relapses);
        if !explained && self.now < since + probation {
            if let Some(state_of) = self.judge.standings.get_mut(&component) {
                state_of.clean_since = Some(since);
                state_of.quiet_since.get_or_insert(since);
            }
            self.judge.look_again(since + probation);
            return None;
        }
        Some(match (component, self.acquit(component)) {
            (Component::Signal(signal), _) if before.record.failed_by_detector => {
                Decision::Recovered(signal, probation, proof)
            }
            (_, cleared) => cleared,
        })
    }

    /// It is trusted again.
    fn acquit(&mut self, component: Component) -> Decision {
        let relapses = self.judge.state_of(component).record.relapses;
        let record = Record { cleared: Some(self.now), relapses, ..Record::default() };
        self.judge.put(component, ComponentState { record, ..ComponentState::default() });
        Decision::Cleared(component)
    }

    /// What speaks about something that is accused. O(its comparisons).
    fn weigh(&self, component: Component) -> Weighed {
        let Review { evidence, now, .. } = *self;
        if !is_sound(evidence, component) {
            return Weighed::Against(None);
        }
        let grounds = match self.count(component) {
            Ok(grounds) => grounds,
            Err(against) => return Weighed::Against(against),
        };
        let state_of = self.judge.state_of(component);
        if !state_of.record.failed_by_detector && self.is_groundless(component, &grounds) {
            return Weighed::Groundless;
        }
        if self.judge.stands_still(component, evidence, now) {
            return Weighed::Against(None);
        }
        let is_met = grounds.agree > 0 || (grounds.witnessed && grounds.silent == 0);
        let has_returned = || {
            state_of.record.failed_by_detector
                && !state_of.record.contradicted
                && is_home(self.evidence, component)
        };
        match () {
            () if is_met => Weighed::For(Proof::Witness),
            () if has_returned() => Weighed::For(Proof::Return),
            () => Weighed::Silent { is_appeased: grounds.appeased > 0 && grounds.silent == 0 },
        }
    }

    /// What the comparisons say that are about something; a comparison that disagrees, or may, is the error.
    fn count(&self, component: Component) -> Result<Grounds, Option<Ground>> {
        let Review { evidence, now, .. } = *self;
        let known = self.judge.grounds.get(&component);
        // What a witness has said of the time before says nothing about the fault.
        let accused = self.judge.state_of(component).accused;
        let has_seen = |pair: &Residual| accused.is_none_or(|accused| pair.window.confirmed_since(accused));
        // What has jumped is off for as long as it stays there, though its changes are right.
        let is_home = is_home(evidence, component);
        let tells = |pair: &Residual| is_home || shows_size(evidence, pair, component);
        let mut found = Grounds::default();
        let mut undecided = false;
        for pair in pairs_of(evidence, component) {
            let ground = (pair.way, pair.other);
            let is_ground = known.is_some_and(|known| known.contains(&ground));
            if !is_ground && !is_about(evidence, pair, component) {
                continue;
            }
            if self.judge.is_explained(evidence, pair, Some(component)) {
                found.explained += usize::from(is_ground);
                continue;
            }
            match pair.relationship(now) {
                ResidualState::Unknown => found.silent += usize::from(is_ground),
                ResidualState::Agree if is_ground && tells(pair) => found.agree += 1,
                ResidualState::Agree if is_ground => found.appeased += 1,
                ResidualState::Agree => {
                    found.witnessed |=
                        has_seen(pair) && tells(pair) && self.judge.bears_witness(evidence, pair, component);
                }
                ResidualState::Undecided => undecided = true,
                ResidualState::Conflict => return Err(Some(ground)),
            }
        }
        if undecided { Err(None) } else { Ok(found) }
    }

    /// Whether nothing speaks against a component any more: other components that have failed explain all conflicts with it; or
    /// it was blamed for a common cause, and nothing else that shares the cause is accused any more.
    fn is_groundless(&self, component: Component, grounds: &Grounds) -> bool {
        let known = self.judge.grounds.get(&component).map_or(0, BTreeSet::len);
        match (known, self.judge.state_of(component).cause) {
            (0, Some(cause)) => {
                let others = self.judge.priors.sharing(cause).iter().map(|signal| Component::Signal(*signal));
                let stands = |other: Component| {
                    self.judge.accuses(other)
                        && (self.judge.state_of(other).record.failed_by_detector
                            || self.judge.grounds.contains_key(&other))
                };
                !others.filter(|other| *other != component).any(stands)
            }
            (0, None) => false,
            _ => grounds.explained > 0 && grounds.agree + grounds.silent == 0,
        }
    }

    /// Looks again when the first comparison with something that is accused is stale.
    fn await_staleness(&mut self, component: Component) {
        let Review { evidence, now, .. } = *self;
        let stale = pairs_of(evidence, component).filter_map(|pair| pair.window.stale_at());
        let stale = stale.filter(|at| *at > now).min();
        stale.into_iter().for_each(|at| self.judge.look_again(at));
    }
}

/// The pairs that may be about something.
fn pairs_of(evidence: &impl Testimony, component: Component) -> impl Iterator<Item = &Residual> {
    let signal = match component {
        Component::Signal(signal) => Some(signal),
        Component::Relation(_) | Component::Cause(_) => None,
    };
    let all = signal.is_none().then(|| evidence.pairs()).into_iter().flatten();
    let all = all.filter(move |pair| rests_on(evidence, pair, component));
    signal.into_iter().flat_map(|signal| evidence.pairs_of(signal)).chain(all)
}

/// Whether a pair would show a lasting offset of a signal: how its value changes does not.
fn shows_size(evidence: &impl Testimony, pair: &Residual, component: Component) -> bool {
    let Component::Signal(signal) = component else { return true };
    let shows =
        |index| evidence.way(index).is_some_and(|way| way.is_sized_by(signal) && !way.computation.is_rate());
    shows(pair.way) || shows(pair.other)
}

/// Whether what a pair says depends on the size of a signal, or on a relation.
fn is_about(evidence: &impl Testimony, pair: &Residual, component: Component) -> bool {
    let Component::Signal(signal) = component else { return rests_on(evidence, pair, component) };
    let is_sized = |index| evidence.way(index).is_some_and(|way| way.is_sized_by(signal));
    is_sized(pair.way) || is_sized(pair.other)
}

/// Whether a signal says something, and nothing is wrong with its readings in themselves.
fn is_sound(evidence: &impl Testimony, component: Component) -> bool {
    let Component::Signal(signal) = component else { return true };
    evidence.is_sound(signal)
}

fn is_home(evidence: &impl Testimony, component: Component) -> bool {
    let home = |signal: SignalId| evidence.is_home(signal);
    !matches!(component, Component::Signal(signal) if !home(signal))
}
