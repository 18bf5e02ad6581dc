//! Evaluation of certificates beside one that knows only the definition: sets of what holds, grown until nothing changes, and
//! every choice of evidence tried.

mod drawn;
mod composition;
mod search;
mod definition;

use crate::plan_support::Random;
use crate::seeds::seeds;
use definition::{Plain, PlainDemand, PlainGuarantee, PlainTree, Says, collect, ordered, smallest, with};
use shsa_core::assurance::{
    Certificates, Demand, DemandId, Evaluation, Evidence, EvidenceId, Guarantee, GuaranteeId, Leaf,
    Quantifier, Service, ServiceId, ServiceKind, Sets, System, Tree, Verdict,
};
use shsa_core::interval::{Interval, Truth};
use shsa_core::knowledge::Id;
use shsa_core::statement::{Content, Inclusion, Level, Property, Scales, Statement};
use shsa_core::time::{Span, Time};
use shsa_core::unit::Dimension;
use std::collections::BTreeSet;

/// More than any of these systems asks for.
const MOST: usize = 100_000;

fn random_system(random: &mut Random) -> (Plain, Vec<usize>, Vec<usize>) {
    let services = 2 + random.below(4);
    let says = |random: &mut Random| Says {
        kind: random.below(2),
        level: random.chance(0.8).then(|| (random.below(8) / 7, random.below(4) as u32)),
        at_most: random.chance(0.4).then(|| 1 + random.below(3) as u32),
        at_least: random.chance(0.3).then(|| 1 + random.below(3) as u32),
    };
    let weaker = |says: &Says, random: &mut Random| Says {
        level: says.level.map(|(scale, rank)| (scale, rank.saturating_sub(random.below(2) as u32))),
        at_most: says.at_most.filter(|_| random.chance(0.5)).map(|it| it + random.below(2) as u32),
        at_least: says.at_least.filter(|_| random.chance(0.5)),
        kind: says.kind,
    };
    let evidence: Vec<usize> = (0..1 + random.below(8)).map(|_| random.below(services)).collect();
    let given: Vec<(usize, Says)> =
        (0..services + random.below(8)).map(|_| (random.below(services), says(random))).collect();
    let mut demands = Vec::new();
    let mut asking = Vec::new();
    for _ in 0..random.below(9) {
        let (by, wanted) = &given[random.below(given.len())];
        let mut of: Vec<usize> = (0..random.below(3)).map(|_| random.below(services)).collect();
        of.push(*by);
        of.dedup();
        if random.chance(0.05) {
            of.clear();
        }
        demands.push(PlainDemand { says: weaker(wanted, random), of, all: random.chance(0.25) });
        asking.push(random.below(services));
    }
    let guarantees = given
        .into_iter()
        .map(|(service, says)| {
            let of =
                |owners: &[usize]| (0..owners.len()).filter(|&at| owners[at] == service).collect::<Vec<_>>();
            let leaves: Vec<PlainTree> = of(&asking)
                .into_iter()
                .map(PlainTree::Demand)
                .chain(of(&evidence).into_iter().map(PlainTree::Evidence))
                .collect();
            PlainGuarantee { service, says, when: random_tree(random, &leaves, 2) }
        })
        .collect();
    (Plain { guarantees, demands, evidence: evidence.len() }, evidence, asking)
}

fn random_tree(random: &mut Random, leaves: &[PlainTree], depth: usize) -> PlainTree {
    if !leaves.is_empty() && (depth == 0 || random.chance(0.4)) {
        return leaves[random.below(leaves.len())].clone();
    }
    let most = if leaves.is_empty() || depth == 0 { 1 } else { 4 };
    let parts: Vec<PlainTree> =
        (0..random.below(most)).map(|_| random_tree(random, leaves, depth - 1)).collect();
    let needed = [parts.len(), 1, random.below(parts.len() + 2)][random.below(3)];
    PlainTree::AtLeast(needed, parts)
}

/// The same system in the core's words.
fn composed(plain: &Plain, evidence: &[usize], asking: &[usize]) -> System {
    let mut rows = Certificates { scales: Scales::standard(), ..Certificates::default() };
    let service = ServiceId::from_index;
    let last = plain
        .guarantees
        .iter()
        .map(|it| it.service)
        .chain(evidence.iter().copied())
        .chain(asking.iter().copied());
    let asked = plain.demands.iter().flat_map(|it| it.of.iter().copied());
    for at in 0..=last.chain(asked).max().unwrap() {
        rows.services.push(Service { name: format!("s{at}"), kind: ServiceKind::Application });
    }
    for &owner in evidence {
        let max_age = Some(Span::from_millis(100));
        let within = Some(Interval::new(0.0, 1.0));
        rows.evidence.push(Evidence { name: "e".into(), service: service(owner), within, max_age });
    }
    for (row, &owner) in plain.demands.iter().zip(asking) {
        rows.demands.push(Demand {
            name: "d".into(),
            service: service(owner),
            statement: statement(&rows.scales, &row.says),
            of: row.of.iter().copied().map(service).collect(),
            quantifier: if row.all { Quantifier::All } else { Quantifier::Any },
        });
    }
    for row in &plain.guarantees {
        let statement = statement(&rows.scales, &row.says);
        let when = tree(&row.when);
        rows.guarantees.push(Guarantee { name: "g".into(), service: service(row.service), statement, when });
    }
    System::new(rows).unwrap()
}

fn level(scales: &Scales, (scale, rank): (usize, u32)) -> Level {
    Level { scale: scales.named(["sil", "pl"][scale]).unwrap(), rank }
}

fn statement(scales: &Scales, says: &Says) -> Statement {
    let numeric = |name: &str, range, inclusion| {
        let content = Content::Numeric { ranges: vec![range], dimension: Dimension::LENGTH, inclusion };
        Property { name: name.into(), mode: None, content }
    };
    let at_most = says.at_most.map(|bound| {
        numeric("deviation", Interval::new(0.0, f64::from(bound)), Inclusion::GuaranteeInDemand)
    });
    let at_least = says
        .at_least
        .map(|bound| numeric("duration", Interval::new(0.0, f64::from(bound)), Inclusion::DemandInGuarantee));
    Statement {
        service: format!("t{}", says.kind),
        level: says.level.map(|it| level(scales, it)),
        properties: at_most.into_iter().chain(at_least).collect(),
    }
}

fn tree(plain: &PlainTree) -> Tree {
    match plain {
        PlainTree::AtLeast(needed, parts) => {
            let all: Vec<Tree> = parts.iter().map(tree).collect();
            match *needed {
                needed if needed == parts.len() => Tree::All(all),
                1 => Tree::Any(all),
                needed => Tree::AtLeast(needed as u32, all),
            }
        }
        PlainTree::Demand(at) => Tree::Demand(DemandId::from_index(*at)),
        PlainTree::Evidence(at) => Tree::Evidence(EvidenceId::from_index(*at)),
    }
}

fn indices<I: Id>(found: &Sets<I>) -> Vec<Vec<usize>> {
    assert!(found.is_complete);
    ordered(found.sets.iter().map(|set| set.iter().map(|id| id.index()).collect()).collect())
}

/// Compares everything that can be asked about the evidence of now.
fn compare(plain: &Plain, system: &System, evaluation: &Evaluation, truth: &[Truth]) {
    let bits = |is: fn(Truth) -> bool| {
        truth.iter().enumerate().filter(|(_, it)| is(**it)).fold(0, |bits, (at, _)| bits | 1 << at)
    };
    let (given, hoped) = (bits(Truth::is_true), bits(|it| !it.is_false()));
    let least = plain.least(given);
    let greatest = plain.fixed_point(given, (0..plain.guarantees.len()).collect());
    let open = plain.least(hoped);
    for at in 0..plain.guarantees.len() {
        let expected = match () {
            () if least.contains(&at) => Verdict::Holds,
            () if open.contains(&at) => Verdict::Open,
            () if greatest.contains(&at) => Verdict::Circular,
            () => Verdict::Refused,
        };
        let id = GuaranteeId::from_index(at);
        assert_eq!(evaluation.guarantee(system, id), expected, "guarantee {at}");
        if expected != Verdict::Holds {
            let (repairs, causes) = evaluation.why_no_guarantee(system, id, MOST);
            let expected = plain.minimal(given, |evidence| plain.least(evidence).contains(&at));
            assert_eq!((indices(&repairs), indices(&causes)), expected, "guarantee {at}");
            check_missing(plain, system, evaluation, (at, given), &least);
        }
    }
    for (at, row) in plain.demands.iter().enumerate() {
        let id = DemandId::from_index(at);
        let is_met = plain.met(at, row.says.level, &least);
        assert_eq!(evaluation.demand(system, id) == Verdict::Holds, is_met, "demand {at}");
        if !is_met {
            let (repairs, causes) = evaluation.why_unmet(system, id, MOST);
            let met = |evidence| plain.met(at, row.says.level, &plain.least(evidence));
            assert_eq!((indices(&repairs), indices(&causes)), plain.minimal(given, met), "demand {at}");
        }
        check_levels(plain, (system, evaluation), at, given, [&least, &open]);
    }
}

/// Sets of own leaves, tried one after the other on the condition alone.
fn check_missing(
    plain: &Plain,
    system: &System,
    evaluation: &Evaluation,
    (at, given): (usize, u32),
    least: &BTreeSet<usize>,
) {
    let mut leaves = BTreeSet::new();
    collect(&plain.guarantees[at].when, &mut leaves);
    let is_unmet = |&(is_demand, leaf): &(bool, usize)| match is_demand {
        true => !plain.met(leaf, plain.demands[leaf].says.level, least),
        false => given >> leaf & 1 == 0,
    };
    let unmet: Vec<(bool, usize)> = leaves.into_iter().filter(is_unmet).collect();
    let holds = |set: &u32| {
        let chosen =
            |leaf: (bool, usize)| unmet.iter().position(|it| *it == leaf).is_none_or(|at| set >> at & 1 == 1);
        with(&plain.guarantees[at].when, &chosen)
    };
    let expected = smallest((0..1u32 << unmet.len()).filter(holds));
    let found = evaluation.missing(system, GuaranteeId::from_index(at), MOST);
    assert!(found.is_complete);
    let place = |leaf: &Leaf| {
        let leaf = match leaf {
            Leaf::Demand(id) => (true, id.index()),
            Leaf::Evidence(id) => (false, id.index()),
        };
        unmet.iter().position(|it| *it == leaf).unwrap()
    };
    let ours = found.sets.iter().map(|set| {
        let mut set: Vec<usize> = set.iter().map(place).collect();
        set.sort_unstable();
        set
    });
    assert_eq!(ordered(ours.collect()), expected, "missing of guarantee {at}");
}

/// Levels of a demand's scale, from the highest down: the first at which it is met.
fn check_levels(
    plain: &Plain,
    (system, evaluation): (&System, &Evaluation),
    at: usize,
    given: u32,
    [least, open]: [&BTreeSet<usize>; 2],
) {
    let id = DemandId::from_index(at);
    let row = &plain.demands[at];
    let Some((scale, _)) = row.says.level.filter(|_| !row.of.is_empty()) else {
        assert_eq!((evaluation.highest(system, id), evaluation.higher(system, id, MOST)), (None, vec![]));
        return;
    };
    let scales = &system.certificates().scales;
    let count = [4, 5][scale];
    let highest = |holds| (0..count).rev().find(|&rank| plain.met(at, Some((scale, rank)), holds));
    let named = |rank: Option<u32>| rank.map(|rank| level(scales, (scale, rank)));
    assert_eq!(evaluation.highest(system, id), named(highest(least)));
    assert_eq!(evaluation.highest_if_unknown_true(system, id), named(highest(open)));
    let above = (highest(least).map_or(0, |rank| rank + 1)..count).filter_map(|rank| {
        let met = |evidence| plain.met(at, Some((scale, rank)), &plain.least(evidence));
        let (repairs, _) = plain.minimal(given, met);
        (!repairs.is_empty()).then(|| (level(scales, (scale, rank)), repairs))
    });
    let ours = evaluation.higher(system, id, MOST).into_iter().map(|it| (it.level, indices(&it.repairs)));
    assert_eq!(ours.collect::<Vec<_>>(), above.collect::<Vec<_>>());
}

/// What evidence is measured as, for each of its truths.
fn measured(truth: Truth, random: &mut Random) -> Interval {
    let (lo, hi) = match truth {
        Truth::True => (0.0, 1.0),
        Truth::False => (1.5, 2.0 + random.share()),
        Truth::Unknown => (0.5, 1.5),
    };
    Interval::new(lo, hi)
}

fn check_seed(seed: u64) {
    let random = &mut Random(seed);
    let (plain, evidence, asking) = random_system(random);
    let system = composed(&plain, &evidence, &asking);
    let mut evaluation = Evaluation::new(&system);
    let mut truth = vec![Truth::Unknown; plain.evidence];
    let mut until = vec![0; plain.evidence];
    for step in 0..6 {
        compare(&plain, &system, &evaluation, &truth);
        let now = step * 60;
        for at in 0..plain.evidence {
            if random.chance(if step == 0 { 1.0 } else { 0.4 }) {
                truth[at] = [Truth::True, Truth::True, Truth::False, Truth::Unknown][random.below(4)];
                until[at] = now + 100;
                let when = Time(Span::from_millis(now).0);
                evaluation.observe(&system, EvidenceId::from_index(at), measured(truth[at], random), when);
            } else if until[at] < now {
                truth[at] = Truth::Unknown;
            }
        }
        evaluation.pass(&system, Time(Span::from_millis(now).0));
    }
    compare(&plain, &system, &evaluation, &truth);
}

#[test]
fn every_answer_is_that_of_the_definition() {
    seeds(80).for_each(check_seed);
}

#[test]
fn a_reached_bound_is_reported_and_what_was_found_is_right() {
    let mut rows = Certificates::default();
    let service = rows.services.push(Service { name: "s".into(), kind: ServiceKind::Application });
    let evidence = |at: usize| Evidence { name: format!("e{at}"), service, within: None, max_age: None };
    let leaves: Vec<EvidenceId> = (0..24).map(|at| rows.evidence.push(evidence(at))).collect();
    let says = Statement { service: "t".into(), level: None, properties: vec![] };
    let when = Tree::AtLeast(12, leaves.into_iter().map(Tree::Evidence).collect());
    let id = rows.guarantees.push(Guarantee { name: "g".into(), service, statement: says, when });
    let system = System::new(rows).unwrap();
    let (repairs, causes) = Evaluation::new(&system).why_no_guarantee(&system, id, 1000);
    assert!(!repairs.is_complete && !causes.is_complete);
    assert!(repairs.sets.iter().all(|set| set.len() == 12) && causes.sets.iter().all(|set| set.len() == 13));
}

#[test]
fn what_cannot_be_composed_is_reported() {
    use shsa_core::assurance::Problem;
    let mut rows = Certificates::default();
    let service = rows.services.push(Service { name: "s".into(), kind: ServiceKind::Application });
    let other = rows.services.push(Service { name: "o".into(), kind: ServiceKind::Application });
    let theirs =
        rows.evidence.push(Evidence { name: "e".into(), service: other, within: None, max_age: None });
    let says = Statement { service: "t".into(), level: None, properties: vec![] };
    let mut deep = Tree::ALWAYS;
    (0..100).for_each(|_| deep = Tree::Any(vec![std::mem::replace(&mut deep, Tree::ALWAYS)]));
    let guarantee = |when| Guarantee { name: "g".into(), service, statement: says.clone(), when };
    let foreign = rows.guarantees.push(guarantee(Tree::Evidence(theirs)));
    let deep = rows.guarantees.push(guarantee(deep));
    assert_eq!(System::new(rows).unwrap_err(), [Problem::ForeignLeaf(foreign), Problem::TooDeep(deep)]);
}
