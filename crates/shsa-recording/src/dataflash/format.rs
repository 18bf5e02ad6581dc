//! The definitions of a DataFlash log: `FMT` (where fields are), `FMTU`, `UNIT` and `MULT` (their units).

use super::super::record::{Scalar, Slot};
use super::super::topic::{Fields, Listener, Topic, TopicId};
use std::collections::BTreeMap;

/// The length of a message's header: two magic bytes, and the kind.
pub(super) const HEADER: usize = 3;

/// The kind of the messages that define formats.
pub(super) const FMT: u8 = 128;

/// The length of an `FMT` message; the fields are `BBnNZ`: kind, length, name, characters of the fields, names of the fields.
pub(super) const FMT_LENGTH: usize = 89;

/// A kind of message.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Format {
    /// The name: `IMU`.
    pub(super) name: String,
    /// The length of a message with its header.
    pub(super) length: usize,
    /// The fields; an error in words where the format cannot be understood. Places count from the end of the header.
    pub(super) slots: Result<Vec<Slot>, String>,
    /// The field with the number of the device: `I`.
    pub(super) instance: Option<usize>,
}

/// The fields of `FMT` itself.
const FMT_COLUMNS: (&str, &str) = ("BBnNZ", "Type,Length,Name,Format,Columns");

impl Format {
    /// The format of `FMT` itself.
    pub(super) fn of_formats() -> Format {
        Format::new("FMT", FMT_LENGTH, FMT_COLUMNS.0, FMT_COLUMNS.1)
    }

    /// A format from its name, the length of a message with its header, a character for each field, and the fields' names.
    pub(super) fn new(name: &str, length: usize, characters: &str, columns: &str) -> Format {
        let slots = slots(characters, columns).and_then(|slots| match HEADER + size(&slots) {
            found if found == length || slots.is_empty() => Ok(slots),
            found => Err(format!("its fields have {found} bytes, and its messages {length}")),
        });
        Format { name: name.to_owned(), length, slots, instance: None }
    }

    /// The format and its kind from the content of an `FMT` message; `None` where the content defines no format.
    pub(super) fn of_message(content: &[u8]) -> Option<(u8, Format)> {
        let [kind, length, rest @ ..] = content else { return None };
        let text = |from: usize, to: usize| {
            let bytes = rest.get(from..to)?.split(|byte| *byte == 0).next()?;
            std::str::from_utf8(bytes).ok()
        };
        let (name, characters, columns) = (text(0, 4)?, text(4, 20)?, text(20, 84)?);
        let length = usize::from(*length);
        let is_name =
            !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
        (is_name && length >= HEADER).then(|| (*kind, Format::new(name, length, characters, columns)))
    }

    /// Whether both formats are the same, units apart.
    pub(super) fn is_same(&self, other: &Format) -> bool {
        let names = |it: &Format| {
            it.slots.as_ref().ok().map(|slots| slots.iter().map(|slot| slot.name.clone()).collect::<Vec<_>>())
        };
        self.name == other.name && self.length == other.length && names(self) == names(other)
    }

    /// Whether this is the GPS message whose `TimeMS` is the time of the week.
    pub(super) fn is_old_gps(&self) -> bool {
        self.name.starts_with("GPS") && self.slot("T").is_some()
    }

    /// Reports the topic of these messages, or of those of one device.
    pub(super) fn report_topic(&self, device: Option<i64>, listener: &mut dyn Listener) -> TopicId {
        let full = device.map_or(self.name.clone(), |device| format!("{}[{device}]", self.name));
        let fields = match &self.slots {
            Ok(slots) => Fields::named(slots.iter().map(Slot::field)),
            Err(problem) => Fields::Unknown(problem.clone()),
        };
        listener.topic(Topic { full: &full, ..Topic::new(&self.name, &self.name, fields) })
    }

    /// The field of this name.
    pub(super) fn slot(&self, name: &str) -> Option<&Slot> {
        self.slots.as_ref().ok()?.iter().find(|slot| slot.name == name)
    }
}

fn size(slots: &[Slot]) -> usize {
    slots.iter().map(|slot| slot.scalar.size() * slot.count.unwrap_or(1)).sum()
}

fn slots(characters: &str, columns: &str) -> Result<Vec<Slot>, String> {
    let mut names = columns.split(',').map(str::trim);
    let mut at = 0;
    let mut slots = Vec::new();
    for (index, character) in characters.chars().enumerate() {
        let (scalar, count, divisor, unit) =
            field(character).ok_or_else(|| format!("'{character}' is no type of a field"))?;
        // Columns are cut at 64 letters: a field that has lost its name still counts.
        let name = names.next().filter(|name| !name.is_empty());
        let name = name.map_or_else(|| format!("field_{index}"), str::to_owned);
        slots.push(Slot { divisor, unit: unit.to_owned(), ..Slot::new(name, scalar, at, count) });
        at += scalar.size() * count.unwrap_or(1);
    }
    Ok(slots)
}

/// The meaning of a field's character: the type, the number of elements, the divisor, the unit.
///
/// <https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html>
fn field(character: char) -> Option<(Scalar, Option<usize>, f64, &'static str)> {
    let one = |scalar| Some((scalar, None, 1.0, ""));
    match character {
        'a' => Some((Scalar::I16, Some(32), 1.0, "")),
        'b' => one(Scalar::I8),
        'B' | 'M' => one(Scalar::U8),
        'h' => one(Scalar::I16),
        'H' => one(Scalar::U16),
        'i' => one(Scalar::I32),
        'I' => one(Scalar::U32),
        'q' => one(Scalar::I64),
        'Q' => one(Scalar::U64),
        'g' => one(Scalar::F16),
        'f' => one(Scalar::F32),
        'd' => one(Scalar::F64),
        'c' => Some((Scalar::I16, None, 100.0, "")),
        'C' => Some((Scalar::U16, None, 100.0, "")),
        'e' => Some((Scalar::I32, None, 100.0, "")),
        'E' => Some((Scalar::U32, None, 100.0, "")),
        'L' => Some((Scalar::I32, None, 1e7, "deg")),
        'n' => Some((Scalar::Char, Some(4), 1.0, "")),
        'N' => Some((Scalar::Char, Some(16), 1.0, "")),
        'Z' => Some((Scalar::Char, Some(64), 1.0, "")),
        _ => None,
    }
}

/// The units and multipliers of a log, by their letters.
#[derive(Clone, Debug, Default)]
pub(super) struct Units {
    units: BTreeMap<u8, String>,
    multipliers: BTreeMap<u8, f64>,
}

/// The letter of the field that numbers the device.
const INSTANCE: u8 = b'#';

impl Units {
    /// Adds a unit for a letter, by `UNIT`.
    pub(super) fn add_unit(&mut self, letter: u8, label: &str) {
        self.units.insert(letter, label.to_owned());
    }

    /// Adds a multiplier for a letter, by `MULT`.
    pub(super) fn add_multiplier(&mut self, letter: u8, multiplier: f64) {
        self.multipliers.insert(letter, multiplier);
    }

    /// Applies the letters of a format's fields, by `FMTU`. Values stay as they are logged. A multiplier that is not part of the
    /// field's type goes into the unit: `mA`.
    pub(super) fn apply(&self, format: &mut Format, units: &[u8], multipliers: &[u8]) {
        let Ok(slots) = &mut format.slots else { return };
        for (index, slot) in slots.iter_mut().enumerate() {
            let letter = units.get(index).copied().unwrap_or(0);
            if letter == INSTANCE {
                format.instance = Some(index);
                continue;
            }
            let Some(unit) = self.units.get(&letter).filter(|unit| !unit.is_empty()) else { continue };
            let multiplier = multipliers.get(index).and_then(|letter| self.multipliers.get(letter));
            let is_scaled = slot.divisor != 1.0;
            if let Some(prefix) = prefix(multiplier.copied().filter(|_| !is_scaled)) {
                slot.unit = format!("{prefix}{}", plain(unit));
            }
        }
    }
}

/// The SI prefix for a multiplier; `None` where there is none.
fn prefix(multiplier: Option<f64>) -> Option<&'static str> {
    let known = [(1e-9, "n"), (1e-6, "u"), (1e-3, "m"), (1e-2, "c"), (1e-1, "d"), (1e3, "k"), (1e6, "M")];
    match multiplier {
        None | Some(0.0 | 1.0) => Some(""),
        Some(it) => known.into_iter().find(|(size, _)| (it / size - 1.0).abs() < 1e-6).map(|(_, name)| name),
    }
}

/// A unit as this program writes it, for labels that are words or have letters beyond ASCII.
fn plain(label: &str) -> &str {
    match label {
        "degheading" | "deglatitude" | "deglongitude" => "deg",
        "degC" | "°C" => "degC",
        "m/s/s" => "m/s^2",
        "m/s/s/s" => "m/s^3",
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_laid_out_by_their_characters() {
        let format = Format::new("GPS", 3 + 8 + 1 + 2 + 4, "QBcL", "TimeUS,Status,HDop,Lat");
        let slots = format.slots.unwrap();
        let shown: Vec<String> =
            slots.iter().map(|it| format!("{}@{}/{}", it.name, it.at, it.divisor)).collect();
        assert_eq!(shown, ["TimeUS@0/1", "Status@8/1", "HDop@9/100", "Lat@11/10000000"]);
        assert_eq!(Format::of_formats().slots.unwrap().len(), 5);
    }

    #[test]
    fn a_format_that_contradicts_itself_keeps_its_length() {
        let format = Format::new("X", 20, "Qf", "TimeUS,A");
        assert_eq!(format.slots.unwrap_err(), "its fields have 15 bytes, and its messages 20");
        assert_eq!(Format::new("X", 20, "Q?", "a,b").slots.unwrap_err(), "'?' is no type of a field");
    }

    #[test]
    fn units_are_those_of_the_values_as_they_are_logged() {
        let mut units = Units::default();
        for (letter, label) in [(b's', "s"), (b'A', "A"), (b'd', "deg"), (b'n', "m/s/s")] {
            units.add_unit(letter, label);
        }
        for (letter, multiplier) in [(b'F', 1e-6), (b'C', 1e-3), (b'B', 1e-2), (b'0', 1.0), (b'-', 0.0)] {
            units.add_multiplier(letter, multiplier);
        }
        let mut format = Format::new("X", 3 + 8 + 1 + 4 + 2 + 4, "QBfcf", "TimeUS,I,Curr,Roll,Acc");
        units.apply(&mut format, b"s#Adn", b"F-CB0");
        assert_eq!(format.instance, Some(1));
        let shown: Vec<&str> = format.slots.as_ref().unwrap().iter().map(|slot| &*slot.unit).collect();
        assert_eq!(shown, ["us", "", "mA", "deg", "m/s^2"]);
    }
}
