//! Conditional safety certificates in the forms of conserts-rs: YAML, one certificate a file, and the `.model` files (XMI) of safeTbox.
//!
//! Undefined names are reported with their place; those in the list of a service are warnings. The order of the files does not matter: every demand is asked of all other
//! services. A guarantee meets a demand of its own type of service with properties of the same names; conserts-rs compares
//! quantities only.

mod statement;
mod raw;
mod yaml;
mod xml;
mod xmi;

use raw::Raw;
use shsa_core::assurance::{Certificates, DemandId, EvidenceId, ServiceId, Tree};
use shsa_core::knowledge::Id;
use shsa_model::Report;
use shsa_model::reader::Reader;
use std::collections::BTreeSet;

/// The largest file in bytes.
const MAX_BYTES: usize = 16 << 20;

/// The certificates of a file, as far as the file is valid; the demands have no services to ask yet.
///
/// A text in XML is read as `.model`, any other as YAML. `name` names the file in the report, and the service of a YAML file.
/// Never fails: the report holds the problems. Time: linear in the text and in the conditions, which are bounded.
#[must_use]
pub fn read(text: &str, name: &str) -> (Certificates, Report) {
    let mut reader = Reader::default();
    if text.len() > MAX_BYTES {
        let message = format!("a file of {} bytes, more than {MAX_BYTES}", text.len());
        return (Certificates::default(), Report::whole(name, message, "is this a certificate?"));
    }
    let (raw, rewritten): (Vec<Raw>, BTreeSet<u32>) = match text.trim_start().starts_with('<') {
        true => (xmi::read(&mut reader, text), BTreeSet::new()),
        false => yaml::read(&mut reader, text, name),
    };
    let read = raw.into_iter().map(|raw| raw.certificates(&mut reader)).collect();
    (joined(read), Report::locate(name, text, reader.problems, &rewritten))
}

/// Certificates of several files as one system: each demand is asked of all other services.
#[must_use]
pub fn compose(files: Vec<Certificates>) -> Certificates {
    let mut all = joined(files);
    let services: Vec<ServiceId> = all.services.ids().collect();
    for demand in all.demands.iter_mut() {
        demand.of = services.iter().copied().filter(|&service| service != demand.service).collect();
    }
    all
}

/// The rows of several files, one after the other.
fn joined(files: Vec<Certificates>) -> Certificates {
    let mut all = Certificates::default();
    for file in files {
        let (services, demands, evidence) = (all.services.len(), all.demands.len(), all.evidence.len());
        let moved = |service: ServiceId| ServiceId::from_index(services + service.index());
        file.services.into_iter().for_each(|row| _ = all.services.push(row));
        for mut row in file.evidence {
            row.service = moved(row.service);
            all.evidence.push(row);
        }
        for mut row in file.demands {
            row.service = moved(row.service);
            row.of.iter_mut().for_each(|service| *service = moved(*service));
            all.demands.push(row);
        }
        for mut row in file.guarantees {
            row.service = moved(row.service);
            move_leaves(&mut row.when, demands, evidence);
            all.guarantees.push(row);
        }
    }
    all
}

fn move_leaves(tree: &mut Tree, demands: usize, evidence: usize) {
    match tree {
        Tree::All(parts) | Tree::Any(parts) | Tree::AtLeast(_, parts) => {
            parts.iter_mut().for_each(|part| move_leaves(part, demands, evidence));
        }
        Tree::Demand(id) => *id = DemandId::from_index(demands + id.index()),
        Tree::Evidence(id) => *id = EvidenceId::from_index(evidence + id.index()),
    }
}

#[cfg(test)]
mod tests;
