//! What a person adds to a draft: units, what does not measure the same, and needs.

use super::text::timeout;
use super::{Because, Column, Columns, Drafted, Group, Member};

/// A variable that must stay available.
#[derive(Clone, Debug, PartialEq)]
pub struct Needed {
    /// The group of the signals that measure it.
    pub group: usize,
    /// How old a published value may be, as models write it: `300 ms`.
    pub max_age: String,
}

impl Column {
    /// Whether its values change.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.signal.points.windows(2).any(|pair| pair[0].1 != pair[1].1)
    }
}

impl Columns {
    /// States the unit of a column whose header has none. A text that is no unit stays open, as one of a header would.
    pub fn set_unit(&mut self, column: usize, unit: &str) {
        self.about[column].declared_unit = Some(unit.to_owned());
        self.columns[column].take_unit(unit);
    }
}

impl Drafted {
    /// Makes a group of its own of a column that does not measure the same as the first one of its group.
    pub fn part(&mut self, group: usize, column: usize) {
        self.groups[group].members.retain(|it| it.column != column);
        let alone =
            Member { column, delay_s: 0.0, offset: 0.0, apart: 0.0, share: 0.0, because: Because::First };
        self.groups.push(Group { members: vec![alone] });
    }

    /// The first group of those with the most signals; `None` without any.
    #[must_use]
    pub fn most_measured(&self) -> Option<usize> {
        let most = self.groups.iter().map(|group| group.members.len()).max()?;
        self.groups.iter().position(|group| group.members.len() == most)
    }

    /// An age at which the signals of a group would count as silent.
    #[must_use]
    pub fn usual_age(&self, group: usize) -> String {
        let members = self.groups[group].members.iter();
        let facts = members.filter_map(|it| self.facts[it.column].as_ref());
        let slowest = facts.max_by(|one, other| one.period_s.total_cmp(&other.period_s));
        slowest.map_or("1 s".to_owned(), timeout)
    }
}
