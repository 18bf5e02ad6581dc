//! Errors that explain the differences of all pairs: those with the least sum of squares that make every pair wide enough.

/// The most passes over all demands.
const MOST_PASSES: usize = 2_000;

/// A demand that a pair becomes wider by its parameters.
#[derive(Clone, Debug)]
pub(crate) struct Demand {
    /// The parameters, and the widening of the pair by one unit of each, above 0.
    pub(crate) gains: Vec<(usize, f64)>,
    /// The demanded widening, above 0.
    pub(crate) least: f64,
}

/// Finds `x >= 0` with `sum(gain * x) >= least` for every demand and the least sum of `(scale * x)^2`.
///
/// Two witnesses get half each; if a third one agrees better with one of them, the other gets more. The squares make the solution
/// unique; a plain sum would often put everything on one. Hildreth's method (DOI 10.1002/nav.3800040113): each demand in turn is
/// met by its share of the dual; gains are positive, so the solution is, too. A demand that is still unmet after the passes is
/// met by scaling all of its parameters. Time: O(passes * gains).
pub(crate) fn least_widening(scales: &[f64], demands: &[Demand]) -> Vec<f64> {
    let mut found = vec![0.0; scales.len()];
    let mut duals = vec![0.0; demands.len()];
    for _ in 0..MOST_PASSES {
        let mut moved = 0.0_f64;
        for (demand, dual) in demands.iter().zip(&mut duals) {
            let weight: f64 = demand.gains.iter().map(|(at, gain)| (gain / scales[*at]).powi(2)).sum();
            if weight <= 0.0 {
                continue;
            }
            let step = ((demand.least - demand.reached(&found)) / weight).max(-*dual);
            *dual += step;
            demand.gains.iter().for_each(|(at, gain)| found[*at] += step * gain / scales[*at].powi(2));
            moved = moved.max((step * weight / demand.least).abs());
        }
        if moved < 1e-9 {
            break;
        }
    }
    let lacks = demands.iter().filter(|it| it.reached(&found) > 0.0);
    let stretch = lacks.map(|it| it.least / it.reached(&found)).fold(1.0, f64::max);
    let widest = found.iter().zip(scales).map(|(value, scale)| value * scale).fold(0.0, f64::max);
    let settled =
        |(value, scale): (&f64, &f64)| if value * scale < 1e-9 * widest { 0.0 } else { value * stretch };
    found.iter().zip(scales).map(settled).collect()
}

impl Demand {
    /// The widening of the pair with these parameters.
    pub(crate) fn reached(&self, parameters: &[f64]) -> f64 {
        self.gains.iter().map(|(at, gain)| gain * parameters[*at]).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn demand(one: usize, other: usize, least: f64) -> Demand {
        Demand { gains: vec![(one, 1.0), (other, 1.0)], least }
    }

    #[track_caller]
    fn check(count: usize, demands: &[Demand], expected: &[f64]) {
        let found = least_widening(&vec![1.0; count], demands);
        let near = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-6);
        assert!(near, "{found:?} is not {expected:?}");
    }

    #[test]
    fn two_witnesses_share_and_the_odd_one_of_three_gets_more() {
        check(2, &[demand(0, 1, 1.0)], &[0.5, 0.5]);
        check(
            3,
            &[demand(0, 1, 0.2), demand(0, 2, 1.0), demand(1, 2, 1.0)],
            &[0.4 - 0.4 / 3.0 + 0.2 / 3.0, 1.0 / 3.0, 2.0 / 3.0],
        );
        check(2, &[], &[0.0, 0.0]);
    }

    #[test]
    fn units_do_not_matter() {
        let metres = Demand { gains: vec![(0, 1.0), (1, 1.0)], least: 1.0 };
        let mixed = Demand { gains: vec![(0, 1.0), (1, 0.01)], least: 1.0 };
        assert_eq!(least_widening(&[1.0, 1.0], &[metres])[0], 0.5);
        let found = least_widening(&[1.0, 0.01], &[mixed]);
        assert!((found[0] - 0.5).abs() < 1e-9 && (found[1] - 50.0).abs() < 1e-6, "{found:?}");
    }

    proptest! {
        /// Every demand is met, and lowering any single parameter would miss one.
        #[test]
        fn met_and_tight(pairs in prop::collection::vec((0..5_usize, 5..9_usize, 0.01..10.0_f64), 1..20)) {
            let demands: Vec<Demand> = pairs.iter().map(|&(one, other, least)| demand(one, other, least)).collect();
            let found = least_widening(&[1.0; 9], &demands);
            for demand in &demands {
                prop_assert!(demand.reached(&found) >= demand.least * (1.0 - 1e-9));
            }
            for (at, value) in found.iter().enumerate().filter(|(_, value)| **value > 1e-6) {
                let mut lower = found.clone();
                lower[at] = value * 0.99 - 1e-4;
                prop_assert!(demands.iter().any(|demand| demand.reached(&lower) < demand.least));
            }
        }
    }
}
