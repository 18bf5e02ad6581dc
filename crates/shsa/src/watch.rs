//! The budget of monitoring: arguments of several commands.

use crate::headings::WATCHING;
use shsa_core::engine::WatchBudget;

/// How many ways of knowing are compared at the most.
#[derive(clap::Args)]
pub(crate) struct Watching {
    /// How many ways of knowing each variable are compared: among more, those that isolate most faults [default: 32].
    #[arg(long, value_name = "N", value_parser = two_or_more, help_heading = WATCHING)]
    watch: Option<usize>,
    /// Operations a second that watching may cost, by the declared rates [default: 10000000].
    #[arg(long, value_name = "N", help_heading = WATCHING)]
    watch_cost: Option<u64>,
}

impl Watching {
    pub(crate) fn budget(&self) -> WatchBudget {
        let usual = WatchBudget::default();
        WatchBudget { ways: self.watch.unwrap_or(usual.ways), cost: self.watch_cost.unwrap_or(usual.cost) }
    }
}

/// At least two ways are needed for a comparison.
fn two_or_more(text: &str) -> Result<usize, String> {
    let ways = text.trim().parse().ok().filter(|&ways| ways >= 2);
    ways.ok_or_else(|| "expected a whole number from 2 on: one way alone is compared with nothing".to_owned())
}
