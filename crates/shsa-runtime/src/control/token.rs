//! The token without which nothing is changed.

use crate::error::{Context, RuntimeError, unfit};
use std::collections::VecDeque;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use std::{env, fmt, fs};
use subtle::ConstantTimeEq;

/// The environment variable that may hold the token.
const VARIABLE: &str = "SHSA_TOKEN";
/// A shorter token is guessed.
const SHORTEST: usize = 16;
/// So many wrong tokens within [`WINDOW`] close the door until the window has passed.
const MOST_WRONG: usize = 5;
const WINDOW: Duration = Duration::from_secs(10);

/// A secret; it is never shown.
#[derive(Clone)]
pub struct Token(Arc<[u8]>);

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(..)")
    }
}

impl Token {
    /// From the first line of a file, else from the environment; `None` when neither is given, and then nothing can be
    /// changed.
    ///
    /// # Errors
    /// When the file cannot be read, or the token is too short.
    pub fn find(file: Option<&Path>) -> Result<Option<Token>, RuntimeError> {
        let text = match file {
            Some(file) => {
                let text = fs::read_to_string(file);
                Some(text.with_context(|| format!("reading the token from {}", file.display()))?)
            }
            None => env::var(VARIABLE).ok(),
        };
        let line = text.as_deref().map(|text| text.lines().next().unwrap_or_default().trim());
        line.map(Token::new).transpose()
    }

    /// In a text.
    ///
    /// # Errors
    /// When it is too short.
    pub fn new(text: &str) -> Result<Token, RuntimeError> {
        if text.len() < SHORTEST {
            return Err(unfit(format!("the token is shorter than {SHORTEST} characters; take a longer one")));
        }
        Ok(Token(text.as_bytes().into()))
    }

    /// Whether a text is the token; takes as long for a text that is nearly right as for one that is not at all.
    fn is(&self, text: &str) -> bool {
        self.0.ct_eq(text.as_bytes()).into()
    }
}

/// What a guard says to who wants to change something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Answer {
    /// The token is right.
    Pass,
    /// There was none, or a wrong one.
    Wrong,
    /// Too many were wrong of late: not even a right one is looked at.
    Later,
    /// The run was started without a token: nobody can change anything.
    Never,
}

impl Answer {
    /// Why it is not done; `wanted` says how the token is shown. `None` when it passes.
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

/// Looks at tokens, and limits guessing; clones are the same guard.
#[derive(Clone, Debug)]
pub(in super::super) struct Guard {
    token: Option<Token>,
    wrong: Arc<Mutex<VecDeque<Instant>>>,
}

impl Guard {
    pub(in super::super) fn new(token: Option<Token>) -> Guard {
        Guard { token, wrong: Arc::default() }
    }

    /// What to answer to who shows this token.
    pub(in super::super) fn look(&self, shown: Option<&str>) -> Answer {
        self.look_at(shown, Instant::now())
    }

    fn look_at(&self, shown: Option<&str>, now: Instant) -> Answer {
        let Some(token) = &self.token else { return Answer::Never };
        let mut wrong = self.wrong.lock().unwrap_or_else(PoisonError::into_inner);
        while wrong.front().is_some_and(|at| now.duration_since(*at) >= WINDOW) {
            wrong.pop_front();
        }
        if wrong.len() >= MOST_WRONG {
            return Answer::Later;
        }
        match shown {
            Some(shown) if token.is(shown) => Answer::Pass,
            Some(_) => {
                wrong.push_back(now);
                Answer::Wrong
            }
            // Who shows nothing has guessed nothing.
            None => Answer::Wrong,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIGHT: &str = "0123456789abcdef";

    #[test]
    fn only_the_right_token_passes() {
        let guard = Guard::new(Some(Token::new(RIGHT).unwrap()));
        assert_eq!(guard.look(Some(RIGHT)), Answer::Pass);
        for wrong in [None, Some(""), Some("0123456789abcde"), Some("0123456789abcdeg")] {
            assert_eq!(guard.look(wrong), Answer::Wrong);
        }
    }

    #[test]
    fn guessing_closes_the_door_for_a_while() {
        let guard = Guard::new(Some(Token::new(RIGHT).unwrap()));
        let start = Instant::now();
        for _ in 0..MOST_WRONG {
            assert_eq!(guard.look_at(Some("guess"), start), Answer::Wrong);
        }
        assert_eq!(guard.look_at(Some(RIGHT), start + WINDOW / 2), Answer::Later);
        assert_eq!(guard.look_at(Some(RIGHT), start + WINDOW), Answer::Pass);
    }

    #[test]
    fn without_a_token_nothing_can_be_changed() {
        assert_eq!(Guard::new(None).look(Some("")), Answer::Never);
    }

    #[test]
    fn a_token_is_never_shown_and_never_short() {
        assert_eq!(format!("{:?}", Token::new(RIGHT).unwrap()), "Token(..)");
        assert!(Token::new("short").is_err());
    }
}
