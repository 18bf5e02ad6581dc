//! A claim of an assurance case: a guarantee of composed certificates, as it stands.

use shsa_core::assurance::{Evaluation, EvidenceId, GuaranteeId, System};
use shsa_format::case::Argument;

/// A guarantee for which a case is made.
pub(super) struct Claim<'a> {
    /// What it is for: a need, or a guarantee of a certificate.
    pub(super) name: String,
    /// Of what and of when it is.
    pub(super) brief: String,
    pub(super) system: &'a System,
    pub(super) evaluation: Evaluation,
    pub(super) root: GuaranteeId,
    /// Each piece of evidence in words.
    pub(super) observed: Vec<String>,
}

impl Claim<'_> {
    pub(super) fn argument(&self) -> Argument {
        let observed = |id: EvidenceId| {
            self.observed.get(shsa_core::knowledge::Id::index(id)).cloned().unwrap_or_default()
        };
        Argument::new(self.system, &self.evaluation, self.root, &observed)
    }

    /// Its name as a file may have it.
    pub(super) fn file_name(&self) -> String {
        let letters = self.name.trim_matches('/').chars();
        letters.map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
    }
}
