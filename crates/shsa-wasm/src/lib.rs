//! The engine and its experiments for JavaScript: models, recordings as bytes, findings, replays, explanations.
//!
//! Results are JSON texts, which are those of the command with `--json`, by the same code. Every error is a [`Problem`] as JSON.
//! Where this program has a defect and panics, WebAssembly ends it; [`last_panic`] then tells why.

mod problem;
mod progress;
mod model;
mod engine;
mod recordings;
mod doctor;
mod replay;

pub use doctor::Doctor;
pub use engine::Engine;
pub use model::{Model, check};
pub use problem::Problem;
pub use recordings::Recordings;
pub use replay::Replay;

use std::cell::RefCell;
use wasm_bindgen::prelude::wasm_bindgen;

thread_local! {
    static PANIC: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Keeps the message of a panic, as WebAssembly says nothing but `unreachable`.
#[wasm_bindgen(start)]
pub fn start() {
    std::panic::set_hook(Box::new(|panic| PANIC.set(Some(panic.to_string()))));
}

/// The message of the panic that has ended this program.
#[wasm_bindgen]
#[must_use]
pub fn last_panic() -> Option<String> {
    PANIC.take()
}

/// The version of the package.
#[wasm_bindgen]
#[must_use]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}
