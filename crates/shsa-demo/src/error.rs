//! Why a demonstration cannot run.

use shsa_bridge::BridgeError;
use thiserror::Error;

/// Why a demonstration cannot run.
#[derive(Debug, Error)]
pub enum DemoError {
    /// The bus refuses a topic.
    #[error(transparent)]
    Bus(#[from] BridgeError),
    /// The model that is compiled in has errors: its problems as text, one below the other.
    #[error("{0}")]
    Model(String),
    /// The thread of the simulator cannot be started.
    #[error(transparent)]
    Thread(#[from] std::io::Error),
}
