//! The sensors: their fields of view, errors, rates and delays.
//!
//! All have the same field of view, 60 degrees to either side from the middle of the robot, and a range beyond the nearest
//! obstacle. So the smallest distance of each means the same. It jumps when an obstacle's edge enters or leaves the field; the
//! sensors agree again as soon as each has measured anew.

use super::robot::Robot;
use super::room::Room;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};

/// Half of the field of view of every sensor, radians.
const HALF_FIELD: f64 = 60.0 * std::f64::consts::PI / 180.0;

/// The topic of the lidar, as in the model: distances of 121 beams in metres, 10 Hz.
pub const LIDAR: &str = "/lidar/scan";
/// The topic of the sonar ring: distances of 12 cones in metres, 12.5 Hz.
pub const SONAR: &str = "/sonar/ranges";
/// The topic of the depth camera: an image of 5 rows of 96 distances in metres, 15 Hz.
pub const DEPTH: &str = "/depth/image";
/// The topic of the odometry: the speed in m/s, 20 Hz.
pub const ODOMETRY: &str = "/odom/speed";

/// Beams of the lidar: one a degree.
const BEAMS: usize = 121;
/// Cones of the sonar ring: 10 degrees each, without gaps.
const CONES: usize = 12;
/// Columns and rows of the depth image; the middle row is the horizontal one.
const COLUMNS: usize = 96;
const ROWS: usize = 5;
/// The angle between two rows of the depth image, radians.
const ROW_STEP: f64 = 8.0 * std::f64::consts::PI / 180.0;
/// The height of the depth camera above the floor, which its lower rows see, metres.
const CAMERA_HEIGHT: f64 = 0.3;

/// The true smallest distance in the field of view, metres.
#[must_use]
pub fn true_dmin(room: &Room, robot: &Robot) -> f64 {
    room.nearest(robot.pose, HALF_FIELD)
}

/// A measurement of a sensor, without its errors.
type Measure = fn(&Room, &Robot) -> Vec<f64>;

/// A sensor: measures, adds its errors, and sets the time of arrival.
#[derive(Clone, Debug)]
pub struct Sensor {
    /// The topic of its measurements.
    pub topic: &'static str,
    period: Span,
    jitter_ms: f64,
    delay_ms: (f64, f64),
    /// The largest error, metres or m/s.
    noise: f64,
    measure: Measure,
    random: ChaCha8Rng,
    nominal: Time,
    due: Time,
}

/// A measurement under way.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The topic of the sensor.
    pub topic: &'static str,
    /// When it was measured.
    pub stamp: Time,
    /// When it reaches the bus.
    pub arrival: Time,
    /// The measured value, with its error.
    pub value: RawValue,
}

/// The four sensors of the demonstration; each has its own stream of random numbers.
#[must_use]
pub fn all(seed: u64) -> Vec<Sensor> {
    let sensor = |stream, topic, hertz: f64, jitter_ms, delay_ms, noise, measure: Measure| {
        let period = Span::from_seconds(1.0 / hertz);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(stream);
        let due = Time(random.random_range(0..period.0));
        Sensor { topic, period, jitter_ms, delay_ms, noise, measure, random, nominal: due, due }
    };
    vec![
        sensor(1, LIDAR, 10.0, 3.0, (10.0, 20.0), 0.03, scan),
        sensor(2, SONAR, 12.5, 4.0, (20.0, 40.0), 0.10, ring),
        sensor(3, DEPTH, 15.0, 3.0, (25.0, 40.0), 0.06, image),
        sensor(4, ODOMETRY, 20.0, 2.0, (5.0, 10.0), 0.02, speed),
    ]
}

impl Sensor {
    /// The measurement of this moment; `None` while none is due.
    pub fn sample(&mut self, now: Time, room: &Room, robot: &Robot) -> Option<Sample> {
        if now < self.due {
            return None;
        }
        let mut values = (self.measure)(room, robot);
        for value in &mut values {
            *value += self.noise * bell(&mut self.random);
        }
        let delay_ms = self.random.random_range(self.delay_ms.0..self.delay_ms.1);
        self.nominal = self.nominal + self.period;
        let jitter_ms = self.random.random_range(-self.jitter_ms..self.jitter_ms);
        self.due = self.nominal + Span::from_seconds(jitter_ms * 1e-3);
        let value =
            if self.topic == ODOMETRY { RawValue::Number(values[0]) } else { RawValue::Vector(values) };
        Some(Sample {
            topic: self.topic,
            stamp: now,
            arrival: now + Span::from_seconds(delay_ms * 1e-3),
            value,
        })
    }
}

/// A random number within plus-minus 1, bell-shaped: the mean of three uniform numbers, standard deviation 1/3.
fn bell(random: &mut ChaCha8Rng) -> f64 {
    (0..3).map(|_| random.random_range(-1.0..=1.0)).sum::<f64>() / 3.0
}

/// The directions of the distances in a scan, from the right to the left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beams {
    /// The direction of the first distance from the heading, radians; positive is left.
    pub first: f64,
    /// The angle from one distance to the next, radians; 0 for a single distance, which is straight ahead.
    pub step: f64,
    /// How many there are.
    pub count: usize,
}

impl Beams {
    /// Those of a sensor that reports `count` distances in the horizontal plane.
    #[must_use]
    pub fn of(topic: &str, count: usize) -> Beams {
        let (first, step) = match count {
            0 | 1 => (0.0, 0.0),
            _ if topic == SONAR => {
                let step = 2.0 * HALF_FIELD / count as f64;
                (step / 2.0 - HALF_FIELD, step)
            }
            _ => (-HALF_FIELD, 2.0 * HALF_FIELD / (count - 1) as f64),
        };
        Beams { first, step, count }
    }

    /// The direction of each distance.
    pub fn angles(self) -> impl Iterator<Item = f64> {
        (0..self.count).map(move |index| self.first + self.step * index as f64)
    }

    /// The distance whose direction is nearest to an angle; `None` outside of the field.
    #[must_use]
    pub fn nearest(self, angle: f64) -> Option<usize> {
        let step = if self.step > 0.0 { self.step } else { HALF_FIELD / 30.0 };
        let index = ((angle - self.first) / step).round();
        (index >= 0.0 && index < self.count as f64).then_some(index as usize)
    }
}

/// The distances of a sensor in the horizontal plane: of an image of the depth camera, its middle row.
#[must_use]
pub fn level<'v>(topic: &str, values: &'v [f64]) -> &'v [f64] {
    let is_image = topic == DEPTH && values.len() == ROWS * COLUMNS;
    let row = values.get(ROWS / 2 * COLUMNS..(ROWS / 2 + 1) * COLUMNS);
    row.filter(|_| is_image).unwrap_or(values)
}

/// `count` directions over the field, both edges included.
fn directions(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |index| HALF_FIELD * (2.0 * index as f64 / (count - 1) as f64 - 1.0))
}

fn scan(room: &Room, robot: &Robot) -> Vec<f64> {
    directions(BEAMS).map(|angle| room.sight(robot.pose.turned(angle))).collect()
}

/// The nearest obstacle within each cone.
fn ring(room: &Room, robot: &Robot) -> Vec<f64> {
    let half = HALF_FIELD / CONES as f64;
    let middle = |cone: usize| half * (2 * cone + 1) as f64 - HALF_FIELD;
    (0..CONES).map(|cone| room.nearest(robot.pose.turned(middle(cone)), half)).collect()
}

/// Distances along the line of sight of each pixel, row by row from above. Obstacles are higher than the camera's view; the lower
/// rows see the floor.
fn image(room: &Room, robot: &Robot) -> Vec<f64> {
    let row: Vec<f64> = directions(COLUMNS).map(|angle| room.sight(robot.pose.turned(angle))).collect();
    let up = |index: usize| ROW_STEP * ((ROWS / 2) as f64 - index as f64);
    let pixel = |up: f64, level: f64| {
        let floor = if up < 0.0 { CAMERA_HEIGHT / (-up).sin() } else { f64::INFINITY };
        (level / up.cos()).min(floor)
    };
    (0..ROWS).flat_map(|index| row.iter().map(move |&level| pixel(up(index), level))).collect()
}

fn speed(_: &Room, robot: &Robot) -> Vec<f64> {
    vec![robot.speed]
}

/// The smallest distance that a sensor reports, metres, by the relations of the model; `None` for other topics and for what is no
/// list.
#[must_use]
pub fn nearest_seen(topic: &str, value: &RawValue) -> Option<f64> {
    let RawValue::Vector(values) = value else { return None };
    if ![LIDAR, SONAR, DEPTH].contains(&topic) {
        return None;
    }
    level(topic, values).iter().copied().reduce(f64::min)
}

#[cfg(test)]
mod tests {
    use super::super::room::{Point, Pose};
    use super::*;

    /// The largest difference between a sensor's smallest distance and the truth, over random poses.
    fn worst_difference(topic: &str) -> f64 {
        let room = Room::furnished();
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut worst = 0.0_f64;
        for _ in 0..500 {
            let at = Point { x: random.random_range(0.3..6.9), y: random.random_range(0.3..4.8) };
            let robot = Robot::at(Pose { at, heading: random.random_range(0.0..6.3) });
            if room.is_solid(at) {
                continue;
            }
            let mut sensor = all(3).into_iter().find(|sensor| sensor.topic == topic).unwrap();
            let sample = sensor.sample(Time::from_seconds(1.0), &room, &robot).unwrap();
            worst = worst.max((nearest_seen(topic, &sample.value).unwrap() - true_dmin(&room, &robot)).abs());
        }
        worst
    }

    /// The model's tolerances cover the noise and the gaps between two rays.
    #[test]
    fn all_see_the_same_nearest_obstacle() {
        for (topic, tolerance) in [(LIDAR, 0.05), (SONAR, 0.12), (DEPTH, 0.08)] {
            let worst = worst_difference(topic);
            assert!(worst < tolerance, "{topic}: {worst}");
        }
    }

    #[test]
    fn each_direction_is_that_of_its_distance() {
        let sensed = [(LIDAR, BEAMS), (SONAR, CONES), (DEPTH, COLUMNS)];
        for (topic, count) in sensed {
            let beams = Beams::of(topic, count);
            for (index, angle) in beams.angles().enumerate() {
                assert_eq!(beams.nearest(angle + 0.4 * beams.step), Some(index), "{topic}");
            }
            assert_eq!(beams.nearest(1.2), None);
        }
        let ahead = Robot::at(Pose { at: Point { x: 1.0, y: 1.5 }, heading: 0.0 });
        let room = Room::furnished();
        for (topic, count, measure) in [(LIDAR, BEAMS, scan as Measure), (SONAR, CONES, ring)] {
            let seen = Beams::of(topic, count).angles().zip(measure(&room, &ahead));
            for (angle, distance) in seen {
                assert!(distance <= room.sight(ahead.pose.turned(angle)) + 1e-9, "{topic}");
            }
        }
        assert_eq!(Beams::of(LIDAR, 1).angles().collect::<Vec<_>>(), [0.0]);
    }

    #[test]
    fn the_floor_is_only_seen_below_the_middle_row() {
        let room = Room::furnished();
        let robot = Robot::at(Pose { at: Point { x: 1.0, y: 1.5 }, heading: 0.0 });
        let rows: Vec<f64> = image(&room, &robot).chunks(COLUMNS).map(|row| row[COLUMNS - 1]).collect();
        let level = room.sight(robot.pose.turned(HALF_FIELD));
        assert_eq!(rows[ROWS / 2], level);
        assert!(rows[0] > level && rows[ROWS - 1] < level);
    }

    #[test]
    fn sensors_keep_their_rates_and_arrive_in_order() {
        let room = Room::furnished();
        let robot = Robot::at(Pose { at: Point { x: 1.0, y: 1.5 }, heading: 0.0 });
        for (mut sensor, expected) in all(1).into_iter().zip([100, 125, 150, 200]) {
            let steps = (0..2000).map(|step| Time(step * 5_000_000));
            let samples: Vec<Sample> = steps.filter_map(|now| sensor.sample(now, &room, &robot)).collect();
            assert_eq!(samples.len(), expected, "{}", sensor.topic);
            assert!(samples.windows(2).all(|pair| pair[0].arrival < pair[1].arrival));
        }
    }
}
