//! Whether the stamps of a signal are usable: they are not where they stand still, or come from another clock.

use super::clock::LEAP;
use shsa_core::time::{Span, Time};

/// Up to this many equal stamps may be chance.
const FEW: usize = 3;

/// Statistics of the stamps of one signal in one file.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stamps {
    count: usize,
    /// The number of stamps further than [`LEAP`] from their reception.
    far: usize,
    first: Option<(Time, Time)>,
    last_received: Time,
    has_moved: bool,
    last: Option<Time>,
    /// The number of stamps before the stamp of the message before.
    pub(super) backward: usize,
}

impl Stamps {
    /// Adds a stamp with the reception of its message.
    pub(super) fn see(&mut self, stamp: Time, received: Time) {
        let (first, _) = *self.first.get_or_insert((stamp, received));
        self.count += 1;
        self.far += usize::from((stamp - received).abs() > LEAP);
        self.has_moved |= stamp != first;
        self.backward += usize::from(self.last.is_some_and(|last| stamp < last));
        self.last = Some(stamp);
        self.last_received = received;
    }

    /// Adds stamps that are the times of reception.
    pub(super) fn see_received(&mut self, times: &[Time]) {
        let Some((first, last)) = times.first().zip(times.last()) else { return };
        let (begin, _) = *self.first.get_or_insert((*first, *first));
        self.count += times.len();
        self.has_moved = self.has_moved || times.iter().any(|time| *time != begin);
        let pairs = times.iter().zip(times.iter().skip(1));
        self.backward += usize::from(self.last.is_some_and(|last| *first < last));
        self.backward += pairs.filter(|(before, after)| after < before).count();
        self.last = Some(*last);
        self.last_received = *last;
    }

    /// Why the reception has to replace the stamps; `None` where the stamps are usable.
    pub(super) fn flaw(&self) -> Option<String> {
        let (stamp, received) = self.first?;
        if 2 * self.far > self.count {
            let off = (stamp - received).abs();
            let which = if stamp < received { "before" } else { "after" };
            return Some(format!(
                "its stamps are of another clock: the first is {} {which} its reception",
                in_words(off)
            ));
        }
        let is_still = !self.has_moved && self.count > FEW && self.last_received > received;
        is_still.then(|| format!("its {} stamps are all the same", self.count))
    }
}

/// A length of time in a suitable unit.
fn in_words(span: Span) -> String {
    match span.seconds() {
        seconds if seconds < 172_800.0 => format!("{:.1} h", seconds / 3_600.0),
        seconds => format!("{:.0} days", seconds / 86_400.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(seconds: &[(i64, i64)], expected: Option<&str>) {
        let mut stamps = Stamps::default();
        let at = |second: i64| Time(second * 1_000_000_000);
        seconds.iter().for_each(|(stamp, received)| stamps.see(at(*stamp), at(*received)));
        assert_eq!(stamps.flaw().as_deref(), expected);
    }

    #[test]
    fn stamps_of_reception_are_added_together_as_one_by_one() {
        let (mut together, mut singly) = (Stamps::default(), Stamps::default());
        for seconds in [&[5_i64, 5][..], &[], &[5], &[7, 6, 6, 9], &[8]] {
            let times: Vec<Time> = seconds.iter().map(|second| Time(*second)).collect();
            together.see_received(&times);
            times.iter().for_each(|time| singly.see(*time, *time));
            assert_eq!(format!("{together:?}"), format!("{singly:?}"));
        }
        assert_eq!(together.backward, 2);
    }

    #[test]
    fn stamps_are_believed_unless_most_of_them_are_wrong() {
        check(&[], None);
        check(&[(9, 10), (10, 11), (11, 12), (12, 13)], None);
        check(&[(9, 10), (10, 11), (9_999, 12)], None);
        check(&[(5, 10), (5, 10), (5, 10), (5, 10)], None);
        check(&[(5, 10), (5, 11), (5, 12)], None);
        check(&[(5, 10), (5, 11), (5, 12), (5, 13)], Some("its 4 stamps are all the same"));
        check(
            &[(30, 1_700_000_000), (31, 1_700_000_001)],
            Some("its stamps are of another clock: the first is 19676 days before its reception"),
        );
        check(
            &[(36_010, 10), (36_011, 11)],
            Some("its stamps are of another clock: the first is 10.0 h after its reception"),
        );
    }
}
