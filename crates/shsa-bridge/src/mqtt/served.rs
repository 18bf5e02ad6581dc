//! A topic whose questions are answered.
//!
//! Questions have no delivery guarantee: the broker keeps none during an absence of the server, because an hour-old order must
//! not be carried out now. For the same reason a retained message is no question.

use super::client::Arrived;
use crate::question::{Question, Server, may_answer_at};
use bytes::Bytes;
use std::sync::Arc;

/// The server, and the topic of its answers.
#[derive(Clone)]
pub(super) struct Served {
    answers: Arc<str>,
    server: Server,
    publish: Arc<dyn Fn(Words) + Send + Sync>,
}

/// An answer to be sent.
pub(super) struct Words {
    pub(super) topic: String,
    pub(super) words: Bytes,
    /// The correlation data of the asker.
    pub(super) correlation: Option<Bytes>,
}

impl Served {
    /// Answers are published under `answers`, or below it if the asker says so.
    pub(super) fn new(
        answers: &str,
        server: Server,
        publish: impl Fn(Words) + Send + Sync + 'static,
    ) -> Served {
        Served { answers: answers.into(), server, publish: Arc::new(publish) }
    }

    /// Passes a message to the server.
    pub(super) fn ask(&self, arrived: Arrived) {
        let Arrived { payload, retained, response_topic, correlation, .. } = arrived;
        let asked_topic = response_topic.as_deref();
        let strays = asked_topic.filter(|asked_topic| !may_answer_at(&self.answers, asked_topic));
        let retained =
            retained.then(|| "a retained message is no request: nobody knows how old it is".to_owned());
        let strays = strays
            .map(|asked_topic| format!("answers go to {} or below it, not to {asked_topic}", self.answers));
        let topic = match (&strays, asked_topic) {
            (None, Some(asked_topic)) => asked_topic.to_owned(),
            _ => self.answers.to_string(),
        };
        let (publish, is_addressed, caller) = (self.publish.clone(), correlation.is_some(), topic.clone());
        let mut question = Question::new(payload, move |words| publish(Words { topic, words, correlation }));
        question.is_addressed = is_addressed;
        question.caller = caller;
        question.problem = retained.or(strays);
        (self.server)(question);
    }
}
