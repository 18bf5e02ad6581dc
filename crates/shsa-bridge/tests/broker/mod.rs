//! A Mosquitto for tests: its own configuration, a free port on the loopback interface, ended by its process id.

use super::real::free_port;
use shsa_bridge::mqtt::Options;
use std::fs;
use std::io::copy;
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// A running broker with a folder of its own; dropping it ends and removes both.
pub(crate) struct Broker {
    child: Option<Child>,
    port: u16,
    folder: PathBuf,
}

static COUNT: AtomicU32 = AtomicU32::new(0);

impl Broker {
    /// Starts a broker with these lines added to the usual configuration. `FOLDER` in them is the folder.
    pub(crate) fn start(lines: &[&str]) -> Broker {
        Broker::start_with(lines, |_| {})
    }

    /// As [`Broker::start`]; `prepare` first puts files into the folder.
    pub(crate) fn start_with(lines: &[&str], prepare: impl FnOnce(&Path)) -> Broker {
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("shsa-mqtt-{}-{count}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        prepare(&folder);
        let port = free_port();
        // Without this line, Mosquitto changes its user when started as root.
        let user = String::from_utf8(Command::new("id").arg("-un").output().unwrap().stdout).unwrap();
        let own = lines.join("\n").replace("FOLDER", &folder.display().to_string());
        let access = if own.contains("allow_anonymous") { "" } else { "allow_anonymous true" };
        let configuration = format!(
            "listener {port} 127.0.0.1\nuser {}\nset_tcp_nodelay true\npersistence true\npersistence_location {}/\n\
             autosave_interval 1\nautosave_on_changes true\nmax_queued_messages 0\nlog_dest none\n{access}\n{own}\n",
            user.trim(),
            folder.display(),
        );
        fs::write(folder.join("mosquitto.conf"), configuration).unwrap();
        let mut broker = Broker { child: None, port, folder };
        broker.restart();
        broker
    }

    /// Starts the broker again, with its saved state.
    pub(crate) fn restart(&mut self) {
        let mut command = Command::new(program());
        command.arg("-c").arg(self.folder.join("mosquitto.conf"));
        let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        self.child = Some(child.expect("mosquitto is there: `cargo xtask test` installs it"));
        let end = Instant::now() + super::real::PATIENCE;
        while TcpStream::connect(("127.0.0.1", self.port)).is_err() {
            assert!(Instant::now() < end, "mosquitto does not listen");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Kills the broker, as a power cut would.
    pub(crate) fn kill(&mut self) {
        if let Some(mut child) = self.child.take() {
            child.kill().unwrap();
            child.wait().unwrap();
        }
    }

    /// Ends the broker in order: it first saves everything.
    pub(crate) fn end(&mut self) {
        let id = self.child.as_ref().map(|child| child.id().to_string());
        let killed = Command::new("kill").arg(id.unwrap()).status();
        assert!(killed.unwrap().success());
        self.child.take().unwrap().wait().unwrap();
    }

    pub(crate) fn port(&self) -> u16 {
        self.port
    }

    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// The options of a client.
    pub(crate) fn options(&self, name: &str) -> Options {
        Options::parse(&format!("mqtt://127.0.0.1:{}", self.port), name).unwrap()
    }
}

impl Drop for Broker {
    fn drop(&mut self) {
        if let Some(mut child) = self.child.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Daemons are not on everybody's path.
fn program() -> &'static str {
    let place = "/usr/sbin/mosquitto";
    if Path::new(place).exists() { place } else { "mosquitto" }
}

/// A connection to a broker that can be cut silently.
pub(crate) struct Cut {
    pub(crate) port: u16,
    streams: Arc<Mutex<Vec<TcpStream>>>,
}

impl Cut {
    pub(crate) fn before(broker: u16) -> Cut {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let streams: Arc<Mutex<Vec<TcpStream>>> = Arc::default();
        let all = streams.clone();
        std::thread::spawn(move || {
            for near in listener.incoming().map_while(Result::ok) {
                let Ok(far) = TcpStream::connect(("127.0.0.1", broker)) else { continue };
                for (from, to) in [(&near, &far), (&far, &near)] {
                    let (mut from, mut to) = (from.try_clone().unwrap(), to.try_clone().unwrap());
                    std::thread::spawn(move || copy(&mut from, &mut to));
                }
                all.lock().unwrap().extend([near, far]);
            }
        });
        Cut { port, streams }
    }

    pub(crate) fn cut(&self) {
        for stream in self.streams.lock().unwrap().drain(..) {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }
}
