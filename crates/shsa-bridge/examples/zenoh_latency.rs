//! The time of a message from one Zenoh bridge to the inbox of another, compared with the transport alone, and the rate.
//!
//! ```sh
//! cargo run --release -p shsa-bridge --features zenoh --example zenoh_latency
//! ```

use ::zenoh::qos::{CongestionControl, Priority};
use ::zenoh::{Config, Session, Wait};
use shsa_bridge::zenoh::{Options, ZenohBridge};
use shsa_bridge::{Bridge, Clock, Inbox, Outgoing, Payload};
use shsa_core::time::Time;
use std::error::Error;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

type Outcome = Result<(), Box<dyn Error>>;

/// At 1 kHz.
const MESSAGES: usize = 5_000;
const PERIOD: Duration = Duration::from_millis(1);
const PAYLOAD: &[u8; 64] = &[b'1'; 64];

fn main() -> Outcome {
    println!("64 bytes at 1 kHz over TCP on loopback, one way, {MESSAGES} messages:");
    shown("  a socket alone    ", socket()?);
    shown("  Zenoh alone       ", transport(false)?);
    shown("  the same, express ", transport(true)?);
    shown("  bridge to inbox   ", bridges()?);
    flood()
}

fn free_port() -> Result<u16, Box<dyn Error>> {
    Ok(TcpListener::bind("127.0.0.1:0")?.local_addr()?.port())
}

fn shown(what: &str, mut times: Vec<Duration>) {
    times.sort();
    let at = |share: f64| {
        let index = ((times.len() as f64 * share) as usize).min(times.len().saturating_sub(1));
        times.get(index).map_or(f64::NAN, |time| time.as_secs_f64() * 1e6)
    };
    println!("{what} p50 {:6.1} us   p99 {:6.1} us   p99.9 {:7.1} us", at(0.5), at(0.99), at(0.999));
}

/// Half of the round trip, so that one clock measures both ends.
fn socket() -> Result<Vec<Duration>, Box<dyn Error>> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let mut near = TcpStream::connect(listener.local_addr()?)?;
    let (mut far, _) = listener.accept()?;
    near.set_nodelay(true)?;
    far.set_nodelay(true)?;
    std::thread::spawn(move || {
        let mut buffer = [0; PAYLOAD.len()];
        while far.read_exact(&mut buffer).and_then(|()| far.write_all(&buffer)).is_ok() {}
    });
    let mut buffer = [0; PAYLOAD.len()];
    let mut times = Vec::with_capacity(MESSAGES);
    for _ in 0..MESSAGES {
        std::thread::sleep(PERIOD);
        let start = Instant::now();
        near.write_all(PAYLOAD)?;
        near.read_exact(&mut buffer)?;
        times.push(start.elapsed() / 2);
    }
    Ok(times)
}

fn session(side: &str, port: u16) -> Result<Session, Box<dyn Error>> {
    let mut config = Config::default();
    for (key, value) in [
        ("scouting/multicast/enabled", "false".to_owned()),
        ("listen/endpoints", "[]".to_owned()),
        (side, format!("[\"tcp/127.0.0.1:{port}\"]")),
    ] {
        config.insert_json5(key, &value).map_err(|problem| problem.to_string())?;
    }
    Ok(::zenoh::open(config).wait().map_err(|problem| problem.to_string())?)
}

fn transport(is_express: bool) -> Result<Vec<Duration>, Box<dyn Error>> {
    let port = free_port()?;
    let (far, near) = (session("listen/endpoints", port)?, session("connect/endpoints", port)?);
    let (sender, arrivals) = channel();
    let subscriber = far.declare_subscriber("x").callback(move |_| {
        let _ = sender.send(Instant::now());
    });
    let _subscriber = subscriber.wait().map_err(|problem| problem.to_string())?;
    let publisher = near.declare_publisher("x").express(is_express);
    let publisher = publisher.priority(Priority::RealTime).congestion_control(CongestionControl::Drop);
    let publisher = publisher.wait().map_err(|problem| problem.to_string())?;
    std::thread::sleep(Duration::from_millis(500));
    let mut times = Vec::with_capacity(MESSAGES);
    for _ in 0..MESSAGES {
        std::thread::sleep(PERIOD);
        let start = Instant::now();
        publisher.put(PAYLOAD).wait().map_err(|problem| problem.to_string())?;
        times.push(arrivals.recv_timeout(Duration::from_secs(1))?.saturating_duration_since(start));
    }
    Ok(times)
}

fn pair(capacity: usize) -> Result<(ZenohBridge, ZenohBridge), Box<dyn Error>> {
    let endpoint = format!("tcp/127.0.0.1:{}", free_port()?);
    let inbox = || Inbox::new(capacity, Clock::running());
    let listening = Options { listen: vec![endpoint.clone()], ..Options::default() };
    let mut far = ZenohBridge::open(&listening, inbox())?;
    far.subscribe("x", None)?;
    let near = ZenohBridge::open(&Options::to(&endpoint), inbox())?;
    std::thread::sleep(Duration::from_millis(500));
    Ok((near, far))
}

fn message(number: u32) -> Outgoing<'static> {
    Outgoing::new("x", Time(i64::from(number)), Payload::Bytes(PAYLOAD.as_slice().into()))
}

/// Until a waiting reader has the message.
fn bridges() -> Result<Vec<Duration>, Box<dyn Error>> {
    let (mut near, mut far) = pair(1024)?;
    let (sender, arrivals) = channel();
    std::thread::spawn(move || {
        for _ in 0..MESSAGES {
            while far.receive().is_none() {
                far.inbox().wait(Duration::from_secs(1));
            }
            if sender.send(Instant::now()).is_err() {
                return;
            }
        }
    });
    let mut times = Vec::with_capacity(MESSAGES);
    for number in 0..MESSAGES {
        std::thread::sleep(PERIOD);
        let start = Instant::now();
        near.publish(message(number as u32))?;
        times.push(arrivals.recv_timeout(Duration::from_secs(1))?.saturating_duration_since(start));
    }
    Ok(times)
}

/// Sends as fast as possible for two seconds, and counts the arrivals.
fn flood() -> Outcome {
    let (mut near, mut far) = pair(1 << 20)?;
    let start = Instant::now();
    let mut sent = 0_u32;
    while start.elapsed() < Duration::from_secs(2) {
        near.publish(message(sent))?;
        sent += 1;
    }
    let sending = start.elapsed();
    let (mut read, mut last) = (0_u64, Instant::now());
    while last.elapsed() < Duration::from_millis(500) {
        if far.receive().is_some() {
            (read, last) = (read + 1, Instant::now());
        } else {
            far.inbox().wait(Duration::from_millis(50));
        }
    }
    let dropped = far.inbox().dropped();
    println!(
        "flooded: {:.0} messages/s sent, {:.2} % of them arrived",
        f64::from(sent) / sending.as_secs_f64(),
        100.0 * (read + dropped) as f64 / f64::from(sent),
    );
    Ok(())
}
