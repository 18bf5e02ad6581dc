//! Runs other programs, given as a command line.

use anyhow::{Context, Result, bail};
use std::io::{BufRead, BufReader};
use std::ops::ControlFlow;
use std::process::{Command, ExitStatus, Stdio};

/// Runs a command with visible output.
///
/// # Errors
/// When it cannot be started, or ends with another status than 0.
pub(crate) fn run(line: &[&str]) -> Result<()> {
    ended(line, prepare(line)?.status().with_context(|| starting(line))?)
}

/// Runs a command, passes on its standard output, and shows each line.
///
/// # Errors
/// When it cannot be started, ends with another status than 0, or prints no UTF-8.
pub(crate) fn relay(line: &[&str], mut show: impl FnMut(&str)) -> Result<()> {
    listen(line, |text| {
        println!("{text}");
        show(text);
        ControlFlow::Continue(())
    })
}

/// Runs a command, and passes on each line of its standard output at once. Kills it when `hear` breaks.
///
/// # Errors
/// When it cannot be started, ends with another status than 0, or prints no UTF-8.
pub(crate) fn listen(line: &[&str], mut hear: impl FnMut(&str) -> ControlFlow<()>) -> Result<()> {
    let mut child = prepare(line)?.stdout(Stdio::piped()).spawn().with_context(|| starting(line))?;
    let printed = child.stdout.take().context("a pipe that is not there")?;
    for text in BufReader::new(printed).lines() {
        if hear(&text.with_context(|| reading(line))?).is_break() {
            child.kill().with_context(|| format!("ending `{}`", line.join(" ")))?;
            break;
        }
    }
    ended(line, child.wait().with_context(|| reading(line))?)
}

/// Runs a command, and returns its standard output.
///
/// # Errors
/// When it cannot be started, ends with another status than 0, or prints no UTF-8.
pub(crate) fn output(line: &[&str]) -> Result<String> {
    let output = prepare(line)?.stderr(Stdio::inherit()).output().with_context(|| starting(line))?;
    ended(line, output.status)?;
    String::from_utf8(output.stdout).with_context(|| reading(line))
}

/// Whether a command exists and succeeds; prints nothing.
pub(crate) fn succeeds(line: &[&str]) -> bool {
    let Ok(mut command) = prepare(line) else { return false };
    command.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
}

fn prepare(line: &[&str]) -> Result<Command> {
    let (program, arguments) = line.split_first().context("a command without a name")?;
    let mut command = Command::new(program);
    command.args(arguments);
    Ok(command)
}

fn ended(line: &[&str], status: ExitStatus) -> Result<()> {
    if !status.success() {
        bail!("`{}` failed: {status}", line.join(" "));
    }
    Ok(())
}

fn reading(line: &[&str]) -> String {
    format!("reading the output of `{}`", line.join(" "))
}

fn starting(line: &[&str]) -> String {
    format!("starting `{}`", line.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_command_is_an_error_that_names_it() {
        let error = run(&["false", "now"]).unwrap_err();
        assert!(error.to_string().contains("`false now` failed"), "{error}");
        assert!(relay(&["false"], |_| ()).is_err());
        assert!(output(&["no-such-program-there-is"]).is_err());
        assert!(!succeeds(&["no-such-program-there-is"]));
    }

    #[test]
    fn each_line_is_shown() {
        let mut lines = Vec::new();
        relay(&["printf", "one\\ntwo\\n"], |line| lines.push(line.to_owned())).unwrap();
        assert_eq!(lines, ["one", "two"]);
    }

    #[test]
    fn a_command_is_ended_by_who_hears_enough() {
        let error = listen(&["yes"], |_| ControlFlow::Break(())).unwrap_err();
        assert!(error.to_string().contains("`yes` failed"), "{error}");
    }
}
