//! The channels of a run, and the viewers that follow them. A viewer that is too slow loses the oldest of what waits for it.

use super::protocol::{self, Asked};
use shsa_report::mcap::{Kind, Message};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use tungstenite::Message as Frame;

/// The most bytes that wait for a viewer.
const MOST_WAITING: usize = 8 << 20;

/// A channel with its newest message, which a new viewer gets at once.
struct Channel {
    topic: String,
    kind: Kind,
    last: Option<(u64, Arc<[u8]>)>,
}

/// What waits for a viewer.
enum Waiting {
    Text(String),
    Data { subscription: u32, time: u64, content: Arc<[u8]> },
}

/// A viewer that is connected.
#[derive(Default)]
struct Viewer {
    /// The number of the subscription, by channel.
    subscriptions: BTreeMap<u32, u32>,
    waiting: VecDeque<Waiting>,
    /// The bytes of the messages that wait.
    bytes: usize,
    /// The messages that were left out since the viewer was last told.
    left_out: u64,
}

impl Viewer {
    fn give(&mut self, channel: u32, time: u64, content: &Arc<[u8]>) {
        let Some(&subscription) = self.subscriptions.get(&channel) else { return };
        self.bytes += content.len();
        self.waiting.push_back(Waiting::Data { subscription, time, content: content.clone() });
        while self.bytes > MOST_WAITING && self.leave_out() {}
    }

    /// Leaves out the oldest message; `false` where none waits.
    fn leave_out(&mut self) -> bool {
        let oldest = self.waiting.iter().position(|it| matches!(it, Waiting::Data { .. }));
        let Some(Waiting::Data { content, .. }) = oldest.and_then(|at| self.waiting.remove(at)) else {
            return false;
        };
        self.bytes -= content.len();
        self.left_out += 1;
        true
    }

    fn take(&mut self) -> Vec<Frame> {
        self.bytes = 0;
        let left_out = std::mem::take(&mut self.left_out);
        let words = format!("{left_out} messages were left out, as this viewer is slower than the run");
        let warning = (left_out > 0).then(|| Frame::text(protocol::warning(&words)));
        let frame = |waiting| match waiting {
            Waiting::Text(text) => Frame::text(text),
            Waiting::Data { subscription, time, content } => {
                Frame::binary(protocol::data(subscription, time, &content))
            }
        };
        warning.into_iter().chain(self.waiting.drain(..).map(frame)).collect()
    }
}

/// The channels of a run with its viewers.
#[derive(Default)]
pub(super) struct Hub {
    /// What a viewer is told first.
    greeting: String,
    channels: Vec<Channel>,
    /// The number of each channel, by topic.
    numbers: BTreeMap<String, u32>,
    viewers: BTreeMap<u64, Viewer>,
    next: u64,
    is_over: bool,
}

impl Hub {
    pub(super) fn new(greeting: String) -> Hub {
        Hub { greeting, ..Hub::default() }
    }

    /// Passes a message on to those who have subscribed to its channel.
    pub(super) fn write(&mut self, message: &Message<'_>) {
        let number = self.number(message.topic, message.kind);
        let time = u64::try_from(message.time.0).unwrap_or_default();
        let content: Arc<[u8]> = message.data.into();
        for viewer in self.viewers.values_mut() {
            viewer.give(number, time, &content);
        }
        if let Some(channel) = self.channels.get_mut(number as usize) {
            channel.last = Some((time, content));
        }
    }

    /// The number of a channel; a new one is made known.
    fn number(&mut self, topic: &str, kind: Kind) -> u32 {
        if let Some(number) = self.numbers.get(topic) {
            return *number;
        }
        let number = u32::try_from(self.channels.len()).unwrap_or(u32::MAX);
        self.numbers.insert(topic.to_owned(), number);
        self.channels.push(Channel { topic: topic.to_owned(), kind, last: None });
        let news = protocol::advertise(std::iter::once((number, topic, kind)));
        for viewer in self.viewers.values_mut() {
            viewer.waiting.push_back(Waiting::Text(news.clone()));
        }
        number
    }

    /// A new viewer, which is greeted and told all channels.
    pub(super) fn enter(&mut self) -> u64 {
        let channels = (0..).zip(&self.channels).map(|(number, it)| (number, &*it.topic, it.kind));
        let known = [self.greeting.clone(), protocol::advertise(channels)].map(Waiting::Text);
        self.next += 1;
        self.viewers.insert(self.next, Viewer { waiting: known.into(), ..Viewer::default() });
        self.next
    }

    /// The viewer has gone.
    pub(super) fn leave(&mut self, viewer: u64) {
        self.viewers.remove(&viewer);
    }

    /// A viewer asks for something; what is not offered is ignored.
    pub(super) fn ask(&mut self, viewer: u64, text: &str) {
        let Hub { viewers, channels, .. } = self;
        let Some(viewer) = viewers.get_mut(&viewer) else { return };
        match Asked::parse(text) {
            Some(Asked::Subscribe(all)) => {
                for (subscription, number) in all {
                    let Some(channel) = channels.get(number as usize) else { continue };
                    viewer.subscriptions.insert(number, subscription);
                    if let Some((time, content)) = &channel.last {
                        viewer.give(number, *time, content);
                    }
                }
            }
            Some(Asked::Unsubscribe(ended)) => {
                viewer.subscriptions.retain(|_, subscription| !ended.contains(subscription));
            }
            None => {}
        }
    }

    /// What waits for a viewer; `None` when the run is over.
    pub(super) fn take(&mut self, viewer: u64) -> Option<Vec<Frame>> {
        let waiting = self.viewers.get_mut(&viewer).map(Viewer::take)?;
        (!self.is_over || !waiting.is_empty()).then_some(waiting)
    }

    /// The run is over.
    pub(super) fn end(&mut self) {
        self.is_over = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_core::time::Time;

    fn write(hub: &mut Hub, topic: &str, time: i64, data: &[u8]) {
        let (kind, about) = (Kind::Interval, &BTreeMap::new);
        hub.write(&Message { topic, kind, time: Time(time), data, about });
    }

    /// The messages of channels that a viewer gets: their times.
    fn times(hub: &mut Hub, viewer: u64) -> Vec<u64> {
        let frames = hub.take(viewer).unwrap();
        let time = |frame: Frame| match frame {
            Frame::Binary(bytes) => Some(u64::from_le_bytes(bytes[5..13].try_into().unwrap())),
            _ => None,
        };
        frames.into_iter().filter_map(time).collect()
    }

    #[test]
    fn a_viewer_gets_what_it_asks_for_and_the_newest_at_once() {
        let mut hub = Hub::new("{}".to_owned());
        write(&mut hub, "/a", 1, b"{}");
        write(&mut hub, "/a", 2, b"{}");
        let viewer = hub.enter();
        write(&mut hub, "/b", 3, b"{}");
        hub.ask(
            viewer,
            r#"{"op": "subscribe", "subscriptions": [{"id": 9, "channelId": 0}, {"id": 8, "channelId": 7}]}"#,
        );
        assert_eq!(times(&mut hub, viewer), [2]);
        write(&mut hub, "/b", 4, b"{}");
        write(&mut hub, "/a", 5, b"{}");
        assert_eq!(times(&mut hub, viewer), [5]);
        hub.ask(viewer, r#"{"op": "unsubscribe", "subscriptionIds": [9]}"#);
        write(&mut hub, "/a", 6, b"{}");
        assert!(times(&mut hub, viewer).is_empty());
        hub.end();
        assert!(hub.take(viewer).is_none());
    }

    #[test]
    fn a_slow_viewer_loses_the_oldest_and_is_told() {
        let mut hub = Hub::new("{}".to_owned());
        write(&mut hub, "/a", 0, b"{}");
        let viewer = hub.enter();
        hub.ask(viewer, r#"{"op": "subscribe", "subscriptions": [{"id": 0, "channelId": 0}]}"#);
        let large = vec![b' '; MOST_WAITING / 4];
        (1..=10).for_each(|time| write(&mut hub, "/a", time, &large));
        let frames = hub.take(viewer).unwrap();
        let first = frames.first().and_then(|frame| frame.to_text().ok()).unwrap();
        assert!(first.contains("7 messages were left out"), "{first}");
        let last = frames.iter().filter(|frame| frame.is_binary()).count();
        assert_eq!(last, 4);
        assert!(times(&mut hub, viewer).is_empty());
    }
}
