//! How needs are wired: the takeover of a failed source's name, and what it takes: actions, checks, the way back.
//!
//! `takeover` decides when which action is due, `action` carries it out in a thread of its own, `patterns` keeps what the
//! source's messages looked like.

pub(super) mod action;
mod patterns;
mod takeover;

pub(super) use patterns::Patterns;
pub(super) use takeover::{Note, Situation, Takeover};
