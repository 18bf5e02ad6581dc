//! Recordings of a healthy system, each divided into a part to fit and a part to test on.

use super::Session;
use crate::LabError;
use crate::campaign::Recorded;
use shsa_core::knowledge::{Id, SignalId};
use shsa_core::observation::Observation;
use shsa_core::time::{Span, Time};
use shsa_recording::{Recording, Sample};

/// The sessions of recordings, each divided into a fitted part and a test part.
#[derive(Default)]
pub struct Parted<'r> {
    /// The parts to fit, one for each session.
    pub fitted: Vec<Session>,
    /// The parts to test on, one for each session.
    pub unseen: Vec<Session>,
    /// The samples before each split.
    pub early: Vec<Recorded<'r>>,
    /// The beginning of each session.
    pub firsts: Vec<Time>,
    /// The total length of the fitted parts.
    pub split: Span,
    /// The total length of all.
    pub duration: Span,
    /// The times that are left out.
    pub left_out: Vec<(Time, Time)>,
}

impl<'r> Parted<'r> {
    /// Divides each session of a recording, whose samples are numbered as the signals of the model, at `split` from its first
    /// observation, or half-way where there is none; leaves out the times of `skip`, which count from there, too.
    ///
    /// # Errors
    /// When the split lies outside of a session, or there is no session.
    pub fn of(
        recording: &'r Recording,
        split: Option<Span>,
        skip: &[(Span, Span)],
    ) -> Result<Parted<'r>, LabError> {
        let mut parted = Parted::default();
        for (_, samples) in recording.by_session() {
            parted.take(samples, split, skip)?;
        }
        if parted.fitted.is_empty() {
            let why = "none of the model's signals is in the recording; `source` in the model says where each is found";
            return Err(LabError::Unfit(why.to_owned()));
        }
        Ok(parted)
    }

    fn take(
        &mut self,
        samples: &'r [Sample],
        split: Option<Span>,
        skip: &[(Span, Span)],
    ) -> Result<(), LabError> {
        let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return Ok(()) };
        let (first, duration) = (first.received, last.received - first.received);
        let split = split.unwrap_or(Span(duration.0 / 2));
        if !(Span::ZERO < split && split < duration) {
            return Err(LabError::Unfit(format!(
                "the split at {} s lies outside of the recording of {} s",
                split.seconds(),
                duration.seconds()
            )));
        }
        let left_out: Vec<(Time, Time)> =
            skip.iter().map(|(from, to)| (first + *from, first + *to)).collect();
        let (fitted, unseen) = Session::new(observations(samples), &left_out).split(first + split);
        let early = samples.partition_point(|it| it.received < first + split);
        let early = samples.get(..early).unwrap_or_default();
        self.early.push(Recorded { origin: first, samples: early });
        self.fitted.push(fitted);
        self.unseen.push(unseen);
        self.firsts.push(first);
        self.left_out.extend(left_out);
        (self.split, self.duration) = (Span(self.split.0 + split.0), Span(self.duration.0 + duration.0));
        Ok(())
    }
}

/// Samples, numbered as the signals of the model, as observations.
pub(crate) fn observations(samples: &[Sample]) -> Vec<Observation> {
    let observation = |sample: &Sample| Observation {
        signal: SignalId::from_index(sample.wanted),
        stamp: sample.time,
        received: sample.received,
        value: sample.value.clone(),
    };
    samples.iter().map(observation).collect()
}
