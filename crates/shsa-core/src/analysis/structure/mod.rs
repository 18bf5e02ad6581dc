//! Structural redundancy: which equations of a knowledge base can contradict each other, and thus show a fault.
//!
//! Every relation is an equation over its variables (inputs, outputs, and those of its condition); every usable signal is an
//! equation for its variable; constants are known. Only *which* variables an equation contains counts, not how, nor in which
//! directions it can be solved: the results are the best that any method can reach with these equations. A derivative and its
//! variable are two unknowns with an equation between them (`climb = derivative(height, 1 s)`).
//!
//! # What may be faulty
//!
//! Every signal, except with a property `prior` (the probability of a fault) below [`NEGLIGIBLE`]: it is taken for
//! granted. Relations only with a `prior` from [`NEGLIGIBLE`] on. So a fault variable of the literature is written
//! as the prior of the equation in which it stands: `balance: { equation: .., properties: { prior: 0.01 } }` may
//! leak. It is one fault for each equation; no structure distinguishes several faults of which it knows the sum only.
//!
//! # Derived signals
//!
//! A derived signal is no witness of its own. It counts as a relation between its variable and those of its origins, and not at
//! all when these are the same variable. The same applies to a second name of the same field of the same source.
//!
//! # The words
//!
//! | | |
//! |---|---|
//! | overdetermined part | the equations that are still determined when any one of them is left out: faults in them are detectable |
//! | class | equations of that part that only go together: faults in one class cannot be told apart |
//! | MSO | minimal structurally overdetermined set: one equation more than unknowns, and no smaller such set in it: one residual |
//! | MTES | minimal test equation support: all equations that can be used in a test that reacts to as few faults as possible |

mod matching;
mod decomposition;
mod redundant;
mod search;
mod sets;
mod solving;

pub use crate::knowledge::NEGLIGIBLE;
pub use decomposition::{Decomposition, Part};
pub use sets::Sets;
pub use solving::Solving;

use crate::knowledge::{Id, IdSet, IdVec, KnowledgeBase, Relation, RelationId, Signal, SignalId, VariableId};
use crate::plan::{Limits, StopReason};
use alloc::vec::Vec;
use matching::Incidence;
use redundant::{Redundant, Row};
use search::Search;
use sets::Found;

/// An equation of a structure: relations in file order, then signals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct EquationId(u32);

impl Id for EquationId {
    fn from_index(index: usize) -> Self {
        EquationId(u32::try_from(index).unwrap_or(u32::MAX))
    }
    fn index(self) -> usize {
        self.0 as usize
    }
}

/// A set of equations.
pub type EquationSet = IdSet<EquationId>;

/// The element that an equation stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Origin {
    /// A relation holds.
    Relation(RelationId),
    /// A signal carries its variable.
    Signal(SignalId),
}

/// One equation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Equation {
    /// The element that the equation stands for.
    pub origin: Origin,
    /// The unknowns of the equation, ascending.
    pub variables: Vec<VariableId>,
    /// Whether a violation of the equation counts as a fault.
    pub may_fail: bool,
}

/// The default limits of searches: about a second, and at most 20 MB for the sets.
///
/// An expansion is a visited edge between an equation and a variable; a state is a set that was found.
pub const LIMITS: Limits = Limits { expansions: 20_000_000, states: 100_000 };

/// The equations of a knowledge base over its unknown variables.
#[derive(Clone, Debug)]
pub struct Structure {
    equations: IdVec<EquationId, Equation>,
    incidence: Incidence<EquationId, VariableId>,
    decomposition: Decomposition,
}

/// Structural detectability and isolability of faults.
#[derive(Clone, Debug, PartialEq)]
pub struct Isolability {
    class: IdVec<EquationId, Option<usize>>,
    classes: Vec<Vec<EquationId>>,
    /// The reason for the end: with a limit, the unexamined equations of the overdetermined part are in the last class of their
    /// connected part.
    pub stop: StopReason,
    /// The number of visited edges.
    pub expanded: u64,
}

impl Isolability {
    /// Whether a fault in this equation is detectable at all.
    #[must_use]
    pub fn is_detectable(&self, equation: EquationId) -> bool {
        self.class.find(equation).is_some_and(Option::is_some)
    }

    /// Whether a fault in `equation` is isolable from one in `other`.
    #[must_use]
    pub fn is_isolable(&self, equation: EquationId, other: EquationId) -> bool {
        self.is_detectable(equation) && self.class.find(equation) != self.class.find(other)
    }

    /// Classes of overdetermined equations whose faults are not isolable from each other.
    #[must_use]
    pub fn classes(&self) -> &[Vec<EquationId>] {
        &self.classes
    }
}

impl Structure {
    /// The structure of a knowledge base as it is now: unavailable signals are left out.
    ///
    /// O(edges * sqrt(equations)), as [`Structure::decomposition`] is computed here.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase) -> Structure {
        let mut equations: IdVec<EquationId, Equation> = IdVec::new();
        let unknown: IdSet<VariableId> = knowledge
            .variables()
            .enumerate()
            .filter(|(_, v)| v.constant.is_none())
            .map(|(id, _)| id)
            .collect();
        for (id, relation) in knowledge.relations().enumerate() {
            equations.push(of_relation(id, relation, &unknown));
        }
        for (id, signal) in knowledge.signals().enumerate().filter(|(id, _)| knowledge.is_available(*id)) {
            if let Some(equation) = of_signal(knowledge, id, signal, &unknown) {
                equations.push(equation);
            }
        }
        let rows = IdVec::filled(equations.len(), |id| equations[id].variables.clone());
        let incidence = Incidence::new(rows, knowledge.variables().len());
        let decomposition = Decomposition::new(&incidence, &unknown);
        Structure { equations, incidence, decomposition }
    }

    /// All equations.
    #[must_use]
    pub fn equations(&self) -> &IdVec<EquationId, Equation> {
        &self.equations
    }

    /// The equation of a signal; `None` when the signal is unavailable, or derived from signals of its own variable.
    #[must_use]
    pub fn of_signal(&self, signal: SignalId) -> Option<EquationId> {
        self.of(Origin::Signal(signal))
    }

    /// The equation of a relation; `None` for a relation of another knowledge base.
    #[must_use]
    pub fn of_relation(&self, relation: RelationId) -> Option<EquationId> {
        self.of(Origin::Relation(relation))
    }

    /// Binary search: equations are in the order of their origins.
    fn of(&self, origin: Origin) -> Option<EquationId> {
        let (mut low, mut high) = (0, self.equations.len());
        while low < high {
            let middle = EquationId::from_index(low.midpoint(high));
            match self.equations[middle].origin.cmp(&origin) {
                core::cmp::Ordering::Less => low = middle.index() + 1,
                core::cmp::Ordering::Equal => return Some(middle),
                core::cmp::Ordering::Greater => high = middle.index(),
            }
        }
        None
    }

    /// The Dulmage-Mendelsohn decomposition.
    #[must_use]
    pub fn decomposition(&self) -> &Decomposition {
        &self.decomposition
    }

    /// The equations of a set that may fail: a test of this set reacts to these faults.
    #[must_use]
    pub fn support(&self, equations: &EquationSet) -> EquationSet {
        equations.iter().filter(|&equation| self.may_fail(equation)).collect()
    }

    /// Detectability and isolability of faults.
    ///
    /// O(edges) for each class, within each connected part. Krysander and Frisk 2008,
    /// doi:10.1109/TSMCA.2008.2003968. The states of the limits are not used.
    #[must_use]
    pub fn isolability(&self, limits: Limits) -> Isolability {
        let mut found = Isolability {
            class: IdVec::filled(self.equations.len(), |_| None),
            classes: Vec::new(),
            stop: StopReason::Complete,
            expanded: 0,
        };
        for mut part in self.parts() {
            let rows: Vec<Row> = part.present().iter().collect();
            let mut rest = part.present().clone();
            for &row in &rows {
                if !rest.contains(row) {
                    continue;
                }
                let is_limited = found.expanded.saturating_add(part.visits()) >= limits.expansions;
                let class = if is_limited { rest.iter().collect() } else { part.class(row, &rows) };
                if is_limited {
                    found.stop = StopReason::LimitExpansions;
                }
                class.iter().for_each(|&row| rest.remove(row));
                let class: Vec<EquationId> = class.into_iter().map(|row| part.equations()[row]).collect();
                class.iter().for_each(|&equation| found.class[equation] = Some(found.classes.len()));
                found.classes.push(class);
            }
            found.expanded += part.visits();
        }
        found
    }

    /// All minimal structurally overdetermined sets (MSO), as many as the limits allow.
    ///
    /// Their number grows as the number of equations to the power of the redundancy; each costs at least O(edges). Krysander,
    /// Aslund and Nyberg 2008, doi:10.1109/TSMCA.2007.909555.
    #[must_use]
    pub fn overdetermined_sets(&self, limits: Limits) -> Sets {
        let mut found = Found::new(limits);
        for mut part in self.parts() {
            let equations = part.equations().clone();
            let all = part.present().clone();
            let mut search = Search::new(&mut part, all);
            found.gather(&mut search, |_, rows| rows.iter().map(|&row| equations[row]).collect());
        }
        found.finished()
    }

    /// All minimal test equation supports (MTES), as many as the limits allow.
    ///
    /// Each is the largest set with its faults ([`Structure::support`]): it also contains equations that are overdetermined
    /// without any fault. Krysander, Aslund and Frisk 2010, "A structural algorithm for finding testable sub-models and multiple
    /// fault isolability analysis", 21st International Workshop on Principles of Diagnosis.
    #[must_use]
    pub fn test_supports(&self, limits: Limits) -> Sets {
        let sound: Vec<EquationId> =
            self.decomposition.over.equations.iter().copied().filter(|&id| !self.may_fail(id)).collect();
        let background: EquationSet = self.incidence.overdetermined(&sound).into_iter().collect();
        let mut found = Found::new(limits);
        for mut part in self.parts() {
            let equations = part.equations().clone();
            let all: Vec<Row> = part.present().iter().collect();
            let faulty = all.iter().copied().filter(|&row| self.may_fail(equations[row])).collect();
            let mut search = Search::new(&mut part, faulty);
            found.gather(&mut search, |search, rows| {
                let support: IdSet<Row> = rows.into_iter().filter(|&row| search.may_miss(row)).collect();
                let rows: Vec<Row> = all
                    .iter()
                    .copied()
                    .filter(|&row| support.contains(row) || !search.may_miss(row))
                    .collect();
                let mut set = background.clone();
                set.extend(&search.overdetermined(&rows).into_iter().map(|row| equations[row]).collect());
                set
            });
        }
        found.finished()
    }

    /// The solving of a minimal overdetermined set with the fewest equations in loops or in impossible directions; `solves` says
    /// whether an equation can be solved for a variable. `None` for a set that is not minimal.
    ///
    /// Complexity: O(n edges sqrt(n)) for n equations.
    #[must_use]
    pub fn solving(
        &self,
        set: &EquationSet,
        solves: &dyn Fn(EquationId, VariableId) -> bool,
    ) -> Option<Solving> {
        solving::best(&self.incidence, set, solves)
    }

    /// A minimal overdetermined set that contains one equation and not another; `None` where there is none.
    ///
    /// Complexity: O(edges sqrt(n)) for each of n equations.
    #[must_use]
    pub fn overdetermined_set(&self, with: EquationId, without: Option<EquationId>) -> Option<EquationSet> {
        let kept = self.equations.ids().filter(|&equation| Some(equation) != without);
        let mut rows = self.incidence.overdetermined(&kept.collect::<Vec<_>>());
        if !rows.contains(&with) {
            return None;
        }
        for equation in rows.clone() {
            let fewer: Vec<EquationId> = rows.iter().copied().filter(|&row| row != equation).collect();
            let fewer = self.incidence.overdetermined(&fewer);
            if equation != with && rows.contains(&equation) && fewer.contains(&with) {
                rows = fewer;
            }
        }
        Some(rows.into_iter().collect())
    }

    fn may_fail(&self, equation: EquationId) -> bool {
        self.equations.find(equation).is_some_and(|equation| equation.may_fail)
    }

    fn parts(&self) -> Vec<Redundant> {
        Redundant::parts(&self.incidence, &self.decomposition.over.equations)
    }
}

fn of_relation(id: RelationId, relation: &Relation, unknown: &IdSet<VariableId>) -> Equation {
    let named: IdSet<VariableId> = relation.inputs.iter().chain(&relation.outputs).copied().collect();
    let variables = named.iter().filter(|&variable| unknown.contains(variable)).collect();
    let may_fail = relation.properties.prior().is_some_and(|prior| prior >= NEGLIGIBLE);
    Equation { origin: Origin::Relation(id), variables, may_fail }
}

fn of_signal(
    knowledge: &KnowledgeBase,
    id: SignalId,
    signal: &Signal,
    unknown: &IdSet<VariableId>,
) -> Option<Equation> {
    // A second name of the same measurement is derived from the first.
    let first = Some(knowledge.witness(id)).filter(|&first| first != id);
    let origins = signal.derived_from.iter().copied().chain(first);
    let is_derived = first.is_some() || !signal.derived_from.is_empty();
    let origins = origins.map(|origin| knowledge.signals()[origin].variable);
    let named: IdSet<VariableId> = origins.chain([signal.variable]).collect();
    if is_derived && named.len() == 1 {
        return None;
    }
    let variables = named.iter().filter(|&variable| unknown.contains(variable)).collect();
    let may_fail = signal.properties.prior().is_none_or(|prior| prior >= NEGLIGIBLE);
    Some(Equation { origin: Origin::Signal(id), variables, may_fail })
}
