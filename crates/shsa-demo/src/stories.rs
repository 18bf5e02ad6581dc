//! Systems as stories of `shsa-format`, with their models within them: no file has to be there.

const CAR: &str = include_str!("../stories/28-a-car-loses-its-speed.yaml");
const STOP: &str = include_str!("../stories/28-sonar-and-camera-together.yaml");
const STOP_MODEL: &str = include_str!("../models/stop.yaml");
const PLATOON: &str = include_str!("../stories/28-a-platoon-over-a-bad-link.yaml");
const PLATOON_MODEL: &str = include_str!("../models/follower.yaml");
const DRIVETRAIN: &str = include_str!("../stories/02-every-way-to-the-steering-angle.yaml");
const DRIVETRAIN_MODEL: &str = include_str!("../models/drivetrain.yaml");
const TANK: &str = include_str!("../stories/04-a-tank-and-its-flows.yaml");
const ROOM: &str = include_str!("../stories/04-a-room-and-its-heating.yaml");
const VOTE: &str = include_str!("../stories/25-the-vote-of-three.yaml");

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

/// A car that loses its steering angle, and then a wheel.
#[must_use]
pub fn drivetrain() -> String {
    with_model(DRIVETRAIN, "model: ../models/drivetrain.yaml\n", DRIVETRAIN_MODEL)
}

/// A tank whose float sticks.
#[must_use]
pub fn tank() -> String {
    TANK.to_owned()
}

/// A room whose thermometer stands in the sun.
#[must_use]
pub fn room() -> String {
    ROOM.to_owned()
}

/// Three sensors of one level, of which two decide.
#[must_use]
pub fn vote() -> String {
    VOTE.to_owned()
}

/// The same story with other noise. The story must not name a seed of its own.
#[must_use]
pub fn with_seed(story: &str, seed: u64) -> String {
    story.replacen("\ntrace:\n", &format!("\ntrace:\n  seed: {seed}\n"), 1)
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

    fn all() -> [String; 7] {
        [car(), stop(), platoon(), drivetrain(), tank(), room(), vote()]
    }

    #[test]
    fn a_model_stands_in_its_story() {
        for text in all() {
            assert!(!text.contains("model: ../"));
            let loaded = load(&text, "story", Path::new("/nowhere"));
            assert!(loaded.report.ok(), "{}", loaded.report.render(false));
        }
    }

    #[test]
    fn every_story_holds_for_twenty_seeds() {
        for text in all() {
            for seed in 1..=20 {
                let seeded = with_seed(&text, seed);
                assert_ne!(seeded, text);
                let story = load(&seeded, "story", Path::new("/nowhere")).story.expect("no errors");
                assert!(story.run().is_met(), "seed {seed}: {text:.60}");
            }
        }
    }
}
