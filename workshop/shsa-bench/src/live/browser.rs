//! A browser with the page open during a soak, and the memory of the page.

use super::middleware::Middleware;
use super::soak::Slope;
use anyhow::Context;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::thread::{self, JoinHandle};

const SCRIPT: &str = include_str!("browser.py");

/// The page in a browser.
pub(super) struct Browser {
    child: Child,
    input: Option<ChildStdin>,
    rows: Option<JoinHandle<Vec<Value>>>,
}

/// The memory of the page over time.
pub(super) struct PageMemory {
    /// Seconds since the page was opened, and bytes of the heap in use.
    points: Vec<(f64, f64)>,
    /// The share of the time in which the main thread was busy.
    busy: f64,
}

impl PageMemory {
    fn of(rows: &[Value]) -> PageMemory {
        let number = |row: &Value, key: &str| row[key].as_f64().unwrap_or(f64::NAN);
        // The first tenth is the warm-up.
        let warm = &rows[rows.len() / 10..];
        let points: Vec<(f64, f64)> =
            warm.iter().map(|row| (number(row, "at_s"), number(row, "heap_bytes"))).collect();
        let busy = warm.iter().map(|row| number(row, "busy")).sum::<f64>() / warm.len() as f64;
        PageMemory { points, busy }
    }

    /// The heap after the warm-up and at the end, bytes.
    fn ends(&self) -> [f64; 2] {
        let bytes = |point: Option<&(f64, f64)>| point.map_or(f64::NAN, |(_, bytes)| *bytes);
        [bytes(self.points.first()), bytes(self.points.last())]
    }

    fn slope(&self) -> Slope {
        Slope::through(&self.points)
    }

    /// The figures in a sentence.
    pub(super) fn sentence(&self) -> String {
        let mib = |bytes: f64| bytes / f64::from(1 << 20);
        let [first, last] = self.ends();
        let Slope { slope, half } = self.slope();
        format!(
            "The heap of the page in Chromium: {:.2} MiB after the warm-up, {:.2} MiB at the end; {:+.3} MiB an hour, 95 % within {:.3}. \
             Its main thread was busy for {:.1} % of the time.",
            mib(first),
            mib(last),
            mib(slope * 3_600.0),
            mib(half * 3_600.0),
            100.0 * self.busy
        )
    }

    pub(super) fn to_json(&self) -> Value {
        let Slope { slope, half } = self.slope();
        json!({
            "heap_slope_bytes": { "per_hour": slope * 3_600.0, "confidence_95": half * 3_600.0 },
            "busy": self.busy,
            "heap": self.points.iter().map(|(at, bytes)| json!([at, bytes])).collect::<Vec<_>>(),
        })
    }
}

impl Browser {
    /// Opens the page of an instance; `python` has the package that drives Chromium.
    ///
    /// # Errors
    /// When the script cannot be started.
    pub(super) fn open(python: &Path, middleware: &Middleware, http: &str) -> anyhow::Result<Browser> {
        let script = middleware.folder.join("browser.py");
        std::fs::write(&script, SCRIPT).with_context(|| format!("cannot write {}", script.display()))?;
        let mut command = Command::new(python);
        command.arg(script).arg(http).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().with_context(|| format!("cannot start {}", python.display()))?;
        let output = child.stdout.take().context("no standard output")?;
        let rows = thread::spawn(move || {
            let lines = BufReader::new(output).lines().map_while(Result::ok);
            lines.filter_map(|line| serde_json::from_str(&line).ok()).collect()
        });
        Ok(Browser { input: child.stdin.take(), child, rows: Some(rows) })
    }

    /// Closes it; returns the memory of the page.
    ///
    /// # Errors
    /// When the page was not open for a minute.
    pub(super) fn close(mut self) -> anyhow::Result<PageMemory> {
        drop(self.input.take());
        let rows = self.rows.take().and_then(|rows| rows.join().ok()).unwrap_or_default();
        anyhow::ensure!(rows.len() > 4, "the browser told the memory of the page {} times", rows.len());
        Ok(PageMemory::of(&rows))
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        drop(self.input.take());
        let _ = self.child.wait();
    }
}
