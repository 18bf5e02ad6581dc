//! Pictures of the live page, of all its views at three widths, light and dark, to be looked at.

use crate::{command, needs};
use anyhow::{Context, Result, ensure};
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

/// Where they are written.
const FOLDER: &str = "target/screenshots";

/// A run of the simulated robot; it ends with this value.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Takes them of a run of the simulated robot, once its lidar has broken.
///
/// # Errors
/// When something is absent, or the page is not as it should be.
pub(crate) fn take() -> Result<()> {
    needs::provide_for_tests()?;
    command::run(&["cargo", "build", "--locked", "-p", "shsa"])?;
    let mut run = Command::new("target/debug/shsa");
    run.args(["run", "--http", "127.0.0.1:0"]).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut running = Running(run.spawn().context("starting a run")?);
    let notes = BufReader::new(running.0.stderr.take().context("a pipe")?);
    let mut addresses = notes.lines().map_while(Result::ok).filter_map(|note| {
        let (_, rest) = note.split_once("http://")?;
        Some(rest.trim_end_matches("/state").to_owned())
    });
    let address = addresses.next().context("the run did not say where its page is")?;
    let order = format!(r#"{{"address": "{address}", "screenshots": "{FOLDER}"}}"#);
    let mut look = Command::new("target/python/bin/python");
    let status = look.args(["crates/shsa/tests/python/page.py", &order]).stdout(Stdio::null()).status()?;
    ensure!(status.success(), "the page is not as it should be");
    println!("the screenshots are in {FOLDER}");
    Ok(())
}
