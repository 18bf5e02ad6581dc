//! What the messages of the programs look like, and the model over such messages.

use shsa_demo::rover::MODEL;

/// What the messages look like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// JSON.
    Json,
    /// The standard messages of ROS 2.
    Ros2,
}

/// What is different in the model over ROS 2: texts, and what replaces them.
const OVER_ROS2: [[&str; 2]; 2] = [
    ["variable: v_3D, source: /depth/image#data", "variable: v_2D, source: /depth/scan#ranges"],
    ["source: /odom/speed", "source: /odom#twist.twist.linear.x"],
];

/// The model of the rover whose programs speak like this. Over ROS 2 the depth camera gives scans, as by `depthimage_to_laserscan`,
/// and the odometry is a `nav_msgs/msg/Odometry`.
#[must_use]
pub fn model(encoding: Encoding) -> String {
    match encoding {
        Encoding::Json => MODEL.to_owned(),
        Encoding::Ros2 => OVER_ROS2.iter().fold(MODEL.to_owned(), |text, [from, to]| text.replace(from, to)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_over_ros2_has_the_same_signals_from_other_topics() {
        for [from, _] in OVER_ROS2 {
            assert_eq!(MODEL.matches(from).count(), 1, "{from}");
        }
        let signals = |encoding| {
            let loaded = shsa_model::load(&model(encoding), "rover.yaml");
            assert!(loaded.report.ok(), "{}", loaded.report.render(false));
            let signals = loaded.knowledge.signals().iter();
            signals.map(|signal| (signal.name.clone(), signal.source.clone())).collect::<Vec<_>>()
        };
        let (json, ros2) = (signals(Encoding::Json), signals(Encoding::Ros2));
        assert!(json.iter().map(|it| &it.0).eq(ros2.iter().map(|it| &it.0)));
        let sources: Vec<&str> = ros2.iter().map(|it| &*it.1).collect();
        let expected = [
            "/lidar/scan#ranges",
            "/sonar/ranges#ranges",
            "/depth/scan#ranges",
            "/odom#twist.twist.linear.x",
        ];
        assert_eq!(sources, expected);
    }
}
