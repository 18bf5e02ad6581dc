//! The commands of the tutorial run one after the other, and print what the page shows.

use crate::{Project, ROOT, is_live, words};

/// The commands of the console blocks, each with the lines that are shown below it.
fn shown(page: &str) -> Vec<(String, Vec<String>)> {
    let mut shown: Vec<(String, Vec<String>)> = Vec::new();
    for line in
        page.split("```console\n").skip(1).filter_map(|it| it.split("```").next()).flat_map(str::lines)
    {
        match (line.strip_prefix("$ "), shown.last_mut()) {
            (Some(command), _) => {
                shown.push((command.split("  #").next().unwrap_or("").to_owned(), Vec::new()))
            }
            (None, Some((_, lines))) => lines.push(line.to_owned()),
            (None, None) => panic!("output without a command: {line}"),
        }
    }
    shown
}

#[test]
fn the_tutorial_prints_what_it_shows() {
    let page = std::fs::read_to_string(format!("{ROOT}/docs/tutorial.md")).expect("there is a tutorial");
    let project = Project::new("tutorial");
    let mut count = 0;
    for (command, lines) in shown(&page) {
        let words = words(&command);
        if is_live(&words) {
            continue;
        }
        let run = project.run(&words[1..]);
        let (printed, said) = (String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
        assert!(run.status.success(), "{command}: {:?}\n{said}", run.status);
        let mut printed = printed.lines().map(str::trim_end);
        for line in lines.iter().filter(|line| *line != "...") {
            assert!(printed.any(|it| it == line), "{command}: not printed, or not there:\n{line}");
        }
        count += 1;
    }
    assert!(count >= 9, "{count} commands");
}

/// What the tutorial shows of the model is in the model.
#[test]
fn the_tutorial_shows_its_model() {
    let page = std::fs::read_to_string(format!("{ROOT}/docs/tutorial.md")).expect("there is a tutorial");
    let model = std::fs::read_to_string(format!("{ROOT}/examples/boiler/boiler.yaml")).expect("it is there");
    let blocks: Vec<&str> =
        page.split("```yaml\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert!(!blocks.is_empty());
    for line in blocks.iter().flat_map(|block| block.lines()) {
        assert!(model.lines().any(|it| it.starts_with(line)), "the model has no line {line}");
    }
}
