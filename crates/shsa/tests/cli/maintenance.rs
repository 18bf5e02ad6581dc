//! `shsa maintenance`: what a journal says about the next visit.

use crate::folder::{Folder, keys};
use std::fmt::Write as _;

const MODEL: &str = "\
shsa: 1
variables: { v: { unit: m/s } }
signals:
  /a: { variable: v, rate: 10 Hz, value_error: 0.1 }
  /b: { variable: v, rate: 10 Hz, value_error: 0.1 }
needs: { v: { max_age: 1 s } }
";

/// A minute of two sensors, of which one falls silent after 40 s.
fn folder() -> Folder {
    let mut recording = String::new();
    for at in 0..600 {
        for name in ["/a", "/b"] {
            if name == "/a" || at < 400 {
                let time = 1_700_000_000_000_000_000_i64 + at * 100_000_000;
                writeln!(recording, "{{\"signal\": \"{name}\", \"time_ns\": {time}, \"value\": 5}}").unwrap();
            }
        }
    }
    Folder::with(&[("m.yaml", MODEL.as_bytes()), ("r.jsonl", recording.as_bytes())])
}

#[test]
fn what_was_lost_is_told_of_recordings_and_of_their_journal() {
    let folder = folder();
    let told = folder.json("maintenance m.yaml r.jsonl --report page.html", 1);
    let fields = ["is_due", "watched_s", "signals", "needs", "ageing", "notes", "left_out"];
    assert_eq!(keys(&told), fields);
    let (signal, need) = (&told["signals"][0], &told["needs"][0]);
    assert_eq!(
        (&signal["name"], &signal["now"], &signal["silent"]),
        (&"/b".into(), &"silent".into(), &1.into())
    );
    let bare = need["without_a_spare_s"].as_f64().unwrap();
    assert!((19.0..20.0).contains(&bare), "{told}");
    assert_eq!((signal["restores_s"].as_f64(), need["not_served_s"].as_f64()), (Some(bare), Some(0.0)));
    assert!(folder.read("page.html").contains("Look at /b first"));
    folder.ends("replay m.yaml r.jsonl --journal j.jsonl", 0);
    assert_eq!(folder.json("maintenance m.yaml j.jsonl", 1)["signals"], told["signals"]);
    assert!(folder.ends("maintenance m.yaml r.jsonl", 1).stdout.starts_with("Look at /b first"));
}

#[test]
fn nothing_is_to_be_done_about_a_sound_system() {
    let folder = folder();
    let head = folder.read("r.jsonl").lines().take(600).collect::<Vec<_>>().join("\n");
    folder.write("r.jsonl", head);
    let told = folder.ends("maintenance m.yaml r.jsonl", 0).stdout;
    assert!(told.starts_with("Nothing to do: in 29.9 s every signal was trusted"), "{told}");
}
