//! Runtime assurance: which guarantees can be given now, at which level, and why not more.
//!
//! Services carry **conditional safety certificates**: guarantees, each on a condition over **demands** of others and
//! **evidence** of the service's own. Certificates are composed over the actual flow of information (horizontally) and over the
//! platforms (vertically). The guarantees that hold are the least fixed point: no guarantee rests on itself, and unknown evidence
//! satisfies nothing. For a guarantee that does not hold, [`Verdict`] gives the kind of the reason, and minimal sets name the
//! leaves that would have to change.
//!
//! Schneider and Trapp 2013, doi:10.1145/2491465.2491467; multidirectional: Amorim et al. 2015, doi:10.1007/978-3-319-24249-1_31
//! and 2018, doi:10.4018/978-1-5225-2845-6.ch006. Scope: systems that are known as a whole in one process. The author of a
//! certificate writes its levels; nothing in this module raises a level.

mod certificate;
mod circuit;
mod fixed_point;
mod minimal;
mod evaluation;
mod reading;
mod composition;
mod assured;
mod assessments;
mod search;

pub use assessments::{Assessments, Override, Refused};
pub use assured::{Admitted, Assured, Ground};
pub use certificate::{
    Certificates, Demand, DemandId, Evidence, EvidenceId, Guarantee, GuaranteeId, MAX_DEPTH, Problem,
    Quantifier, Service, ServiceId, ServiceKind, Tree,
};
pub use composition::{Assessment, Assurance, Bounds, Composition, Lacking};
pub use evaluation::{Evaluation, Higher, Leaf, System, Verdict};
pub use minimal::Sets;
pub use reading::{Read, Reading};
pub use search::Search;
