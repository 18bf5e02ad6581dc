//! `shsa plan`: substitutions, best first.

use crate::folder::{Folder, keys};
use crate::tank;
use serde_json::Value;

#[test]
fn all_substitutions_as_json() {
    let answer = tank::folder().json("plan tank.yaml level --all", 0);
    let found = ["variable", "engine", "stop", "expanded", "search_ns"];
    // `bound`: no substitution that was not found has a higher utility, if a limit ends the search.
    assert_eq!(keys(&answer), [&found[..], &["bound", "substitutions"]].concat());
    assert_eq!((&answer["variable"], &answer["engine"]), (&"level".into(), &"best-first".into()));
    assert_eq!(answer["stop"], "complete");
    assert!(answer["search_ns"].as_u64().unwrap() > 0);
    let substitutions = answer["substitutions"].as_array().unwrap();
    assert_eq!(substitutions.len(), 3);
    for substitution in substitutions {
        assert_eq!(keys(substitution), ["utility", "relations", "variables", "signals", "formula"]);
    }
    let utilities: Vec<f64> = substitutions.iter().map(|each| each["utility"].as_f64().unwrap()).collect();
    assert!(utilities.is_sorted_by(|one, next| one >= next), "{utilities:?}");
    let computed =
        substitutions.iter().find(|each| each["relations"] == serde_json::json!(["hydrostatic"])).unwrap();
    assert_eq!(computed["variables"], serde_json::json!(["level", "pressure"]));
    assert_eq!(computed["signals"], serde_json::json!(["/pressure"]));
    assert_eq!(computed["formula"], "pressure / 9810");
}

#[test]
fn one_is_found_unless_more_are_asked_for() {
    let folder = tank::folder();
    let count = |arguments: &str| {
        let answer = folder.json(&format!("plan tank.yaml level {arguments}"), 0);
        answer["substitutions"].as_array().unwrap().len()
    };
    assert_eq!([count(""), count("--top 2"), count("--top 9"), count("--all")], [1, 2, 3, 3]);
    folder.refuses("plan tank.yaml level --top 2 --all", &["cannot be used with"]);
    folder.refuses("plan tank.yaml level --top 0", &["expected a whole number from 1 on"]);
}

#[test]
fn what_is_behind_a_provided_variable_is_found_when_asked_for() {
    let folder = Folder::with(&[(
        "chain.yaml",
        b"shsa: 1\nvariables: { a: {}, b: {}, c: {} }\n\
          relations: { r: { output: a, inputs: [b] }, s: { output: b, inputs: [c] } }\n\
          signals: { sb: { variable: b }, sc: { variable: c } }\n",
    )]);
    let relations = |arguments: &str| -> Vec<serde_json::Value> {
        let answer = folder.json(&format!("plan chain.yaml a --all {arguments}"), 0);
        answer["substitutions"].as_array().unwrap().iter().map(|it| it["relations"].clone()).collect()
    };
    use serde_json::json;
    assert_eq!(relations(""), [json!(["r"])]);
    for engine in ["best-first", "dfs", "sh-pgsa", "exhaustive"] {
        assert_eq!(relations(&format!("--behind --engine {engine}")), [json!(["r"]), json!(["r", "s"])]);
    }
    folder.refuses("plan chain.yaml a --contingency --behind", &["cannot be used with"]);
}

#[test]
fn each_step_of_a_search_is_shown() {
    let folder = tank::folder();
    let answer = folder.json("plan tank.yaml level --all --behind --trace", 0);
    assert_eq!(answer["engine"], "sh-pgsa");
    let steps = answer["steps"].as_array().unwrap();
    // Each complete step is an answer, with the utility of the answer.
    let utilities = |of: &[Value]| -> Vec<f64> {
        let mut found: Vec<f64> = of.iter().map(|it| it["utility"].as_f64().unwrap()).collect();
        found.sort_by(f64::total_cmp);
        found
    };
    let complete: Vec<Value> = steps.iter().filter(|step| step["leaves"] == "complete").cloned().collect();
    assert_eq!(utilities(&complete), utilities(answer["substitutions"].as_array().unwrap()));
    for (at, step) in steps.iter().enumerate() {
        assert!(step["after"].as_u64().is_none_or(|after| after <= at as u64), "{step}");
        assert!(!step["decisions"].as_array().unwrap().is_empty(), "{step}");
    }
    let text = folder.ends("plan tank.yaml level --all --behind --trace", 0).stdout;
    assert!(text.contains("step  decides") && text.contains("complete"), "{text}");
    folder.refuses("plan tank.yaml level --trace --engine dfs", &["cannot be used with"]);
}

#[test]
fn each_substitution_is_drawn() {
    let folder = tank::folder();
    let run = folder.ends("plan tank.yaml level --all --behind --draw drawn", 0);
    assert!(run.stderr.contains("written to drawn"), "{}", run.stderr);
    let (one, two) = (folder.read("drawn/level-1.svg"), folder.read("drawn/level-2.svg"));
    assert!(one.contains("<svg") && one != two, "{one}");
}

#[test]
fn engines_agree() {
    let folder = tank::folder();
    let found = |engine: &str| {
        let answer = folder.json(&format!("plan tank.yaml level --all --engine {engine}"), 0);
        assert_eq!(answer["engine"], engine);
        answer["substitutions"].as_array().unwrap().clone()
    };
    for engine in ["sh-pgsa", "dfs", "exhaustive"] {
        assert_eq!(found("best-first"), found(engine), "{engine}");
    }
    assert_eq!(found("orr"), found("best-first")[..1]);
    folder.refuses("plan tank.yaml level --engine bfs", &["bfs", "possible values", "sh-pgsa, orr, dfs"]);
}

#[test]
fn searches_that_take_the_first_need_not_find_the_best() {
    let model = "\
shsa: 1
variables: { a: {}, b: {}, c: {} }
relations:
  dear: { output: a, inputs: [b], properties: { cost: 9 } }
  cheap: { output: a, inputs: [c] }
signals: { s1: { variable: b }, s2: { variable: c } }
";
    let folder = Folder::with(&[("m.yaml", model.as_bytes())]);
    let found = |arguments: &str| {
        let answer = folder.json(&format!("plan m.yaml a {arguments}"), 0);
        let relations: Vec<_> = answer["substitutions"].as_array().unwrap().iter().collect();
        let relations: Vec<_> = relations.iter().map(|each| each["relations"][0].clone()).collect();
        (relations, answer["stop"].clone(), answer["bound"].clone())
    };
    let dear = (vec!["dear".into()], "found".into(), 1.0.into());
    let cheap = |stop: &str, bound: f64| (vec!["cheap".into()], stop.into(), bound.into());
    assert_eq!(found("--engine orr"), dear);
    assert_eq!(found("--engine dfs"), dear);
    for engine in ["best-first", "sh-pgsa"] {
        let answer = found(&format!("--engine {engine}"));
        assert_eq!((&answer.0, &answer.1), (&cheap("", 0.0).0, &"found".into()), "{engine}");
    }
    assert_eq!(found("--engine exhaustive"), cheap("complete", 0.68253968254));
}

#[test]
fn text_is_a_table() {
    let output = tank::folder().ends("plan tank.yaml level --all", 0).stdout;
    let expected = "\
utility   relations         from       formula (in SI units)
1.000000  (its own signal)  /level     level
1.000000  hydrostatic       /pressure  pressure / 9810
";
    assert!(output.starts_with(expected), "{output}");
    assert!(output.contains("\n\n3 substitutions (complete, "), "{output}");
}

#[test]
fn excluded_signals_are_not_used() {
    let folder = tank::folder();
    let answer = folder.json("plan tank.yaml level --exclude /level --exclude /pressure", 0);
    assert_eq!(answer["substitutions"][0]["signals"], serde_json::json!(["/volume"]));
}

#[test]
fn no_substitution_is_the_answer_no() {
    let folder = tank::folder();
    let output = folder.ends("plan tank.yaml volume --exclude /volume", 1).stdout;
    assert!(output.starts_with("nothing can provide volume (complete, "), "{output}");
    let answer = folder.json("plan tank.yaml volume --exclude /volume", 1);
    assert_eq!(answer["substitutions"], serde_json::json!([]));
    assert_eq!(answer["stop"], "complete");
}

#[test]
fn a_limit_that_ends_the_search_is_reported() {
    let folder = tank::folder();
    let output = folder.ends("plan tank.yaml level --all --limit 0", 0).stdout;
    assert!(
        output.ends_with(
            "1 substitution (limit of expansions, 0 decisions; what is missing is worth at most 1.000000)\n"
        ),
        "{output}"
    );
    let answer = folder.json("plan tank.yaml level --all --limit 0", 0);
    assert_eq!((&answer["stop"], &answer["bound"]), (&"limit of expansions".into(), &1.0.into()));
}

#[test]
fn names_that_are_not_there() {
    let folder = tank::folder();
    folder.refuses("plan tank.yaml levl", &["no variable 'levl'", "did you mean 'level'?"]);
    folder.refuses("plan tank.yaml qqq", &["no variable 'qqq'", "it has level, pressure, volume"]);
    folder.refuses("plan tank.yaml /level", &["'/level' is a signal", "'level'"]);
    folder.refuses("plan tank.yaml level --exclude /levl", &["no signal '/levl'", "did you mean '/level'?"]);
}

#[test]
fn structure_only_is_planned() {
    let model = "\
shsa: 1
variables: { a: {}, b: {}, c: {} }
relations:
  opaque: { output: a, inputs: [b, c], properties: { cost: 3 } }
signals: { s1: { variable: b }, s2: { variable: c } }
";
    let folder = Folder::with(&[("m.yaml", model.as_bytes())]);
    let answer = folder.json("plan m.yaml a", 0);
    assert_eq!(answer["substitutions"][0]["signals"], serde_json::json!(["s1", "s2"]));
    assert_eq!(answer["substitutions"][0]["formula"], "opaque(b, c)");
}

const QUALITIES: &str = "\
shsa: 1
variables: { speed: { unit: m/s }, position: { unit: m }, wheel: { unit: rad/s } }
relations:
  rate: speed = derivative(position, 500 ms)
  rolling: { equation: speed = wheel * 0.5 m / 1 rad, error: 0.1, properties: { integrity: C } }
signals:
  /gnss: { variable: position, rate: 1 Hz, delay: 40 ms }
  /wheel: { variable: wheel, rate: 50 Hz, value_error: 0.2, properties: { integrity: B } }
  /wheel/raw: { variable: wheel, rate: 50 Hz, value_error: 0.2, derived_from: [/wheel] }
needs:
  speed: { max_age: 300 ms }
";

#[test]
fn what_falls_short_is_not_given_and_tells_why() {
    let folder = Folder::with(&[("car.yaml", QUALITIES.as_bytes())]);
    let ask = |flags: &str, status: i32| {
        let answer = folder.json(&format!("plan car.yaml speed --all --why {flags}"), status);
        let relations = |key: &str| {
            let list = answer[key].as_array().unwrap().iter();
            list.map(|each| each["relations"][0].as_str().unwrap().to_owned()).collect::<Vec<_>>()
        };
        (relations("substitutions"), answer["refused"].to_string())
    };
    assert_eq!(ask("", 0), (vec!["rate".to_owned(), "rolling".to_owned()], "[]".to_owned()));
    let refused = |flags: &str, left: &str, because: &str| {
        let (found, refused) = ask(flags, 0);
        assert_eq!(found, [left], "{flags}");
        assert!(refused.contains(because), "{flags}: {refused}");
    };
    refused("--for-need", "rolling", "it rests on values 0.54 s old, more than 0.3 s");
    refused("--max-latency 100ms", "rolling", "0.54 s old, more than 0.1 s");
    refused("--max-width 0.3", "rate", "its values are at least 0.4");
    refused("--min-rate 10", "rolling", "signals of position come 1 times a second, not 10");
    refused("--integrity B", "rolling", "signals of position have integrity none, not B");
    refused("--independent-of /wheel", "rate", "which is not independent of the suspects");
    refused("--exclude-relation rate", "rolling", "rate may not be used");
    assert_eq!(ask("--integrity C", 1).0.len(), 0);
    let (_, refused) = ask("--max-width 0.3 --exclude /gnss", 1);
    assert!(refused.contains(r#""because":["no signal of position may be used"]"#), "{refused}");
    let text = folder.ends("plan car.yaml speed --for-need --why", 0).stdout;
    assert!(text.contains("falls short  because\nrate         it rests on values 0.54 s old"), "{text}");
    folder.refuses("plan car.yaml speed --integrity E", &["'E' is no integrity level; write A, B, C or D"]);
    folder.refuses("plan car.yaml speed --max-width=-1", &["--max-width -1 makes no sense"]);
    folder.refuses("plan car.yaml wheel --for-need", &["the model has no need of 'wheel'"]);
    folder.refuses("plan car.yaml speed --exclude-relation rote", &["did you mean 'rate'?"]);
    folder.refuses("plan car.yaml speed --max-latency 1s --engine dfs", &["by the engine best-first only"]);
}

#[test]
fn threads_change_nothing() {
    let folder = tank::folder();
    for engine in ["best-first", "sh-pgsa"] {
        let plan = |threads| format!("plan tank.yaml level --all --engine {engine} --threads {threads}");
        let found = |threads| folder.json(&plan(threads), 0)["substitutions"].clone();
        assert_eq!(found(3), found(1), "{engine}");
    }
    folder.refuses("plan tank.yaml level --threads 0", &["expected a whole number from 1 on"]);
}

#[test]
fn a_model_rates_by_its_own_formulas() {
    let own = |utility: &str| {
        let folder = Folder::with(&[("car.yaml", format!("{QUALITIES}utility: {utility}\n").as_bytes())]);
        let found = folder.json("plan car.yaml speed --all", 0)["substitutions"].clone();
        let list = found.as_array().unwrap().iter();
        list.map(|each| (each["relations"][0].to_string(), each["utility"].as_f64().unwrap()))
            .collect::<Vec<_>>()
    };
    let named = |name: &str, utility: f64| (format!("\"{name}\""), utility);
    let slow = own("{ aggregate: sum, relation: 1, signal: 10 / rate }");
    assert_eq!(slow, [named("rolling", -1.2), named("rate", -11.0)]);
    let safe = own("{ aggregate: minimum, signal: integrity / 4, defaults: { integrity: 0 } }");
    assert_eq!(safe, [named("rolling", 0.5), named("rate", 0.0)]);
}

#[test]
fn what_is_left_with_the_allowed_signals_is_asked_why_too() {
    let model = "\
shsa: 1
variables: { a: {}, b: {}, c: {} }
relations:
  near: { output: a, inputs: [b] }
  far: { output: b, inputs: [c] }
signals:
  b: { variable: b }
  c: { variable: c, delay: 1 s }
";
    let folder = Folder::with(&[("m.yaml", model.as_bytes())]);
    let answer = folder.json("plan m.yaml a --why --exclude b --max-latency 100ms", 1);
    let far = serde_json::json!({
        "relations": ["near", "far"], "because": ["it rests on values 1 s old, more than 0.1 s"],
    });
    let near = serde_json::json!({ "relations": ["near"], "because": ["no signal of b may be used"] });
    assert_eq!(answer["refused"], serde_json::json!([near, far]));
}

#[test]
fn a_substitution_starts_from_the_signals_that_it_is_rated_by() {
    let from = |aggregate: &str, signal: &str| {
        let model = format!(
            "\
shsa: 1
variables: {{ a: {{}}, b: {{}} }}
relations: {{ r: {{ output: a, inputs: [b] }} }}
signals:
  bad:  {{ variable: b, properties: {{ trust: 0.1 }} }}
  good: {{ variable: b, properties: {{ trust: 0.9 }} }}
  same: {{ variable: b, properties: {{ trust: 0.9 }} }}
utility: {{ aggregate: {aggregate}, signal: {signal} }}
"
        );
        let folder = Folder::with(&[("m.yaml", model.as_bytes())]);
        let best = &folder.json("plan m.yaml a", 0)["substitutions"][0];
        (best["signals"].to_string(), best["utility"].as_f64().unwrap())
    };
    let good = r#"["good"]"#.to_owned();
    assert_eq!(from("product", "trust"), (good.clone(), 0.9));
    assert_eq!(from("minimum", "trust"), (good.clone(), 0.9));
    assert_eq!(from("sum", "1 - trust"), (good, -0.1));
}

/// In a ladder each variable is read twice, so the full text would double with every rung. In a chain the nesting would be as
/// deep as the chain is long.
#[test]
fn formulas_of_long_and_shared_structures_end() {
    let model = |rungs: usize, names: &[&str]| {
        let each = |what: &dyn Fn(usize, &str) -> String, count: usize| {
            let lines = (0..count).flat_map(|at| names.iter().map(move |name| what(at, name)));
            lines.collect::<String>()
        };
        let variables = each(&|at, name| format!("  {name}{at}: {{}}\n"), rungs + 1);
        let inputs =
            |at: usize| names.iter().map(|name| format!("{name}{}", at + 1)).collect::<Vec<_>>().join(", ");
        let relation = |at: usize, name: &str| {
            format!("  r_{name}{at}: {{ output: {name}{at}, inputs: [{}] }}\n", inputs(at))
        };
        let relations = each(&relation, rungs);
        let signals = each(&|_, name| format!("  s{name}: {{ variable: {name}{rungs} }}\n"), 1);
        format!("shsa: 1\nvariables:\n{variables}relations:\n{relations}signals:\n{signals}")
    };
    let (ladder, chain) = (model(60, &["a", "b"]), model(20_000, &["a"]));
    let folder = Folder::with(&[("ladder.yaml", ladder.as_bytes()), ("chain.yaml", chain.as_bytes())]);
    for file in ["ladder.yaml", "chain.yaml"] {
        let found = folder.json(&format!("plan {file} a0"), 0);
        let formula = found["substitutions"][0]["formula"].as_str().unwrap();
        assert!(formula.starts_with("r_a0(r_a1(") && formula.len() < 10_000, "{file}: {}", formula.len());
    }
}
