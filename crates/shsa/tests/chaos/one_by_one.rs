//! One fault of the environment after the other, with and without stamps in the sensors' messages: no value is wrong or outdated.

use crate::real::{self, eventually};
use crate::row::{Scenario, beside_others, shown};
use crate::scene::kinds_of;
use crate::world::{Fault, Kind, Setting, Target, World};
use std::collections::BTreeSet;
use std::io::Write;
use std::net::TcpStream;
use std::path::Path;
use std::thread;

const SUSPENDED: Scenario = Scenario {
    number: 20,
    name: "suspended for 12 s",
    done: "`shsa run` suspended for 12 s, while 1800 messages wait in the connection to Mosquitto",
    promised: "no value is wrong or of before; served again by itself within 10 s; told",
};
const BACKLOG: Scenario = Scenario {
    number: 21,
    name: "backlog of all sensors",
    done: "all three sensors keep their messages for 8 s, and publish them at once",
    promised: "no value is wrong or of before; served again by itself within 10 s; told where there are no stamps",
};
const HALF_OPEN: Scenario = Scenario {
    number: 22,
    name: "half-open connections",
    done: "1100 HTTP connections that send nothing, or half of a request, and stay; the broker killed for 4 s meanwhile",
    promised: "no value is wrong or of before; the healing goes on, and the run answers",
};
const CLOCK: Scenario = Scenario {
    number: 23,
    name: "clock off by an hour at one sensor",
    done: "the stamps of the need's own source an hour ahead for 6 s, then an hour behind for 6 s",
    promised: "no value is wrong or of before; its clock is named where it stamps; others serve",
};
const BROKER: Scenario = Scenario {
    number: 24,
    name: "broker down for 30 s",
    done: "Mosquitto killed with -9, and started again after 30 s",
    promised: "no value is wrong or of before; served again by itself within 10 s of its start; told",
};
/// The longest time from the end of a fault until the need is served from sound sources, seconds.
const RECOVERY: f64 = 10.0;
const CONNECTIONS: usize = 1_100;

#[test]
fn suspended_for_long() {
    both(
        &SUSPENDED,
        &[Fault { target: Target::Run, kind: Kind::Suspended, from: 0.0, until: 12.0 }],
        "absent",
    );
}

#[test]
fn a_backlog_of_all_sensors() {
    let faults = [0, 1, 2].map(|wheel| Fault::ordered(wheel, "hold", 0.0, (0.0, 8.0)));
    row(&BACKLOG, &[(true, "silent"), (false, "backlog")], |world| world.live_through(&faults));
}

#[test]
fn a_clock_that_is_off_at_one_sensor() {
    let faults = [(3_600.0, (0.0, 6.0)), (-3_600.0, (6.5, 12.5))];
    let faults = faults.map(|(amount, when)| Fault::ordered(0, "clock", amount, when));
    row(&CLOCK, &[(true, "failed")], |world| world.live_through(&faults));
}

#[test]
fn a_broker_that_is_down_for_long() {
    both(
        &BROKER,
        &[Fault { target: Target::Broker, kind: Kind::Killed, from: 0.0, until: 30.0 }],
        "disconnected",
    );
}

#[test]
fn half_open_connections_and_a_broker_that_comes_back() {
    let fault = Fault { target: Target::Broker, kind: Kind::Killed, from: 0.0, until: 4.0 };
    let act = |world: &mut World| {
        let half_open: Vec<TcpStream> =
            (0..CONNECTIONS).filter_map(|number| half_open(world, number)).collect();
        assert!(half_open.len() > CONNECTIONS / 2, "{}", half_open.len());
        world.live_through(&[fault]);
        assert!([200, 503].contains(&world.run().get("/health").0));
        drop(half_open);
    };
    row(&HALF_OPEN, &[(true, "disconnected"), (false, "disconnected")], act);
}

/// A connection that sends nothing, or an incomplete request.
fn half_open(world: &World, number: usize) -> Option<TcpStream> {
    let mut stream = TcpStream::connect(world.run().address()).ok()?;
    let words: &[u8] = if number.is_multiple_of(2) { b"" } else { b"GET /state HTTP/1.1\r\nHost: lo" };
    // The server may have closed it already, to make room.
    let _ = stream.write_all(words);
    Some(stream)
}

fn both(scenario: &Scenario, faults: &[Fault], wanted: &'static str) {
    row(scenario, &[(true, wanted), (false, wanted)], |world| world.live_through(faults));
}

/// Runs an action in worlds with and without stamps; each world names the event that must be reported.
fn row(scenario: &Scenario, worlds: &[(bool, &'static str)], act: impl Fn(&mut World) + Sync) {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let (act, python) = (&act, &*python);
    let words = |is_stamped: bool| if is_stamped { "with stamps" } else { "without stamps" };
    let seen: Vec<String> = thread::scope(|scope| {
        let run = |is_stamped, wanted| scope.spawn(move || lived(is_stamped, act, python, wanted));
        let runs = worlds.iter().map(|(is_stamped, wanted)| (words(*is_stamped), run(*is_stamped, wanted)));
        let runs: Vec<_> = runs.collect();
        runs.into_iter().map(|(words, run)| format!("{words}: {}", run.join().unwrap())).collect()
    });
    scenario.seen(&seen.join("; "));
}

/// The result in one world.
fn lived(is_stamped: bool, act: impl Fn(&mut World), python: &Path, wanted: &str) -> String {
    let mut world = World::start(Setting::plain(is_stamped), python);
    world.settle();
    world.run().decisions();
    let (_, begun) = world.seen();
    act(&mut world);
    let (_, last) = world.seen();
    let judgement = world.until_served(begun, last, 2.0 * RECOVERY);
    world.until_trusted();
    eventually(wanted, || {
        let (_, events) = world.run().get("/events");
        events.as_array()?.iter().find(|event| event["kind"] == wanted).map(|_| ())
    });
    let remains = world.close();
    let decisions = kinds_of(&remains.decisions);
    let [wrong, old] = judgement.off;
    assert_eq!((wrong, old), (0, 0), "{judgement:?} {decisions:?}");
    let recovery = judgement.recovery.filter(|time| *time <= RECOVERY);
    let kinds: BTreeSet<String> = decisions.into_iter().map(|kind| format!("`{kind}`")).collect();
    format!(
        "longest gap {}, served {} after its end; of {} values {wrong} wrong, {old} old; told: {}",
        shown(judgement.gap),
        shown(recovery.unwrap_or_else(|| panic!("{:?}", judgement.recovery))),
        judgement.values,
        kinds.into_iter().collect::<Vec<_>>().join(", "),
    )
}
