//! The wiring of needs: the takeover of a failed source's name, with its actions, checks and way back.
//!
//! `takeover` decides which action is due when, `action` carries it out in a thread of its own, `patterns` keeps the message
//! templates of the sources.

pub(super) mod action;
mod patterns;
mod takeover;

pub(super) use patterns::Patterns;
pub(super) use takeover::{Note, Situation, Takeover};
