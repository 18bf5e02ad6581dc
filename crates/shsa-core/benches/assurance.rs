//! What a change of one piece of evidence costs in a system of 1,000 certificates.
#![allow(clippy::expect_used, missing_docs, reason = "benchmarks may fail loudly")]

use core::hint::black_box;
use criterion::{Criterion, criterion_group, criterion_main};
use shsa_core::assurance::{
    Certificates, Demand, Evaluation, Evidence, EvidenceId, Guarantee, Quantifier, Service, ServiceId,
    ServiceKind, System, Tree,
};
use shsa_core::interval::Truth;
use shsa_core::knowledge::Id;
use shsa_core::statement::Statement;

const COUNT: usize = 1_000;

/// Services with one piece of evidence each. A service also demands the guarantees of those that `asks` names, which come
/// before it.
fn system(asks: impl Fn(usize) -> Vec<usize>) -> System {
    let mut rows = Certificates::default();
    for at in 0..COUNT {
        rows.services.push(Service { name: format!("s{at}"), kind: ServiceKind::Application });
    }
    let says = || Statement { service: "t".into(), level: None, properties: vec![] };
    for at in 0..COUNT {
        let service = ServiceId::from_index(at);
        let evidence = Evidence { name: "e".into(), service, within: None, max_age: None };
        let mut parts = vec![Tree::Evidence(rows.evidence.push(evidence))];
        parts.extend(asks(at).into_iter().map(|other| {
            let of = vec![ServiceId::from_index(other)];
            let demand =
                Demand { name: "d".into(), service, statement: says(), of, quantifier: Quantifier::Any };
            Tree::Demand(rows.demands.push(demand))
        }));
        let when = Tree::All(parts);
        rows.guarantees.push(Guarantee { name: "g".into(), service, statement: says(), when });
    }
    System::new(rows).expect("all that is named is there")
}

/// All evidence holds; then that of one service fails and holds again, in turn.
fn toggle(c: &mut Criterion, name: &str, system: &System, at: usize) {
    let mut evaluation = Evaluation::new(system);
    for each in 0..COUNT {
        evaluation.set(system, EvidenceId::from_index(each), Truth::True);
    }
    let mut holds = true;
    c.bench_function(name, |b| {
        b.iter(|| {
            holds = !holds;
            let truth = if holds { Truth::True } else { Truth::False };
            evaluation.set(black_box(system), EvidenceId::from_index(at), truth);
        });
    });
}

fn changes(c: &mut Criterion) {
    // A platform below nine controllers, each below ten services, and so on: each service rests on the one a tenth of its number.
    let tree = system(|at| if at == 0 { vec![] } else { vec![at / 10] });
    toggle(c, "1,000 certificates in a tree, a leaf", &tree, COUNT - 1);
    toggle(c, "1,000 certificates in a tree, a branch with 110 others", &tree, 9);
    toggle(c, "1,000 certificates in a tree, all rest on it", &tree, 0);
    let chain = system(|at| at.checked_sub(1).into_iter().collect());
    toggle(c, "1,000 certificates in a chain, all rest on it", &chain, 0);
}

criterion_group!(benches, changes);
criterion_main!(benches);
