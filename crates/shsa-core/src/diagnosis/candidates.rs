//! Explanations: sets of components whose faults would explain every conflict, and their probabilities.
//!
//! Two ways of knowing that disagree are a conflict over the components that both rest on: signals, relations, and common causes.
//! At least one of them is faulty. A set of components that meets every conflict explains them all (Reiter 1987, DOI
//! 10.1016/0004-3702(87)90062-2). The probabilities of these sets follow from the priors and from the comparisons that agree (de
//! Kleer and Williams 1987, DOI 10.1016/0004-3702(87)90063-4). One clear answer isolates the fault; with several answers it is
//! not isolated.
//!
//! A hypothesis is a set of faulty components; all others are sound. Its probability is 0 when it misses a conflict, else
//! proportional to the product of
//!
//! * `p` for each faulty component and `1 - p` for each sound one, with the priors `p`;
//! * [`EVEN`] for each agreement of which one way rests on a faulty component, and at most [`MOST_ONE_SIDED`] of them: not
//!   every comparison shows a fault, and comparisons that overlook the same fault are not independent;
//! * [`PRIOR`] for each agreement of which both ways rest on different faulty components: two faults rarely err alike. A
//!   component may affect both of its ways alike, which is no evidence;
//! * [`PRIOR`] when some conflict is met only by components that a relation's condition reads: a wrong value there may
//!   let a relation count where it does not hold. A condition that still holds is no evidence of the size of its inputs, so
//!   an agreement does not count for them.
//!
//! Conflicts that share components, directly or through others, form one [`Part`]; components without a conflict count as sound.

use crate::knowledge::{Id, IdSet};
use crate::numbers::{CLEAR_RATIO, EVEN, HIGHEST_PRIOR, MOST_ONE_SIDED, PRIOR};
use crate::trust::Component;
use alloc::collections::{BTreeMap, BTreeSet, BinaryHeap};
use alloc::vec::Vec;
use core::cmp::Ordering;

/// A comparison of two ways: the components that they rest on, and whether they agree.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The components of the first way.
    pub one: BTreeSet<Component>,
    /// The components of the second way.
    pub other: BTreeSet<Component>,
    /// The components that only conditions of the ways read; not part of the sets above.
    pub conditions: BTreeSet<Component>,
    /// Whether the ways agree; otherwise they conflict.
    pub agrees: bool,
}

/// A minimal set of components whose common failure explains every conflict of a part.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The faulty components, ascending.
    pub components: Vec<Component>,
    /// Proportional to the probability of the explanation.
    pub weight: f64,
}

/// Connected conflicts, and their explanations.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// All components of the conflicts, ascending.
    pub components: Vec<Component>,
    /// The explanations that are probable enough compared with the best one, best first.
    pub candidates: Vec<Candidate>,
    /// Whether there were too many explanations: then each signal is a candidate by itself.
    pub is_cut_off: bool,
}

/// At most this many partial explanations of a part are examined.
const MOST_PARTIAL: usize = 4_096;

/// At most this many products of hypotheses and comparisons are summed for exact probabilities.
const MOST_SUMMED: usize = 1 << 20;

/// Explains conflicts.
///
/// Arguments: the comparisons, and for each component its prior fault probability. Returns the parts of the conflicts, in the
/// order of their first components. Beyond 4,096 partial explanations of a part, each of its signals becomes a candidate.
/// Complexity: that many times the part's comparisons.
#[must_use]
pub fn explain(comparisons: &[Comparison], prior: impl Fn(Component) -> f64) -> Vec<Part> {
    parts(comparisons)
        .into_iter()
        .map(|components| {
            let local = Local::new(comparisons, &components);
            let odds: Vec<f64> = components.iter().map(|&component| odds(prior(component))).collect();
            match local.candidates(&odds) {
                Some(candidates) => Part { candidates, components, is_cut_off: false },
                None => Part { candidates: everyone(&components), components, is_cut_off: true },
            }
        })
        .collect()
}

/// The exact probability of a fault of each component of a part, in the order of [`Part::components`], given the conflicts, the
/// agreements and the priors. `None` where that takes too many steps.
///
/// Components of the same comparisons are summed as one class. Complexity: O(2^n c) for n classes and c comparisons, at most
/// 2^20.
#[must_use]
pub fn probabilities(
    comparisons: &[Comparison],
    part: &Part,
    prior: impl Fn(Component) -> f64,
) -> Option<Vec<f64>> {
    let local = Local::new(comparisons, &part.components);
    let priors: Vec<f64> = part.components.iter().map(|&component| bounded(prior(component))).collect();
    let classes = local.classes();
    let count = classes.iter().max().map_or(0, |last| last + 1);
    let mut sound = alloc::vec![1.0; count];
    for (&class, prior) in classes.iter().zip(&priors) {
        if let Some(sound) = sound.get_mut(class) {
            *sound *= 1.0 - prior;
        }
    }
    let seen = local.of_classes(&classes);
    let is_small = count < 20 && (1_usize << count).saturating_mul(seen.len()) <= MOST_SUMMED;
    if !is_small {
        return None;
    }
    let mut faulty = alloc::vec![0.0; count];
    let mut total = 0.0;
    for hypothesis in 0..1_u32 << count {
        let weight = weight(&seen, &sound, hypothesis);
        total += weight;
        let in_it = faulty.iter_mut().enumerate().filter(|(class, _)| hypothesis >> class & 1 == 1);
        in_it.for_each(|(_, sum)| *sum += weight);
    }
    let share = |(&class, prior): (&usize, &f64)| {
        let (faulty, sound) = (*faulty.get(class)?, *sound.get(class)?);
        Some(faulty / total * prior / (1.0 - sound))
    };
    classes.iter().zip(&priors).map(share).collect()
}

/// A comparison over classes of components as bits.
#[derive(Clone, Copy, Debug)]
struct Seen {
    one: u32,
    other: u32,
    conditions: u32,
    agrees: bool,
}

fn weight(seen: &[Seen], sound: &[f64], hypothesis: u32) -> f64 {
    let misses = |seen: &&Seen| !seen.agrees && (seen.one | seen.other) & hypothesis == 0;
    let mut missed = seen.iter().filter(misses).peekable();
    let by_condition = if missed.peek().is_some() { PRIOR } else { 1.0 };
    if missed.any(|seen| seen.conditions & hypothesis == 0) {
        return 0.0;
    }
    let prior: f64 = sound
        .iter()
        .enumerate()
        .map(|(class, sound)| if hypothesis >> class & 1 == 1 { 1.0 - sound } else { *sound })
        .product();
    let touched = seen.iter().filter(|seen| seen.agrees).map(|seen| {
        let (one, other) = (seen.one & hypothesis, seen.other & hypothesis);
        Touched::new(one != 0, other != 0, one & other != 0)
    });
    prior * by_condition * agreement(touched)
}

/// How a hypothesis touches a comparison.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Touched {
    Not,
    OneSide,
    BothSides,
}

impl Touched {
    /// `alike`: one faulty component is on both sides, so the agreement is no evidence.
    fn new(one: bool, other: bool, alike: bool) -> Touched {
        match (one, other) {
            _ if alike => Touched::Not,
            (true, true) => Touched::BothSides,
            (false, false) => Touched::Not,
            _ => Touched::OneSide,
        }
    }
}

/// The likelihood of agreements.
fn agreement(touched: impl Iterator<Item = Touched>) -> f64 {
    let (mut one_sided, mut likelihood) = (0, 1.0);
    for touched in touched {
        match touched {
            Touched::OneSide if one_sided < MOST_ONE_SIDED => {
                one_sided += 1;
                likelihood *= EVEN;
            }
            Touched::BothSides => likelihood *= PRIOR,
            Touched::OneSide | Touched::Not => {}
        }
    }
    likelihood
}

fn bounded(prior: f64) -> f64 {
    prior.clamp(f64::MIN_POSITIVE, HIGHEST_PRIOR)
}

fn odds(prior: f64) -> f64 {
    bounded(prior) / (1.0 - bounded(prior))
}

/// The components of each group of connected conflicts.
fn parts(comparisons: &[Comparison]) -> Vec<Vec<Component>> {
    let mut parts: Vec<BTreeSet<Component>> = Vec::new();
    for conflict in comparisons.iter().filter(|comparison| !comparison.agrees) {
        let mut whole: BTreeSet<Component> = conflict.one.union(&conflict.other).copied().collect();
        whole.extend(&conflict.conditions);
        let (joined, apart): (Vec<_>, Vec<_>) = parts.into_iter().partition(|part| !part.is_disjoint(&whole));
        whole.extend(joined.into_iter().flatten());
        parts = apart;
        parts.push(whole);
    }
    parts.sort_unstable();
    parts.into_iter().map(|part| part.into_iter().collect()).collect()
}

/// Each signal of a part as an explanation by itself: there are too many faults to enumerate.
fn everyone(components: &[Component]) -> Vec<Candidate> {
    let signals = components.iter().filter(|component| matches!(component, Component::Signal(_)));
    signals.map(|&component| Candidate { components: Vec::from([component]), weight: 0.0 }).collect()
}

/// A component's place in its part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Place(usize);

impl Id for Place {
    fn from_index(index: usize) -> Place {
        Place(index)
    }
    fn index(self) -> usize {
        self.0
    }
}

type PlaceSet = IdSet<Place>;

/// A part whose components are numbered from 0.
struct Local<'c> {
    components: &'c [Component],
    conflicts: Vec<Sides>,
    agreements: Vec<Sides>,
}

/// A comparison, by the numbers of components.
struct Sides {
    one: PlaceSet,
    other: PlaceSet,
    /// Empty in an agreement.
    conditions: PlaceSet,
}

impl Sides {
    /// Whether one of the ways contains one of the given components.
    fn meet(&self, places: &PlaceSet) -> bool {
        places.meets(&self.one) || places.meets(&self.other)
    }
}

/// An explanation of every conflict, with its weight.
struct Found {
    places: PlaceSet,
    weight: f64,
    /// Whether it explains some conflict only through a condition.
    by_condition: bool,
}

/// An explanation that may still miss conflicts.
#[derive(PartialEq)]
struct Partial {
    prior: f64,
    places: PlaceSet,
}

impl Eq for Partial {}

impl Ord for Partial {
    /// The more probable one is greater; of equals, the one earlier in file order.
    fn cmp(&self, other: &Partial) -> Ordering {
        self.prior.total_cmp(&other.prior).then_with(|| other.places.iter().cmp(self.places.iter()))
    }
}

impl PartialOrd for Partial {
    fn partial_cmp(&self, other: &Partial) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<'c> Local<'c> {
    fn new(comparisons: &[Comparison], components: &'c [Component]) -> Local<'c> {
        let numbers: BTreeMap<Component, usize> =
            components.iter().enumerate().map(|(number, &component)| (component, number)).collect();
        let places = |side: &BTreeSet<Component>| -> PlaceSet {
            side.iter().filter_map(|component| numbers.get(component)).map(|&number| Place(number)).collect()
        };
        let mut local = Local { components, conflicts: Vec::new(), agreements: Vec::new() };
        for comparison in comparisons {
            let (one, other) = (places(&comparison.one), places(&comparison.other));
            let conditions = if comparison.agrees { PlaceSet::new() } else { places(&comparison.conditions) };
            if one.is_empty() && other.is_empty() && conditions.is_empty() {
                continue;
            }
            let list = if comparison.agrees { &mut local.agreements } else { &mut local.conflicts };
            list.push(Sides { one, other, conditions });
        }
        local
    }

    /// Minimal explanations by falling prior, until no other can come near the best; `None` when there are too many.
    fn candidates(&self, odds: &[f64]) -> Option<Vec<Candidate>> {
        let mut open = BinaryHeap::from([Partial { prior: 1.0, places: PlaceSet::new() }]);
        let mut seen: BTreeSet<PlaceSet> = BTreeSet::new();
        let mut found: Vec<Found> = Vec::new();
        let mut best = 0.0_f64;
        let mut steps = 0;
        while let Some(Partial { prior, places }) = open.pop() {
            if prior * CLEAR_RATIO < best {
                break;
            }
            steps += 1;
            if steps > MOST_PARTIAL || open.len() > 16 * MOST_PARTIAL {
                return None;
            }
            // A subset explains everything without a condition, and was found first, as it is more probable.
            if found.iter().any(|it| !it.by_condition && places.covers(&it.places)) {
                continue;
            }
            let missed = self.first_missed(&places);
            let to_meet = missed.or_else(|| self.first_by_condition(&places));
            if missed.is_none() {
                let by_condition = to_meet.is_some();
                let is_more = by_condition && found.iter().any(|it| places.covers(&it.places));
                if !is_more {
                    let weight = prior * self.likelihood(&places);
                    best = best.max(weight);
                    found.push(Found { places: places.clone(), weight, by_condition });
                }
            }
            let Some(to_meet) = to_meet else { continue };
            let conditions = missed.into_iter().flat_map(|missed| missed.conditions.iter());
            let members = to_meet.one.iter().chain(to_meet.other.iter()).chain(conditions);
            let with = members.filter_map(|place| Some((place, prior * odds.get(place.0)?)));
            for (place, prior) in with.filter(|(_, prior)| prior * CLEAR_RATIO >= best) {
                let mut larger = places.clone();
                larger.insert(place);
                if seen.insert(larger.clone()) {
                    open.push(Partial { prior, places: larger });
                }
            }
        }
        found.retain(|it| it.weight * CLEAR_RATIO >= best);
        found
            .sort_by(|a, b| b.weight.total_cmp(&a.weight).then_with(|| a.places.iter().cmp(b.places.iter())));
        Some(found.iter().map(|it| self.candidate(&it.places, it.weight)).collect())
    }

    fn candidate(&self, places: &PlaceSet, weight: f64) -> Candidate {
        let components = places.iter().filter_map(|place| self.components.get(place.0).copied()).collect();
        Candidate { components, weight }
    }

    /// The first conflict that none of these components explains.
    fn first_missed(&self, places: &PlaceSet) -> Option<&Sides> {
        self.conflicts.iter().find(|sides| !sides.meet(places) && !places.meets(&sides.conditions))
    }

    /// The first conflict that these components explain at most through a condition.
    fn first_by_condition(&self, places: &PlaceSet) -> Option<&Sides> {
        self.conflicts.iter().find(|sides| !sides.meet(places))
    }

    fn likelihood(&self, faulty: &PlaceSet) -> f64 {
        let by_condition = if self.first_by_condition(faulty).is_some() { PRIOR } else { 1.0 };
        by_condition
            * agreement(self.agreements.iter().map(|Sides { one, other, .. }| {
                let mut alike = one.iter().filter(|&place| other.contains(place) && faulty.contains(place));
                Touched::new(faulty.meets(one), faulty.meets(other), alike.next().is_some())
            }))
    }

    /// The class number of each component: components of one class are on the same sides of the same comparisons.
    fn classes(&self) -> Vec<usize> {
        let comparisons = || self.conflicts.iter().chain(&self.agreements);
        let mut numbers: BTreeMap<Vec<[bool; 3]>, usize> = BTreeMap::new();
        let class = |number: usize| {
            let sides = comparisons().map(|Sides { one, other, conditions }| {
                [one, other, conditions].map(|side| side.contains(Place(number)))
            });
            let next = numbers.len();
            *numbers.entry(sides.collect()).or_insert(next)
        };
        (0..self.components.len()).map(class).collect()
    }

    fn of_classes(&self, classes: &[usize]) -> Vec<Seen> {
        let bits = |places: &PlaceSet| {
            let classes = places.iter().filter_map(|place| classes.get(place.0));
            classes.fold(0_u32, |bits, &class| bits | 1_u32.checked_shl(class as u32).unwrap_or(0))
        };
        let seen = |agrees| {
            move |Sides { one, other, conditions }: &Sides| Seen {
                one: bits(one),
                other: bits(other),
                conditions: bits(conditions),
                agrees,
            }
        };
        self.conflicts.iter().map(seen(false)).chain(self.agreements.iter().map(seen(true))).collect()
    }
}

#[cfg(test)]
mod tests;
