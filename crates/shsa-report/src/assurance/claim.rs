//! A claim of an assurance case: a guarantee of composed certificates, with its evaluation.

use shsa_core::assurance::{Evaluation, EvidenceId, GuaranteeId, System};
use shsa_format::case::{Argument, gsn};
use shsa_format::conserts::prolog;

/// A guarantee for which a case is made.
pub struct Claim<'a> {
    /// The name of the need or of the certificate's guarantee.
    pub name: String,
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

    /// The certificates and the evidence as facts and rules of SWI-Prolog.
    #[must_use]
    pub fn prolog(&self) -> String {
        prolog::write(self.system, &self.evaluation)
    }
}

/// A name for the module and file of each claim, none twice.
#[must_use]
pub fn modules(claims: &[Claim<'_>]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for claim in claims {
        let name = gsn::identifier(&claim.name);
        let numbered = (2..).map(|number| format!("{name}_{number}"));
        let free = std::iter::once(name.clone()).chain(numbered).find(|it| !names.contains(it));
        names.extend(free);
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_core::assurance::Certificates;
    use shsa_core::knowledge::Id;

    #[test]
    fn no_two_claims_share_a_module() {
        let system = System::new(Certificates::default()).unwrap();
        let claim = |name: &str| Claim {
            name: name.to_owned(),
            brief: String::new(),
            system: &system,
            evaluation: Evaluation::new(&system),
            root: GuaranteeId::from_index(0),
            observed: Vec::new(),
        };
        assert_eq!(modules(&["/a/b", "a_b", "a b", "c"].map(claim)), ["a_b", "a_b_2", "a_b_3", "c"]);
    }
}
