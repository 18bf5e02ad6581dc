//! Runs the commands of the README and of the documents, and compares the README's console blocks with the output.
#![cfg(test)]

#[cfg(feature = "mqtt")]
#[allow(dead_code, reason = "the bridges' tests use all of it")]
#[path = "../../../shsa-bridge/tests/broker/mod.rs"]
mod broker;
#[cfg(feature = "mqtt")]
#[path = "../../../shsa-bridge/tests/real/mod.rs"]
mod real;

mod links;
mod tutorial;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

fn readme() -> String {
    std::fs::read_to_string(format!("{ROOT}/README.md")).expect("there is a README")
}

/// The lines of the README's console block of a command, without the command itself.
fn shown<'a>(readme: &'a str, command: &str) -> Vec<&'a str> {
    let block = readme.split_once(&format!("$ {command}\n")).expect("the README shows the command").1;
    block.split_once("```").expect("the block ends").0.lines().collect()
}

/// Every command of the README and of the first two doors, which are about the command, without the comments behind them.
fn commands() -> Vec<String> {
    let read = |page: &str| std::fs::read_to_string(format!("{ROOT}/{page}")).expect("the page is there");
    ["README.md", "docs/use.md", "docs/operate.md"].iter().flat_map(|page| commands_of(&read(page))).collect()
}

/// Every command in the console blocks and in the indented blocks of a page, without the comments behind them.
fn commands_of(page: &str) -> Vec<String> {
    let blocks = page.split("```console\n").skip(1).filter_map(|rest| rest.split("```").next());
    let prompted = blocks.flat_map(str::lines).filter_map(|line| line.strip_prefix("$ "));
    let indented =
        page.lines().filter_map(|line| line.strip_prefix("    ")).filter(|it| it.starts_with("shsa "));
    let lines = prompted.chain(indented);
    lines.map(|line| line.split("  #").next().unwrap_or_default().trim().to_owned()).collect()
}

/// A folder with the files that the commands read; commands can write there. Dropping it removes the folder.
struct Project(PathBuf);

impl Project {
    fn new(name: &str) -> Project {
        let folder =
            Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("readme-{name}-{}", std::process::id()));
        for part in ["examples", "models", "stories"] {
            copy(&Path::new(ROOT).join(part), &folder.join(part));
        }
        Project(folder)
    }

    fn run(&self, words: &[String]) -> Output {
        let run = Command::new(env!("CARGO_BIN_EXE_shsa")).current_dir(&self.0).args(words).output();
        run.expect("the command starts")
    }
}

impl Drop for Project {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder of the project") {
        let path = entry.expect("an entry").path();
        let to = to.join(path.file_name().expect("a name"));
        if path.is_dir() {
            copy(&path, &to);
        } else {
            std::fs::copy(&path, &to).expect("a copy");
        }
    }
}

/// The words of a line as in a shell: single quotes keep blanks.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (at, part) in line.split('\'').enumerate() {
        match at % 2 {
            0 => words.extend(part.split_whitespace().map(str::to_owned)),
            _ => words.push(part.to_owned()),
        }
    }
    words
}

/// Whether a command receives from a bus, including the simulated one: such a command runs until it is stopped.
fn is_live(words: &[String]) -> bool {
    matches!(words.get(1).map(String::as_str), Some("scan" | "run" | "service"))
}

#[test]
fn every_command_on_files_runs() {
    let project = Project::new("files");
    let mut count = 0;
    for line in commands() {
        let words = words(&line);
        // `cargo` lines build, or run all tests including this one; `demo` without --fast plays in real time; `top` needs a run
        // at its port, which another test has.
        if words[0] != "shsa" || is_live(&words) || words[1] == "top" {
            assert!(words[0] == "shsa" || words[0] == "cargo", "{line}");
            continue;
        }
        let run = project.run(&words[1..]);
        let reported = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{line}: {:?}\n{reported}", run.status);
        count += 1;
    }
    assert!(count >= 20, "{count} commands");
}

/// Every command uses the broker of this test, as no other is present. Nobody publishes, so needs are unmet (status 1).
#[cfg(feature = "mqtt")]
#[test]
fn every_command_on_a_bus_runs() {
    let project = Project::new("bus");
    let broker = broker::Broker::start(&[]);
    let address = format!("mqtt://127.0.0.1:{}", broker.port());
    let mut count = 0;
    for line in commands() {
        let mut words = words(&line);
        if words[0] != "shsa" || !is_live(&words) {
            continue;
        }
        let bus = words.iter().position(|word| word == "--bus").map(|at| at + 1);
        bus.into_iter().for_each(|at| words[at] = address.clone());
        words.extend(["--for", "2s"].map(str::to_owned));
        if words[1] == "run" {
            words.extend(["--http", "127.0.0.1:0"].map(str::to_owned));
        }
        let run = project.run(&words[1..]);
        let expected = if bus.is_some() && words[1] != "service" { 1 } else { 0 };
        let reported = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(expected), "{line}\n{reported}");
        count += 1;
    }
    assert!(count >= 4, "{count} commands");
}

/// The demo of the README without waiting for real time: the run is the same.
#[test]
fn the_demo_runs() {
    let readme = readme();
    assert!(readme.contains("-- demo rover\n"), "the README shows the demo");
    let run = Project::new("demo").run(&["demo", "rover", "--fast"].map(str::to_owned));
    assert!(run.status.success());
}

#[test]
fn the_story_in_the_readme_is_what_the_command_prints() {
    let readme = readme();
    let story = "stories/02-fallback-by-value.yaml";
    let run = Command::new(env!("CARGO_BIN_EXE_shsa")).current_dir(ROOT).args(["test", story]).output();
    let run = run.expect("the command starts");
    let printed = String::from_utf8(run.stdout).expect("it prints text");
    let mut printed = printed.lines();
    for line in shown(&readme, &format!("shsa test {story}")) {
        let found = line == "..." || printed.any(|printed| printed == line);
        assert!(found, "the README shows a line that the command does not print, or not there:\n{line}");
    }
    assert!(run.status.success());
}

/// The name and the commands of each page of `docs/`: those that call `shsa`, without the variables that they set before.
fn commands_of_documents() -> Vec<(String, Vec<Vec<String>>)> {
    let pages = std::fs::read_dir(format!("{ROOT}/docs")).expect("there are documents");
    let pages = pages.map(|entry| entry.expect("an entry").path());
    let pages = pages.filter(|path| path.extension().is_some_and(|it| it == "md"));
    let read = |path: PathBuf| {
        let page = std::fs::read_to_string(&path).expect("a page is text");
        let call = |line: &String| -> Option<Vec<String>> {
            let mut words = words(line).into_iter().skip_while(|word| word.contains('='));
            (words.next()? == "shsa").then(|| words.collect())
        };
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        (name, commands_of(&page).iter().filter_map(call).collect())
    };
    pages.map(read).collect()
}

/// `--help` behind the arguments ends a command after it has read them, so live commands need no bus here.
#[test]
fn every_command_of_the_documents_has_valid_arguments() {
    let project = Project::new("arguments");
    let mut count = 0;
    for (page, calls) in commands_of_documents() {
        for call in calls {
            let run = project.run(&[&call[..], &["--help".to_owned()]].concat());
            assert!(run.status.success(), "{page}: {call:?}\n{}", String::from_utf8_lossy(&run.stderr));
            count += 1;
        }
    }
    assert!(count >= 27, "{count} commands");
}

/// The pages whose commands read recordings: `drive/` stands for any recording.
#[test]
fn every_command_of_the_documents_on_recordings_runs() {
    let project = Project::new("recordings");
    let drives = ["examples/monday/", "examples/tuesday/"].map(str::to_owned);
    let mut count = 0;
    for (page, calls) in commands_of_documents() {
        for call in calls.iter().filter(|_| ["learning", "recordings"].contains(&&*page)) {
            let words = call.iter().flat_map(|word| match &**word {
                "drive/" => drives.to_vec(),
                _ => vec![word.clone()],
            });
            let run = project.run(&words.collect::<Vec<_>>());
            assert!(run.status.success(), "{page}: {call:?}\n{}", String::from_utf8_lossy(&run.stderr));
            count += 1;
        }
    }
    assert!(count >= 6, "{count} commands");
}

/// The rows of docs/thesis.md: what is here, and the commands that show it.
fn rows_about_the_thesis() -> Vec<(String, Vec<String>)> {
    let page = std::fs::read_to_string(format!("{ROOT}/docs/thesis.md")).expect("the page is there");
    let rows = page
        .lines()
        .filter(|line| line.starts_with("| ") && !line.starts_with("| thesis |") && !line.contains("---"));
    let cells = rows.map(|row| row.split('|').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>());
    let quoted = |cell: &str| cell.split('`').skip(1).step_by(2).map(str::to_owned).collect();
    cells.map(|cells| (cells[2].clone(), quoted(&cells[3]))).collect()
}

/// Commands of other programs are looked for, not run. Writing a form that loses units or ranges of the model has status 3.
#[test]
fn every_row_about_the_thesis_is_shown_by_a_command_that_runs() {
    let project = Project::new("thesis");
    let rows = rows_about_the_thesis();
    for (here, commands) in &rows {
        assert!(!commands.is_empty() || here == "not here" || here.starts_with("see "), "{here}");
        for command in commands {
            let words = words(command);
            if words[0] == "shsa" {
                let run = project.run(&words[1..]);
                let may_lose = words[1..3] == ["model", "convert"] && run.status.code() == Some(3);
                let reported = String::from_utf8_lossy(&run.stderr);
                assert!(run.status.success() || may_lose, "{command}: {:?}\n{reported}", run.status);
            } else {
                assert!(is_there(&words), "{command}: nothing has this name");
            }
        }
    }
    assert!(rows.len() > 40, "{} rows", rows.len());
}

/// Whether a test that another program runs is there, or a benchmark or command has a file of its name, or is named in one.
fn is_there(words: &[String]) -> bool {
    let mut words = words.iter().map(String::as_str).skip_while(|word| word.contains('='));
    match (words.next(), words.next(), words.collect::<Vec<_>>().as_slice()) {
        (Some(program @ ("shsa-bench" | "shsa-demos")), Some(name), _) => {
            is_source(&format!("workshop/{program}/src"), is_named(name))
        }
        (Some("cargo"), Some("xtask"), [name]) => is_source("workshop/xtask/src", is_named(name)),
        (Some("cargo"), Some("test"), ["-p", package]) => {
            folder_of(package).is_some_and(|folder| is_source(&folder, is_tested("")))
        }
        (Some("cargo"), Some("test"), ["-p", package, .., name]) => {
            folder_of(package).is_some_and(|folder| is_source(&folder, is_tested(name)))
        }
        (Some("cargo"), Some("bench"), ["-p", package, .., name]) => {
            is_source(&format!("crates/{package}/benches"), is_named(name))
        }
        _ => false,
    }
}

/// The folder of a package of the project; some are not below `crates`.
fn folder_of(package: &str) -> Option<String> {
    let short = package.trim_start_matches("shsa-");
    let folders =
        ["crates/", "workshop/", ""].map(|above| [package, short].map(|name| format!("{above}{name}")));
    folders.into_iter().flatten().find(|folder| Path::new(ROOT).join(folder).join("Cargo.toml").is_file())
}

/// Whether a source file has a name in its path, or in its text.
fn is_named(name: &str) -> impl Fn(&str, &str) -> bool + Copy {
    move |path, text| path.contains(name) || text.contains(name)
}

/// Whether a source file has tests, and the name in its path or in that of a function.
fn is_tested(name: &str) -> impl Fn(&str, &str) -> bool + Copy {
    move |path, text| {
        let mut functions = text.lines().filter_map(|line| line.trim_start().strip_prefix("fn "));
        let is_function = |line: &str| line.split('(').next().is_some_and(|it| it.contains(name));
        text.contains("#[test]") && (path.contains(name) || functions.any(is_function))
    }
}

/// Whether a source file below a folder of the project is as `is`, a function of its path and text, says.
fn is_source(folder: &str, is: impl Fn(&str, &str) -> bool + Copy) -> bool {
    std::fs::read_dir(Path::new(ROOT).join(folder)).expect("a folder of the project").any(|entry| {
        let entry = entry.expect("an entry");
        let path = format!("{folder}/{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            return is_source(&path, is);
        }
        path.ends_with(".rs") && std::fs::read_to_string(entry.path()).is_ok_and(|text| is(&path, &text))
    })
}
