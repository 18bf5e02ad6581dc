//! Progress bars on standard error, where that is a terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use shsa_core::engine::Input;
use shsa_format::drive::{Era, Given};
use shsa_lab::campaign::Progress;
use std::io::{IsTerminal, stderr};
use std::sync::{Mutex, PoisonError};

/// The number of observations between two steps of a bar.
const STEP: u64 = 4_096;

/// A bar of `length` steps, hidden without a terminal.
pub(crate) fn bar(length: usize, template: &str) -> ProgressBar {
    let target =
        if stderr().is_terminal() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let style = ProgressStyle::with_template(template);
    let bar = ProgressBar::with_draw_target(Some(length as u64), target);
    bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// A bar over the observations of a run; it disappears when it is dropped.
pub(crate) struct Observations {
    bar: ProgressBar,
    seen: u64,
}

impl Observations {
    /// A bar for so many observations.
    pub(crate) fn new(length: usize) -> Observations {
        let bar = bar(length, "{bar:40} {percent:>3} %  {pos} of {len} observations  {eta} left");
        Observations { bar, seen: 0 }
    }

    /// A bar for the observations of all eras.
    pub(crate) fn of(eras: &[Era]) -> Observations {
        Observations::new(eras.iter().map(|era| era.inputs.len()).sum())
    }

    /// Counts an input.
    pub(crate) fn count(&mut self, given: &Given<'_>) {
        self.seen += u64::from(matches!(given, Given::Input(Input::Observation(_))));
        if self.seen.is_multiple_of(STEP) {
            self.bar.set_position(self.seen);
        }
    }
}

impl Drop for Observations {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// The bars of a search, one after the other.
#[derive(Default)]
pub(crate) struct Search(Mutex<Option<ProgressBar>>);

impl Search {
    fn with(&self, act: impl Fn(&ProgressBar)) {
        let bar = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        bar.iter().for_each(act);
    }
}

impl Progress for Search {
    fn begin(&self, count: usize, of_what: &str) {
        let template = format!("{{bar:40}} {{percent:>3}} %  {{pos}} of {{len}} {of_what}  {{eta}} left");
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(bar(count, &template));
    }

    fn step(&self) {
        self.with(|bar| bar.inc(1));
    }

    fn end(&self) {
        self.with(ProgressBar::finish_and_clear);
    }
}
