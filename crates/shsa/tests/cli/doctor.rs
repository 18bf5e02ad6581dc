//! `shsa doctor`: what is wrong in a recording is told without a model, and nothing where nothing is.

use crate::folder::Folder;
use std::fmt::Write;

/// Four thermometers of a hall for half an hour, of which the second one reads so much too much for two minutes; a door, and a text.
pub(crate) fn hall(wrong: Option<f64>) -> String {
    let mut text =
        "t [s],hall_1 [degC],hall_2 [degC],hall_3 [degC],hall_4 [degC],outside [degC],door,note\n".to_owned();
    let mut state = 1_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(u32::MAX >> 1) - 0.5
    };
    let mut outside = 5.0;
    for row in 0..1_800_u32 {
        let time = f64::from(row);
        let truth = 20.0 + 2.0 * (0.013 * time).sin() + (0.0041 * time).cos();
        outside += 0.02 * noise();
        let by = wrong.filter(|_| (900..1_020).contains(&row)).unwrap_or(0.0);
        let read: Vec<String> = [0.1, -0.2 + by, 0.0, 0.3]
            .iter()
            .map(|offset| format!("{:.2}", truth + offset + 0.1 * noise()))
            .collect();
        writeln!(text, "{time},{},{outside:.2},{},x", read.join(","), row / 300 % 2).unwrap();
    }
    text
}

#[test]
fn a_wrong_signal_is_named_with_when_and_by_how_much() {
    let folder = Folder::with(&[("hall.csv", hall(Some(1.5)).as_bytes())]);
    let told = folder.ends("doctor hall.csv -o hall.yaml --html hall.html", 1).stdout;
    assert!(told.contains("1. hall_2 reads 1.5 degC too much\n   15 min 0 s to 16 min 59 s"), "{told}");
    assert!(told.contains("measure the same: hall_1, hall_2, hall_3, hall_4"), "{told}");
    assert!(told.contains("outside: nothing else here implies it"), "{told}");
    folder.ends("check hall.yaml", 0);
    let page = folder.read("hall.html");
    assert!(page.contains("hall_2 reads 1.5 degC too much") && page.contains("<svg"), "{page}");
}

#[test]
fn a_sound_recording_gives_no_finding() {
    let folder = Folder::with(&[("hall.csv", hall(None).as_bytes())]);
    let told = folder.ends("doctor hall.csv", 0).stdout;
    assert!(told.starts_with("Nothing contradicts anything else: 4 of 6 signals are checked"), "{told}");
}

#[test]
fn odd_recordings_are_told_or_refused() {
    let rows = |text: &str, count: usize| format!("t,a,b\n{}", text.repeat(count));
    let folder = Folder::with(&[
        ("one.csv", b"t,a\n0,1\n".as_slice()),
        ("constant.csv", rows("1,2,3\n", 1).as_bytes()),
        (
            "missing.csv",
            format!("t,a,b\n{}", (0..200).map(|at| format!("{at},nan,inf\n")).collect::<String>()).as_bytes(),
        ),
        ("texts.csv", b"t,a\n0,x\n1,y\n2,z\n"),
        (
            "back.csv",
            format!(
                "t,a,b\n{}",
                (0..300)
                    .map(|at| format!("{},{},{}\n", at % 100, at * 7 % 13, at * 7 % 13 + 1))
                    .collect::<String>()
            )
            .as_bytes(),
        ),
    ]);
    for (name, statuses) in
        [("one", [0, 2]), ("constant", [0, 2]), ("missing", [0, 2]), ("texts", [0, 2]), ("back", [0, 1])]
    {
        let ended = folder.command(&format!("doctor {name}.csv")).output().unwrap();
        let told = String::from_utf8_lossy(&ended.stderr).into_owned();
        assert!(
            ended.status.code().is_some_and(|it| statuses.contains(&it)),
            "{name}: {:?} {told}",
            ended.status
        );
        assert!(!told.contains("defect") && !told.contains("panic"), "{name}: {told}");
    }
    folder.refuses("doctor none.csv", &["none.csv"]);
}
