//! What was last told of how a need is served, so that each change is told once.

use crate::time::{Span, Time};

/// What was told last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Standing {
    /// That it is served; so it begins.
    Served,
    /// That it is not served.
    Unserved {
        /// It was not served again for long: that it is served is told when it lasts.
        is_wary: bool,
    },
}

/// What is to be told of a value that goes out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum News {
    /// The need was not served, and is now.
    ServedAgain,
    /// What went out was uncertain, and is trusted now.
    TrustedAgain,
}

/// What was told of a need, and since when it is served.
#[derive(Clone, Copy, Debug)]
pub(super) struct Told {
    standing: Standing,
    /// Whether it was told that values go out as uncertain.
    is_uncertain: bool,
    /// When it was told last that it is served again, and since when it is without a break.
    served_again: Option<Time>,
    steady_since: Option<Time>,
}

impl Told {
    /// Nothing yet.
    pub(super) const NOTHING: Told =
        Told { standing: Standing::Served, is_uncertain: false, served_again: None, steady_since: None };

    pub(super) fn is_unserved(&self) -> bool {
        self.standing != Standing::Served
    }

    pub(super) fn is_uncertain(&self) -> bool {
        self.is_uncertain
    }

    /// What was told before a restart.
    pub(super) fn recall(&mut self, unserved: bool) {
        self.standing = if unserved { Standing::Unserved { is_wary: false } } else { Standing::Served };
    }

    /// It is told that the need is not served. Who is served again and again for a moment only is told so when it lasts:
    /// for the probation.
    pub(super) fn lose(&mut self, probation: Span, now: Time) {
        let is_wary = self.served_again.is_some_and(|at| now - at < probation);
        self.standing = Standing::Unserved { is_wary };
        self.is_uncertain = false;
    }

    /// It is told that values go out as uncertain.
    pub(super) fn doubt(&mut self) {
        self.is_uncertain = true;
    }

    /// A value goes out: whether it is trusted, and whether it is the first after a break.
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
        let Standing::Unserved { is_wary } = self.standing else {
            return was_uncertain.then_some(News::TrustedAgain);
        };
        let lasts = self.steady_since.is_some_and(|since| now - since >= probation);
        if is_wary && !lasts {
            return None;
        }
        self.standing = Standing::Served;
        self.served_again = Some(now);
        Some(News::ServedAgain)
    }
}
