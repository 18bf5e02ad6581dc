//! The programs of the rover as processes, and `shsa run` beside them.

use anyhow::{Context, bail};
use serde_json::Value;
use shsa_demos::rover::process::Part;
use shsa_demos::rover::{Encoding, model};
use std::env;
use std::ffi::OsString;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

/// The programs that run all the time.
pub(super) const PARTS: [Part; 7] =
    [Part::World, Part::Lidar, Part::Sonar, Part::Depth, Part::Odometry, Part::Stop, Part::Teleoperation];
/// The others.
const GUESTS: [Part; 2] = [Part::LidarAlone, Part::Attacker];

/// The names of the options that concern neither the bus nor a part.
const OWN: [&str; 4] = ["rover", "--brisk", "--json", "--without-shsa"];

/// The name of a part on the command line.
pub(super) fn named(part: Part) -> &'static str {
    match part {
        Part::World => "world",
        Part::Lidar => "lidar",
        Part::Sonar => "sonar",
        Part::Depth => "depth",
        Part::Odometry => "odometry",
        Part::Stop => "stop",
        Part::Teleoperation => "teleoperation",
        Part::LidarAlone => "lidar-alone",
        Part::Attacker => "attacker",
    }
}

/// The part of a name.
pub(super) fn part_of(name: &str) -> Option<Part> {
    PARTS.into_iter().chain(GUESTS).find(|part| named(*part) == name)
}

/// The path of `shsa`: from the environment variable `SHSA`, else beside this program.
fn shsa() -> anyhow::Result<PathBuf> {
    let beside = || Ok(env::current_exe()?.with_file_name("shsa"));
    let program = env::var_os("SHSA").map(PathBuf::from).map_or_else(beside, anyhow::Ok)?;
    if !program.exists() {
        bail!("{} is absent: build it (cargo build -p shsa), or name it in SHSA", program.display());
    }
    Ok(program)
}

/// A running program; it is killed when this is dropped.
pub(super) struct Program {
    /// `None`: `shsa run`.
    pub(super) part: Option<Part>,
    child: Child,
}

impl Drop for Program {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The options of the bus, as they were given.
fn bus_options() -> Vec<OsString> {
    let mut given = env::args_os().skip(1).filter(|it| OWN.iter().all(|own| it != own));
    let mut options = Vec::new();
    while let Some(option) = given.next() {
        if option == "--seed" {
            given.next();
        } else if !option.to_string_lossy().starts_with("--seed=") {
            options.push(option);
        }
    }
    options
}

/// Starts a part.
///
/// # Errors
/// When the system refuses.
pub(super) fn start(part: Part, seed: u64) -> anyhow::Result<Program> {
    let mut command = Command::new(env::current_exe()?);
    command.args(["rover", "--part", named(part), "--seed", &seed.to_string()]).args(bus_options());
    let child = command.stdin(Stdio::null()).stdout(Stdio::null()).spawn();
    Ok(Program { part: Some(part), child: child.with_context(|| format!("starting {}", named(part)))? })
}

/// Starts `shsa run`; its decisions come one by one. In JSON the values of the need have their bounds; in ROS 2 they are numbers, as
/// nodes read them.
///
/// # Errors
/// When the system refuses.
pub(super) fn heal(encoding: Encoding) -> anyhow::Result<(Program, Receiver<Value>)> {
    let file = env::temp_dir().join(format!("shsa-demos-{}", std::process::id()));
    fs::create_dir_all(&file)?;
    let file = file.join("rover.yaml");
    fs::write(&file, model(encoding)).with_context(|| format!("cannot write {}", file.display()))?;
    let form = if encoding == Encoding::Json { "json" } else { "plain" };
    let mut command = Command::new(shsa()?);
    command
        .arg("run")
        .arg(&file)
        .args(["--json", "--form", form, "--http", "127.0.0.1:0"])
        .args(bus_options());
    let mut child =
        command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().context("starting shsa run")?;
    let lines = BufReader::new(child.stdout.take().context("a pipe that is not there")?);
    let (sender, receiver) = channel();
    thread::Builder::new().name("decisions".into()).spawn(move || {
        let decisions =
            lines.lines().map_while(Result::ok).filter_map(|line| serde_json::from_str(&line).ok());
        for decision in decisions {
            if sender.send(decision).is_err() {
                return;
            }
        }
    })?;
    Ok((Program { part: None, child }, receiver))
}
