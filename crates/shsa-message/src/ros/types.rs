//! Message types by their names: ROS 2's common ones, those of a workspace, and those in a bag.

use super::definition::{Count, Kind, Language, Member};
use super::service::{divided, event};
use crate::MessageError;
use crate::path::Step;
use memchr::{memchr, memchr_iter, memmem, memrchr};
use shsa_core::unit::nearest;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::mem;
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, LazyLock, OnceLock};

/// Types by their full names, such as `sensor_msgs/msg/LaserScan`. A definition is parsed when its type is first asked for: a
/// recording has many types of which nothing is read.
#[derive(Clone, Debug, Default)]
pub struct Types {
    own: BTreeMap<Arc<str>, Definition>,
    /// The types that are known besides; one of its own counts before one of these.
    others: Option<Arc<Types>>,
}

static STANDARD: LazyLock<Arc<Types>> =
    LazyLock::new(|| Arc::new(Types::table(include_str!("standard.txt"))));

/// What a line begins with that names the type whose fields follow.
const NEXT: &[u8] = b"MSG:";

/// The definition of one type.
#[derive(Clone, Debug)]
struct Definition {
    language: Language,
    /// A text, where in it the fields are, and what stands between two of them.
    text: Arc<str>,
    at: Range<usize>,
    between: u8,
    members: OnceLock<Vec<Member>>,
}

impl Definition {
    /// The fields of the type, which has this name.
    fn members(&self, name: &str) -> &[Member] {
        self.members.get_or_init(|| {
            let text = self.text.get(self.at.clone()).unwrap_or_default();
            let (mut members, mut begin) = (Vec::new(), 0);
            let ends = memchr_iter(self.between, text.as_bytes()).chain([text.len()]);
            for end in ends {
                let field = text.get(begin..end).unwrap_or_default();
                members.extend(self.language.member(field, name));
                begin = end + 1;
            }
            members
        })
    }
}

impl Types {
    /// The messages of ROS 2's common interfaces: std, sensor, geometry, nav, diagnostic, trajectory and more.
    #[must_use]
    pub fn standard() -> Arc<Types> {
        STANDARD.clone()
    }

    /// No types yet beside others, which are not copied.
    #[must_use]
    pub fn beside(others: Arc<Types>) -> Types {
        Types { own: BTreeMap::new(), others: Some(others) }
    }

    /// A table of one type a line: `name: kind field, kind field`.
    fn table(text: &str) -> Types {
        let (mut types, text) = (Types::default(), Arc::<str>::from(text));
        let mut begin = 0;
        for line in text.split('\n') {
            let end = begin + line.len();
            if let Some((name, fields)) = line.split_once(':') {
                types.insert(name.into(), Language::Ros2, &text, end - fields.len()..end, b',');
            }
            begin = end + 1;
        }
        types
    }

    /// The types of a definition in a bag of ROS 1: the fields of the type `root`, then those of the used types, each after a
    /// line `MSG: package/Type`. Names are ROS 1's, such as `nav_msgs/Odometry`. Lines without a field are skipped.
    #[must_use]
    pub fn of_bag(root: &str, definition: &str) -> Types {
        let mut types = Types::default();
        types.add_joined(Language::Ros1, root, definition);
        types
    }

    /// Adds the types of a definition in a recording of ROS 2, in the form of [`Types::of_bag`]. Names become ROS 2's full ones;
    /// known types are replaced.
    ///
    /// # Errors
    /// A definition of an action, which has more than two parts.
    pub fn add_recorded(&mut self, root: &str, definition: &str) -> Result<(), MessageError> {
        let Some((request, response)) = divided(definition) else {
            self.add_joined(Language::Ros2, root, definition);
            return Ok(());
        };
        if divided(response).is_some() {
            return Err(MessageError::Action(root.to_owned()));
        }
        // What the response uses stands behind it.
        let root = full_name(root);
        self.add(&format!("{root}_Request"), request);
        self.add_joined(Language::Ros2, &format!("{root}_Response"), response);
        self.add(&root, &event(&root));
        Ok(())
    }

    fn add_joined(&mut self, language: Language, root: &str, definition: &str) {
        let named = |name: &str| -> Arc<str> {
            match language {
                Language::Ros1 => name.into(),
                Language::Ros2 => full_name(name).into(),
            }
        };
        let text = Arc::<str>::from(definition);
        let bytes = text.as_bytes();
        let (mut name, mut begin) = (named(root), 0);
        for mark in memmem::find_iter(bytes, NEXT) {
            let (before, behind) = bytes.split_at(mark);
            let line = memrchr(b'\n', before).map_or(0, |at| at + 1);
            if !before.get(line..).unwrap_or_default().trim_ascii().is_empty() {
                continue;
            }
            let end = mark + memchr(b'\n', behind).unwrap_or(behind.len());
            let next = named(text.get(mark + NEXT.len()..end).unwrap_or_default().trim());
            self.insert(mem::replace(&mut name, next), language, &text, begin..line, b'\n');
            begin = (end + 1).min(bytes.len());
        }
        self.insert(name, language, &text, begin..bytes.len(), b'\n');
    }

    /// Adds the type of a `.msg` file of ROS 2, or replaces one of the same name. Comments and constants are skipped.
    pub fn add(&mut self, name: &str, definition: &str) {
        self.insert(full_name(name).into(), Language::Ros2, &definition.into(), 0..definition.len(), b'\n');
    }

    fn insert(&mut self, name: Arc<str>, language: Language, text: &Arc<str>, at: Range<usize>, between: u8) {
        let text = text.clone();
        self.own.insert(name, Definition { language, text, at, between, members: OnceLock::new() });
    }

    /// Adds the types of a folder and its subfolders: `PACKAGE/msg/NAME.msg`, as in the `share` folder of a ROS installation or
    /// the folder of a workspace.
    ///
    /// # Errors
    /// A folder or file that cannot be read.
    pub fn add_folder(&mut self, folder: &Path) -> Result<(), MessageError> {
        let wrong = |what: &Path, why: std::io::Error| MessageError::Folder {
            path: what.to_owned(),
            reason: why.to_string(),
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
    /// An unknown type, with the nearest known one.
    pub fn members(&self, name: &str) -> Result<&[Member], MessageError> {
        self.known(name).ok_or_else(|| MessageError::UnknownType {
            name: name.to_owned(),
            near: nearest(name, self.names()).map(str::to_owned),
        })
    }

    /// Whether there is a type of this name.
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        self.own.contains_key(name) || self.others.as_ref().is_some_and(|others| others.has(name))
    }

    fn known(&self, name: &str) -> Option<&[Member]> {
        match self.own.get(name) {
            Some(own) => Some(own.members(name)),
            None => self.others.as_ref()?.known(name),
        }
    }

    /// The path of the stamp in a leading header; `None` for a type without one.
    #[must_use]
    pub fn header_stamp(&self, name: &str) -> Option<[Step; 2]> {
        let Member { name, kind: Kind::Message(kind), count: Count::One } =
            self.members(name).ok()?.first()?
        else {
            return None;
        };
        // ROS 1 recognises a header by its name, too.
        let is_header = &**kind == "std_msgs/msg/Header" || &**kind == "std_msgs/Header" && name == "header";
        is_header.then(|| [name.as_str(), "stamp"].map(|name| Step::Key(name.to_owned())))
    }

    /// Appends the paths of all numbers and lists of numbers in a type, until there are `at_most`; of a list of messages, those
    /// of the first one.
    ///
    /// # Errors
    /// An unknown type.
    pub fn paths(
        &self,
        name: &str,
        from: &str,
        at_most: usize,
        paths: &mut Vec<String>,
    ) -> Result<(), MessageError> {
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

    /// The names of all types, in their order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.all_names().into_iter()
    }

    fn all_names(&self) -> BTreeSet<&str> {
        let mut names = self.others.as_ref().map_or_else(BTreeSet::new, |others| others.all_names());
        names.extend(self.own.keys().map(AsRef::<str>::as_ref));
        names
    }
}

impl PartialEq for Types {
    fn eq(&self, other: &Types) -> bool {
        self.names().eq(other.names()) && self.names().all(|name| self.known(name) == other.known(name))
    }
}

impl Eq for Types {}

/// Longer paths are not listed, as a type may contain itself.
const PATH_MAX: usize = 200;

/// The deepest nesting of folders.
const DEPTH_MAX: usize = 8;

/// The type name of a file: `.../sensor_msgs/msg/Imu.msg` is `sensor_msgs/msg/Imu`.
fn name_of_file(path: &Path) -> Option<String> {
    path.extension().filter(|extension| *extension == "msg")?;
    let folder = path.parent()?;
    (folder.file_name()? == "msg").then_some(())?;
    let package = folder.parent()?.file_name()?;
    Some(format!("{}/msg/{}", package.to_str()?, path.file_stem()?.to_str()?))
}

/// The full name of a ROS 2 type from a shorter one, or from DDS's: `std_msgs/Float64` and `std_msgs::msg::dds_::Float64_` are
/// `std_msgs/msg/Float64`.
#[must_use]
pub fn full_name(name: &str) -> Cow<'_, str> {
    let name = name.trim();
    // Most names are plain, and a byte is found more quickly than a text.
    let of_dds = memchr(b':', name.as_bytes()).and_then(|_| name.split_once("::msg::dds_::"));
    if let Some((package, dds)) = of_dds {
        return [package, "/msg/", dds.strip_suffix('_').unwrap_or(dds)].concat().into();
    }
    match name.split_once('/') {
        Some((package, own)) if !own.contains('/') => [package, "/msg/", own].concat().into(),
        _ => name.into(),
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
        for name in types.names() {
            for member in types.members(name).unwrap() {
                if let Kind::Message(inner) = &member.kind {
                    assert!(types.members(inner).is_ok(), "{name}: {inner}");
                }
            }
        }
        // What every bag has that records all topics.
        for of_all in [
            "rcl_interfaces/msg/Log",
            "rcl_interfaces/msg/ParameterEvent",
            "rosbag2_interfaces/msg/WriteSplitEvent",
        ] {
            assert!(types.members(of_all).is_ok(), "{of_all}");
        }
        let problem = types.members("sensor_msgs/msg/LaserScam").unwrap_err().to_string();
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
    fn what_makes_no_sense_is_a_type_that_nothing_defines() {
        for kind in ["float6<", "string<=x", "float64[9", "float64[x]", "float64[<=]", "int8[-1]"] {
            let mut types = Types::default();
            types.add("bot_msgs/Robot", &format!("{kind} odd\nfloat64 speed"));
            let members = types.members("bot_msgs/msg/Robot").unwrap();
            let odd = Member {
                name: "odd".into(),
                kind: Kind::Message(format!("bot_msgs/msg/{kind}").into()),
                count: Count::One,
            };
            assert_eq!((members.first(), members.len()), (Some(&odd), 2));
        }
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

    #[test]
    fn a_header_is_known_where_it_comes_first() {
        let of_bag = |definition| Types::of_bag("a/A", definition).header_stamp("a/A").is_some();
        assert!(of_bag("Header header") && of_bag("std_msgs/Header header\nint8 x"));
        assert!(!of_bag("int8 x\nHeader header") && !of_bag("Header head") && !of_bag("Header[] header"));
        let stamp = Types::standard().header_stamp("sensor_msgs/msg/Imu").unwrap();
        assert_eq!(stamp, [Step::Key("header".into()), Step::Key("stamp".into())]);
        assert_eq!(Types::standard().header_stamp("std_msgs/msg/Float64"), None);
    }
}
