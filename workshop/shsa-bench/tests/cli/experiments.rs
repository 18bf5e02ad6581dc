//! `shsa-bench thesis`: the experiments of the thesis.

use crate::folder::{Folder, keys};
use serde_json::Value;

fn lines(arguments: &str) -> Vec<Value> {
    let ended = Folder::new().ends(&format!("thesis {arguments} --json"), 0);
    ended.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn of<'a>(lines: &'a [Value], search: &str, take: &str, depth: u64) -> &'a Value {
    lines
        .iter()
        .find(|line| line["search"] == search && line["take"] == take && line["depth"] == depth)
        .unwrap_or_else(|| panic!("no {search} {take} {depth}"))
}

#[test]
fn complete_trees_have_as_many_substitutions_as_the_formula_says() {
    let lines = lines("--experiment ex1 --limit 100000");
    assert_eq!(lines.len(), 5 * 9);
    let shape = ["experiment", "branch", "depth", "seed", "nodes", "reached", "search", "take", "seconds"];
    let found = ["stop", "expanded", "found", "utility", "bound", "best"];
    assert_eq!(keys(&lines[0]), [&shape[..], &found[..]].concat());
    for search in ["best_first", "property_guided", "depth_first", "exhaustive"] {
        for (depth, count) in [(2, 2), (4, 8), (6, 128)] {
            let line = of(&lines, search, "all", depth);
            assert_eq!((&line["found"], &line["stop"]), (&count.into(), &"complete".into()), "{line}");
        }
        // There are 2^31 answers: a limit ends each search, and the search gives the bound of the others.
        let line = of(&lines, search, "all", 10);
        assert!(line["stop"].as_str().unwrap().starts_with("limit"), "{line}");
        assert!(line["bound"].as_f64().unwrap() > 0.0, "{line}");
    }
    let best = of(&lines, "best_first", "first", 10);
    assert_eq!((&best["found"], &best["utility"]), (&1.into(), &best["best"]));
    assert_eq!((&best["nodes"], &best["reached"]), (&2047.into(), &2047.into()));
}

#[test]
fn what_proves_its_first_answer_gives_the_best() {
    let lines = lines("--experiment ex2,ex3c,ex4 --seeds 2 --limit 1000");
    let (mut below, mut seen) = (0, 0);
    for line in lines.iter().filter(|line| line["take"] == "first") {
        let (Some(utility), Some(best)) = (line["utility"].as_f64(), line["best"].as_f64()) else { continue };
        assert!(utility <= best + 1e-12, "{line}");
        let proves = line["search"] == "best_first" || line["search"] == "property_guided";
        if proves && line["stop"] == "found" {
            assert_eq!(utility, best, "{line}");
            seen += 1;
        }
        below += usize::from(utility < best - 1e-9);
    }
    // The other searches take the first answer that they find.
    assert!(seen > 40 && below > 0, "{seen} {below}");
}

#[test]
fn the_case_studies_are_planned_and_looked_up() {
    let lines = lines("--experiment rover,drivetrain");
    let of = |model: &str, search: &str| -> Vec<&Value> {
        lines.iter().filter(|line| line["experiment"] == model && line["search"] == search).collect()
    };
    // The wheels, and the lateral acceleration with the speed.
    assert!(of("drivetrain", "exhaustive").iter().all(|line| line["found"] == 2));
    assert_eq!(of("drivetrain", "visit")[0]["nodes"], 22);
    assert!(!of("drivetrain", "contingency").is_empty() && !of("rover", "contingency").is_empty());
    assert!(of("rover", "best_first").iter().all(|line| line["stop"] != Value::Null));
}

#[test]
fn several_threads_find_what_one_does() {
    let lines = lines("--experiment ex1 --limit 100000 --threads 2");
    assert_eq!(lines.len(), 5 * 11);
    for (one, several) in
        [("best_first", "best_first_in_parts"), ("property_guided", "property_guided_in_parts")]
    {
        for depth in [2, 4, 6] {
            let [one, several] = [one, several].map(|search| of(&lines, search, "all", depth));
            for key in ["found", "stop", "utility", "bound"] {
                assert_eq!(one[key], several[key], "{several}");
            }
        }
    }
    let text = Folder::new().ends("thesis --experiment rover --threads 2", 0).stdout;
    assert!(text.contains("All answers, on several threads"), "{text}");
}

#[test]
fn the_document_names_its_command_and_keeps_the_results() {
    let folder = Folder::new();
    let output = folder
        .ends("thesis --experiment ex2,drivetrain --seeds 1 --limit 500 --out workshop/measured", 0)
        .stdout;
    assert!(output.contains("First answer") && output.contains("ex2 b2 d18"), "{output}");
    let document = folder.read("workshop/measured/experiments.md");
    assert!(document.contains(
        "`shsa-bench thesis --experiment ex2,drivetrain --seeds 1 --limit 500 --out workshop/measured`"
    ));
    assert!(document.contains("| ex2 b2 d14 | 1 | 32767 |"), "{document}");
    assert!(document.contains("![First answer in ex2](experiments-first.svg)"), "{document}");
    assert!(document.contains("## The best answer beside a visit"), "{document}");
    let plot = folder.read("workshop/measured/experiments-first.svg");
    assert!(plot.starts_with("<svg") && plot.contains("public SH-PGSA") && plot.contains("public ORR"));
    let raw = folder.read("workshop/measured/experiments.jsonl");
    assert!(raw.lines().all(|line| serde_json::from_str::<Value>(line).is_ok()));
    assert!(raw.lines().count() > 9 * 10);
}

#[test]
fn what_is_no_experiment_is_refused() {
    let folder = Folder::new();
    folder.refuses("thesis --experiment ex5", &["ex5", "possible values", "ex4"]);
    folder.refuses("thesis --seeds 0", &["expected a whole number from 1 on"]);
}
