//! Whether the values of the instances that hold tokens for a need arrive on the bus.
//!
//! A token tells what an instance can do. A hung process still holds its token, the broker may refuse its values, and a stranger who
//! may write claims publishes nothing. So an instance hears what is published under the need's name. It takes a need over when it has
//! had a value for the need's age and heard nobody, and gives a need to another instance only when it hears that instance.

use shsa_core::time::{Span, Time};
use std::collections::BTreeMap;

/// Values that are on their way when the age is over arrive within this time.
const ON_THE_WAY: Span = Span::from_millis(100);

/// What is heard under the name of a need.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    max_age: Span,
    /// The last value, by the mark of the publisher; `None`: the middleware does not show who publishes.
    heard: BTreeMap<Option<u32>, Time>,
    /// The time of our first value since another instance was heard.
    waiting: Option<Time>,
    /// When the wait was found to be longer than the age.
    doubted: Option<Time>,
    /// Whether somebody was heard since the last look.
    is_news: bool,
}

impl Watch {
    pub(super) fn new(max_age: Span) -> Watch {
        let (heard, waiting, doubted) = (BTreeMap::new(), None, None);
        Watch { max_age, heard, waiting, doubted, is_news: false }
    }

    pub(super) fn is_of(&self, max_age: Span) -> bool {
        self.max_age == max_age
    }

    /// Takes in a value that another instance has published.
    pub(super) fn hear(&mut self, publisher: Option<u32>, now: Time) {
        (self.waiting, self.doubted, self.is_news) = (None, None, true);
        let last = self.heard.entry(publisher).or_insert(now);
        *last = now.max(*last);
    }

    /// This instance has a value that it leaves to the owner.
    pub(super) fn want(&mut self, now: Time) {
        self.waiting.get_or_insert(now);
    }

    /// Whether nobody has been heard for the need's age although there were values. The answer is late by the time that values
    /// need on their way, also after a suspension of this process. `is_able`: this instance can serve the need; else it waits for
    /// nothing.
    pub(super) fn is_unserved(&mut self, is_able: bool, now: Time) -> bool {
        self.waiting.take_if(|_| !is_able);
        let is_over = self.waiting.is_some_and(|since| now - since > self.max_age);
        if !is_over {
            self.doubted = None;
            return false;
        }
        now - *self.doubted.get_or_insert(now) >= ON_THE_WAY
    }

    /// When the answer of [`Watch::is_unserved`] may change without a value.
    pub(super) fn due(&self) -> Option<Time> {
        let over = self.waiting.map(|since| since + self.max_age + Span(1));
        self.doubted.map(|doubted| doubted + ON_THE_WAY).or(over)
    }

    /// Whether the owner has to be chosen anew: somebody is heard beside this instance, which serves the need (`is_ours`), or nobody
    /// is heard while another one should serve it.
    pub(super) fn is_due(&mut self, is_ours: bool, now: Time) -> bool {
        let is_news = std::mem::take(&mut self.is_news);
        if is_ours { is_news } else { self.due().is_some_and(|due| due <= now) }
    }

    /// Whether an instance with this mark publishes values. One of which nobody has told that it publishes under its mark may be
    /// any publisher that is not shown.
    pub(super) fn hears(&self, mark: Option<u32>, now: Time) -> bool {
        let last = self.heard.get(&mark).or_else(|| self.heard.get(&None));
        last.is_some_and(|last| now - *last <= self.max_age)
    }

    /// This instance serves the need from now on, or no longer.
    pub(super) fn change_hands(&mut self) {
        (self.waiting, self.doubted) = (None, None);
    }

    /// Forgets publishers that hold no token any more.
    pub(super) fn forget(&mut self, is_known: impl Fn(u32) -> bool) {
        self.heard.retain(|mark, _| mark.is_none_or(&is_known));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(milliseconds: i64) -> Time {
        Time(milliseconds * 1_000_000)
    }

    /// A watch over a need of the age 1 s.
    fn watch() -> Watch {
        Watch::new(Span::from_millis(1_000))
    }

    #[test]
    fn values_that_nobody_publishes_for_the_age_are_unserved() {
        let mut watch = watch();
        assert!(!watch.is_unserved(true, at(9_000)), "there was no value");
        for now in (0..=1_000).step_by(100) {
            watch.want(at(now));
            assert!(!watch.is_unserved(true, at(now)), "{now}");
        }
        assert_eq!(watch.due(), Some(at(1_000) + Span(1)));
        assert!(!watch.is_unserved(true, at(1_010)), "it may be on its way");
        assert_eq!(watch.due(), Some(at(1_110)));
        assert!(watch.is_unserved(true, at(1_110)));
        assert!(!watch.clone().is_unserved(false, at(1_110)));
        watch.hear(Some(1), at(1_120));
        assert!(!watch.is_unserved(true, at(9_000)));
        assert_eq!(watch.due(), None);
    }

    #[test]
    fn who_was_suspended_looks_at_what_has_waited_first() {
        let mut watch = watch();
        watch.want(at(0));
        assert!(!watch.is_unserved(true, at(60_000)));
        watch.hear(Some(1), at(60_050));
        assert!(!watch.is_unserved(true, at(60_200)));
    }

    #[test]
    fn only_who_publishes_is_heard() {
        let mut watch = watch();
        watch.hear(Some(1), at(0));
        assert!(watch.hears(Some(1), at(1_000)) && !watch.hears(Some(1), at(1_001)));
        assert!(!watch.hears(Some(2), at(0)));
        // A publisher that is not shown may be anybody who has not shown itself.
        watch.hear(None, at(2_000));
        assert!(watch.hears(Some(2), at(2_000)) && !watch.hears(Some(1), at(2_000)));
        watch.forget(|mark| mark == 2);
        assert!(watch.hears(Some(1), at(2_000)), "what it published is forgotten");
    }
}
