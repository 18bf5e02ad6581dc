//! A test in a network of its own, with nothing but a loopback interface: what it says reaches no other test and no other machine.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output};

/// Set in the process that runs a test inside.
const INSIDE: &str = "SHSA_TEST_NETWORK";
/// The status of a machine that grants no network.
const REFUSED: i32 = 97;
/// No test takes longer, seconds.
const LONGEST: &str = "180";

/// Whether the network's loopback interface carries multicast; it does not by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Multicast {
    On,
    Off,
}

/// Runs a test in a network of its own: this program is started there for this test only. `test` is the name of the test.
#[track_caller]
pub(crate) fn alone(test: &str, multicast: Multicast, body: impl FnOnce()) {
    alone_with(test, multicast, &[], body);
}

/// As [`alone`], with more variables of the environment.
#[track_caller]
pub(crate) fn alone_with(test: &str, multicast: Multicast, variables: &[(&str, &str)], body: impl FnOnce()) {
    if std::env::var_os(INSIDE).is_some() {
        return body();
    }
    let outcome = [&["--net"][..], &["--net", "--user", "--map-root-user"]]
        .iter()
        .map(|rights| start(rights, test, multicast, variables))
        .find(|outcome| outcome.as_ref().is_ok_and(|output| output.status.code() != Some(REFUSED)));
    let mut error = std::io::stderr();
    let Some(Ok(output)) = outcome else {
        let _ = writeln!(error, "SKIPPED: {test}: no network namespace (unshare, ip) on this machine");
        return;
    };
    let (said, complained) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    complained.lines().filter(|line| line.contains("SKIPPED")).for_each(|line| {
        let _ = writeln!(error, "{line}");
    });
    assert!(output.status.success(), "{test}: {}\n{said}\n{complained}", output.status);
    assert!(said.contains("1 passed"), "no test of the name {test}: {said}");
    // Figures that the test states.
    eprint!("{complained}");
}

/// Runs this program in a new network.
fn start(
    rights: &[&str],
    test: &str,
    multicast: Multicast,
    variables: &[(&str, &str)],
) -> std::io::Result<Output> {
    let multicast = match multicast {
        Multicast::On => "ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo",
        Multicast::Off => "ip link set lo multicast off",
    };
    let script = format!(
        "PATH=$PATH:/usr/sbin:/sbin; ip link set lo up && {multicast} || exit {REFUSED}; exec \"$0\" \"$@\""
    );
    let program = std::env::current_exe()?;
    let timeout = ["-k", "5", LONGEST, "unshare"];
    let mut command = Command::new("timeout");
    command.args(timeout).args(rights).args(["--", "sh", "-c", &script]).arg(Path::new(&program));
    command.args(["--exact", test, "--nocapture", "--test-threads", "1"]).env(INSIDE, "1");
    command.envs(variables.iter().copied());
    let output = command.output()?;
    // `unshare` itself ends by 1 where it may not.
    let is_refused = output.status.code() == Some(1) && output.stdout.is_empty();
    if is_refused { Err(std::io::Error::other("refused")) } else { Ok(output) }
}
