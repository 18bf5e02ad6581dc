//! `shsa-demos platoon`: two trucks, each with an instance of its own, over Zenoh within this machine.
//!
//! Sensors on board hand their values to the instance of their truck. What the trucks tell each other goes over Zenoh, by a radio
//! link that can be cut.

use super::radio::Radio;
use crate::Outcome;
use anyhow::{Context, anyhow, bail};
use serde_json::{Value, json};
use shsa_bridge::memory::MemoryBus;
use shsa_bridge::{Address, BusOptions, Clock, Inbox, Message, Payload};
use shsa_demos::platoon::{END_S, Happening, SCENARIO, Truck, readings};
use shsa_format::text::table;
use shsa_format::wiring::Form;
use shsa_model::live::{Live, Written};
use shsa_runtime::{Ending, Handle, Model, Options, Runtime, RuntimeError};
use std::io::{Write, stdout};
use std::net::{Ipv4Addr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// How often the states are looked at, and how often the sensors measure.
const LOOK: Duration = Duration::from_millis(50);
const PERIOD: Duration = Duration::from_millis(100);
/// How long the trucks may take to find each other, or to be served again.
const PATIENCE_S: f64 = 15.0;
/// Messages of one topic that may wait.
const QUEUE: usize = 64;

/// What serves a truck's need: the source, and its level.
type Served = (Option<String>, Option<String>);

/// A truck under way.
struct Aboard {
    truck: Truck,
    inbox: Inbox,
    handle: Handle,
    run: JoinHandle<Result<Ending, RuntimeError>>,
    served: Served,
}

/// What happened, by what each truck is served before it and in the end after it, and since when if that has changed.
struct Effect {
    happening: Happening,
    at_s: f64,
    before: [Served; 2],
    after: [Served; 2],
    changed_at_s: [Option<f64>; 2],
}

/// Plays the scenario; the answer is no if one of the trucks does not serve its need at the end as at the begin.
pub(super) fn run(as_json: bool) -> anyhow::Result<Outcome> {
    let port = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?.local_addr()?.port();
    let listening = vec![format!("tcp/127.0.0.1:{port}")];
    let leader = BusOptions { listen: listening, ..BusOptions::at(Address::Zenoh(Vec::new())) };
    let radio = Radio::to(port)?;
    let follower = BusOptions::at(Address::Zenoh(vec![format!("tcp/127.0.0.1:{}", radio.port)]));
    let mut aboard = [Aboard::new(Truck::Leader, &leader)?, Aboard::new(Truck::Follower, &follower)?];
    if !as_json {
        writeln!(
            stdout(),
            "Two trucks, each with an instance of its own. The first tells the second its speed, and at which level it vouches\n\
             for it, over Zenoh (tcp, 127.0.0.1 only).\n"
        )?;
    }
    let sensors = Sensors::start(&aboard)?;
    let mut play =
        Play { aboard: &mut aboard, radio: &radio, sensors: &sensors, effects: Vec::new(), as_json };
    let first = play.find_each_other()?;
    play.play_out(&first)?;
    let last = play.served();
    let effects = play.effects;
    let states: Vec<Value> = aboard.iter().map(Aboard::need).collect::<anyhow::Result<_>>()?;
    let is_as_before = first == last;
    sensors.stop()?;
    for truck in aboard {
        truck.handle.stop();
        truck.run.join().map_err(|_| anyhow!("the instance of {} has failed", truck.truck.name()))??;
    }
    let figures = match as_json {
        true => format!("{}\n", figures_json(&effects, &states, is_as_before)),
        false => figures(&effects, &states),
    };
    stdout().write_all(figures.as_bytes())?;
    Ok(if is_as_before { Outcome::Done } else { Outcome::No })
}

impl Aboard {
    fn new(truck: Truck, bus: &BusOptions) -> anyhow::Result<Aboard> {
        let (clock, name) = (Clock::running(), truck.name());
        let loaded = Live::load(Written { name, text: truck.model() });
        let (live, _) = loaded.map_err(|report| anyhow!("{}", report.render(false)))?;
        let inbox = Inbox::new(QUEUE, clock.clone());
        let bridge = bus.open(name, inbox.clone(), &MemoryBus::new(clock))?;
        let options = Options { name: name.to_owned(), form: Form::Json, ..Options::default() };
        let model = Model { name: name.to_owned(), path: None, live };
        let runtime = Runtime::new(vec![model], options, bridge)?;
        let handle = runtime.handle();
        let run = thread::Builder::new().name(name.to_owned()).spawn(move || runtime.run())?;
        Ok(Aboard { truck, inbox, handle, run, served: (None, None) })
    }

    /// The state of the truck's need.
    fn need(&self) -> anyhow::Result<Value> {
        let state = self.handle.state()?;
        Ok(state["models"][self.truck.name()]["needs"][self.truck.need()].clone())
    }

    /// Looks what serves the need; returns whether that has changed.
    fn look(&mut self) -> anyhow::Result<bool> {
        let need = self.need()?;
        let word = |value: &Value| value.as_str().map(str::to_owned);
        let level = word(&need["assurance"]["level"]).filter(|_| !need["source"].is_null());
        let served = (word(&need["source"]), level);
        Ok(std::mem::replace(&mut self.served, served.clone()) != served)
    }
}

/// The sensors on board of both trucks: they measure in a thread of their own, so that nothing that is looked at delays them.
struct Sensors {
    is_over: Arc<AtomicBool>,
    radar_works: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Sensors {
    fn start(aboard: &[Aboard; 2]) -> std::io::Result<Sensors> {
        let (is_over, radar_works) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(true)));
        let (over, works) = (is_over.clone(), radar_works.clone());
        let inboxes = aboard.each_ref().map(|truck| (truck.truck, truck.inbox.clone()));
        let thread = thread::Builder::new().name("sensors".to_owned()).spawn(move || {
            let started = Instant::now();
            for count in 1.. {
                for (truck, inbox) in &inboxes {
                    measure(*truck, inbox, started.elapsed().as_secs_f64(), works.load(Ordering::Relaxed));
                }
                if over.load(Ordering::Relaxed) {
                    return;
                }
                thread::sleep((PERIOD * count).saturating_sub(started.elapsed()));
            }
        })?;
        Ok(Sensors { is_over, radar_works, thread })
    }

    fn stop(self) -> anyhow::Result<()> {
        self.is_over.store(true, Ordering::Relaxed);
        self.thread.join().map_err(|_| anyhow!("the sensors have failed"))
    }
}

/// Hands what the sensors on board measure to the instance.
fn measure(truck: Truck, inbox: &Inbox, at_s: f64, radar_works: bool) {
    for reading in readings(truck, at_s, radar_works) {
        let bytes = json!({ reading.field: reading.value }).to_string().into_bytes();
        let received = inbox.clock().now();
        inbox.push(Message::new(reading.topic.into(), received, Payload::Bytes(bytes.into())));
    }
}

/// The scenario under way.
struct Play<'a> {
    aboard: &'a mut [Aboard; 2],
    radio: &'a Radio,
    sensors: &'a Sensors,
    effects: Vec<Effect>,
    as_json: bool,
}

impl Play<'_> {
    fn served(&self) -> [Served; 2] {
        self.aboard.each_ref().map(|truck| truck.served.clone())
    }

    /// Waits until both are served by the best source.
    fn find_each_other(&mut self) -> anyhow::Result<[Served; 2]> {
        let started = Instant::now();
        while started.elapsed().as_secs_f64() < PATIENCE_S {
            self.look()?;
            if self.aboard.iter().all(|truck| truck.served.1.as_deref() == Some("ASIL B")) {
                for truck in self.aboard.iter() {
                    self.print_line(0.0, truck.truck.name(), &described(&truck.served))?;
                }
                return Ok(self.served());
            }
        }
        bail!("the trucks have not found each other within {PATIENCE_S} s");
    }

    /// Plays the scenario, by the looks and not by the clock: nothing happens while a truck is served by nothing, as on a machine that
    /// stalls. At the end the trucks are to be served as at first.
    fn play_out(&mut self, first: &[Served; 2]) -> anyhow::Result<()> {
        let started = Instant::now();
        let mut scenario = SCENARIO.iter().peekable();
        let (mut played_s, mut waited_s) = (0.0, 0.0);
        while played_s < END_S || (self.served() != *first && waited_s < PATIENCE_S) {
            match scenario.peek() {
                Some((at_s, _)) if *at_s > played_s => played_s += LOOK.as_secs_f64(),
                Some(_) if !self.is_served() && waited_s < PATIENCE_S => waited_s += LOOK.as_secs_f64(),
                Some((_, happening)) => {
                    self.happen(*happening, started.elapsed().as_secs_f64())?;
                    scenario.next();
                    waited_s = 0.0;
                }
                None if played_s < END_S => played_s += LOOK.as_secs_f64(),
                None => waited_s += LOOK.as_secs_f64(),
            }
            for (at, has_changed) in self.look()?.into_iter().enumerate() {
                if has_changed {
                    self.note(at, started.elapsed().as_secs_f64())?;
                }
            }
        }
        Ok(())
    }

    /// Whether both trucks are served by something.
    fn is_served(&self) -> bool {
        self.aboard.iter().all(|truck| truck.served.0.as_ref().is_some_and(|source| !source.is_empty()))
    }

    fn happen(&mut self, happening: Happening, at_s: f64) -> anyhow::Result<()> {
        match happening {
            Happening::RadarFails => self.sensors.radar_works.store(false, Ordering::Relaxed),
            Happening::RadarWorks => self.sensors.radar_works.store(true, Ordering::Relaxed),
            Happening::LinkIsCut => self.radio.cut(),
            Happening::LinkIsBack => self.radio.restore(),
        }
        let (before, after) = (self.served(), self.served());
        self.effects.push(Effect { happening, at_s, before, after, changed_at_s: [None, None] });
        self.print_line(at_s, "", happening.describe())
    }

    /// Waits, and looks at both trucks; returns whether what serves them has changed.
    fn look(&mut self) -> anyhow::Result<[bool; 2]> {
        thread::sleep(LOOK);
        let [leader, follower] = &mut *self.aboard;
        Ok([leader.look()?, follower.look()?])
    }

    /// Notes a change of what serves a truck.
    fn note(&mut self, at: usize, now_s: f64) -> anyhow::Result<()> {
        let Some(truck) = self.aboard.get(at) else { return Ok(()) };
        if let Some(effect) = self.effects.last_mut()
            && let Some(before) = effect.before.get(at)
            && let (Some(after), Some(changed)) = (effect.after.get_mut(at), effect.changed_at_s.get_mut(at))
        {
            *changed = (truck.served != *before).then_some(now_s);
            *after = truck.served.clone();
        }
        self.print_line(now_s, truck.truck.name(), &described(&truck.served))
    }

    fn print_line(&self, at_s: f64, who: &str, what: &str) -> anyhow::Result<()> {
        if !self.as_json {
            writeln!(stdout(), "{at_s:6.2} s  {who:9} {what}").context("cannot print")?;
        }
        Ok(())
    }
}

fn described((source, level): &Served) -> String {
    let source = source.as_deref().unwrap_or("nothing");
    level.as_ref().map_or(source.to_owned(), |level| format!("{source}, {level}"))
}

/// How long each change took, and what went out.
fn figures(effects: &[Effect], states: &[Value]) -> String {
    let rows = effects.iter().map(|effect| {
        let change = |(after, changed): (&Served, &Option<f64>)| {
            changed.map_or("no change".to_owned(), |at_s| {
                format!("{:.2} s: {}", at_s - effect.at_s, described(after))
            })
        };
        let changes = effect.after.iter().zip(&effect.changed_at_s).map(change);
        [effect.happening.describe().to_owned()].into_iter().chain(changes).collect()
    });
    let changes = table(&["", "the leader serves, after", "the follower serves, after"], rows.collect());
    let trucks = [Truck::Leader, Truck::Follower].into_iter().zip(states);
    let rows = trucks.map(|(truck, need)| {
        let figure = |name: &str| need[name].to_string();
        vec![truck.name().to_owned(), figure("published"), format!("{} s", figure("longest_gap_s"))]
    });
    format!("\n{changes}\n\n{}\n", table(&["", "values", "longest gap"], rows.collect()))
}

fn figures_json(effects: &[Effect], states: &[Value], is_as_before: bool) -> Value {
    let effect = |effect: &Effect| {
        let served = |at: usize| {
            let (source, level) = effect.after.get(at)?;
            let after_s = effect.changed_at_s.get(at)?.map(|at_s| at_s - effect.at_s);
            Some(json!({ "after_s": after_s, "source": source, "level": level }))
        };
        json!({ "what": effect.happening.describe(), "at_s": effect.at_s, "leader": served(0), "follower": served(1) })
    };
    let need =
        |need: &Value| json!({ "published": need["published"], "longest_gap_s": need["longest_gap_s"] });
    json!({
        "happenings": effects.iter().map(effect).collect::<Vec<_>>(),
        "leader": states.first().map(need),
        "follower": states.last().map(need),
        "as_before": is_as_before,
    })
}
