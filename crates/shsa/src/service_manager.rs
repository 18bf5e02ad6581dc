//! Messages to a service manager (`sd_notify(3)`): the run is ready, is alive, reads its models again.
//!
//! Without `NOTIFY_SOCKET` there is no service manager, and no messages.

use shsa_runtime::Handle;
use std::env;
use std::os::unix::net::UnixDatagram;
use std::thread;
use std::time::Duration;

/// The variable with the address of the service manager.
const SOCKET: &str = "NOTIFY_SOCKET";
/// The variable with the time after which a silent program is restarted, microseconds.
const WATCHDOG: &str = "WATCHDOG_USEC";

/// Tells that the run is ready once it answers, then twice in each watchdog time that it is alive: only a run that answers is
/// alive.
///
/// # Errors
/// When no thread can be started.
pub(crate) fn attend(handle: Handle) -> std::io::Result<()> {
    if env::var_os(SOCKET).is_none() {
        return Ok(());
    }
    let every = env::var(WATCHDOG).ok().and_then(|text| text.parse().ok()).map(|time: u64| time / 2);
    thread::Builder::new().name("watchdog".into()).spawn(move || {
        let mut state = "READY=1\nSTATUS=running";
        while handle.health().is_ok() {
            notify(state);
            state = "WATCHDOG=1";
            let Some(every) = every else { return };
            thread::sleep(Duration::from_micros(every));
        }
    })?;
    Ok(())
}

/// Sends a state; the service manager may be gone.
pub(crate) fn notify(state: &str) {
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
