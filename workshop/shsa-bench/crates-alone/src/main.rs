//! Reads all messages of some topics of a recording with the crate for its format, and prints how many seconds that takes: the
//! least of several rounds. MCAP: `mcap`; bags of ROS 2 in SQLite: `rusqlite`.
//!
//!     crates-alone-beside-shsa ROUNDS FILE_OR_FOLDER [TOPIC ..]

use std::error::Error;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The begin of data that zstd has packed.
const PACKED: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let rounds: u32 = arguments.next().ok_or("no number of rounds")?.parse()?;
    let file = only_file(Path::new(&arguments.next().ok_or("no recording")?))?;
    let topics: Vec<String> = arguments.collect();
    let read = match file.extension().and_then(|ending| ending.to_str()) {
        Some("mcap") => read_mcap,
        Some("db3") => read_db3,
        _ => return Err("no crate reads this format here".into()),
    };
    let mut least = f64::INFINITY;
    for _ in 0..rounds {
        let began = Instant::now();
        if read(&file, &topics)? == 0 {
            return Err("no message of these topics".into());
        }
        least = least.min(began.elapsed().as_secs_f64());
    }
    println!("{least}");
    Ok(())
}

/// The file, or the only recording in the folder.
fn only_file(path: &Path) -> Result<PathBuf, Box<dyn Error>> {
    if path.is_file() {
        return Ok(path.to_owned());
    }
    let entries = path.read_dir()?.filter_map(|entry| Some(entry.ok()?.path()));
    let is_bag = |path: &PathBuf| path.extension().is_some_and(|it| it == "mcap" || it == "db3");
    let mut files = entries.filter(is_bag);
    match (files.next(), files.next()) {
        (Some(file), None) => Ok(file),
        _ => Err("not one plain file".into()),
    }
}

fn is_meant(topic: &str, topics: &[String]) -> bool {
    topics.is_empty() || topics.iter().any(|it| it.trim_start_matches('/') == topic.trim_start_matches('/'))
}

/// The number of messages.
fn read_mcap(file: &Path, topics: &[String]) -> Result<usize, Box<dyn Error>> {
    let bytes = std::fs::read(file)?;
    let mut count = 0;
    for message in mcap::MessageStream::new(&bytes)? {
        let message = message?;
        if is_meant(&message.channel.topic, topics) {
            black_box(&message.data);
            count += 1;
        }
    }
    Ok(count)
}

/// The number of messages.
fn read_db3(file: &Path, topics: &[String]) -> Result<usize, Box<dyn Error>> {
    let base = rusqlite::Connection::open_with_flags(file, rusqlite::OpenFlags::SQLITE_OPEN_READ_ONLY)?;
    let mut names = base.prepare("select id, name from topics")?;
    let named = names.query_map([], |row| Ok((row.get::<_, i64>(0)?, row.get::<_, String>(1)?)))?;
    let mut wanted = Vec::new();
    for topic in named {
        let (id, name) = topic?;
        if is_meant(&name, topics) {
            wanted.push(id);
        }
    }
    let mut messages = base.prepare("select topic_id, timestamp, data from messages order by timestamp")?;
    let mut rows = messages.query([])?;
    let mut count = 0;
    while let Some(row) = rows.next()? {
        if wanted.contains(&row.get(0)?) {
            let (time, data): (i64, &[u8]) = (row.get(1)?, row.get_ref(2)?.as_blob()?);
            if data.starts_with(&PACKED) {
                return Err("the messages are packed".into());
            }
            black_box((time, data));
            count += 1;
        }
    }
    Ok(count)
}
