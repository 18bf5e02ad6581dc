//! The time of a place: how far its clock is ahead of UTC, always or by the rules of the place.

use jiff::Timestamp;
use jiff::tz::{AmbiguousOffset, Offset, TimeZone};
use shsa_core::time::{Span, Time};

const SECOND: i64 = 1_000_000_000;

/// Where times were written down that do not say it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Zone {
    rule: Rule,
    /// Whether the zone was given; otherwise it is UTC.
    pub is_given: bool,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Rule {
    /// Always so far ahead of UTC; behind it when negative.
    Ahead(Span),
    /// By the rules of a place in the time zone database of IANA.
    Place(TimeZone),
}

/// Why the time of a clock alone does not say the moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doubt {
    /// The clock was put back and showed it a second time, at this moment.
    Twice(Time),
    /// The clock was put forward past it.
    Never,
}

impl Default for Rule {
    fn default() -> Rule {
        Rule::Ahead(Span::ZERO)
    }
}

impl Zone {
    /// When the clock of the place showed a time, which is given as if it were one of UTC. Of two moments the first; of none the
    /// one at which it would have been shown, had the clock not been put forward.
    #[must_use]
    pub fn utc(&self, shown: Time) -> (Time, Option<Doubt>) {
        let place = match &self.rule {
            Rule::Ahead(ahead) => return (shown - *ahead, None),
            Rule::Place(place) => place,
        };
        let Ok(as_utc) = Timestamp::from_nanosecond(shown.0.into()) else { return (shown, None) };
        let at = |offset: Offset| shown - Span(i64::from(offset.seconds()).saturating_mul(SECOND));
        match place.to_ambiguous_timestamp(TimeZone::UTC.to_datetime(as_utc)).offset() {
            AmbiguousOffset::Unambiguous { offset } => (at(offset), None),
            AmbiguousOffset::Fold { before, after } => (at(before), Some(Doubt::Twice(at(after)))),
            AmbiguousOffset::Gap { before, .. } => (at(before), Some(Doubt::Never)),
        }
    }
}

impl std::str::FromStr for Zone {
    type Err = String;

    /// `UTC`, `Z`, `+02:00`, `-0330`, `Europe/Vienna`.
    fn from_str(text: &str) -> Result<Zone, String> {
        let text = text.trim();
        let ahead = match text {
            "UTC" | "utc" | "GMT" => Some(0),
            _ if text.starts_with(['+', '-', 'Z', 'z']) => crate::stamp::zone_alone(text),
            _ => None,
        };
        if let Some(ahead) = ahead {
            return Ok(Zone { rule: Rule::Ahead(Span(ahead * SECOND)), is_given: true });
        }
        let place = jiff::tz::db().get(text);
        let place = place.map_err(|_| {
            format!("'{text}' is no time zone; write UTC, +02:00, or a place of the IANA database, such as Europe/Vienna")
        })?;
        Ok(Zone { rule: Rule::Place(place), is_given: true })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::moment::{DateOrder, moment};

    /// When a clock showed a time, as RFC 3339 writes it in UTC, and what is in doubt.
    #[track_caller]
    fn check(zone: &str, shown: &str, expected: &str, doubt: Option<Option<&str>>) {
        let utc = |text: &str| moment(text, DateOrder::YearMonthDay, &Zone::default()).unwrap().time;
        let zone: Zone = zone.parse().unwrap();
        let found = moment(shown, DateOrder::YearMonthDay, &zone).unwrap();
        assert_eq!(found.time, utc(expected), "{shown}");
        let doubt = doubt.map(|second| second.map_or(Doubt::Never, |second| Doubt::Twice(utc(second))));
        assert_eq!(found.doubt, doubt, "{shown}");
    }

    #[test]
    fn places_have_summer_time() {
        check("+02:00", "2018-01-08 10:31:37", "2018-01-08 08:31:37", None);
        check("Europe/Vienna", "2018-01-08 10:31:37.5", "2018-01-08 09:31:37.5", None);
        check("Europe/Vienna", "2018-07-08 10:31:37", "2018-07-08 08:31:37", None);
        // A zone that is written counts before that of the place.
        check("Europe/Vienna", "2018-07-08T10:31:37-05:00", "2018-07-08 15:31:37", None);
        check("America/New_York", "2040-07-08 10:31:37", "2040-07-08 14:31:37", None);
    }

    #[test]
    fn what_a_clock_shows_twice_or_never_is_in_doubt() {
        check(
            "Europe/Vienna",
            "2018-10-28 02:30:00",
            "2018-10-28 00:30:00",
            Some(Some("2018-10-28 01:30:00")),
        );
        check("Europe/Vienna", "2018-10-28 03:00:00", "2018-10-28 02:00:00", None);
        check("Europe/Vienna", "2018-03-25 02:30:00", "2018-03-25 01:30:00", Some(None));
    }

    #[test]
    fn what_is_no_zone_says_what_is() {
        let stated = "Europe/Vienn".parse::<Zone>().unwrap_err();
        assert_eq!(
            stated,
            "'Europe/Vienn' is no time zone; write UTC, +02:00, or a place of the IANA database, such as Europe/Vienna"
        );
        assert!("+99".parse::<Zone>().is_err() && "".parse::<Zone>().is_err());
        assert!("europe/vienna".parse::<Zone>().is_ok());
    }
}
