//! Collision avoidance: drives around, and stops when the nearest obstacle is too near for the speed.
//!
//! Its only input about the world is `dmin`, under the name of the need. It does not know who computes `dmin`.

use super::robot::{Command, Robot};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use shsa_core::time::{Span, Time};

/// The activity of the controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    /// There is no fresh `dmin`: stands still, which is safe and useless.
    Blind,
    /// Drives.
    Drive,
    /// An obstacle is too near.
    Brake,
    /// Looks for a free direction.
    Turn,
    /// Has hit something: backs off until this time.
    BackOff(Time),
}

/// The controller's state.
#[derive(Clone, Debug)]
pub struct Avoidance {
    pub(super) mode: Mode,
    command: Command,
    dmin: Option<(Time, f64)>,
    turn_since: Time,
    turn_rate: f64,
    curve_until: Time,
    curve_rate: f64,
    random: ChaCha8Rng,
}

/// The speed on a free way, m/s.
const CRUISE: f64 = 0.6;
/// From the measurement to the beginning of braking, including the time to find a faulty sensor, seconds.
const REACTION: f64 = 0.6;
/// The distance between body and obstacle after braking, metres.
const MARGIN: f64 = 0.12;
/// A `dmin` older than this is not used.
const MAX_AGE: Span = Span::from_millis(500);

/// The smallest `dmin` at which driving on at `speed` m/s is safe, metres from the middle of the robot.
#[must_use]
pub fn stop_distance(speed: f64) -> f64 {
    Robot::RADIUS + MARGIN + speed * REACTION + speed * speed / (2.0 * Robot::DECELERATION)
}

impl Avoidance {
    /// A controller at rest; its turns and curves are those of the seed.
    #[must_use]
    pub fn new(seed: u64) -> Avoidance {
        let random = ChaCha8Rng::seed_from_u64(seed);
        Avoidance {
            mode: Mode::Blind,
            command: Command::default(),
            dmin: None,
            turn_since: Time(0),
            turn_rate: 0.0,
            curve_until: Time(0),
            curve_rate: 0.0,
            random,
        }
    }

    /// Takes in a `dmin` in metres: the lower bound, if it has one.
    pub fn observe(&mut self, stamp: Time, dmin: f64) {
        self.dmin = Some((stamp, dmin));
    }

    /// The bumper was hit.
    pub fn bumped(&mut self, now: Time) {
        self.mode = Mode::BackOff(now + Span::from_millis(1_000));
    }

    /// The present command at a speed of `speed` m/s; decided anew if `due`.
    pub fn command(&mut self, now: Time, speed: f64, due: bool) -> Command {
        if due {
            self.command = self.decide(now, speed);
        }
        self.command
    }

    fn decide(&mut self, now: Time, speed: f64) -> Command {
        self.mode = self.next_mode(now, speed);
        match self.mode {
            Mode::Blind | Mode::Brake => Command::default(),
            Mode::Drive => Command { speed: CRUISE, turn_rate: self.curve(now) },
            Mode::Turn => Command { speed: 0.0, turn_rate: self.turn_rate },
            Mode::BackOff(_) => Command { speed: -0.3, turn_rate: 0.0 },
        }
    }

    fn next_mode(&mut self, now: Time, speed: f64) -> Mode {
        if let Mode::BackOff(until) = self.mode {
            return if now < until { self.mode } else { self.start_turn(now) };
        }
        let fresh = self.dmin.filter(|&(stamp, _)| now - stamp <= MAX_AGE);
        let Some((_, dmin)) = fresh else { return Mode::Blind };
        match self.mode {
            Mode::Turn if dmin > self.free_distance(now) => Mode::Drive,
            Mode::Turn => Mode::Turn,
            Mode::Brake if speed.abs() > 0.01 => Mode::Brake,
            Mode::Brake => self.start_turn(now),
            _ if dmin > stop_distance(speed) => Mode::Drive,
            _ => Mode::Brake,
        }
    }

    fn start_turn(&mut self, now: Time) -> Mode {
        self.turn_since = now;
        self.turn_rate = if self.random.random() { 0.9 } else { -0.9 };
        Mode::Turn
    }

    /// The free distance that a direction must have; it shrinks while none is found.
    fn free_distance(&self, now: Time) -> f64 {
        (1.4 - 0.08 * (now - self.turn_since).seconds()).max(stop_distance(0.0) + 0.2)
    }

    /// A gentle curve that changes about every second.
    fn curve(&mut self, now: Time) -> f64 {
        if now >= self.curve_until {
            self.curve_until = now + Span::from_seconds(self.random.random_range(0.8..2.0));
            self.curve_rate = self.random.random_range(-0.25..0.25);
        }
        self.curve_rate
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the modes after each `dmin`, 100 ms apart, at a speed of `speed` m/s.
    #[track_caller]
    fn check(speed: f64, dmins: &[f64], expected: &[Mode]) {
        let mut avoidance = Avoidance::new(1);
        let modes: Vec<Mode> = (0i64..)
            .zip(dmins)
            .map(|(step, &dmin)| {
                let now = Time(step * 100_000_000);
                avoidance.observe(now, dmin);
                avoidance.decide(now, speed);
                avoidance.mode
            })
            .collect();
        assert_eq!(modes, expected);
    }

    #[test]
    fn it_stops_when_too_near_for_the_speed() {
        let near = stop_distance(0.6);
        check(0.6, &[near + 0.01, near - 0.01, 3.0], &[Mode::Drive, Mode::Brake, Mode::Brake]);
        check(0.3, &[near - 0.01], &[Mode::Drive]);
    }

    #[test]
    fn at_rest_it_turns_until_the_way_is_free() {
        check(
            0.0,
            &[0.3, 0.3, 0.9, 1.3, 1.5],
            &[Mode::Brake, Mode::Turn, Mode::Turn, Mode::Turn, Mode::Drive],
        );
    }

    #[test]
    fn without_fresh_dmin_it_stands_still() {
        let mut avoidance = Avoidance::new(1);
        assert_eq!(avoidance.decide(Time(0), 0.0), Command::default());
        avoidance.observe(Time(0), 2.0);
        assert_eq!(avoidance.decide(Time(400_000_000), 0.6).speed, CRUISE);
        assert_eq!(avoidance.decide(Time(600_000_000), 0.6), Command::default());
        assert_eq!(avoidance.mode, Mode::Blind);
    }
}
