//! What becomes of a scenario: a row of the table in docs/results.md; and whose turn it is.

use serde_json::json;
use std::io::Write;
use std::path::PathBuf;
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

/// What broke, and what was promised for it.
pub(crate) struct Scenario {
    /// Its place in the table.
    pub(crate) number: u32,
    /// What broke.
    pub(crate) name: &'static str,
    /// What was done.
    pub(crate) done: &'static str,
    /// What is promised.
    pub(crate) promised: &'static str,
}

impl Scenario {
    /// What was promised was kept; this was seen.
    pub(crate) fn seen(&self, seen: &str) {
        let _ = writeln!(std::io::stderr(), "{}: {seen}", self.name);
        let Some(folder) = std::env::var_os("SHSA_CHAOS_ROWS") else { return };
        let Scenario { number, name, done, promised } = self;
        let row = json!({ "scenario": name, "done": done, "promised": promised, "seen": seen });
        std::fs::write(PathBuf::from(folder).join(format!("{number:02}.json")), row.to_string()).unwrap();
    }

    /// It cannot be shown on this machine, and says so.
    pub(crate) fn skipped(&self, because: &str) {
        let _ = writeln!(std::io::stderr(), "SKIPPED: {}: {because}", self.name);
        self.seen(&format!("SKIPPED: {because}"));
    }
}

/// Scenarios that need the machine for themselves wait for the others, and the others for them.
static TURN: RwLock<()> = RwLock::new(());

/// Runs beside others.
pub(crate) fn beside_others() -> RwLockReadGuard<'static, ()> {
    TURN.read().unwrap_or_else(PoisonError::into_inner)
}

/// Runs alone.
pub(crate) fn alone() -> RwLockWriteGuard<'static, ()> {
    TURN.write().unwrap_or_else(PoisonError::into_inner)
}

/// A time for the table.
pub(crate) fn shown(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.0} ms", seconds * 1e3) } else { format!("{seconds:.1} s") }
}
