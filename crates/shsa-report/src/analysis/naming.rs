//! The names of a model's elements, and the reasons why comparisons isolate fewer faults than the structure.

use shsa_core::analysis::{Gap, Obstacle, Watch};
use shsa_core::knowledge::{KnowledgeBase, RelationId, SignalId, VariableId};
use shsa_core::trust::Component;

/// A component, and the components that its fault is not isolable from.
type Apart = (Component, Vec<Component>);

/// The most faults that are named for one reason.
const MOST_NAMED: usize = 12;

/// The names of a model.
#[derive(Clone, Copy)]
pub(super) struct Names<'a> {
    knowledge: &'a KnowledgeBase,
}

impl<'a> Names<'a> {
    pub(super) fn new(knowledge: &'a KnowledgeBase) -> Names<'a> {
        Names { knowledge }
    }

    pub(super) fn signal(&self, signal: SignalId) -> &'a str {
        &self.knowledge.signals()[signal].name
    }

    pub(super) fn variable(&self, variable: VariableId) -> &'a str {
        &self.knowledge.variables()[variable].name
    }

    /// The name of a signal, relation or cause.
    pub(super) fn component(&self, component: Component) -> &'a str {
        match component {
            Component::Signal(signal) => self.signal(signal),
            Component::Relation(relation) => &self.knowledge.relations()[relation].name,
            Component::Cause(cause) => &self.knowledge.causes()[cause].name,
        }
    }

    /// Describes the obstacles of a residual.
    pub(super) fn obstacles(&self, obstacles: &[Obstacle]) -> String {
        obstacles.iter().map(|obstacle| self.obstacle(obstacle)).collect::<Vec<_>>().join("; ")
    }

    fn obstacle(&self, obstacle: &Obstacle) -> String {
        let relation = |id: &RelationId| self.component(Component::Relation(*id));
        match obstacle {
            Obstacle::Loop { relations, variables, is_dynamic } => {
                let relations: Vec<&str> = relations.iter().map(relation).collect();
                let variables: Vec<&str> = variables.iter().map(|it| self.variable(*it)).collect();
                let kind = if *is_dynamic { "a differential equation" } else { "an algebraic loop" };
                let (relations, variables) = (listed(&relations), listed(&variables));
                format!("{relations} would have to be solved together for {variables} ({kind})")
            }
            Obstacle::Direction { relation: id, variable } => {
                format!("{} is not solved for {}", relation(id), self.variable(*variable))
            }
            Obstacle::NotRun { relation: id } => {
                format!("{} is not counted on, as no formula of it can run for that", relation(id))
            }
            Obstacle::Derived { signal } => {
                format!("how {} is derived is not in the model", self.signal(*signal))
            }
            Obstacle::LeftOut => {
                "what would tell it is not watched (--watch, --watch-cost, or a limit of the search)"
                    .to_owned()
            }
            Obstacle::NotSearched => "a limit of the search was reached before a reason was found".to_owned(),
        }
    }

    /// Faults that only the structure isolates, one line for each reason, in the order of first occurrence.
    pub(super) fn by_reason(&self, gaps: &[Gap]) -> Vec<String> {
        let mut by_reason: Vec<(&[Obstacle], Vec<Apart>)> = Vec::new();
        for Gap { fault, from, obstacles } in gaps {
            let at = by_reason.iter().position(|(known, _)| known == obstacles).unwrap_or_else(|| {
                by_reason.push((obstacles, Vec::new()));
                by_reason.len() - 1
            });
            let faults = &mut by_reason[at].1;
            match faults.last_mut() {
                Some((same, others)) if same == fault => others.extend(from),
                _ => faults.push((*fault, from.iter().copied().collect())),
            }
        }
        let described = |(fault, others): &(Component, Vec<Component>)| match others.as_slice() {
            [] => format!("{} at all", self.component(*fault)),
            others => {
                let others: Vec<&str> = others.iter().map(|&other| self.component(other)).collect();
                format!("{} from {}", self.component(*fault), listed(&others))
            }
        };
        let line = |(obstacles, faults): (&[Obstacle], Vec<(Component, Vec<Component>)>)| {
            let more = faults.len().saturating_sub(MOST_NAMED);
            let mut faults: Vec<String> = faults.iter().take(MOST_NAMED).map(described).collect();
            if more > 0 {
                faults.push(format!("and {more} more"));
            }
            format!("{}: {}", faults.join("; "), self.obstacles(obstacles))
        };
        by_reason.into_iter().map(line).collect()
    }
}

/// How many ways of a variable are monitored: `3 of 3`, `32 of 256 or more`.
pub(super) fn ways(watch: &Watch) -> String {
    match watch.exact {
        true => format!("{} of {}", watch.ways, watch.possible),
        false => format!("{} of {} or more", watch.ways, watch.possible),
    }
}

/// `a`, `a and b`, `a, b and c`.
fn listed(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [others @ .., last] => format!("{} and {last}", others.join(", ")),
    }
}
