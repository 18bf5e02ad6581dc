//! Systems under contract, as stories of `shsa-format` with their models within them: no file has to be there.

const CAR: &str = include_str!("../stories/28-a-car-loses-its-speed.yaml");
const STOP: &str = include_str!("../stories/28-sonar-and-camera-together.yaml");
const STOP_MODEL: &str = include_str!("../models/stop.yaml");
const PLATOON: &str = include_str!("../stories/28-a-platoon-over-a-bad-link.yaml");
const PLATOON_MODEL: &str = include_str!("../models/follower.yaml");

/// A car that loses its speed, gets an upgrade, and runs out of processing time.
///
/// # Example
/// ```
/// use shsa_format::story::load;
///
/// let loaded = load(&shsa_demo::stories::car(), "car", std::path::Path::new("."));
/// let story = loaded.story.expect("the story has no errors");
/// assert!(story.run().is_met());
/// ```
#[must_use]
pub fn car() -> String {
    CAR.to_owned()
}

/// A robot's emergency stop at SIL 2: by its lidar, or by sonar and camera together.
#[must_use]
pub fn stop() -> String {
    with_model(STOP, "model: ../models/stop.yaml\n", STOP_MODEL)
}

/// A truck behind another: what the leader guarantees comes over the network, and ends with it.
#[must_use]
pub fn platoon() -> String {
    with_model(PLATOON, "model: ../models/follower.yaml\n", PLATOON_MODEL)
}

/// The story with the model in the place of the line that names it.
fn with_model(story: &str, line: &str, model: &str) -> String {
    let indented = |line: &str| if line.is_empty() { "\n".to_owned() } else { format!("  {line}\n") };
    let model: String = model.lines().map(indented).collect();
    story.replacen(line, &format!("model:\n{model}"), 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_format::story::load;
    use std::path::Path;

    #[test]
    fn a_model_stands_in_its_story() {
        for text in [car(), stop(), platoon()] {
            assert!(!text.contains("model: ../"));
            let loaded = load(&text, "story", Path::new("/nowhere"));
            assert!(loaded.report.ok(), "{}", loaded.report.render(false));
        }
    }
}
