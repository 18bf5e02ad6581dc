//! Notices that the wall clock was set back.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// A smaller step is outlasted.
const STEP: Duration = Duration::from_millis(100);

/// Compares the wall clock with one that runs evenly.
#[derive(Debug)]
pub(super) struct Steps {
    origin: Instant,
    /// The furthest lead of the wall clock over the other one.
    lead: Duration,
}

impl Steps {
    pub(super) fn new() -> Steps {
        let origin = Instant::now();
        Steps { origin, lead: lead_at(wall(), origin.elapsed()) }
    }

    /// Whether the wall clock was set back, until this is [forgotten](Steps::forget).
    pub(super) fn is_back(&mut self) -> bool {
        self.see(wall(), self.origin.elapsed())
    }

    /// Begins anew.
    pub(super) fn forget(&mut self) {
        self.lead = lead_at(wall(), self.origin.elapsed());
    }

    fn see(&mut self, wall: Duration, even: Duration) -> bool {
        let lead = lead_at(wall, even);
        self.lead = self.lead.max(lead);
        self.lead.saturating_sub(lead) > STEP
    }
}

fn lead_at(wall: Duration, even: Duration) -> Duration {
    wall.saturating_sub(even)
}

fn wall() -> Duration {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_step_back_counts() {
        let at = Duration::from_millis;
        let mut steps = Steps { origin: Instant::now(), lead: at(1_000_000) };
        for (wall, even, expected) in [
            (1_000_010, 10, false),
            (1_000_000, 90, false),
            (1_500_000, 100, false),
            (1_500_020, 200, false),
            (1_400_000, 300, true),
            (1_499_000, 400, true),
            (1_501_000, 1_050, false),
        ] {
            assert_eq!(steps.see(at(wall), at(even)), expected, "{wall} {even}");
        }
    }
}
