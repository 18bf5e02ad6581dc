//! Publishers that are no instances and use the name of a need: consumers cannot tell their values from those of the need.

use crate::undelivered::Swell;
use serde_json::{Value, json};
use shsa_bridge::PublisherId;
use shsa_core::time::Time;
use std::collections::BTreeMap;

/// The messages of strangers, by the name of the need.
#[derive(Debug, Default)]
pub(super) struct Strangers {
    names: BTreeMap<String, Messages>,
}

#[derive(Debug, Default)]
struct Messages {
    count: u64,
    /// Those since the last report, by the last publisher: its token may be on its way.
    new: u64,
    publisher: Option<PublisherId>,
    swell: Swell,
}

impl Strangers {
    /// Counts a message.
    pub(super) fn count(&mut self, need: &str, publisher: Option<PublisherId>) {
        if !self.names.contains_key(need) {
            self.names.insert(need.to_owned(), Messages::default());
        }
        if let Some(messages) = self.names.get_mut(need) {
            (messages.new, messages.publisher) = (messages.new + 1, publisher);
        }
    }

    /// Notes about messages since the last call, when they begin and when their count has grown tenfold. `is_instance`: the
    /// publisher is known as an instance by now.
    pub(super) fn notes(&mut self, is_instance: impl Fn(PublisherId) -> bool, now: Time) -> Vec<String> {
        let mut notes = Vec::new();
        for (need, messages) in &mut self.names {
            let new = std::mem::take(&mut messages.new);
            if messages.publisher.is_some_and(&is_instance) {
                continue;
            }
            messages.count += new;
            let Some(count) = messages.swell.rise(new, now) else { continue };
            let who =
                messages.publisher.map_or("somebody else".to_owned(), |it| format!("the publisher {it}"));
            notes.push(format!(
                "{who} publishes under {need}, the name of a need: {count} messages; consumers cannot tell them from ours"
            ));
        }
        notes
    }

    /// The number of messages by the name of the need, for the state.
    pub(super) fn json(&self) -> Value {
        let counts = self.names.iter().filter(|(_, messages)| messages.count > 0);
        counts
            .map(|(need, messages)| (need.clone(), json!(messages.count)))
            .collect::<serde_json::Map<_, _>>()
            .into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_is_an_instance_by_now_is_no_stranger() {
        let mut strangers = Strangers::default();
        strangers.count("a", Some(PublisherId(1)));
        assert_eq!(strangers.notes(|it| it == PublisherId(1), Time(0)), [""; 0]);
        strangers.count("a", Some(PublisherId(17)));
        strangers.count("b", None);
        let notes = strangers.notes(|it| it == PublisherId(1), Time(0));
        let begin = ["the publisher 11 publishes under a, ", "somebody else publishes under b, "];
        assert!(
            notes.len() == 2 && notes.iter().zip(begin).all(|(note, it)| note.starts_with(it)),
            "{notes:?}"
        );
        assert_eq!(strangers.json(), json!({ "a": 1, "b": 1 }));
        assert_eq!(strangers.notes(|_| false, Time(0)), [""; 0]);
    }
}
