//! How the engine is set.

use crate::diagnosis::JudgeOptions;
use crate::monitor;
use crate::residual_selection::WatchBudget;

/// Settings of the engine; the defaults are sound.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// What makes a conflict, and how many bad readings of a signal make a fault.
    pub monitor: monitor::Options,
    /// When a signal is trusted again.
    pub judge: JudgeOptions,
    /// How many ways of knowing are compared.
    pub watch: WatchBudget,
    /// What decides between sources of the same utility.
    pub ties: Ties,
}

/// What decides between sources of the same utility when one has to be chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ties {
    /// How they have run; what is not known stands between the proven right and the proven wrong.
    #[default]
    Proven,
    /// The order of the search: fewer relations, then the order of the file.
    Order,
}
