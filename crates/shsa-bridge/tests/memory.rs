//! The bus in memory keeps the contract of all bridges.

#[macro_use]
mod contract;

use contract::{Asking, Middleware};
use shsa_bridge::memory::MemoryBus;
use shsa_bridge::{Bridge, Clock, Inbox};

impl Middleware for MemoryBus {
    fn bridge(&mut self, _name: &str, inbox: Inbox) -> Box<dyn Bridge> {
        Box::new(self.join_with(inbox))
    }

    fn break_it(&mut self) -> bool {
        false
    }

    fn mend_it(&mut self) {}

    fn asking(&self) -> Asking {
        Asking::Queries
    }
}

contract!(memory, MemoryBus::new(Clock::running()));
