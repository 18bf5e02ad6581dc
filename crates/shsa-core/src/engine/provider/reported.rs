//! What events have last reported about a need, so that each change is reported once.

use crate::time::{Span, Time};

/// The last reported state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Service {
    /// The need is served; this is the initial state.
    Served,
    /// The need is not served.
    Unserved {
        /// The last service was shorter than the probation: the next one is reported when it has lasted that long.
        is_wary: bool,
    },
}

/// A change to report with a published value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum News {
    /// The need was not served, and is served now.
    ServedAgain,
    /// Values were uncertain, and are trusted now.
    TrustedAgain,
}

/// What events have reported about a need, and since when it is served.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reported {
    service: Service,
    /// Whether an event has reported that values are uncertain.
    is_uncertain: bool,
    /// When an event last reported that the need is served again, and since when it is served without a break.
    served_again: Option<Time>,
    steady_since: Option<Time>,
}

impl Reported {
    /// Nothing has been reported.
    pub(super) const NOTHING: Reported =
        Reported { service: Service::Served, is_uncertain: false, served_again: None, steady_since: None };

    pub(super) fn is_unserved(&self) -> bool {
        self.service != Service::Served
    }

    pub(super) fn is_uncertain(&self) -> bool {
        self.is_uncertain
    }

    /// Sets what was reported before a restart.
    pub(super) fn recall(&mut self, unserved: bool) {
        self.service = if unserved { Service::Unserved { is_wary: false } } else { Service::Served };
    }

    /// Notes an event that the need is not served. If the need is then served for moments only, the service is reported after the
    /// probation.
    pub(super) fn lose(&mut self, probation: Span, now: Time) {
        let is_wary = self.served_again.is_some_and(|at| now - at < probation);
        self.service = Service::Unserved { is_wary };
        self.is_uncertain = false;
    }

    /// Notes an event that values are uncertain.
    pub(super) fn doubt(&mut self) {
        self.is_uncertain = true;
    }

    /// Notes a published value: whether it is trusted, and whether it is the first after a break. Returns the change to report.
    pub(super) fn serve(
        &mut self,
        is_certain: bool,
        is_break: bool,
        probation: Span,
        now: Time,
    ) -> Option<News> {
        let was_uncertain = is_certain && core::mem::take(&mut self.is_uncertain);
        if is_break || self.steady_since.is_none() {
            self.steady_since = Some(now);
        }
        let Service::Unserved { is_wary } = self.service else {
            return was_uncertain.then_some(News::TrustedAgain);
        };
        let lasts = self.steady_since.is_some_and(|since| now - since >= probation);
        if is_wary && !lasts {
            return None;
        }
        self.service = Service::Served;
        self.served_again = Some(now);
        Some(News::ServedAgain)
    }
}
