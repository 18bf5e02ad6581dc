//! Sessions of an edge node: what each message leads to.

use super::*;
use proptest::prelude::*;
use shsa_message::sparkplug::{NewMetric, NewValue, Writer};

/// A node, and the time.
struct Scene {
    followed: Followed,
    now: Uptime,
}

impl Scene {
    fn new(reorder: Duration) -> Scene {
        Scene { followed: Followed::new(reorder), now: Uptime::now() }
    }

    fn later(&mut self, seconds: f64) -> String {
        self.now = self.now + Duration::from_secs_f64(seconds);
        let mut shown = Vec::new();
        self.followed.pass(self.now, &mut |step| shown.push(show(&step)));
        shown.join(" ")
    }

    fn take(&mut self, kind: Kind, device: Option<&str>, payload: Vec<u8>) -> String {
        let mut shown = Vec::new();
        self.followed.take(kind, device, &payload.into(), self.now, &mut |step| shown.push(show(&step)));
        shown.join(" ")
    }

    fn node_birth(&mut self, bd_seq: u64) -> String {
        self.take(Kind::NodeBirth, None, birth(0, Some(bd_seq)))
    }

    fn data(&mut self, seq: u8) -> String {
        self.take(Kind::NodeData, None, data(seq, 1))
    }

    fn device(&mut self, kind: Kind, seq: u8) -> String {
        let payload = if kind == Kind::DeviceBirth { birth(seq, None) } else { data(seq, 1) };
        self.take(kind, Some("D"), payload)
    }
}

fn show(step: &Step<'_>) -> String {
    let name = |device: &Option<&str>| device.unwrap_or("N").to_owned();
    match step {
        Step::Deliver { device, payload } => {
            let payload = Payload::read(payload).unwrap();
            let metric =
                |metric: Metric<'_>| format!("{}={}", metric.name.unwrap(), metric.number().unwrap());
            format!("{}[{}]", name(device), payload.metrics().map(metric).collect::<Vec<_>>().join(","))
        }
        Step::Stale { device, .. } => format!("{}-stale", name(device)),
        Step::AskRebirth => "ask".to_owned(),
        Step::Unreadable => "unreadable".to_owned(),
    }
}

/// A birth with `bdSeq` and the metrics `t` (signed, alias 1) and `u` (alias 2).
fn birth(seq: u8, bd_seq: Option<u64>) -> Vec<u8> {
    let mut writer = Writer::new(1, Some(seq));
    if let Some(bd_seq) = bd_seq {
        let value = Some(NewValue::Whole(bd_seq));
        let data_type = Some(DataType::UINT64);
        writer.push(&NewMetric { name: BD_SEQ, timestamp: 1, data_type, value, properties: &[] });
    }
    let mut payload = writer.finish();
    // The name, the alias, the time, the type, and the value.
    payload.extend(b"\x12\x0f\x0a\x01t\x10\x01\x18\x01\x20\x03\x50\xff\xff\xff\xff\x0f");
    payload.extend(b"\x12\x0b\x0a\x01u\x10\x02\x18\x01\x20\x03\x50\x07");
    payload
}

/// A value of the metric with this alias: -2.
fn data(seq: u8, alias: u8) -> Vec<u8> {
    let mut payload = Writer::new(1, Some(seq)).finish();
    payload.extend([0x12, 8, 0x10, alias, 0x50, 0xfe, 0xff, 0xff, 0xff, 0x0f]);
    payload
}

fn death(bd_seq: u64) -> Vec<u8> {
    let mut writer = Writer::new(1, None);
    let value = Some(NewValue::Whole(bd_seq));
    writer.push(&NewMetric {
        name: BD_SEQ,
        timestamp: 1,
        data_type: Some(DataType::UINT64),
        value,
        properties: &[],
    });
    writer.finish()
}

/// A value under a name, without a type.
fn named(seq: u8, name: u8) -> Vec<u8> {
    let mut payload = Writer::new(1, Some(seq)).finish();
    payload.extend([0x12, 9, 0x0a, 1, name, 0x50, 0xfe, 0xff, 0xff, 0xff, 0x0f]);
    payload
}

#[test]
fn births_give_names_and_types_to_what_follows() {
    let mut scene = Scene::new(Duration::ZERO);
    assert_eq!(scene.node_birth(5), "N[bdSeq=5,t=-1,u=7]");
    assert_eq!(scene.data(1), "N[t=-2]");
    assert_eq!(scene.device(Kind::DeviceBirth, 2), "D[t=-1,u=7]");
    assert_eq!(scene.device(Kind::DeviceData, 3), "D[t=-2]");
    assert_eq!(scene.take(Kind::NodeData, None, named(4, b'u')), "N[u=-2]");
    assert_eq!(scene.later(100.0), "", "nothing is due");
}

#[test]
fn the_sequence_goes_round() {
    let mut scene = Scene::new(Duration::ZERO);
    scene.node_birth(0);
    for seq in (1..=255).chain(0..=3) {
        assert_eq!(scene.data(seq), "N[t=-2]", "{seq}");
    }
}

#[test]
fn a_gap_asks_for_births_and_aliases_count_no_more_until_then() {
    let mut scene = Scene::new(Duration::ZERO);
    scene.node_birth(0);
    assert_eq!(scene.data(2), "ask");
    assert_eq!(scene.data(3), "");
    assert_eq!(scene.take(Kind::NodeData, None, named(4, b't')), "N[t=-2]");
    // The request or its answer was lost.
    assert_eq!((scene.later(0.5), scene.later(0.6)), (String::new(), "ask".to_owned()));
    assert_eq!((scene.later(1.5), scene.later(0.6)), (String::new(), "ask".to_owned()));
    assert_eq!(scene.node_birth(0), "N[bdSeq=0,t=-1,u=7]");
    assert_eq!((scene.data(1), scene.later(1000.0)), ("N[t=-2]".to_owned(), String::new()));
}

#[test]
fn what_was_never_declared_asks_for_births_but_not_without_end() {
    let mut scene = Scene::new(Duration::ZERO);
    assert_eq!(scene.data(7), "ask");
    assert_eq!(scene.node_birth(0), "N[bdSeq=0,t=-1,u=7]");
    assert_eq!(scene.device(Kind::DeviceData, 1), "", "asked a moment ago");
    let mut asked = 0;
    for seq in 2..=121 {
        scene.later(1.0);
        let steps = scene.take(Kind::NodeData, None, named(seq, b'x'));
        asked += u32::from(steps.contains("ask"));
        if steps.contains("ask") {
            // It answers, and goes on as before.
            scene.node_birth(0);
            scene.followed.next = Some(seq.wrapping_add(1));
        }
    }
    assert!((3..=8).contains(&asked), "{asked}");
}

#[test]
fn what_needs_no_birth_counts_without_one() {
    let mut scene = Scene::new(Duration::ZERO);
    let mut of = |value: NewValue<'_>| {
        let mut writer = Writer::new(1, Some(0));
        let metric =
            NewMetric { name: "v", timestamp: 1, data_type: None, value: Some(value), properties: &[] };
        writer.push(&metric);
        scene.take(Kind::DeviceData, Some("D"), writer.finish())
    };
    assert_eq!(of(NewValue::Number(1.5)), "ask D[v=1.5]");
    assert_eq!(of(NewValue::Whole(7)), "", "its sign is not known");
}

#[test]
fn a_death_counts_for_its_own_birth() {
    let mut scene = Scene::new(Duration::ZERO);
    scene.node_birth(3);
    assert_eq!(scene.take(Kind::NodeDeath, None, death(2)), "");
    assert_eq!(scene.data(1), "N[t=-2]");
    assert_eq!(scene.take(Kind::NodeDeath, None, death(3)), "N-stale");
    assert!(!scene.followed.is_born());
    scene.later(5.0);
    assert_eq!(scene.data(2), "ask", "a node that was buried speaks");
    assert_eq!(scene.node_birth(4), "N[bdSeq=4,t=-1,u=7]");
    assert_eq!(scene.device(Kind::DeviceBirth, 1), "D[t=-1,u=7]");
    assert_eq!(scene.device(Kind::DeviceDeath, 2), "D-stale");
    scene.later(5.0);
    assert_eq!(scene.device(Kind::DeviceData, 3), "ask");
    assert_eq!(scene.data(4), "N[t=-2]", "the node itself lives");
}

#[test]
fn messages_wait_for_a_missing_one_where_the_order_is_not_kept() {
    let mut scene = Scene::new(Duration::from_secs(2));
    scene.node_birth(0);
    assert_eq!((scene.data(2), scene.data(4), scene.later(1.0)), Default::default());
    assert_eq!(scene.data(1), "N[t=-2] N[t=-2]");
    assert_eq!(scene.followed.early.len(), 1);
    assert_eq!(scene.data(3), "N[t=-2] N[t=-2]");
    assert_eq!(scene.followed.due(), None);
    assert_eq!((scene.data(6), scene.later(1.9)), Default::default());
    assert_eq!(scene.later(0.1), "ask");
    assert_eq!(scene.followed.next, Some(7));
}

#[test]
fn a_flood_of_early_messages_is_bounded() {
    let mut scene = Scene::new(Duration::from_secs(60));
    scene.node_birth(0);
    let steps: Vec<String> = (2..100).map(|seq| scene.data(seq)).collect();
    assert!(scene.followed.early.len() <= WAITING_MAX && steps.concat().contains("ask"));
}

#[test]
fn after_an_outage_the_next_message_begins_the_order() {
    let mut scene = Scene::new(Duration::ZERO);
    scene.node_birth(0);
    scene.followed.reconnected(scene.now);
    assert!(scene.followed.is_awaited());
    assert_eq!(scene.take(Kind::NodeData, None, named(77, b't')), "N[t=-2]");
    assert_eq!(scene.data(78), "", "the caller has asked");
    assert_eq!(scene.take(Kind::NodeData, None, vec![0x0a]), "unreadable");
    scene.node_birth(0);
    assert!(!scene.followed.is_awaited());
}

const KINDS: [Kind; 6] = [
    Kind::NodeBirth,
    Kind::NodeData,
    Kind::NodeDeath,
    Kind::DeviceBirth,
    Kind::DeviceData,
    Kind::DeviceDeath,
];

/// A kind, whether it is of a device, garbage, and what is sent.
fn messages() -> impl Strategy<Value = Vec<(u8, bool, Vec<u8>, u8)>> {
    let garbage = proptest::collection::vec(any::<u8>(), 0..40);
    proptest::collection::vec((0..6_u8, any::<bool>(), garbage, 0..4_u8), 0..200)
}

proptest! {
    /// Strangers' messages: what is kept is bounded, and what is delivered has names.
    #[test]
    fn any_messages_are_survived(messages in messages()) {
        let mut scene = Scene::new(Duration::from_secs(1));
        for (kind, is_device, garbage, what) in messages {
            let kind = KINDS[usize::from(kind)];
            let seq = garbage.first().copied().unwrap_or(0);
            let payload = match what {
                0 => garbage,
                1 => birth(seq, Some(seq.into())),
                2 => data(seq, seq % 4),
                _ => named(seq, b't'),
            };
            scene.take(kind, is_device.then_some("D"), payload);
            scene.later(0.1);
            prop_assert!(scene.followed.early.len() <= WAITING_MAX);
        }
    }
}
