//! The faults and their times.

use super::sensors::{LIDAR, Sample};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};

/// The kind of a signal's fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultKind {
    /// Nothing comes.
    Silent,
    /// Messages arrive on time and in the right form, but every distance is this one, metres.
    Spoofed(f64),
}

/// A fault of a signal for some time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// The topic of the signal.
    pub topic: &'static str,
    /// What is wrong.
    pub kind: FaultKind,
    /// The beginning, within each minute.
    pub from: Time,
    /// The end, which is no longer faulty.
    pub to: Time,
}

/// The period after which all faults are repeated.
const CYCLE: Span = Span::from_millis(60_000);

impl Fault {
    /// The faults of the demonstration: the lidar breaks down and recovers; later it is spoofed until the minute ends.
    #[must_use]
    pub fn schedule() -> Vec<Fault> {
        let lidar = |kind, from: f64, to: f64| Fault {
            topic: LIDAR,
            kind,
            from: Time::from_seconds(from),
            to: Time::from_seconds(to),
        };
        vec![lidar(FaultKind::Silent, 12.0, 24.0), lidar(FaultKind::Spoofed(3.0), 36.0, 60.0)]
    }

    pub(super) fn is_active(&self, now: Time) -> bool {
        (self.from..self.to).contains(&Time(now.0 % CYCLE.0))
    }

    /// The fault in the notation of the command line: `drop:/lidar/scan@12s..24s`.
    #[must_use]
    pub fn name(&self) -> String {
        let kind = match self.kind {
            FaultKind::Silent => "drop".to_string(),
            FaultKind::Spoofed(distance) => format!("spoof={distance}"),
        };
        let seconds = |time: Time| time.0 as f64 / 1e9;
        format!("{kind}:{}@{}s..{}s", self.topic, seconds(self.from), seconds(self.to))
    }

    /// A description of the effect, as a sentence.
    #[must_use]
    pub fn describe(&self) -> String {
        match self.kind {
            FaultKind::Silent => format!("{} breaks down: it says nothing any more", self.topic),
            FaultKind::Spoofed(distance) => {
                format!("{} is spoofed: every beam says {distance} m, on time and in shape", self.topic)
            }
        }
    }

    /// A sample with the fault in it; `None` when it is lost.
    pub(super) fn apply(&self, mut sample: Sample) -> Option<Sample> {
        if sample.topic != self.topic || !self.is_active(sample.stamp) {
            return Some(sample);
        }
        match (self.kind, &mut sample.value) {
            (FaultKind::Silent, _) => return None,
            (FaultKind::Spoofed(distance), RawValue::Vector(values)) => values.fill(distance),
            (FaultKind::Spoofed(distance), value) => *value = RawValue::Number(distance),
        }
        Some(sample)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faulty(seconds: f64) -> Option<RawValue> {
        let stamp = Time::from_seconds(seconds);
        let sample = Sample { topic: LIDAR, stamp, arrival: stamp, value: RawValue::Vector(vec![1.0, 2.0]) };
        Fault::schedule()
            .iter()
            .try_fold(sample, |sample, fault| fault.apply(sample))
            .map(|sample| sample.value)
    }

    #[test]
    fn the_lidar_is_silent_recovers_and_lies() {
        let healthy = Some(RawValue::Vector(vec![1.0, 2.0]));
        assert_eq!(faulty(11.9), healthy);
        assert_eq!(faulty(12.0), None);
        assert_eq!(faulty(24.0), healthy);
        assert_eq!(faulty(36.0), Some(RawValue::Vector(vec![3.0, 3.0])));
    }

    #[test]
    fn names_are_in_the_syntax_of_the_command_line() {
        let names: Vec<String> = Fault::schedule().iter().map(Fault::name).collect();
        assert_eq!(names, ["drop:/lidar/scan@12s..24s", "spoof=3:/lidar/scan@36s..60s"]);
    }
}
