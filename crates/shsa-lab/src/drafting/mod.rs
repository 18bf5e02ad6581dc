//! The first draft of a model from recordings: which columns are signals, which of them measure the same, with which numbers.
//!
//! `recordings -> columns -> facts of each -> roles (constants, what has no times, clocks, copies, running maxima, signals) -> groups of equal signals -> rates -> model file`

mod glitches;
mod dead_band;
mod column;
mod groups;
mod rates;
mod values;
mod columns;
mod text;
mod answers;
mod checked;
mod nothing;

pub use answers::Needed;
pub use checked::checked_text;
pub use column::{Column, Facts};
pub use columns::{About, Columns, Origin, Series};
pub use nothing::why_nothing;
pub use text::{model_text, variable_names};

use crate::LabError;
use crate::campaign::parallel::{Progress, on_all_cores};
use crate::learning::{Copied, Relation, Shape, Signal, copies_among, learn_pairs};

/// What a column is.
#[derive(Clone, Debug, PartialEq)]
pub enum Role {
    /// It has a single value, or none.
    Constant,
    /// Its times do not advance: parameters, formats and texts, which are written once.
    Untimed,
    /// It grows evenly with time: a clock or a counter.
    Clock,
    /// It is computed from another column: `factor * other + offset`, in SI units.
    Copy(Copied),
    /// It is the largest value so far of another column.
    RunningMaximum(usize),
    /// It measures something.
    Signal,
}

/// Why a column belongs to a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Because {
    /// The others are compared with it.
    First,
    /// Its values are those of the first one, but for an offset and a delay.
    Equal,
    /// Its name says that it measures the same, and its values are near.
    Named,
}

/// A column in a group.
#[derive(Clone, Debug, PartialEq)]
pub struct Member {
    /// The column.
    pub column: usize,
    /// How much later than the first one it says the same, seconds.
    pub delay_s: f64,
    /// The median difference from the first one, in its own unit.
    pub offset: f64,
    /// What 95 % of the differences from the first one do not exceed, without the offset, in its own unit.
    pub apart: f64,
    /// The spread of the differences as a share of the spread of the first one.
    pub share: f64,
    /// Why it is here.
    pub because: Because,
}

/// Columns that measure the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// At least one member; the others are compared with the first.
    pub members: Vec<Member>,
}

/// A draft.
#[derive(Clone, Debug, Default)]
pub struct Drafted {
    /// The facts of each column; `None` where it has fewer than two values.
    pub facts: Vec<Option<Facts>>,
    /// The role of each column.
    pub roles: Vec<Role>,
    /// All signals.
    pub groups: Vec<Group>,
    /// Rates and integrals: candidates of relations.
    pub rates: Vec<Relation>,
    /// What must stay available; a draft alone cannot tell.
    pub needs: Vec<Needed>,
}

/// Drafts a model of columns of sessions that meet at these times, in order, and reports the progress. Equal columns give equal drafts. Time: O(pairs of columns), with bounded
/// moments each; on all cores.
///
/// # Errors
/// When a thread panics.
pub fn draft(columns: &[Column], joints: &[f64], progress: &dyn Progress) -> Result<Drafted, LabError> {
    let facts = on_all_cores(columns.len(), None, progress, "columns", |column| Facts::of(&columns[column]))?;
    let signals: Vec<Signal> = columns.iter().map(|it| it.signal.clone()).collect();
    let may_measure = |column: usize| {
        facts[column]
            .as_ref()
            .is_some_and(|it| !it.is_constant() && !it.is_untimed && !it.is_even && it.levels.is_none())
    };
    let learned = learn_pairs(&signals, joints, &may_measure, progress)?;
    let roles: Vec<Role> =
        (0..columns.len()).map(|column| role(columns, &facts, &learned.copies, column)).collect();
    let own: Vec<usize> = (0..columns.len()).filter(|it| roles[*it] == Role::Signal).collect();
    let relations: Vec<Relation> = learned
        .relations
        .into_iter()
        .filter(|it| it.signals().iter().all(|signal| roles[*signal] == Role::Signal))
        .collect();
    let groups = groups::of(columns, joints, &facts, &own, &relations);
    let is_rate = |it: &Relation| matches!(it.shape, Shape::Rate { .. } | Shape::Integral);
    let mut rates: Vec<Relation> = relations.into_iter().filter(is_rate).collect();
    let likely = rates::of(columns, joints, &groups, &rates);
    rates.extend(likely);
    Ok(Drafted { facts, roles, groups, rates, needs: Vec::new() })
}

/// The facts and the roles of columns, without groups. Time: O(n log n) for each column, and O(pairs of columns that look alike).
///
/// # Errors
/// When a thread panics.
pub(crate) fn roles(
    columns: &[Column],
    joints: &[f64],
    progress: &dyn Progress,
) -> Result<(Vec<Option<Facts>>, Vec<Role>), LabError> {
    let facts = on_all_cores(columns.len(), None, progress, "columns", |column| Facts::of(&columns[column]))?;
    let signals: Vec<Signal> = columns.iter().map(|it| it.signal.clone()).collect();
    let copies = copies_among(&signals, joints);
    let roles = (0..columns.len()).map(|column| role(columns, &facts, &copies, column)).collect();
    Ok((facts, roles))
}

fn role(columns: &[Column], facts: &[Option<Facts>], copies: &[Copied], column: usize) -> Role {
    let Some(own) = &facts[column] else { return Role::Constant };
    if own.is_constant() {
        return Role::Constant;
    }
    if own.is_untimed {
        return Role::Untimed;
    }
    if own.is_even {
        return Role::Clock;
    }
    if let Some(copy) = copies.iter().find(|copy| copy.signal == column) {
        return Role::Copy(copy.clone());
    }
    let points = &columns[column].signal.points;
    let never_falls = own.levels.is_none() && points.windows(2).all(|pair| pair[1].1 >= pair[0].1);
    let of = (0..columns.len())
        .filter(|it| never_falls && *it != column)
        .find(|it| is_running_maximum(points, &columns[*it].signal.points));
    of.map_or(Role::Signal, Role::RunningMaximum)
}

/// Whether values are the largest so far of others at the same times, which fall again.
fn is_running_maximum(values: &[(f64, f64)], of: &[(f64, f64)]) -> bool {
    /// The relative rounding of written numbers.
    const ROUNDED: f64 = 1e-6;
    let mut largest = f64::NEG_INFINITY;
    let mut is_next = |(own, other): (&(f64, f64), &(f64, f64))| {
        largest = largest.max(other.1);
        own.0 == other.0 && (own.1 - largest).abs() <= ROUNDED * largest.abs()
    };
    values.len() == of.len()
        && of.windows(2).any(|pair| pair[1].1 < pair[0].1)
        && values.iter().zip(of).all(&mut is_next)
}
