//! Objects: the tracks of several sensors that are of one thing.

use super::assignment::assign;
use shsa_core::time::Time;

/// The most tracks of a sensor that are associated at a moment: the assignment takes cubic time.
pub const TRACKS_MAX: usize = 256;
/// The standard deviations within which an error is bounded.
const SIGMAS: f64 = 3.0;

/// What a sensor says of a thing: where it is at a time, and how it moves, in the same units for all sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Track {
    /// The time of the position.
    pub at: Time,
    /// The position in the plane.
    pub position: [f64; 2],
    /// The change of the position a second.
    pub velocity: [f64; 2],
}

impl Track {
    /// The track at another time, if the velocity stays as it is.
    #[must_use]
    pub fn ahead(self, at: Time) -> Track {
        let elapsed_s = (at - self.at).seconds();
        let [x, y] = self.position;
        let [x_a_second, y_a_second] = self.velocity;
        Track { at, position: [x + x_a_second * elapsed_s, y + y_a_second * elapsed_s], ..self }
    }

    /// Whether all of its numbers are numbers.
    fn is_finite(&self) -> bool {
        self.position.iter().chain(&self.velocity).all(|number| number.is_finite())
    }
}

/// A sensor of tracks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// The largest errors of a position along x and y: three standard deviations, each above 0.
    pub error: [f64; 2],
}

/// A track of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Member {
    /// The track, predicted to the moment of the association.
    pub track: Track,
    /// Its place in the given tracks of its sensor, from 0.
    pub index: usize,
}

/// One thing, by each sensor that sees it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Object {
    /// A track of each sensor, in the order of the sensors.
    pub members: Vec<Option<Member>>,
}

impl Object {
    /// The tracks of the sensors that see it.
    pub fn seen(&self) -> impl Iterator<Item = Member> {
        self.members.iter().copied().flatten()
    }

    /// Where it is: the mean of the positions, the more exact ones counting more, with the velocity of the first.
    #[must_use]
    pub fn place(&self, sensors: &[Sensor]) -> Option<Track> {
        let first = self.seen().next()?.track;
        let axis = |axis: usize| {
            let (mut sum, mut weights) = (0.0, 0.0);
            for (member, sensor) in self.members.iter().zip(sensors) {
                let Some(Member { track, .. }) = member else { continue };
                let weight = at(sensor.error, axis).powi(-2);
                sum += weight * at(track.position, axis);
                weights += weight;
            }
            sum / weights
        };
        Some(Track { position: [axis(0), axis(1)], ..first })
    }
}

/// The number of an axis.
fn at(of: [f64; 2], axis: usize) -> f64 {
    of.get(axis).copied().unwrap_or(f64::NAN)
}

/// When two tracks can be of one object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gate {
    /// The standard deviations by which sensors may be placed or stamped wrongly against each other.
    pub(super) misplaced: [f64; 2],
    /// The largest square of a distance in standard deviations.
    pub(super) square: f64,
}

impl Gate {
    /// The gate that the tracks of one object pass with this probability: the quantile of a chi-square variable of two degrees of freedom.
    pub(super) fn new(misplaced: [f64; 2], probability: f64) -> Gate {
        Gate { misplaced, square: -2.0 * libm::log1p(-probability) }
    }

    /// The square of the distance in standard deviations, within the gate.
    pub(super) fn distance(&self, one: [f64; 2], other: [f64; 2], errors: [[f64; 2]; 2]) -> Option<f64> {
        let square = |axis: usize| {
            let sigma = |error: [f64; 2]| at(error, axis) / SIGMAS;
            let variance = errors.map(|error| sigma(error).powi(2)).iter().sum::<f64>()
                + at(self.misplaced, axis).powi(2);
            (at(one, axis) - at(other, axis)).powi(2) / variance
        };
        let square = square(0) + square(1);
        (square < self.square).then_some(square)
    }
}

/// Assigns the tracks of a further sensor to objects; those without a partner are objects of their own.
pub(super) fn join(
    objects: &mut Vec<Object>,
    members: &[Member],
    sensors: &[Sensor],
    own: usize,
    gate: Gate,
) {
    let Some(sensor) = sensors.get(own) else { return };
    let places: Vec<Option<Track>> = objects.iter().map(|object| object.place(sensors)).collect();
    let errors: Vec<[f64; 2]> = objects.iter().map(|object| largest_error(object, sensors)).collect();
    let cost = |row: usize, column: usize| {
        let (place, member) = (places.get(row)?.as_ref()?, members.get(column)?);
        gate.distance(place.position, member.track.position, [*errors.get(row)?, sensor.error])
    };
    let assigned = assign(objects.len(), members.len(), cost);
    let mut is_alone = vec![true; members.len()];
    for (object, column) in objects.iter_mut().zip(&assigned) {
        let Some(column) = *column else { continue };
        let place = object.members.get_mut(own);
        if let (Some(place), Some(is_alone)) = (place, is_alone.get_mut(column)) {
            *place = members.get(column).copied();
            *is_alone = false;
        }
    }
    for member in members.iter().zip(is_alone).filter(|(_, is_alone)| *is_alone).map(|(member, _)| member) {
        let mut object = Object { members: vec![None; sensors.len()] };
        if let Some(place) = object.members.get_mut(own) {
            *place = Some(*member);
        }
        objects.push(object);
    }
}

/// The largest error of those who see an object.
fn largest_error(object: &Object, sensors: &[Sensor]) -> [f64; 2] {
    let seen = object.members.iter().zip(sensors).filter(|(member, _)| member.is_some());
    seen.fold([0.0, 0.0], |[x, y], (_, sensor)| {
        let [own_x, own_y] = sensor.error;
        [own_x.max(x), own_y.max(y)]
    })
}

/// The first [`TRACKS_MAX`] tracks whose numbers are numbers, predicted to a moment.
pub(super) fn predicted(tracks: &[Track], at: Time) -> impl Iterator<Item = Member> {
    let whole = tracks.iter().enumerate().take(TRACKS_MAX).filter(|(_, track)| track.is_finite());
    whole.map(move |(index, track)| Member { track: track.ahead(at), index })
}
