//! Questions of others on the bus, and their answers.

use bytes::Bytes;
use std::fmt;
use std::sync::Arc;

/// A question. Without an answer, the asker waits in vain, or learns that none comes.
pub struct Question {
    /// The text; empty if the name is enough.
    pub payload: Bytes,
    /// The parameters behind the name, if the middleware has them: `since=3` of Zenoh's selector `name?since=3`.
    pub parameters: String,
    /// Whether the answer is addressed: it is a reply, or has the asker's correlation data.
    pub is_addressed: bool,
    /// The asker, as far as the middleware names it: the topic for the answer, say.
    pub caller: String,
    /// Why the question must be refused, whatever it asks.
    pub problem: Option<String>,
    answer: Box<dyn FnOnce(Bytes) + Send>,
}

/// Takes questions in the middleware's threads: it must pass them on and not wait.
pub type Server = Arc<dyn Fn(Question) + Send + Sync>;

/// Takes the answer to a question of ours.
pub type Taker = Box<dyn FnOnce(Vec<u8>) + Send>;

impl Question {
    /// A question with this text; `answer` passes the answer to the asker.
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

    /// Answers the question; the asker may be gone.
    pub fn answer(self, words: Bytes) {
        (self.answer)(words);
    }
}

impl fmt::Debug for Question {
    /// Without the text: it may hold a secret.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Question({} bytes)", self.payload.len())
    }
}

/// Whether an answer may go to the topic that its asker wishes: the topic of answers or one below it. For other topics we may
/// have rights that the asker lacks.
#[cfg(feature = "mqtt")]
pub(crate) fn may_answer_at(answers: &str, response_topic: &str) -> bool {
    let below =
        response_topic.strip_prefix(answers).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'));
    below && !response_topic.contains(['+', '#', '\0'])
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
