//! Questions and orders over the bus, by independent clients.

use crate::broker::Broker;
use crate::car::{MODEL, client_of, router};
use crate::real::{self, Script};
use crate::running::{Running, TOKEN};
use serde_json::{Value, json};
use std::cell::Cell;
use std::path::Path;
use std::time::Duration;

/// An asking and a listening client: a single one could receive an answer before it reports that it has asked.
struct Client {
    asks: Script,
    hears: Script,
}

impl Client {
    /// A client over MQTT that subscribes to these topics.
    fn start(python: &Path, port: u16, version: u32, topics: &[&str]) -> Client {
        let start = |name: &str| {
            let argument = json!({ "name": format!("{name}-{version}"), "port": port, "version": version });
            Script::start(python, "../../../shsa-bridge/tests/python/mqtt_client.py", &argument)
        };
        let (asks, mut hears) = (start("asks"), start("hears"));
        topics.iter().for_each(|topic| hears.order(&json!({ "subscribe": topic })));
        Client { asks, hears }
    }

    #[track_caller]
    fn order(&mut self, order: &Value) {
        self.asks.order(order);
    }

    /// The next message, except the status of a need, which comes unasked.
    #[track_caller]
    fn next(&mut self) -> Value {
        loop {
            let message = self.hears.next_with("topic");
            if message["topic"] != "shsa/x/need/speed" || message["correlation"] != "" {
                return message;
            }
        }
    }
}

/// The JSON of a received message.
#[track_caller]
fn words(message: &Value) -> Value {
    let hex = message["hex"].as_str().unwrap_or_else(|| panic!("{message}"));
    let bytes = (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap());
    serde_json::from_slice(&bytes.collect::<Vec<_>>()).unwrap()
}

#[track_caller]
fn ask(client: &mut Client, request: &Value) -> Value {
    client.order(&json!({ "publish": "shsa/x/request", "text": request.to_string() }));
    words(&client.next())
}

fn forbid(token: &str) -> Value {
    json!({ "id": "f", "order": { "order": "forbid", "signal": "wheel_1" }, "token": token })
}

/// Starts an instance named `x`, and waits until it answers.
fn start(address: &str) -> Running {
    Running::start([MODEL, "--bus", address, "--name", "x"])
}

/// Waits until the counts of requests are as expected.
#[track_caller]
fn tally(run: &Running, expected: &Value) {
    run.until(&format!("the requests are {expected}"), |state| {
        let counts = expected.as_object().unwrap();
        counts.iter().all(|(name, count)| state["requests"][name] == *count)
    });
}

#[test]
fn over_mqtt_it_answers_and_obeys_who_has_the_token() {
    let Some(python) = real::python() else { return };
    let broker = Broker::start(&[]);
    let run = start(&format!("mqtt://127.0.0.1:{}", broker.port()));
    for (version, order) in [(4, "forbid"), (5, "allow")] {
        let mut client = Client::start(&python, broker.port(), version, &["shsa/x/answer"]);
        let health = ask(&mut client, &json!({ "id": 1, "ask": "health" }));
        assert_eq!((&health["id"], &health["done"]["connected"]), (&json!(1), &json!(true)), "{health}");
        let refused = ask(&mut client, &json!({ "id": 2, "order": { "order": "reload" } }));
        assert_eq!(refused, json!({ "id": 2, "refused": "needs the right `token`" }));
        let order = json!({ "order": order, "signal": "wheel_1" });
        let done = ask(&mut client, &json!({ "id": "f", "order": order, "token": TOKEN }));
        assert!(done["done"].as_str().unwrap().contains("wheel_1"), "{done}");
        run.decision("ordered");
        let wrong = json!({ "id": 3, "order": { "order": "explode" }, "token": TOKEN });
        let refused = ask(&mut client, &wrong);
        assert!(refused["refused"].as_str().unwrap().contains("no order `explode`"), "{refused}");
        let events = ask(&mut client, &json!({ "id": 4, "ask": "events", "since": 0 }));
        assert!(events["done"].as_array().unwrap().iter().any(|event| event["kind"] == "ordered"));
    }
    tally(&run, &json!({ "done": 6, "refused": 4, "unreadable": 0, "crowded": 0 }));
    let (_, metrics) = run.get("/metrics");
    assert!(metrics.as_str().unwrap().contains(r#"shsa_bus_requests_total{outcome="done"} 6"#), "{metrics}");
}

#[test]
fn an_answer_goes_where_answers_may_go_and_nowhere_else() {
    let Some(python) = real::python() else { return };
    let broker = Broker::start(&[]);
    let run = start(&format!("mqtt://127.0.0.1:{}", broker.port()));
    let topics = ["shsa/x/answer/#", "/car/speed", "wheel_speed", "elsewhere", "shsa/x/need/speed"];
    let mut client = Client::start(&python, broker.port(), 5, &topics);
    let request = |response: &str| {
        let text = json!({ "id": 1, "ask": "health" }).to_string();
        json!({ "publish": "shsa/x/request", "text": text, "response": response, "correlation": "c0ffee" })
    };
    client.order(&request("shsa/x/answer/me"));
    let answer = client.next();
    assert_eq!((&answer["topic"], &answer["correlation"]), (&json!("shsa/x/answer/me"), &json!("c0ffee")));
    assert_eq!(words(&answer)["done"]["connected"], true);
    for foreign in ["/car/speed", "wheel_speed", "elsewhere", "shsa/x/need/speed", "shsa/x/answers"] {
        client.order(&request(foreign));
        let answer = client.next();
        assert_eq!(answer["topic"], "shsa/x/answer", "{answer}");
        assert_eq!(answer["correlation"], "c0ffee");
        assert!(words(&answer)["refused"].as_str().unwrap().ends_with(&format!("not to {foreign}")));
    }
    tally(&run, &json!({ "done": 1, "refused": 5 }));
}

#[test]
fn guessing_garbage_and_old_requests_over_mqtt_change_nothing() {
    let Some(python) = real::python() else { return };
    let broker = Broker::start(&[]);
    let address = format!("mqtt://127.0.0.1:{}", broker.port());
    let mut client = Client::start(&python, broker.port(), 5, &["shsa/x/answer"]);
    // A retained message was kept by the broker and may be of any age.
    let order = |retain: bool| json!({ "publish": "shsa/x/request", "text": forbid(TOKEN).to_string(), "retain": retain });
    client.order(&order(true));
    let run = start(&address);
    let refused = words(&client.next());
    assert!(refused["refused"].as_str().unwrap().contains("retained"), "{refused}");

    for garbage in ["", "{", "[1]", "{}", "{\"id\": {}}", "null"] {
        client.order(&json!({ "publish": "shsa/x/request", "text": garbage }));
    }
    tally(&run, &json!({ "unreadable": 6 }));
    client.order(&json!({ "publish": "shsa/x/request", "hex": "00ff".repeat(600_000) }));
    tally(&run, &json!({ "unreadable": 7 }));

    for _ in 0..5 {
        let wrong = ask(&mut client, &forbid("a guess that is wrong"));
        assert_eq!(wrong["refused"], "needs the right `token`");
    }
    let later = ask(&mut client, &forbid("another guess"));
    assert_eq!(later["refused"], "too many wrong tokens; try again later");
    // A guesser on the bus locks out nobody.
    let done = ask(&mut client, &forbid(TOKEN));
    assert!(done["done"].as_str().unwrap().contains("wheel_1"), "{done}");
    assert_eq!(run.order(Some(TOKEN), r#"{"order": "reload"}"#).0, 200);
    let (_, events) = run.get("/events");
    let kinds: Vec<&str> = events.as_array().unwrap().iter().map(|it| it["kind"].as_str().unwrap()).collect();
    let mut told = kinds.clone();
    told.retain(|kind| ["denied", "ordered"].contains(kind));
    assert_eq!(told, ["denied", "denied", "ordered", "ordered"], "{events}");
    let (_, state) = run.get("/state");
    assert!(!state.to_string().contains(TOKEN));

    // A request that is sent during an absence of the run is not carried out later.
    run.kill();
    client.order(&json!({ "publish": "shsa/x/request", "text": "", "retain": true }));
    client.order(&order(false));
    let run = start(&address);
    let question = json!({ "publish": "shsa/x/request", "text": r#"{ "id": 9, "ask": "health" }"# });
    // The question is lost until the run has subscribed.
    let answer = (0..40).find_map(|_| {
        client.order(&question);
        client
            .hears
            .poll("correlation", Duration::from_millis(500))
            .filter(|it| it["topic"] == "shsa/x/answer")
    });
    let health = words(&answer.expect("an answer"));
    assert_eq!(health["id"], 9, "{health}");
    tally(&run, &json!({ "refused": 0 }));
}

#[test]
fn a_flood_of_requests_is_bounded_and_the_run_goes_on() {
    let Some(python) = real::python() else { return };
    let broker = Broker::start(&[]);
    let run = start(&format!("mqtt://127.0.0.1:{}", broker.port()));
    let mut client = Client::start(&python, broker.port(), 5, &[]);
    let text = json!({ "id": 1, "ask": "state" }).to_string();
    client.order(&json!({ "publish": "shsa/x/request", "text": text, "times": 5_000, "qos": 0 }));
    run.until("some were dropped", |state| state["requests"]["crowded"].as_u64() > Some(100));
    assert_eq!(run.get("/health").1["connected"], true);
    let done = Cell::new(0);
    run.until("the rest is answered", |state| {
        let before = done.replace(state["requests"]["done"].as_u64().unwrap());
        std::thread::sleep(Duration::from_millis(200));
        before > 0 && before == done.get()
    });
    assert!(done.get() < 5_000, "{}", done.get());
}

#[test]
fn looking_over_mqtt_needs_the_token_where_one_is_given() {
    let Some(python) = real::python() else { return };
    let broker = Broker::start(&[]);
    let address = format!("mqtt://127.0.0.1:{}", broker.port());
    let view = "a-token-for-looking-only";
    let variable = format!("SHSA_VIEW_TOKEN={view}");
    let run = Running::start_under(&["env", &variable], [MODEL, "--bus", &address, "--name", "x"]);
    let mut client = Client::start(&python, broker.port(), 5, &["shsa/x/answer"]);
    let question = |token: Option<&str>, ask: &str| match token {
        Some(token) => json!({ "id": 1, "ask": ask, "token": token }),
        None => json!({ "id": 1, "ask": ask }),
    };
    assert_eq!(ask(&mut client, &question(None, "state"))["refused"], "needs the right `token`");
    for token in [view, TOKEN] {
        assert_eq!(ask(&mut client, &question(Some(token), "state"))["done"]["name"], "x");
    }
    assert!(ask(&mut client, &question(None, "health"))["done"]["needs"].is_object());
    assert_eq!(ask(&mut client, &forbid(view))["refused"], "needs the right `token`");
    drop(run);
}

#[test]
fn over_zenoh_queries_are_answered_and_orders_obeyed() {
    let Some(python) = real::python() else { return };
    let (mut client, port) = router(&python);
    let run = start(&format!("zenoh://127.0.0.1:{port}"));
    run.until("it is connected", |state| state["link"]["up"] == true);
    let mut get = |selector: &str, text: Option<String>| -> (String, Value) {
        let order = match text {
            Some(text) => json!({ "get": selector, "text": text }),
            None => json!({ "get": selector }),
        };
        // It takes a moment until the server is known everywhere.
        let reply = real::eventually("a reply", || {
            Some(client.answer(&order, "reply")).filter(|reply| !reply["reply"].is_null())
        });
        let words = serde_json::from_str(reply["text"].as_str().unwrap());
        (reply["reply"].as_str().unwrap().to_owned(), words.unwrap_or(reply["text"].clone()))
    };
    let (key, state) = get("shsa/x/state", None);
    assert_eq!((key.as_str(), &state["name"]), ("shsa/x/state", &json!("x")), "{state}");
    let (key, health) = get("shsa/*/health", None);
    assert_eq!((key.as_str(), &health["connected"]), ("shsa/x/health", &json!(true)), "{health}");
    let (_, metrics) = get("shsa/x/metrics", None);
    assert!(metrics.as_str().unwrap().contains("shsa_messages_total"), "{metrics}");
    let (_, refused) = get("shsa/x/request", Some(forbid("a guess that is wrong").to_string()));
    assert_eq!(refused, json!({ "id": "f", "refused": "needs the right `token`" }));
    let (_, refused) = get("shsa/x/request", Some("{".into()));
    assert_eq!(refused, json!({ "id": null, "refused": "a request is a JSON object" }));
    let (_, done) = get("shsa/x/request", Some(forbid(TOKEN).to_string()));
    assert!(done["done"].as_str().unwrap().contains("wheel_1"), "{done}");
    let number = run.decision("ordered")["number"].as_u64().unwrap();
    let (_, events) = get(&format!("shsa/x/events?since={number}"), None);
    assert_eq!(events[0]["kind"], "ordered", "{events}");

    // The answer to a publication goes to the topic of answers.
    let (config, script) = (client_of(port), "../../../shsa-bridge/tests/python/zenoh_client.py");
    let mut hears = Script::start(&python, script, &config);
    hears.order(&json!({ "subscribe": "shsa/x/answer" }));
    // It takes a moment until the subscription is known everywhere.
    std::thread::sleep(Duration::from_millis(500));
    let order = json!({ "id": 5, "order": { "order": "allow", "signal": "wheel_1" }, "token": TOKEN });
    client.order(&json!({ "put": "shsa/x/request", "text": order.to_string() }));
    let answer = words(&hears.next_with("key"));
    assert_eq!(answer["id"], 5, "{answer}");
    assert!(answer["done"].as_str().unwrap().contains("wheel_1"), "{answer}");
    run.decision("ordered");
}
