//! `shsa top`: a running instance in the terminal.

use crate::real::free_port;
use crate::running::{Folder, Running};
use std::os::unix::fs::PermissionsExt;
use std::process::{Command, Output};

const VIEW: &str = "a-token-for-looking-only";

fn top(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_shsa")).arg("top").args(arguments).output().unwrap()
}

fn stated(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

#[test]
fn needs_signals_and_decisions_of_a_running_instance() {
    let run = Running::start(["--name", "robot"]);
    // The simulated lidar breaks.
    run.decision("substituted");
    let reported = top(&[run.address(), "--once"]);
    let stated = stated(&reported);
    assert_eq!(reported.status.code(), Some(0), "{stated}");
    let lines: Vec<&str> = stated.lines().collect();
    assert!(lines[0].starts_with("robot (shsa "), "{stated}");
    let need = lines.iter().find(|line| line.starts_with("/emergency_stop/dmin")).expect(&stated);
    assert!(need.contains(" m ") && need.contains(" by nearest"), "{stated}");
    for head in ["need ", "signal ", "decided at "] {
        assert!(lines.iter().any(|line| line.starts_with(head)), "no {head} in {stated}");
    }
    assert!(lines.iter().any(|line| line.contains("substituted  v_dmin")), "{stated}");
}

#[test]
fn who_may_not_look_and_who_is_not_there() {
    let folder = Folder::new();
    let file = folder.path("view");
    std::fs::write(&file, VIEW).unwrap();
    std::fs::set_permissions(&file, PermissionsExt::from_mode(0o640)).unwrap();
    let file = file.to_str().unwrap();
    let run = Running::start(["--view-token-file", file]);
    let refused = top(&[run.address()]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(stated(&refused).contains("--view-token-file or SHSA_VIEW_TOKEN"), "{}", stated(&refused));
    let reported = top(&[run.address(), "--view-token-file", file]);
    assert_eq!(reported.status.code(), Some(0), "{}", stated(&reported));

    let nobody = top(&[&format!("127.0.0.1:{}", free_port())]);
    assert_eq!(nobody.status.code(), Some(4));
    assert!(stated(&nobody).contains("no instance can be reached"), "{}", stated(&nobody));
}
