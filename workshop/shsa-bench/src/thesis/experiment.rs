//! The graphs of the experiments.

use super::generate::{Branching, Tree};
use anyhow::{Context, anyhow};
use shsa_core::knowledge::{Id, KnowledgeBase, VariableId};
use std::fmt;

/// An experiment or case study of the thesis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub(super) enum Experiment {
    /// Complete trees by depth; only the leaves are provided.
    Ex1,
    /// Complete trees by depth; the deeper a variable is, the more likely it is provided.
    Ex2,
    /// As ex2, by the number of children.
    Ex3,
    /// As ex3, with random costs of relations.
    Ex3c,
    /// Random trees by the largest number of children.
    Ex4,
    /// The distance to an obstacle.
    Rover,
    /// The steering angle of a car.
    Drivetrain,
}

impl Experiment {
    const ALL: [Experiment; 7] = [
        Experiment::Ex1,
        Experiment::Ex2,
        Experiment::Ex3,
        Experiment::Ex3c,
        Experiment::Ex4,
        Experiment::Rover,
        Experiment::Drivetrain,
    ];

    pub(super) fn name(self) -> &'static str {
        match self {
            Experiment::Ex1 => "ex1",
            Experiment::Ex2 => "ex2",
            Experiment::Ex3 => "ex3",
            Experiment::Ex3c => "ex3c",
            Experiment::Ex4 => "ex4",
            Experiment::Rover => "rover",
            Experiment::Drivetrain => "drivetrain",
        }
    }

    /// The sizes of the experiment's trees, as branching and depth; none for a case study.
    fn sizes(self) -> Vec<(usize, usize)> {
        match self {
            Experiment::Ex1 => [2, 4, 6, 8, 10].map(|depth| (2, depth)).to_vec(),
            Experiment::Ex2 => [2, 4, 6, 8, 10, 12, 14, 16, 18].map(|depth| (2, depth)).to_vec(),
            Experiment::Ex3 => [1, 2, 3, 4].map(|branch| (branch, 6)).to_vec(),
            Experiment::Ex3c => [2, 3].map(|branch| (branch, 6)).to_vec(),
            Experiment::Ex4 => [1, 2, 3, 4, 5, 6].map(|branch| (branch, 8)).to_vec(),
            Experiment::Rover | Experiment::Drivetrain => Vec::new(),
        }
    }

    /// The kind of its trees.
    fn tree(self, branch: usize, depth: usize) -> Tree {
        Tree {
            branch,
            depth,
            branching: if self == Experiment::Ex4 { Branching::Random } else { Branching::Complete },
            availability: (self != Experiment::Ex1).then_some(0.2),
            costs: self == Experiment::Ex3c,
            both_ways: self != Experiment::Ex4,
        }
    }

    /// A case study's model and its root variable.
    fn model(self) -> Option<(&'static str, &'static str)> {
        match self {
            Experiment::Rover => Some((include_str!("../../../../models/rover.yaml"), "v_dmin")),
            Experiment::Drivetrain => {
                Some((include_str!("../../../../models/drivetrain.yaml"), "steering_angle"))
            }
            _ => None,
        }
    }
}

/// The common facts of the cases in one row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Kind {
    pub(super) experiment: Experiment,
    /// Branching and depth of a tree; `None` for a case study.
    pub(super) size: Option<(usize, usize)>,
}

impl fmt::Display for Kind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.experiment.name();
        match self.size {
            None => write!(formatter, "{name}"),
            Some((branch, depth)) => write!(formatter, "{name} b{branch} d{depth}"),
        }
    }
}

/// One graph with its root variable.
#[derive(Clone, Copy, Debug)]
pub(super) struct Case {
    pub(super) kind: Kind,
    pub(super) seed: u64,
}

impl fmt::Display for Case {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}, seed {}", self.kind, self.seed)
    }
}

impl Case {
    /// The graph and its root variable.
    ///
    /// # Errors
    /// When the model of a case study is invalid.
    pub(super) fn knowledge(&self) -> anyhow::Result<(KnowledgeBase, VariableId)> {
        let Kind { experiment, size } = self.kind;
        if let Some((branch, depth)) = size {
            return Ok((experiment.tree(branch, depth).generate(self.seed), VariableId::from_index(0)));
        }
        let (text, variable) = experiment.model().context("an experiment without graphs")?;
        let loaded = shsa_model::load(text, experiment.name());
        let root = loaded.knowledge.variable(variable);
        let root = root.ok_or_else(|| anyhow!("{}: {}", experiment.name(), loaded.report.render(false)))?;
        Ok((loaded.knowledge, root))
    }

    /// The approximate effort of a case, for the progress bar.
    pub(super) fn effort(&self) -> u64 {
        self.kind.size.map_or(1, |(branch, depth)| (branch * depth) as u64)
    }
}

/// The graphs of some experiments, or of all when none is named.
pub(super) fn cases(experiments: &[Experiment], seeds: usize) -> Vec<Case> {
    let asked = |experiment: &Experiment| experiments.is_empty() || experiments.contains(experiment);
    let of = |experiment: Experiment| {
        let sizes = experiment.sizes().into_iter().map(Some).collect::<Vec<_>>();
        let sizes = if sizes.is_empty() { vec![None] } else { sizes };
        let random = !matches!(experiment, Experiment::Ex1 | Experiment::Rover | Experiment::Drivetrain);
        let seeds = if random { seeds as u64 } else { 1 };
        sizes
            .into_iter()
            .flat_map(move |size| (0..seeds).map(move |seed| Case { kind: Kind { experiment, size }, seed }))
    };
    Experiment::ALL.into_iter().filter(asked).flat_map(of).collect()
}
