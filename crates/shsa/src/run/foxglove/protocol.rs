//! The messages of the Foxglove WebSocket protocol, version 1 (<https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>).

use serde_json::{Value, json};
use shsa_report::mcap::Kind;

/// The names of the protocol; the first is the newer one of the two, which are the same in what is used here.
pub(super) const NAMES: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];

/// What a viewer asks for.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Asked {
    /// Channels from now on: the number of the subscription, and that of the channel.
    Subscribe(Vec<(u32, u32)>),
    /// No more of these subscriptions.
    Unsubscribe(Vec<u32>),
}

impl Asked {
    /// `None` for what is not understood, or not offered.
    pub(super) fn parse(text: &str) -> Option<Asked> {
        let message: Value = serde_json::from_str(text).ok()?;
        let number = |value: &Value| u32::try_from(value.as_u64()?).ok();
        match message["op"].as_str()? {
            "subscribe" => {
                let asked = message["subscriptions"].as_array()?.iter();
                let asked = asked.map(|it| Some((number(&it["id"])?, number(&it["channelId"])?)));
                asked.collect::<Option<_>>().map(Asked::Subscribe)
            }
            "unsubscribe" => {
                let ended = message["subscriptionIds"].as_array()?.iter();
                ended.map(number).collect::<Option<_>>().map(Asked::Unsubscribe)
            }
            _ => None,
        }
    }
}

/// Who serves; the first message to a viewer. `session` differs from run to run.
pub(super) fn server_info(name: &str, session: &str) -> String {
    json!({ "op": "serverInfo", "name": name, "capabilities": [], "metadata": {}, "sessionId": session })
        .to_string()
}

/// New channels: their numbers, topics and kinds.
pub(super) fn advertise<'a>(channels: impl Iterator<Item = (u32, &'a str, Kind)>) -> String {
    let row = |(id, topic, kind): (u32, &str, Kind)| {
        json!({
            "id": id,
            "topic": topic,
            "encoding": "json",
            "schemaName": kind.name(),
            "schema": kind.schema(),
            "schemaEncoding": "jsonschema",
        })
    };
    json!({ "op": "advertise", "channels": channels.map(row).collect::<Vec<_>>() }).to_string()
}

/// A warning that the viewer shows.
pub(super) fn warning(message: &str) -> String {
    json!({ "op": "status", "level": 1, "message": message }).to_string()
}

/// A message of a channel: time in nanoseconds, and the content.
pub(super) fn data(subscription: u32, time: u64, content: &[u8]) -> Vec<u8> {
    [&[1], &subscription.to_le_bytes()[..], &time.to_le_bytes(), content].concat()
}

/// Whether a page from this origin may follow the run. Programs have none; a page of somewhere else would let its author look.
pub(super) fn is_welcome(origin: Option<&str>) -> bool {
    let Some(origin) = origin else { return true };
    let Some((scheme, rest)) = origin.split_once("://") else { return false };
    let host = match rest.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => rest.split(':').next().unwrap_or_default(),
    };
    let is_own = ["localhost", "127.0.0.1", "::1"].contains(&host);
    let is_foxglove = host == "foxglove.dev" || host.ends_with(".foxglove.dev");
    scheme == "file" || is_own || (scheme == "https" && is_foxglove)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_asked_for_is_understood() {
        #[track_caller]
        fn check(text: &str, expected: Option<Asked>) {
            assert_eq!(Asked::parse(text), expected);
        }
        let text =
            r#"{"op": "subscribe", "subscriptions": [{"id": 0, "channelId": 3}, {"id": 1, "channelId": 5}]}"#;
        check(text, Some(Asked::Subscribe(vec![(0, 3), (1, 5)])));
        check(r#"{"op": "unsubscribe", "subscriptionIds": [1]}"#, Some(Asked::Unsubscribe(vec![1])));
        check(r#"{"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 3}]}"#, None);
        check(r#"{"op": "getParameters"}"#, None);
        check("[]", None);
        check("{", None);
    }

    #[test]
    fn a_message_has_its_subscription_and_time_before_its_content() {
        let expected = [1, 7, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, b'{', b'}'];
        assert_eq!(data(7, 256, b"{}"), expected);
    }

    #[test]
    fn pages_from_elsewhere_may_not_look() {
        let welcome = [
            None,
            Some("file://"),
            Some("https://app.foxglove.dev"),
            Some("http://localhost:8080"),
            Some("http://[::1]:80"),
        ];
        let unwelcome =
            ["null", "https://example.org", "http://foxglove.dev.example.org", "http://app.foxglove.dev"];
        assert!(welcome.iter().all(|origin| is_welcome(*origin)));
        assert!(!unwelcome.iter().any(|origin| is_welcome(Some(origin))));
    }
}
