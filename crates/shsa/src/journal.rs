//! `shsa journal`: whether the journal of a run is as it was written.

use crate::outcome::Outcome;
use anyhow::Context;
use clap::Subcommand;
use serde_json::{Value, json};
use shsa_format::journal::examination::{Examined, Place, Problem, Verification, examine, verify};
use shsa_runtime::PublicKey;
use std::fs::File;
use std::io::{BufReader, Write, stdout};
use std::path::{Path, PathBuf};

/// Arguments of `shsa journal`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa journal verify --key public.pem journal/model.*")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

/// What is done with journals.
#[derive(Subcommand)]
enum Command {
    /// Find the first record of a sealed journal that is not as it was written.
    Verify(VerifyArguments),
}

/// Arguments of `shsa journal verify`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa journal verify --key public.pem journal/model.*

Exit status: 0 all is as it was written; 1 the first record that is not was found; 3 it is, but the last record was cut off, as by a
power cut, or nothing is signed after some record.
A journal is sealed by `shsa run --journal FOLDER --journal-seal`, and signed by --journal-key. That whole records are missing at its
very end shows only where it is signed, or where a later file goes on after them.")]
struct VerifyArguments {
    /// All files of one journal, or some that follow each other; in any order.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// A file with the public key of those who may have signed, as `openssl pkey -pubout` writes it; may be given several times.
    /// Without one, signatures are not looked at.
    #[arg(long, value_name = "FILE")]
    key: Vec<PathBuf>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command that was given.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let Command::Verify(arguments) = &arguments.command;
    let keys: Vec<_> = arguments.key.iter().map(|key| PublicKey::read(key)).collect::<Result<_, _>>()?;
    let examined: Vec<_> =
        arguments.files.iter().map(|file| examined(file, &keys)).collect::<anyhow::Result<_>>()?;
    let found = verify(&examined);
    let answer = Answer { arguments, examined: &examined, found: &found };
    let mut output = stdout().lock();
    match arguments.json {
        true => writeln!(output, "{}", answer.json())?,
        false => output.write_all(answer.text().as_bytes())?,
    }
    Ok(answer.outcome())
}

fn examined(path: &Path, keys: &[PublicKey]) -> anyhow::Result<Examined> {
    let file = File::open(path).with_context(|| format!("cannot open {}", path.display()))?;
    let is_signed =
        |bytes: &[u8], signature: &[u8; 64]| keys.iter().any(|key| key.verifies(bytes, signature));
    examine(BufReader::new(file), (!keys.is_empty()).then_some(&is_signed))
        .with_context(|| format!("cannot read {}", path.display()))
}

/// What is told of a journal.
struct Answer<'a> {
    arguments: &'a VerifyArguments,
    examined: &'a [Examined],
    found: &'a Verification,
}

impl Answer<'_> {
    /// The records that no key speaks for; `None`: no key was given.
    fn unsigned(&self) -> Option<u64> {
        (!self.arguments.key.is_empty()).then_some(self.found.unsigned)
    }

    fn outcome(&self) -> Outcome {
        match (&self.found.finding, self.found.cuts.is_empty(), self.unsigned().unwrap_or(0)) {
            (Some(_), ..) => Outcome::No,
            (None, true, 0) => Outcome::Done,
            (None, ..) => Outcome::Degraded,
        }
    }

    fn name(&self, file: usize) -> String {
        self.arguments.files.get(file).map_or(String::new(), |path| path.display().to_string())
    }

    /// The numbers of the first and the last file.
    fn numbers(&self) -> Option<(u64, u64)> {
        let mut numbers = self.found.order.iter().filter_map(|at| self.examined.get(*at)?.number);
        let first = numbers.next()?;
        Some((first, numbers.next_back().unwrap_or(first)))
    }

    fn text(&self) -> String {
        let Verification { finding, cuts, records, end, .. } = self.found;
        let place =
            |file: usize, Place { line, offset }: Place| format!("{}:{line}, byte {offset}", self.name(file));
        let mut text = String::new();
        for (file, at) in cuts {
            text += &format!("{}: the record was cut off, as by a power cut\n", place(*file, *at));
        }
        let are = if *records == 1 { "1 record is" } else { &format!("{records} records are") };
        if let Some((file, at, problem)) = finding {
            text += &format!("{}: {problem}\n{are} as written before it\n", place(*file, *at));
            return text;
        }
        let files = match self.numbers() {
            Some((first, last)) if first < last => format!("files {first} to {last}"),
            Some((only, _)) => format!("file {only}"),
            None => "no file".to_owned(),
        };
        text += &format!("{are} as written: {files}, up to the seal {end}\n");
        text += &match self.unsigned() {
            None => String::new(),
            Some(0) => "all of it is signed\n".to_owned(),
            Some(unsigned) => format!("the last {unsigned} of them are not signed\n"),
        };
        text
    }

    fn json(&self) -> Value {
        let Verification { finding, cuts, records, end, .. } = self.found;
        let place =
            |file: usize, at: Place| json!({ "file": self.name(file), "line": at.line, "offset": at.offset });
        let finding = finding.as_ref().map(|(file, at, problem): &(usize, Place, Problem)| {
            let mut finding = place(*file, *at);
            finding["because"] = json!(problem.to_string());
            finding
        });
        json!({
            "ok": self.outcome() == Outcome::Done,
            "records": records,
            "files": self.numbers().map(|(first, last)| json!([first, last])),
            "finding": finding,
            "cut_off": cuts.iter().map(|(file, at)| place(*file, *at)).collect::<Vec<_>>(),
            "unsigned": self.unsigned(),
            "seal": end.to_string(),
        })
    }
}
