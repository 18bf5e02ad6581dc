//! A change of evidence is followed without allocating.

use crate::plan_support::Random;
use shsa_core::assurance::{
    Certificates, Demand, Evaluation, Evidence, EvidenceId, Guarantee, Quantifier, Service, ServiceId,
    ServiceKind, System, Tree,
};
use shsa_core::interval::{Interval, Truth};
use shsa_core::knowledge::Id;
use shsa_core::statement::Statement;
use shsa_core::time::{Span, Time};

/// Services in a ring of which each asks its neighbour, and some evidence of its own.
fn ring(count: usize) -> System {
    let mut rows = Certificates::default();
    for at in 0..count {
        rows.services.push(Service { name: format!("s{at}"), kind: ServiceKind::Application });
    }
    let says = || Statement { service: "t".into(), level: None, properties: vec![] };
    for at in 0..count {
        let service = ServiceId::from_index(at);
        let (within, max_age) = (Some(Interval::new(0.0, 1.0)), Some(Span::from_millis(10)));
        let evidence = rows.evidence.push(Evidence { name: "e".into(), service, within, max_age });
        let of = vec![ServiceId::from_index((at + 1) % count)];
        let demand = Demand { name: "d".into(), service, statement: says(), of, quantifier: Quantifier::Any };
        let parts = vec![Tree::Evidence(evidence), Tree::Demand(rows.demands.push(demand))];
        rows.guarantees.push(Guarantee {
            name: "g".into(),
            service,
            statement: says(),
            when: Tree::Any(parts),
        });
    }
    System::new(rows).unwrap()
}

#[test]
fn a_change_of_evidence_allocates_nothing() {
    let system = ring(100);
    let mut evaluation = Evaluation::new(&system);
    let mut random = Random(1);
    let counted = allocation_counter::measure(|| {
        for at in 0..1000 {
            let evidence = EvidenceId::from_index(random.below(100));
            evaluation.set(&system, evidence, if random.chance(0.5) { Truth::True } else { Truth::False });
            let evidence = EvidenceId::from_index(random.below(100));
            evaluation.observe(&system, evidence, Interval::point(random.share()), Time(at * 1_000_000));
            evaluation.pass(&system, Time(at * 1_000_000));
        }
    });
    assert_eq!(counted.count_total, 0);
}
