//! A broker, three sensors, a consumer and a run; each is a process that can fail.

mod fault;
mod truth;

pub(crate) use fault::{Fault, Kind, Target};
pub(crate) use truth::{Judgement, judged};

use crate::broker::Broker;
use crate::disk::Disk;
use crate::real::Script;
use crate::running::{Folder, Running};
use crate::scene::{WHEELS, is_trusted, model, text};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};
use truth::Seen;

/// Mosquitto saves its store once a second, not with every kept message.
const SAVING: [&str; 1] = ["autosave_on_changes false"];
const SCRIPT: &str = "unsteady.py";

/// A sensor; `None` while it is dead.
struct Sensor {
    order: Value,
    script: Option<Script>,
}

impl Sensor {
    fn start(&mut self, python: &Path) {
        self.script = Some(Script::start(python, SCRIPT, &self.order));
    }

    fn script(&mut self) -> &mut Script {
        self.script.as_mut().expect("nobody else breaks a dead sensor")
    }
}

/// A place for files that can be full.
enum Store {
    Small(Disk),
    /// The file system has room, but files may not grow.
    Limited(Folder),
}

impl Store {
    fn new(is_small: bool, place: &Path) -> Store {
        let disk = is_small.then(|| Disk::mount(place, 32).ok()).flatten();
        disk.map_or_else(|| Store::Limited(Folder::new()), Store::Small)
    }

    fn path(&self, name: &str) -> PathBuf {
        match self {
            Store::Small(disk) => disk.path().join(name),
            Store::Limited(folder) => folder.path(name),
        }
    }

    fn set_full(&self, run: &Running, is_full: bool) {
        match self {
            Store::Small(disk) if is_full => disk.fill(),
            Store::Small(disk) => disk.free(),
            Store::Limited(_) => {
                let limit = if is_full { "0" } else { "unlimited" };
                let process = run.id().to_string();
                let limit = format!("--fsize={limit}:unlimited");
                let limited = Command::new("prlimit").args(["--pid", &process, &limit]).status();
                assert!(limited.unwrap().success());
            }
        }
    }
}

/// The common settings of sensors and run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Setting {
    /// Whether each sensor stamps its messages.
    pub(crate) stamped: [bool; 3],
    /// Whether the broker keeps messages during an absence of the run.
    pub(crate) is_kept: bool,
    /// Whether the disk is small, if a file system can be mounted; else files may not grow while it is full.
    pub(crate) has_small_disk: bool,
}

impl Setting {
    /// All sensors stamp, or none does; the broker keeps nothing.
    pub(crate) fn plain(is_stamped: bool) -> Setting {
        Setting { stamped: [is_stamped; 3], is_kept: false, has_small_disk: false }
    }
}

/// A world that can fail. The run must be dropped last, because its files lie in the other fields.
pub(crate) struct World {
    python: PathBuf,
    run: Running,
    sensors: Vec<Sensor>,
    consumer: Script,
    seen: Vec<Seen>,
    broker: Broker,
    store: Store,
    model: String,
    _folder: Folder,
}

impl World {
    /// Starts all processes.
    pub(crate) fn start(setting: Setting, python: &Path) -> World {
        let (broker, folder) = (Broker::start(&SAVING), Folder::new());
        let store = Store::new(setting.has_small_disk, &folder.path("disk"));
        let is_kept = setting.is_kept;
        let model = model(&folder);
        let mut written = fs::read_to_string(&model).unwrap();
        let sensors = WHEELS.iter().zip(setting.stamped).map(|(wheel, is_stamped)| {
            if !is_stamped {
                written =
                    written.replace(&format!("chaos/{wheel}#value@at"), &format!("chaos/{wheel}#value"));
            }
            let order = json!({ "port": broker.port(), "topic": format!("chaos/{wheel}"), "rate": 50,
                "stamped": is_stamped, "qos": u8::from(is_kept) });
            Sensor { order, script: None }
        });
        let mut sensors: Vec<Sensor> = sensors.collect();
        fs::write(&model, written).unwrap();
        let session = if is_kept { "?session=60" } else { "" };
        let address = format!("mqtt://127.0.0.1:{}{session}", broker.port());
        let (journal, state) = (text(&store.path("journal")), text(&store.path("state")));
        let run = Running::start([&*model, "--bus", &address, "--journal", &journal, "--state", &state]);
        let consumer = json!({ "port": broker.port(), "need": "chaos/speed" });
        let consumer = Script::start(python, SCRIPT, &consumer);
        sensors.iter_mut().for_each(|sensor| sensor.start(python));
        let python = python.to_owned();
        World { python, run, sensors, consumer, seen: Vec::new(), broker, store, model, _folder: folder }
    }

    /// Waits until every wheel is received and trusted, and the speed is served.
    pub(crate) fn settle(&self) {
        self.run.until("every wheel is trusted, and the speed is served", |state| {
            let state_of = |wheel: &&str| {
                let accepted = state["models"]["chaos"]["signals"][*wheel]["accepted"].as_u64();
                accepted > Some(30) && is_trusted(state, wheel)
            };
            let need = &state["models"]["chaos"]["needs"]["speed"];
            WHEELS.iter().all(state_of) && need["quality"] == "Good"
        });
    }

    /// Waits until every wheel is trusted.
    pub(crate) fn until_trusted(&self) {
        self.run.until("every wheel is trusted again", |state| {
            WHEELS.iter().all(|wheel| is_trusted(state, wheel))
        });
    }

    /// Begins and ends every fault at its time.
    pub(crate) fn live_through(&mut self, faults: &[Fault]) {
        let turns = faults.iter().flat_map(|fault| [(fault.from, fault, true), (fault.until, fault, false)]);
        let mut turns: Vec<_> = turns.collect();
        turns.sort_by(|one, other| one.0.total_cmp(&other.0));
        let start = Instant::now();
        for (at, fault, begins) in turns {
            thread::sleep((start + Duration::from_secs_f64(at)).saturating_duration_since(Instant::now()));
            if begins { self.begin(fault) } else { self.end(fault) }
        }
    }

    /// Waits until the need is served permanently after the last fault, or until the time limit.
    pub(crate) fn until_served(&mut self, begun: f64, last: f64, at_most: f64) -> Judgement {
        loop {
            thread::sleep(Duration::from_millis(200));
            let (seen, now) = self.seen();
            let judgement = judged(seen, begun, last);
            if judgement.recovery.is_some() || now > last + at_most {
                return judgement;
            }
        }
    }

    pub(crate) fn run(&self) -> &Running {
        &self.run
    }

    fn begin(&mut self, fault: &Fault) {
        match (fault.target, fault.kind) {
            (Target::Wheel(at), Kind::Killed) => self.sensors[at].script = None,
            (Target::Wheel(at), Kind::Ordered(order, amount)) => {
                self.sensors[at].script().order(&json!({ "fault": order, "amount": amount }));
            }
            (Target::Wheel(at), _) => self.sensors[at].script().signal("STOP"),
            (Target::Broker, _) => self.broker.kill(),
            (Target::Run, _) => self.run.signal("-STOP"),
            (Target::Disk, _) => self.store.set_full(&self.run, true),
        }
    }

    fn end(&mut self, fault: &Fault) {
        match (fault.target, fault.kind) {
            (Target::Wheel(at), Kind::Killed) => self.sensors[at].start(&self.python),
            (Target::Wheel(at), Kind::Ordered(..)) => {
                self.sensors[at].script().order(&json!({ "fault": "none" }))
            }
            (Target::Wheel(at), _) => self.sensors[at].script().signal("CONT"),
            (Target::Broker, _) => self.broker.restart(),
            (Target::Run, _) => self.run.signal("-CONT"),
            (Target::Disk, _) => self.store.set_full(&self.run, false),
        }
    }

    /// All values of the consumer, and the time of its clock.
    pub(crate) fn seen(&mut self) -> (&[Seen], f64) {
        let answer = self.consumer.answer(&json!({ "values": true }), "values");
        self.seen.extend(answer["values"].as_array().unwrap().iter().map(Seen::read));
        (&self.seen, answer["now"].as_f64().unwrap())
    }

    /// Ends the run, and returns its remains.
    pub(crate) fn close(self) -> Remains {
        let World { run, store, model, _folder: folder, .. } = self;
        // A stopped run must go on, so that its last decisions are sent.
        run.signal("-CONT");
        let ended = run.stop_and_tell();
        Remains { decisions: ended.1, status: ended.0.code(), store, model, _folder: folder }
    }
}

/// The remains of a run.
pub(crate) struct Remains {
    pub(crate) status: Option<i32>,
    pub(crate) decisions: Vec<Value>,
    pub(crate) model: String,
    store: Store,
    _folder: Folder,
}

impl Remains {
    /// The files of its journal, the oldest first.
    pub(crate) fn journals(&self) -> Vec<PathBuf> {
        let older = (1..=7).rev().map(|number| format!("journal/chaos.{number}.jsonl"));
        let names = older.chain(["journal/chaos.jsonl".to_owned()]);
        names.map(|name| self.store.path(&name)).filter(|path| path.exists()).collect()
    }
}
