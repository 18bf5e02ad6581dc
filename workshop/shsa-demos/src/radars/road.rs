//! The road: vehicles under radars, and what radars and vehicles say.

use super::faults::Fault;
use super::radar::{RADARS, Track, bell, scan};
use super::traffic::{Traffic, Vehicle};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use shsa_core::time::{Span, Time};
use std::collections::{BTreeMap, VecDeque};

/// A step of the simulation: half of the time between two scans.
pub(super) const STEP: Span = Span::from_millis(50);
/// Steps between two messages of a vehicle.
const TELLS_STEPS: u64 = 10;
/// The largest error of the position that a vehicle tells, along and across, m.
const TOLD_M: (f64, f64) = (1.0, 0.5);
/// For how many steps what was is remembered, for a radar that is late.
const MEMORY: usize = 40;

/// The road with its radars. The same seed gives the same traffic and noise.
pub struct Road {
    step: u64,
    random: ChaCha8Rng,
    traffic: Traffic,
    /// What was, step by step.
    past: VecDeque<Vec<Vehicle>>,
    scans: Vec<Vec<Track>>,
    told: BTreeMap<u32, Track>,
    fault: Fault,
}

impl Road {
    /// When the road is full.
    pub const FILLED: Time = Time(40_000_000_000);

    /// An empty road, which is full at [`Road::FILLED`].
    #[must_use]
    pub fn new(seed: u64) -> Road {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        Road {
            step: 0,
            traffic: Traffic::new(&mut random),
            random,
            past: VecDeque::new(),
            scans: vec![Vec::new(); RADARS],
            told: BTreeMap::new(),
            fault: Fault::Nothing,
        }
    }

    /// The time since the beginning.
    #[must_use]
    pub fn now(&self) -> Time {
        Time(self.step as i64 * STEP.0)
    }

    /// What happens to a radar from now on.
    pub fn set_fault(&mut self, fault: Fault) {
        self.fault = fault;
    }

    /// Goes on by 50 ms.
    pub fn step(&mut self) {
        self.step += 1;
        self.traffic.pass(STEP.seconds(), &mut self.random);
        self.past.push_back(self.traffic.vehicles().cloned().collect());
        if self.past.len() > MEMORY {
            self.past.pop_front();
        }
        self.tell();
        for radar in 0..RADARS {
            if self.is_scanning(radar) {
                self.scan(radar);
            }
        }
    }

    /// Whether a radar scans in this step: neighbours do by turns.
    pub(super) fn is_scanning(&self, radar: usize) -> bool {
        (self.step + radar as u64).is_multiple_of(2)
    }

    /// The newest tracks of a radar.
    pub(super) fn tracks(&self, radar: usize) -> &[Track] {
        self.scans.get(radar).map_or(&[], Vec::as_slice)
    }

    /// What the vehicles have told in the last second.
    pub(super) fn told(&self) -> impl Iterator<Item = Track> {
        self.told.values().copied()
    }

    pub(super) fn vehicle(&self, id: Option<u32>) -> Option<&Vehicle> {
        self.traffic.vehicles().find(|vehicle| Some(vehicle.id) == id)
    }

    /// What radars and vehicles say in this step, as topics with their JSON; the times in it are seconds, and `offset_s` later than those of
    /// the simulation.
    #[must_use]
    pub fn messages(&self, offset_s: f64) -> Vec<(String, String)> {
        let now_s = self.now().seconds();
        let of_radar = |radar: usize| {
            let tracks = self.tracks(radar);
            let list = |of: fn(&Track) -> f64| tracks.iter().map(of).collect::<Vec<_>>();
            let [x, y, speed] = [list(|it| it.x), list(|it| it.y), list(|it| it.speed)];
            let text = json!({ "t": now_s + offset_s, "x": x, "y": y, "speed": speed }).to_string();
            (format!("/radar/{}/tracks", radar + 1), text)
        };
        let of_vehicle = |track: Track| {
            let Track { at_s, x, y, speed, of } = track;
            let text = json!({ "t": at_s + offset_s, "id": of, "x": x, "y": y, "speed": speed });
            ("/vehicles".to_owned(), text.to_string())
        };
        let radars = (0..RADARS).filter(|radar| self.is_scanning(*radar)).map(of_radar);
        let vehicles = self.told().filter(|track| track.at_s >= now_s).map(of_vehicle);
        radars.chain(vehicles).collect()
    }

    /// Vehicles tell where they are.
    fn tell(&mut self) {
        let (now_s, step) = (self.now().seconds(), self.step);
        let is_due =
            |vehicle: &&Vehicle| vehicle.tells && (step + u64::from(vehicle.id)).is_multiple_of(TELLS_STEPS);
        for vehicle in self.traffic.vehicles().filter(is_due) {
            let (x, y) = (TOLD_M.0 * bell(&mut self.random), TOLD_M.1 * bell(&mut self.random));
            let (x, y, speed) = (vehicle.x + x, vehicle.y + y, vehicle.speed);
            self.told.insert(vehicle.id, Track { at_s: now_s, x, y, speed, of: vehicle.id });
        }
        self.told.retain(|_, track| now_s - track.at_s < 1.0);
    }

    fn scan(&mut self, radar: usize) {
        let is_faulty = self.fault.radar() == Some(radar);
        let age = if is_faulty { (self.fault.age_s() / STEP.seconds()).round() as usize } else { 0 };
        let Some(vehicles) = self.past.iter().rev().nth(age) else { return };
        let tracks = scan(radar, self.step as f64 * STEP.seconds(), vehicles.iter(), &mut self.random);
        if let Some(scan) = self.scans.get_mut(radar) {
            *scan = if is_faulty { self.fault.said(tracks) } else { tracks };
        }
    }
}
