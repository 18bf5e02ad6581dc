//! Simulated systems that break and heal, for measurements and tests, beside the robot of `shsa-demo`.
//!
//! [`pack`] is a battery of 96 cells in a car, [`radars`] are over the traffic of a road: a trial of each is measured against the
//! truth. [`platoon`] is two trucks for two instances, [`rover`] the robot as separate programs.

pub mod pack;
pub mod radars;
pub mod platoon;
pub mod rover;
