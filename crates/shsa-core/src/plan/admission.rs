//! A check of substitutions beside the requirements, such as contracts, whose answer depends on the present evidence.

use crate::substitution::{Step, Substitution};
use core::fmt::Debug;

/// Decides which substitutions are answers. An answer must stay the same for as long as a search lasts.
pub trait Admission: Debug + Sync {
    /// Whether a substitution with these steps (in their order of computation) and perhaps more may be admitted; must be true
    /// where one of them is admitted. A search prunes everything that follows from other steps, so sharper answers make it
    /// faster.
    fn may_admit(&self, steps: &[Step]) -> bool;

    /// Whether [`Admission::may_admit`] ever says no.
    fn prunes(&self) -> bool {
        true
    }

    /// Whether a substitution is admitted.
    fn admits(&self, substitution: &Substitution) -> bool;
}
