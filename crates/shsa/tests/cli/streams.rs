//! Where output goes: pipes, closed readers, no terminal.

use crate::tank;
use std::io::{BufRead, BufReader, Read};
use std::process::Stdio;

const COMMANDS: [&str; 6] = [
    "check tank.yaml",
    "check bad.yaml",
    "plan tank.yaml level --all",
    "replay tank.yaml run.csv --compare level",
    "replay tank.yaml run.csv --inject drop:/volume@90s..",
    "replay bad.yaml run.csv",
];

#[test]
fn no_colour_where_there_is_no_terminal() {
    let folder = tank::folder();
    folder.write("bad.yaml", "shsa: 1\nvariables: { x: { unti: m } }\n");
    for command in COMMANDS {
        let ended = folder.run(command);
        assert!(!format!("{}{}", ended.stdout, ended.stderr).contains('\x1b'), "{command}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn colour_on_a_terminal_unless_it_is_not_wanted() {
    use std::io::Write;
    let folder = tank::folder();
    let shown = |settings: &str| {
        let line = format!("{settings} {} replay tank.yaml run.csv", env!("CARGO_BIN_EXE_shsa"));
        let mut script = std::process::Command::new("script");
        let output = script
            .args(["-qec", &line, "/dev/null"])
            .current_dir(folder.path(""))
            .stdin(Stdio::null())
            .output();
        output.map(|output| String::from_utf8_lossy(&output.stdout).into_owned())
    };
    match shown("env -u NO_COLOR") {
        Err(error) => drop(writeln!(std::io::stderr(), "SKIPPED: no `script` to make a terminal: {error}")),
        Ok(coloured) => {
            assert!(coloured.contains("\x1b[31mfailed"), "{coloured}");
            let plain = shown("env NO_COLOR=1").unwrap();
            assert!(plain.contains("failed") && !plain.contains("\x1b[3"), "{plain}");
        }
    }
}

#[test]
fn a_reader_that_stops_is_no_error() {
    let folder = tank::folder();
    let long = ["replay tank.yaml run.csv --compare level --json --period 1ms", "completions bash"];
    for command in long {
        let mut child =
            folder.command(command).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::with_capacity(16, child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let mut reported = String::new();
        child.stderr.take().unwrap().read_to_string(&mut reported).unwrap();
        let status = child.wait().unwrap();
        assert!(!line.is_empty());
        assert_eq!((reported.as_str(), status.code()), ("", Some(0)), "{command}");
    }
}

/// Nobody reads the error messages either.
#[test]
fn a_closed_standard_error_is_no_panic() {
    let folder = tank::folder();
    folder.write("bad.yaml", "shsa: 1\nvariables: { x: { unti: m } }\n");
    for (command, status) in
        [("replay bad.yaml run.csv", 2), ("plan tank.yaml levl", 2), ("plan tank.yaml level", 0)]
    {
        let mut child = folder.command(command).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stderr.take());
        assert_eq!(child.wait().unwrap().code(), Some(status), "{command}");
    }
}

#[test]
fn models_come_through_pipes_too() {
    use std::io::Write;
    if !cfg!(unix) {
        return;
    }
    let folder = tank::folder();
    let mut command = folder.command("check /dev/stdin --json");
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(tank::MODEL.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8(output.stdout).unwrap().starts_with(r#"{"ok":true"#));
}
