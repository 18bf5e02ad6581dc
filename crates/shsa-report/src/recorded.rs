//! The sessions of a recording as inputs of replays: with injected faults, under one model after the other.
//!
//! `stages -> wanted -> (the recording is read) -> injections -> broken -> (parts of it are left out) -> sources`

use crate::Source;
use shsa_core::engine::Input;
use shsa_core::knowledge::{KnowledgeBase, Scaling, SignalId};
use shsa_core::observation::Observation;
use shsa_core::time::{Span, Time};
use shsa_format::drive::Era;
use shsa_format::fault::Fault;
use shsa_recording::{Recording, Sample, Session, Wanted};
use std::collections::BTreeMap;

/// A knowledge base, and the time from which it is used.
#[derive(Clone, Debug)]
pub struct Stage {
    /// The time from the beginning of the recording.
    pub at: Span,
    /// The knowledge base.
    pub knowledge: KnowledgeBase,
    /// The name and the text of the file with the change; `None` for the first model.
    pub change: Option<(String, String)>,
}

impl Stage {
    /// The first model.
    #[must_use]
    pub fn first(knowledge: KnowledgeBase) -> Stage {
        Stage { at: Span::ZERO, knowledge, change: None }
    }
}

/// The fields to look for in recordings: every signal of the model except computed ones, which come last.
#[must_use]
pub fn wanted(knowledge: &KnowledgeBase) -> Vec<Wanted> {
    let measured = knowledge.signals().enumerate().filter(|(id, _)| !knowledge.is_computed(*id));
    measured.map(|(_, signal)| Wanted::new(signal.name.clone(), signal.source.clone())).collect()
}

/// The fields that any of the models wants, each once.
#[must_use]
pub fn wanted_by(stages: &[Stage]) -> Vec<Wanted> {
    let mut all: Vec<Wanted> = Vec::new();
    for one in stages.iter().flat_map(|stage| wanted(&stage.knowledge)) {
        if !all.contains(&one) {
            all.push(one);
        }
    }
    all
}

/// A fault with what it strikes.
#[derive(Clone, Debug)]
pub struct Injection<'a> {
    /// The fault.
    pub fault: &'a Fault,
    /// The numbers of the wanted fields of its signal, from every source that the models name.
    targets: Vec<usize>,
    /// The scaling by the first model with the signal.
    scaling: Option<Scaling>,
}

impl<'a> Injection<'a> {
    /// A fault of wanted fields.
    #[must_use]
    pub fn new(fault: &'a Fault, stages: &[Stage], wanted: &[Wanted]) -> Injection<'a> {
        let of_name = wanted.iter().enumerate().filter(|(_, wanted)| wanted.signal == fault.signal);
        let targets: Vec<usize> = of_name.map(|(at, _)| at).collect();
        let mut signals = stages.iter().flat_map(|stage| stage.knowledge.signals().iter());
        let scaling = signals.find(|signal| signal.name == fault.signal).and_then(|signal| signal.scaling);
        Injection { fault, targets, scaling }
    }

    /// Whether any of the wanted fields is of its signal.
    #[must_use]
    pub fn has_target(&self) -> bool {
        !self.targets.is_empty()
    }

    /// Whether the fault can change an observation of what is left of the recording.
    #[must_use]
    pub fn strikes(&self, recording: &Recording) -> bool {
        let hits = |(session, samples): (&Session, &[Sample])| {
            samples.iter().any(|sample| self.hits(sample, session.origin))
        };
        recording.by_session().any(hits)
    }

    /// Whether the fault can change this sample of a recording that begins at `origin`.
    #[must_use]
    pub fn hits(&self, sample: &Sample, origin: Time) -> bool {
        let since = sample.received - origin;
        self.targets.contains(&sample.wanted)
            && since >= self.fault.from
            && self.fault.to.is_none_or(|to| since < to)
    }
}

/// The samples of one session with the faults, as [`broken`] makes them, while they are read; `origin` is the begin of the session.
#[must_use]
pub fn breaking<'a, E: 'a>(
    samples: impl Iterator<Item = Result<Sample, E>> + 'a,
    injections: &[Injection<'_>],
    origin: Time,
    seed: u64,
) -> Box<dyn Iterator<Item = Result<Sample, E>> + 'a> {
    let mut broken: Box<dyn Iterator<Item = Result<Sample, E>> + 'a> = Box::new(samples);
    for (number, Injection { fault, targets, scaling }) in (0..).zip(injections) {
        for &target in targets {
            let seed = seed.wrapping_add(number);
            broken = Box::new(fault.injected(broken, target, *scaling, origin, seed));
        }
    }
    broken
}

/// The samples of each session with the faults; `seed` is that of the first fault, each further one has the next. `None` without
/// faults. Before anything is left out of the recording, as a fault may take a value from before.
#[must_use]
pub fn broken(recording: &Recording, injections: &[Injection<'_>], seed: u64) -> Option<Vec<Vec<Sample>>> {
    let of_session = |(session, samples): (&Session, &[Sample])| {
        let mut samples = samples.to_vec();
        for (number, injection) in (0..).zip(injections) {
            for &target in &injection.targets {
                let seed = seed.wrapping_add(number);
                injection.fault.inject(&mut samples, target, injection.scaling, session.origin, seed);
            }
        }
        samples
    };
    (!injections.is_empty()).then(|| recording.by_session().map(of_session).collect())
}

/// A recording with all that its replay needs.
#[derive(Clone, Copy, Debug)]
pub struct Recorded<'a> {
    /// The models in the order of time.
    pub stages: &'a [Stage],
    /// What was looked for in the recording.
    pub wanted: &'a [Wanted],
    /// The recording.
    pub recording: &'a Recording,
    /// The samples with [faults](broken), by the sessions before anything was left out.
    pub broken: Option<&'a [Vec<Sample>]>,
    /// Whether something else than a part of the recording is lost.
    pub degraded: bool,
}

impl Recorded<'_> {
    /// The inputs of each session.
    #[must_use]
    pub fn sources(&self) -> Vec<Source> {
        let missing = self.recording.found.iter().zip(self.wanted);
        let missing: BTreeMap<String, usize> =
            missing.map(|(found, wanted)| (wanted.signal.clone(), found.missing)).collect();
        let source = |(session, clean): (&Session, &[Sample])| {
            let eras = |samples: &[Sample]| {
                eras(of_session(self.stages, session), samples, self.wanted, session.origin)
            };
            let is_kept = |sample: &&Sample| session.part.holds(session.origin, sample);
            let broken = self.broken.and_then(|broken| broken.get(session.recording));
            let broken = broken.map(|own| own.iter().filter(is_kept).cloned().collect::<Vec<_>>());
            Source {
                eras: eras(broken.as_deref().unwrap_or(clean)),
                clean: broken.is_some().then(|| eras(clean)),
                span: Some(session.span),
                origin: Some(session.origin),
                session: Some(session.clone()),
                missing: missing.clone(),
                degraded: self.recording.degraded || self.degraded,
            }
        };
        self.recording.by_session().map(source).collect()
    }
}

/// The stages of a session. The last stage before the beginning of its recording holds from the beginning.
fn of_session<'a>(stages: &'a [Stage], session: &Session) -> &'a [Stage] {
    let begins = session.span.0 - session.origin;
    let before = stages.iter().filter(|stage| stage.at < begins).count();
    stages.get(before.saturating_sub(1)..).unwrap_or_default()
}

/// The observations under each knowledge base, without those of signals that it lacks or reads from another source.
fn eras(stages: &[Stage], samples: &[Sample], wanted: &[Wanted], first: Time) -> Vec<Era> {
    let mut eras = Vec::new();
    let mut rest = samples;
    for (number, stage) in stages.iter().enumerate() {
        let until = stages
            .get(number + 1)
            .map_or(rest.len(), |next| rest.partition_point(|sample| sample.received < first + next.at));
        let (own, later) = rest.split_at(until);
        rest = later;
        let known = self::wanted(&stage.knowledge);
        let ids: BTreeMap<(&str, &str), SignalId> = known
            .iter()
            .zip(stage.knowledge.signals().ids())
            .map(|(known, id)| ((known.signal.as_str(), known.source.as_str()), id))
            .collect();
        let signals: Vec<Option<SignalId>> = wanted
            .iter()
            .map(|wanted| ids.get(&(wanted.signal.as_str(), wanted.source.as_str())).copied())
            .collect();
        let input = |sample: &Sample| {
            Some(Input::Observation(Observation {
                signal: signals.get(sample.wanted).copied().flatten()?,
                stamp: sample.time,
                received: sample.received,
                value: sample.value.clone(),
            }))
        };
        eras.push(Era {
            from: first + stage.at,
            knowledge: stage.knowledge.clone(),
            change: stage.change.clone().filter(|_| number > 0),
            inputs: own.iter().filter_map(input).collect(),
        });
    }
    eras
}
