//! A border between two radars: their tracks are associated by the file that `shsa service --associate` reads, too.

use super::radar::Track;
use shsa_core::time::Time;
use shsa_demo::DemoError;
use shsa_estimate::association::{self, Associated, Associator};
use shsa_format::association::Associations;

/// The associations of all borders.
const ASSOCIATIONS: &str = include_str!("../../models/radar-tracks.yaml");
/// A message of a vehicle is used for this long, s.
const TOLD_FOR_S: f64 = 0.6;

/// The association of one border.
#[derive(Clone, Debug)]
pub(super) struct Border(Associator);

/// How many vehicles are at the border.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Counts {
    pub(super) left: f64,
    pub(super) entered: f64,
    pub(super) told: f64,
}

/// One vehicle, by each who sees it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Seen {
    pub(super) left: Option<Track>,
    pub(super) entered: Option<Track>,
    pub(super) told: Option<Track>,
}

impl Seen {
    /// The vehicle that most of them are tracks of: for the score only.
    pub(super) fn of(&self) -> Option<u32> {
        let seen = [self.left, self.entered, self.told];
        let tracks: Vec<u32> = seen.into_iter().flatten().map(|track| track.of).collect();
        tracks.iter().copied().max_by_key(|id| tracks.iter().filter(|other| *other == id).count())
    }
}

impl Border {
    /// The borders along the road, in order.
    ///
    /// # Errors
    /// [`DemoError::Model`] when the file has errors, which tests exclude.
    pub(super) fn all() -> Result<Vec<Border>, DemoError> {
        let read = Associations::read(ASSOCIATIONS, "models/tracks/radars.yaml");
        let read = read.map_err(|report| DemoError::Model(report.render(false)))?;
        Ok(read.associations.into_iter().map(|association| Border(association.associator)).collect())
    }

    /// Takes in the newest tracks of both radars and what vehicles have told; returns the vehicle that is spoken of, and the counts.
    pub(super) fn take(
        &mut self,
        left: &[Track],
        entered: &[Track],
        told: &[Track],
        at_s: f64,
    ) -> (Seen, Counts) {
        let told: Vec<Track> = told.iter().filter(|told| at_s - told.at_s < TOLD_FOR_S).copied().collect();
        // In the order of the sensors in the file.
        let given = [entered, left, &told];
        let tracks = given.map(|tracks| tracks.iter().map(associated).collect::<Vec<_>>());
        let tracks = tracks.each_ref().map(|tracks| Some(tracks.as_slice()));
        let found = self.0.associate(&tracks, Time::from_seconds(at_s));
        let count = |sensor: usize| found.counts.get(sensor).copied().flatten().unwrap_or(0.0);
        let counts = Counts { entered: count(0), left: count(1), told: count(2) };
        let [entered, left, told] = [0, 1, 2].map(|sensor| seen(&found, sensor, given.get(sensor)?));
        (Seen { left, entered, told }, counts)
    }
}

/// A track as the association takes it: nothing of it says which vehicle it is.
fn associated(track: &Track) -> association::Track {
    let Track { at_s, x, y, speed, of: _ } = *track;
    association::Track { at: Time::from_seconds(at_s), position: [x, y], velocity: [speed, 0.0] }
}

/// The chosen vehicle by a sensor, where it is at the moment of the association.
fn seen(found: &Associated, sensor: usize, given: &[Track]) -> Option<Track> {
    let member = found.objects.get(found.chosen?)?.members.get(sensor).copied().flatten()?;
    let [x, y] = member.track.position;
    Some(Track { at_s: member.track.at.seconds(), x, y, ..*given.get(member.index)? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vehicle_at_a_border_is_found_by_both_radars() {
        let mut borders = Border::all().unwrap();
        assert_eq!(borders.len(), 3);
        let track = |at_s: f64, x: f64| Track { at_s, x, y: 2.0, speed: 20.0, of: x as u32 };
        // 0.1 s later both are 2 m further.
        let (left, entered) = ([track(0.0, 145.0)], [track(0.1, 150.0)]);
        let (seen, counts) = borders[0].take(&left, &entered, &[], 0.1);
        assert_eq!((seen.left.map(|it| it.x), seen.entered.map(|it| it.x)), (Some(147.0), Some(150.0)));
        assert_eq!((counts.left, counts.entered, counts.told), (1.0, 1.0, 0.0));
    }
}
