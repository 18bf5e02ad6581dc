//! The round-trip time of a broker, and the rate of one bridge: `cargo run --release -p shsa-bridge --features mqtt --example
//! mqtt_speed -- mqtt://127.0.0.1:1883`.

use shsa_bridge::mqtt::{MqttBridge, Options};
use shsa_bridge::{Bridge, Clock, Inbox, Outgoing, Payload};
use shsa_core::time::Time;
use std::time::{Duration, Instant};

const ROUNDS: usize = 2000;
const BURST: usize = 50_000;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let address = std::env::args().nth(1).ok_or("give the broker's address, as mqtt://127.0.0.1:1883")?;
    let open = |name: &str| {
        let inbox = Inbox::new(BURST, Clock::running());
        MqttBridge::open(&Options::parse(&address, name)?, inbox)
    };
    let (mut near, mut far) = (open("speed-near")?, open("speed-far")?);
    near.subscribe("speed/pong", None)?;
    far.subscribe("speed/ping", None)?;
    std::thread::sleep(Duration::from_millis(500));
    round_trips(&mut near, &mut far)?;
    burst(&mut near, &mut far)?;
    Ok(())
}

/// One message to the far bridge and one back, a thousand times a second.
fn round_trips(near: &mut MqttBridge, far: &mut MqttBridge) -> Result<(), Box<dyn std::error::Error>> {
    let mut times = Vec::with_capacity(ROUNDS);
    for round in 0..ROUNDS {
        let start = Instant::now();
        send(near, "speed/ping", round)?;
        await_one(far);
        send(far, "speed/pong", round)?;
        await_one(near);
        times.push(start.elapsed());
        std::thread::sleep(Duration::from_millis(1).saturating_sub(start.elapsed()));
    }
    times.sort();
    let at = |share: f64| times.get((ROUNDS as f64 * share) as usize).copied().unwrap_or_default();
    println!("there and back: p50 {:?}, p99 {:?}", at(0.5), at(0.99));
    Ok(())
}

/// As many messages as possible.
fn burst(near: &mut MqttBridge, far: &mut MqttBridge) -> Result<(), Box<dyn std::error::Error>> {
    let start = Instant::now();
    for number in 0..BURST {
        send(near, "speed/ping", number)?;
        // No more at once than the bridge's queue takes, so that no message is dropped.
        while number % 128 == 0 && number > far_count(far) + 512 {
            std::thread::sleep(Duration::from_micros(50));
        }
    }
    while far_count(far) < BURST {
        std::thread::sleep(Duration::from_millis(1));
        if start.elapsed() > Duration::from_secs(60) {
            break;
        }
    }
    let (count, elapsed) = (far_count(far), start.elapsed());
    println!(
        "{count} of {BURST} messages in {elapsed:?}: {:.0} a second",
        count as f64 / elapsed.as_secs_f64()
    );
    Ok(())
}

fn far_count(far: &MqttBridge) -> usize {
    far.inbox().len()
}

fn send(bridge: &mut MqttBridge, topic: &str, number: usize) -> Result<(), shsa_bridge::BridgeError> {
    let payload = format!(r#"{{"speed": {number}.5, "stamp": 1700000000.25}}"#);
    bridge.publish(Outgoing::new(topic, Time(1), Payload::Bytes(payload.into())))
}

fn await_one(bridge: &mut MqttBridge) {
    while bridge.receive().is_none() {
        bridge.inbox().wait(Duration::from_secs(5));
    }
}
