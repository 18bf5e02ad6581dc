//! Requests: queries of Zenoh, whose first answer counts.

use super::connection::Connection;
use super::{lost, not_open};
use crate::{Answer, BridgeError};
use ::zenoh::Wait;
use ::zenoh::key_expr::KeyExpr;
use ::zenoh::query::{ConsolidationMode, QueryTarget, Reply};
use bytes::Bytes;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

/// How much longer than the query itself its answer is awaited.
const GRACE: Duration = Duration::from_millis(500);

/// Asks all servers under a key.
pub(crate) fn request(
    connection: &Connection,
    key: KeyExpr<'static>,
    payload: Bytes,
    attachment: Option<Vec<u8>>,
    within: Duration,
) -> Result<Answer, BridgeError> {
    let session = connection.session().ok_or_else(|| not_open(connection))?;
    let (sender, answers) = mpsc::channel();
    let name = key.to_string();
    let query = session
        .get(key)
        .payload(payload)
        .target(QueryTarget::All)
        // Later answers do not replace the first one.
        .consolidation(ConsolidationMode::None)
        .timeout(within);
    let query = match attachment {
        Some(attachment) => query.attachment(attachment),
        None => query,
    };
    // The asker may have given up.
    query.callback(move |reply| drop(sender.send(read(reply)))).wait().map_err(lost)?;
    Ok(Box::new(move || match answers.recv_timeout(within + GRACE) {
        Ok(answer) => answer,
        Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
            Err(BridgeError::Lost(format!("nobody answers under `{name}`")))
        }
    }))
}

fn read(reply: Reply) -> Result<Bytes, BridgeError> {
    match reply.into_result() {
        Ok(sample) => Ok(super::bytes_of(&sample)),
        Err(error) => {
            let refusal = error.payload().to_bytes();
            Err(BridgeError::Refused(String::from_utf8_lossy(&refusal).into_owned()))
        }
    }
}
