//! The inbox gives the room of a backlog back, and allocates nothing while its reader keeps up. A process of its own, as its
//! allocations are counted.

use allocation_counter::measure;
use shsa_bridge::{Clock, Inbox, Message, Payload};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use std::sync::Arc;

const TOPICS: usize = 50;

/// Messages on every topic in turn: `each` of them.
fn fill(inbox: &Inbox, topics: &[Arc<str>], each: usize) {
    for topic in topics.iter().cycle().take(each * topics.len()) {
        inbox.push(Message::new(topic.clone(), Time(0), Payload::Value(RawValue::Number(1.0))));
    }
}

fn drain(inbox: &Inbox) {
    while inbox.pop().is_some() {}
}

fn topics() -> Vec<Arc<str>> {
    (0..TOPICS).map(|topic| format!("topic/{topic}").into()).collect()
}

#[test]
fn the_room_of_a_backlog_is_given_back() {
    let (inbox, topics) = (Inbox::new(4096, Clock::manual()), topics());
    // The inbox knows the topics, and has no room yet.
    fill(&inbox, &topics, 33);
    drain(&inbox);
    let counted = measure(|| {
        fill(&inbox, &topics, 1_000);
        drain(&inbox);
    });
    assert_eq!(inbox.dropped(), 0);
    let (kept, needed) = (counted.bytes_current, TOPICS * 1_000 * size_of::<Message>());
    assert_eq!(kept, 0, "bytes are kept of {needed}");
    // And no block was outgrown, which would leave a hole behind.
    let taken = counted.bytes_total;
    assert!(taken <= (needed + needed / 4) as u64, "{taken} bytes were allocated for {needed}");
}

#[test]
fn a_reader_that_keeps_up_costs_no_allocation() {
    let (inbox, topics) = (Inbox::new(4096, Clock::manual()), topics());
    fill(&inbox, &topics, 30);
    drain(&inbox);
    let counted = measure(|| {
        for each in (0..100).map(|turn| turn % 30 + 1) {
            fill(&inbox, &topics, each);
            drain(&inbox);
        }
    });
    assert_eq!(counted.count_total, 0);
}
