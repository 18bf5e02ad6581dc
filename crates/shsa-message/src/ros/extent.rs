//! Where a message ends: a message that ends elsewhere is not of its type.

use super::definition::Kind;
use super::layout::{Body, Layout};
use super::plan::Compiler;
use super::steps::{Step, Steps, run};
use super::types::Types;
use crate::MessageError;

/// The most bytes behind the last field in CDR, which make the whole a multiple of four.
const PADDING_MAX: usize = 3;

/// The whole of a message: where it ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Extent {
    layout: Layout,
    /// The steps over all fields.
    steps: Vec<Step>,
    /// Whether the type has no fields; such messages have a byte, or none.
    is_empty: bool,
}

impl Extent {
    /// Of messages of a type.
    ///
    /// # Errors
    /// Why the end of a message cannot be found, as behind a text of wide characters.
    pub fn new(types: &Types, layout: Layout, message_type: &str) -> Result<Extent, MessageError> {
        let mut compiler = Compiler::new(types, layout);
        let mut steps = Steps::default();
        let is_empty = types.members(message_type)?.is_empty();
        compiler.over_one(&Kind::Message(message_type.into()), 0, &mut steps)?;
        Ok(Extent { layout, steps: steps.list, is_empty })
    }

    /// Whether the message ends where its fields do; CDR may pad it to a multiple of four bytes. `O(message)`.
    #[must_use]
    pub fn fits(&self, body: Body<'_>) -> bool {
        let padding = match self.layout {
            Layout::Packed => 0,
            Layout::Cdr => PADDING_MAX,
        };
        let is_end = |end: usize| body.bytes.len() - end <= padding;
        if self.is_empty {
            body.bytes.len() <= 1 + padding
        } else {
            run(&self.steps, body, 0).is_some_and(is_end)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(layout: Layout, definition: &str, bytes: &[u8], expected: bool) {
        let mut types = Types::beside(Types::standard());
        types.add("a/msg/A", definition);
        let body = Body { bytes, is_big_endian: false, layout };
        assert_eq!(Extent::new(&types, layout, "a/msg/A").unwrap().fits(body), expected, "{bytes:?}");
    }

    #[test]
    fn a_message_ends_with_its_fields() {
        let definition = "uint8 a\nstring s\nint16[] q";
        let packed = b"\x01\x01\0\0\0x\x01\0\0\0\x07\0";
        check(Layout::Packed, definition, packed, true);
        check(Layout::Packed, definition, &packed[..11], false);
        check(Layout::Packed, definition, &[packed, &b"\0"[..]].concat(), false);
        let cdr = b"\x01\0\0\0\x02\0\0\0x\0\0\0\x01\0\0\0\x07\0";
        check(Layout::Cdr, definition, cdr, true);
        check(Layout::Cdr, definition, &[&cdr[..], b"\0\0\0"].concat(), true);
        check(Layout::Cdr, definition, &[&cdr[..], b"\0\0\0\0"].concat(), false);
        check(Layout::Cdr, definition, &cdr[..17], false);
        check(Layout::Packed, "", b"", true);
        check(Layout::Cdr, "", b"\0\0\0\0", true);
        check(Layout::Cdr, "", b"\0\0\0\0\0", false);
    }
}
