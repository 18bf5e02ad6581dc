//! `shsa draft`: the model of a recording is valid, groups what measures the same, and leaves out what is no signal.

use crate::folder::Folder;
use std::fmt::Write;

/// Two speeds of which one is later, an odometer, a copy, a running maximum, a constant and a switch.
fn drive(rows: usize) -> String {
    let mut text =
        "t [s],wheel_1 [m/s],wheel_2 [m/s],gnss [km/h],way [m],way_km [km],top [m/s],cells,brake,note\n"
            .to_owned();
    let speed = |time: f64| 10.0 + 3.0 * (0.5 * time).sin() + (1.3 * time).cos() + (0.11 * time).sin();
    let way = |time: f64| {
        10.0 * time - 6.0 * (0.5 * time).cos() + (1.3 * time).sin() / 1.3 - (0.11 * time).cos() / 0.11
    };
    let mut state = 1_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(u32::MAX >> 1) - 0.5
    };
    let mut top = f64::NEG_INFINITY;
    for row in 0..rows {
        let time = row as f64 * 0.1;
        let one: f64 = format!("{:.4}", speed(time) + 0.1 * noise()).parse().unwrap();
        top = one.max(top);
        let (two, gnss) = (speed(time) + 0.1 * noise(), 3.6 * (speed(time - 0.7) + 0.1 * noise()));
        let way: f64 = format!("{:.3}", way(time)).parse().unwrap();
        let on = u8::from(row / 37 % 3 == 0);
        writeln!(text, "{time:.1},{one},{two:.4},{gnss:.4},{way},{},{top},4,{on},x", way / 1e3).unwrap();
    }
    text
}

#[test]
fn what_measures_the_same_shares_a_variable() {
    let folder = Folder::with(&[("drive.csv", drive(3_000).as_bytes())]);
    assert_eq!(folder.ends("draft drive.csv -o m.yaml", 0).stdout, "");
    folder.ends("check m.yaml", 0);
    let model = folder.read("m.yaml");
    let line = |name: &str| {
        let found = model.lines().find(|line| line.starts_with(&format!("  {name}: {{ variable")));
        found.unwrap_or_else(|| panic!("no {name}: {model}")).to_owned()
    };
    for name in ["wheel_1", "wheel_2", "gnss"] {
        assert!(line(name).contains("variable: wheel,"), "{}", line(name));
    }
    let is_late = ["delay: 69", "delay: 70"].iter().any(|delay| line("gnss").contains(delay));
    assert!(line("gnss").contains("unit: km/h") && is_late, "{}", line("gnss"));
    assert!(!line("wheel_2").contains("delay"), "{}", line("wheel_2"));
    assert!(line("way_km").contains("derived_from: [way]"), "{}", line("way_km"));
    assert!(line("brake").contains("hold: true"), "{}", line("brake"));
    for left_out in
        ["drive#top: the largest value of wheel_1 so far", "drive#cells: always 4", "drive#note: text"]
    {
        assert!(model.contains(&format!("#   {left_out}\n")), "{left_out}: {model}");
    }
    assert!(model.contains("#   rate_1: wheel = derivative(way, "), "{model}");
}

#[test]
fn what_is_missing_or_wrong_in_a_recording_stays_out_of_the_model() {
    let mut rows = "time,T,missing,rarely,feet [ft],depth [m]\n".to_owned();
    for row in 0..400 {
        let depth = 10.0 + 3.0 * (f64::from(row) / 40.0).sin() + (f64::from(row) / 13.0).cos();
        let temperature = if row == 200 { -127.0 } else { 20.0 + 0.5 * (f64::from(row) / 50.0).sin() };
        let rarely = if row % 50 == 0 { "inf".to_owned() } else { format!("{:.3}", depth * depth) };
        writeln!(rows, "{row},{temperature:.2},NaN,{rarely},{:.1},{depth:.2}", depth / 0.3048).unwrap();
    }
    let folder = Folder::with(&[("log.csv", rows.as_bytes())]);
    folder.ends("draft log.csv -o m.yaml", 0);
    folder.ends("check m.yaml", 0);
    let model = folder.read("m.yaml");
    for part in [
        "source: \"log#T\"",
        "without a glitch: -127 at 200 s",
        "#   log#missing: fewer than two values",
        "derived_from: [depth]",
        "source: \"log#rarely\"",
    ] {
        assert!(model.contains(part), "{part}: {model}");
    }
}

#[test]
fn one_thermometer_in_two_units_is_one_witness() {
    let mut rows = "time [s],fine [degC],coarse [degF]\n".to_owned();
    for row in 0..400 {
        let celsius = 20.0 + 3.0 * (f64::from(row) / 40.0).sin() + (f64::from(row) / 13.0).cos();
        writeln!(rows, "{row},{celsius:.2},{:.1}", 1.8 * celsius + 32.0).unwrap();
    }
    let folder = Folder::with(&[("log.csv", rows.as_bytes())]);
    folder.ends("draft log.csv -o m.yaml", 0);
    folder.ends("check m.yaml", 0);
    let model = folder.read("m.yaml");
    let copy = model.lines().find(|line| line.starts_with("  coarse: ")).unwrap_or_else(|| panic!("{model}"));
    assert!(copy.contains("unit: degF, rate:") && copy.contains("derived_from: [fine]"), "{copy}");
    let report = folder.json("replay m.yaml log.csv", 0);
    assert_eq!(report["events"], serde_json::json!([]), "{report}");
}

#[test]
fn from_a_recording_to_a_watching_model_in_three_commands() {
    let folder = Folder::with(&[("drive.csv", drive(2_000).as_bytes())]);
    folder.ends("draft drive.csv -o m.yaml", 0);
    folder.ends("calibrate m.yaml drive.csv --patch tuned.yaml --false-alarms 20", 0);
    folder.ends("model patch m.yaml tuned.yaml -o m.yaml", 0);
    let events = |arguments: &str| {
        let report = folder.json(&format!("replay m.yaml drive.csv {arguments}"), 0);
        let events = report["events"].as_array().unwrap().iter().filter(|it| it["kind"] == "failed");
        events.map(|it| it["signal"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(events(""), Vec::<String>::new());
    assert_eq!(events("--inject bias=3:wheel_2@120s.."), ["wheel_2"]);
}

#[test]
fn rows_of_several_sources_are_told_apart() {
    let mut text = "reading,station,temp\n".to_owned();
    let value = |station: usize, row: usize| {
        20.0 + (row as f64 / 40.0).sin() * 3.0 + (row * station % 7) as f64 * 0.01
    };
    for (station, row) in [1, 2].into_iter().flat_map(|station| (0..500).map(move |row| (station, row))) {
        writeln!(text, "{row},{station},{:.2}", value(station, row)).unwrap();
    }
    let folder = Folder::with(&[("rooms.csv", text.as_bytes())]);
    let time = "--time-column reading --time-unit 5s";
    assert!(folder.ends(&format!("draft rooms.csv {time}"), 0).stderr.contains("--by"));
    let model = folder.ends(&format!("draft rooms.csv {time} --by station"), 0).stdout;
    let second =
        "station_2_temp: { variable: temp, source: \"rooms#temp[station=2]@reading*5s\", rate: 0.2 Hz";
    assert!(model.contains(second), "{model}");
    folder.refuses(&format!("draft rooms.csv {time} --by temp"), &["does not tell sources apart"]);
}

#[test]
fn nothing_is_drafted_of_what_never_changes() {
    let folder = Folder::with(&[("still.csv", b"t,a\n0,1\n1,1\n2,1\n")]);
    folder.refuses("draft still.csv", &["a: it never changes"]);
    folder.refuses("draft absent.csv", &["absent.csv"]);
}
