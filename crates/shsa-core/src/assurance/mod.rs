//! Runtime assurance: which guarantees can be given now, at which level, and why not more.
//!
//! Services carry **conditional safety certificates**: what they guarantee, on which condition over **demands** of others and
//! **evidence** of their own. Composed over the actual flow of information (horizontally) and over what they run on
//! (vertically), certificates say what holds now. What holds is the least fixed point: no guarantee rests on itself, and what
//! is unknown satisfies nothing. What does not hold is told apart ([`Verdict`]), with the minimal sets of leaves that would
//! have to change.
//!
//! Schneider and Trapp 2013, doi:10.1145/2491465.2491467; multidirectional: Amorim et al. 2015,
//! doi:10.1007/978-3-319-24249-1_31 and 2018, doi:10.4018/978-1-5225-2845-6.ch006. Scope: systems that are known as a whole
//! in one process. A certificate's author writes its levels; nothing here raises one.

mod certificate;
mod circuit;
mod fixed_point;
mod minimal;
mod evaluation;
mod composition;
mod assured;
mod assessments;
mod search;

pub use assessments::{Assessments, Override, Read, Reading, Refused, Trust};
pub use assured::{Admitted, Assured, Ground};
pub use certificate::{
    Certificates, Demand, DemandId, Evidence, EvidenceId, Guarantee, GuaranteeId, MAX_DEPTH, Problem,
    Quantifier, Service, ServiceId, ServiceKind, Tree,
};
pub use composition::{Assessment, Assurance, Composition, Lacking};
pub use evaluation::{Evaluation, Higher, Leaf, System, Verdict};
pub use minimal::Sets;
pub use search::Search;
