//! The options of a connection by Sparkplug, from one address.

use super::name::NodeName;
use crate::BridgeError;
use crate::mqtt;
use crate::mqtt::options::whole_seconds;
use std::time::Duration;

/// How to reach a broker by Sparkplug, and who is there.
#[derive(Clone, Debug)]
pub struct Options {
    /// The connection of the host application. That of the edge node is as this one, under the name with `-node` behind it.
    pub mqtt: mqtt::Options,
    /// The edge node that publishes; `None`: an observer publishes nothing.
    pub node: Option<NodeName>,
    /// The identifier of the host application in its STATE; `None`: an observer sends none.
    pub host: Option<String>,
    /// How long a message of an edge node may wait for a missing earlier one, before births are requested anew.
    pub reorder: Duration,
}

const HELP: &str = "write sparkplug://HOST[:PORT]/GROUP/NODE, or sparkplugs:// for TLS; behind a `?`, joined by `&`: host, reorder, \
    and the settings of MQTT: version, qos, name, retry, user, password-file, ca, cert, key";

impl Options {
    /// The options for a broker at `sparkplug://HOST[:PORT]/GROUP/NODE`, or `sparkplugs://` with TLS. Without `/NODE` the edge
    /// node has the name `name`. The settings are those of [MQTT](mqtt::Options::parse), and these:
    ///
    /// | setting | means |
    /// |---|---|
    /// | `host=TEXT` | the identifier of the host application (`name`) |
    /// | `reorder=SECONDS` | how long a message of an edge node may wait for a missing earlier one (0: a single broker keeps the order) |
    ///
    /// # Errors
    /// [`BridgeError::Configuration`] tells which part is wrong, or which file cannot be read.
    pub fn parse(address: &str, name: &str) -> Result<Options, BridgeError> {
        let options = Options::observer(address, name)?;
        let (_, path) = parts(address)?;
        let path = path.trim_matches('/');
        if path.is_empty() {
            return Err(wrong(format!("the address names no group; {HELP}")));
        }
        let node = if path.contains('/') { path.parse() } else { format!("{path}/{name}").parse() };
        Ok(Options { node: Some(node?), host: options.host.or_else(|| Some(name.to_owned())), ..options })
    }

    /// As [`Options::parse`], for an observer; group and node may be left out, and have no effect.
    ///
    /// # Errors
    /// As [`Options::parse`].
    pub fn observer(address: &str, name: &str) -> Result<Options, BridgeError> {
        let (scheme, rest) = address.split_once("://").ok_or_else(|| wrong(HELP))?;
        let scheme = match scheme {
            "sparkplug" => "mqtt",
            "sparkplugs" => "mqtts",
            other => return Err(wrong(format!("`{other}://` is no Sparkplug; {HELP}"))),
        };
        let (place, settings) = rest.split_once('?').unwrap_or((rest, ""));
        let broker = place.split('/').next().unwrap_or_default();
        let (mut host, mut reorder, mut others) = (None, Duration::ZERO, Vec::new());
        for setting in settings.split('&').filter(|setting| !setting.is_empty()) {
            match setting.split_once('=').unwrap_or((setting, "")) {
                ("host", id) if !id.is_empty() && !id.contains(['+', '#', '/']) => host = Some(id.to_owned()),
                ("host", id) => {
                    return Err(wrong(format!("`host={id}` is no identifier of a host application")));
                }
                ("reorder", seconds) => reorder = whole_seconds("reorder", seconds)?,
                ("session", _) => {
                    return Err(wrong(
                        "Sparkplug begins every connection with a clean session: leave `session` out",
                    ));
                }
                _ => others.push(setting),
            }
        }
        let mqtt = mqtt::Options::parse(&format!("{scheme}://{broker}?{}", others.join("&")), name)?;
        Ok(Options { mqtt, node: None, host, reorder })
    }

    /// The options of the edge node's connection.
    pub(super) fn of_node(&self) -> mqtt::Options {
        mqtt::Options { name: format!("{}-node", self.mqtt.name), ..self.mqtt.clone() }
    }
}

/// The broker and the path of an address.
fn parts(address: &str) -> Result<(&str, &str), BridgeError> {
    let (_, rest) = address.split_once("://").ok_or_else(|| wrong(HELP))?;
    let (place, _) = rest.split_once('?').unwrap_or((rest, ""));
    Ok(place.split_once('/').unwrap_or((place, "")))
}

fn wrong(what: impl Into<String>) -> BridgeError {
    BridgeError::Configuration(what.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(address: &str, expected: &str) {
        let shown = match Options::parse(address, "healer") {
            Err(problem) => format!("error: {problem}").chars().take(50).collect(),
            Ok(Options { mqtt, node, host, reorder }) => {
                let tls = if mqtt.tls.is_some() { " tls" } else { "" };
                let (node, host) = (node.map(|node| node.to_string()), host.unwrap_or_default());
                format!("{}:{}{tls} {} {host} {reorder:?}", mqtt.host, mqtt.port, node.unwrap_or_default())
            }
        };
        assert_eq!(shown, expected);
    }

    #[test]
    fn addresses() {
        check("sparkplug://broker/Plant/shsa", "broker:1883 Plant/shsa healer 0ns");
        check("sparkplug://broker:99/Plant 1?host=scada&reorder=2", "broker:99 Plant 1/healer scada 2s");
        check("sparkplugs://broker/Plant/shsa?version=3.1.1", "broker:8883 tls Plant/shsa healer 0ns");
        check("sparkplug://broker", "error: the address names no group; write sparkplug");
        check("sparkplug://broker/a/b/c", "error: `a/b/c` is no edge node; write GROUP/NODE, ");
        check("sparkplug://broker/a/+", "error: `a/+` is no edge node; write GROUP/NODE, wi");
        check("mqtt://broker/a/b", "error: `mqtt://` is no Sparkplug; write sparkplug:");
        check("sparkplug://broker/a?session=60", "error: Sparkplug begins every connection with a cl");
        check("sparkplug://broker/a?host=a/b", "error: `host=a/b` is no identifier of a host appli");
        check("sparkplug://broker/a?reorder=x", "error: `reorder` is a number of seconds");
        check("sparkplug://broker/a?qos=2", "error: `qos=2` is no setting; write mqtt://HOST[:P");
    }

    #[test]
    fn each_connection_has_a_name_of_its_own() {
        let options = Options::parse("sparkplug://broker/Plant/shsa", "healer").unwrap();
        assert_eq!((&*options.mqtt.name, &*options.of_node().name), ("healer", "healer-node"));
        assert_eq!(Options::observer("sparkplug://broker", "me").unwrap().node, None);
    }
}
