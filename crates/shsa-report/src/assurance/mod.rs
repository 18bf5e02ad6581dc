//! What contracts allow: who may serve each need, at which level, and why not at a higher one; and the assurance case of it.

mod moment;
mod claim;
mod model;
mod certificates;
mod text;
mod json;
mod page;

pub use certificates::CertificateReport;
pub use claim::{Claim, modules};
pub use model::ModelReport;
pub use moment::WrittenMoment;
