//! `--bus ..`: which middleware, and how to reach it.

use shsa_bridge::memory::MemoryBus;
use shsa_bridge::{Bridge, BridgeError, Inbox};
use std::fmt;
use std::str::FromStr;

/// Where the bus is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Address {
    /// Within this process.
    Memory,
}

impl FromStr for Address {
    type Err = String;

    /// # Errors
    /// Says what an address looks like.
    fn from_str(text: &str) -> Result<Address, String> {
        match text {
            "memory" => Ok(Address::Memory),
            other => Err(format!("`{other}` is no bus; write `memory`")),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Address::Memory => f.write_str("memory"),
        }
    }
}

/// The arguments of every command that uses a bus.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct BusArguments {
    /// The middleware: memory.
    #[arg(long, value_name = "BUS", default_value = "memory")]
    pub(crate) bus: Address,
    /// Messages of one topic that may wait; the oldest make room for newer ones.
    #[arg(long, value_name = "N", default_value_t = 1024)]
    pub(crate) queue: usize,
}

impl BusArguments {
    /// Connects; what arrives waits in `inbox`. The bus in memory is `memory`.
    ///
    /// # Errors
    /// When the address or the configuration cannot be used, or the other side refuses.
    pub(crate) fn open(
        &self,
        _name: &str,
        inbox: Inbox,
        memory: &MemoryBus,
    ) -> Result<Box<dyn Bridge>, BridgeError> {
        match &self.bus {
            Address::Memory => Ok(Box::new(memory.join_with(inbox))),
        }
    }
}
