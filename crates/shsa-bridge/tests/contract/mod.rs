//! The contract of every bridge: order, reconnection, bursts, huge and invalid payloads, ending, no echo, resistance to a flood,
//! answers to questions.

use bytes::Bytes;
use shsa_bridge::{Bridge, BridgeError, Clock, Inbox, Link, Message, Outgoing, Payload, Question};
use shsa_core::time::Time;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// A middleware under test.
pub(crate) trait Middleware {
    /// A bridge of its own; it may take a while until the bridge is connected.
    fn bridge(&mut self, name: &str, inbox: Inbox) -> Box<dyn Bridge>;
    /// Breaks the connections between its bridges; `false`: they cannot break.
    fn break_it(&mut self) -> bool;
    /// Restores the connections.
    fn mend_it(&mut self);
    /// How its bridges ask each other.
    fn asking(&self) -> Asking;
    /// Whether its bridges always recognise their own messages.
    fn knows_own(&self) -> bool {
        true
    }
}

/// How bridges of a middleware ask each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Asking {
    /// By `request` and by `ask`.
    #[allow(dead_code, reason = "only some middlewares are so")]
    Queries,
    /// By `request` only; `ask` is silent.
    #[allow(dead_code, reason = "only some middlewares are so")]
    Messages,
    /// By `ask` only; requests do not go to bridges.
    #[allow(dead_code, reason = "only some middlewares are so")]
    Services,
    /// Not at all.
    #[allow(dead_code, reason = "only some middlewares are so")]
    Never,
}

/// A time limit that no step reaches, even on a busy machine.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);

/// Waits until a condition holds.
#[track_caller]
pub(crate) fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < PATIENCE, "{what}: not within {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

pub(crate) fn inbox(capacity: usize) -> Inbox {
    Inbox::new(capacity, Clock::running())
}

pub(crate) fn send(bridge: &mut dyn Bridge, topic: &str, payload: &str) {
    send_bytes(bridge, topic, payload.as_bytes().to_vec());
}

pub(crate) fn send_bytes(bridge: &mut dyn Bridge, topic: &str, payload: Vec<u8>) {
    bridge.publish(Outgoing::new(topic, Time(1), Payload::Bytes(payload.into()))).unwrap();
}

#[track_caller]
pub(crate) fn bytes(message: &Message) -> &[u8] {
    let Payload::Bytes(bytes) = &message.payload else { panic!("bytes were sent") };
    bytes
}

pub(crate) fn text(message: &Message) -> String {
    String::from_utf8_lossy(bytes(message)).into_owned()
}

/// The next message.
#[track_caller]
pub(crate) fn next(bridge: &mut dyn Bridge) -> Message {
    let mut found = None;
    until("a message", || {
        found = bridge.receive();
        found.is_some()
    });
    found.unwrap()
}

/// All messages of a topic up to this payload, without repetitions after a break of the connection.
#[track_caller]
#[allow(dead_code, reason = "not every middleware keeps messages")]
pub(crate) fn until_payload(bridge: &mut dyn Bridge, topic: &str, last: &str) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    while all.last().is_none_or(|payload| payload != last) {
        let message = next(bridge);
        if &*message.topic == topic && !all.contains(&text(&message)) {
            all.push(text(&message));
        }
    }
    all
}

/// Publishes on a topic until the subscriber receives it: from then on it receives everything.
#[track_caller]
pub(crate) fn join_up(source: &mut dyn Bridge, sink: &mut dyn Bridge, topic: &str) {
    sink.subscribe(topic, None).unwrap();
    until("the first message", || {
        send(source, topic, "probe");
        std::thread::sleep(Duration::from_millis(20));
        sink.receive().is_some()
    });
    send(source, topic, "go");
    until("the last probe", || sink.receive().is_some_and(|message| text(&message) == "go"));
}

fn pair(
    middleware: &mut impl Middleware,
    capacity: usize,
    topic: &str,
) -> (Box<dyn Bridge>, Box<dyn Bridge>) {
    let mut source = middleware.bridge("source", inbox(capacity));
    let mut sink = middleware.bridge("sink", inbox(capacity));
    join_up(&mut *source, &mut *sink, topic);
    (source, sink)
}

pub(crate) fn messages_come_in_their_order(mut middleware: impl Middleware) {
    let (mut source, mut sink) = pair(&mut middleware, 4096, "a/x");
    sink.subscribe("a/y", None).unwrap();
    join_up(&mut *source, &mut *sink, "a/y");
    for number in 0..500 {
        send(&mut *source, if number % 3 == 0 { "a/y" } else { "a/x" }, &number.to_string());
    }
    let got: Vec<String> = (0..500).map(|_| text(&next(&mut *sink))).collect();
    // Middlewares promise an order within a topic, not between topics.
    for rest in [0, 1] {
        let of_topic = |text: &&String| (text.parse::<u32>().unwrap() % 3 == 0) == (rest == 0);
        let numbers: Vec<u32> = got.iter().filter(of_topic).map(|text| text.parse().unwrap()).collect();
        assert!(numbers.is_sorted(), "{numbers:?}");
    }
    assert_eq!(got.len(), 500);
}

pub(crate) fn who_has_not_subscribed_gets_nothing(mut middleware: impl Middleware) {
    let (mut source, mut sink) = pair(&mut middleware, 64, "a/x");
    send(&mut *source, "a/other", "1");
    send(&mut *source, "a/x", "2");
    assert_eq!(text(&next(&mut *sink)), "2");
    assert_eq!(sink.receive(), None);
}

pub(crate) fn a_burst_arrives_in_order_up_to_its_newest(mut middleware: impl Middleware) {
    let (mut source, mut sink) = pair(&mut middleware, 20_000, "a/x");
    for number in 0..10_000 {
        send(&mut *source, "a/x", &number.to_string());
    }
    // A waiting message may be replaced by a newer one: only the newest is promised.
    until_payload_sorted(&mut *sink, 9_999);
}

#[track_caller]
fn until_payload_sorted(sink: &mut dyn Bridge, last: u32) {
    let mut before = None;
    while before != Some(last) {
        let number = text(&next(sink)).parse().unwrap();
        assert!(before.is_none_or(|before| before < number), "{number} after {before:?}");
        before = Some(number);
    }
}

pub(crate) fn a_huge_payload_harms_nobody(mut middleware: impl Middleware) {
    let (mut source, mut sink) = pair(&mut middleware, 64, "a/x");
    let large = vec![b'7'; 1 << 20];
    send_bytes(&mut *source, "a/x", large.clone());
    assert!(bytes(&next(&mut *sink)) == large, "a megabyte arrives as it is");
    // Too large for some bridges: refused by the sender, dropped by the receiver, or delivered.
    let _refused = source.publish(Outgoing::new("a/x", Time(1), Payload::Bytes(vec![b'8'; 20 << 20].into())));
    send(&mut *source, "a/x", "after");
    until("what comes after it", || sink.receive().is_some_and(|message| bytes(&message) == b"after"));
}

pub(crate) fn garbage_is_delivered_as_it_is(mut middleware: impl Middleware) {
    let (mut source, mut sink) = pair(&mut middleware, 1024, "a/x");
    for length in 1..200_u8 {
        let garbage: Vec<u8> = (0..length).map(|at| at.wrapping_mul(151).wrapping_add(length)).collect();
        send_bytes(&mut *source, "a/x", garbage.clone());
        assert_eq!(bytes(&next(&mut *sink)), garbage);
    }
}

pub(crate) fn own_messages_do_not_come_back(mut middleware: impl Middleware) {
    let (mut source, mut healer) = pair(&mut middleware, 64, "a/x");
    source.subscribe("a/x", None).unwrap();
    join_up(&mut *healer, &mut *source, "a/x");
    for number in 0..20 {
        send(&mut *healer, "a/x", &format!("healed {number}"));
        assert_eq!(text(&next(&mut *source)), format!("healed {number}"));
    }
    send(&mut *source, "a/x", "from the source");
    assert_eq!(text(&next(&mut *healer)), "from the source");
    assert_eq!(healer.receive(), None);
}

pub(crate) fn a_flood_of_one_topic_costs_no_other(mut middleware: impl Middleware) {
    let (mut source, mut sink) = pair(&mut middleware, 16, "a/flood");
    let mut calm_source = middleware.bridge("calm", inbox(16));
    join_up(&mut *calm_source, &mut *sink, "a/calm");
    for number in 0..5_000 {
        send(&mut *source, "a/flood", &number.to_string());
        if number % 500 == 0 {
            send(&mut *calm_source, "a/calm", &number.to_string());
            std::thread::sleep(Duration::from_millis(2));
        }
    }
    let last = "4999".as_bytes();
    let mut calm = Vec::new();
    let mut is_over = false;
    until("the end of the flood", || {
        while let Some(message) = sink.receive() {
            is_over |= bytes(&message) == last;
            calm.extend((&*message.topic == "a/calm").then(|| text(&message)));
        }
        is_over && calm.len() == 10
    });
    let expected: Vec<String> = (0..10).map(|number| (number * 500).to_string()).collect();
    assert_eq!(calm, expected);
}

/// Answers questions under `a/q` with their own text and an exclamation mark; returns the questions.
fn echo(server: &mut dyn Bridge) -> Arc<Mutex<Vec<Bytes>>> {
    let asked: Arc<Mutex<Vec<Bytes>>> = Arc::default();
    let seen = asked.clone();
    let answer = move |question: Question| {
        seen.lock().unwrap().push(question.payload.clone());
        let words = [&*question.payload, b"!"].concat();
        question.answer(words.into());
    };
    server.serve("a/q", "a/q/response", Arc::new(answer)).unwrap();
    asked
}

/// Repeats a request until it is answered: a new server takes a moment to be known everywhere.
#[track_caller]
fn answer_to(asker: &mut dyn Bridge, words: &[u8]) -> Bytes {
    let mut answer = None;
    until("an answer", || {
        let asked = asker.request("a/q", Bytes::copy_from_slice(words), Duration::from_millis(500));
        answer = asked.and_then(|wait| wait()).ok();
        answer.is_some()
    });
    answer.unwrap()
}

pub(crate) fn who_asks_gets_the_answer(mut middleware: impl Middleware) {
    if matches!(middleware.asking(), Asking::Services | Asking::Never) {
        return;
    }
    let (mut server, mut asker) = pair(&mut middleware, 64, "a/x");
    let asked = echo(&mut *server);
    assert_eq!(answer_to(&mut *asker, b"first"), "first!");
    // Earlier requests may be answered late, and not every middleware tells which question an answer belongs to.
    std::thread::sleep(Duration::from_secs(1));
    // A long invalid payload is a question as well.
    let large: Vec<u8> = (0..100_000_u32).map(|at| (at.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let answer = asker.request("a/q", large.clone().into(), PATIENCE).and_then(|wait| wait()).unwrap();
    assert!(answer.strip_suffix(b"!") == Some(&large[..]));
    assert!(asked.lock().unwrap().iter().all(|words| *words == "first" || *words == large));
    // With several requests under way, each gets its own answer, in the order of asking.
    let asked = ["1", "2", "3"].map(|words| {
        let words = Bytes::from_static(words.as_bytes());
        asker.request("a/q", words, PATIENCE).unwrap()
    });
    let answers: Vec<Bytes> = asked.into_iter().map(|wait| wait().unwrap()).collect();
    assert_eq!(answers, ["1!", "2!", "3!"]);
    // A question does not arrive as a message at its server.
    assert_eq!(server.receive(), None);
}

pub(crate) fn a_request_that_nobody_answers_ends_in_its_time(mut middleware: impl Middleware) {
    let (_other, mut asker) = pair(&mut middleware, 64, "a/x");
    let start = Instant::now();
    let asked = asker.request("a/nobody", Bytes::from_static(b"?"), Duration::from_millis(300));
    let answer = asked.and_then(|wait| wait());
    let is_refused = middleware.asking() == Asking::Never
        && matches!(&answer, Err(BridgeError::Configuration(why)) if why.contains("no requests"));
    assert!(is_refused || matches!(answer, Err(BridgeError::Lost(_))), "{answer:?}");
    assert!(start.elapsed() < PATIENCE / 2, "{:?}", start.elapsed());
}

/// Asks once under `a/q`; returns the receiver of the answer.
fn ask(asker: &dyn Bridge, longest: usize) -> Receiver<Vec<u8>> {
    let (sender, answers) = channel();
    asker.ask("a/q", longest, Box::new(move |words| drop(sender.send(words)))).unwrap();
    answers
}

pub(crate) fn who_asks_without_waiting_is_given_the_first_answer_that_fits(mut middleware: impl Middleware) {
    let (mut server, asker) = pair(&mut middleware, 64, "a/x");
    let text = |question: Question| question.answer(Bytes::from_static(b"17 bytes of words"));
    server.serve("a/q", "a/q/response", Arc::new(text)).unwrap();
    let short = |longest| ask(&*asker, longest).recv_timeout(Duration::from_millis(500)).ok();
    if matches!(middleware.asking(), Asking::Messages | Asking::Never) {
        assert_eq!(short(17), None);
        return;
    }
    until("an answer", || short(17).as_deref() == Some(b"17 bytes of words"));
    assert_eq!(short(16), None, "longer than was asked for");
}

pub(crate) fn what_others_say_in_the_same_words_is_theirs(mut middleware: impl Middleware) {
    let (mut source, mut healer) = pair(&mut middleware, 64, "a/x");
    assert_eq!(healer.knows_own(), middleware.knows_own());
    if !healer.knows_own() {
        return;
    }
    for number in 0..20 {
        send(&mut *healer, "a/x", &number.to_string());
        send(&mut *source, "a/x", &number.to_string());
        assert_eq!(text(&next(&mut *healer)), number.to_string());
    }
    assert_eq!(healer.receive(), None);
}

pub(crate) fn it_comes_back_after_a_break(mut middleware: impl Middleware) {
    let (mut source, mut sink) = pair(&mut middleware, 1024, "a/x");
    if !middleware.break_it() {
        return;
    }
    until("the break is noticed", || {
        matches!(source.link(), Link::Down(_)) && matches!(sink.link(), Link::Down(_))
    });
    middleware.mend_it();
    until("it is mended", || source.link() == Link::Up && sink.link() == Link::Up);
    until("the first message after it", || {
        send(&mut *source, "a/x", "after");
        std::thread::sleep(Duration::from_millis(20));
        sink.receive().is_some_and(|message| text(&message) == "after")
    });
}

pub(crate) fn it_ends_when_it_is_dropped(mut middleware: impl Middleware) {
    let (mut source, sink) = pair(&mut middleware, 64, "a/x");
    let start = Instant::now();
    drop(sink);
    send(&mut *source, "a/x", "to nobody");
    drop(source);
    // Ending must work without a connection, too.
    let alone = middleware.bridge("alone", inbox(4));
    middleware.break_it();
    drop(alone);
    assert!(start.elapsed() < Duration::from_secs(8), "{:?}", start.elapsed());
}

/// Runs a test in this process.
#[allow(dead_code, reason = "some middlewares need a network of their own")]
pub(crate) fn here(_: &str, test: impl FnOnce()) {
    test();
}

/// Makes each promise a test of its own, in a module of this name; the second part makes the middleware, the third runs a test by
/// its name.
macro_rules! contract {
    ($name:ident, $middleware:expr) => {
        contract!($name, $middleware, contract::here);
    };
    ($name:ident, $middleware:expr, $run:path) => {
        mod $name {
            use super::*;
            contract!(@tests $name, $middleware, $run;
                messages_come_in_their_order
                who_has_not_subscribed_gets_nothing
                a_burst_arrives_in_order_up_to_its_newest
                a_huge_payload_harms_nobody
                garbage_is_delivered_as_it_is
                own_messages_do_not_come_back
                a_flood_of_one_topic_costs_no_other
                who_asks_gets_the_answer
                a_request_that_nobody_answers_ends_in_its_time
                who_asks_without_waiting_is_given_the_first_answer_that_fits
                what_others_say_in_the_same_words_is_theirs
                it_comes_back_after_a_break
                it_ends_when_it_is_dropped
            );
        }
    };
    (@tests $name:ident, $middleware:expr, $run:path; $($test:ident)*) => {
        $(#[test]
        fn $test() {
            $run(concat!(stringify!($name), "::", stringify!($test)), || contract::$test($middleware));
        })*
    };
}
