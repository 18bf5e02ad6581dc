//! The room: walls, boxes and pillars, and the distances to them.

/// A point in the room, metres from the lower left corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Metres to the right.
    pub x: f64,
    /// Metres upwards.
    pub y: f64,
}

impl Point {
    /// The point moved by `distance` metres into `direction` (radians, counter-clockwise from x).
    #[must_use]
    pub fn ahead(self, direction: f64, distance: f64) -> Point {
        Point { x: self.x + distance * direction.cos(), y: self.y + distance * direction.sin() }
    }

    /// The distance of two points, metres.
    pub(super) fn distance(self, other: Point) -> f64 {
        self.minus(other).length()
    }

    fn minus(self, other: Point) -> Point {
        Point { x: self.x - other.x, y: self.y - other.y }
    }

    fn dot(self, other: Point) -> f64 {
        self.x * other.x + self.y * other.y
    }

    fn cross(self, other: Point) -> f64 {
        self.x * other.y - self.y * other.x
    }

    fn length(self) -> f64 {
        self.x.hypot(self.y)
    }

    /// The point in the coordinates of `pose`, which looks along x.
    fn seen_from(self, pose: Pose) -> Point {
        let (sin, cos) = pose.heading.sin_cos();
        let offset = self.minus(pose.at);
        Point { x: offset.x * cos + offset.y * sin, y: offset.y * cos - offset.x * sin }
    }
}

/// A position and a heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The position.
    pub at: Point,
    /// The heading in radians, counter-clockwise from x.
    pub heading: f64,
}

impl Pose {
    /// The same position, turned to the left by `angle` radians.
    pub(super) fn turned(self, angle: f64) -> Pose {
        Pose { at: self.at, heading: self.heading + angle }
    }
}

#[derive(Clone, Copy, Debug)]
enum Surface {
    Segment(Point, Point),
    Circle(Point, f64),
}

/// All obstacles. A surface is seen from its free side.
#[derive(Clone, Debug)]
pub struct Room {
    pub(super) width: f64,
    pub(super) height: f64,
    surfaces: Vec<Surface>,
    boxes: Vec<(Point, Point)>,
}

impl Room {
    /// The room of the demonstration: 7.2 m by 5.1 m, three boxes and two pillars. It is so small that every sensor can reach the
    /// nearest obstacle from everywhere.
    #[must_use]
    pub fn furnished() -> Room {
        let mut room = Room { width: 7.2, height: 5.1, surfaces: Vec::new(), boxes: Vec::new() };
        room.add_outline(Point { x: 0.0, y: 0.0 }, Point { x: 7.2, y: 5.1 });
        for (x, y, width, height) in [(1.05, 3.3, 0.9, 0.6), (4.5, 0.9, 1.05, 0.6), (2.1, 0.0, 0.75, 0.6)] {
            room.add_box(Point { x, y }, Point { x: x + width, y: y + height });
        }
        room.surfaces.push(Surface::Circle(Point { x: 3.3, y: 2.55 }, 0.28));
        room.surfaces.push(Surface::Circle(Point { x: 5.7, y: 3.75 }, 0.34));
        room
    }

    fn add_box(&mut self, low: Point, high: Point) {
        self.add_outline(low, high);
        self.boxes.push((low, high));
    }

    fn add_outline(&mut self, low: Point, high: Point) {
        let corners = [low, Point { x: high.x, y: low.y }, high, Point { x: low.x, y: high.y }, low];
        self.surfaces.extend(corners.windows(2).map(|ends| Surface::Segment(ends[0], ends[1])));
    }

    /// Whether there is a wall or an obstacle at `place`.
    #[must_use]
    pub fn is_solid(&self, place: Point) -> bool {
        let inside = |(low, high): &(Point, Point)| {
            (low.x..=high.x).contains(&place.x) && (low.y..=high.y).contains(&place.y)
        };
        let outside = !((0.0..=self.width).contains(&place.x) && (0.0..=self.height).contains(&place.y));
        outside || self.boxes.iter().any(inside) || self.surfaces.iter().any(|s| s.is_around(place))
    }

    /// Metres from `place` to the nearest surface.
    pub(super) fn clearance(&self, place: Point) -> f64 {
        self.smallest(|surface| surface.distance(place))
    }

    /// Metres along the line of sight of `pose` to the first surface; infinite when there is none.
    pub(super) fn sight(&self, pose: Pose) -> f64 {
        self.smallest(|surface| surface.seen_from(pose).sight(0.0))
    }

    /// Metres to the nearest surface within `half_angle` radians (below 90 degrees) left and right of the line of
    /// sight of `pose`; exact, not sampled.
    pub(super) fn nearest(&self, pose: Pose, half_angle: f64) -> f64 {
        self.smallest(|surface| surface.seen_from(pose).nearest_within(half_angle))
    }

    fn smallest(&self, distance: impl Fn(&Surface) -> f64) -> f64 {
        self.surfaces.iter().map(distance).fold(f64::INFINITY, f64::min)
    }
}

const ORIGIN: Point = Point { x: 0.0, y: 0.0 };

impl Surface {
    fn is_around(&self, place: Point) -> bool {
        matches!(*self, Surface::Circle(centre, radius) if place.minus(centre).length() <= radius)
    }

    fn seen_from(&self, pose: Pose) -> Surface {
        match *self {
            Surface::Segment(a, b) => Surface::Segment(a.seen_from(pose), b.seen_from(pose)),
            Surface::Circle(centre, radius) => Surface::Circle(centre.seen_from(pose), radius),
        }
    }

    /// The point nearest to `place`.
    fn foot(&self, place: Point) -> Point {
        match *self {
            Surface::Segment(a, b) => {
                let along = b.minus(a);
                let share = (place.minus(a).dot(along) / along.dot(along)).clamp(0.0, 1.0);
                Point { x: a.x + share * along.x, y: a.y + share * along.y }
            }
            Surface::Circle(centre, radius) => {
                let out = place.minus(centre);
                centre.ahead(out.y.atan2(out.x), radius)
            }
        }
    }

    fn distance(&self, place: Point) -> f64 {
        self.foot(place).minus(place).length()
    }

    /// Distance from the origin along `direction`; infinite when the ray misses.
    fn sight(&self, direction: f64) -> f64 {
        let ray = ORIGIN.ahead(direction, 1.0);
        match *self {
            Surface::Segment(a, b) => {
                let along = b.minus(a);
                let (distance, share) = (a.cross(along) / ray.cross(along), a.cross(ray) / ray.cross(along));
                if distance >= 0.0 && (0.0..=1.0).contains(&share) { distance } else { f64::INFINITY }
            }
            Surface::Circle(centre, radius) => {
                let (ahead, aside) = (centre.dot(ray), centre.cross(ray));
                let depth = radius * radius - aside * aside;
                if ahead >= 0.0 && depth >= 0.0 { ahead - depth.sqrt() } else { f64::INFINITY }
            }
        }
    }

    /// Distance from the origin to the part of the surface within `half_angle` of x. The distance is convex along a surface, so
    /// its minimum is at the foot, or where the surface ends or leaves the field.
    fn nearest_within(&self, half_angle: f64) -> f64 {
        let within = |point: &Point| point.y.atan2(point.x).abs() <= half_angle;
        let foot = self.foot(ORIGIN);
        if within(&foot) {
            return foot.length();
        }
        let ends = match *self {
            Surface::Segment(a, b) => {
                [a, b].into_iter().filter(within).map(Point::length).fold(f64::INFINITY, f64::min)
            }
            Surface::Circle(..) => f64::INFINITY,
        };
        ends.min(self.sight(half_angle)).min(self.sight(-half_angle))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn pose(x: f64, y: f64, degrees: f64) -> Pose {
        Pose { at: Point { x, y }, heading: degrees.to_radians() }
    }

    #[track_caller]
    fn check_sight(pose: Pose, expected: f64) {
        let seen = Room::furnished().sight(pose);
        assert!((seen - expected).abs() < 1e-9, "{seen} instead of {expected}");
    }

    #[test]
    fn walls_boxes_and_pillars_are_seen() {
        check_sight(pose(1.0, 1.0, 180.0), 1.0);
        check_sight(pose(3.3, 4.1, 90.0), 1.0);
        check_sight(pose(3.3, 1.0, 90.0), 2.55 - 0.28 - 1.0);
        check_sight(pose(3.5, 1.2, 0.0), 1.0);
    }

    #[test]
    fn solid_is_what_cannot_be_entered() {
        let room = Room::furnished();
        for (x, y, solid) in [(1.5, 3.5, true), (3.3, 2.5, true), (-0.1, 1.0, true), (1.0, 1.0, false)] {
            assert_eq!(room.is_solid(Point { x, y }), solid, "at {x}, {y}");
        }
    }

    /// The exact minimum is never above any ray of the field, and a dense fan of rays comes close to it.
    #[test]
    fn nearest_is_the_minimum_over_the_field() {
        let room = Room::furnished();
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        for _ in 0..200 {
            let pose = pose(
                random.random_range(0.1..7.1),
                random.random_range(0.1..5.0),
                random.random_range(0.0..360.0),
            );
            if room.is_solid(pose.at) {
                continue;
            }
            let half = random.random_range(0.02..1.5);
            let rays = (-2000..=2000).map(|ray| room.sight(pose.turned(half * f64::from(ray) / 2000.0)));
            let sampled = rays.fold(f64::INFINITY, f64::min);
            let exact = room.nearest(pose, half);
            assert!(exact <= sampled + 1e-9 && sampled < exact + 0.02, "{exact} and {sampled} at {pose:?}");
        }
    }
}
