//! Two trucks over Zenoh within this machine.

/// The demonstration needs nothing but this machine, and ends as it began.
#[test]
fn the_demonstration_degrades_with_radar_and_link_and_ends_as_it_began() {
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_shsa-demos"))
        .args(["platoon", "--json"])
        .output()
        .unwrap();
    let reported: serde_json::Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&output.stderr)));
    assert_eq!(reported["as_before"], true, "{reported}");
    let [radar, cut, back, works] = reported["happenings"].as_array().unwrap().as_slice() else {
        panic!("{reported}")
    };
    let served = |happening: &serde_json::Value, truck: &str| {
        let served = &happening[truck];
        (served["source"].as_str().unwrap().to_owned(), served["level"].as_str().unwrap().to_owned())
    };
    let by = |source: &str, level: &str| (source.to_owned(), level.to_owned());
    let (wheels, own) = ("/leader/wheels by rolling", "/follower/speed, /follower/radar by seen");
    assert_eq!(served(radar, "leader"), by(wheels, "ASIL A"), "{reported}");
    assert_eq!(served(radar, "follower").1, "ASIL A", "{reported}");
    assert_eq!(served(cut, "follower"), by(own, "ASIL A"), "{reported}");
    assert_eq!(served(back, "leader"), by(wheels, "ASIL A"), "{reported}");
    assert_eq!(served(works, "leader"), by("/leader/radar", "ASIL B"), "{reported}");
    assert_eq!(served(works, "follower"), by("/leader/speed", "ASIL B"), "{reported}");
}
