//! The certificates of `shsa-assurance-golden-1`: the form of a file, and its conversion to our certificates.

use anyhow::Context;
use serde::Deserialize;
use serde_json::Value;
use shsa_core::assurance::{
    Certificates, Demand, DemandId, Evidence, EvidenceId, Guarantee, Quantifier, Service, ServiceId,
    ServiceKind, Tree,
};
use shsa_core::interval::Interval;
use shsa_core::statement::{Content, Inclusion, Property, Scales, Statement};
use shsa_core::unit::Dimension;
use std::collections::BTreeMap;

/// A file.
#[derive(Deserialize)]
pub(super) struct Recorded {
    pub(super) scales: BTreeMap<String, Vec<String>>,
    pub(super) units: BTreeMap<String, UnitFacts>,
    pub(super) examples: Vec<Case>,
    pub(super) cases: Vec<Case>,
}

#[derive(Deserialize)]
pub(super) struct UnitFacts {
    pub(super) dimension: String,
    pub(super) factor: f64,
}

#[derive(Deserialize)]
pub(super) struct Case {
    pub(super) id: String,
    pub(super) services: Vec<ServiceFacts>,
    pub(super) expected: Value,
    #[serde(default)]
    pub(super) steps: Vec<Step>,
}

#[derive(Deserialize)]
pub(super) struct ServiceFacts {
    pub(super) name: String,
    pub(super) kind: String,
    pub(super) guarantees: Vec<GuaranteeFacts>,
    pub(super) demands: Vec<DemandFacts>,
    pub(super) evidence: Vec<EvidenceFacts>,
}

#[derive(Deserialize)]
pub(super) struct GuaranteeFacts {
    pub(super) id: String,
    pub(super) when: TreeFacts,
    #[serde(flatten)]
    pub(super) statement: StatementFacts,
}

#[derive(Deserialize)]
pub(super) struct DemandFacts {
    pub(super) id: String,
    pub(super) of: Vec<String>,
    pub(super) quantifier: String,
    #[serde(flatten)]
    pub(super) statement: StatementFacts,
}

#[derive(Deserialize)]
pub(super) struct StatementFacts {
    #[serde(rename = "type")]
    pub(super) service: String,
    pub(super) level: Option<(String, String)>,
    pub(super) properties: Vec<PropertyFacts>,
}

#[derive(Deserialize)]
pub(super) struct PropertyFacts {
    pub(super) name: String,
    pub(super) kind: String,
    pub(super) inclusion: Option<String>,
    pub(super) unit: Option<String>,
    #[serde(default)]
    pub(super) ranges: Vec<Bounds>,
    #[serde(default)]
    pub(super) covered: Vec<String>,
}

/// From, to; `null` is no bound.
pub(super) type Bounds = (Option<f64>, Option<f64>);

#[derive(Deserialize)]
#[serde(untagged)]
pub(super) enum TreeFacts {
    All { all: Vec<TreeFacts> },
    Any { any: Vec<TreeFacts> },
    AtLeast { at_least: u32, of: Vec<TreeFacts> },
    Demand { demand: String },
    Evidence { evidence: String },
}

#[derive(Deserialize)]
pub(super) struct EvidenceFacts {
    pub(super) id: String,
    #[serde(default)]
    pub(super) value: Option<bool>,
    pub(super) range: Option<Bounds>,
    #[serde(default)]
    pub(super) measured: Option<Bounds>,
    pub(super) unit: Option<String>,
}

#[derive(Deserialize)]
pub(super) struct Step {
    pub(super) set: BTreeMap<String, Value>,
    pub(super) holds: Vec<String>,
    pub(super) met: Vec<String>,
}

pub(super) fn interval((lo, hi): Bounds, factor: f64) -> Interval {
    let bound = |bound: Option<f64>, none| bound.map_or(none, |bound| bound * factor);
    Interval::new(bound(lo, f64::NEG_INFINITY), bound(hi, f64::INFINITY))
}

impl Recorded {
    /// The dimension and the size of a unit. The file names a dimension; each name gets an exponent of its own of one base.
    pub(super) fn unit(&self, name: Option<&str>) -> anyhow::Result<(Dimension, f64)> {
        let name = name.unwrap_or_default();
        let unit = self.units.get(name).with_context(|| format!("no unit `{name}`"))?;
        let mut dimensions: Vec<&str> = self.units.values().map(|it| it.dimension.as_str()).collect();
        dimensions.sort_unstable();
        dimensions.dedup();
        let at = dimensions.iter().position(|it| *it == unit.dimension).unwrap_or_default();
        let at = i8::try_from(at).context("too many dimensions")?;
        Ok((Dimension::of([at, 0, 0, 0, 0, 0, 0, 0, 0]), unit.factor))
    }
}

/// The identifiers of a case's names.
#[derive(Default)]
struct Ids<'a> {
    services: BTreeMap<&'a str, ServiceId>,
    demands: BTreeMap<&'a str, DemandId>,
    evidence: BTreeMap<&'a str, EvidenceId>,
}

/// Converts the certificates of a case.
struct Reader<'a> {
    recorded: &'a Recorded,
    certificates: Certificates,
    ids: Ids<'a>,
}

/// The certificates of a case.
///
/// # Errors
/// When the case uses a name that it does not define.
pub(super) fn certificates(recorded: &Recorded, case: &Case) -> anyhow::Result<Certificates> {
    let mut reader = Reader { recorded, certificates: Certificates::default(), ids: Ids::default() };
    reader.certificates.scales = Scales::new();
    for (name, levels) in &recorded.scales {
        reader.certificates.scales.add(name, levels.clone());
    }
    reader.read(case)?;
    Ok(reader.certificates)
}

impl<'a> Reader<'a> {
    fn read(&mut self, case: &'a Case) -> anyhow::Result<()> {
        for facts in &case.services {
            let kind =
                if facts.kind == "platform" { ServiceKind::Platform } else { ServiceKind::Application };
            let id = self.certificates.services.push(Service { name: facts.name.clone(), kind });
            self.ids.services.insert(&facts.name, id);
        }
        for service in &case.services {
            let owner = self.service(&service.name)?;
            for facts in &service.evidence {
                self.evidence(owner, facts)?;
            }
            for facts in &service.demands {
                self.demand(owner, facts)?;
            }
        }
        for service in &case.services {
            let owner = self.service(&service.name)?;
            for facts in &service.guarantees {
                let statement = self.statement(&facts.statement)?;
                let when = self.tree(&facts.when)?;
                let row = Guarantee { name: facts.id.clone(), service: owner, statement, when };
                self.certificates.guarantees.push(row);
            }
        }
        Ok(())
    }

    fn service(&self, name: &str) -> anyhow::Result<ServiceId> {
        self.ids.services.get(name).copied().with_context(|| format!("no service {name}"))
    }

    fn evidence(&mut self, owner: ServiceId, facts: &'a EvidenceFacts) -> anyhow::Result<()> {
        let (_, factor) = self.recorded.unit(facts.unit.as_deref())?;
        let within = facts.range.map(|bounds| interval(bounds, factor));
        let row = Evidence { name: facts.id.clone(), service: owner, within, max_age: None };
        self.ids.evidence.insert(&facts.id, self.certificates.evidence.push(row));
        Ok(())
    }

    fn demand(&mut self, owner: ServiceId, facts: &'a DemandFacts) -> anyhow::Result<()> {
        let of = facts.of.iter().map(|name| self.service(name)).collect::<anyhow::Result<_>>()?;
        let quantifier = match facts.quantifier.as_str() {
            "any" => Quantifier::Any,
            "all" => Quantifier::All,
            other => anyhow::bail!("no quantifier {other}"),
        };
        let statement = self.statement(&facts.statement)?;
        let row = Demand { name: facts.id.clone(), service: owner, statement, of, quantifier };
        self.ids.demands.insert(&facts.id, self.certificates.demands.push(row));
        Ok(())
    }

    fn statement(&self, facts: &StatementFacts) -> anyhow::Result<Statement> {
        let level = |(scale, level): &(String, String)| {
            self.certificates.scales.level(scale, level).with_context(|| format!("no level {scale} {level}"))
        };
        Ok(Statement {
            service: facts.service.clone(),
            level: facts.level.as_ref().map(level).transpose()?,
            properties: facts.properties.iter().map(|it| self.property(it)).collect::<anyhow::Result<_>>()?,
        })
    }

    fn property(&self, facts: &PropertyFacts) -> anyhow::Result<Property> {
        let inclusion = || match facts.inclusion.as_deref() {
            Some("guarantee_in_demand") => Ok(Inclusion::GuaranteeInDemand),
            Some("demand_in_guarantee") => Ok(Inclusion::DemandInGuarantee),
            other => Err(anyhow::anyhow!("no inclusion {other:?}")),
        };
        let content = match facts.kind.as_str() {
            "binary" => Content::Binary,
            "categorical" => {
                let covered = facts.covered.iter().cloned().collect();
                Content::Categorical { covered, inclusion: inclusion()? }
            }
            "numeric" => {
                let (dimension, factor) = self.recorded.unit(facts.unit.as_deref())?;
                let ranges = facts.ranges.iter().map(|&bounds| interval(bounds, factor)).collect();
                Content::Numeric { ranges, dimension, inclusion: inclusion()? }
            }
            other => anyhow::bail!("no kind {other}"),
        };
        Ok(Property { name: facts.name.clone(), mode: None, content })
    }

    fn tree(&self, facts: &TreeFacts) -> anyhow::Result<Tree> {
        let all =
            |parts: &[TreeFacts]| parts.iter().map(|part| self.tree(part)).collect::<anyhow::Result<_>>();
        Ok(match facts {
            TreeFacts::All { all: parts } => Tree::All(all(parts)?),
            TreeFacts::Any { any: parts } => Tree::Any(all(parts)?),
            TreeFacts::AtLeast { at_least, of } => Tree::AtLeast(*at_least, all(of)?),
            TreeFacts::Demand { demand: name } => Tree::Demand(
                *self.ids.demands.get(name.as_str()).with_context(|| format!("no demand {name}"))?,
            ),
            TreeFacts::Evidence { evidence: name } => Tree::Evidence(
                *self.ids.evidence.get(name.as_str()).with_context(|| format!("no evidence {name}"))?,
            ),
        })
    }
}
