//! The middleware under measurement: a broker, a router, or the memory of this process. It is started here and ended when the
//! value is dropped.

use super::plain;
use anyhow::{Context, bail};
use shsa_bridge::memory::MemoryBus;
use shsa_bridge::{Address, BusOptions};
use shsa_bridge::{Bridge, Clock, Inbox};
use std::fs;
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// How long a started process may take to answer.
pub(super) const PATIENCE: Duration = Duration::from_secs(20);

/// The kind of middleware.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Kind {
    /// Within one process.
    Memory,
    /// Mosquitto.
    Mqtt,
    /// A router of Zenoh in a process of its own.
    Zenoh,
}

impl Kind {
    pub(super) fn name(self) -> &'static str {
        match self {
            Kind::Memory => "memory",
            Kind::Mqtt => "MQTT",
            Kind::Zenoh => "Zenoh",
        }
    }
}

/// A process that is killed when this is dropped.
pub(super) struct Process(pub(super) Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A running middleware.
pub(super) struct Middleware {
    pub(super) kind: Kind,
    pub(super) clock: Clock,
    pub(super) memory: MemoryBus,
    pub(super) port: u16,
    /// The folder of the broker's files and of the instance under measurement.
    pub(super) folder: PathBuf,
    server: Option<Process>,
}

impl Middleware {
    /// Starts a middleware on a free port.
    ///
    /// # Errors
    /// When the middleware is not installed, or does not start.
    pub(super) fn start(kind: Kind) -> anyhow::Result<Middleware> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("shsa-live-{}-{count}", std::process::id()));
        fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
        let clock = Clock::running();
        let memory = MemoryBus::new(clock.clone());
        let port = TcpListener::bind("127.0.0.1:0")?.local_addr()?.port();
        let mut middleware = Middleware { kind, clock, memory, port, folder, server: None };
        let server = match kind {
            Kind::Memory => None,
            Kind::Mqtt => Some(mosquitto(&middleware.folder, port)?),
            Kind::Zenoh => Some(plain::command("router", &[&port.to_string()])?),
        };
        middleware.server = server.map(Process);
        middleware.wait()?;
        Ok(middleware)
    }

    /// Waits until the server accepts connections.
    fn wait(&mut self) -> anyhow::Result<()> {
        let Some(Process(server)) = &mut self.server else { return Ok(()) };
        let end = Instant::now() + PATIENCE;
        while TcpStream::connect(("127.0.0.1", self.port)).is_err() {
            if let Some(status) = server.try_wait()? {
                bail!("the server of {} has ended: {status}", self.kind.name());
            }
            if Instant::now() > end {
                bail!("the server of {} does not listen", self.kind.name());
            }
            thread::sleep(Duration::from_millis(10));
        }
        Ok(())
    }

    /// Its address for `--bus`; `at_most_once` lowers the delivery guarantee where the transport has a choice.
    pub(super) fn address(&self, at_most_once: bool) -> String {
        match self.kind {
            Kind::Memory => "memory".to_owned(),
            Kind::Mqtt => {
                format!("mqtt://127.0.0.1:{}?session=0&qos={}", self.port, u8::from(!at_most_once))
            }
            Kind::Zenoh => format!("zenoh://127.0.0.1:{}", self.port),
        }
    }

    /// Connects under this name, with room for `queue` waiting messages a topic.
    ///
    /// # Errors
    /// When the middleware refuses.
    pub(super) fn join(
        &self,
        name: &str,
        queue: usize,
        at_most_once: bool,
    ) -> anyhow::Result<Box<dyn Bridge>> {
        let address: Address = self.address(at_most_once).parse().map_err(anyhow::Error::msg)?;
        let inbox = Inbox::new(queue, self.clock.clone());
        Ok(BusOptions::at(address).open(name, inbox, &self.memory)?)
    }

    /// The process id of the server; `None` in memory.
    pub(super) fn server(&self) -> Option<u32> {
        self.server.as_ref().map(|Process(child)| child.id())
    }
}

impl Drop for Middleware {
    fn drop(&mut self) {
        self.server = None;
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Mosquitto with a configuration of its own: nothing on disk, no limit of the queues.
fn mosquitto(folder: &Path, port: u16) -> anyhow::Result<Child> {
    // Daemons are not on everybody's path. Without `user`, Mosquitto changes its user when started as root.
    let place = "/usr/sbin/mosquitto";
    let program = if Path::new(place).exists() { place } else { "mosquitto" };
    let user = Command::new("id").arg("-un").output().context("asking for the user's name")?.stdout;
    let configuration = format!(
        "listener {port} 127.0.0.1\nuser {}\nallow_anonymous true\nset_tcp_nodelay true\nmax_queued_messages 0\n\
         max_inflight_messages 0\nlog_dest none\n",
        String::from_utf8_lossy(&user).trim()
    );
    let file = folder.join("mosquitto.conf");
    fs::write(&file, configuration).with_context(|| format!("cannot write {}", file.display()))?;
    let mut command = Command::new(program);
    command.arg("-c").arg(file).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().context("cannot start mosquitto: is it installed?")
}
