//! Sources silenced by a run: each is let back when the model whose takeover silenced it has changed.

use super::{Bench, PATIENCE, TWO, text};
use serde_json::Value;
use std::fs;
use std::path::PathBuf;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// A file that actions write to.
struct Diary(PathBuf);

impl Diary {
    fn new(name: &str) -> Diary {
        let path = std::env::temp_dir().join(format!("shsa-run-{}-{name}", std::process::id()));
        fs::write(&path, "").unwrap();
        Diary(path)
    }

    /// The wiring of a takeover whose actions write to the diary; the action `restore` works the second time only.
    fn wiring(&self) -> String {
        let write = |word: &str| format!("[sh, -c, 'echo {word} >> {}']", self.0.display());
        let back = format!(
            "[sh, -c, 'echo on >> {path}; test $(grep -c on {path}) -gt 1']",
            path = self.0.display()
        );
        format!(
            "{{ silence: {{ command: {} }}, restore: {{ command: {back} }}, check: 100 ms, retry: 200 ms }}",
            write("off")
        )
    }

    /// Waits until the diary holds these words.
    #[track_caller]
    fn wait_for(&self, words: &str) {
        let end = Instant::now() + PATIENCE;
        let read = || fs::read_to_string(&self.0).unwrap().replace('\n', " ");
        while read() != words {
            assert!(Instant::now() < end, "{}", read());
            sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Diary {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

#[test]
fn a_source_whose_need_is_removed_is_let_back() {
    let diary = Diary::new("removed");
    let mut bench = Bench::wired(TWO, &diary.wiring(), &[]);
    bench.lose_the_wheel();
    bench.change("needs: { speed: null }").unwrap();
    bench.await_message("shsa/model/events", "wheel is let publish robot/wheel again by the command sh (the model has changed, and its name is not taken any more)");
    bench.await_message("shsa/model/events", "wheel cannot be let publish again: sh ended with status 1");
    // `restore` is repeated until it works, and not after that.
    diary.wait_for("off on on ");
    sleep(Duration::from_millis(500));
    diary.wait_for("off on on ");
}

#[test]
fn a_source_whose_signal_is_renamed_is_let_back() {
    let diary = Diary::new("renamed");
    let mut bench = Bench::wired(TWO, &diary.wiring(), &[]);
    bench.lose_the_wheel();
    bench.change("signals: { wheel: null, wheel_1: { variable: speed, source: robot/wheel } }").unwrap();
    bench.await_message("shsa/model/events", "the model has changed, and its name is not taken any more");
    diary.wait_for("off on on ");
}

#[test]
fn the_stage_of_a_takeover_stands_on_the_topic_of_its_need() {
    let diary = Diary::new("stage");
    let mut bench = Bench::wired(TWO, &diary.wiring(), &[]);
    bench.await_message("shsa/model/need/speed", "\"stage\":\"watching\"");
    bench.say("robot/wheel", 5.0);
    bench.say("robot/radar", 5.0);
    bench.await_message("healed/speed", "5");
    bench.order(r#"{"order": "forbid", "signal": "wheel"}"#);
    bench.say("robot/radar", 6.0);
    for stage in ["silencing", "checking", "taken"] {
        bench.await_message("shsa/model/need/speed", &format!("\"stage\":\"{stage}\""));
    }
    // The source publishes although it was silenced.
    bench.say("robot/wheel", 5.0);
    let status = text(&bench.await_message("shsa/model/need/speed", "\"stage\":\"waiting\""));
    let status: Value = serde_json::from_str(&status).unwrap();
    assert_eq!(
        (&status["takeover"]["last"], &status["takeover"]["name"]),
        (&"returned".into(), &"robot/wheel".into())
    );
}
