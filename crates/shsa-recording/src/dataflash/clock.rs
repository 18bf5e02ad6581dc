//! From the boot of a flight controller to the epoch: the week and the milliseconds of GPS, and its leap seconds.

use shsa_core::time::{Span, Time};

const SECOND_MS: i64 = 1_000;

/// The start of GPS time, 1980-01-06, in seconds of the epoch.
const GPS_BEGIN_S: i64 = 315_964_800;

/// A week, in milliseconds.
const WEEK_MS: i64 = 7 * 86_400 * SECOND_MS;

/// When GPS time went one second further ahead of UTC, in seconds of GPS time: the leap seconds since July 1981.
///
/// Source: IERS Bulletin C; no leap second followed that of 2017-01-01 up to the end of 2026.
const LEAPS_S: [i64; 18] = [
    46_828_800,
    78_364_801,
    109_900_802,
    173_059_203,
    252_028_804,
    315_187_205,
    346_723_206,
    393_984_007,
    425_520_008,
    457_056_009,
    504_489_610,
    551_750_411,
    599_184_012,
    820_108_813,
    914_803_214,
    1_025_136_015,
    1_119_744_016,
    1_167_264_017,
];

/// The moment of a GPS week and the milliseconds in it; `None` for one that no receiver gives.
pub(super) fn moment(week: i64, week_ms: i64) -> Option<Time> {
    let is_time = (1..10_000).contains(&week) && (0..WEEK_MS).contains(&week_ms);
    let since_begin_ms = is_time.then_some(week * WEEK_MS + week_ms)?;
    let leaps = LEAPS_S.iter().filter(|leap| **leap * SECOND_MS <= since_begin_ms).count() as i64;
    Some(Time((GPS_BEGIN_S * SECOND_MS + since_begin_ms - leaps * SECOND_MS) * 1_000_000))
}

/// How far the epoch is from the boot, by a GPS message that has both times.
pub(super) fn epoch(since_boot: Time, week: i64, week_ms: i64) -> Option<Span> {
    Some(moment(week, week_ms)? - since_boot)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(week: i64, week_ms: i64, expected_s: i64) {
        assert_eq!(moment(week, week_ms), Some(Time(expected_s * 1_000_000_000)));
    }

    #[test]
    fn weeks_of_gps_are_moments() {
        // 2017-09-10 10:49:22.8, 18 s behind.
        assert_eq!(moment(1966, 38_980_800), Some(Time(1_505_040_562_800_000_000)));
        // 2016-12-31 23:59:59 was before the leap, 2017-01-01 00:00:00 after it.
        check(1930, 17_000 - 1_000, 1_483_228_800 - 1);
        check(1930, 18_000, 1_483_228_800);
        // 2013-06-16 00:00:00, 16 s behind.
        check(1745, 16_000, 1_371_340_800);
        assert_eq!([moment(0, 5), moment(1966, -1), moment(1966, WEEK_MS)], [None; 3]);
    }
}
