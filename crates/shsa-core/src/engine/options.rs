//! The settings of the engine.

use crate::diagnosis::JudgeOptions;
use crate::monitor;
use crate::residual_selection::WatchBudget;

/// Settings of the engine; the defaults are safe.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// What makes a conflict, and how many bad readings of a signal make a fault.
    pub monitor: monitor::Options,
    /// When a signal is trusted again.
    pub judge: JudgeOptions,
    /// How many ways of knowing are compared.
    pub watch: WatchBudget,
    /// How sources of the same utility are ranked.
    pub ties: Ties,
}

/// How sources of the same utility are ranked when one has to be chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ties {
    /// By their record of agreement and availability; unknown ranks between proven right and proven wrong.
    #[default]
    Proven,
    /// By the order of the search: fewer relations, then the order of the file.
    Order,
}
