//! A drawing of each substitution (Fig. 1.16 of the thesis).

use anyhow::Context;
use shsa_core::knowledge::{KnowledgeBase, SignalId, SignalSet, VariableId};
use shsa_core::plan::Plan;
use shsa_drawing::Marks;
use std::fs;
use std::path::Path;

/// The most drawings of one search: the best substitutions.
const MOST: usize = 100;

/// Writes the knowledge base with each substitution marked, the best one as `VARIABLE-1.svg`; returns the number of files.
pub(super) fn write(
    knowledge: &KnowledgeBase,
    variable: VariableId,
    plan: &Plan,
    excluded: &[SignalId],
    folder: &Path,
) -> anyhow::Result<usize> {
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let mut lost = SignalSet::new();
    for &signal in excluded {
        lost.insert(signal);
    }
    let name = &knowledge.variables()[variable].name;
    let mut count = 0;
    for (substitution, _) in plan.substitutions.iter().take(MOST) {
        count += 1;
        let marks = Marks { chosen: Some(substitution.clone()), lost: lost.clone() };
        let path = folder.join(format!("{name}-{count}.svg"));
        let drawn = shsa_drawing::svg(knowledge, &marks)?;
        fs::write(&path, drawn + "\n").with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(count)
}
