//! Demonstrations that are stories: contracts decide what may be published.

use super::{DemoArgs, System};
use crate::outcome::Outcome;
use crate::replay::Made;
use crate::story;
use anyhow::{Context, bail};
use shsa_format::story::load;
use std::path::Path;

const CAR: &str = include_str!("../../stories/28-a-car-loses-its-speed.yaml");
const STOP: &str = include_str!("../../stories/28-sonar-and-camera-together.yaml");
const STOP_MODEL: &str = include_str!("../../models/stop.yaml");
const PLATOON: &str = include_str!("../../stories/28-a-platoon-over-a-bad-link.yaml");
const PLATOON_MODEL: &str = include_str!("../../models/follower.yaml");

/// Tells the story of a system, and writes the page about it.
pub(super) fn run(args: &DemoArgs) -> anyhow::Result<Outcome> {
    if args.fast || args.without_shsa || args.json || args.page || args.seed != 1 {
        bail!("this demonstration is a story, the same each time: it takes --report only");
    }
    let text = match args.name {
        System::Rover => bail!("the rover is no story"),
        System::Car => CAR.to_owned(),
        System::Stop => with_model(STOP, "model: ../models/stop.yaml\n", STOP_MODEL),
        System::Platoon => with_model(PLATOON, "model: ../models/follower.yaml\n", PLATOON_MODEL),
    };
    let story = load(&text, "story", Path::new(".")).story.context("the story has errors")?;
    let report =
        args.report.as_deref().map(|path| (path, Made::new(Path::new("story.yaml"), text.as_bytes())));
    story::told(&story, report.as_ref().map(|(path, made)| (*path, made)))
}

/// The story with the model within it, as no file may be there.
fn with_model(story: &str, line: &str, model: &str) -> String {
    let indented = |line: &str| if line.is_empty() { "\n".to_owned() } else { format!("  {line}\n") };
    let model: String = model.lines().map(indented).collect();
    story.replacen(line, &format!("model:\n{model}"), 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_stands_in_its_story() {
        for (story, line, model) in [
            (STOP, "model: ../models/stop.yaml\n", STOP_MODEL),
            (PLATOON, "model: ../models/follower.yaml\n", PLATOON_MODEL),
        ] {
            let text = with_model(story, line, model);
            assert!(!text.contains(line));
            let loaded = load(&text, "story", Path::new("/nowhere"));
            assert!(loaded.report.ok(), "{}", loaded.report.render(false));
        }
    }
}
