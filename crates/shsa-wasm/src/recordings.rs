//! Recordings that come as bytes: named files, whole or read in pieces by a function of JavaScript.

use crate::progress::Told;
use crate::{Doctor, Problem};
use js_sys::{Function, Uint8Array};
use serde::Deserialize;
use shsa_lab::drafting::{Columns, Origin, checked_text, draft, why_nothing};
use shsa_message::span::parse_span;
use shsa_recording::{Bytes, Files, ReadOptions, Recording, Wanted, inventory, read};
use std::cell::RefCell;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use wasm_bindgen::JsCast;
use wasm_bindgen::prelude::wasm_bindgen;

/// What recordings do not say of themselves: as the options of the command.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "camelCase")]
struct Reading {
    by: Option<String>,
    time_column: Option<String>,
    time_unit: Option<String>,
    date_order: Option<String>,
    time_zone: Option<String>,
}

/// Files of recordings and of databases of CAN messages.
#[wasm_bindgen]
#[derive(Default)]
pub struct Recordings {
    paths: Vec<PathBuf>,
    databases: Vec<PathBuf>,
    files: Vec<(PathBuf, Arc<dyn Bytes>)>,
    by: Option<String>,
    options: ReadOptions,
}

thread_local! {
    /// Functions of JavaScript stay in their thread; a file has the number of its function.
    static READERS: RefCell<Vec<Function>> = const { RefCell::new(Vec::new()) };
}

/// A file that is read in pieces: `read(from, length)` gives a `Uint8Array`.
struct Pieces {
    reader: usize,
    size: u64,
}

impl Bytes for Pieces {
    fn size(&self) -> u64 {
        self.size
    }

    fn read_at(&self, at: u64, into: &mut [u8]) -> io::Result<usize> {
        let length = into.len().min(usize::try_from(self.size.saturating_sub(at)).unwrap_or(usize::MAX));
        let reader = READERS.with_borrow(|all| all.get(self.reader).cloned());
        let (Some(reader), Some(into)) = (reader, into.get_mut(..length).filter(|it| !it.is_empty())) else {
            return Ok(0);
        };
        let piece = reader.call2(&reader, &(at as f64).into(), &(length as f64).into());
        let piece: Option<Uint8Array> = piece.ok().and_then(|piece| piece.dyn_into().ok());
        let piece = piece.filter(|piece| piece.length() as usize == length);
        let piece =
            piece.ok_or_else(|| io::Error::other(format!("{length} bytes at {at} cannot be read")))?;
        piece.copy_to(into);
        Ok(length)
    }
}

impl Recordings {
    /// The options of the readers, with the files.
    pub(crate) fn options(&self) -> ReadOptions {
        let files = Files::given(self.files.iter().cloned());
        ReadOptions { files, dbc: self.databases.clone(), ..self.options.clone() }
    }

    /// The names of the recordings.
    pub(crate) fn names(&self) -> String {
        let names: Vec<String> = self.paths.iter().map(|path| path.display().to_string()).collect();
        names.join(", ")
    }

    fn columns(&self) -> Result<Columns, Problem> {
        let origin = Origin { recordings: self.paths.clone(), by: self.by.clone(), options: self.options() };
        origin.read().map_err(Problem::of)
    }

    /// Reads the signals of a model.
    pub(crate) fn read(&self, wanted: &[Wanted]) -> Result<Recording, Problem> {
        let recording = read(&self.paths, wanted, &self.options()).map_err(Problem::of)?;
        if let Some(cause) = recording.cause() {
            return Err(Problem::of(format!("nothing of the recording can be read: {cause}")));
        }
        let none =
            "none of the model's signals is in the recording; `source` in the model says where each is found";
        if recording.samples.is_empty() { Err(Problem::of(none)) } else { Ok(recording) }
    }

    fn add_file(&mut self, name: &str, bytes: Arc<dyn Bytes>) {
        self.files.push((PathBuf::from(name), bytes));
    }
}

#[wasm_bindgen]
impl Recordings {
    /// No files yet; `options` is a JSON object.
    ///
    /// # Errors
    /// An option that is unknown, or has no such value.
    #[wasm_bindgen(constructor)]
    pub fn new(options: &str) -> Result<Recordings, Problem> {
        let reading: Reading = serde_json::from_str(options).map_err(Problem::of)?;
        let mut read = ReadOptions { time_column: reading.time_column, ..ReadOptions::default() };
        read.time_scale = reading.time_unit.as_deref().map(parse_span).transpose().map_err(Problem::of)?;
        read.date_order = reading.date_order.as_deref().map(str::parse).transpose().map_err(Problem::of)?;
        if let Some(zone) = &reading.time_zone {
            read.zone = zone.parse().map_err(Problem::of)?;
        }
        Ok(Recordings { by: reading.by, options: read, ..Recordings::default() })
    }

    /// Reads an added file, or the added files of a folder. A name that ends in `.dbc` is a database of CAN messages.
    pub fn open(&mut self, path: &str) {
        let path = PathBuf::from(path);
        let is_database = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("dbc"));
        if is_database { self.databases.push(path) } else { self.paths.push(path) }
    }

    /// Adds a file with its bytes.
    pub fn add(&mut self, name: &str, bytes: Vec<u8>) {
        self.add_file(name, Arc::new(bytes));
    }

    /// Adds a file of this size that is read in pieces.
    pub fn add_pieces(&mut self, name: &str, size: f64, read: Function) {
        let reader = READERS.with_borrow_mut(|all| {
            all.push(read);
            all.len() - 1
        });
        self.add_file(name, Arc::new(Pieces { reader, size: size as u64 }));
    }

    /// The content of the files: what `shsa info --json` prints.
    ///
    /// # Errors
    /// When a file cannot be read at all.
    pub fn info(&self) -> Result<String, Problem> {
        let files = inventory(&self.paths, &self.options()).map_err(Problem::of)?;
        Ok(shsa_report::info::json(&files).to_string())
    }

    /// Finds what is wrong, without a model.
    ///
    /// # Errors
    /// When a file cannot be read, or nothing in it can be a signal.
    pub fn doctor(&self, progress: Option<Function>) -> Result<Doctor, Problem> {
        let told = Told::to(progress);
        Doctor::of(self.columns()?, self.names(), &told)
    }

    /// A first model, as `shsa draft` writes it without a terminal.
    ///
    /// # Errors
    /// When a file cannot be read, or nothing in it can be a signal.
    pub fn draft(&self, progress: Option<Function>) -> Result<String, Problem> {
        let told = Told::to(progress);
        let mut read = self.columns()?;
        let mut drafted = draft(&read.columns, &read.joints, &told).map_err(Problem::of)?;
        if drafted.groups.is_empty() {
            return Err(Problem::of(why_nothing(&read, &drafted)));
        }
        checked_text(&mut read, &mut drafted, &self.names()).map_err(Problem::of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_read_by_their_name() {
        let mut recordings = Recordings::new("{}").unwrap_or_default();
        recordings.add("log.csv", b"t [s],speed [m/s]\n0,1\n1,2\n".to_vec());
        recordings.open("log.csv");
        let info: serde_json::Value = serde_json::from_str(&recordings.info().unwrap()).unwrap();
        assert_eq!(info["files"][0]["file"], "log.csv");
        assert_eq!(info["topics"][0]["messages"], 2);
        assert!(Recordings::new("{\"timeZon\": 1}").is_err());
    }
}
