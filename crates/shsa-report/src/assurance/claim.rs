//! A claim of an assurance case: a guarantee of composed certificates, with its evaluation.

use shsa_core::assurance::{Evaluation, EvidenceId, GuaranteeId, System};
use shsa_drawing::case::Argument;
use shsa_drawing::case::gsn::{self, Listed};
use shsa_drawing::case::prolog;

/// A guarantee for which a case is made.
pub struct Claim<'a> {
    /// The name of the need or of the certificate's guarantee.
    pub name: String,
    /// The need or the service that claims it.
    pub(super) of: String,
    /// The files and the moment of the claim.
    pub(super) brief: String,
    pub(super) system: &'a System,
    pub(super) evaluation: Evaluation,
    pub(super) root: GuaranteeId,
    /// Descriptions of the pieces of evidence.
    pub(super) observed: Vec<String>,
}

impl Claim<'_> {
    /// The argument: claims that rest on claims of others and on evidence, with their verdicts.
    #[must_use]
    pub fn argument(&self) -> Argument {
        let observed = |id: EvidenceId| {
            self.observed.get(shsa_core::knowledge::Id::index(id)).cloned().unwrap_or_default()
        };
        Argument::new(self.system, &self.evaluation, self.root, &observed)
    }

    /// The argument in the YAML of `gsn2x` as a module of this name, with the verdicts of this one moment.
    #[must_use]
    pub fn gsn(&self, module: &str) -> String {
        gsn::write(&self.argument(), module, &self.brief, &[])
    }

    /// The certificates and the evidence as facts and rules of SWI-Prolog, from which `claim` follows where this claim holds.
    #[must_use]
    pub fn prolog(&self) -> String {
        prolog::write(self.system, &self.evaluation) + &prolog::claim(self.root, &self.name)
    }
}

/// A name for the module and file of each claim, none twice.
#[must_use]
pub fn modules(claims: &[Claim<'_>]) -> Vec<String> {
    gsn::modules(claims.iter().map(|claim| claim.name.as_str()))
}

/// The module of GSN over those of all claims; the claims of one need, or one service, follow each other and are alternatives.
pub(super) fn index(claims: &[Claim<'_>], brief: &str) -> String {
    let listed = claims.iter().zip(modules(claims)).map(|(claim, module)| Listed {
        of: claim.of.clone(),
        module,
        state: claim.evaluation.guarantee(claim.system, claim.root),
    });
    gsn::index(&listed.collect::<Vec<_>>(), brief)
}
