//! Names, units and numbers of drafted models.

use std::collections::BTreeSet;

/// Units by parts of a name.
const UNITS: [(&[&str], &str); 14] = [
    (&["temperature", "temp"], "degC"),
    (&["humidity", "soc", "percent", "level"], "%"),
    (&["pressure"], "hPa"),
    (&["linear", "speed", "velocity"], "m/s"),
    (&["angular", "yaw_rate", "gyro"], "rad/s"),
    (&["accel", "acceleration"], "m/s^2"),
    (&["angle", "yaw", "roll", "pitch", "steering"], "rad"),
    (&["latitude", "longitude", "heading", "lat", "lon"], "deg"),
    (&["distance", "range", "ranges", "altitude", "height", "depth"], "m"),
    (&["voltage", "volt"], "V"),
    (&["current", "amp"], "A"),
    (&["power", "watt"], "W"),
    (&["energy"], "J"),
    (&["frequency"], "Hz"),
];

/// A text as YAML, with all characters escaped that need it.
#[must_use]
pub fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// A variable's name: that of the field, with that of the topic if the former is too general.
#[must_use]
pub fn variable(topic: &str, path: &str) -> String {
    let words = |text: &str| -> Vec<String> {
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        text.split(|c| !is_word(c)).filter(|word| !word.is_empty()).map(str::to_lowercase).collect()
    };
    let name = [words(topic), words(path)].concat().join("_");
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) { name } else { format!("v_{name}") }
}

/// A name that no other has: the name itself, or with a number behind it. It joins the others.
pub fn unique(name: &str, names: &mut BTreeSet<String>) -> String {
    let numbered = (2..).map(|number| format!("{name}_{number}"));
    let free = std::iter::once(name.to_owned()).chain(numbered).find(|name| !names.contains(name));
    let free = free.unwrap_or_default();
    names.insert(free.clone());
    free
}

/// The unit suggested by the nearest word in the field's name, else in the topic's.
#[must_use]
pub fn unit(path: &str, topic: &str) -> Option<&'static str> {
    let of = |text: &str| {
        let text = text.to_lowercase();
        let words: Vec<&str> = text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).collect();
        let suggests = |word: &str, names: &[&str]| {
            names.contains(&word) || word.split('_').any(|part| names.contains(&part))
        };
        words
            .iter()
            .rev()
            .find_map(|word| UNITS.iter().find(|(names, _)| suggests(word, names)).map(|(_, unit)| *unit))
    };
    of(path).or_else(|| of(topic))
}

/// A value with two digits more than a width needs.
#[must_use]
pub fn fine(value: f64, width: f64) -> String {
    let needed = if width > 0.0 { 2 - width.log10().floor() as i32 } else { 6 };
    // More places, or digits before the point, than a number has: the shortest text that is read as this value.
    if needed > 12 || value.abs() >= 1e15 {
        return format!("{value:e}");
    }
    let places = needed.max(0) as usize;
    let text = format!("{value:.places$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Three significant digits.
#[must_use]
pub fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return "0".to_owned();
    }
    let size = value.abs().log10().floor() as i32;
    if !(-6..7).contains(&size) {
        return format!("{value:.2e}");
    }
    let places = (2 - size).max(0) as usize;
    let text = format!("{value:.places$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_words_and_unique() {
        assert_eq!(variable("/odom", "twist.linear.x"), "odom_twist_linear_x");
        assert_eq!(variable("7/a b", ""), "v_7_a_b");
        let mut names = BTreeSet::new();
        let all: Vec<_> = (0..3).map(|_| unique("a", &mut names)).collect();
        assert_eq!(all, ["a", "a_2", "a_3"]);
    }

    #[test]
    fn units_are_suggested_by_names() {
        assert_eq!(unit("outdoor_temperature", "x"), Some("degC"));
        assert_eq!(unit("twist.linear.x", "odom"), Some("m/s"));
        assert_eq!(unit("value", "house/humidity"), Some("%"));
        assert_eq!(unit("a", "b"), None);
    }
}
