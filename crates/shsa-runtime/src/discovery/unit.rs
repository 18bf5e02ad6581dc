//! Units as Home Assistant writes them, and the device classes that they belong to.
//!
//! After the tables `DEVICE_CLASS_UNITS` and `DEVICE_CLASS_STATE_CLASSES` of Home Assistant
//! (<https://github.com/home-assistant/core/blob/dev/homeassistant/components/sensor/const.py>).

use shsa_core::unit::Unit;

/// When a unit of a model is one of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Means {
    /// It has the same size and dimension.
    Same,
    /// It is also written the same: `J` is not the unit of a torque, nor `W` that of apparent power, nor `Hz` that of a rate.
    Written,
}

/// The spellings of units, by device class. A class is left out where others have the same units (`%`, `K`, volumes), or where it does
/// not permit measurements (energy).
const CLASSES: [(Option<&str>, Means, &[&str]); 20] = [
    (Some("temperature"), Means::Same, &["°C", "°F"]),
    (Some("voltage"), Means::Same, &["V", "mV", "µV", "kV", "MV"]),
    (Some("current"), Means::Same, &["A", "mA"]),
    (Some("power"), Means::Written, &["W", "kW", "MW", "GW", "TW"]),
    (Some("apparent_power"), Means::Written, &["VA"]),
    (Some("frequency"), Means::Written, &["Hz", "kHz", "MHz", "GHz"]),
    (Some("illuminance"), Means::Written, &["lx"]),
    (Some("irradiance"), Means::Same, &["W/m²"]),
    (Some("speed"), Means::Same, &["m/s", "km/h", "kn", "mph", "ft/s", "mm/s", "mm/h", "mm/d"]),
    (Some("pressure"), Means::Same, &["Pa", "hPa", "kPa", "bar", "cbar", "mbar", "mmHg", "psi"]),
    (Some("distance"), Means::Same, &["m", "km", "cm", "mm", "mi", "yd", "ft", "nmi"]),
    (Some("area"), Means::Same, &["m²", "km²", "cm²", "mm²"]),
    (Some("weight"), Means::Same, &["kg", "g", "mg", "µg", "lb"]),
    (Some("duration"), Means::Same, &["s", "ms", "min", "h", "d"]),
    (Some("conductivity"), Means::Same, &["S/cm", "mS/cm", "µS/cm"]),
    (Some("volume_flow_rate"), Means::Same, &["m³/h", "m³/s", "L/h", "L/min", "L/s", "mL/s", "ft³/min"]),
    (Some("data_rate"), Means::Same, &["bit/s", "kbit/s", "Mbit/s", "B/s", "kB/s", "MB/s", "GB/s"]),
    (Some("data_size"), Means::Same, &["bit", "kbit", "Mbit", "B", "kB", "MB", "GB", "KiB", "MiB", "GiB"]),
    (None, Means::Same, &["m³", "L", "mL", "ft³", "°", "%"]),
    (None, Means::Written, &["K", "J", "kJ", "Wh", "kWh", "MWh"]),
];

/// A unit in Home Assistant's spelling, and its device class, if the unit tells it.
pub(super) fn written(unit: &Unit) -> (String, Option<&'static str>) {
    let own = spelled(&unit.to_string());
    let all =
        || CLASSES.iter().flat_map(|(class, means, texts)| texts.iter().map(|text| (*class, *means, *text)));
    let as_written = all().find(|(.., text)| *text == own);
    let found = as_written.or_else(|| {
        all()
            .filter(|(_, means, _)| *means == Means::Same)
            .find(|(.., text)| Unit::parse(text).as_ref() == Ok(unit))
    });
    found.map_or((own, None), |(class, _, text)| (text.to_owned(), class))
}

/// The text of a model's unit with the signs of print: `m/s²`, `kg·m²`.
fn spelled(text: &str) -> String {
    text.replace("^2", "²").replace("^3", "³").replace('*', "·")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, expected: &str, class: Option<&str>) {
        assert_eq!(written(&Unit::parse(text).unwrap()), (expected.to_owned(), class), "{text}");
    }

    #[test]
    fn a_unit_has_the_spelling_of_home_assistant() {
        check("degC", "°C", Some("temperature"));
        check("celsius", "°C", Some("temperature"));
        check("kmh", "km/h", Some("speed"));
        check("m s^-1", "m/s", Some("speed"));
        check("m^3/h", "m³/h", Some("volume_flow_rate"));
        check("l/s", "L/s", Some("volume_flow_rate"));
        check("uV", "µV", Some("voltage"));
        check("N/m^2", "Pa", Some("pressure"));
        check("W/m^2", "W/m²", Some("irradiance"));
        check("deg", "°", None);
        check("%", "%", None);
        check("m/s^2", "m/s²", None);
        check("kg*m^2", "kg·m²", None);
    }

    #[test]
    fn a_class_is_left_out_where_the_unit_alone_does_not_tell_it() {
        check("kWh", "kWh", None);
        check("K", "K", None);
        check("l", "L", None);
        // Of the size of a joule, a watt, a hertz and a lux.
        check("Nm", "Nm", None);
        check("N m/s", "N m/s", None);
        check("VA", "VA", Some("apparent_power"));
        check("1/s", "1/s", None);
        check("cd/m^2", "cd/m²", None);
    }

    /// A row that no model can have would never be found.
    #[test]
    fn every_spelling_is_a_unit_and_found_in_its_row() {
        for (class, _, texts) in CLASSES {
            for text in texts {
                check(text, text, class);
            }
        }
    }
}
