//! Associations of tracks, in a file: which sensors give tracks of the same objects, where, and what is published about them.
//!
//! ```yaml
//! associations:
//!   border_1:
//!     sensors:
//!       entering: { tracks: /radar/2/tracks, x: x, y: y, speed_x: speed, error: [1.2, 0.6], output: /radar/2/entering }
//!       leaving:  { tracks: /radar/1/tracks, x: x, y: y, speed_x: speed, error: [1.2, 0.6], output: /radar/1/leaving }
//!     region: "x > 110 and x < 180"
//!     near: [150, 2]
//! ```
//!
//! All numbers are in the units of the messages. `docs/association.md` describes every key.

mod read;

use shsa_core::knowledge::Place;
use shsa_core::time::Span;
use shsa_estimate::association::Associator;
use shsa_message::source::StampField;
use shsa_model::reader::Reader;
use shsa_model::tree;
use shsa_model::{Report, read_text};
use std::path::Path;

/// A key: its name, what it holds, the value where it is absent.
pub type Key = (&'static str, &'static str, &'static str);

/// The keys of an association.
pub const ASSOCIATION: [Key; 9] = [
    ("sensors", "names of sensors with their keys", ""),
    ("misplaced", "two numbers, at least 0", "`[0, 0]`"),
    ("gate", "a probability", "0.999"),
    ("region", "a condition of `x` and `y`", "everywhere"),
    ("inner", "a condition of `x` and `y`", "all of the region"),
    ("near", "two numbers", "`[0, 0]`"),
    ("count_over", "a time", "a single moment"),
    ("pause", "a time", "none"),
    ("objects", "a topic", "no list of the objects"),
];

/// The keys of a sensor.
pub const SENSOR: [Key; 10] = [
    ("tracks", "a topic", ""),
    ("x", "a path", ""),
    ("y", "a path", ""),
    ("speed_x", "a path", "the objects rest along x"),
    ("speed_y", "a path", "the objects rest along y"),
    ("id", "a path", "a message has all tracks"),
    ("time", "a path, and the length of a step: `t*1 ms`", "the header's stamp, else the reception"),
    ("error", "two numbers above 0", ""),
    ("max_age", "a time", "1 s"),
    ("output", "the beginning of topics", "nothing is published"),
];

/// The associations of a file.
#[derive(Clone, Debug)]
pub struct Associations {
    /// In the order of the file; never empty.
    pub associations: Vec<Association>,
}

/// An association: how it is computed, where its tracks come from, and where its results go.
#[derive(Clone, Debug)]
pub struct Association {
    /// Its name.
    pub name: String,
    /// What associates the tracks; its sensors are those below.
    pub associator: Associator,
    /// The sensors.
    pub sensors: Vec<TrackSensor>,
    /// The topic of the list of all objects.
    pub objects: Option<String>,
}

/// Where the tracks of a sensor come from, and where its part of the results goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TrackSensor {
    /// Its name.
    pub name: String,
    /// The topic of its messages.
    pub topic: String,
    /// The fields of its messages.
    pub fields: Vec<(Part, String)>,
    /// The place of the time.
    pub time: Option<StampField>,
    /// When its tracks are too old to be used.
    pub max_age: Span,
    /// The beginning of the topics of its results.
    pub output: Option<String>,
}

/// A part of a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The position along x.
    X,
    /// The position along y.
    Y,
    /// The speed along x.
    SpeedX,
    /// The speed along y.
    SpeedY,
    /// The number of an object that has messages of its own.
    Id,
}

impl Part {
    /// All parts, with their keys.
    pub const ALL: [(&str, Part); 5] = [
        ("x", Part::X),
        ("y", Part::Y),
        ("speed_x", Part::SpeedX),
        ("speed_y", Part::SpeedY),
        ("id", Part::Id),
    ];
}

impl Associations {
    /// Reads a file.
    ///
    /// # Errors
    /// All problems with their places.
    pub fn load(path: &Path) -> Result<Associations, Report> {
        let text = read_text(path, "associations")?;
        Associations::read(&text, &path.display().to_string())
    }

    /// Reads a text; `name` is its name in reports.
    ///
    /// # Errors
    /// All problems with their places.
    pub fn read(text: &str, name: &str) -> Result<Associations, Report> {
        let mut tree = tree::read(text);
        let mut reader = Reader::default();
        let associations = match &tree.root {
            Some(root) => read::associations(&mut reader, root),
            None => {
                reader.note(Place::default(), "there are no associations", read::HELP);
                Vec::new()
            }
        };
        tree.problems.append(&mut reader.problems);
        match tree.problems.is_empty() {
            true => Ok(Associations { associations }),
            false => Err(Report::locate(name, text, tree.problems, &tree.rewritten)),
        }
    }
}

#[cfg(test)]
mod tests;
