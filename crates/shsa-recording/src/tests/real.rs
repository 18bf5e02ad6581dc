//! Real recordings, where they are available; the figures for bags come from the Python package `rosbags` 0.11.

use super::*;

/// The path of a recording; `None`, with a loud message, where it is missing.
fn real(path: &str) -> Option<PathBuf> {
    let full = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data")).join(path);
    if !full.exists() {
        eprintln!("SKIPPED: no recording at {}", full.display());
        return None;
    }
    Some(full)
}

fn read_real(path: &Path, sources: &[&str]) -> Recording {
    let recording = read(&[path.into()], &wanted(sources), &ReadOptions::default()).unwrap();
    assert!(!recording.degraded, "{:?}", recording.warnings);
    recording
}

/// The number of a wanted signal's samples, the first and the last.
fn summary(recording: &Recording, wanted: usize) -> String {
    let of: Vec<&Sample> = recording.samples.iter().filter(|sample| sample.wanted == wanted).collect();
    let show = |sample: Option<&&Sample>| {
        sample.map_or(String::new(), |Sample { time, received, value, .. }| {
            let value = match value {
                RawValue::Vector(items) => {
                    let finite: f64 = items.iter().filter(|item| item.is_finite()).sum();
                    format!("{} items, finite sum {finite:.6}", items.len())
                }
                other => format!("{other:?}"),
            };
            format!("{} {} {value}", time.0, received.0)
        })
    };
    format!("{} | {} | {}", of.len(), show(of.first()), show(of.last()))
}

fn sum(recording: &Recording, wanted: usize) -> f64 {
    let of = recording.samples.iter().filter(|sample| sample.wanted == wanted);
    let number = |sample: &Sample| match sample.value {
        RawValue::Number(value) => value,
        _ => f64::NAN,
    };
    of.map(number).sum()
}

fn topic_list(path: &Path) -> Vec<String> {
    let line = |topic: TopicInfo| {
        format!("{} {} {} {:.2}", topic.name, topic.kind, topic.count, topic.rate_hz.unwrap_or(0.0))
    };
    topics(path).into_iter().map(line).collect()
}

#[test]
fn husky() {
    let Some(path) = real("husky/test1.bag") else { return };
    assert_eq!(
        topic_list(&path),
        [
            "/fix sensor_msgs/NavSatFix 989 2.50",
            "/husky_velocity_controller/odom nav_msgs/Odometry 3952 9.99",
            "/imu/data sensor_msgs/Imu 11865 30.01",
        ]
    );
    let recording = read_real(
        &path,
        &[
            "imu/data#angular_velocity.y",
            "/husky_velocity_controller/odom#twist.twist.linear.x",
            "fix#latitude",
            "fix#status.status",
            "husky_velocity_controller/odom#pose.covariance",
            "imu/data#orientation_covariance[0]",
        ],
    );
    assert_eq!(
        summary(&recording, 0),
        "11865 | 1432235497988949113 1432235498025043042 Number(-0.010768940672278404) \
         | 1432235893280979189 1432235893302031381 Number(0.0006675403565168381)"
    );
    assert_eq!(
        summary(&recording, 1),
        "3952 | 1432235498027976030 1432235498028275834 Number(0.17779841518092315) \
         | 1432235893331706030 1432235893332159182 Number(1.000241556248227e-15)"
    );
    assert_eq!(
        summary(&recording, 2),
        "989 | 1432235498039089918 1432235498039331631 Number(42.375812) \
         | 1432235893228159904 1432235893228464099 Number(42.37579983333333)"
    );
    assert!((sum(&recording, 0) - -108.080_235_536_210_24).abs() < 1e-9);
    assert!((sum(&recording, 1) - 3_586.747_040_997_876).abs() < 1e-9);
    assert_eq!(sum(&recording, 3), 989.0);
    assert!(
        summary(&recording, 4)
            .starts_with("3952 | 1432235498027976030 1432235498028275834 36 items, finite sum 0.035000")
    );
    assert!(summary(&recording, 5).contains("Number(0.0012250000000000002)"));
    assert_eq!(recording.warnings, []);
}

#[test]
fn turtlebot3() {
    let Some(path) = real("turtlebot3/turtlebot3.bag") else { return };
    assert_eq!(
        topic_list(&path),
        [
            "/cmd_vel geometry_msgs/Twist 2335 26.30",
            "/imu sensor_msgs/Imu 2253 24.74",
            "/joint_states sensor_msgs/JointState 2741 30.00",
            "/odom nav_msgs/Odometry 2741 30.00",
            "/scan sensor_msgs/LaserScan 457 5.00",
        ]
    );
    let recording = read_real(
        &path,
        &[
            "scan#ranges",
            "odom#twist.twist.angular.z",
            "joint_states#position",
            "joint_states#position[1]",
            "cmd_vel#linear.x",
            "imu#angular_velocity.z",
            "joint_states#velocity[0]",
            "joint_states#position[name=wheel_left_joint]",
            "joint_states#position[name=wheel_right_joint]",
        ],
    );
    assert_eq!(
        summary(&recording, 0),
        "457 | 112573000000 112570208284 360 items, finite sum 437.544206 \
         | 203773000000 203770181270 360 items, finite sum 436.870654"
    );
    assert_eq!(
        summary(&recording, 1),
        "2741 | 112539000000 112540000000 Number(-0.0001995090671841564) \
         | 203872000000 203880780307 Number(0.0009685120574128732)"
    );
    assert!(summary(&recording, 2).ends_with("203873000000 203870726003 2 items, finite sum 1500.837519"));
    assert!(summary(&recording, 3).ends_with("Number(762.3109419945466)"));
    assert!(summary(&recording, 4).starts_with("2335 | 112540000000 112540000000 Number(0.0)"));
    assert!((sum(&recording, 4) - 798.319_615_641_783_5).abs() < 1e-9);
    assert!((sum(&recording, 5) - -1.628_408_293_164_720_7).abs() < 1e-9);
    assert_eq!((recording.found[6].samples, recording.found[6].missing), (0, 2741), "it has no velocities");
    assert!(summary(&recording, 7).ends_with("Number(762.3109419945466)"));
    assert!(summary(&recording, 8).ends_with("Number(738.526577018746)"));
}

#[test]
fn comma2k19() {
    let Some(path) = real("comma2k19") else { return };
    let recording = read_real(
        &path,
        &[
            "wheel_speed#wheel_1 [m/s]",
            "wheel_speed#wheel_4",
            "gnss_ublox#speed",
            "gyro#gyro_z",
            "steering_angle#steering_angle",
        ],
    );
    assert_eq!(
        summary(&recording, 0),
        "4974 | 589503000 589503000 Number(8.0166667) | 60577617000 60577617000 Number(11.2166667)"
    );
    let counts: Vec<usize> = recording.found.iter().map(|found| found.samples).collect();
    assert_eq!(counts, [4974, 4974, 579, 6256, 4974]);
    assert_eq!(recording.found[1].places, ["wheel_speed.csv: wheel_4 [m/s]"]);
    assert_eq!(recording.warnings, []);
}

#[test]
fn motes() {
    let Some(path) = real("suthaharan/motes.csv") else { return };
    let sources = [1, 2, 3, 4].map(|mote| format!("motes#temperature[mote_id={mote}]@reading*5s"));
    let recording = read_real(&path, &sources.each_ref().map(String::as_str));
    let counts: Vec<usize> = recording.found.iter().map(|found| found.samples).collect();
    assert_eq!(counts, [4417, 4417, 5039, 5041]);
    assert_eq!(recording.first(), Some(Time(5_000_000_000)));
    assert_eq!(recording.warnings, []);
}

#[test]
fn quad() {
    let Some(path) = real("quad/airdata.csv") else { return };
    let recording = read_real(
        &path,
        &["airdata#xSpeed", "airdata#xSpeed!changed", "airdata#latitude", "airdata#voltage(v)"],
    );
    let counts: Vec<usize> = recording.found.iter().map(|found| found.samples).collect();
    assert_eq!((counts[0], counts[2], counts[3]), (9773, 9773, 9773));
    assert_eq!(counts[1], 3101, "the speed changes at about 3 Hz, the rows come at 10 Hz");
}
