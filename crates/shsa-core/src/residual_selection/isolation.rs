//! Adds ways that compute a measured number instead of reading it, where their comparisons isolate more faults.
//!
//! A provided number is compared itself, so that most faults are detected without computing it. But then every comparison of
//! variables computed from it rests on its signal, too. A fault elsewhere is not isolable from one of that signal if all
//! comparisons that show it use the number. A residual without the signal computes the number instead (it *eliminates* the
//! measured variable; Krysander, Aslund and Nyberg 2008, doi:10.1109/TSMCA.2007.909555). One signal at a time must be avoided,
//! and a residual through other measured numbers splits into some without them. So only numbers with a single independent signal
//! are computed, one at a time, and only ways that isolate more than all comparisons so far are added.

use super::candidates::stands;
use super::fault_signature::FaultSignature;
use super::findings::Findings;
use super::measured::{Measured, only_signal};
use super::witnesses::Witnesses;
use crate::knowledge::{
    IdVec, KnowledgeBase, RelationId, RelationSet, Shape, SignalId, SignalSet, VariableId,
};
use crate::monitor::{SupportedWay, are_compared, compared};
use crate::plan::{self, Graph, Limits, Options};
use crate::substitution::{Substitution, Way};
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

/// Larger models are left as they are, as the findings of each pair of components are stored.
const MOST_COMPONENTS: usize = 20_000;

/// The limit of decisions of all searches together; counted, so that runs repeat.
const MOST_EXPANDED: u64 = 100_000;

/// The limits of one search.
const LIMITS: Limits = Limits { expansions: 5_000, states: 5_000 };

/// The largest number of substitutions considered for a variable, and of choices of signals for each.
const MOST_SEARCHED: usize = 32;
const MOST_CHOICES: usize = 2;

/// The largest number of comparisons examined.
const MOST_LOOKED: u64 = 100_000;

/// Where no single way isolates anything, each is examined in pairs with at most this many following ones.
const MOST_PAIRED: usize = 8;

/// At most this many ways of each variable count as compared with each other.
const MOST_COMPARED: usize = 64;

/// Adds ways that compute a measured number to the watched ones, as long as each isolates more, and there are at most `most` of a
/// variable. Returns the number of decisions taken.
///
/// `admits` tells whether a way counts. Complexity: for each number with one signal that a fault is not isolable from, a search
/// for each variable computed from it, at most 100,000 expansions in all; O(p s) for p pairs of watched ways over s signals.
pub fn isolate(
    knowledge: &KnowledgeBase,
    graph: &Graph,
    watched: &mut BTreeMap<VariableId, &mut Witnesses>,
    most: usize,
    admits: impl Fn(&Way) -> bool,
) -> u64 {
    if knowledge.signals().len() + knowledge.relations().len() > MOST_COMPONENTS {
        return 0;
    }
    let readers = readers(knowledge);
    let is_read = |variable: &VariableId| !readers[*variable].is_empty();
    let variables = knowledge.variables().ids().filter(is_read);
    let measured: Vec<(VariableId, SignalId)> =
        variables.filter_map(|variable| Some((variable, only_signal(knowledge, variable)?))).collect();
    if measured.is_empty() {
        return 0;
    }
    let findings = taken_in(knowledge, watched);
    let blamed = blamed(&findings);
    let (expanded, looked) = (0, 0);
    let mut isolation = Isolation { knowledge, graph, readers, findings, most, expanded, looked };
    for (variable, signal) in measured {
        if isolation.expanded >= MOST_EXPANDED || isolation.looked >= MOST_LOOKED {
            break;
        }
        // Some of the faults may have become isolable from the signal's by now.
        if let Some(blamed) = blamed.get(&signal) {
            let measured = Measured::new(knowledge, variable, signal);
            isolation.look_behind(&measured, blamed, watched, &admits);
        }
    }
    isolation.expanded
}

/// The findings by the comparisons that are made anyway.
fn taken_in(knowledge: &KnowledgeBase, watched: &BTreeMap<VariableId, &mut Witnesses>) -> Findings {
    let ways: Vec<&Way> =
        watched.values().flat_map(|witnesses| witnesses.ways.iter().take(MOST_COMPARED)).collect();
    let fault_signature: Vec<FaultSignature> =
        ways.iter().map(|way| FaultSignature::of(knowledge, way)).collect();
    let rests_on = fault_signature.iter().map(FaultSignature::rests_on);
    let supported: Vec<SupportedWay<'_>> =
        ways.into_iter().zip(rests_on).map(|(way, rests_on)| SupportedWay { way, rests_on }).collect();
    let mut findings = Findings::new(knowledge);
    for (one, other) in compared(knowledge, &supported) {
        if let (Some(one), Some(other)) = (fault_signature.get(one), fault_signature.get(other)) {
            findings.compare(one, other);
        }
    }
    findings
}

/// For each signal, the components whose faults are not isolable from its fault; relations only if their faults are considered.
fn blamed(findings: &Findings) -> BTreeMap<SignalId, Blamed> {
    let mut blamed: BTreeMap<SignalId, Blamed> = BTreeMap::new();
    for fault in findings.signals() {
        for signal in findings.signal(fault).signals.iter().filter(|&signal| signal != fault) {
            blamed.entry(signal).or_default().signals.insert(fault);
        }
    }
    for fault in findings.fallible().iter() {
        for signal in findings.relation(fault).signals.iter() {
            blamed.entry(signal).or_default().relations.insert(fault);
        }
    }
    blamed
}

/// The relations that read each variable.
fn readers(knowledge: &KnowledgeBase) -> IdVec<VariableId, Vec<RelationId>> {
    let mut readers = IdVec::filled(knowledge.variables().len(), |_| Vec::new());
    for (id, relation) in knowledge.relations().enumerate() {
        for &input in &relation.inputs {
            if relation.outputs.iter().any(|&output| output != input) {
                readers[input].push(id);
            }
        }
    }
    readers
}

/// A way that may be added, or is watched already.
struct Candidate {
    way: Way,
    fault_signature: FaultSignature,
}

impl Candidate {
    fn new(knowledge: &KnowledgeBase, way: Way) -> Candidate {
        Candidate { fault_signature: FaultSignature::of(knowledge, &way), way }
    }

    fn sink(&self) -> VariableId {
        self.way.substitution.sink
    }

    fn is_compared(&self, knowledge: &KnowledgeBase, other: &Candidate) -> bool {
        are_compared(knowledge, self.supported(), other.supported())
    }

    fn supported(&self) -> SupportedWay<'_> {
        SupportedWay { way: &self.way, rests_on: self.fault_signature.rests_on() }
    }

    fn rests_on(&self, measured: &Measured) -> bool {
        self.fault_signature.rests_on().contains(measured.signal)
    }
}

struct Isolation<'a> {
    knowledge: &'a KnowledgeBase,
    graph: &'a Graph,
    readers: IdVec<VariableId, Vec<RelationId>>,
    findings: Findings,
    most: usize,
    expanded: u64,
    /// The number of comparisons examined.
    looked: u64,
}

impl Isolation<'_> {
    /// The components among these whose faults are still not isolable from the signal's.
    fn still(&self, blamed: &Blamed, measured: &Measured) -> Blamed {
        let Measured { signal: own, followers, .. } = measured;
        let signals = blamed.signals.iter().filter(|&it| !followers.contains(it));
        let relations = blamed.relations.iter();
        Blamed {
            signals: signals.filter(|&it| self.findings.signal(it).signals.contains(*own)).collect(),
            relations: relations.filter(|&it| self.findings.relation(it).signals.contains(*own)).collect(),
        }
    }

    fn look_behind(
        &mut self,
        measured: &Measured,
        blamed: &Blamed,
        watched: &mut BTreeMap<VariableId, &mut Witnesses>,
        admits: &impl Fn(&Way) -> bool,
    ) {
        if self.still(blamed, measured).is_empty() {
            return;
        }
        let mut candidates = Vec::new();
        let mut beside: BTreeMap<VariableId, Vec<Candidate>> = BTreeMap::new();
        for sink in self.follow_from(measured) {
            let Some(witnesses) = watched.get(&sink).filter(|it| it.ways.len() < self.most) else { continue };
            let found = self.candidates(measured, sink, admits);
            if !found.is_empty() {
                let ways = witnesses.ways.iter().take(MOST_COMPARED).cloned();
                let known = ways.map(|way| Candidate::new(self.knowledge, way));
                beside.insert(sink, known.filter(|it| !it.rests_on(measured)).collect());
                candidates.extend(found);
            }
        }
        loop {
            let blamed = self.still(blamed, measured);
            let Some(chosen) = self.best(&candidates, &beside, &blamed) else { break };
            for at in chosen.into_iter().rev() {
                let candidate = candidates.remove(at);
                let sink = candidate.sink();
                let (Some(witnesses), Some(beside)) = (watched.get_mut(&sink), beside.get_mut(&sink)) else {
                    continue;
                };
                for other in beside.iter().filter(|other| candidate.is_compared(self.knowledge, other)) {
                    self.findings.compare(&candidate.fault_signature, &other.fault_signature);
                }
                witnesses.add(candidate.way.clone());
                beside.push(candidate);
                if witnesses.ways.len() >= self.most {
                    candidates.retain(|other| other.sink() != sink);
                    break;
                }
            }
        }
    }

    /// The numbers that are computed from one without passing through another provided number.
    fn follow_from(&self, measured: &Measured) -> Vec<VariableId> {
        let mut reached: BTreeSet<VariableId> = BTreeSet::from([measured.variable]);
        let mut open = Vec::from([measured.variable]);
        let mut found = Vec::new();
        while let Some(variable) = open.pop() {
            for &relation in &self.readers[variable] {
                let relation = &self.knowledge.relations()[relation];
                let outputs = relation.outputs.iter().copied().filter(|&output| output != variable);
                for output in outputs {
                    if !reached.insert(output) {
                        continue;
                    }
                    let is_number = self.knowledge.variables()[output].shape == Shape::Scalar;
                    if is_number {
                        found.push(output);
                    }
                    if !is_number || !self.is_provided(output, measured) {
                        open.push(output);
                    }
                }
            }
        }
        found.sort_unstable();
        found
    }

    /// Whether a variable is provided by a constant or signal that does not depend on the signal.
    fn is_provided(&self, variable: VariableId, measured: &Measured) -> bool {
        let is_left =
            |&signal: &SignalId| self.knowledge.is_available(signal) && !measured.followers.contains(signal);
        self.knowledge.variables()[variable].constant.is_some()
            || self.knowledge.carriers(variable).iter().any(is_left)
    }

    /// Ways of knowing a variable that compute the measured number.
    fn candidates(
        &mut self,
        measured: &Measured,
        sink: VariableId,
        admits: &impl Fn(&Way) -> bool,
    ) -> Vec<Candidate> {
        let knowledge = self.knowledge;
        let expansions = LIMITS.expansions.min(MOST_EXPANDED.saturating_sub(self.expanded));
        let options =
            Options { forbidden_signals: measured.followers.iter().collect(), ..Options::default() };
        let found = plan::best(self.graph, sink, &options, MOST_SEARCHED, Limits { expansions, ..LIMITS });
        self.expanded += 1 + found.expanded;
        let passes = |substitution: &&Substitution| {
            let mut outputs = substitution.steps.iter().map(|step| step.output);
            outputs.any(|output| output == measured.variable) && !substitution.continues_itself(knowledge)
        };
        let usable = |signal| stands(knowledge, signal) && !measured.followers.contains(signal);
        let ways = |substitution| Way::choices(knowledge, substitution, usable, MOST_CHOICES);
        let substitutions = found.substitutions.iter().map(|(substitution, _)| substitution).filter(passes);
        let mut seen = BTreeSet::new();
        let found = substitutions.flat_map(ways).filter(|way| admits(way));
        let found = found.map(|way| Candidate::new(knowledge, way));
        // One of the ways over the same signals and relations represents them all.
        found
            .filter(|it| {
                seen.insert((it.fault_signature.rests_on().clone(), it.way.substitution.relations()))
            })
            .collect()
    }

    /// The place of the candidate, or the places of the pair, that isolates most of the blamed components from the signal, beside
    /// the watched ways. Of equals, the shorter way, then the first.
    fn best(
        &mut self,
        candidates: &[Candidate],
        beside: &BTreeMap<VariableId, Vec<Candidate>>,
        blamed: &Blamed,
    ) -> Option<Vec<usize>> {
        let mut best: Option<(usize, usize, usize)> = None;
        for (at, candidate) in candidates.iter().enumerate() {
            let others = beside.get(&candidate.sink()).into_iter().flatten();
            let gain = self.distinguished(candidate, others, blamed);
            let steps = candidate.way.substitution.steps.len();
            if gain > 0 && best.is_none_or(|(most, least, _)| gain > most || (gain == most && steps < least))
            {
                best = Some((gain, steps, at));
            }
        }
        if let Some((_, _, at)) = best {
            return Some(Vec::from([at]));
        }
        let mut best: Option<(usize, Vec<usize>)> = None;
        for (at, one) in candidates.iter().enumerate() {
            let after = candidates.iter().enumerate().skip(at + 1).take(MOST_PAIRED);
            for (after, other) in after.filter(|(_, other)| other.sink() == one.sink()) {
                let gain = self.distinguished(one, core::iter::once(other), blamed);
                if gain > best.as_ref().map_or(0, |(most, _)| *most) {
                    best = Some((gain, Vec::from([at, after])));
                }
            }
        }
        best.map(|(_, places)| places)
    }

    /// The number of blamed components that the comparisons of a way with others show.
    fn distinguished<'c>(
        &mut self,
        one: &Candidate,
        others: impl Iterator<Item = &'c Candidate>,
        blamed: &Blamed,
    ) -> usize {
        let mut shown = Blamed::default();
        for other in others {
            self.looked += 1;
            if self.looked <= MOST_LOOKED && one.is_compared(self.knowledge, other) {
                shown.signals.extend(&one.fault_signature.shows(&other.fault_signature));
                shown.relations.extend(&one.fault_signature.shows_relations(&other.fault_signature));
            }
        }
        shown.signals.intersect(&blamed.signals);
        shown.relations.intersect(&blamed.relations);
        shown.signals.len() + shown.relations.len()
    }
}

/// Components whose faults are not isolable from one of a signal.
#[derive(Default)]
struct Blamed {
    signals: SignalSet,
    relations: RelationSet,
}

impl Blamed {
    fn is_empty(&self) -> bool {
        self.signals.is_empty() && self.relations.is_empty()
    }
}
