//! A robot that drives about a room and stops before obstacles. It needs the distance of the nearest one, `dmin`; its lidar
//! falls silent, and later lies.
//!
//! The data flow: `room -> sensors -> faults -> bus -> provider -> bus -> avoidance -> robot -> room`. One thread runs all of it.

mod room;
mod robot;
mod sensors;
mod faults;
mod avoidance;
mod provider;
mod healed;
mod machine;
mod score;
mod trial;

pub use avoidance::{Avoidance, Mode, stop_distance};
pub use faults::{Fault, FaultKind};
pub use healed::{MODEL, Settings};
pub use machine::{STEP, start};
pub use provider::{NEED, lower_bound};
pub use robot::{Command, Robot};
pub use room::{Point, Pose, Room};
pub use score::Score;
pub use sensors::{
    Beams, DEPTH, LIDAR, ODOMETRY, SONAR, Sample, Sensor, all, level, nearest_seen, true_dmin,
};
pub use trial::{Happening, Trial, View};

use crate::DemoError;
use machine::Machine;
use shsa_bridge::memory::MemoryBus;
use shsa_core::time::Time;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Runs the robot on a bus in real time, in a thread of its own, until `stop` is set. The topics are [`LIDAR`], [`SONAR`],
/// [`DEPTH`] and [`ODOMETRY`]; the robot drives by the values under the name [`NEED`], and stands still without them. Its
/// faults are those of [`Fault::schedule`], again every minute.
///
/// # Errors
/// When no thread can be started.
///
/// # Example
/// ```
/// use shsa_bridge::{Bridge, Clock, memory::MemoryBus};
/// use shsa_demo::rover::{SONAR, nearest_seen, simulate};
/// use std::sync::{Arc, atomic::{AtomicBool, Ordering}};
///
/// let bus = MemoryBus::new(Clock::running());
/// let mut ears = bus.join(16);
/// ears.subscribe(SONAR, None)?;
/// let stop = Arc::new(AtomicBool::new(false));
/// simulate(&bus, &stop)?;
/// let message = loop {
///     match ears.receive() {
///         Some(message) => break message,
///         None => std::thread::yield_now(),
///     }
/// };
/// let dmin_m = message.value().and_then(|value| nearest_seen(SONAR, value));
/// assert!(dmin_m.is_some_and(|dmin_m| dmin_m > 0.0));
/// stop.store(true, Ordering::Release);
/// # Ok::<(), shsa_demo::DemoError>(())
/// ```
pub fn simulate(bus: &MemoryBus, stop: &Arc<AtomicBool>) -> Result<(), DemoError> {
    let (bus, stop) = (bus.clone(), stop.clone());
    let mut machine = Machine::new(1, &bus)?;
    std::thread::Builder::new().name("simulator".into()).spawn(move || {
        let began = Instant::now();
        let mut now = Time(0);
        while !stop.load(Ordering::Acquire) {
            now = now + STEP;
            if machine.sense(now).is_err() {
                return;
            }
            machine.drive(now);
            let simulated = Duration::from_nanos(now.0.unsigned_abs());
            std::thread::sleep(simulated.saturating_sub(began.elapsed()));
        }
    })?;
    Ok(())
}
