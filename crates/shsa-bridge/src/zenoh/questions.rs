//! A key under which questions are answered: queries by a reply, and what is put there by a message.

use super::{bytes_of, connection::Connection, key_of};
use crate::{BridgeError, Question, Server};
use ::zenoh::Wait;
use ::zenoh::key_expr::KeyExpr;
use ::zenoh::query::Query;
use ::zenoh::sample::{Locality, Sample, SampleKind};
use bytes::Bytes;

/// Hands what others ask under `name` to `server`, from the moment on at which there is a session.
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
        // Both fail only where the session is closed.
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

/// The reply bears our own key: the query may have asked for many.
fn question(query: Query, own: KeyExpr<'static>) -> Question {
    let words = query.payload().map_or(Bytes::new(), |words| Bytes::from(words.to_bytes().into_owned()));
    let parameters = query.parameters().as_str().to_owned();
    let reply = move |words: Bytes| drop(query.reply(own, words).wait());
    let mut question = Question::new(words, reply);
    question.parameters = parameters;
    question.is_addressed = true;
    question
}
