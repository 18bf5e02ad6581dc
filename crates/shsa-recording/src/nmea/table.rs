//! The sentences of NMEA 0183: names and units of their fields, and the conversion of the cells between the commas.

use super::super::topic::{Field, Value};
use shsa_core::time::Span;
use shsa_message::number::float;
use shsa_message::stamp::decimal;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// A line for each sentence: `name:kind:unit`. Fields with `?` are missing in older versions, or where a device has no value.
///
/// | kind | cells | value |
/// |---|---|---|
/// | `n` | one | a number |
/// | `u` | two | a number, then the letter of its unit |
/// | `w` | two | a number, then `E` or `W` (negative) |
/// | `l` | two | a number, then `R` or `L` (negative) |
/// | `s` | two | a speed in the unit of the letter after it (`N`, `K`, `M`, `S`), converted to knots |
/// | `y` | two | a latitude or longitude in degrees: `ddmm.mmmm`, then `N`, `S` (negative), `E`, `W` (negative) |
/// | `t` | one | a time of the day, `hhmmss.ss`, converted to seconds |
/// | `a` | one | a letter or two |
/// | `x` | one | a text |
const TABLE: &str = "\
RMC time:t:s status:a latitude:y:deg longitude:y:deg speed:n:kn course:n:deg date:x magnetic_variation:w:deg mode:a? nav_status:a?
GGA time:t:s latitude:y:deg longitude:y:deg quality:n satellites:n hdop:n altitude:u:m geoid_separation:u:m dgps_age:n:s? dgps_station:x?
GNS time:t:s latitude:y:deg longitude:y:deg mode:x satellites:n hdop:n altitude:n:m geoid_separation:n:m dgps_age:n:s? dgps_station:x? nav_status:a?
GLL latitude:y:deg longitude:y:deg time:t:s? status:a? mode:a?
GST time:t:s rms:n semi_major:n:m semi_minor:n:m orientation:n:deg latitude_error:n:m longitude_error:n:m altitude_error:n:m
GBS time:t:s latitude_error:n:m longitude_error:n:m altitude_error:n:m satellite:n probability:n bias:n:m deviation:n:m system:x? signal:x?
GSA mode:a fix:n satellite_1:n satellite_2:n satellite_3:n satellite_4:n satellite_5:n satellite_6:n satellite_7:n satellite_8:n satellite_9:n satellite_10:n satellite_11:n satellite_12:n pdop:n hdop:n vdop:n system:x?
GSV sentences:n number:n in_view:n satellite_1:n? elevation_1:n:deg? azimuth_1:n:deg? snr_1:n? satellite_2:n? elevation_2:n:deg? azimuth_2:n:deg? snr_2:n? satellite_3:n? elevation_3:n:deg? azimuth_3:n:deg? snr_3:n? satellite_4:n? elevation_4:n:deg? azimuth_4:n:deg? snr_4:n? signal:x?
ZDA time:t:s day:n month:n year:n zone_hours:n? zone_minutes:n?
VTG course:u:deg course_magnetic:u:deg speed:u:kn speed_kmh:u:km/h mode:a?
HDG heading:n:deg deviation:w:deg magnetic_variation:w:deg
HDM heading:u:deg
HDT heading:u:deg
THS heading:n:deg mode:a
HSC heading:u:deg heading_magnetic:u:deg
VHW heading:u:deg heading_magnetic:u:deg speed:u:kn speed_kmh:u:km/h
VBW water_speed:n:kn water_speed_transverse:n:kn water_status:a ground_speed:n:kn ground_speed_transverse:n:kn ground_status:a stern_water_speed:n:kn? stern_water_status:a? stern_ground_speed:n:kn? stern_ground_status:a?
VLW distance_total:u:nmi distance:u:nmi ground_distance_total:u:nmi? ground_distance:u:nmi?
VDR set:u:deg set_magnetic:u:deg drift:u:kn
VPW speed:u:kn speed_ms:u:m/s
DBT depth_feet:u:ft depth:u:m depth_fathoms:u:fathom
DBK depth_feet:u:ft depth:u:m depth_fathoms:u:fathom
DBS depth_feet:u:ft depth:u:m depth_fathoms:u:fathom
DPT depth:n:m offset:n:m? range:n:m?
MWV angle:n:deg reference:a speed:s:kn status:a
MWD direction:u:deg direction_magnetic:u:deg speed:u:kn speed_ms:u:m/s
VWR angle:l:deg speed:u:kn speed_ms:u:m/s speed_kmh:u:km/h
VWT angle:l:deg speed:u:kn speed_ms:u:m/s speed_kmh:u:km/h
MTW temperature:u:degC
MTA temperature:u:degC
MDA pressure_inhg:u:inHg pressure:u:bar air_temperature:u:degC water_temperature:u:degC relative_humidity:n:% absolute_humidity:n:% dew_point:u:degC wind_direction:u:deg wind_direction_magnetic:u:deg wind_speed:u:kn wind_speed_ms:u:m/s
MHU relative_humidity:n:% absolute_humidity:n:% dew_point:u:degC
MMB pressure_inhg:u:inHg pressure:u:bar
ROT rate:n:deg/min status:a
RSA starboard:n:deg starboard_status:a port:n:deg? port_status:a?
RPM source:a number:n speed:n:1/min pitch:n:% status:a
XTE status:a cycle_lock:a error:l:nmi unit:a mode:a?
APB status:a cycle_lock:a error:l:nmi unit:a arrived:a perpendicular:a bearing_origin:u:deg waypoint:x bearing:u:deg heading_to_steer:u:deg mode:a?
RMB status:a error:l:nmi origin:x destination:x latitude:y:deg longitude:y:deg range:n:nmi bearing:n:deg closing_speed:n:kn arrived:a mode:a?
BWC time:t:s latitude:y:deg longitude:y:deg bearing:u:deg bearing_magnetic:u:deg distance:u:nmi waypoint:x mode:a?
BWR time:t:s latitude:y:deg longitude:y:deg bearing:u:deg bearing_magnetic:u:deg distance:u:nmi waypoint:x mode:a?
BOD bearing:u:deg bearing_magnetic:u:deg destination:x origin:x?
WPL latitude:y:deg longitude:y:deg waypoint:x
TXT sentences:n number:n id:n text:x
";

/// The most fields of a sentence without an entry.
const OTHER_FIELDS_MAX: usize = 64;

/// The conversion of cells to a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Number,
    WithUnit,
    EastWest,
    LeftRight,
    Speed,
    Angle,
    TimeOfDay,
    Letters,
    Text,
}

impl Kind {
    fn of(letter: &str) -> Kind {
        match letter {
            "u" => Kind::WithUnit,
            "w" => Kind::EastWest,
            "l" => Kind::LeftRight,
            "s" => Kind::Speed,
            "y" => Kind::Angle,
            "t" => Kind::TimeOfDay,
            "a" => Kind::Letters,
            "x" => Kind::Text,
            _ => Kind::Number,
        }
    }

    fn cells(self) -> usize {
        match self {
            Kind::Number | Kind::TimeOfDay | Kind::Letters | Kind::Text => 1,
            Kind::WithUnit | Kind::EastWest | Kind::LeftRight | Kind::Speed | Kind::Angle => 2,
        }
    }
}

/// The entry of a sentence.
pub(super) struct Known {
    fields: Vec<(Field, Kind)>,
    /// The number of cells that even old versions have.
    cells_min: usize,
}

static KNOWN: LazyLock<BTreeMap<&'static str, Known>> =
    LazyLock::new(|| TABLE.lines().filter_map(known).collect());

fn known(line: &'static str) -> Option<(&'static str, Known)> {
    let (name, fields) = line.split_once(' ')?;
    let mut cells_min = 0;
    let field = |text: &str| {
        let (text, is_optional) = text.strip_suffix('?').map_or((text, false), |text| (text, true));
        let mut parts = text.splitn(3, ':');
        let (name, kind) = (parts.next().unwrap_or_default(), Kind::of(parts.next().unwrap_or_default()));
        cells_min += if is_optional { 0 } else { kind.cells() };
        (Field { name: name.to_owned(), unit: parts.next().map(str::to_owned) }, kind)
    };
    let fields = fields.split(' ').map(field).collect();
    Some((name, Known { fields, cells_min }))
}

/// The entry of a sentence by its three letters; `None` for an unknown one.
pub(super) fn entry(name: &str) -> Option<&'static Known> {
    KNOWN.get(name)
}

impl Known {
    pub(super) fn fields(&self) -> impl Iterator<Item = Field> {
        self.fields.iter().map(|(field, _)| field.clone())
    }

    /// Converts these cells to the values of the fields. A sentence may have lost commas: the checksum misses an even number of
    /// them. That shows when the sentence has too few cells, or when a letter is in the place of another. Then the first wrong
    /// value and all after it are left out. Returns the number of the fields that are left in that case.
    pub(super) fn values<'a>(&self, cells: &[&'a str], values: &mut Vec<Value<'a>>) -> Option<usize> {
        let is_short = cells.len() < self.cells_min;
        let mut cells = cells;
        for (at, (_, kind)) in self.fields.iter().enumerate() {
            let (own, rest) = cells.split_at_checked(kind.cells()).unwrap_or((cells, &[]));
            match value(*kind, own) {
                Err(Mismatch::Letter) => return Some(at),
                Err(Mismatch::Value) if is_short => return Some(at),
                found => values.push(found.unwrap_or(Value::Missing)),
            }
            cells = rest;
        }
        None
    }
}

/// Names for the fields of a sentence without an entry.
pub(super) fn other_fields(cells: usize) -> Vec<Field> {
    (1..=cells.min(OTHER_FIELDS_MAX)).map(|at| Field::new(format!("field_{at}"))).collect()
}

/// Why a cell does not fit its field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mismatch {
    /// The cell has no value of this kind.
    Value,
    /// The cell has another letter, or a number, in the place of a letter: the cells are shifted.
    Letter,
}

/// The value of these cells; missing where the cells are missing or empty.
fn value<'a>(kind: Kind, cells: &[&'a str]) -> Result<Value<'a>, Mismatch> {
    let Some(first) = cells.first().copied().filter(|first| !first.is_empty()) else {
        return Ok(Value::Missing);
    };
    let second = cells.get(1).copied().unwrap_or_default();
    let sign = |positive: &[&str], negative: &[&str]| match second {
        letter if positive.contains(&letter) => Ok(1.0),
        letter if negative.contains(&letter) => Ok(-1.0),
        _ => Err(Mismatch::Letter),
    };
    let number = || plain(first).ok_or(Mismatch::Value);
    let number = match kind {
        Kind::Number => number()?,
        Kind::WithUnit if plain(second).is_some() => return Err(Mismatch::Letter),
        Kind::WithUnit => number()?,
        Kind::EastWest => sign(&["E", ""], &["W"])? * number()?,
        Kind::LeftRight => sign(&["R", ""], &["L"])? * number()?,
        Kind::Speed => in_knots(second).ok_or(Mismatch::Letter)? * number()?,
        Kind::Angle => sign(&["N", "E"], &["S", "W"])? * degrees(first).ok_or(Mismatch::Value)?,
        Kind::TimeOfDay => time_of_day(first).ok_or(Mismatch::Value)?.seconds(),
        Kind::Letters if first.len() > 2 || plain(first).is_some() => return Err(Mismatch::Letter),
        Kind::Letters | Kind::Text => return Ok(Value::Text(first)),
    };
    Ok(Value::Number(number))
}

fn plain(text: &str) -> Option<f64> {
    let is_plain = text.bytes().all(|byte| byte.is_ascii_digit() || matches!(byte, b'.' | b'-' | b'+'));
    if is_plain { float(text) } else { None }
}

/// The factor from a unit of speed to knots, by the letter of the unit: knots, km/h, m/s, miles per hour.
fn in_knots(letter: &str) -> Option<f64> {
    match letter {
        "N" | "" => Some(1.0),
        "K" => Some(1.0 / 1.852),
        "M" => Some(3.6 / 1.852),
        "S" => Some(1.609_344 / 1.852),
        _ => None,
    }
}

/// `dddmm.mmmm`: the minutes begin two digits before the point.
fn degrees(text: &str) -> Option<f64> {
    let number = plain(text)?;
    let degrees = (number / 100.0).trunc();
    let minutes = number - degrees * 100.0;
    (number >= 0.0 && minutes < 60.0 && degrees <= 180.0).then_some(degrees + minutes / 60.0)
}

/// `hhmmss.ss`, since the start of the day.
pub(super) fn time_of_day(text: &str) -> Option<Span> {
    let (clock, fraction) = text.split_at(text.bytes().position(|byte| byte == b'.').unwrap_or(text.len()));
    let digits = clock.len() == 6 && clock.bytes().all(|byte| byte.is_ascii_digit());
    let part =
        |from: usize| clock.get(from..from + 2).and_then(|part| part.parse::<i64>().ok()).filter(|_| digits);
    let (hour, minute, second) = (part(0)?, part(2)?, part(4)?);
    let is_clock = hour < 24 && minute < 60 && second < 61;
    let whole = is_clock.then_some(((hour * 60 + minute) * 60 + second) * 1_000_000_000)?;
    // A point without digits behind it is none.
    let fraction = if fraction.len() < 2 { 0 } else { decimal(fraction, Span::from_millis(1_000))?.0 };
    Some(Span(whole + fraction))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(name: &str, content: &str, expected: &str) {
        let cells: Vec<&str> = content.split(',').collect();
        let known = entry(name).unwrap();
        let mut values = Vec::new();
        let cut = known.values(&cells, &mut values);
        let shown = known.fields().zip(&values).filter_map(|(field, value)| match value {
            Value::Missing => None,
            Value::Text(text) => Some(format!("{}={text}", field.name)),
            Value::Number(number) => Some(format!("{}={number:.4}", field.name)),
            _ => None,
        });
        let cut = cut.map_or(String::new(), |at| format!(" cut at {at}"));
        assert_eq!(shown.collect::<Vec<_>>().join(" ") + &cut, expected);
    }

    #[test]
    fn cells_become_values() {
        check(
            "RMC",
            "190315.500,A,3503.8851,N,07658.0729,W,0.27,27.56,120816,1.5,W,A",
            "time=68595.5000 status=A latitude=35.0648 longitude=-76.9679 speed=0.2700 course=27.5600 date=120816 \
             magnetic_variation=-1.5000 mode=A",
        );
        check("MWV", "293.0,R,10.0,M,A", "angle=293.0000 reference=R speed=19.4384 status=A");
        check(
            "VWR",
            "045.0,L,12.6,N,6.5,M,23.3,K",
            "angle=-45.0000 speed=12.6000 speed_ms=6.5000 speed_kmh=23.3000",
        );
        check("DBT", "8.46,f,2.58,M,1.41,F", "depth_feet=8.4600 depth=2.5800 depth_fathoms=1.4100");
        check("DPT", "2.58,", "depth=2.5800");
        check("VTG", "286.35,T,,M,0.00,N,0.00,K,A", "course=286.3500 speed=0.0000 speed_kmh=0.0000 mode=A");
    }

    #[test]
    fn a_sentence_that_has_lost_commas_is_believed_up_to_there() {
        let before = "time=68595.0000 status=A latitude=35.0648 longitude=-76.9679 speed=3.7500 course=175.4500 date=120816";
        check("RMC", "190315,A,3503.8851,N,07658.0729,W,3.75,175.45,120816,A", &format!("{before} cut at 7"));
        check(
            "RMC",
            "190315,A,3503.8851N,07658.0729,W,3.75,175.45,120816,,,A",
            "time=68595.0000 status=A cut at 2",
        );
        // All cells are there: an invalid value affects only its own field.
        check("DBT", "8.46,f,x,M,1.41,F", "depth_feet=8.4600 depth_fathoms=1.4100");
    }

    #[test]
    fn times_of_the_day_are_told_by_six_digits() {
        let second = 1_000_000_000;
        assert_eq!(time_of_day("235960.25"), Some(Span(86_400 * second + second / 4)));
        assert_eq!([time_of_day("1234"), time_of_day("246060"), time_of_day("12345x")], [None; 3]);
    }
}
