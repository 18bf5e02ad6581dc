//! The analysis compared with brute force over all sets of losses, with the running monitor, and with itself.

use crate::plan_support::{KINDS, Random, knowledge, random};
use shsa_core::analysis::{Analysis, Candidate, Limited, Options, Tolerance, analyze};
use shsa_core::diagnosis::candidates::{Comparison, explain};
use shsa_core::engine::{self, Engine, WatchBudget};
use shsa_core::knowledge::{
    Id, IdVec, KnowledgeBase, Need, Properties, Relation, Signal, SignalId, SignalSet, Switching, VariableId,
    WhenUnsure,
};
use shsa_core::{time::Span, trust::Component};
use std::collections::BTreeSet;

pub(crate) const WITHOUT_ADDITIONS: Options =
    Options { only_runnable: false, steps: 10_000_000, addition_steps: 0, watch: WATCH };

/// The default number of watched ways, at any cost.
const WATCH: WatchBudget = WatchBudget { ways: 32, cost: u64::MAX };

/// The same model with other signals, relations and needs.
fn with_parts(
    knowledge: &KnowledgeBase,
    relations: IdVec<shsa_core::knowledge::RelationId, Relation>,
    signals: IdVec<SignalId, Signal>,
    needs: impl IntoIterator<Item = VariableId>,
) -> KnowledgeBase {
    let mut all = IdVec::new();
    for variable in needs {
        all.push(Need {
            variable,
            signal: format!("/need/{}", variable.index()),
            max_age: Span::from_millis(500),
            max_width: None,
            integrity: None,
            min_rate_hz: None,
            when_unsure: WhenUnsure::Withhold,
            switching: Switching::default(),
            is_isolated: false,
        });
    }
    KnowledgeBase::from_parts(knowledge.variables().clone(), relations, signals, all)
}

/// A random model with some derived signals, whose first variables are needed.
pub(crate) fn random_model(seed: u64) -> KnowledgeBase {
    let mut numbers = Random(seed);
    let kind = KINDS[numbers.below(KINDS.len())];
    let size = 3 + numbers.below(8);
    let base = random(&mut numbers, kind, size, true);
    let mut signals = base.signals().clone();
    for id in base.signals().ids().skip(1) {
        if numbers.chance(0.2) {
            signals[id].derived_from.push(SignalId::from_index(numbers.below(id.index())));
        }
    }
    let needed: Vec<VariableId> = base.variables().ids().take(3).collect();
    with_parts(&base, base.relations().clone(), signals, needed)
}

/// Whether a variable can be known without some signals, by going forward from what is provided until nothing is new.
pub(crate) fn is_known(knowledge: &KnowledgeBase, variable: VariableId, lost: &SignalSet) -> bool {
    let provides = |signal: SignalId| !knowledge.origins(signal).meets(lost);
    let mut known: BTreeSet<VariableId> = knowledge
        .variables()
        .ids()
        .filter(|&v| knowledge.carriers(v).iter().any(|&signal| provides(signal)))
        .collect();
    loop {
        let new: Vec<VariableId> = knowledge
            .relations()
            .iter()
            .flat_map(|relation| relation.outputs.iter().map(move |&output| (relation, output)))
            .filter(|(relation, output)| relation.needs(*output).all(|input| known.contains(&input)))
            .map(|(_, output)| output)
            .filter(|output| !known.contains(output))
            .collect();
        if new.is_empty() {
            return known.contains(&variable);
        }
        known.extend(new);
    }
}

/// All sets of signals, the smaller first.
pub(crate) fn losses(count: usize) -> Vec<SignalSet> {
    let mut sets: Vec<SignalSet> = (0_u32..1 << count)
        .map(|bits| (0..count).filter(|at| bits >> at & 1 == 1).map(SignalId::from_index).collect())
        .collect();
    sets.sort_by_key(SignalSet::len);
    sets
}

#[track_caller]
fn check_tolerance(knowledge: &KnowledgeBase, variable: VariableId, found: &Tolerance, case: &str) {
    assert!(found.exact, "{case}: {found:?}");
    let count = knowledge.signals().len();
    assert_eq!(found.known, is_known(knowledge, variable, &SignalSet::new()), "{case}");
    if !found.known {
        return;
    }
    let fewest = losses(count).into_iter().find(|lost| !is_known(knowledge, variable, lost));
    assert_eq!(found.survives, fewest.as_ref().map(|lost| lost.len() - 1), "{case}: {found:?}");
    if let Some(fewest) = fewest {
        assert_eq!(found.cut.len(), fewest.len(), "{case}");
        assert!(!is_known(knowledge, variable, &found.cut), "{case}: {:?} does not take it", found.cut);
    }
    let alone = |signal: &SignalId| !is_known(knowledge, variable, &SignalSet::from_iter([*signal]));
    let single: SignalSet = knowledge.signals().ids().filter(alone).collect();
    assert_eq!(found.single_points, single, "{case}");
}

#[test]
fn losses_are_survived_as_trying_all_of_them_says() {
    let (mut several, mut tried) = (0, 0);
    for seed in crate::seeds::seeds(400) {
        let knowledge = random_model(seed);
        if knowledge.signals().len() > 8 {
            continue;
        }
        tried += 1;
        let analysis = analyze(&knowledge, WITHOUT_ADDITIONS);
        for (id, need) in knowledge.needs().enumerate() {
            check_tolerance(&knowledge, need.variable, &analysis.needs[id], &format!("seed {seed}, need"));
        }
        for (id, signal) in knowledge.signals().enumerate() {
            let found = &analysis.signals[id];
            check_tolerance(&knowledge, signal.variable, found, &format!("seed {seed}, signal"));
            let without = SignalSet::from_iter([id]);
            assert_eq!(analysis.is_substitutable(id), is_known(&knowledge, signal.variable, &without));
            let lost: Vec<VariableId> =
                analysis.needs_lost(id).map(|need| knowledge.needs()[need].variable).collect();
            let expected: Vec<VariableId> = knowledge
                .needs()
                .iter()
                .map(|need| need.variable)
                .filter(|&v| is_known(&knowledge, v, &SignalSet::new()) && !is_known(&knowledge, v, &without))
                .collect();
            assert_eq!(lost, expected, "seed {seed}");
            several += usize::from(found.survives.is_some_and(|survives| survives > 1));
        }
    }
    assert!(tried > 180 && several > 60, "too simple: {tried} tried, {several} survive several losses");
}

#[track_caller]
fn check_comparisons(knowledge: &KnowledgeBase) -> usize {
    let analysis = analyze(knowledge, Options { only_runnable: true, ..WITHOUT_ADDITIONS });
    let engine = Engine::new(knowledge.clone(), engine::Options::default());
    let pairs = engine.monitor().residuals().iter();
    let mut watched: Vec<SignalSet> = pairs.map(|pair| pair.signals.clone()).collect();
    // With uncertain stamps, each of two ways is compared at the moments of the other.
    watched.dedup();
    let comparisons = &analysis.comparisons;
    let found: Vec<SignalSet> = comparisons.pairs().iter().map(|&pair| comparisons.signals(pair)).collect();
    assert_eq!(found, watched);
    found.len()
}

#[test]
fn the_comparisons_are_those_of_the_monitor() {
    let systems = [crate::models::car(), crate::models::climber(), crate::models::rover()];
    let counts: Vec<usize> = systems.iter().map(|system| check_comparisons(&system.knowledge)).collect();
    assert!(counts.iter().all(|&count| count > 0), "{counts:?}");
}

/// Single faults: when all comparisons that show one disagree, the diagnosis suspects the components of the analysis.
#[track_caller]
fn check_suspects(knowledge: &KnowledgeBase, analysis: &Analysis) -> usize {
    let (faults, comparisons) = (&analysis.faults, &analysis.comparisons);
    for signal in knowledge.signals().ids() {
        let shown = comparisons.pairs().iter().filter(|&&pair| comparisons.shows(pair).contains(signal));
        let conflict = |&pair: &_| Comparison {
            conditions: BTreeSet::new(),
            one: comparisons.signals(pair).iter().map(Component::Signal).collect(),
            other: BTreeSet::new(),
            agrees: false,
        };
        let conflicts: Vec<Comparison> = shown.map(conflict).collect();
        let explained = explain(&conflicts, |_| 0.01);
        let named = explained.iter().flat_map(|part| &part.candidates).flat_map(|it| &it.components);
        let named = named.filter_map(|component| match component {
            Component::Signal(signal) => Some(*signal),
            Component::Cause(_) | Component::Relation(_) => None,
        });
        let suspects: SignalSet = named.collect();
        assert_eq!(*faults.suspects(signal), suspects);
        assert_eq!(faults.is_detectable(signal), !suspects.is_empty());
        let reported: Vec<SignalId> = knowledge
            .signals()
            .ids()
            .filter(|&other| {
                comparisons.pairs().iter().any(|&pair| {
                    comparisons.shows(pair).contains(signal) && !comparisons.signals(pair).contains(other)
                })
            })
            .collect();
        assert_eq!(faults.isolable_from(signal).collect::<Vec<_>>(), reported);
    }
    comparisons.pairs().len()
}

#[test]
fn the_diagnosis_suspects_whom_the_analysis_says() {
    let compared = (0..500).map(|seed| {
        let knowledge = random_model(seed);
        check_suspects(&knowledge, &analyze(&knowledge, WITHOUT_ADDITIONS))
    });
    assert!(compared.sum::<usize>() > 5_000);
}

fn larger(knowledge: &KnowledgeBase, candidate: Candidate) -> KnowledgeBase {
    let (mut relations, mut signals) = (knowledge.relations().clone(), knowledge.signals().clone());
    if let Candidate::Sensor(variable) = candidate {
        signals.push(Signal::new("added".to_owned(), variable));
    }
    if let Candidate::Relation(one, other) = candidate {
        relations.push(Relation {
            name: "added".to_owned(),
            inputs: vec![one, other],
            outputs: vec![one, other],
            formulas: Vec::new(),
            condition: None,
            text: String::new(),
            properties: Properties::new(),
        });
    }
    let needs: Vec<VariableId> = knowledge.needs().iter().map(|need| need.variable).collect();
    with_parts(knowledge, relations, signals, needs)
}

/// An addition has the effect that a whole new analysis finds, although only the affected part is analysed.
#[test]
fn additions_bring_what_a_new_analysis_says() {
    let mut helpful = 0;
    for seed in crate::seeds::seeds(20) {
        let knowledge = with_units(random_model(seed));
        let before = analyze(&knowledge, Options::default());
        if before.limited.iter().any(|limited| !matches!(limited, Limited::Needs { .. })) {
            continue;
        }
        for addition in &before.additions {
            let after = analyze(&larger(&knowledge, addition.candidate), WITHOUT_ADDITIONS);
            let signals = || knowledge.signals().ids();
            let newly = |is: &dyn Fn(&Analysis, SignalId) -> bool| -> SignalSet {
                signals().filter(|&signal| is(&after, signal) && !is(&before, signal)).collect()
            };
            let pairs = |analysis: &Analysis| {
                let reported =
                    |signal| signals().filter(|&s| analysis.faults.is_isolable_from(signal, s)).count();
                signals().map(reported).sum::<usize>()
            };
            let case = format!("seed {seed}: {:?}", addition.candidate);
            assert_eq!(addition.detectable, newly(&|a, s| a.faults.is_detectable(s)), "{case}");
            assert_eq!(addition.substitutable, newly(&|a, s| a.is_substitutable(s)), "{case}");
            assert_eq!(addition.isolable_pairs, pairs(&after).saturating_sub(pairs(&before)), "{case}");
            for survives in &addition.survives {
                assert_eq!(survives.now, before.needs[survives.need], "{case}");
                assert_eq!(survives.then.survives, after.needs[survives.need].survives, "{case}");
            }
            helpful += 1;
        }
    }
    assert!(helpful > 60, "{helpful}");
}

/// All variables in metres, so that relations between them are candidates.
fn with_units(knowledge: KnowledgeBase) -> KnowledgeBase {
    let mut variables = knowledge.variables().clone();
    for variable in variables.iter_mut() {
        variable.unit = Some(shsa_core::unit::Unit::parse("m").unwrap());
    }
    KnowledgeBase::from_parts(
        variables,
        knowledge.relations().clone(),
        knowledge.signals().clone(),
        knowledge.needs().clone(),
    )
}

fn names(knowledge: &KnowledgeBase, signals: &SignalSet) -> String {
    let names: Vec<&str> = signals.iter().map(|signal| knowledge.signals()[signal].name.as_str()).collect();
    names.join(" ")
}

#[test]
fn what_both_sides_read_alike_does_not_show() {
    // x by one relation from s and either a: faults of both a are detectable, those of s are not.
    let knowledge = knowledge(&["!s", "!a", "!a", "x = r(s, a)"]);
    let analysis = analyze(&knowledge, WITHOUT_ADDITIONS);
    let detectable: SignalSet =
        knowledge.signals().ids().filter(|&signal| analysis.faults.is_detectable(signal)).collect();
    assert_eq!(names(&knowledge, &detectable), "/a/1 /a/2");
    let groups: Vec<String> = analysis.faults.groups().iter().map(|group| names(&knowledge, group)).collect();
    assert_eq!(groups, ["/a/1 /a/2"]);
}

#[test]
fn what_reaches_two_sides_over_different_relations_shows() {
    let knowledge = knowledge(&["!s", "!a", "!b", "x = r1(s, a)", "x = r2(s, b)"]);
    let analysis = analyze(&knowledge, WITHOUT_ADDITIONS);
    let signals: Vec<SignalId> = knowledge.signals().ids().collect();
    assert!(signals.iter().all(|&signal| analysis.faults.is_detectable(signal)));
}

#[test]
fn a_fault_of_a_derived_signal_shows_and_one_of_its_origin_does_not() {
    let base = knowledge(&["!a", "!b", "b = r(a)"]);
    let mut signals = base.signals().clone();
    let (origin, derived) = (SignalId::from_index(0), SignalId::from_index(1));
    signals[derived].derived_from.push(origin);
    let knowledge = with_parts(&base, base.relations().clone(), signals, []);
    let analysis = analyze(&knowledge, WITHOUT_ADDITIONS);
    assert!(analysis.faults.is_detectable(derived) && !analysis.faults.is_detectable(origin));
    assert!(!analysis.faults.is_isolable_from(derived, origin));
    assert!(!analysis.is_substitutable(origin));
    // The relation knows b without its own signal, but no way knows b without a.
    assert!(analysis.is_substitutable(derived));
    assert_eq!(analysis.signals[derived].single_points, SignalSet::from_iter([origin]));
}

#[test]
fn what_goes_on_from_itself_is_no_substitute() {
    let knowledge = crate::models::climber().knowledge;
    let analysis = analyze(&knowledge, WITHOUT_ADDITIONS);
    let barometer = knowledge.signal("barometer").unwrap();
    assert!(!analysis.is_substitutable(barometer));
    let lost: Vec<usize> = analysis.needs_lost(barometer).map(Id::index).collect();
    assert_eq!(lost, [0]);
    assert_eq!(analysis.unhealed(), SignalSet::from_iter([barometer]));
    // The climb has two sensors and the derivative of the height.
    assert_eq!(analysis.needs.iter().map(|need| need.survives).collect::<Vec<_>>(), [Some(0), Some(2)]);
}

#[test]
fn what_is_too_old_for_a_need_does_not_serve_it() {
    let base = knowledge(&["!a", "!a"]);
    let variable = VariableId::from_index(0);
    let mut signals = base.signals().clone();
    signals[SignalId::from_index(1)].delay = Span::from_millis(501);
    let knowledge = with_parts(&base, base.relations().clone(), signals, [variable]);
    let analysis = analyze(&knowledge, WITHOUT_ADDITIONS);
    assert_eq!(analysis.needs.iter().map(|need| need.survives).collect::<Vec<_>>(), [Some(0)]);
    assert_eq!(analysis.signals[SignalId::from_index(0)].survives, Some(1));
}

#[test]
fn structure_counts_unless_it_must_run() {
    let knowledge = knowledge(&["!a", "!b", "b = r(a)"]);
    let a_second = SignalId::from_index(1);
    assert!(analyze(&knowledge, WITHOUT_ADDITIONS).is_substitutable(a_second));
    let runnable = analyze(&knowledge, Options { only_runnable: true, ..Options::default() });
    assert!(!runnable.is_substitutable(a_second) && !runnable.faults.is_detectable(a_second));
    // Then a second sensor helps: an addition counts as runnable.
    assert!(matches!(runnable.additions[0].candidate, Candidate::Sensor(_)));
}

/// As many ways as there are choices for each of forty parts: 2^40, which are never listed.
#[test]
fn ways_are_not_listed() {
    let mut lines: Vec<String> = Vec::new();
    let parts: Vec<String> = (0..40).map(|part| format!("x{part}")).collect();
    for part in &parts {
        lines.extend([format!("!{part}a"), format!("!{part}b")]);
        lines.extend([format!("{part} = p{part}({part}a)"), format!("{part} = q{part}({part}b)")]);
    }
    lines.push(format!("v = all({})", parts.join(", ")));
    let knowledge = needing_v(&lines);
    let analysis = analyze(&knowledge, WITHOUT_ADDITIONS);
    let need = analysis.needs.iter().next().unwrap();
    assert_eq!((need.known, need.survives, need.exact), (true, Some(1), true), "{need:?}");
    assert_eq!(analysis.limited, [Limited::Ways { variables: 1 }]);
}

/// The lines of the projective plane of order 3: every two meet, and no three points meet all of them. So the simple bound is 1
/// and the truth is 4 (a line).
#[test]
fn a_limit_leaves_a_bound_and_is_reported() {
    let mut lines: Vec<String> = (0..13).map(|point| format!("!p{point}")).collect();
    for line in 0..13 {
        let points = [0, 1, 3, 9].map(|at| format!("p{}", (line + at) % 13));
        lines.push(format!("v = line{line}({})", points.join(", ")));
    }
    let knowledge = needing_v(&lines);
    let reported = |steps| {
        let analysis = analyze(&knowledge, Options { steps, ..WITHOUT_ADDITIONS });
        let need = analysis.needs.iter().next().unwrap();
        assert!(!need.exact || !is_known(&knowledge, knowledge.variable("v").unwrap(), &need.cut));
        (need.known, need.survives.unwrap(), need.exact, analysis.limited)
    };
    assert_eq!(reported(1_000_000), (true, 3, true, vec![]));
    let (known, survives, exact, limited) = reported(20);
    assert!(known && survives < 3 && !exact, "{survives} {exact}");
    assert!(limited.contains(&Limited::Needs { needs: 1 }), "{limited:?}");
}

fn needing_v(lines: &[String]) -> KnowledgeBase {
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    let base = knowledge(&lines);
    with_parts(&base, base.relations().clone(), base.signals().clone(), base.variable("v"))
}
