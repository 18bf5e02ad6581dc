//! Types of messages: what fields they have, in the order in which they stand on the wire.

use crate::BridgeError;
use shsa_core::unit::nearest;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, LazyLock};

/// A number on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Primitive {
    Bool,
    Byte,
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

/// What a field holds, or each element of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Primitive(Primitive),
    /// At most so many bytes, where it is bounded.
    Text(Option<u32>),
    /// A text of wide characters; no message of ROS's own has one, and nothing behind one is read.
    WideText,
    /// Of this type, by its full name.
    Message(Arc<str>),
}

/// How many values a field holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Count {
    One,
    Fixed(u32),
    /// Said on the wire; at most so many, where it is bounded.
    Free(Option<u32>),
}

/// A field of a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Member {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    pub(crate) count: Count,
}

/// Types by their full names, such as `sensor_msgs/msg/LaserScan`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Types(BTreeMap<Arc<str>, Vec<Member>>);

static STANDARD: LazyLock<Arc<Types>> =
    LazyLock::new(|| Arc::new(Types::table(include_str!("standard.txt"))));

impl Types {
    /// The messages of ROS 2's common interfaces: std, sensor, geometry, nav, diagnostic, trajectory and more.
    #[must_use]
    pub fn standard() -> Arc<Types> {
        STANDARD.clone()
    }

    /// One type a line: `name: kind field, kind field`.
    fn table(text: &str) -> Types {
        let mut types = Types::default();
        for (name, fields) in text.lines().filter_map(|line| line.split_once(':')) {
            types.insert(name, fields.split(','));
        }
        types
    }

    /// Adds the type that the text of a `.msg` file defines; one of the same name is replaced. What is no field (comments,
    /// constants) is passed over.
    ///
    /// Language: <https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html>.
    pub fn add(&mut self, name: &str, definition: &str) {
        self.insert(&full_name(name), definition.lines());
    }

    fn insert<'a>(&mut self, name: &str, fields: impl Iterator<Item = &'a str>) {
        let members = fields.filter_map(|line| member(line, name)).collect();
        self.0.insert(name.into(), members);
    }

    /// Adds the types of a folder and those below it: `PACKAGE/msg/NAME.msg`, as in the `share` folder of a ROS
    /// installation or the folder of a workspace.
    ///
    /// # Errors
    /// When the folder or a file in it cannot be read.
    pub fn add_folder(&mut self, folder: &Path) -> Result<(), BridgeError> {
        let wrong = |what: &Path, why: std::io::Error| {
            BridgeError::Configuration(format!("{}: {why}", what.display()))
        };
        let mut folders = vec![(folder.to_owned(), 0)];
        while let Some((folder, depth)) = folders.pop() {
            for entry in std::fs::read_dir(&folder).map_err(|why| wrong(&folder, why))? {
                let path = entry.map_err(|why| wrong(&folder, why))?.path();
                if path.is_dir() && depth < DEPTH_MAX {
                    folders.push((path, depth + 1));
                } else if let Some(name) = name_of_file(&path) {
                    self.add(&name, &std::fs::read_to_string(&path).map_err(|why| wrong(&path, why))?);
                }
            }
        }
        Ok(())
    }

    /// The fields of a type.
    ///
    /// # Errors
    /// When the type is not known; names the nearest one.
    pub(crate) fn members(&self, name: &str) -> Result<&[Member], String> {
        self.0.get(name).map(Vec::as_slice).ok_or_else(|| {
            let near = nearest(name, self.0.keys().map(AsRef::as_ref));
            let hint = near.map_or_else(String::new, |near| format!("; is it {near}?"));
            format!("the message type {name} is not known{hint}")
        })
    }

    /// Appends the paths of all numbers and lists of numbers in a type, until there are `at_most`; of a list of messages
    /// those of the first one.
    ///
    /// # Errors
    /// When a type is not known.
    pub(crate) fn paths(
        &self,
        name: &str,
        from: &str,
        at_most: usize,
        paths: &mut Vec<String>,
    ) -> Result<(), String> {
        for Member { name, kind, count } in self.members(name)? {
            let dot = if from.is_empty() { "" } else { "." };
            let element = if matches!(kind, Kind::Message(_)) && *count != Count::One { "[0]" } else { "" };
            let path = format!("{from}{dot}{name}{element}");
            match kind {
                _ if paths.len() >= at_most || path.len() > PATH_MAX => return Ok(()),
                Kind::Primitive(_) => paths.push(path),
                Kind::Message(inner) => self.paths(inner, &path, at_most, paths)?,
                Kind::Text(_) | Kind::WideText => {}
            }
        }
        Ok(())
    }

    /// The names of all types.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(AsRef::as_ref)
    }
}

/// Longer paths are not listed: a type may hold itself.
const PATH_MAX: usize = 200;

/// Folders may nest so deep.
const DEPTH_MAX: usize = 8;

/// `.../sensor_msgs/msg/Imu.msg` is `sensor_msgs/msg/Imu`.
fn name_of_file(path: &Path) -> Option<String> {
    path.extension().filter(|extension| *extension == "msg")?;
    let folder = path.parent()?;
    (folder.file_name()? == "msg").then_some(())?;
    let package = folder.parent()?.file_name()?;
    Some(format!("{}/msg/{}", package.to_str()?, path.file_stem()?.to_str()?))
}

/// The full name of a type that may be written shorter, or as DDS writes it: `std_msgs/Float64` and
/// `std_msgs::msg::dds_::Float64_` are `std_msgs/msg/Float64`.
#[must_use]
pub fn full_name(name: &str) -> Cow<'_, str> {
    let name = name.trim();
    if let Some((package, dds)) = name.split_once("::msg::dds_::") {
        return format!("{package}/msg/{}", dds.strip_suffix('_').unwrap_or(dds)).into();
    }
    match name.split_once('/') {
        Some((package, own)) if !own.contains('/') => format!("{package}/msg/{own}").into(),
        _ => name.into(),
    }
}

/// A field of a definition's line; `None` for comments, constants, blank lines.
fn member(line: &str, owner: &str) -> Option<Member> {
    let line = line.split('#').next()?.trim();
    let (kind, rest) = line.split_once(char::is_whitespace)?;
    let mut rest = rest.split_whitespace();
    let name = rest.next()?;
    if name.contains('=') || rest.next().is_some_and(|word| word.starts_with('=')) {
        return None;
    }
    let (kind, count) = match kind.strip_suffix(']').and_then(|open| open.rsplit_once('[')) {
        None => (kind, Count::One),
        Some((kind, "")) => (kind, Count::Free(None)),
        Some((kind, size)) => (
            kind,
            match size.strip_prefix("<=") {
                Some(bound) => Count::Free(Some(bound.parse().ok()?)),
                None => Count::Fixed(size.parse().ok()?),
            },
        ),
    };
    Some(Member { name: name.to_owned(), kind: kind_of(kind, owner)?, count })
}

fn kind_of(kind: &str, owner: &str) -> Option<Kind> {
    let (kind, bound) = match kind.split_once("<=") {
        Some((kind, bound)) => (kind, Some(bound.parse().ok()?)),
        None => (kind, None),
    };
    if let Some(primitive) = Primitive::named(kind) {
        return Some(Kind::Primitive(primitive));
    }
    Some(match kind {
        "string" => Kind::Text(bound),
        "wstring" => Kind::WideText,
        "time" => Kind::Message("builtin_interfaces/msg/Time".into()),
        "duration" => Kind::Message("builtin_interfaces/msg/Duration".into()),
        "Header" => Kind::Message("std_msgs/msg/Header".into()),
        other if other.contains('/') => Kind::Message(full_name(other).into()),
        near => Kind::Message(format!("{}/msg/{near}", owner.split('/').next()?).into()),
    })
}

impl Primitive {
    fn named(name: &str) -> Option<Primitive> {
        Some(match name {
            "bool" => Primitive::Bool,
            "byte" => Primitive::Byte,
            "int8" => Primitive::I8,
            "uint8" | "char" => Primitive::U8,
            "int16" => Primitive::I16,
            "uint16" => Primitive::U16,
            "int32" => Primitive::I32,
            "uint32" => Primitive::U32,
            "int64" => Primitive::I64,
            "uint64" => Primitive::U64,
            "float32" => Primitive::F32,
            "float64" => Primitive::F64,
            _ => return None,
        })
    }

    /// Its size, which is its alignment, too; bytes.
    pub(crate) fn size(self) -> usize {
        match self {
            Primitive::Bool | Primitive::Byte | Primitive::I8 | Primitive::U8 => 1,
            Primitive::I16 | Primitive::U16 => 2,
            Primitive::I32 | Primitive::U32 | Primitive::F32 => 4,
            Primitive::I64 | Primitive::U64 | Primitive::F64 => 8,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_written_in_many_ways() {
        for name in ["std_msgs/Float64", "std_msgs/msg/Float64", " std_msgs::msg::dds_::Float64_"] {
            assert_eq!(full_name(name), "std_msgs/msg/Float64");
        }
        assert_eq!(full_name("Float64"), "Float64");
    }

    #[test]
    fn every_standard_type_is_whole() {
        let types = Types::standard();
        assert_eq!(types.names().count(), include_str!("standard.txt").lines().count());
        for (name, members) in &types.0 {
            for member in members {
                if let Kind::Message(inner) = &member.kind {
                    assert!(types.0.contains_key(inner), "{name}: {inner}");
                }
            }
        }
        let problem = types.members("sensor_msgs/msg/LaserScam").unwrap_err();
        assert!(problem.ends_with("is not known; is it sensor_msgs/msg/LaserScan?"), "{problem}");
    }

    #[test]
    fn definitions_are_read() {
        let mut types = Types::default();
        types.add(
            "bot_msgs/Robot",
            "# a robot\nuint8 KIND=3\nstring NAME = \"a # b\"\nHeader header # when\n\nstring<=10 name \"x\"\n\
             Part[<=4] parts\nuint16[3] codes [1, 2, 3]\nfloat64 speed 0.5\nwstring title\ntime at\n",
        );
        let shown: Vec<String> = types
            .members("bot_msgs/msg/Robot")
            .unwrap()
            .iter()
            .map(|member| format!("{} {:?} {:?}", member.name, member.kind, member.count))
            .collect();
        assert_eq!(
            shown,
            [
                r#"header Message("std_msgs/msg/Header") One"#,
                "name Text(Some(10)) One",
                r#"parts Message("bot_msgs/msg/Part") Free(Some(4))"#,
                "codes Primitive(U16) Fixed(3)",
                "speed Primitive(F64) One",
                "title WideText One",
                r#"at Message("builtin_interfaces/msg/Time") One"#,
            ]
        );
    }

    #[test]
    fn folders_are_read() {
        let folder = std::env::temp_dir().join(format!("shsa-types-{}", std::process::id()));
        let package = folder.join("share/bot_msgs/msg");
        std::fs::create_dir_all(&package).unwrap();
        std::fs::write(package.join("Part.msg"), "float32 wear\n").unwrap();
        std::fs::write(package.join("Part.txt"), "no type\n").unwrap();
        let mut types = Types::default();
        types.add_folder(&folder).unwrap();
        assert_eq!(types.names().collect::<Vec<_>>(), ["bot_msgs/msg/Part"]);
        std::fs::remove_dir_all(&folder).unwrap();
        assert!(types.add_folder(&folder).is_err());
    }
}
