//! Errors of a middleware.

use shsa_message::MessageError;
use thiserror::Error;

/// Why a bridge could not do what it was asked for.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum BridgeError {
    /// The address, the configuration or the file of credentials cannot be used.
    #[error("{0}")]
    Configuration(String),
    /// The other side refused: credentials, certificate, access rights, a name that it does not allow.
    #[error("refused: {0}")]
    Refused(String),
    /// The other side cannot be reached, or the connection is lost for good.
    #[error("connection lost: {0}")]
    Lost(String),
}

impl From<MessageError> for BridgeError {
    fn from(error: MessageError) -> BridgeError {
        BridgeError::Configuration(error.to_string())
    }
}
