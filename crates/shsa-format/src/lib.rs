//! Files: knowledge bases, recordings, faults to inject, orders, journals, states and stories.

pub mod drive;
pub mod drawing;
pub mod fault;
pub mod journal;
pub mod model;
pub mod order;
pub mod recording;
pub mod state;
pub mod story;
pub mod wiring;
