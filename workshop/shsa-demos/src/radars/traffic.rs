//! Vehicles on two lanes that follow each other by the Intelligent Driver Model (Treiber, Hennecke and Helbing 2000, DOI
//! 10.1103/PhysRevE.62.1805), with the figures that its authors use for motorways. Nobody changes lanes.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// The lanes' distances from the side of the road, m.
pub(super) const LANES_M: [f64; 2] = [2.0, 5.5];
/// Where vehicles appear, and where they are forgotten.
const BEGIN_M: f64 = -150.0;
const END_M: f64 = 650.0;
/// Time to the vehicle ahead, distance at rest, acceleration, comfortable deceleration.
const HEADWAY_S: f64 = 1.2;
const REST_M: f64 = 2.0;
const ACCELERATION: f64 = 1.0;
const DECELERATION: f64 = 1.5;
/// The share of vehicles that are lorries, and of those that tell where they are.
const LORRIES: f64 = 0.2;
const TELLING: f64 = 0.4;
/// Nobody comes for the second of these times after the first, again and again: an empty road is no fault.
const BUSY_S: f64 = 45.0;
const EMPTY_S: f64 = 15.0;

/// A vehicle.
#[derive(Clone, Debug)]
pub(super) struct Vehicle {
    pub(super) id: u32,
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) speed: f64,
    pub(super) length: f64,
    /// Whether it tells where it is, as by cooperative awareness messages.
    pub(super) tells: bool,
    desired: f64,
}

/// The vehicles of both lanes, those in front first.
#[derive(Clone, Debug)]
pub(super) struct Traffic {
    lanes: [Vec<Vehicle>; 2],
    next_s: [f64; 2],
    now_s: f64,
    made: u32,
}

impl Traffic {
    pub(super) fn new(random: &mut ChaCha8Rng) -> Traffic {
        let next_s = [random.random_range(0.0..3.0), random.random_range(0.0..5.0)];
        Traffic { lanes: [Vec::new(), Vec::new()], next_s, now_s: 0.0, made: 0 }
    }

    /// All vehicles.
    pub(super) fn vehicles(&self) -> impl Iterator<Item = &Vehicle> {
        self.lanes.iter().flatten()
    }

    /// Goes on by some seconds.
    pub(super) fn pass(&mut self, span_s: f64, random: &mut ChaCha8Rng) {
        self.now_s += span_s;
        for lane in &mut self.lanes {
            follow(lane, span_s);
            lane.retain(|vehicle| vehicle.x < END_M);
        }
        (0..LANES_M.len()).for_each(|lane| self.arrive(lane, random));
    }

    /// A vehicle arrives when its time has come and there is room.
    fn arrive(&mut self, lane: usize, random: &mut ChaCha8Rng) {
        if self.now_s < self.next_s[lane] {
            return;
        }
        if self.now_s % (BUSY_S + EMPTY_S) > BUSY_S {
            self.next_s[lane] = self.now_s + 1.0;
            return;
        }
        let vehicle = self.vehicle(lane, random);
        let room = self.lanes[lane].last().map_or(f64::INFINITY, |last| last.x - last.length - BEGIN_M);
        if room > 1.5 * vehicle.speed {
            self.lanes[lane].push(vehicle);
            let seldom_s = [2.5, 4.0][lane];
            self.next_s[lane] = self.now_s + 1.2 - seldom_s * random.random_range(1e-3..1.0_f64).ln();
        }
    }

    fn vehicle(&mut self, lane: usize, random: &mut ChaCha8Rng) -> Vehicle {
        self.made += 1;
        let is_lorry = lane == 0 && random.random_bool(LORRIES);
        let desired: f64 = match (is_lorry, lane) {
            (true, _) => random.random_range(22.0..25.0),
            (false, 0) => random.random_range(24.0..30.0),
            _ => random.random_range(28.0..36.0),
        };
        let before = self.lanes[lane].last().map_or(f64::INFINITY, |last| last.speed);
        Vehicle {
            id: self.made,
            x: BEGIN_M,
            y: LANES_M[lane],
            speed: desired.min(before),
            length: if is_lorry { 12.0 } else { 4.5 },
            tells: random.random_bool(TELLING),
            desired,
        }
    }
}

/// Each vehicle of a lane follows the one ahead.
fn follow(lane: &mut [Vehicle], span_s: f64) {
    let mut ahead: Option<(f64, f64)> = None;
    for vehicle in lane {
        let free = (vehicle.speed / vehicle.desired).powi(4);
        let near = ahead.map_or(0.0, |(rear, speed)| {
            let closing =
                vehicle.speed * (vehicle.speed - speed) / (2.0 * (ACCELERATION * DECELERATION).sqrt());
            let wanted = REST_M + (vehicle.speed * HEADWAY_S + closing).max(0.0);
            (wanted / (rear - front(vehicle)).max(0.1)).powi(2)
        });
        let acceleration = (ACCELERATION * (1.0 - free - near)).max(-8.0);
        vehicle.speed = (vehicle.speed + acceleration * span_s).max(0.0);
        vehicle.x += vehicle.speed * span_s;
        ahead = Some((vehicle.x - vehicle.length / 2.0, vehicle.speed));
    }
}

/// Where a vehicle begins; `x` is its middle.
fn front(vehicle: &Vehicle) -> f64 {
    vehicle.x + vehicle.length / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn nobody_runs_into_the_one_ahead() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut traffic = Traffic::new(&mut random);
        for _ in 0..6_000 {
            traffic.pass(0.05, &mut random);
            for pair in traffic.lanes.iter().flat_map(|lane| lane.windows(2)) {
                assert!(pair[0].x - pair[0].length / 2.0 > front(&pair[1]));
            }
        }
        assert!(traffic.made > 100, "{}", traffic.made);
    }
}
