//! Statements about a service with integrity levels, and the matching of guarantees and demands.

mod level;

pub use level::{Level, STANDARD_SCALES, Scale, ScaleId, Scales};

use crate::interval::{Interval, Truth};
use crate::unit::Dimension;
use alloc::collections::BTreeSet;
use alloc::string::String;
use alloc::vec::Vec;

/// Bounds that differ by no more than this share are equal: conversions between units round.
const EQUAL: f64 = 1e-9;

/// A guaranteed or demanded statement about a service.
#[derive(Clone, Debug, PartialEq)]
pub struct Statement {
    /// The type of the service; only equal types can meet.
    pub service: String,
    /// The integrity level; `None` in a demand accepts any, `None` in a guarantee reaches no level.
    pub level: Option<Level>,
    /// The properties, all of which hold.
    pub properties: Vec<Property>,
}

impl Statement {
    /// Whether this guarantee meets a demand in type, level and every demanded property.
    ///
    /// Time: the product of the numbers of properties and of their ranges.
    #[must_use]
    pub fn meets(&self, demand: &Statement) -> bool {
        let reaches = demand.level.is_none_or(|wanted| self.level.is_some_and(|level| level.reaches(wanted)));
        reaches && self.says(demand)
    }

    /// Whether this guarantee meets a demand, regardless of the level.
    #[must_use]
    pub fn says(&self, demand: &Statement) -> bool {
        let says = |wanted: &Property| self.properties.iter().any(|given| given.meets(wanted));
        self.service == demand.service && demand.properties.iter().all(says)
    }
}

/// Failure modes of a service: the guide words of ISO 26262 and of hazard analyses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FailureMode {
    /// The service provides nothing where it should.
    Omission,
    /// The service provides something where it should not.
    Commission,
    /// The provided value deviates from the truth.
    Value,
    /// The service is early.
    Early,
    /// The service is late.
    Late,
}

impl FailureMode {
    /// Every mode.
    pub const ALL: [FailureMode; 5] = [
        FailureMode::Omission,
        FailureMode::Commission,
        FailureMode::Value,
        FailureMode::Early,
        FailureMode::Late,
    ];

    /// The mode's name in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            FailureMode::Omission => "omission",
            FailureMode::Commission => "commission",
            FailureMode::Value => "value",
            FailureMode::Early => "early",
            FailureMode::Late => "late",
        }
    }
}

/// A typed property of a service.
#[derive(Clone, Debug, PartialEq)]
pub struct Property {
    /// Only equal names can meet.
    pub name: String,
    /// The failure mode that the property bounds; only equal modes can meet.
    pub mode: Option<FailureMode>,
    /// The property's content.
    pub content: Content,
}

/// The content of a property.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// The property holds.
    Binary,
    /// The covered cases.
    Categorical {
        /// The cases.
        covered: BTreeSet<String>,
        /// Which side must lie within which.
        inclusion: Inclusion,
    },
    /// The covered numbers.
    Numeric {
        /// Closed ranges in SI; none is empty.
        ranges: Vec<Interval>,
        /// The dimension of the numbers.
        dimension: Dimension,
        /// Which side must lie within which.
        inclusion: Inclusion,
    },
}

/// Which side of a match must lie within the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inclusion {
    /// "At most": an error of up to 0.2 m meets a demand of up to 0.3 m.
    GuaranteeInDemand,
    /// "At least": a guarantee of 2 s meets a demand of 1.5 s.
    DemandInGuarantee,
}

impl Inclusion {
    /// The outer and the inner side of a match.
    fn sides<T>(self, guarantee: T, demand: T) -> (T, T) {
        match self {
            Inclusion::GuaranteeInDemand => (demand, guarantee),
            Inclusion::DemandInGuarantee => (guarantee, demand),
        }
    }
}

impl Property {
    /// Whether this guaranteed property meets a demanded one: equal name, failure mode, kind, direction and dimension, and one
    /// side within the other (each of its ranges within one of the other's).
    #[must_use]
    pub fn meets(&self, demand: &Property) -> bool {
        self.name == demand.name && self.mode == demand.mode && self.content.meets(&demand.content)
    }
}

impl Content {
    fn meets(&self, demand: &Content) -> bool {
        match (self, demand) {
            (Content::Binary, Content::Binary) => true,
            (
                Content::Categorical { covered, inclusion },
                Content::Categorical { covered: wanted, inclusion: stated },
            ) => {
                let (outer, inner) = inclusion.sides(covered, wanted);
                inclusion == stated && inner.is_subset(outer)
            }
            (
                Content::Numeric { ranges, dimension, inclusion },
                Content::Numeric { ranges: wanted, dimension: of, inclusion: stated },
            ) => {
                let (outer, inner) = inclusion.sides(ranges, wanted);
                let lies_within = |range: &Interval| outer.iter().any(|around| within(*range, *around));
                inclusion == stated && dimension == of && inner.iter().all(lies_within)
            }
            _ => false,
        }
    }
}

/// Whether a measured quantity lies within a range: true when all of it does, false when none of it does.
pub(crate) fn truth(measured: Interval, range: Interval) -> Truth {
    if measured.is_empty() || range.is_empty() {
        Truth::Unknown
    } else if within(measured, range) {
        Truth::True
    } else if at_most(range.lo(), measured.hi()) && at_most(measured.lo(), range.hi()) {
        Truth::Unknown
    } else {
        Truth::False
    }
}

fn within(inner: Interval, outer: Interval) -> bool {
    inner.is_empty() || at_most(outer.lo(), inner.lo()) && at_most(inner.hi(), outer.hi())
}

/// Whether a bound is at most another one, but for rounding.
fn at_most(one: f64, other: f64) -> bool {
    let scale = one.abs().max(other.abs());
    one <= other || scale.is_finite() && one - other <= EQUAL * scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec;

    #[track_caller]
    fn check(inclusion: Inclusion, given: &[(f64, f64)], wanted: &[(f64, f64)], expected: bool) {
        let content = |ranges: &[(f64, f64)]| Content::Numeric {
            ranges: ranges.iter().map(|&(lo, hi)| Interval::new(lo, hi)).collect(),
            dimension: Dimension::LENGTH,
            inclusion,
        };
        assert_eq!(content(given).meets(&content(wanted)), expected);
    }

    #[test]
    fn inclusion_goes_in_the_stated_direction() {
        check(Inclusion::GuaranteeInDemand, &[(0.0, 0.2)], &[(0.0, 0.3)], true);
        check(Inclusion::GuaranteeInDemand, &[(0.0, 0.3)], &[(0.0, 0.2)], false);
        check(Inclusion::GuaranteeInDemand, &[(0.0, 300.0 * 0.001)], &[(0.0, 0.1 + 0.2)], true);
        check(Inclusion::DemandInGuarantee, &[(0.0, 2.0)], &[(0.0, 1.5)], true);
        check(Inclusion::DemandInGuarantee, &[(0.0, 3.0), (5.0, 9.0)], &[(2.0, 6.0)], false);
        check(Inclusion::DemandInGuarantee, &[(0.0, 5.0)], &[(0.0, f64::INFINITY)], false);
        check(Inclusion::DemandInGuarantee, &[(0.0, f64::INFINITY)], &[(0.0, f64::INFINITY)], true);
    }

    #[test]
    fn a_measured_interval_is_within_apart_or_neither() {
        let range = Interval::new(0.0, 300.0);
        let check = |lo, hi, expected| assert_eq!(truth(Interval::new(lo, hi), range), expected);
        check(40.0, 60.0, Truth::True);
        check(0.0, 300.0, Truth::True);
        check(280.0, 320.0, Truth::Unknown);
        check(300.0, 310.0, Truth::Unknown);
        check(301.0, 310.0, Truth::False);
        check(f64::NAN, 1.0, Truth::Unknown);
    }

    #[test]
    fn the_mode_of_failure_belongs_to_the_property() {
        let property = |mode| Property { name: "speed".into(), mode, content: Content::Binary };
        let late = property(Some(FailureMode::Late));
        assert!(late.meets(&late));
        assert!(!late.meets(&property(None)) && !late.meets(&property(Some(FailureMode::Omission))));
        let statement = Statement { service: "speed".into(), level: None, properties: vec![late] };
        assert!(statement.says(&statement));
    }
}
