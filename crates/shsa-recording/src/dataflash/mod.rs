//! DataFlash, the logs of ArduPilot: messages of fixed fields (`.bin`), or the same as lines of text (`.log`).
//!
//! Format: <https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html>. Times count from the boot; the first GPS
//! message with a week relates them to the epoch. Units come from `FMTU`. Where a device exists several times (`IMU[1]`), its
//! instance field has its number.

mod clock;
mod format;
pub(super) mod binary;
pub(super) mod text;
pub(super) mod dump;

/// Fields with the time since boot, and the nanoseconds of one step. Old logs count milliseconds; in their GPS messages `TimeMS`
/// is the time of the week, and `T` the time since boot.
const TIMES: [(&str, i64); 2] = [("TimeUS", 1_000), ("TimeMS", 1_000_000)];

/// The messages that relate the time since boot to the epoch.
const GPS: [&str; 2] = ["GPS", "GPS2"];

/// The fields with the time since boot, the week, and the milliseconds in the week: new and old names.
const GPS_FIELDS: [(&str, i64, &str, &str); 2] =
    [("TimeUS", 1_000, "GWk", "GMS"), ("T", 1_000_000, "Week", "TimeMS")];

/// The note about times.
fn said_of_times(is_tied: bool) -> String {
    let said = match is_tied {
        true => "times since boot are tied to the epoch by the first message of GPS that has its week",
        false => "times count from the boot: no message of GPS has its week",
    };
    said.to_owned()
}

#[cfg(test)]
mod tests;
