//! A recording for calibration: stretches of healthy time that are handled separately.

use shsa_core::observation::Observation;
use shsa_core::time::{Span, Time};

/// The recording from one start to the next, without the skipped times.
///
/// Stretches are separate: no window spans their ends, and no gap is counted between two.
#[derive(Clone, Debug, Default)]
pub struct Session {
    stretches: Vec<Vec<Observation>>,
}

impl Session {
    /// A session of observations in the order of reception, without those received in a skipped time, which excludes its end.
    #[must_use]
    pub fn new(observations: Vec<Observation>, left_out: &[(Time, Time)]) -> Session {
        let place = |at: Time| {
            let is_inside = left_out.iter().any(|(from, to)| *from <= at && at < *to);
            (!is_inside).then(|| left_out.iter().filter(|(_, to)| *to <= at).count())
        };
        let mut stretches: Vec<Vec<Observation>> = Vec::new();
        let mut last = None;
        for observation in observations {
            let Some(now) = place(observation.received) else { continue };
            if last != Some(now) {
                stretches.push(Vec::new());
                last = Some(now);
            }
            stretches.last_mut().into_iter().for_each(|it| it.push(observation.clone()));
        }
        Session { stretches }
    }

    /// Splits the session at a time of reception.
    #[must_use]
    pub fn split(&self, at: Time) -> (Session, Session) {
        let (mut before, mut after) = (Session::default(), Session::default());
        for stretch in &self.stretches {
            let (early, late) = stretch.split_at(stretch.partition_point(|it| it.received < at));
            before.stretches.extend((!early.is_empty()).then(|| early.to_vec()));
            after.stretches.extend((!late.is_empty()).then(|| late.to_vec()));
        }
        (before, after)
    }

    /// The session without further skipped times.
    #[must_use]
    pub(crate) fn without(&self, left_out: &[(Time, Time)]) -> Session {
        let parts = self.stretches.iter().map(|it| Session::new(it.clone(), left_out).stretches);
        Session { stretches: parts.flatten().collect() }
    }

    /// The stretches, none of them empty.
    #[must_use]
    pub fn stretches(&self) -> &[Vec<Observation>] {
        &self.stretches
    }

    /// Its observations.
    pub fn observations(&self) -> impl Iterator<Item = &Observation> {
        self.stretches.iter().flatten()
    }

    /// The total duration of the stretches.
    #[must_use]
    pub fn duration(&self) -> Span {
        let lasts = |stretch: &Vec<Observation>| {
            stretch.first().zip(stretch.last()).map_or(0, |(first, last)| (last.received - first.received).0)
        };
        Span(self.stretches.iter().map(lasts).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_core::knowledge::{Id, SignalId};
    use shsa_core::observation::RawValue;

    fn session(left_out: &[(i64, i64)]) -> Session {
        let observation = |at: i64| Observation {
            signal: SignalId::from_index(0),
            stamp: Time(at),
            received: Time(at),
            value: RawValue::Number(0.0),
        };
        let left_out: Vec<(Time, Time)> =
            left_out.iter().map(|(from, to)| (Time(*from), Time(*to))).collect();
        Session::new((0..10).map(observation).collect(), &left_out)
    }

    #[track_caller]
    fn check(session: &Session, expected: &[&[i64]]) {
        let times = |stretch: &Vec<Observation>| stretch.iter().map(|it| it.received.0).collect::<Vec<_>>();
        assert_eq!(session.stretches().iter().map(times).collect::<Vec<_>>(), expected);
    }

    #[test]
    fn what_is_left_out_parts_a_session_and_is_no_part_of_its_time() {
        check(&session(&[]), &[&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9]]);
        check(&session(&[(3, 5)]), &[&[0, 1, 2], &[5, 6, 7, 8, 9]]);
        check(&session(&[(3, 5), (4, 9)]), &[&[0, 1, 2], &[9]]);
        check(&session(&[(0, 2), (8, 99)]), &[&[2, 3, 4, 5, 6, 7]]);
        assert_eq!(session(&[(3, 5)]).duration(), Span(2 + 4));
        let (before, after) = session(&[(3, 5)]).split(Time(7));
        check(&before, &[&[0, 1, 2], &[5, 6]]);
        check(&after, &[&[7, 8, 9]]);
    }
}
