//! The options of a connection to a broker, from one address; secrets come from the environment or a file.

use super::tls::Tls;
use crate::{BridgeError, Channel};
use bytes::Bytes;
use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The version of the protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// 5: carries provenance as user properties, and never sends back the client's own messages.
    V5,
    /// 3.1.1, for brokers that know no other.
    V311,
}

/// The guarantee of delivery.
///
/// Exactly once is not offered: the next value replaces a value anyway, and the necessary state does not survive the loss of
/// either side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivery {
    /// A message may be lost when the connection breaks (quality of service 0).
    AtMostOnce,
    /// A message may arrive twice when the connection breaks (quality of service 1).
    AtLeastOnce,
}

/// User and password. They are never printed.
#[derive(Clone, PartialEq, Eq)]
pub struct Credentials {
    /// The user's name.
    pub user: String,
    /// The password.
    pub password: String,
}

impl fmt::Debug for Credentials {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Credentials(not shown)")
    }
}

/// How others learn whether this client is connected: by retained messages on a topic of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Presence {
    /// The topic.
    pub topic: String,
    /// The message after each connection.
    pub here: Bytes,
    /// The message when the client leaves; the broker publishes it if the connection breaks (last will).
    pub gone: Bytes,
}

/// How to reach a broker.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Its name or address.
    pub host: String,
    /// Usually 1883, or 8883 with TLS.
    pub port: u16,
    /// `None`: not encrypted.
    pub tls: Option<Tls>,
    /// The version of the protocol.
    pub version: Version,
    /// The client's identifier, unique on the broker and the same after a restart: the broker keeps messages for this identifier.
    pub name: String,
    /// `None`: without.
    pub credentials: Option<Credentials>,
    /// The delivery of publications and subscriptions.
    pub delivery: Delivery,
    /// How long the broker keeps messages during an absence of the client; zero: not at all. Brokers of 3.1.1 keep them as long
    /// as they like.
    pub session: Duration,
    /// The longest pause between two attempts to connect; at least 0.1 s.
    pub retry: Duration,
    /// A connection without a message for up to twice this time is given up; at least 5 s.
    pub keep_alive: Duration,
    /// How others learn whether this client is connected; `None`: not at all.
    pub presence: Option<Presence>,
    /// `shsa/NAME/claims` lists the client's claims under this name ([`Bridge::attend`](crate::Bridge::attend)); its
    /// [`presence`](Options::presence) must be reported on `shsa/NAME/status` by `online` and `offline`. `None`: it claims
    /// nothing.
    pub claims: Option<String>,
    /// The largest payload in bytes; larger ones are dropped and reported.
    pub size_limit: usize,
    /// How long [`MqttBridge::open`](super::MqttBridge::open) waits for the first attempt.
    pub first_attempt: Duration,
}

impl Options {
    /// What protects messages: a connection with TLS is never made without it, and only to a broker whose certificate is trusted.
    pub(super) fn channel(&self) -> Channel {
        let shows_certificate = self.tls.as_ref().is_some_and(|tls| tls.certificate.is_some());
        Channel {
            encrypted: self.tls.is_some(),
            authenticated: self.credentials.is_some() || shows_certificate,
        }
    }

    /// The options for a broker at `mqtt://HOST[:PORT]`, or `mqtts://HOST[:PORT]` with TLS, optionally with settings like
    /// `?version=3.1.1&qos=0`:
    ///
    /// | setting | means |
    /// |---|---|
    /// | `version=5`, `3.1.1` | the protocol's version (5) |
    /// | `qos=0`, `1` | the quality of service (1) |
    /// | `name=TEXT` | the client's identifier (`name`) |
    /// | `session=SECONDS` | how long the broker keeps messages while this client is away (0): without stamps they say nothing about now |
    /// | `retry=SECONDS` | the longest pause between two attempts to connect (2) |
    /// | `user=TEXT`, `password-file=FILE` | credentials; the file's first line is the password |
    /// | `ca=FILE` | with TLS, the only authorities that are trusted, PEM; without it those of the system |
    /// | `cert=FILE`, `key=FILE` | with TLS, the certificate and key that this client shows, PEM |
    ///
    /// # Errors
    /// [`BridgeError::Configuration`] tells which part is wrong, or which file cannot be read.
    pub fn parse(address: &str, name: &str) -> Result<Options, BridgeError> {
        let (scheme, rest) = address.split_once("://").ok_or_else(|| wrong(HELP))?;
        let is_encrypted = match scheme {
            "mqtt" | "tcp" => false,
            "mqtts" | "ssl" => true,
            other => return Err(wrong(format!("`{other}://` is no MQTT; {HELP}"))),
        };
        let (place, settings) = rest.split_once('?').unwrap_or((rest, ""));
        let (host, port) =
            host_and_port(place.trim_end_matches('/'), if is_encrypted { 8883 } else { 1883 })?;
        let mut options = Options {
            host,
            port,
            tls: is_encrypted.then(Tls::default),
            version: Version::V5,
            name: name.to_owned(),
            credentials: None,
            delivery: Delivery::AtLeastOnce,
            session: Duration::ZERO,
            retry: Duration::from_secs(2),
            keep_alive: Duration::from_secs(5),
            presence: None,
            claims: None,
            size_limit: crate::payload::SIZE_LIMIT,
            first_attempt: Duration::from_secs(5),
        };
        let mut secrets = Secrets::default();
        for setting in settings.split('&').filter(|setting| !setting.is_empty()) {
            let (key, value) = setting.split_once('=').unwrap_or((setting, ""));
            options.set(key, value, &mut secrets)?;
        }
        options.credentials = secrets.read()?;
        Ok(options)
    }

    /// Takes `SHSA_MQTT_USER` and `SHSA_MQTT_PASSWORD` from the environment unless the address names credentials; `variable`
    /// looks a variable up.
    #[must_use]
    pub fn with_environment(mut self, variable: impl Fn(&str) -> Option<String>) -> Options {
        if self.credentials.is_none() {
            let password = variable("SHSA_MQTT_PASSWORD").unwrap_or_default();
            self.credentials = variable("SHSA_MQTT_USER").map(|user| Credentials { user, password });
        }
        self
    }

    fn set(&mut self, key: &str, value: &str, secrets: &mut Secrets) -> Result<(), BridgeError> {
        match (key, value) {
            ("version", "5") => self.version = Version::V5,
            ("version", "3.1.1" | "4") => self.version = Version::V311,
            ("qos", "0") => self.delivery = Delivery::AtMostOnce,
            ("qos", "1") => self.delivery = Delivery::AtLeastOnce,
            ("name", name) if !name.is_empty() => self.name = name.to_owned(),
            ("session", seconds) => self.session = whole_seconds(key, seconds)?,
            ("retry", seconds) => self.retry = whole_seconds(key, seconds)?,
            ("user", user) => secrets.user = Some(user.to_owned()),
            ("password-file", file) => secrets.password_file = Some(file.into()),
            ("password", _) => {
                return Err(wrong(
                    "a password on a command line can be read by everyone; \
                    use `password-file=FILE`, or the variable SHSA_MQTT_PASSWORD",
                ));
            }
            ("ca" | "cert" | "key", file) => {
                let tls = self.tls.as_mut().ok_or_else(|| wrong(format!("`{key}` needs `mqtts://`")))?;
                tls.set(key, file);
            }
            _ => return Err(wrong(format!("`{key}={value}` is no setting; {HELP}"))),
        }
        Ok(())
    }

    /// Whether the broker is to keep messages during an absence of this client.
    pub(super) fn is_kept(&self) -> bool {
        !self.session.is_zero()
    }
}

/// The time of a setting in whole seconds.
pub(super) fn whole_seconds(key: &str, seconds: &str) -> Result<Duration, BridgeError> {
    let seconds = seconds.parse::<u32>().map_err(|_| wrong(format!("`{key}` is a number of seconds")))?;
    Ok(Duration::from_secs(seconds.into()))
}

const HELP: &str = "write mqtt://HOST[:PORT], or mqtts://HOST[:PORT] for TLS; behind a `?`, joined by `&`: version, qos, name, \
    session, retry, user, password-file, ca, cert, key";

fn wrong(what: impl Into<String>) -> BridgeError {
    BridgeError::Configuration(what.into())
}

fn host_and_port(place: &str, usual: u16) -> Result<(String, u16), BridgeError> {
    if place.contains('@') {
        return Err(wrong(
            "user and password do not belong into the address; use `?user=..&password-file=FILE`, or \
            the variables SHSA_MQTT_USER and SHSA_MQTT_PASSWORD",
        ));
    }
    let bracketed = place.strip_prefix('[').and_then(|rest| rest.split_once(']'));
    let (host, port) = match bracketed {
        Some((host, port)) => (format!("[{host}]"), port.strip_prefix(':')),
        None => place
            .split_once(':')
            .map_or((place.to_owned(), None), |(host, port)| (host.to_owned(), Some(port))),
    };
    if host.is_empty() {
        return Err(wrong(format!("the address names no host; {HELP}")));
    }
    let port =
        port.map_or(Ok(usual), |port| port.parse().map_err(|_| wrong(format!("`{port}` is no port"))))?;
    Ok((host, port))
}

/// The places of the secrets.
#[derive(Default)]
struct Secrets {
    user: Option<String>,
    password_file: Option<PathBuf>,
}

impl Secrets {
    fn read(self) -> Result<Option<Credentials>, BridgeError> {
        match (self.user, self.password_file) {
            (None, None) => Ok(None),
            (None, Some(_)) => Err(wrong("`password-file` needs `user`")),
            (Some(user), None) => Ok(Some(Credentials { user, password: String::new() })),
            (Some(user), Some(file)) => Ok(Some(Credentials { user, password: first_line(&file)? })),
        }
    }
}

fn first_line(file: &Path) -> Result<String, BridgeError> {
    let text = std::fs::read_to_string(file)
        .map_err(|error| wrong(format!("the password file {}: {error}", file.display())))?;
    Ok(text.lines().next().unwrap_or_default().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(address: &str, expected: &str) {
        let shown = match Options::parse(address, "healer") {
            Err(problem) => format!("error: {problem}").chars().take(60).collect(),
            Ok(o) => {
                format!("{} {} {:?} {:?} {} {:?}", o.host, o.port, o.version, o.delivery, o.name, o.session)
            }
        };
        assert_eq!(shown, expected);
    }

    #[test]
    fn addresses() {
        check("mqtt://broker", "broker 1883 V5 AtLeastOnce healer 0ns");
        check("mqtts://broker/", "broker 8883 V5 AtLeastOnce healer 0ns");
        check("mqtt://10.0.0.1:99?version=3.1.1&qos=0&name=a&session=0", "10.0.0.1 99 V311 AtMostOnce a 0ns");
        check("mqtt://[::1]:5", "[::1] 5 V5 AtLeastOnce healer 0ns");
        check("broker", "error: write mqtt://HOST[:PORT], or mqtts://HOST[:PORT] for ");
        check("http://broker", "error: `http://` is no MQTT; write mqtt://HOST[:PORT], or mq");
        check("mqtt://", "error: the address names no host; write mqtt://HOST[:PORT], ");
        check("mqtt://a:b", "error: `b` is no port");
        check("mqtt://a?qos=2", "error: `qos=2` is no setting; write mqtt://HOST[:PORT], or m");
        check("mqtt://a?ca=x", "error: `ca` needs `mqtts://`");
        check("mqtt://u:p@a", "error: user and password do not belong into the address; use");
        check("mqtt://a?password=x", "error: a password on a command line can be read by everyone;");
        check("mqtt://a?password-file=x", "error: `password-file` needs `user`");
        check(
            "mqtt://a?user=u&password-file=/no/file",
            "error: the password file /no/file: No such file or directory",
        );
    }

    #[test]
    fn credentials_come_from_the_environment_and_are_never_shown() {
        let variable = |name: &str| match name {
            "SHSA_MQTT_USER" => Some("ann".to_owned()),
            "SHSA_MQTT_PASSWORD" => Some("secret-word".to_owned()),
            _ => None,
        };
        let options = Options::parse("mqtt://a", "n").unwrap().with_environment(variable);
        assert_eq!(options.credentials.as_ref().unwrap().password, "secret-word");
        assert!(!format!("{options:?}").contains("secret-word"));
        let own = Options::parse("mqtt://a?user=bob", "n").unwrap().with_environment(variable);
        assert_eq!(own.credentials.unwrap().user, "bob");
    }
}
