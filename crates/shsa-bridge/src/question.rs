//! What others on the bus ask of us, and the way back to them.

use bytes::Bytes;
use std::fmt;
use std::sync::Arc;

/// Somebody asks something. Without an answer, who has asked waits in vain, or learns that none comes.
pub struct Question {
    /// Its words; empty where the name that it was asked under says it all.
    pub payload: Bytes,
    /// What stands behind the name, where the middleware has such: `since=3` of Zenoh's selector `name?since=3`.
    pub parameters: String,
    /// Whether the answer can be told from others: it is a reply, or has the correlation data that the asker has chosen.
    pub is_addressed: bool,
    /// Who asks, as far as the middleware tells: the topic that the answer is wished at, say.
    pub caller: String,
    /// Why it must not be done, whatever it is.
    pub problem: Option<String>,
    answer: Box<dyn FnOnce(Bytes) + Send>,
}

/// Takes questions, in the middleware's threads: it must hand them on and not wait.
pub type Server = Arc<dyn Fn(Question) + Send + Sync>;

/// Takes the answer to a question of ours.
pub type Taker = Box<dyn FnOnce(Vec<u8>) + Send>;

impl Question {
    /// A question in these words; `answer` takes what is answered where it belongs.
    #[must_use]
    pub fn new(payload: Bytes, answer: impl FnOnce(Bytes) + Send + 'static) -> Question {
        Question {
            payload,
            parameters: String::new(),
            caller: "the bus".to_owned(),
            is_addressed: false,
            problem: None,
            answer: Box::new(answer),
        }
    }

    /// Answers it; whoever has asked may have gone.
    pub fn answer(self, words: Bytes) {
        (self.answer)(words);
    }
}

impl fmt::Debug for Question {
    /// Without the words: they may hold a secret.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Question({} bytes)", self.payload.len())
    }
}

/// Whether an answer may go to the topic that its asker wishes: to the topic of answers or one below it. Anywhere else the
/// asker may have no right to publish, and we have.
#[cfg(feature = "mqtt")]
pub(crate) fn may_answer_at(answers: &str, wish: &str) -> bool {
    let below = wish.strip_prefix(answers).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'));
    below && !wish.contains(['+', '#', '\0'])
}

#[cfg(all(test, feature = "mqtt"))]
mod tests {
    use super::*;

    #[test]
    fn answers_stay_below_their_topic() {
        for allowed in ["shsa/a/answer", "shsa/a/answer/me", "shsa/a/answer/x/y"] {
            assert!(may_answer_at("shsa/a/answer", allowed), "{allowed}");
        }
        for foreign in
            ["", "/car/speed", "shsa/a", "shsa/a/answers", "shsa/b/answer", "shsa/a/answer/#", "$SYS/x"]
        {
            assert!(!may_answer_at("shsa/a/answer", foreign), "{foreign}");
        }
    }

    #[test]
    fn words_are_not_shown() {
        let question = Question::new(Bytes::from_static(b"a secret"), |_| ());
        assert_eq!(format!("{question:?}"), "Question(8 bytes)");
    }
}
