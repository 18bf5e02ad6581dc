//! What a service manager is told (`sd_notify(3)`): that the run is ready, that it is alive, that it reads its models again.
//!
//! Nothing is told where nobody listens: without `NOTIFY_SOCKET`.

use shsa_runtime::Handle;
use std::env;
use std::os::unix::net::UnixDatagram;
use std::thread;
use std::time::Duration;

/// Where a service manager listens.
const SOCKET: &str = "NOTIFY_SOCKET";
/// How long it waits for a sign of life before it starts the program anew, microseconds.
const WATCHDOG: &str = "WATCHDOG_USEC";

/// Tells that the run is ready as soon as it answers, and then that it is alive, twice in the time that is waited for that: only a
/// run that answers is alive.
///
/// # Errors
/// When there can be no thread.
pub(crate) fn attend(handle: Handle) -> std::io::Result<()> {
    if env::var_os(SOCKET).is_none() {
        return Ok(());
    }
    let every = env::var(WATCHDOG).ok().and_then(|text| text.parse().ok()).map(|time: u64| time / 2);
    thread::Builder::new().name("watchdog".into()).spawn(move || {
        let mut state = "READY=1\nSTATUS=running";
        while handle.health().is_ok() {
            tell(state);
            state = "WATCHDOG=1";
            let Some(every) = every else { return };
            thread::sleep(Duration::from_micros(every));
        }
    })?;
    Ok(())
}

/// Tells a state; whoever has started us may have gone.
pub(crate) fn tell(state: &str) {
    let Some(path) = env::var_os(SOCKET) else { return };
    let _ = UnixDatagram::unbound().and_then(|socket| match path.to_string_lossy().strip_prefix('@') {
        #[cfg(target_os = "linux")]
        Some(name) => {
            use std::os::linux::net::SocketAddrExt;
            let address = std::os::unix::net::SocketAddr::from_abstract_name(name.as_bytes())?;
            socket.send_to_addr(state.as_bytes(), &address)
        }
        _ => socket.send_to(state.as_bytes(), &path),
    });
}
