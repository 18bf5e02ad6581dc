//! The options of a Zenoh connection: from an address or from a Zenoh configuration file, with every service off by default.

use crate::{BridgeError, Channel};
use ::zenoh::Config;
use serde_json::{Value, json};
use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

/// The role of a session in its network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Connects to several others, and lets others connect.
    Peer,
    /// Connects to one router at a time.
    Client,
}

impl Mode {
    /// Its name in Zenoh's configuration.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Mode::Peer => "peer",
            Mode::Client => "client",
        }
    }
}

/// A secret. It is not printed.
#[derive(Clone, PartialEq, Eq)]
pub struct Secret(pub String);

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("(secret)")
    }
}

/// How to reach a Zenoh network.
///
/// These settings override the file. Addresses are Zenoh's endpoints: `tcp/127.0.0.1:7447`, `tls/router.local:7447`,
/// `unixsock-stream//run/zenoh.sock`. Nothing listens and nothing scouts by multicast unless set: Zenoh's own defaults (all
/// interfaces, multicast on) are not used, not even if the file lists them for listening.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// `None`: from the file, else peer.
    pub mode: Option<Mode>,
    /// Endpoints to connect to; empty: those of the file.
    pub connect: Vec<String>,
    /// Endpoints to listen on; empty: those of the file.
    pub listen: Vec<String>,
    /// A configuration file of Zenoh (JSON5 or YAML, by its extension).
    pub config: Option<PathBuf>,
    /// The certificate of the authority that must have signed others' certificates (PEM).
    pub ca: Option<PathBuf>,
    /// Our certificate and its key (PEM), for listening and for others that ask for them.
    pub identity: Option<(PathBuf, PathBuf)>,
    /// User and password, for routers that ask for them.
    pub user: Option<(String, Secret)>,
    /// Others give us up after this long without a sign of life; each side sets its own.
    pub lease: Duration,
    /// The largest message that is received, bytes.
    pub message_max: usize,
    /// How long opening waits for the network; attempts go on in the background.
    pub patience: Duration,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            mode: None,
            connect: Vec::new(),
            listen: Vec::new(),
            config: None,
            ca: None,
            identity: None,
            user: None,
            lease: Duration::from_secs(4),
            message_max: 64 << 20,
            patience: Duration::from_secs(2),
        }
    }
}

/// A configuration of Zenoh, and the facts that we need of it.
#[derive(Clone)]
pub(super) struct Settings {
    pub(super) config: Config,
    pub(super) mode: Mode,
    /// The endpoints to connect to.
    pub(super) connect: Vec<String>,
    pub(super) channel: Channel,
}

/// Without the configuration, which holds passwords.
impl fmt::Debug for Settings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} to {:?}", self.mode.name(), self.connect)
    }
}

impl Options {
    /// Connects to one endpoint.
    #[must_use]
    pub fn to(endpoint: &str) -> Options {
        Options { connect: vec![endpoint.to_owned()], ..Options::default() }
    }

    /// The settings to open Zenoh with.
    ///
    /// # Errors
    /// When the file cannot be read, an endpoint is invalid, or there is no endpoint to connect to or to listen on.
    pub(super) fn settings(&self) -> Result<Settings, BridgeError> {
        let mut config = self.file()?;
        let from_file = config.get_json("mode").ok().filter(|mode| mode.contains("client"));
        let mode = self.mode.unwrap_or(if from_file.is_some() { Mode::Client } else { Mode::Peer });
        if config.get_json("mode").is_ok_and(|mode| mode.contains("router")) && self.mode.is_none() {
            return Err(wrong("mode: a router is a program of its own; use peer or client".into()));
        }
        set(&mut config, "mode", &json!(mode.name()))?;
        self.set_endpoints(&mut config)?;
        self.set_security(&mut config)?;
        set_defaults(&mut config, self)?;
        let connect = endpoints(&config, "connect/endpoints", mode);
        let listen = endpoints(&config, "listen/endpoints", mode);
        let alone = listen.is_empty() && !scouts(&config);
        if connect.is_empty() && (alone || mode == Mode::Client && !scouts(&config)) {
            return Err(wrong("nothing to connect to: name an endpoint, such as tcp/127.0.0.1:7447".into()));
        }
        let channel = channel(&config, connect.iter().chain(&listen));
        Ok(Settings { config, mode, connect, channel })
    }

    fn file(&self) -> Result<Config, BridgeError> {
        let Some(path) = &self.config else { return Ok(Config::default()) };
        let config = Config::from_file(path);
        config.map_err(|problem| wrong(format!("{}: {}", path.display(), first_line(&problem.to_string()))))
    }

    fn set_endpoints(&self, config: &mut Config) -> Result<(), BridgeError> {
        let of_zenoh = Config::default().get_json("listen/endpoints").ok();
        if !self.listen.is_empty() {
            self.listen.iter().try_for_each(|endpoint| check_endpoint(endpoint))?;
            set(config, "listen/endpoints", &json!(self.listen))?;
        } else if config.get_json("listen/endpoints").ok() == of_zenoh {
            set(config, "listen/endpoints", &json!([]))?;
        }
        if !self.connect.is_empty() {
            self.connect.iter().try_for_each(|endpoint| check_endpoint(endpoint))?;
            set(config, "connect/endpoints", &json!(self.connect))?;
        }
        Ok(())
    }

    fn set_security(&self, config: &mut Config) -> Result<(), BridgeError> {
        let tls = "transport/link/tls";
        if let Some(ca) = &self.ca {
            set(config, &format!("{tls}/root_ca_certificate"), &json!(readable(ca)?))?;
        }
        if let Some((certificate, key)) = &self.identity {
            let (certificate, key) = (json!(readable(certificate)?), json!(readable(key)?));
            for side in ["connect", "listen"] {
                set(config, &format!("{tls}/{side}_certificate"), &certificate)?;
                set(config, &format!("{tls}/{side}_private_key"), &key)?;
            }
            // With a certificate and an authority, others must show their certificates, too.
            set(config, &format!("{tls}/enable_mtls"), &json!(self.ca.is_some()))?;
        }
        if let Some((user, Secret(password))) = &self.user {
            set(config, "transport/auth/usrpwd/user", &json!(user))?;
            set(config, "transport/auth/usrpwd/password", &json!(password))?;
        }
        Ok(())
    }
}

/// Sets safe values with a quick recovery, unless the file sets its own.
fn set_defaults(config: &mut Config, options: &Options) -> Result<(), BridgeError> {
    if config.get_json("scouting/multicast/enabled").is_ok_and(|enabled| enabled == "null") {
        set(config, "scouting/multicast/enabled", &json!(false))?;
    }
    let of_zenoh = Config::default();
    let milliseconds = u64::try_from(options.lease.as_millis()).unwrap_or(u64::MAX);
    for (key, value) in [
        ("transport/link/tx/lease", json!(milliseconds.max(100))),
        ("transport/link/rx/max_message_size", json!(options.message_max)),
        // The largest size: 1 MiB waits for a consumer that reads in bursts.
        ("transport/link/tx/queue/size/real_time", json!(16)),
        // A consumer that does not read delays us once, for this long; then its messages are dropped until it reads again.
        ("transport/link/tx/queue/congestion_control/drop/wait_before_drop", json!(10_000)),
        ("transport/link/tx/queue/congestion_control/drop/max_wait_before_drop_fragments", json!(2_000_000)),
        // The pause between two attempts to connect.
        (
            "connect/retry",
            json!({ "period_init_ms": 100, "period_max_ms": 2000, "period_increase_factor": 2 }),
        ),
    ] {
        if config.get_json(key).ok() == of_zenoh.get_json(key).ok() {
            set(config, key, &value)?;
        }
    }
    // One attempt in the foreground. Further attempts are our own, because Zenoh's would block forever.
    set(config, "connect/timeout_ms", &json!({ "client": 0, "peer": -1, "router": -1 }))?;
    set(config, "connect/exit_on_failure", &json!({ "client": true, "peer": false, "router": false }))
}

/// The endpoints in Zenoh's configuration under a key; some keys have a value for each mode.
fn endpoints(config: &Config, key: &str, mode: Mode) -> Vec<String> {
    let value = config.get_json(key).ok().and_then(|text| serde_json::from_str::<Value>(&text).ok());
    let value = value.unwrap_or_default();
    let list = if value.is_object() { value.get(mode.name()).cloned().unwrap_or_default() } else { value };
    let texts = list.as_array().into_iter().flatten().filter_map(Value::as_str);
    texts.map(str::to_owned).collect()
}

/// What protects messages between these endpoints. Others that scouting finds may be reached by any transport; a local socket does not
/// leave the machine.
fn channel<'a>(config: &Config, mut endpoints: impl Iterator<Item = &'a String>) -> Channel {
    let is_set = |key: &str| config.get_json(key).is_ok_and(|value| !matches!(&*value, "null" | "false"));
    let is_private =
        |endpoint: &String| endpoint.starts_with("tls/") || endpoint.starts_with("unixsock-stream/");
    let encrypted = !scouts(config) && endpoints.all(is_private);
    let shows_certificate = encrypted && is_set("transport/link/tls/connect_certificate");
    Channel { encrypted, authenticated: is_set("transport/auth/usrpwd/user") || shows_certificate }
}

fn scouts(config: &Config) -> bool {
    config.get_json("scouting/multicast/enabled").is_ok_and(|enabled| enabled == "true")
}

pub(super) fn set(config: &mut Config, key: &str, value: &Value) -> Result<(), BridgeError> {
    let set = config.insert_json5(key, &value.to_string());
    set.map_err(|problem| wrong(format!("{key}: {}", first_line(&problem.to_string()))))
}

fn check_endpoint(endpoint: &str) -> Result<(), BridgeError> {
    let transports = ["tcp", "tls", "unixsock-stream"];
    let help = "write it like tcp/127.0.0.1:7447";
    match endpoint.split_once('/') {
        Some((transport, address)) if transports.contains(&transport) && !address.is_empty() => Ok(()),
        Some((transport, _)) if !transports.contains(&transport) => Err(wrong(format!(
            "endpoint '{endpoint}': no transport '{transport}' (there is: {}); {help}",
            transports.join(", ")
        ))),
        _ => Err(wrong(format!("endpoint '{endpoint}' has no address; {help}"))),
    }
}

/// The path as text, if the file can be read: Zenoh's own message does not name the file.
fn readable(path: &std::path::Path) -> Result<String, BridgeError> {
    std::fs::File::open(path).map_err(|problem| wrong(format!("{}: {problem}", path.display())))?;
    Ok(path.display().to_string())
}

fn wrong(problem: String) -> BridgeError {
    BridgeError::Configuration(problem)
}

/// Cuts off the places in Zenoh's source that follow its errors.
pub(super) fn first_line(text: &str) -> String {
    let line = text.lines().next().unwrap_or_default();
    // Cuts off the state of a link, too.
    let line = line.split(" at /").next().unwrap_or(line);
    line.split(" on: TransportLink").next().unwrap_or(line).trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(name: &str, text: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("shsa-zenoh-{}-{name}", std::process::id()));
        std::fs::write(&path, text).unwrap();
        path
    }

    /// Mode, what is listened on, whether it scouts, what it connects to.
    fn shown(options: &Options) -> String {
        match options.settings() {
            Ok(Settings { config, mode, connect, .. }) => {
                let listen = endpoints(&config, "listen/endpoints", mode);
                format!("{} {listen:?} {} {connect:?}", mode.name(), scouts(&config))
            }
            Err(problem) => problem.to_string(),
        }
    }

    #[test]
    fn nothing_listens_and_nothing_scouts_unless_told_to() {
        let router = "tcp/127.0.0.1:7447";
        assert_eq!(shown(&Options::to(router)), r#"peer [] false ["tcp/127.0.0.1:7447"]"#);
        let listening = Options { listen: vec![router.into()], ..Options::default() };
        assert_eq!(shown(&listening), r#"peer ["tcp/127.0.0.1:7447"] false []"#);
        let client = Options { mode: Some(Mode::Client), ..Options::to(router) };
        assert_eq!(shown(&client), r#"client [] false ["tcp/127.0.0.1:7447"]"#);
    }

    #[test]
    fn a_file_of_zenoh_says_the_rest() {
        let of = |name, text| Options { config: Some(file(name, text)), ..Options::default() };
        let path =
            of("a.json5", "{ mode: 'client', connect: { endpoints: ['tcp/10.0.0.1:7447'] } /* yes */ }");
        assert_eq!(shown(&path), r#"client [] false ["tcp/10.0.0.1:7447"]"#);
        let scouting = of("b.json5", "{ scouting: { multicast: { enabled: true } } }");
        assert_eq!(shown(&scouting), "peer [] true []");
        let listening = of("c.yaml", "listen:\n  endpoints: [tcp/10.0.0.1:7447]\n");
        assert_eq!(shown(&listening), r#"peer ["tcp/10.0.0.1:7447"] false []"#);
        let spelled =
            of("d.json5", "{ listen: { endpoints: { router: ['tcp/[::]:7447'], peer: ['tcp/[::]:0'] } } }");
        assert!(shown(&spelled).starts_with("nothing to connect to"), "{}", shown(&spelled));
        let wins = Options { connect: vec!["tcp/1.1.1.1:1".into()], mode: Some(Mode::Peer), ..path };
        assert_eq!(shown(&wins), r#"peer [] false ["tcp/1.1.1.1:1"]"#);
    }

    #[test]
    fn what_cannot_be_used_is_said() {
        let check = |options: Options, expected: &str| {
            let shown = shown(&options);
            assert!(shown.contains(expected), "{shown}");
        };
        check(Options::default(), "nothing to connect to: name an endpoint, such as tcp/127.0.0.1:7447");
        check(Options::to("localhost:7447"), "endpoint 'localhost:7447' has no address; write it like");
        check(Options::to("udp/a:1"), "no transport 'udp' (there is: tcp, tls, unixsock-stream)");
        let absent = Options { config: Some("absent.json5".into()), ..Options::default() };
        check(absent, "absent.json5: ");
        let broken = Options { config: Some(file("e.json5", "{ mode: ")), ..Options::default() };
        check(broken, "e.json5: ");
        let router =
            Options { config: Some(file("f.json5", "{ mode: 'router' }")), ..Options::to("tcp/a:1") };
        check(router, "a router is a program of its own");
        check(Options { ca: Some("no-such.pem".into()), ..Options::to("tls/a:1") }, "no-such.pem: ");
    }

    #[test]
    fn what_protects_a_connection_is_read_from_all_of_its_settings() {
        let check = |options: Options, encrypted: bool, authenticated: bool| {
            let found = options.settings().unwrap().channel;
            assert_eq!(found, Channel { encrypted, authenticated }, "{options:?}");
        };
        let user = Some(("me".to_owned(), Secret("hidden".to_owned())));
        check(Options::to("tcp/127.0.0.1:1"), false, false);
        check(Options { user: user.clone(), ..Options::to("tcp/127.0.0.1:1") }, false, true);
        check(Options::to("tls/a:1"), true, false);
        check(Options { user, ..Options::to("tls/a:1") }, true, true);
        check(Options::to("unixsock-stream//run/z.sock"), true, false);
        let pem = file("own.pem", "");
        check(Options { identity: Some((pem.clone(), pem.clone())), ..Options::to("tls/a:1") }, true, true);
        check(Options { identity: Some((pem.clone(), pem)), ..Options::to("tcp/a:1") }, false, false);
        // One plain endpoint is enough, and so is what scouting may find.
        let mixed = ["tls/a:1".to_owned(), "tcp/b:1".to_owned()];
        check(Options { connect: mixed.to_vec(), ..Options::default() }, false, false);
        check(Options { listen: vec!["tcp/127.0.0.1:1".to_owned()], ..Options::to("tls/a:1") }, false, false);
        let scouting = file("scouting.json5", "{ scouting: { multicast: { enabled: true } } }");
        check(Options { config: Some(scouting), ..Options::to("tls/a:1") }, false, false);
        let whole = "{ connect: { endpoints: ['tls/a:1'] }, transport: { auth: { usrpwd: { user: 'me', password: 'x' } } } }";
        check(Options { config: Some(file("whole.json5", whole)), ..Options::default() }, true, true);
    }

    #[test]
    fn a_password_is_not_shown() {
        let user = Some(("me".to_owned(), Secret("hidden".to_owned())));
        let options = Options { user, ..Options::to("tcp/127.0.0.1:1") };
        assert!(!format!("{options:?}").contains("hidden"));
        let settings = options.settings().unwrap();
        assert_eq!(format!("{settings:?}"), r#"peer to ["tcp/127.0.0.1:1"]"#);
        assert!(settings.config.get_json("transport/auth/usrpwd/password").unwrap().contains("hidden"));
    }
}
