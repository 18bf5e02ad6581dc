//! The battery: 96 cells with a charge, a pair of resistance and capacitance and a resistance that depends on the temperature, in
//! modules that warm up and are cooled.
//!
//! Figures. Charge and size of a cell: 94 Ah, 2.1 kg, the data sheet of the Samsung SDI 94 Ah cell. Resistance: 0.75 milliohm at once and
//! 0.38 within 30 s at 25 degC, what pulses of 18 s show of such cells; it follows the law of Arrhenius with 20 kJ/mol, so that it doubles
//! from 25 down to 0 degC. Heat capacity: 1000 J/(kg K), as measured of many lithium cells. Spread: 1 % of capacity, 3 % of resistance.

use super::model::{CELLS, MODULES};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// The charge of a cell in coulomb.
pub(super) const CAPACITY_C: f64 = 94.0 * 3600.0;
/// The lowest permitted voltage of a cell: below it the anode's copper dissolves.
pub(super) const LIMIT_V: f64 = 2.8;
const RESISTANCE_OHM: f64 = 0.75e-3;
const PAIR_OHM: f64 = 0.38e-3;
const PAIR_S: f64 = 30.0;
/// Activation energy over the gas constant, kelvin.
const ARRHENIUS_K: f64 = 20_000.0 / 8.314;
/// Heat capacity of a module, J/K.
const HEAT_J_K: f64 = CELLS as f64 * 2.1 * 1000.0;
/// From a module to its cold plate, and to the module beside it, W/K.
const PLATE_W_K: f64 = 12.0;
const BESIDE_W_K: f64 = 6.0;
/// The share of the usual capacity that the weakest cell has.
const WEAKEST: f64 = 0.93;
/// The open-circuit voltage at shares of the charge, as in the model.
const REST_V: [(f64, f64); 16] = [
    (-0.1, 2.0),
    (0.0, 3.0),
    (0.03, 3.25),
    (0.06, 3.38),
    (0.1, 3.45),
    (0.15, 3.5),
    (0.2, 3.54),
    (0.3, 3.6),
    (0.4, 3.64),
    (0.5, 3.69),
    (0.6, 3.78),
    (0.7, 3.89),
    (0.8, 3.98),
    (0.9, 4.07),
    (1.0, 4.17),
    (1.1, 4.4),
];

/// A cell.
#[derive(Clone, Debug)]
struct Cell {
    capacity_c: f64,
    charge_c: f64,
    /// The cell's resistance beside a usual one.
    resistance: f64,
    pair_v: f64,
    voltage_v: f64,
}

/// The battery.
#[derive(Clone, Debug)]
pub(super) struct Battery {
    cells: Vec<Cell>,
    pub(super) temperatures_k: Vec<f64>,
    plates_w_k: Vec<f64>,
    /// How the open-circuit voltage of all cells differs from the table: amplitude and phase.
    misfit_v: f64,
    misfit_phase: f64,
    /// The place of the weakest cell, from 0.
    pub(super) weakest: usize,
    /// What is driven out of it, A.
    pub(super) current_a: f64,
}

impl Battery {
    /// A battery with a quarter of its charge, cold or warm.
    pub(super) fn new(random: &mut ChaCha8Rng) -> Battery {
        let weakest = random.random_range(0..MODULES * CELLS);
        let charge = random.random_range(0.24..0.27);
        let warmth_k = random.random_range(278.0..303.0);
        let cell = |place: usize, random: &mut ChaCha8Rng| {
            let share = if place == weakest { WEAKEST } else { random.random_range(0.99..1.01) };
            let capacity_c = CAPACITY_C * share;
            // All were full once: who has less is emptier now.
            let charge_c = capacity_c - CAPACITY_C * (1.0 - charge);
            let resistance = random.random_range(0.97..1.03);
            Cell { capacity_c, charge_c, resistance, pair_v: 0.0, voltage_v: 0.0 }
        };
        let mut battery = Battery {
            cells: (0..MODULES * CELLS).map(|place| cell(place, random)).collect(),
            temperatures_k: (0..MODULES).map(|_| warmth_k + random.random_range(-0.5..0.5)).collect(),
            plates_w_k: (0..MODULES).map(|_| PLATE_W_K * random.random_range(0.9..1.1)).collect(),
            misfit_v: random.random_range(-0.006..0.006),
            misfit_phase: random.random_range(0.0..6.3),
            weakest,
            current_a: 0.0,
        };
        battery.pass(0.0, 0.0);
        battery
    }

    /// Lets a current flow for some seconds.
    pub(super) fn pass(&mut self, current_a: f64, span_s: f64) {
        self.current_a = current_a;
        let (misfit_v, phase) = (self.misfit_v, self.misfit_phase);
        let nearer = 1.0 - (-span_s / PAIR_S).exp();
        let mut heats_w = Vec::with_capacity(MODULES);
        for (module, &warmth_k) in self.cells.chunks_mut(CELLS).zip(&self.temperatures_k) {
            let colder = (ARRHENIUS_K * (1.0 / warmth_k - 1.0 / 298.15)).exp();
            let mut heat_w = 0.0;
            for cell in module {
                cell.charge_c -= current_a * span_s;
                let aim_v = current_a * PAIR_OHM * colder * cell.resistance;
                cell.pair_v += (aim_v - cell.pair_v) * nearer;
                let lost_v = current_a * RESISTANCE_OHM * colder * cell.resistance + cell.pair_v;
                let share = cell.charge_c / cell.capacity_c;
                cell.voltage_v = rest_v(share) + misfit_v * (9.0 * share + phase).sin() - lost_v;
                heat_w += current_a * lost_v;
            }
            heats_w.push(heat_w);
        }
        self.warm(&heats_w, span_s);
    }

    /// Heat comes from the cells, and goes to the plate and to the modules beside.
    fn warm(&mut self, heats_w: &[f64], span_s: f64) {
        const PLATE_K: f64 = 285.0;
        let before = self.temperatures_k.clone();
        for (place, warmth_k) in self.temperatures_k.iter_mut().enumerate() {
            let beside = [place.checked_sub(1), Some(place + 1)].into_iter().flatten();
            let flow_w: f64 =
                beside.filter_map(|other| before.get(other)).map(|it| (it - *warmth_k) * BESIDE_W_K).sum();
            let cooled_w = (*warmth_k - PLATE_K) * self.plates_w_k[place];
            *warmth_k += (heats_w[place] + flow_w - cooled_w) * span_s / HEAT_J_K;
        }
    }

    /// The weakest cell's resistance more than doubles, as by a weld that gives way.
    pub(super) fn weaken(&mut self) {
        let weakest = self.weakest;
        self.cells[weakest].resistance = 2.5;
    }

    /// The voltages of the cells, module by module.
    pub(super) fn voltages_v(&self) -> impl Iterator<Item = f64> {
        self.cells.iter().map(|cell| cell.voltage_v)
    }

    /// The voltage of all of it.
    pub(super) fn voltage_v(&self) -> f64 {
        self.voltages_v().sum()
    }

    /// The charge as a share, as if all cells were usual ones.
    pub(super) fn charge(&self) -> f64 {
        let missing: f64 = self.cells.iter().map(|cell| cell.capacity_c - cell.charge_c).sum();
        1.0 - missing / (CAPACITY_C * self.cells.len() as f64)
    }

    /// The lowest voltage of a cell.
    pub(super) fn lowest_v(&self) -> f64 {
        self.voltages_v().fold(f64::INFINITY, f64::min)
    }

    /// The place of the hottest module, from 0.
    pub(super) fn hottest(&self) -> usize {
        let order =
            |one: &usize, other: &usize| self.temperatures_k[*one].total_cmp(&self.temperatures_k[*other]);
        (0..MODULES).max_by(order).unwrap_or_default()
    }
}

/// The open-circuit voltage at a share of the charge.
fn rest_v(share: f64) -> f64 {
    let next = REST_V.partition_point(|(at, _)| *at <= share).clamp(1, REST_V.len() - 1);
    let [(from, low), (to, high)] = [REST_V[next - 1], REST_V[next]];
    low + (high - low) * (share - from) / (to - from)
}
