//! The circuit of models/cell-charge.yaml and models/cell-pulses.yaml: a finer curve than the plain circuit's, and three pairs of
//! resistance and capacitance, the slower two of which have resistances that depend on the charge where the recording tells how.

use super::cell::{Row, half};
use super::circuit::{kept, weights};
use crate::table::Errors;
use anyhow::Context;
use nalgebra::{DMatrix, DVector};

/// Where the curve has its points, in shares of the capacity.
const CURVE: [f64; 28] = [
    0.0, 0.004, 0.008, 0.012, 0.016, 0.024, 0.033, 0.041, 0.05, 0.066, 0.083, 0.1, 0.13, 0.16, 0.2, 0.26,
    0.33, 0.4, 0.46, 0.53, 0.6, 0.66, 0.73, 0.8, 0.86, 0.93, 0.965, 1.0,
];
/// Where the resistances of the slower pairs have their points.
const SLOWER: [f64; 4] = [0.0, 0.1, 0.3, 1.0];
/// Where they have one resistance only.
const ALIKE: [f64; 1] = [0.0];
/// The time constants of the pairs, in seconds: from what follows a change of the load to what lasts for an hour of rest.
const PAIRS_S: [f64; 3] = [20.0, 200.0, 2000.0];
/// How the models call the currents through the resistances of the slower pairs.
const SLOWER_NAMES: [&str; 2] = ["middle", "lasting"];
/// Keeps the solution of the normal equations finite where the data decides nothing.
const RIDGE: f64 = 1e-6;

/// The circuit, SI but for the charge in Ah.
pub(super) struct Detailed {
    capacity_ah: f64,
    slower_places: &'static [f64],
    /// The curve's voltages, the resistance, that of the brief pair, and those of each slower pair.
    solved: Vec<f64>,
}

/// A larger change of the current, in A, is one of the load.
const CHANGE_A: f64 = 0.5;
const MINUTE_S: f64 = 60.0;

/// What the circuit does not explain of a row's voltage.
struct Residual {
    voltage_v: f64,
    /// Since the row before.
    elapsed_s: f64,
}

/// What the circuit's voltage is linear in, at a row.
struct Terms {
    /// The currents through the resistances of the pairs.
    pairs_a: [f64; PAIRS_S.len()],
    before_s: Option<f64>,
}

impl Terms {
    const NONE: Terms = Terms { pairs_a: [0.0; PAIRS_S.len()], before_s: None };

    fn of(&mut self, row: &Row, capacity_ah: f64, slower_places: &[f64]) -> (DVector<f64>, f64) {
        let elapsed = row.at_s - self.before_s.replace(row.at_s).unwrap_or(row.at_s);
        for (through_a, time_s) in self.pairs_a.iter_mut().zip(PAIRS_S) {
            let kept = kept(elapsed, time_s);
            *through_a = kept * *through_a + (1.0 - kept) * row.current_a;
        }
        let mut terms = DVector::zeros(size(slower_places));
        let share = row.charge_ah / capacity_ah;
        weights(&CURVE, share).into_iter().for_each(|(place, weight)| terms[place] = weight);
        let [brief_a, slower_a @ ..] = self.pairs_a;
        (terms[CURVE.len()], terms[CURVE.len() + 1]) = (row.current_a, brief_a);
        for (pair, through_a) in slower_a.into_iter().enumerate() {
            let first = CURVE.len() + 2 + pair * slower_places.len();
            match slower_places.len() {
                1 => terms[first] = through_a,
                _ => weights(slower_places, share)
                    .into_iter()
                    .for_each(|(place, weight)| terms[first + place] = weight * through_a),
            }
        }
        (terms, elapsed)
    }
}

/// How many numbers the circuit has.
fn size(slower_places: &[f64]) -> usize {
    CURVE.len() + 2 + SLOWER_NAMES.len() * slower_places.len()
}

impl Detailed {
    /// The circuit that fits the first half of a recording best (least squares over time).
    ///
    /// # Errors
    /// The recording does not go from empty to full in its first half.
    pub(super) fn fit(rows: &[Row]) -> anyhow::Result<Detailed> {
        let rows = rows.get(..half(rows)).unwrap_or(rows);
        let capacity_ah = rows.iter().map(|row| row.charge_ah).fold(0.0, f64::max);
        let slower_places = slower_places(rows, capacity_ah);
        let size = size(slower_places);
        let (mut squares, mut products) = (RIDGE * DMatrix::identity(size, size), DVector::zeros(size));
        let mut at = Terms::NONE;
        for row in rows {
            let (terms, elapsed) = at.of(row, capacity_ah, slower_places);
            squares += elapsed * &terms * terms.transpose();
            products += elapsed * row.voltage_v * terms;
        }
        let solved = squares.cholesky().map(|factors| factors.solve(&products));
        let solved = solved.context("the recording does not pass all of the curve")?;
        Ok(Detailed { capacity_ah, slower_places, solved: solved.iter().copied().collect() })
    }

    /// The errors of the voltage above a tenth of the capacity: of the first half, and of the second.
    pub(super) fn errors(&self, rows: &[Row]) -> [Errors; 2] {
        let mut errors = [Errors::default(); 2];
        let middle = half(rows);
        for (place, (row, residual)) in rows.iter().zip(self.residuals(rows)).enumerate() {
            if self.is_above_a_tenth(row) {
                errors[usize::from(place >= middle)].add(residual.voltage_v, residual.elapsed_s);
            }
        }
        errors
    }

    /// By how much the error of the voltage changes within a minute, in the first half and above a tenth of the capacity: at rest, and
    /// under load. The two minutes after a change of the load are left out.
    pub(super) fn wander(&self, rows: &[Row]) -> [Errors; 2] {
        let rows = rows.get(..half(rows)).unwrap_or(rows);
        let residuals = self.residuals(rows);
        let (mut wander, mut changed_s, mut before) = ([Errors::default(); 2], f64::NEG_INFINITY, 0);
        for (place, pair) in rows.windows(2).enumerate() {
            let [last, row] = pair else { continue };
            if (row.current_a - last.current_a).abs() > CHANGE_A {
                changed_s = row.at_s;
            }
            while rows[before + 1].at_s <= row.at_s - MINUTE_S {
                before += 1;
            }
            let is_a_minute = row.at_s - rows[before].at_s < MINUTE_S + 1.0;
            if is_a_minute && rows[before].at_s > changed_s + 2.0 * MINUTE_S && self.is_above_a_tenth(row) {
                let change = residuals[place + 1].voltage_v - residuals[before].voltage_v;
                wander[usize::from(row.current_a.abs() > CHANGE_A)]
                    .add(change, residuals[place + 1].elapsed_s);
            }
        }
        wander
    }

    fn is_above_a_tenth(&self, row: &Row) -> bool {
        row.charge_ah > 0.1 * self.capacity_ah
    }

    /// What the voltage of each row is beyond that of the circuit.
    fn residuals(&self, rows: &[Row]) -> Vec<Residual> {
        let (mut at, solved) = (Terms::NONE, DVector::from_column_slice(&self.solved));
        let residual = |row: &Row| {
            let (terms, elapsed_s) = at.of(row, self.capacity_ah, self.slower_places);
            Residual { voltage_v: row.voltage_v - terms.dot(&solved), elapsed_s }
        };
        rows.iter().map(residual).collect()
    }

    /// The points of its curves and its resistances, as they stand in the model.
    pub(super) fn texts(&self) -> Vec<String> {
        let charge = |share: f64| format!("{} Ah", rounded(share * self.capacity_ah, 3));
        let milliohm = |resistance: &f64| rounded(1e3 * resistance, 3);
        let (curve, rest) = self.solved.split_at(CURVE.len());
        let (plain, slower) = rest.split_at(2);
        let curve =
            CURVE.iter().zip(curve).map(|(at, it)| format!("[{}, {} V]", charge(*at), rounded(*it, 4)));
        let plain =
            [format!("initial: {},", milliohm(&plain[0])), format!("{} mV/A * brief", milliohm(&plain[1]))];
        let slower = slower.chunks(self.slower_places.len()).zip(SLOWER_NAMES).flat_map(|(pair, name)| {
            let points = self.slower_places.iter().zip(pair);
            points.map(move |(at, it)| match pair.len() {
                1 => format!("{} mV/A * {name}", milliohm(it)),
                _ => format!("[{}, {} mV/A]", charge(*at), milliohm(it)),
            })
        });
        curve.chain(plain).chain(slower).collect()
    }
}

/// Where the resistances of the slower pairs have their points: a recording that is not emptied again does not tell how they depend on the
/// charge.
fn slower_places(rows: &[Row], capacity_ah: f64) -> &'static [f64] {
    let full = rows.iter().position(|row| row.charge_ah > 0.9 * capacity_ah).unwrap_or(0);
    let is_emptied = rows.iter().skip(full).any(|row| row.charge_ah < 0.1 * capacity_ah);
    if is_emptied { &SLOWER } else { &ALIKE }
}

/// A number with so many decimals at most.
fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10_f64.powi(decimals);
    (value * scale).round() / scale
}
