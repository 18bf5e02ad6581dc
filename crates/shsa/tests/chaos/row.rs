//! The result of a scenario as a row of the table in workshop/measured/results.md; and the order in which scenarios run.

use serde_json::json;
use std::io::Write;
use std::path::PathBuf;
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

/// The fault of a scenario, and the promise.
pub(crate) struct Scenario {
    /// The row of the table.
    pub(crate) number: u32,
    /// The fault.
    pub(crate) name: &'static str,
    /// How the fault was made.
    pub(crate) done: &'static str,
    /// The promise.
    pub(crate) promised: &'static str,
}

impl Scenario {
    /// Records that the promise was kept, with the observations.
    pub(crate) fn seen(&self, seen: &str) {
        let _ = writeln!(std::io::stderr(), "{}: {seen}", self.name);
        let Some(folder) = std::env::var_os("SHSA_CHAOS_ROWS") else { return };
        let Scenario { number, name, done, promised } = self;
        let row = json!({ "scenario": name, "done": done, "promised": promised, "seen": seen });
        std::fs::write(PathBuf::from(folder).join(format!("{number:02}.json")), row.to_string()).unwrap();
    }

    /// Records that this machine cannot run the scenario, with the reason.
    pub(crate) fn skipped(&self, because: &str) {
        let _ = writeln!(std::io::stderr(), "SKIPPED: {}: {because}", self.name);
        self.seen(&format!("SKIPPED: {because}"));
    }
}

/// Scenarios that need the machine alone exclude all others.
static TURN: RwLock<()> = RwLock::new(());

/// For a scenario that may run with others.
pub(crate) fn beside_others() -> RwLockReadGuard<'static, ()> {
    TURN.read().unwrap_or_else(PoisonError::into_inner)
}

/// For a scenario that must run alone.
pub(crate) fn alone() -> RwLockWriteGuard<'static, ()> {
    TURN.write().unwrap_or_else(PoisonError::into_inner)
}

/// A time for the table.
pub(crate) fn shown(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.0} ms", seconds * 1e3) } else { format!("{seconds:.1} s") }
}
