//! The equivalent circuit of a cell: an open-circuit curve, a resistance, and a pair of resistance and capacitance.

use super::cell::Row;
use anyhow::Context;
use nalgebra::{DMatrix, DVector};
use std::fmt::Write;

/// The time constant of the pair in seconds: the one that fits best of 40, 100, 200, 400, 600, 1000 and 1800.
pub(super) const PAIR_S: f64 = 600.0;

/// Where the curve has its points, in shares of the capacity: closer where it is steep.
const PLACES: [f64; 21] = [
    0.0, 0.008, 0.016, 0.033, 0.05, 0.066, 0.1, 0.13, 0.2, 0.26, 0.33, 0.4, 0.46, 0.53, 0.6, 0.66, 0.73, 0.8,
    0.86, 0.93, 1.0,
];

/// A cell.
#[derive(Clone, Debug)]
pub(super) struct Circuit {
    /// The charge of a full cell.
    pub(super) capacity_ah: f64,
    /// Points of the curve: charge in Ah, voltage in V.
    pub(super) knots: Vec<(f64, f64)>,
    /// Series resistance in ohm.
    pub(super) resistance: f64,
    /// Resistance of the pair in ohm.
    pub(super) pair: f64,
}

/// The current through the resistance of the pair after a time step.
pub(super) fn through_pair(before: f64, current_a: f64, elapsed_s: f64) -> f64 {
    let kept = (-elapsed_s / PAIR_S).exp();
    kept * before + (1.0 - kept) * current_a
}

impl Circuit {
    /// The circuit that fits a recording best (least squares over time).
    ///
    /// # Errors
    /// The recording does not go from empty to full.
    pub(super) fn fit(rows: &[Row]) -> anyhow::Result<Circuit> {
        let capacity_ah = rows.iter().map(|row| row.charge_ah).fold(0.0, f64::max);
        let places = PLACES.map(|share| share * capacity_ah);
        let size = places.len() + 2;
        let (mut squares, mut products) = (DMatrix::zeros(size, size), DVector::zeros(size));
        let (mut pair, mut before) = (0.0, rows.first().map_or(0.0, |row| row.at_s));
        for row in rows {
            let elapsed = row.at_s - before;
            pair = through_pair(pair, row.current_a, elapsed);
            before = row.at_s;
            let mut terms = DVector::zeros(size);
            weights(&places, row.charge_ah).into_iter().for_each(|(place, weight)| terms[place] = weight);
            (terms[size - 2], terms[size - 1]) = (row.current_a, pair);
            squares += elapsed * &terms * terms.transpose();
            products += elapsed * row.voltage_v * terms;
        }
        let solved = squares.cholesky().map(|factors| factors.solve(&products));
        let found = solved
            .context("the recording does not pass all of the curve: it must charge from empty to full")?;
        Ok(Circuit {
            capacity_ah,
            knots: places.iter().zip(found.iter()).map(|(charge, voltage)| (*charge, *voltage)).collect(),
            resistance: found[size - 2],
            pair: found[size - 1],
        })
    }

    /// The open-circuit voltage as a formula: the first line, plus for each later knot the change of slope. Both end lines are
    /// continued.
    pub(super) fn curve(&self, charge: &str) -> String {
        let slopes: Vec<f64> =
            self.knots.windows(2).map(|pair| (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0)).collect();
        let (first, mut text) = (self.knots[0], String::new());
        let _ = write!(text, "{:e} + {:e}*({charge} - {:e})", first.1, slopes[0], first.0);
        for (pair, knot) in slopes.windows(2).zip(self.knots.iter().skip(1)) {
            let _ = write!(text, " + ({:e})*max({charge} - {:e}, 0)", pair[1] - pair[0], knot.0);
        }
        text
    }

    /// The charge at which the curve has this voltage; beyond its ends by the end lines.
    pub(super) fn charge_at(&self, voltage_v: f64) -> f64 {
        let last = self.knots.len() - 2;
        let above = self.knots.partition_point(|knot| knot.1 < voltage_v);
        let place = above.saturating_sub(1).min(last);
        let ((q, u), (q_next, u_next)) = (self.knots[place], self.knots[place + 1]);
        q + (voltage_v - u) / (u_next - u) * (q_next - q)
    }
}

/// The weights of a curve's points at a charge.
fn weights(places: &[f64], charge_ah: f64) -> [(usize, f64); 2] {
    let above = places.partition_point(|place| *place <= charge_ah);
    let place = above.saturating_sub(1).min(places.len() - 2);
    let share = (charge_ah - places[place]) / (places[place + 1] - places[place]);
    [(place, 1.0 - share), (place + 1, share)]
}
