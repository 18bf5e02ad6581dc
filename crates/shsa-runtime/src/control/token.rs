//! The token that orders need.

use super::{Desk, Request};
use crate::error::{Context, RuntimeError, unfit};
use std::collections::{BTreeMap, VecDeque};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use std::{env, fmt, fs};
use subtle::ConstantTimeEq;

/// The least length of a token: a shorter one can be guessed.
const SHORTEST: usize = 16;
/// After this many wrong tokens within [`WINDOW`], no token of the same source is checked until the window has passed.
const MOST_WRONG: usize = 5;
const WINDOW: Duration = Duration::from_secs(10);
/// The number of sources whose wrong tokens are remembered.
const MOST_SOURCES: usize = 256;
/// The first wrong tokens of different sources are reported once in this time.
const REPORTED_EVERY: Duration = Duration::from_secs(1);

/// Whether users other than the owner and the group may read a file.
pub(in super::super) fn is_open_to_all(file: &Path) -> std::io::Result<bool> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        Ok(fs::metadata(file)?.permissions().mode() & 0o004 != 0)
    }
    #[cfg(not(unix))]
    Ok(false)
}

/// A secret. It is never printed.
#[derive(Clone)]
pub struct Token(Arc<[u8]>);

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(..)")
    }
}

impl Token {
    /// The token in the first line of a file, else in an environment variable; `None` when neither is given.
    ///
    /// # Errors
    /// When the file cannot be read, or the token is too short.
    pub fn find(file: Option<&Path>, variable: &str) -> Result<Option<Token>, RuntimeError> {
        let text = match file {
            Some(file) => {
                let reading = || format!("reading the token from {}", file.display());
                let text = fs::read_to_string(file).with_context(reading)?;
                if is_open_to_all(file).with_context(reading)? {
                    let file = file.display();
                    return Err(unfit(format!(
                        "everyone on this machine can read {file}; run: chmod o-r {file}"
                    )));
                }
                Some(text)
            }
            None => env::var(variable).ok(),
        };
        let line = text.as_deref().map(|text| text.lines().next().unwrap_or_default().trim());
        line.map(Token::new).transpose()
    }

    /// The token of a text.
    ///
    /// # Errors
    /// When the text is too short.
    pub fn new(text: &str) -> Result<Token, RuntimeError> {
        if text.len() < SHORTEST {
            return Err(unfit(format!("the token is shorter than {SHORTEST} characters; take a longer one")));
        }
        Ok(Token(text.as_bytes().into()))
    }

    /// The value of the header `Authorization` with this token, for who asks an instance.
    #[must_use]
    pub fn bearer(&self) -> String {
        format!("Bearer {}", String::from_utf8_lossy(&self.0))
    }

    /// Whether a text is the token. The time does not depend on how much of the text is right.
    fn is(&self, text: &str) -> bool {
        self.0.ct_eq(text.as_bytes()).into()
    }
}

/// The result of a token check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Answer {
    /// The token is right.
    Pass,
    /// The token is missing or wrong.
    Wrong,
    /// Too many tokens of this source were wrong of late: none is checked, not even a right one where the source is known.
    Later,
    /// The run has no token for this role: nobody has it.
    Never,
}

impl Answer {
    /// The reason of a refusal; `wanted` describes how to show the token. `None` for a pass.
    pub(in super::super) fn refusal(self, wanted: &str) -> Option<String> {
        match self {
            Answer::Pass => None,
            Answer::Wrong => Some(format!("needs {wanted}")),
            Answer::Later => Some("too many wrong tokens; try again later".to_owned()),
            Answer::Never => {
                Some("started without a token: nothing can be changed (see --token-file)".to_owned())
            }
        }
    }
}

/// Who shows a token.
#[derive(Clone, Copy, Debug)]
pub(in super::super) enum Asker<'a> {
    /// A machine, by its address: what it guesses locks out itself.
    Known(&'a str),
    /// Somebody on a bus that does not show who asks. The address for the answers is chosen by the asker, or shared by all: a guesser
    /// must lock out nobody who uses the same one, so a right token always passes. A run takes 200 requests a second, so guessing a
    /// token takes too long.
    Unknown(&'a str),
}

impl Asker<'_> {
    fn name(&self) -> &str {
        match self {
            Asker::Known(name) | Asker::Unknown(name) => name,
        }
    }
}

/// What a caller wants to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Role {
    /// View state, events and metrics.
    View,
    /// Give orders; includes viewing.
    Order,
}

/// The tokens of the run.
#[derive(Clone, Debug, Default)]
pub(in super::super) struct Tokens {
    /// The token for viewing; `None`: everyone may view.
    pub(in super::super) view: Option<Token>,
    /// The token for orders; `None`: nobody may order.
    pub(in super::super) order: Option<Token>,
}

/// Checks tokens and limits guessing; clones share their state.
///
/// A guessing source locks out only itself: a right token of another source always passes, and so does one of a source that nobody
/// can tell from others.
#[derive(Clone)]
pub(in super::super) struct Guard {
    tokens: Tokens,
    wrong: Arc<Mutex<Wrong>>,
    /// Takes notes about wrong tokens.
    desk: Desk,
}

/// Recent wrong tokens.
#[derive(Default)]
struct Wrong {
    /// The times of each source's wrong tokens.
    sources: BTreeMap<String, VecDeque<Instant>>,
    /// The number of wrong tokens since the start.
    count: u64,
    /// When a wrong token was reported last.
    reported: Option<Instant>,
}

impl Wrong {
    /// Forgets wrong tokens older than the window; with too many sources, forgets the source whose last wrong token is oldest.
    fn forget(&mut self, now: Instant) {
        for times in self.sources.values_mut() {
            times.retain(|at| now.duration_since(*at) < WINDOW);
        }
        self.sources.retain(|_, times| !times.is_empty());
        if self.sources.len() >= MOST_SOURCES {
            let oldest = self.sources.iter().min_by_key(|(_, times)| times.back().copied());
            let oldest = oldest.map(|(source, _)| source.clone());
            oldest.map(|source| self.sources.remove(&source));
        }
    }

    /// Counts a wrong token; returns a note if it is to be reported.
    fn count(&mut self, source: &str, is_known: bool, now: Instant) -> Option<String> {
        self.count += 1;
        self.forget(now);
        let times = self.sources.entry(source.to_owned()).or_default();
        times.push_back(now);
        let (number, seconds) = (times.len(), WINDOW.as_secs());
        let is_news = number == 1 || number == MOST_WRONG;
        if !is_news
            || self.reported.is_some_and(|at| now.duration_since(at) < REPORTED_EVERY && number < MOST_WRONG)
        {
            return None;
        }
        self.reported = Some(now);
        Some(match number {
            1 => format!("a wrong token from {source}"),
            _ if is_known => format!(
                "{number} wrong tokens from {source} within {seconds} s: none of it is looked at for {seconds} s"
            ),
            _ => format!("{number} wrong tokens from {source} within {seconds} s"),
        })
    }
}

impl Guard {
    pub(in super::super) fn new(tokens: Tokens, desk: Desk) -> Guard {
        Guard { tokens, wrong: Arc::default(), desk }
    }

    /// Checks the token that a caller shows for a role.
    pub(in super::super) fn look(&self, role: Role, shown: Option<&str>, caller: Asker<'_>) -> Answer {
        self.look_at(role, shown, caller, Instant::now())
    }

    /// The number of wrong tokens since the start.
    pub(in super::super) fn wrong(&self) -> u64 {
        self.lock().count
    }

    fn lock(&self) -> MutexGuard<'_, Wrong> {
        self.wrong.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn look_at(&self, role: Role, shown: Option<&str>, caller: Asker<'_>, now: Instant) -> Answer {
        let (source, is_known) = (caller.name(), matches!(caller, Asker::Known(_)));
        let Tokens { view, order } = &self.tokens;
        match role {
            Role::View if view.is_none() => return Answer::Pass,
            Role::Order if order.is_none() => return Answer::Never,
            Role::View | Role::Order => {}
        }
        let view = view.as_ref().filter(|_| role == Role::View);
        let is_right =
            |shown: &str| [view, order.as_ref()].into_iter().flatten().any(|token| token.is(shown));
        let mut wrong = self.lock();
        let is_late = |at: &&Instant| now.duration_since(**at) < WINDOW;
        let of_late = wrong.sources.get(source).map_or(0, |times| times.iter().filter(is_late).count());
        match shown {
            _ if is_known && of_late >= MOST_WRONG => Answer::Later,
            Some(shown) if is_right(shown) => Answer::Pass,
            _ if of_late >= MOST_WRONG => Answer::Later,
            Some(_) => {
                if let Some(news) = wrong.count(source, is_known, now) {
                    self.desk.call(Request::Denied(news), |_| ());
                }
                Answer::Wrong
            }
            // A missing token is no guess.
            None => Answer::Wrong,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Call;
    use super::*;
    use std::sync::mpsc::Receiver;

    const RIGHT: &str = "0123456789abcdef";

    fn guard(order: Option<&str>, view: Option<&str>) -> (Guard, Receiver<Call>) {
        let (desk, calls) = Desk::new(shsa_bridge::Inbox::new(1, shsa_bridge::Clock::manual()));
        let [order, view] = [order, view].map(|token| token.map(|token| Token::new(token).unwrap()));
        (Guard::new(Tokens { view, order }, desk), calls)
    }

    fn reported(calls: &Receiver<Call>) -> Vec<String> {
        let news = |call: Call| match call.request {
            Request::Denied(news) => news,
            other => panic!("{other:?}"),
        };
        calls.try_iter().map(news).collect()
    }

    #[test]
    fn only_the_right_token_passes() {
        let (guard, _calls) = guard(Some(RIGHT), None);
        assert_eq!(guard.look(Role::Order, Some(RIGHT), Asker::Known("a")), Answer::Pass);
        for wrong in [None, Some(""), Some("0123456789abcde"), Some("0123456789abcdeg")] {
            assert_eq!(guard.look(Role::Order, wrong, Asker::Known("a")), Answer::Wrong);
        }
        assert_eq!(guard.wrong(), 3);
    }

    #[test]
    fn guessing_locks_out_who_guesses_for_a_while_and_nobody_else() {
        let (guard, calls) = guard(Some(RIGHT), None);
        let start = Instant::now();
        for _ in 0..MOST_WRONG {
            assert_eq!(guard.look_at(Role::Order, Some("guess"), Asker::Known("a"), start), Answer::Wrong);
        }
        assert_eq!(
            guard.look_at(Role::Order, Some(RIGHT), Asker::Known("a"), start + WINDOW / 2),
            Answer::Later
        );
        assert_eq!(
            guard.look_at(Role::Order, Some(RIGHT), Asker::Known("b"), start + WINDOW / 2),
            Answer::Pass
        );
        assert_eq!(guard.look_at(Role::Order, Some(RIGHT), Asker::Known("a"), start + WINDOW), Answer::Pass);
        let reported = reported(&calls);
        assert_eq!(reported.len(), 2, "{reported:?}");
        assert_eq!(reported[0], "a wrong token from a");
        assert!(reported[1].starts_with("5 wrong tokens from a within 10 s"), "{}", reported[1]);
    }

    #[test]
    fn guessing_locks_out_nobody_where_nobody_is_shown() {
        let (guard, calls) = guard(Some(RIGHT), None);
        let start = Instant::now();
        let look = |shown| guard.look_at(Role::Order, Some(shown), Asker::Unknown("the bus"), start);
        let guesses = [(); MOST_WRONG + 1].map(|()| look("guess"));
        assert!(guesses.iter().take(MOST_WRONG).all(|answer| *answer == Answer::Wrong));
        assert_eq!((guesses[MOST_WRONG], look(RIGHT)), (Answer::Later, Answer::Pass));
        assert_eq!(reported(&calls).last().unwrap(), "5 wrong tokens from the bus within 10 s");
    }

    #[test]
    fn many_sources_cost_bounded_memory_and_few_words() {
        let (guard, calls) = guard(Some(RIGHT), None);
        let start = Instant::now();
        for source in 0..3 * MOST_SOURCES {
            assert_eq!(
                guard.look_at(Role::Order, Some("guess"), Asker::Known(&source.to_string()), start),
                Answer::Wrong
            );
        }
        assert!(guard.lock().sources.len() <= MOST_SOURCES);
        assert_eq!((reported(&calls).len(), guard.wrong()), (1, 3 * MOST_SOURCES as u64));
    }

    #[test]
    fn without_a_token_nothing_can_be_changed() {
        assert_eq!(guard(None, None).0.look(Role::Order, Some(""), Asker::Known("a")), Answer::Never);
    }

    #[test]
    fn who_may_look_may_not_order_and_who_may_order_may_look() {
        let view = "fedcba9876543210";
        let (with_both, _calls) = guard(Some(RIGHT), Some(view));
        let look = |role, shown| with_both.look(role, shown, Asker::Known("a"));
        assert_eq!([look(Role::View, Some(view)), look(Role::View, Some(RIGHT))], [Answer::Pass; 2]);
        assert_eq!([look(Role::View, None), look(Role::Order, Some(view))], [Answer::Wrong; 2]);
        assert_eq!(guard(Some(RIGHT), None).0.look(Role::View, None, Asker::Known("a")), Answer::Pass);
        assert_eq!(guard(None, Some(view)).0.look(Role::Order, Some(view), Asker::Known("a")), Answer::Never);
    }

    #[test]
    fn a_token_is_never_shown_and_never_short() {
        assert_eq!(format!("{:?}", Token::new(RIGHT).unwrap()), "Token(..)");
        assert!(Token::new("short").is_err());
    }
}
