//! A claim of an assurance case: a guarantee of composed certificates, with its evaluation.

use shsa_core::assurance::{Evaluation, EvidenceId, GuaranteeId, System};
use shsa_format::case::Argument;

/// A guarantee for which a case is made.
pub(super) struct Claim<'a> {
    /// The name of the need or of the certificate's guarantee.
    pub(super) name: String,
    /// The files and the moment of the claim.
    pub(super) brief: String,
    pub(super) system: &'a System,
    pub(super) evaluation: Evaluation,
    pub(super) root: GuaranteeId,
    /// Descriptions of the pieces of evidence.
    pub(super) observed: Vec<String>,
}

impl Claim<'_> {
    pub(super) fn argument(&self) -> Argument {
        let observed = |id: EvidenceId| {
            self.observed.get(shsa_core::knowledge::Id::index(id)).cloned().unwrap_or_default()
        };
        Argument::new(self.system, &self.evaluation, self.root, &observed)
    }

    /// The name as part of a file name.
    pub(super) fn file_name(&self) -> String {
        let letters = self.name.trim_matches('/').chars();
        letters.map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
    }
}
