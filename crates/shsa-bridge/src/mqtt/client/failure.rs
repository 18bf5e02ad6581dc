//! Why connections end, from the errors of the library.

use rumqttc::v5;
use std::{error::Error, io};

/// Why a connection ended or could not be made.
pub(in crate::mqtt) struct Failure {
    /// The other side refuses: trying again soon is useless.
    pub(in crate::mqtt) is_refusal: bool,
    pub(in crate::mqtt) reason: String,
}

pub(super) fn failure_v4(error: &rumqttc::ConnectionError) -> Failure {
    use rumqttc::{ConnectReturnCode, ConnectionError, StateError};
    match error {
        ConnectionError::ConnectionRefused(ConnectReturnCode::ServiceUnavailable) => {
            lost("the broker is unavailable")
        }
        ConnectionError::ConnectionRefused(code) => refused(format!("the broker says {code:?}")),
        ConnectionError::MqttState(StateError::ConnectionAborted) => {
            lost("the broker has closed the connection")
        }
        ConnectionError::NetworkTimeout | ConnectionError::FlushTimeout => lost("no answer"),
        ConnectionError::MqttState(StateError::AwaitPingResp) => lost("no answer to a ping"),
        other => of_error(other),
    }
}

pub(super) fn failure_v5(error: &v5::ConnectionError) -> Failure {
    use v5::mqttbytes::v5::{ConnectReturnCode, DisconnectReasonCode};
    use v5::{ConnectionError, StateError};
    match error {
        ConnectionError::ConnectionRefused(
            code @ (ConnectReturnCode::ServiceUnavailable
            | ConnectReturnCode::ServerBusy
            | ConnectReturnCode::ConnectionRateExceeded),
        ) => lost(format!("the broker says {code:?}")),
        ConnectionError::ConnectionRefused(code) => refused(format!("the broker says {code:?}")),
        ConnectionError::MqttState(StateError::ConnectionAborted) => {
            lost("the broker has closed the connection")
        }
        ConnectionError::MqttState(StateError::ServerDisconnect { reason_code, .. }) => match reason_code {
            DisconnectReasonCode::SessionTakenOver => {
                refused("another client has come with the same identifier; each needs its own: `name=..`")
            }
            DisconnectReasonCode::NotAuthorized | DisconnectReasonCode::AdministrativeAction => {
                refused(format!("the broker says {reason_code:?}"))
            }
            _ => lost(format!("the broker has left: {reason_code:?}")),
        },
        ConnectionError::MqttState(StateError::AwaitPingResp) => lost("no answer to a ping"),
        ConnectionError::Timeout(_) => lost("no answer"),
        other => of_error(other),
    }
}

fn lost(reason: impl Into<String>) -> Failure {
    Failure { is_refusal: false, reason: reason.into() }
}

fn refused(reason: impl Into<String>) -> Failure {
    Failure { is_refusal: true, reason: reason.into() }
}

/// A certificate that one side does not accept is a refusal; every other error may be gone at the next attempt.
fn of_error(error: &(dyn Error + 'static)) -> Failure {
    let reason = error.to_string();
    // The library gives the cause of some errors only in their text.
    let is_refusal = is_tls(error) || reason.contains("received fatal alert");
    let text = reason.strip_prefix("I/O: ").unwrap_or(&reason);
    Failure { is_refusal, reason: text.to_owned() }
}

fn is_tls(error: &(dyn Error + 'static)) -> bool {
    if error.is::<rustls::Error>() {
        return true;
    }
    let inner = error.downcast_ref::<io::Error>().and_then(io::Error::get_ref);
    inner.is_some_and(|inner| is_tls(inner)) || error.source().is_some_and(is_tls)
}
