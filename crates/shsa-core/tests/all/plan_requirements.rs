//! Searches with requirements, compared with the oracle filtered by the exact check.

use crate::driven::text;
use crate::plan_support::Random;
use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, KnowledgeBase, RelationDraft, SignalDraft, SignalId, VariableDraft, build,
};
use shsa_core::plan::{
    BestFirst, Contingency, Graph, Limits, Options, Preparation, Requirements, Shortfall, StopReason,
    best_meeting, exhaustive,
};
use shsa_core::reason::Reason;
use shsa_core::time::Span;

const LIMITS: Limits = Limits { expansions: 10_000_000, states: 3_000_000 };

fn equation(name: String, output: &str, right: String) -> RelationDraft {
    RelationDraft {
        name: text(name),
        body: BodyDraft::Equation(text(format!("{output} = {right}"))),
        directions: Some(vec![text(output)]),
        condition: None,
        error: None,
        learn: Vec::new(),
        properties: Vec::new(),
    }
}

fn term(random: &mut Random, variable: usize) -> String {
    match random.below(6) {
        0 => format!("derivative(v{variable}, {} ms)", 100 * (1 + random.below(9))),
        1 => format!("delay(v{variable}, {} ms)", 50 * (1 + random.below(9))),
        2 => format!("v{variable} / {}", 1 + random.below(4)),
        3 => format!("sqrt(abs(v{variable}))"),
        _ => format!("{} * v{variable}", 0.5 * (1 + random.below(4)) as f64),
    }
}

/// Linear and other equations, some over time, with signals of different quality.
fn random_model(random: &mut Random) -> KnowledgeBase {
    let size = 4 + random.below(5);
    let mut draft = Draft::default();
    for at in 0..size {
        draft.variables.push(VariableDraft { name: text(format!("v{at}")), ..VariableDraft::default() });
        for copy in 0..if at == 0 { 0 } else { random.below(4) / 2 + usize::from(at + 2 >= size) } {
            let mut signal = SignalDraft { name: text(format!("/v{at}/{copy}")), ..SignalDraft::default() };
            signal.variable = Some(text(format!("v{at}")));
            signal.delay = Some(text(format!("{} ms", 20 * random.below(10))));
            signal.rate = random.chance(0.8).then(|| text(format!("{} Hz", 1 + random.below(20))));
            signal.value_error = Some(Bounds::One(text(format!("0.0{}", random.below(10)))));
            if random.chance(0.6) {
                let level = ["A", "B", "C", "D"][random.below(4)];
                signal.properties.push((text("integrity"), text(level)));
            }
            if random.chance(0.3)
                && let Some(other) = draft.signals.first()
            {
                signal.derived_from.push(other.name.clone());
            }
            draft.signals.push(signal);
        }
    }
    for at in 0..2 * size {
        let output = random.below(size);
        let inputs: Vec<usize> =
            (0..1 + random.below(2)).map(|_| random.below(size)).filter(|i| *i != output).collect();
        if inputs.is_empty() {
            continue;
        }
        let right = inputs.iter().map(|&input| term(random, input)).collect::<Vec<_>>().join(" - ");
        let mut relation = equation(format!("r{at}"), &format!("v{output}"), right);
        if random.chance(0.2) {
            relation.properties.push((text("integrity"), text(["A", "B", "C", "D"][random.below(4)])));
        }
        draft.relations.push(relation);
    }
    let (knowledge, problems) = build(&draft);
    let errors: Vec<_> =
        problems.iter().filter(|p| p.severity == shsa_core::knowledge::Severity::Error).collect();
    assert!(errors.is_empty(), "{errors:?}");
    knowledge
}

fn random_requirements(random: &mut Random, knowledge: &KnowledgeBase) -> Requirements {
    let signals: Vec<SignalId> = knowledge.signals().ids().collect();
    Requirements {
        max_latency: random.chance(0.5).then(|| Span::from_millis(50 * random.below(20) as i64)),
        max_period: random.chance(0.3).then(|| Span::from_millis(100 * random.below(10) as i64)),
        max_width: random.chance(0.5).then(|| 0.02 * random.below(20) as f64),
        min_rate_hz: random.chance(0.3).then(|| random.below(12) as f64),
        integrity: random.chance(0.3).then(|| (1 + random.below(4)) as f64),
        single_valued: false,
        independent_of: signals.into_iter().filter(|_| random.chance(0.1)).collect(),
    }
}

#[test]
fn what_is_pruned_is_what_the_exact_check_refuses() {
    let (mut admitted, mut refused, mut kinds) = (0, 0, [0; 10]);
    for seed in 0..3_000 {
        let mut random = Random(seed);
        let knowledge = random_model(&mut random);
        let requirements = random_requirements(&mut random, &knowledge);
        let options = Options { substitute_provided: random.chance(0.3), ..Options::default() };
        let root = knowledge.variables().ids().next().unwrap();
        let graph = Graph::new(&knowledge);
        // The norm rates the available signals, so the oracle must not see those that fall short.
        let none =
            Requirements { max_latency: None, max_period: None, max_width: None, ..requirements.clone() };
        let narrow = BestFirst::meeting(&knowledge, &graph, root, &options, &none, LIMITS);
        let narrow: Vec<_> = narrow.collect();
        let met = |requirements: &Requirements, substitution| {
            requirements.shortfalls(&knowledge, &options, substitution)
        };
        let expected: Vec<_> = narrow
            .iter()
            .filter(|(substitution, _)| met(&requirements, substitution).is_empty())
            .cloned()
            .collect();
        let mut search = BestFirst::meeting(&knowledge, &graph, root, &options, &requirements, LIMITS);
        let found: Vec<_> = search.by_ref().collect();
        assert_eq!(search.stop(), StopReason::Complete, "seed {seed}");
        assert_eq!(found, expected, "seed {seed} {requirements:?}");
        // A requirement only removes answers: the remaining ones are among all.
        let all = exhaustive(
            &knowledge,
            root,
            &Options { substitute_provided: true, ..Options::default() },
            LIMITS,
        );
        for (substitution, _) in &narrow {
            assert!(all.substitutions.iter().any(|(other, _)| other.relations() == substitution.relations()));
        }
        for (substitution, _) in &all.substitutions {
            for shortfall in met(&requirements, substitution) {
                assert_eq!(shortfall.reason(&knowledge).code(), CODES[kind(&shortfall)]);
                kinds[kind(&shortfall)] += 1;
            }
        }
        admitted += found.len();
        refused += narrow.len() - found.len();
    }
    assert!(admitted > 1_000 && refused > 500, "{admitted} admitted, {refused} refused");
    assert!(kinds.iter().enumerate().all(|(at, &count)| count > 20 || at < 2 || at == 9), "{kinds:?}");
}

/// The plans of a table after each loss of up to two signals equal those of searches with the same requirements.
#[test]
fn a_table_meets_the_requirements_after_each_loss() {
    let (mut known, mut changed) = (0, 0);
    for seed in 0..400 {
        let mut random = Random(seed);
        let knowledge = random_model(&mut random);
        let requirements = random_requirements(&mut random, &knowledge);
        let options = Options { substitute_provided: random.chance(0.3), ..Options::default() };
        let (root, graph) = (knowledge.variables().ids().next().unwrap(), Graph::new(&knowledge));
        let count = 3;
        let preparation = Preparation {
            count,
            pairs: true,
            options: options.clone(),
            requirements: requirements.clone(),
            limits: LIMITS,
            ..Preparation::default()
        };
        let table = Contingency::new(&knowledge, &graph, [root], preparation);
        assert!(table.is_complete(root));
        let signals: Vec<SignalId> = knowledge.signals().ids().collect();
        for lost in signals.iter().flat_map(|&one| signals.iter().map(move |&other| vec![one, other])) {
            let narrow = Options { forbidden_signals: lost.clone(), ..options.clone() };
            let fresh = best_meeting(&knowledge, &graph, root, &narrow, &requirements, count, LIMITS);
            for plan in
                [table.plan(root, &lost).unwrap(), &*table.plan_or_search(&knowledge, &graph, root, &lost)]
            {
                assert_eq!(
                    (&plan.substitutions, plan.stop),
                    (&fresh.substitutions, fresh.stop),
                    "seed {seed} lost {lost:?} {requirements:?}"
                );
            }
            known += fresh.substitutions.len();
            changed += usize::from(table.loss(root, &lost) != Some(&[]));
        }
    }
    assert!(known > 1_000 && changed > 1_000, "{known} {changed}");
}

/// The codes of what falls short, by [`kind`].
const CODES: [&str; 10] = [
    "no-signal-of",
    "relation-barred",
    "rate-too-low",
    "signals-integrity",
    "relation-integrity",
    "not-independent",
    "rests-on-old",
    "too-wide",
    "comes-rarely",
    "one-of-several",
];

fn kind(shortfall: &Shortfall) -> usize {
    match shortfall {
        Shortfall::Signal(_) => 0,
        Shortfall::Relation(_) => 1,
        Shortfall::Rate(..) => 2,
        Shortfall::SignalIntegrity(..) => 3,
        Shortfall::RelationIntegrity(..) => 4,
        Shortfall::Alternatives(_) => 9,
        Shortfall::Shared(..) => 5,
        Shortfall::Latency(..) => 6,
        Shortfall::Width(..) => 7,
        Shortfall::Period(..) => 8,
    }
}

#[test]
fn a_pruned_candidate_tells_why() {
    let mut draft = Draft::default();
    for name in ["speed", "position", "pace"] {
        draft.variables.push(VariableDraft { name: text(name), ..VariableDraft::default() });
    }
    draft.relations.push(equation("rate".into(), "speed", "derivative(position, 500 ms)".into()));
    draft.relations.push(equation("twice".into(), "speed", "2 * pace".into()));
    let signal = |name: &str, variable: &str, error: &str| SignalDraft {
        name: text(name),
        variable: Some(text(variable)),
        rate: Some(text("10 Hz")),
        delay: Some(text("40 ms")),
        value_error: Some(Bounds::One(text(error))),
        ..SignalDraft::default()
    };
    draft.signals = vec![signal("/position", "position", "0.1"), signal("/pace", "pace", "0.2")];
    let (knowledge, _) = build(&draft);
    let graph = Graph::new(&knowledge);
    let root = knowledge.variable("speed").unwrap();
    let why = |requirements: &Requirements| -> Vec<Reason> {
        let options = Options::default();
        let all = exhaustive(&knowledge, root, &options, LIMITS).substitutions;
        let found: Vec<_> =
            BestFirst::meeting(&knowledge, &graph, root, &options, requirements, LIMITS).collect();
        let reported = all.iter().flat_map(|(s, _)| requirements.shortfalls(&knowledge, &options, s));
        let reported: Vec<Reason> = reported.map(|shortfall| shortfall.reason(&knowledge)).collect();
        assert_eq!(found.len() + reported.len(), 2);
        reported
    };
    let latency = Requirements { max_latency: Some(Span::from_millis(300)), ..Requirements::default() };
    assert_eq!(why(&latency), [Reason::RestsOnOld { age_s: 0.54, most_s: 0.3 }]);
    let width = Requirements { max_width: Some(0.5), ..Requirements::default() };
    assert_eq!(why(&width), [Reason::TooWide { width: 0.8, most: 0.5 }]);
    let rate = Requirements { min_rate_hz: Some(20.0), ..Requirements::default() };
    let expected = Reason::RateTooLow { variable: "position".to_owned(), rate_hz: 10.0, least_hz: 20.0 };
    assert_eq!(why(&rate)[0], expected);
    let level = Requirements { integrity: Some(2.0), ..Requirements::default() };
    let (variable, least) = ("pace".to_owned(), "B".to_owned());
    let expected = Reason::SignalsIntegrity { variable: variable.clone(), level: "none".to_owned(), least };
    assert_eq!(why(&level)[1], expected);
    let suspects = vec![knowledge.signal("/pace").unwrap()];
    let shared = Requirements { independent_of: suspects, ..Requirements::default() };
    assert_eq!(why(&shared), [Reason::NotIndependent { variable, signal: "/pace".to_owned() }]);
}
