//! The parts of a recording that are left out: a beginning, an end, stretches. After each gap a new session begins.

use super::session::{Because, Session};
use super::{Recording, Sample};
use crate::fault::moment;
use shsa_core::time::{Span, Time};
use std::str::FromStr;

/// A stretch of time, counted from the first observation of its recording; the end is excluded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Stretch {
    /// The begin.
    pub from: Span,
    /// The end, which is after the begin.
    pub to: Span,
}

impl Stretch {
    /// The whole recording.
    pub const ALL: Stretch = Stretch { from: Span::ZERO, to: Span::MAX };
}

impl FromStr for Stretch {
    type Err = String;

    /// Such as `20s..30s`; a missing end is that of the recording.
    ///
    /// # Errors
    /// The reason in words.
    fn from_str(text: &str) -> Result<Stretch, String> {
        let (from, to) = text.split_once("..").ok_or("no '..'; write it like 20s..30s")?;
        let is_blank = |text: &str| text.trim().is_empty();
        let from = if is_blank(from) { Span::ZERO } else { moment(from)? };
        let to = if is_blank(to) { Span::MAX } else { moment(to)? };
        if from < to { Ok(Stretch { from, to }) } else { Err("it ends before it starts".to_owned()) }
    }
}

/// The parts to leave out of each recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cuts {
    /// Everything before this time.
    pub from: Option<Span>,
    /// Everything from this time on.
    pub until: Option<Span>,
    /// These stretches.
    pub skip: Vec<Stretch>,
}

impl Cuts {
    /// Whether nothing is left out.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Cuts::default()
    }

    /// The stretches that are kept, in the order of time.
    #[must_use]
    pub fn kept(&self) -> Vec<Stretch> {
        let mut skip = self.skip.clone();
        skip.extend(self.from.map(|to| Stretch { from: Span::ZERO, to }));
        skip.extend(self.until.map(|from| Stretch { from, to: Span::MAX }));
        skip.sort();
        let mut kept = Vec::new();
        let mut from = Span::ZERO;
        for one in skip {
            if from < one.from {
                kept.push(Stretch { from, to: one.from });
            }
            from = from.max(one.to);
        }
        if from < Span::MAX {
            kept.push(Stretch { from, to: Span::MAX });
        }
        kept
    }
}

impl Recording {
    /// Leaves out the cuts, in each session by its own time. The part after a gap is a new session, so that no computation spans
    /// the gap. Returns a message for each stretch that left nothing out.
    pub fn cut(&mut self, cuts: &Cuts) -> Vec<String> {
        if cuts.is_empty() {
            return Vec::new();
        }
        let mut samples = Vec::new();
        let mut sessions = Vec::new();
        let kept = cuts.kept();
        for (session, own) in self.by_session() {
            let mut before = session.origin;
            for stretch in &kept {
                let begin = samples.len();
                samples.extend(own.iter().filter(|it| stretch.holds(session.origin, it)).cloned());
                let Some(part) = part(session, samples.get(begin..).unwrap_or_default(), begin) else {
                    continue;
                };
                let left_out = Because::LeftOut { length: part.span.0 - before };
                let because =
                    if stretch.from > Span::ZERO { Some(left_out) } else { session.because.clone() };
                before = part.span.1;
                sessions.push(Session { because, part: *stretch, ..part });
            }
        }
        let longest = self.sessions.iter().map(|it| it.span.1 - it.origin).max().unwrap_or_default();
        (self.samples, self.sessions) = (samples, sessions);
        let is_beyond = |stretch: &&Stretch| stretch.from > longest;
        let beyond = |stretch: &Stretch| {
            format!("nothing to skip from {} s on: the recording ends before", stretch.from.seconds())
        };
        cuts.skip.iter().filter(is_beyond).map(beyond).collect()
    }
}

impl Stretch {
    /// Whether a sample was received in this stretch of a recording that begins at `origin`.
    #[must_use]
    pub fn holds(&self, origin: Time, sample: &Sample) -> bool {
        let since = sample.received - origin;
        self.from <= since && since < self.to
    }
}

/// The part of a session within a stretch; its samples begin at index `begin`.
fn part(session: &Session, samples: &[Sample], begin: usize) -> Option<Session> {
    let span = (samples.first()?.received, samples.last()?.received);
    Some(Session { samples: begin..begin + samples.len(), span, ..session.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(from: Option<i64>, until: Option<i64>, skip: &[&str], expected: &str) {
        let seconds = |it: i64| Span::from_millis(it * 1_000);
        let skip = skip.iter().map(|text| text.parse().unwrap()).collect();
        let kept = Cuts { from: from.map(seconds), until: until.map(seconds), skip }.kept();
        let second = |it: Span| if it == Span::MAX { "end".to_owned() } else { it.seconds().to_string() };
        let spans: Vec<String> =
            kept.iter().map(|it| format!("{}..{}", second(it.from), second(it.to))).collect();
        assert_eq!(spans.join(" "), expected);
    }

    #[test]
    fn what_is_left_out_leaves_the_rest() {
        check(None, None, &[], "0..end");
        check(Some(5), Some(50), &[], "5..50");
        check(None, None, &["20s..30s"], "0..20 30..end");
        check(Some(10), Some(50), &["30s..40s", "5s..15s", "35s..60s"], "15..30");
        check(None, None, &["..10s", "90s.."], "10..90");
        check(None, None, &["10s..20s", "20s..30s"], "0..10 30..end");
        check(Some(60), Some(50), &[], "");
    }

    #[test]
    fn stretches_that_are_none_are_refused() {
        for text in ["20s", "30s..20s", "a..b", "20..20"] {
            assert!(text.parse::<Stretch>().is_err(), "{text}");
        }
    }
}
