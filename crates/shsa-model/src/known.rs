//! Reads a mapping by the table of its keys; error messages use the words of the table.

use shsa_core::knowledge::{Bounds, PropertyDrafts, Text};

use super::keys::Key;
use super::reader::{Fields, Reader};
use super::tree::Node;

/// The values of one mapping.
pub(crate) struct Known<'r, 'n> {
    pub(crate) reader: &'r mut Reader,
    fields: Fields<'n>,
    keys: &'static [Key],
}

impl<'r, 'n> Known<'r, 'n> {
    /// The values of a node. Unknown keys are reported; `what` names the expected value, `example` shows it.
    pub(crate) fn of(
        reader: &'r mut Reader,
        node: &'n Node,
        keys: &'static [Key],
        what: &str,
        example: &str,
    ) -> Self {
        let fields = reader.fields_of(node, what, keys.iter().map(|key| key.name), example);
        Known { reader, fields, keys }
    }

    /// The values of a node with further keys, which are returned with their texts.
    pub(crate) fn beside_words(
        reader: &'r mut Reader,
        node: &'n Node,
        keys: &'static [Key],
        what: &str,
        example: &str,
    ) -> (Self, PropertyDrafts) {
        let entries = reader.entries(node, what, example);
        let others = entries.iter().filter(|(name, _)| keys.iter().all(|key| key.name != name.text));
        let word = |(name, node): &(Text, Node)| {
            let example = format_args!("{}: at most 0.5 m", name.text).to_string();
            Some((name.clone(), reader.text(node, "a bound in words", example)?))
        };
        let words = others.filter_map(word).collect();
        let fields = Fields::of(entries);
        (Known { reader, fields, keys }, words)
    }

    /// Whether a key is one of the table.
    pub(crate) fn is_known(&self, key: &str) -> bool {
        self.keys.iter().any(|known| known.name == key)
    }

    /// Names with a text each.
    pub(crate) fn words(&mut self, key: &str) -> PropertyDrafts {
        let example = "fresh: age at most 300 ms";
        let read = |reader: &mut Reader, (name, node): &(Text, Node)| {
            Some((name.clone(), reader.text(node, "words", example)?))
        };
        self.entries(key, read).into_iter().flatten().collect()
    }

    pub(crate) fn get(&self, key: &str) -> Option<&'n Node> {
        debug_assert!(self.is_known(key), "`{key}` is in no table");
        self.fields.get(key)
    }

    pub(crate) fn text(&mut self, key: &str) -> Option<Text> {
        self.read(key, |reader, node, key| reader.text(node, key.what, written(key)))
    }

    pub(crate) fn names(&mut self, key: &str) -> Option<Vec<Text>> {
        self.read(key, |reader, node, key| Some(reader.names(node, key.what, written(key))))
    }

    pub(crate) fn bounds(&mut self, key: &str) -> Option<Bounds> {
        self.read(key, |reader, node, key| reader.bounds(node, key.what, written(key)))
    }

    pub(crate) fn pair(&mut self, key: &str) -> Option<(Text, Text)> {
        self.read(key, |reader, node, key| reader.pair(node, key.what, written(key)))
    }

    pub(crate) fn numbers(&mut self, key: &str) -> PropertyDrafts {
        let node = self.get(key);
        self.reader.properties(node)
    }

    /// Names with a name each.
    pub(crate) fn texts(&mut self, key: &str) -> Vec<(Text, Text)> {
        let read = self.read(key, |reader, node, key| {
            let entries = reader.entries(node, key.what, key.example);
            let one = |(name, node): &(Text, Node)| {
                Some((name.clone(), reader.text(node, "a name", written(key))?))
            };
            Some(entries.iter().filter_map(one).collect())
        });
        read.unwrap_or_default()
    }

    /// Names, each with the result of `one`.
    pub(crate) fn entries<T>(
        &mut self,
        key: &str,
        mut one: impl FnMut(&mut Reader, &(Text, Node)) -> T,
    ) -> Vec<T> {
        let read = self.read(key, |reader, node, key| {
            let entries = reader.entries(node, key.what, written(key));
            Some(entries.iter().map(|entry| one(reader, entry)).collect())
        });
        read.unwrap_or_default()
    }

    fn read<T>(
        &mut self,
        key: &str,
        how: impl FnOnce(&mut Reader, &'n Node, &'static Key) -> Option<T>,
    ) -> Option<T> {
        let node = self.get(key)?;
        let known = self.keys.iter().find(|known| known.name == key)?;
        how(self.reader, node, known)
    }
}

/// A key as written in a model; formatted only for a message.
fn written(key: &'static Key) -> impl std::fmt::Display + Copy {
    #[derive(Clone, Copy)]
    struct Written(&'static Key);
    impl std::fmt::Display for Written {
        fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            write!(f, "{}: {}", self.0.name, self.0.example)
        }
    }
    Written(key)
}
