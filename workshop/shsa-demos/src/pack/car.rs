//! The car that drives: speeds between towns and on motorways, and the power that they take.
//!
//! Figures of the BMW i3: 1300 kg with its driver, a drag area of 0.69 m^2, 125 kW; its tyres roll with 0.9 %.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

const MASS_KG: f64 = 1300.0;
const DRAG_M2: f64 = 0.69;
const ROLLING: f64 = 0.009;
/// From the battery to the wheels; braking gives back as much.
const EFFICIENCY: f64 = 0.88;
/// The most that motor and battery give and take, W.
const MOST_W: f64 = 100_000.0;
const LEAST_W: f64 = -40_000.0;
/// How fast the power changes, W/s.
const SLEW_W_S: f64 = 80_000.0;

/// A car on its way.
#[derive(Clone, Debug)]
pub(super) struct Car {
    speed: f64,
    aim: f64,
    /// Seconds until the driver wants another speed.
    until_s: f64,
    power_w: f64,
    /// What does not go to the motor, W.
    pub(super) standby_w: f64,
}

impl Car {
    pub(super) fn new(random: &mut ChaCha8Rng) -> Car {
        Car {
            speed: 0.0,
            aim: 0.0,
            until_s: 20.0,
            power_w: 0.0,
            standby_w: random.random_range(600.0..1600.0),
        }
    }

    /// The power of the motor over the next seconds, within a share of the most.
    pub(super) fn drive(&mut self, share: f64, span_s: f64, random: &mut ChaCha8Rng) -> f64 {
        self.until_s -= span_s;
        if self.until_s <= 0.0 {
            self.aim = [0.0, 14.0, 25.0, 31.0, 34.0, 36.0][random.random_range(0..6)];
            self.until_s =
                if self.aim > 0.0 { random.random_range(15.0..50.0) } else { random.random_range(5.0..20.0) };
        }
        let wanted = (0.5 * (self.aim - self.speed)).clamp(-2.0, 2.2);
        let resistance_n =
            0.6 * DRAG_M2 * self.speed * self.speed + ROLLING * MASS_KG * 9.81 * self.speed.min(1.0);
        let wheels_w = (MASS_KG * wanted + resistance_n) * self.speed.max(0.5);
        let asked_w = if wheels_w > 0.0 { wheels_w / EFFICIENCY } else { wheels_w * EFFICIENCY };
        let asked_w = if self.speed < 0.1 && self.aim == 0.0 { 0.0 } else { asked_w };
        let change = (asked_w.clamp(LEAST_W, MOST_W * share) - self.power_w)
            .clamp(-SLEW_W_S * span_s, SLEW_W_S * span_s);
        self.power_w += change;
        let pushed_w = if self.power_w > 0.0 { self.power_w * EFFICIENCY } else { self.power_w / EFFICIENCY };
        // What the motor cannot brake, the brakes do.
        let force_n = pushed_w / self.speed.max(0.5) + (wheels_w - LEAST_W).min(0.0) / self.speed.max(0.5);
        self.speed = (self.speed + (force_n - resistance_n) / MASS_KG * span_s).max(0.0);
        self.power_w
    }
}
