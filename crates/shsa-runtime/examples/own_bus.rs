//! A program with a bus of its own heals it from within: loads the model, runs the runtime in a thread, reads decisions and
//! state.

use shsa_bridge::{Clock, Inbox, Message, Outgoing, OwnBus, Payload};
use shsa_core::observation::RawValue;
use shsa_model::live::{Live, Written};
use shsa_runtime::{Ending, Model, Options, Order, Runtime, RuntimeError};
use std::sync::mpsc::channel;

const CAR: &str = "
shsa: 1
variables: { speed: { unit: m/s } }
signals:
  wheel: { variable: speed, properties: { accuracy: 0.9 } }
  radar: { variable: speed, properties: { accuracy: 0.8 } }
needs:
  speed: { signal: healed/speed, max_age: 1 min }
";

/// Returns the speeds published while both sensors publish and after an operator has forbidden the wheel, and the decisions.
pub(crate) fn run() -> Result<(Vec<f64>, Vec<String>), RuntimeError> {
    let (live, _) = Live::load(Written { name: "car", text: CAR }).expect("the model is right");
    let inbox = Inbox::new(64, Clock::running());
    let (sender, sent) = channel();
    let bus = OwnBus::new(inbox.clone(), move |message: Outgoing<'_>| {
        if let ("healed/speed", Payload::Value(RawValue::Interval { lo, hi })) =
            (message.topic, message.payload)
        {
            let _ = sender.send((lo + hi) / 2.0);
        }
        Ok(())
    });
    let model = Model { name: "car".to_owned(), path: None, live };
    let runtime = Runtime::new(vec![model], Options::default(), Box::new(bus))?;
    let (handle, events) = (runtime.handle(), runtime.handle().subscribe());
    let thread = std::thread::spawn(move || runtime.run());

    let publish = |topic: &str, speed: f64| {
        let payload = Payload::Value(RawValue::Number(speed));
        inbox.push(Message::new(topic.into(), inbox.clock().now(), payload));
    };
    let mut healed = Vec::new();
    publish("wheel", 5.0);
    healed.extend(sent.recv());
    handle.order(Order::read(r#"{"order": "forbid", "signal": "wheel"}"#).expect("it is an order"))?;
    publish("radar", 6.0);
    healed.extend(sent.recv());
    assert_eq!(handle.state()?["models"]["car"]["signals"]["radar"]["accepted"], 1);
    handle.stop();
    assert_eq!(thread.join().expect("the run does not panic")?, Ending::Served);
    Ok((healed, events.filter_map(|event| Some(event["kind"].as_str()?.to_owned())).collect()))
}

#[cfg_attr(test, allow(dead_code, reason = "the test runs what it does"))]
fn main() -> Result<(), RuntimeError> {
    let (healed, decisions) = run()?;
    println!("healed: {healed:?}; decided: {decisions:?}");
    Ok(())
}
