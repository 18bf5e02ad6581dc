//! The structural redundancy of a model in figures.

use serde_json::{Value, json};
use shsa_core::analysis::structure::{LIMITS, Part, Sets, Structure};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::plan::StopReason;
use shsa_format::text::counted;

/// Sizes of the parts of a model, and the number of minimal sets of equations that can contradict each other.
pub(super) struct Figures {
    redundancy: usize,
    over: Size,
    just: Size,
    under: Size,
    /// Variables of the underdetermined part, which no equation fixes.
    free: Vec<String>,
    overdetermined_sets: Counted,
    test_supports: Counted,
}

/// The numbers of equations and variables of a part.
struct Size {
    equations: usize,
    variables: usize,
}

impl Size {
    fn of(part: &Part) -> Size {
        Size { equations: part.equations.len(), variables: part.variables.len() }
    }

    fn json(&self) -> Value {
        json!({ "equations": self.equations, "variables": self.variables })
    }
}

/// The number of sets found, and why the search ended.
struct Counted {
    count: usize,
    stop: StopReason,
}

impl Counted {
    fn of(sets: &Sets) -> Counted {
        Counted { count: sets.sets.len(), stop: sets.stop }
    }

    fn json(&self) -> Value {
        json!({ "count": self.count, "stop": self.stop.to_string() })
    }

    fn words(&self) -> String {
        match self.stop {
            StopReason::Complete => self.count.to_string(),
            stop => format!("at least {} ({stop})", self.count),
        }
    }
}

impl Figures {
    pub(super) fn of(knowledge: &KnowledgeBase) -> Figures {
        let structure = Structure::new(knowledge);
        let parts = structure.decomposition();
        let sum = |count: fn(&Part) -> usize| parts.just.iter().map(count).sum();
        let name = |&variable: &_| knowledge.variables()[variable].name.clone();
        Figures {
            redundancy: parts.redundancy(),
            over: Size::of(&parts.over),
            just: Size {
                equations: sum(|part| part.equations.len()),
                variables: sum(|part| part.variables.len()),
            },
            under: Size::of(&parts.under),
            free: parts.under.variables.iter().map(name).collect(),
            overdetermined_sets: Counted::of(&structure.overdetermined_sets(LIMITS)),
            test_supports: Counted::of(&structure.test_supports(LIMITS)),
        }
    }

    pub(super) fn json(&self) -> Value {
        json!({
            "redundancy": self.redundancy,
            "overdetermined": self.over.json(),
            "just_determined": self.just.json(),
            "underdetermined": self.under.json(),
            "free": self.free,
            "mso": self.overdetermined_sets.json(),
            "mtes": self.test_supports.json(),
        })
    }

    /// Rows of a table: the name of a figure, and its value.
    pub(super) fn rows(&self) -> Vec<(&'static str, String)> {
        let size = |size: &Size| match (size.equations, size.variables) {
            (0, 0) => "-".to_owned(),
            (equations, variables) => {
                let equations = counted(equations, "equation");
                format!("{equations} over {}", counted(variables, "variable"))
            }
        };
        vec![
            ("degree of redundancy", self.redundancy.to_string()),
            ("overdetermined part", size(&self.over)),
            ("just-determined part", size(&self.just)),
            ("underdetermined part", size(&self.under)),
            ("minimal overdetermined sets (MSO)", self.overdetermined_sets.words()),
            ("minimal test supports (MTES)", self.test_supports.words()),
        ]
    }
}
