//! The robot: a round body with two driven wheels. It moves as commanded, and stops at obstacles.

use super::room::{Pose, Room};

/// A command to the drive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command {
    /// Speed in m/s; negative is backwards.
    pub speed: f64,
    /// Turn rate in rad/s; positive is left.
    pub turn_rate: f64,
}

/// Pose and motion.
#[derive(Clone, Debug)]
pub struct Robot {
    /// The middle of the body, and where it looks.
    pub pose: Pose,
    /// Speed in m/s along the heading.
    pub speed: f64,
    touching: bool,
}

impl Robot {
    /// Radius of the body, metres.
    pub const RADIUS: f64 = 0.2;
    /// The largest acceleration, m/s^2.
    const ACCELERATION: f64 = 0.5;
    /// The largest deceleration, m/s^2.
    pub(super) const DECELERATION: f64 = 1.0;

    /// The gap at which a contact ends, metres: pushing on against a wall is the same contact.
    const LETS_GO: f64 = 0.02;

    /// A robot at rest.
    #[must_use]
    pub fn at(pose: Pose) -> Robot {
        Robot { pose, speed: 0.0, touching: false }
    }

    /// Moves for `dt` seconds, and stops at an obstacle; returns whether it has just hit one.
    pub fn step(&mut self, command: Command, room: &Room, dt: f64) -> bool {
        let braking = command.speed.abs() < self.speed.abs() || command.speed * self.speed < 0.0;
        let most = dt * if braking { Self::DECELERATION } else { Self::ACCELERATION };
        self.speed += (command.speed - self.speed).clamp(-most, most);
        self.pose.heading += command.turn_rate * dt;
        let next = self.pose.at.ahead(self.pose.heading, self.speed * dt);
        let (gap, next_gap) = (self.clearance(room), room.clearance(next) - Self::RADIUS);
        let blocked = next_gap < 0.0 && next_gap < gap;
        let collided = blocked && !self.touching;
        self.touching = blocked || (self.touching && gap < Self::LETS_GO);
        if blocked {
            self.speed = 0.0;
        } else {
            self.pose.at = next;
        }
        collided
    }

    /// Metres between the body and the nearest obstacle.
    #[must_use]
    pub fn clearance(&self, room: &Room) -> f64 {
        room.clearance(self.pose.at) - Self::RADIUS
    }
}

#[cfg(test)]
mod tests {
    use super::super::room::Point;
    use super::*;

    fn drive(robot: &mut Robot, command: Command, seconds: f64) -> u32 {
        let room = Room::furnished();
        (0..(seconds * 200.0) as u32).map(|_| u32::from(robot.step(command, &room, 0.005))).sum()
    }

    #[test]
    fn it_brakes_within_the_distance_that_its_deceleration_gives() {
        let mut robot = Robot::at(Pose { at: Point { x: 1.0, y: 1.5 }, heading: 0.0 });
        drive(&mut robot, Command { speed: 0.6, turn_rate: 0.0 }, 2.0);
        assert!((robot.speed - 0.6).abs() < 1e-9);
        let start = robot.pose.at.x;
        drive(&mut robot, Command::default(), 1.0);
        assert_eq!(robot.speed, 0.0);
        assert!((robot.pose.at.x - start - 0.18).abs() < 0.01);
    }

    #[test]
    fn a_wall_stops_it_and_counts_once() {
        let mut robot = Robot::at(Pose { at: Point { x: 1.0, y: 1.0 }, heading: std::f64::consts::PI });
        let ahead = Command { speed: 0.6, turn_rate: 0.0 };
        assert_eq!(drive(&mut robot, ahead, 5.0), 1);
        assert!(robot.clearance(&Room::furnished()).abs() < 0.01);
        assert_eq!(drive(&mut robot, Command { speed: -0.3, turn_rate: 0.0 }, 1.0), 0);
        assert_eq!(drive(&mut robot, ahead, 5.0), 1);
    }
}
