//! Two trucks of a platoon, each with an instance of its own: their models, what their sensors measure, and what happens to them.
//!
//! The first truck publishes its speed with the level that it guarantees. The second truck keeps its distance by this speed, or
//! by its own radar. The caller runs the two instances, and carries their messages.

/// The model of the truck in front.
pub const LEADER: &str = include_str!("../models/leader.yaml");
/// The model of the truck behind.
pub const FOLLOWER: &str = include_str!("../models/follower.yaml");

/// A truck.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Truck {
    /// In front.
    Leader,
    /// Behind.
    Follower,
}

impl Truck {
    /// Its name, also that of its model.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Truck::Leader => "leader",
            Truck::Follower => "follower",
        }
    }

    /// Its model as text.
    #[must_use]
    pub const fn model(self) -> &'static str {
        match self {
            Truck::Leader => LEADER,
            Truck::Follower => FOLLOWER,
        }
    }

    /// The variable that it needs.
    #[must_use]
    pub const fn need(self) -> &'static str {
        match self {
            Truck::Leader => "speed",
            Truck::Follower => "ahead",
        }
    }
}

/// What happens to the trucks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Happening {
    /// The leader's radar, its speed over ground, falls silent.
    RadarFails,
    /// The radio link between the trucks is cut.
    LinkIsCut,
    /// The radio link is there again.
    LinkIsBack,
    /// The radar works again.
    RadarWorks,
}

impl Happening {
    /// What it is in words.
    #[must_use]
    pub const fn describe(self) -> &'static str {
        match self {
            Happening::RadarFails => "the leader's radar falls silent",
            Happening::LinkIsCut => "the radio link is cut",
            Happening::LinkIsBack => "the radio link is back",
            Happening::RadarWorks => "the leader's radar works again",
        }
    }
}

/// What happens, and when, in seconds from the begin.
pub const SCENARIO: [(f64, Happening); 4] = [
    (4.0, Happening::RadarFails),
    (8.0, Happening::LinkIsCut),
    (13.0, Happening::LinkIsBack),
    (18.0, Happening::RadarWorks),
];

/// When the scenario ends, in seconds.
pub const END_S: f64 = 26.0;

/// The speed of both trucks, in m/s.
#[must_use]
pub fn speed(at_s: f64) -> f64 {
    22.0 + 2.0 * (0.3 * at_s).sin()
}

/// A value that a sensor on board measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// The topic.
    pub topic: &'static str,
    /// The field of the message.
    pub field: &'static str,
    /// The value, in m/s.
    pub value: f64,
}

/// What the sensors of a truck measure at a time; the leader's radar only while it works.
///
/// # Example
/// ```
/// use shsa_demos::platoon::{Truck, readings, speed};
///
/// let [radar, wheels] = readings(Truck::Leader, 1.0, true)[..] else { panic!("two sensors") };
/// assert_eq!((radar.topic, wheels.topic), ("leader/radar", "leader/wheels"));
/// assert!((radar.value - speed(1.0)).abs() < 0.3);
/// ```
#[must_use]
pub fn readings(truck: Truck, at_s: f64, radar_works: bool) -> Vec<Reading> {
    let reading = |topic, field, value| Reading { topic, field, value };
    let speed = speed(at_s);
    match truck {
        Truck::Leader => {
            let radar = radar_works.then(|| reading("leader/radar", "speed", speed + 0.1));
            radar.into_iter().chain([reading("leader/wheels", "speed", speed - 0.1)]).collect()
        }
        Truck::Follower => {
            vec![reading("follower/speed", "speed", speed), reading("follower/radar", "closing", 0.05)]
        }
    }
}
