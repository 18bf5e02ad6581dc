//! The reference in `docs/` holds what the code's tables hold, no more and no less, and its examples are true.

mod document;

mod association;
mod events;
mod formulas;
mod grammar;
mod model;
mod recordings;
