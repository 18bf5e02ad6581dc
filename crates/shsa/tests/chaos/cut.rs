//! The network between two sites is cut, and restored.

use crate::plant::{Plant, Seen, longest_gap};
use crate::real::{self, Script};
use crate::row::{Scenario, beside_others, shown};
use crate::running::{Folder, Running};
use crate::scene::{kinds_of, model, router, system, under, wait};
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

const SCENARIO: Scenario = Scenario {
    number: 4,
    name: "network cut between two instances for 10 s",
    done: "two sites, each a network namespace with a Zenoh router, an instance, sensors and a consumer; their link set down \
           for 10 s (lease between the routers: 1 s)",
    promised: "each site serves its consumer while cut; afterwards one instance serves both; told",
};
/// The duration of the cut, seconds.
const CUT: f64 = 10.0;
/// Without a sign of life for this long, a router gives the other one up, milliseconds.
const LEASE_MS: u32 = 1_000;

/// Two network namespaces, connected by a cable; dropping it removes them.
struct Cable {
    names: [String; 2],
}

impl Cable {
    fn lay() -> Result<Cable, String> {
        let names = ["left", "right"].map(|side| format!("shsa-{side}-{}", std::process::id()));
        let cable = Cable { names };
        cable.names.iter().try_for_each(|name| system(&format!("ip netns add {name}")))?;
        let [left, right] = &cable.names;
        system(&format!("ip -n {left} link add cable type veth peer name cable netns {right}"))?;
        for (number, name) in (1..).zip(&cable.names) {
            system(&format!("ip -n {name} address add 10.213.77.{number}/24 dev cable"))?;
            system(&format!("ip -n {name} link set lo up"))?;
            system(&format!("ip -n {name} link set cable up"))?;
        }
        Ok(cable)
    }

    fn set(&self, way: &str) {
        system(&format!("ip -n {} link set cable {way}", self.names[0])).unwrap();
    }
}

impl Drop for Cable {
    fn drop(&mut self) {
        for name in &self.names {
            let _ = Command::new("ip").args(["netns", "del", name]).status();
        }
    }
}

/// A site with its own router, instance, sensors and consumer.
struct Site {
    run: Running,
    plant: Plant,
    _router: Script,
}

impl Site {
    fn build(cable: &Cable, side: usize, folder: &Folder, python: &Path, wheels: &[&str]) -> Site {
        let name = &cable.names[side];
        let inside = ["ip", "netns", "exec", name];
        let python: PathBuf = under(folder, &format!("python-{side}"), &inside, python);
        let other = json!(if side == 0 { vec![] } else { vec!["tcp/10.213.77.1:7447"] });
        let config = json!({
            "listen/endpoints": ["tcp/0.0.0.0:7447"],
            "connect/endpoints": other,
            "connect/retry": { "period_init_ms": 200, "period_max_ms": 1000, "period_increase_factor": 2 },
            "transport/link/tx/lease": LEASE_MS,
        });
        let router = router(&python, &config);
        let model = model(folder);
        let called = ["left", "right"][side];
        let run =
            Running::start_under(&inside, [&*model, "--bus", "zenoh://127.0.0.1:7447", "--name", called]);
        let plant = Plant::start(&python, "zenoh", 7447, wheels);
        Site { run, plant, _router: router }
    }

    /// The publishers whose values were received since a time.
    fn publishers(&mut self, from: f64) -> BTreeSet<String> {
        self.plant.seen().iter().filter(|seen| seen.at >= from).map(|seen| seen.publisher.clone()).collect()
    }
}

#[test]
fn both_sides_of_a_cut_are_served_and_agree_afterwards() {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let cable = match Cable::lay() {
        Ok(cable) => cable,
        Err(why) => return SCENARIO.skipped(&why),
    };
    let folder = Folder::new();
    let mut sites = [
        Site::build(&cable, 0, &folder, &python, &["wheel_1", "wheel_3"]),
        Site::build(&cable, 1, &folder, &python, &["wheel_2"]),
    ];
    agree(&mut sites);
    sites.iter().for_each(|site| drop(site.run.decisions()));

    let cut = sites[0].plant.now();
    cable.set("down");
    wait(CUT);
    let whole = sites[0].plant.now();
    let alone = sites.each_mut().map(|site| site.publishers(cut + 4.0));
    assert!(alone[0].len() == 1 && alone[1].len() == 1 && alone[0] != alone[1], "{alone:?}");
    cable.set("up");
    let agreed = agree(&mut sites);

    let gaps = sites.each_mut().map(|site| longest_gap(site.plant.seen(), cut - 0.5, agreed));
    let both = sites.each_mut().map(|site| doubles(site.plant.seen(), whole));
    let decisions = sites.each_ref().map(|site| kinds_of(&site.run.decisions()));
    let released = decisions.iter().flatten().filter(|kind| *kind == "released").count();
    assert!(released == 1, "{decisions:?}");
    SCENARIO.seen(&format!(
        "longest gap {} on one side, {} on the other, from the cut until both agreed, {} after the link was up; both served \
         the same consumer for {}; `responsible` and `released` told once each",
        shown(gaps[0]),
        shown(gaps[1]),
        shown(agreed - whole),
        shown(both[0].max(both[1])),
    ));
}

/// Waits until both consumers receive values of the same single instance for a second; returns when this began.
fn agree(sites: &mut [Site; 2]) -> f64 {
    for _ in 0..200 {
        let since = sites[0].plant.now() - 1.0;
        let [left, right] = sites.each_mut().map(|site| site.publishers(since));
        if left.len() == 1
            && left == right
            && sites[0].plant.seen().iter().filter(|seen| seen.at > since).count() > 20
        {
            return since;
        }
        wait(0.1);
    }
    panic!("both sides never heard the same one instance")
}

/// How long values of two instances arrived after a time, seconds.
fn doubles(seen: &[Seen], from: f64) -> f64 {
    let mut spans: BTreeMap<&str, (f64, f64)> = BTreeMap::new();
    for seen in seen.iter().filter(|seen| seen.at >= from) {
        spans.entry(&seen.publisher).or_insert((seen.at, seen.at)).1 = seen.at;
    }
    let latest_begin = spans.values().map(|span| span.0).fold(f64::MIN, f64::max);
    let earliest_end = spans.values().map(|span| span.1).fold(f64::MAX, f64::min);
    if spans.len() < 2 { 0.0 } else { (earliest_end - latest_begin).max(0.0) }
}
