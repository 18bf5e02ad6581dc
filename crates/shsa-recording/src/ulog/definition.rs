//! The definitions of a ULog: formats in text, and the places of their fields in the bytes.

use super::super::record::{Scalar, Slot};
use std::collections::BTreeMap;

/// The deepest nesting of formats.
const DEPTH_MAX: usize = 8;

/// The most fields of a format, with those of nested formats, and the most steps to find them.
const STEPS_MAX: usize = 1 << 13;

/// The most bytes of all formats, as formats are kept.
const TEXT_MAX: usize = 1 << 22;

/// The longest message: its length has 16 bits.
const SIZE_MAX: usize = 1 << 16;

/// One field of a format: `float[3] gyro_rad`.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Member {
    name: String,
    kind: String,
    count: Option<usize>,
}

/// The formats of a log.
#[derive(Clone, Debug, Default)]
pub(super) struct Formats {
    by_name: BTreeMap<String, Vec<Member>>,
    /// The length of all texts.
    text: usize,
}

/// The places of the fields in a topic's messages.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Layout {
    /// The fields without the padding, in the order of the bytes.
    pub(super) slots: Vec<Slot>,
    /// The length of a message with the padding.
    pub(super) size: usize,
    /// The length without the padding at the end, which is not logged.
    pub(super) size_min: usize,
    steps: usize,
}

impl Formats {
    /// Adds a format: `sensor_combined:uint64_t timestamp;float[3] gyro_rad;`. `None` where the text is no format.
    pub(super) fn add(&mut self, text: &str) -> Option<()> {
        let (name, members) = text.split_once(':')?;
        let members = members.split(';').map(str::trim).filter(|member| !member.is_empty());
        let members = members.map(member).collect::<Option<Vec<_>>>()?;
        self.text += text.len();
        let is_sound = is_name(name) && !members.is_empty() && self.text <= TEXT_MAX;
        is_sound.then(|| drop(self.by_name.insert(name.to_owned(), members)))
    }

    /// The places of a format's fields; an error in words where there can be none.
    pub(super) fn layout(&self, name: &str) -> Result<Layout, String> {
        let mut layout = Layout::default();
        self.lay_out(name, "", 0, &mut layout)?;
        Ok(layout)
    }

    fn lay_out(&self, format: &str, prefix: &str, depth: usize, layout: &mut Layout) -> Result<(), String> {
        let members =
            self.by_name.get(format).ok_or_else(|| format!("the format '{format}' is not defined"))?;
        if depth == DEPTH_MAX {
            return Err(format!("formats are nested more than {DEPTH_MAX} deep"));
        }
        for Member { name, kind, count } in members {
            layout.step()?;
            let name = format!("{prefix}{name}");
            match scalar(kind) {
                Some(scalar) => layout.push(name, scalar, *count)?,
                None => {
                    for index in 0..count.unwrap_or(1) {
                        layout.step()?;
                        let within = count.map_or(format!("{name}."), |_| format!("{name}[{index}]."));
                        self.lay_out(kind, &within, depth + 1, layout)?;
                    }
                }
            }
        }
        Ok(())
    }
}

impl Layout {
    /// Counts a step, as a few bytes of nesting could ask for much work.
    fn step(&mut self) -> Result<(), String> {
        self.steps += 1;
        let most = format!("the format has more than {STEPS_MAX} fields");
        if self.steps > STEPS_MAX { Err(most) } else { Ok(()) }
    }

    fn push(&mut self, name: String, scalar: Scalar, count: Option<usize>) -> Result<(), String> {
        let (at, length) = (self.size, scalar.size() * count.unwrap_or(1));
        self.size += length;
        if self.size > SIZE_MAX {
            return Err(format!("the format has more than {SIZE_MAX} bytes"));
        }
        let is_padding = name.rsplit('.').next().is_some_and(|name| name.starts_with("_padding"));
        if !is_padding {
            self.size_min = self.size;
            self.slots.push(Slot::new(name, scalar, at, count));
        }
        Ok(())
    }

    /// The field of this name.
    pub(super) fn slot(&self, name: &str) -> Option<&Slot> {
        self.slots.iter().find(|slot| slot.name == name)
    }
}

fn member(text: &str) -> Option<Member> {
    let (kind, name) = text.split_once(' ')?;
    let (kind, count) = match kind.split_once('[') {
        Some((kind, count)) => {
            (kind, Some(count.strip_suffix(']')?.parse().ok().filter(|it| *it <= SIZE_MAX)?))
        }
        None => (kind, None),
    };
    let name = name.trim();
    (is_name(name) && is_name(kind)).then(|| Member { name: name.to_owned(), kind: kind.to_owned(), count })
}

/// Whether a text can be the name of a format, a topic or a field.
pub(super) fn is_name(text: &str) -> bool {
    let is_part = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-' | b'/');
    !text.is_empty() && text.bytes().all(is_part)
}

fn scalar(name: &str) -> Option<Scalar> {
    Some(match name {
        "int8_t" => Scalar::I8,
        "uint8_t" | "bool" => Scalar::U8,
        "int16_t" => Scalar::I16,
        "uint16_t" => Scalar::U16,
        "int32_t" => Scalar::I32,
        "uint32_t" => Scalar::U32,
        "int64_t" => Scalar::I64,
        "uint64_t" => Scalar::U64,
        "float" => Scalar::F32,
        "double" => Scalar::F64,
        "char" => Scalar::Char,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(formats: &[&str], name: &str, expected: &str) {
        let mut all = Formats::default();
        for format in formats {
            all.add(format).unwrap();
        }
        let shown = all.layout(name).map_or_else(
            |problem| problem,
            |layout| {
                let slot = |it: &Slot| format!("{}@{}", it.name, it.at);
                let slots: Vec<_> = layout.slots.iter().map(slot).collect();
                format!("{} of {}..{}", slots.join(" "), layout.size_min, layout.size)
            },
        );
        assert_eq!(shown, expected);
    }

    #[test]
    fn fields_stand_one_after_the_other() {
        check(
            &["a:uint64_t timestamp;float[3] x;uint8_t[2] _padding0;bool on;uint8_t[3] _padding1;"],
            "a",
            "timestamp@0 x@8 on@22 of 23..26",
        );
        check(
            &["inner:int16_t a;char[4] b;", "outer:inner[2] esc;inner one;"],
            "outer",
            "esc[0].a@0 esc[0].b@2 esc[1].a@6 esc[1].b@8 one.a@12 one.b@14 of 18..18",
        );
    }

    #[test]
    fn what_cannot_be_laid_out_is_said() {
        check(&["a:b x;"], "a", "the format 'b' is not defined");
        check(&["a:a x;"], "a", "formats are nested more than 8 deep");
        check(&["a:float[60000] x;"], "a", "the format has more than 65536 bytes");
        check(&["a:b[65000] x;", "b:c[65000] x;", "c:a[0] x;"], "a", "the format has more than 8192 fields");
        let mut formats = Formats::default();
        for wrong in ["a", "a:", "a:x", "a:float[x] b;", "a:float[3 b;", "é:float b;", "a:float b c;"] {
            assert!(formats.add(wrong).is_none(), "{wrong}");
        }
    }
}
