//! The parts of a recording that are left out: a beginning, an end, stretches. After each gap a new session begins.

use super::session::{Because, Session};
use super::{Recording, Sample};
use shsa_core::time::{Span, Time};
use shsa_message::span::parse_span;
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

/// A time from the start. Zero needs no unit; a plain number counts seconds.
///
/// # Errors
/// The reason in words.
pub fn moment(text: &str) -> Result<Span, String> {
    match text.trim().trim_end_matches(|c: char| c.is_alphabetic()).trim().parse::<f64>() {
        Ok(0.0) => Ok(Span::ZERO),
        Ok(seconds) if text.trim().ends_with(|c: char| c.is_ascii_digit()) && seconds > 0.0 => {
            Ok(Span::from_seconds(seconds))
        }
        _ => parse_span(text),
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

impl Cuts {
    /// A message for each stretch that leaves nothing out of any of these sessions, which are whole.
    #[must_use]
    pub fn beyond(&self, sessions: &[Session]) -> Vec<String> {
        let longest = sessions.iter().map(|it| it.span.1 - it.origin).max().unwrap_or_default();
        let is_beyond = |stretch: &&Stretch| stretch.from > longest;
        let beyond = |stretch: &Stretch| {
            format!("nothing to skip from {} s on: the recording ends before", stretch.from.seconds())
        };
        self.skip.iter().filter(is_beyond).map(beyond).collect()
    }
}

impl Recording {
    /// Leaves out the cuts, in each session by its own time. The part after a gap is a new session, so that no computation spans
    /// the gap. Returns a message for each stretch that left nothing out.
    pub fn cut(&mut self, cuts: &Cuts) -> Vec<String> {
        if cuts.is_empty() {
            return Vec::new();
        }
        let beyond = cuts.beyond(&self.sessions);
        let (mut samples, mut sessions) = (Vec::new(), Vec::new());
        for (session, own) in self.by_session() {
            let mut parting = Parting::new(session, cuts);
            own.iter().for_each(|sample| parting.see(sample));
            for part in parting.sessions(samples.len()) {
                let is_kept = |sample: &&Sample| part.part.holds(part.origin, sample);
                samples.extend(own.iter().filter(is_kept).cloned());
                sessions.push(part);
            }
        }
        (self.samples, self.sessions) = (samples, sessions);
        beyond
    }
}

/// The parts of a session that cuts leave, found by passing over its samples in the order of reception.
#[derive(Clone, Debug)]
pub struct Parting {
    session: Session,
    parts: Vec<(Stretch, Option<Kept>)>,
}

/// The samples of a part: the first and the last reception, and the count.
#[derive(Clone, Copy, Debug)]
struct Kept {
    span: (Time, Time),
    count: usize,
}

impl Parting {
    /// Before the first sample of a whole session.
    #[must_use]
    pub fn new(session: &Session, cuts: &Cuts) -> Parting {
        let parts = cuts.kept().into_iter().map(|stretch| (stretch, None)).collect();
        Parting { session: session.clone(), parts }
    }

    /// Takes in the next sample.
    pub fn see(&mut self, sample: &Sample) {
        let (origin, at) = (self.session.origin, sample.received);
        let part = self.parts.iter_mut().find(|(stretch, _)| stretch.holds(origin, sample));
        if let Some((_, kept)) = part {
            let Kept { span: (from, _), count } = kept.unwrap_or(Kept { span: (at, at), count: 0 });
            *kept = Some(Kept { span: (from, at), count: count + 1 });
        }
    }

    /// The parts that have samples, as sessions whose samples begin at this index, one part after the other.
    #[must_use]
    pub fn sessions(self, mut begin: usize) -> Vec<Session> {
        let Parting { session, parts } = self;
        let mut before = session.origin;
        let part = |(part, kept): (Stretch, Option<Kept>)| {
            let Kept { span, count } = kept?;
            let left_out = Because::LeftOut { length: span.0 - before };
            let because = if part.from > Span::ZERO { Some(left_out) } else { session.because.clone() };
            let samples = begin..begin + count;
            (before, begin) = (span.1, samples.end);
            Some(Session { samples, span, because, part, ..session.clone() })
        };
        parts.into_iter().filter_map(part).collect()
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
