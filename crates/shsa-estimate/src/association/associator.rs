//! The associator: tracks in, objects out, and the object that is compared over time.

use super::counts::Counts;
use super::objects::{Gate, Member, Object, Sensor, Track, join, predicted};
use super::region::Region;
use crate::Error;
use shsa_core::time::{Span, Time};

/// What an associator knows of its sensors and of the place.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The sensors, in the order in which their tracks are given.
    pub sensors: Vec<Sensor>,
    /// By how much sensors may be placed or stamped wrongly against each other without their tracks losing their partners, along x and y:
    /// one standard deviation. Without it a faulty sensor finds no partner, and no contradiction is seen.
    pub misplaced: [f64; 2],
    /// The probability with which the gate lets the tracks of one object pass, between 0 and 1.
    pub gate: f64,
    /// Where tracks are associated: where several sensors can see an object; `None`: everywhere.
    pub region: Option<Region>,
    /// Where sensors see an object as a whole: objects are counted there, and the chosen one is there; `None`: in the region.
    pub inner: Option<Region>,
    /// Of the objects that most sensors see, the nearest to this point is chosen.
    pub near: [f64; 2],
    /// The time over which objects are counted.
    pub count_over: Span,
    /// How long no object is chosen after one was lost: values of the two are not compared.
    pub pause: Span,
}

/// The result of an association.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Associated {
    /// All objects.
    pub objects: Vec<Object>,
    /// The chosen object; `None` while there is none, and for the pause after one was lost.
    pub chosen: Option<usize>,
    /// How many objects each sensor sees, as a mean; `None` for a sensor that is silent.
    pub counts: Vec<Option<f64>>,
}

/// Associates the tracks of sensors, moment by moment.
///
/// Complexity: O(n^3) for n tracks of a sensor, of at most [`TRACKS_MAX`](super::TRACKS_MAX); memory is bounded.
#[derive(Clone, Debug)]
pub struct Associator {
    settings: Settings,
    gate: Gate,
    counts: Counts,
    /// Where the chosen object was last.
    last: Option<Track>,
    /// The end of the pause.
    quiet_until: Option<Time>,
}

impl Associator {
    /// # Errors
    /// [`Error::Range`] for errors that are not above 0, and for a gate that is no probability.
    pub fn new(settings: Settings) -> Result<Associator, Error> {
        let range = |what, value, range| Err(Error::Range { what, value, range });
        let is_error = |error: &f64| error.is_finite() && *error > 0.0;
        if let Some(&value) =
            settings.sensors.iter().flat_map(|sensor| &sensor.error).find(|it| !is_error(it))
        {
            return range("an error", value, "above 0");
        }
        if let Some(&value) = settings.misplaced.iter().find(|it| !(it.is_finite() && **it >= 0.0)) {
            return range("a misplacement", value, "at least 0");
        }
        if !(settings.gate > 0.0 && settings.gate < 1.0) {
            return range("the probability of the gate", settings.gate, "between 0 and 1");
        }
        let gate = Gate::new(settings.misplaced, settings.gate);
        Ok(Associator { settings, gate, counts: Counts::default(), last: None, quiet_until: None })
    }

    /// The sensors, in their order.
    #[must_use]
    pub fn sensors(&self) -> &[Sensor] {
        &self.settings.sensors
    }

    /// Associates the latest tracks of all sensors at a moment; `None` for a sensor that is silent. Moments do not go back.
    pub fn associate(&mut self, tracks: &[Option<&[Track]>], at: Time) -> Associated {
        let mut objects = Vec::new();
        let mut counted = Vec::with_capacity(self.settings.sensors.len());
        for own in 0..self.settings.sensors.len() {
            let given = tracks.get(own).copied().flatten();
            let members: Vec<Member> = given
                .into_iter()
                .flat_map(|tracks| predicted(tracks, at))
                .filter(|it| self.is_in_region(it))
                .collect();
            let inner = members.iter().filter(|member| self.is_inner(&member.track)).count();
            counted.push(given.map(|_| inner as u32));
            join(&mut objects, &members, &self.settings.sensors, own, self.gate);
        }
        let chosen = self.choose(&objects, at);
        let counts = self.counts.take(at, counted, self.settings.count_over);
        Associated { objects, chosen, counts }
    }

    /// The object of the moment before while it is there, else the best, after a pause.
    fn choose(&mut self, objects: &[Object], at: Time) -> Option<usize> {
        let last = self.last.map(|last| last.ahead(at));
        let same = last.and_then(|last| self.same(objects, &last));
        let chosen = same.or_else(|| self.best(objects));
        if same.is_none() && last.is_some() {
            self.quiet_until = Some(at + self.settings.pause);
        }
        self.last = chosen.and_then(|chosen| objects.get(chosen)?.place(&self.settings.sensors));
        chosen.filter(|_| self.quiet_until.is_none_or(|until| at >= until))
    }

    /// The object that is where the last one is to be, while sensors see all of it.
    fn same(&mut self, objects: &[Object], last: &Track) -> Option<usize> {
        let errors = self.settings.sensors.iter().fold([0.0_f64; 2], |[x, y], sensor| {
            let [own_x, own_y] = sensor.error;
            [x.max(own_x), y.max(own_y)]
        });
        let gate = self.gate;
        let is_it = |place: &Track| gate.distance(last.position, place.position, [errors; 2]).is_some();
        let places = objects.iter().map(|object| object.place(&self.settings.sensors));
        let (found, place) =
            places.enumerate().find_map(|(index, place)| place.filter(is_it).map(|place| (index, place)))?;
        self.is_inner(&place).then_some(found)
    }

    /// Of the objects that sensors see as a whole those that most of them see, and of these the nearest.
    fn best(&mut self, objects: &[Object]) -> Option<usize> {
        let rank = |(index, object): (usize, &Object)| {
            let place = object.place(&self.settings.sensors)?;
            Some((self.is_inner(&place), object.seen().count(), self.away(&place), index))
        };
        let ranked = objects.iter().enumerate().filter_map(rank);
        let best = ranked
            .min_by(|one, other| (other.0, other.1).cmp(&(one.0, one.1)).then(one.2.total_cmp(&other.2)));
        best.map(|(.., index)| index)
    }

    fn away(&self, track: &Track) -> f64 {
        let [x, y] = track.position;
        let [near_x, near_y] = self.settings.near;
        libm::hypot(x - near_x, y - near_y)
    }

    fn is_in_region(&mut self, member: &Member) -> bool {
        self.settings.region.as_mut().is_none_or(|region| region.contains(member.track.position))
    }

    fn is_inner(&mut self, track: &Track) -> bool {
        self.settings.inner.as_mut().is_none_or(|inner| inner.contains(track.position))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(sensors: usize) -> Settings {
        Settings {
            sensors: vec![Sensor { error: [1.2, 0.6] }; sensors],
            misplaced: [3.0, 0.7],
            gate: 0.999,
            region: None,
            inner: None,
            near: [150.0, 0.0],
            count_over: Span::from_millis(400),
            pause: Span::from_millis(200),
        }
    }

    fn at(at_ms: i64) -> Time {
        Time(at_ms * 1_000_000)
    }

    fn track(at_ms: i64, x: f64, y: f64) -> Track {
        Track { at: at(at_ms), position: [x, y], velocity: [20.0, 0.0] }
    }

    /// The places of an object's tracks in what their sensors gave.
    fn places(object: &Object) -> Vec<Option<usize>> {
        object.members.iter().map(|member| member.map(|it| it.index)).collect()
    }

    #[test]
    fn tracks_are_predicted_and_associated_as_a_whole() {
        let mut associator = Associator::new(settings(2)).unwrap();
        // 0.1 s later both are 2 m further; the nearest partner of the second would be that of the first.
        let one = [track(0, 145.0, 2.0), track(0, 150.0, 2.0)];
        let other = [track(100, 150.0, 2.0), track(100, 155.0, 2.0)];
        let found = associator.associate(&[Some(&one), Some(&other)], at(100));
        assert_eq!(
            found.objects.iter().map(places).collect::<Vec<_>>(),
            [[Some(0), Some(0)], [Some(1), Some(1)]]
        );
        assert_eq!(found.objects[0].members[0].map(|it| it.track.position), Some([147.0, 2.0]));
        assert_eq!((found.chosen, found.counts), (Some(0), vec![Some(2.0), Some(2.0)]));
    }

    #[test]
    fn another_lane_is_no_partner_and_a_silent_sensor_counts_nothing() {
        let mut associator = Associator::new(settings(3)).unwrap();
        let (one, other) = ([track(0, 145.0, 2.0)], [track(0, 145.0, 5.5)]);
        let found = associator.associate(&[Some(&one), Some(&other), None], at(0));
        assert_eq!(
            found.objects.iter().map(places).collect::<Vec<_>>(),
            [[Some(0), None, None], [None, Some(0), None]]
        );
        assert_eq!(found.counts, [Some(1.0), Some(1.0), None]);
    }

    #[test]
    fn an_object_is_kept_until_it_is_lost_and_then_nothing_is_said_for_a_while() {
        let mut associator = Associator::new(settings(1)).unwrap();
        let mut chosen = |at_ms: i64, tracks: &[Track]| {
            let found = associator.associate(&[Some(tracks)], at(at_ms));
            found.chosen.map(|chosen| found.objects[chosen].members[0].unwrap().index)
        };
        assert_eq!(chosen(0, &[track(0, 150.0, 2.0)]), Some(0));
        // Another one is nearer now.
        assert_eq!(chosen(1_000, &[track(1_000, 150.0, 5.5), track(1_000, 170.0, 2.0)]), Some(1));
        assert_eq!(chosen(1_100, &[track(1_100, 152.0, 5.5)]), None);
        assert_eq!(chosen(1_200, &[track(1_200, 154.0, 5.5)]), None);
        assert_eq!(chosen(1_300, &[track(1_300, 156.0, 5.5)]), Some(0));
    }

    #[test]
    fn only_the_region_counts_and_numbers_that_are_none_are_left_out() {
        let region = Some(Region::new("x > 100").unwrap());
        let inner = Some(Region::new("x > 120").unwrap());
        let mut associator = Associator::new(Settings { region, inner, ..settings(1) }).unwrap();
        let tracks =
            [track(0, 90.0, 2.0), track(0, f64::NAN, 2.0), track(0, 110.0, 2.0), track(0, 130.0, 2.0)];
        let found = associator.associate(&[Some(&tracks)], at(0));
        assert_eq!(found.objects.iter().map(places).collect::<Vec<_>>(), [[Some(2)], [Some(3)]]);
        assert_eq!((found.chosen, found.counts), (Some(1), vec![Some(1.0)]));
    }

    #[test]
    fn settings_that_are_none_are_refused() {
        let wrong = |settings: Settings| Associator::new(settings).unwrap_err().to_string();
        let mut zero = settings(1);
        zero.sensors[0].error = [0.0, 1.0];
        assert_eq!(wrong(zero), "an error is 0, and must be above 0");
        assert_eq!(
            wrong(Settings { gate: 1.0, ..settings(1) }),
            "the probability of the gate is 1, and must be between 0 and 1"
        );
        assert_eq!(
            wrong(Settings { misplaced: [-1.0, 0.0], ..settings(1) }),
            "a misplacement is -1, and must be at least 0"
        );
    }
}
