//! Who has given an order, in the journal of a run.

use super::{TWO, named, options};
use crate::{JournalOptions, JournalSeal, Options, Order, Runtime};
use serde_json::Value;
use shsa_bridge::Clock;
use shsa_bridge::memory::MemoryBus;
use shsa_format::journal::examination::{examine, verify};
use shsa_format::journal::read_journal;
use shsa_format::wiring::Wiring;
use shsa_model::live::{Live, Written};
use std::thread::spawn;

/// The journal of a run that has carried out two orders.
fn ordered_journal(seal: JournalSeal) -> Vec<u8> {
    let folder = std::env::temp_dir().join(format!("shsa-ordered-{seal:?}-{}", std::process::id()));
    let bus = MemoryBus::new(Clock::running());
    let journal = JournalOptions { folder: folder.clone(), size: 1 << 20, older: 1, seal };
    let options = Options { journal: Some(journal), ..options(Wiring::default()) };
    let (live, _) = Live::load(Written { name: "model", text: TWO }).unwrap();
    let runtime = Runtime::new(vec![named(live)], options, Box::new(bus.join(64))).unwrap();
    let handle = runtime.handle();
    let run = spawn(move || runtime.run());
    for order in
        [r#"{"order": "forbid", "signal": "wheel"}"#, r#"{"order": "change", "text": "relations: {}"}"#]
    {
        handle.order(Order::read(order).unwrap()).unwrap();
    }
    handle.stop();
    run.join().unwrap().unwrap();
    let written = std::fs::read(folder.join("model.jsonl")).unwrap();
    std::fs::remove_dir_all(folder).unwrap();
    written
}

#[test]
fn a_sealed_journal_says_who_has_given_an_order() {
    let sealed = ordered_journal(JournalSeal::Chained);
    let found = verify(&[examine(&*sealed, None).unwrap()]);
    assert_eq!((found.finding, found.cuts), (None, vec![]));
    let ordered = |text: &[u8]| -> Vec<Value> {
        let lines = text.split(|byte| *byte == b'\n').filter_map(|line| serde_json::from_slice(line).ok());
        lines.filter(|line: &Value| line["ordered_ns"].is_i64()).collect()
    };
    let told = ordered(&sealed);
    assert!(told.len() == 2 && told.iter().all(|line| line["by"] == "the program"), "{told:?}");
    assert_eq!(told[0]["done"], "forbid wheel");
    let plain = ordered_journal(JournalSeal::Off);
    assert!(ordered(&plain).is_empty() && !String::from_utf8_lossy(&plain).contains("seal"));
    let (live, _) = Live::load(Written { name: "model", text: TWO }).unwrap();
    let read = read_journal(&*sealed, live).unwrap();
    assert_eq!((read.eras.len(), read.damage), (2, None));
}
