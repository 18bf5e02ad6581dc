//! What has to agree to a substitution beside the requirements: contracts, say, whose answer depends on the evidence of now.

use crate::substitution::{Step, Substitution};
use core::fmt::Debug;

/// Decides which substitutions are answers. The same question has the same answer as long as a search lasts.
pub trait Admission: Debug + Sync {
    /// Whether something that takes these steps, which are in their order of computation, may be admitted: it must not deny
    /// it where a substitution with these steps and perhaps more is admitted. A search leaves out all that follows from steps
    /// that may not, so the sharper this is, the shorter it takes.
    fn may_admit(&self, steps: &[Step]) -> bool;

    /// Whether a substitution is admitted.
    fn admits(&self, substitution: &Substitution) -> bool;
}
