//! Substitutes in processes of their own: the arguments.

use shsa_core::time::Span;
use shsa_message::span::parse_span;
use shsa_runtime::SandboxOptions;
use std::ffi::OsString;
use std::path::PathBuf;

/// Where substitutes are computed, where the model does not say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Place {
    /// Within the run.
    Engine,
    /// Each in a process of its own.
    Process,
}

/// The arguments about processes that compute.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Isolation")]
pub(super) struct IsolationArguments {
    /// Where substitutes are computed: `engine`, within the run, or `process`, each in a process of its own; a need may ask for a
    /// process itself (`isolation: process`).
    #[arg(long, value_name = "PLACE", default_value = "engine", hide_possible_values = true)]
    isolation: Place,
    /// The memory that a process may take, MiB.
    #[arg(long, value_name = "MIB", default_value_t = 64)]
    isolation_memory: u64,
    /// The share of a processor that a process may use, percent.
    #[arg(long, value_name = "PERCENT", default_value_t = 50, value_parser = clap::value_parser!(u8).range(1..=100))]
    isolation_cpu: u8,
    /// How long an answer may take; else a period of the fastest input, at most half of the need's greatest age.
    #[arg(long, value_name = "TIME", value_parser = parse_span)]
    isolation_time: Option<Span>,
}

impl IsolationArguments {
    /// What the run is given.
    ///
    /// # Errors
    /// When the path of this program cannot be found.
    pub(super) fn options(&self) -> anyhow::Result<SandboxOptions> {
        Ok(SandboxOptions {
            is_for_all: self.isolation == Place::Process,
            program: vec![own_program()?.into(), OsString::from("substitute")],
            memory: self.isolation_memory << 20,
            share: f64::from(self.isolation_cpu) / 100.0,
            time: self.isolation_time,
        })
    }
}

/// This program, even if its file was replaced meanwhile.
fn own_program() -> std::io::Result<PathBuf> {
    if cfg!(target_os = "linux") { Ok("/proc/self/exe".into()) } else { std::env::current_exe() }
}
