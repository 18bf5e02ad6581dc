//! Keys whose questions are answered: queries by a reply, publications by a message. And our own queries.

use super::{bytes_of, connection::Connection, key_of};
use crate::{BridgeError, Inbox, Question, Server, Taker};
use ::zenoh::Wait;
use ::zenoh::key_expr::KeyExpr;
use ::zenoh::query::{Query, Reply};
use ::zenoh::sample::{Locality, Sample, SampleKind};
use bytes::Bytes;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// The longest time for an answer of others.
const ANSWER_MAX: Duration = Duration::from_secs(5);

/// Passes questions under `name` to `server`, once there is a session.
pub(crate) fn serve(
    connection: &Connection,
    name: &str,
    answers: &str,
    server: Server,
) -> Result<(), BridgeError> {
    let (key, answers) = (key_of(name)?, key_of(answers)?);
    connection.when_open(move |session| {
        let (own, ask) = (key.clone(), server.clone());
        let of_query = move |query: Query| ask(question(query, own.clone()));
        let queryable = session.declare_queryable(key.clone()).allowed_origin(Locality::Remote);
        // Both fail only if the session is closed.
        let _ = queryable.callback(of_query).background().wait();
        let network = session.clone();
        let of_message = move |sample: Sample| {
            if sample.kind() == SampleKind::Put {
                let (network, answers) = (network.clone(), answers.clone());
                let put = move |words: Bytes| drop(network.put(answers, words).wait());
                server(Question::new(bytes_of(&sample), put));
            }
        };
        let subscriber = session.declare_subscriber(key).allowed_origin(Locality::Remote);
        let _ = subscriber.callback(of_message).background().wait();
    });
    Ok(())
}

/// The reply has our own key, because the query may match many keys.
fn question(query: Query, own: KeyExpr<'static>) -> Question {
    let words = query.payload().map_or(Bytes::new(), |words| Bytes::from(words.to_bytes().into_owned()));
    let parameters = query.parameters().as_str().to_owned();
    let reply = move |words: Bytes| drop(query.reply(own, words).wait());
    let mut question = Question::new(words, reply);
    question.parameters = parameters;
    question.is_addressed = true;
    question
}

/// Passes the first answer to `take`; longer answers are ignored.
pub(crate) fn ask(
    connection: &Connection,
    inbox: &Inbox,
    name: &str,
    longest: usize,
    take: Taker,
) -> Result<(), BridgeError> {
    let (key, inbox, take) = (key_of(name)?, inbox.clone(), Mutex::new(Some(take)));
    let on_reply = move |reply: Reply| {
        let Ok(sample) = reply.result() else { return };
        if sample.payload().len() > longest {
            return;
        }
        let first = take.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(take) = first {
            take(sample.payload().to_bytes().into_owned());
            inbox.wake();
        }
    };
    connection.when_open(move |session| {
        let query = session.get(key).timeout(ANSWER_MAX).allowed_destination(Locality::Remote);
        // Fails only if the session is closed.
        let _ = query.callback(on_reply).wait();
    });
    Ok(())
}
