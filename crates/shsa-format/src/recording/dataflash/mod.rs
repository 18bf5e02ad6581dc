//! DataFlash, the logs of ArduPilot: messages of fixed fields (`.bin`), or the same as lines of text (`.log`).
//!
//! Format: <https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html>. Times are those since boot, tied to the
//! epoch by the first message of GPS that has its week. Units are those of `FMTU`; of a device that is there several times
//! (`IMU[1]`), its field of the instance tells which it is.

mod clock;
mod format;
pub(super) mod binary;
pub(super) mod text;

/// Fields of the time since boot, and how many nanoseconds a step is. Old logs count milliseconds; in their messages of GPS
/// `TimeMS` is the time of the week, and `T` the other.
const TIMES: [(&str, i64); 2] = [("TimeUS", 1_000), ("TimeMS", 1_000_000)];

/// The messages that tie the time since boot to the epoch.
const GPS: [&str; 2] = ["GPS", "GPS2"];

/// The time since boot, the week, and the milliseconds in it: by names of fields, new and old.
const GPS_FIELDS: [(&str, i64, &str, &str); 2] =
    [("TimeUS", 1_000, "GWk", "GMS"), ("T", 1_000_000, "Week", "TimeMS")];

/// What is said of times.
fn said_of_times(is_tied: bool) -> String {
    let said = match is_tied {
        true => "times since boot are tied to the epoch by the first message of GPS that has its week",
        false => "times count from the boot: no message of GPS has its week",
    };
    said.to_owned()
}

#[cfg(test)]
mod tests;
