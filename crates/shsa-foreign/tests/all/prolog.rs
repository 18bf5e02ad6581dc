//! SWI-Prolog answers from the exported facts as our searches do; files of the thesis's forms give its answers.
//!
//! The rules at the end of an export are the definition, written for Prolog: they share nothing with the searches.

use serde_json::Value;
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::plan::{Limits, Options, StopReason, exhaustive};
use shsa_foreign::load;
use shsa_foreign::thesis::prolog;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Sets of relations.
type Sets = BTreeSet<Vec<String>>;

fn substitutions(knowledge: &KnowledgeBase, variable: VariableId, options: &Options) -> Option<Sets> {
    let plan = exhaustive(knowledge, variable, options, Limits::default());
    (plan.stop == StopReason::Complete).then(|| {
        let names = plan.substitutions.iter().map(|(found, _)| {
            let mut names: Vec<String> =
                found.relations().into_iter().map(|id| knowledge.relations()[id].name.clone()).collect();
            names.sort();
            names
        });
        names.collect()
    })
}

/// The answers of SWI-Prolog for each file and variable; `None` for a variable that took too long.
fn answers(files: &[PathBuf]) -> Option<BTreeMap<(String, String), Option<Sets>>> {
    let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/all/prolog/substitution.pl");
    let output = match Command::new("swipl").arg(program).arg("--").args(files).output() {
        Ok(output) => output,
        Err(error) => {
            let mut stderr = std::io::stderr().lock();
            let _ = writeln!(stderr, "SKIPPED: swipl: {error}: install SWI-Prolog (swi-prolog-nox)");
            return None;
        }
    };
    let reported = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && reported.is_empty(), "{reported}");
    let mut answers: BTreeMap<(String, String), Option<Sets>> = BTreeMap::new();
    for line in String::from_utf8_lossy(&output.stdout).lines() {
        let mut words = line.split('\t').map(str::to_owned);
        let key = (words.next().unwrap(), words.next().unwrap());
        let relations: Vec<String> = words.collect();
        let sets = answers.entry(key).or_insert_with(|| Some(Sets::new()));
        match sets {
            Some(_) if relations == ["!limit"] => *sets = None,
            Some(sets) => {
                sets.insert(relations);
            }
            None => {}
        }
    }
    Some(answers)
}

/// The relation that an exported name stands for: its own, or that of the same equation solved for another variable.
fn own_name(knowledge: &KnowledgeBase, name: &str) -> String {
    let is = |name: &str| knowledge.relations().iter().any(|relation| relation.name == name);
    let cut =
        || name.char_indices().filter(|(_, c)| *c == '_').map(|(at, _)| &name[..at]).rfind(|cut| is(cut));
    if is(name) { name.to_owned() } else { cut().unwrap_or(name).to_owned() }
}

/// Compares all variables of the models; gives how many there were and how many substitutions they have.
fn check(folder: &str, models: &[(String, String)]) -> Option<(usize, usize)> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(folder);
    fs::create_dir_all(&folder).unwrap();
    let bases: Vec<KnowledgeBase> = models
        .iter()
        .map(|(name, text)| {
            let loaded = load(text, name);
            assert!(loaded.report.ok(), "{}", loaded.report.render(false));
            loaded.knowledge
        })
        .collect();
    let files: Vec<PathBuf> = (0..bases.len()).map(|at| folder.join(format!("{at}.pl"))).collect();
    for (file, knowledge) in files.iter().zip(&bases) {
        fs::write(file, prolog::write(knowledge).text).unwrap();
    }
    let answers = answers(&files)?;
    let (mut variables, mut found) = (0, 0);
    for ((file, knowledge), (name, text)) in files.iter().zip(&bases).zip(models) {
        let own = |names: &Vec<String>| {
            let mut names: Vec<String> = names.iter().map(|name| own_name(knowledge, name)).collect();
            names.sort();
            names
        };
        for (id, variable) in knowledge.variables().enumerate() {
            let key = (file.display().to_string(), variable.name.clone());
            let none = Some(Sets::new());
            let Some(answer) = answers.get(&key).unwrap_or(&none) else { continue };
            let Some(ours) = substitutions(knowledge, id, &Options::default()) else { continue };
            let theirs: Sets = answer.iter().map(own).collect();
            assert_eq!(ours, theirs, "{name}, {}:\n{text}", variable.name);
            variables += 1;
            found += ours.len();
        }
        // what was exported is read as the same structure
        let again = load(&fs::read_to_string(file).unwrap(), name);
        assert!(
            again.report.ok() || again.knowledge.relations().is_empty(),
            "{}",
            again.report.render(false)
        );
    }
    Some((variables, found))
}

#[test]
fn models_have_the_substitutions_that_prolog_finds() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let yaml = paths.filter(|path| path.extension().is_some_and(|ending| ending == "yaml"));
    let models: Vec<_> =
        yaml.map(|path| (path.display().to_string(), fs::read_to_string(&path).unwrap())).collect();
    let Some((variables, _)) = check("models", &models) else { return };
    assert!(variables > 20, "{variables}");
}

#[test]
fn an_export_answers_by_itself() {
    let text = include_str!("../../../../models/drivetrain.yaml");
    let knowledge = load(text, "drivetrain.yaml").knowledge;
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("drivetrain.pl");
    fs::write(&file, prolog::write(&knowledge).text).unwrap();
    let query = "forall(substitution(steering_angle, S), (atomic_list_concat(S, ' ', L), writeln(L)))";
    let Ok(output) = Command::new("swipl").args(["-g", query, "-t", "halt"]).arg(&file).output() else {
        let _ = writeln!(std::io::stderr(), "SKIPPED: swipl: install SWI-Prolog (swi-prolog-nox)");
        return;
    };
    let reported = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && reported.is_empty(), "{reported}");
    let printed = String::from_utf8_lossy(&output.stdout);
    let own = |line: &str| {
        let mut names: Vec<String> = line.split_whitespace().map(|name| own_name(&knowledge, name)).collect();
        names.sort();
        names
    };
    let theirs: Vec<Vec<String>> = printed.lines().map(own).collect();
    let wanted = knowledge.variable("steering_angle").unwrap();
    let ours = substitutions(&knowledge, wanted, &Options::default()).unwrap();
    assert_eq!((theirs.len(), theirs.into_iter().collect::<Sets>()), (ours.len(), ours));
    assert!(load(&fs::read_to_string(file).unwrap(), "drivetrain.pl").report.ok());
}

/// A small generator of pseudo-random numbers (SplitMix64).
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % end.max(1) as u64) as usize
    }
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Tree,
    Shared,
    Cyclic,
    Equations,
    Mixed,
}

/// A random model of about `size` variables.
fn model(random: &mut Random, kind: Kind, size: usize) -> String {
    let mut text = "shsa: 1\nvariables:\n".to_owned();
    (0..size).for_each(|at| writeln!(text, "  v{at}:").unwrap());
    text += "relations:\n";
    let mut fresh = 1;
    for at in 0..size + random.below(4) {
        let count = 1 + random.below(3);
        let mut any = |from: usize| (from + random.below(size - from)).to_string();
        let distinct = |names: Vec<String>| {
            names
                .into_iter()
                .collect::<BTreeSet<_>>()
                .into_iter()
                .map(|name| format!("v{name}"))
                .collect::<Vec<_>>()
        };
        let (outputs, inputs) = match kind {
            Kind::Tree => {
                let output = random.below(fresh);
                let inputs: Vec<String> = (fresh..size.min(fresh + count)).map(|at| at.to_string()).collect();
                fresh += inputs.len();
                if inputs.is_empty() {
                    break;
                }
                (vec![output.to_string()], inputs)
            }
            Kind::Shared => {
                let output = random.below(size - 1);
                (
                    vec![output.to_string()],
                    (0..count).map(|_| (output + 1 + random.below(size - output - 1)).to_string()).collect(),
                )
            }
            Kind::Cyclic => (vec![any(0)], (0..count).map(|_| any(0)).collect()),
            Kind::Equations | Kind::Mixed => {
                ((0..=count % 2).map(|_| any(0)).collect(), (0..count).map(|_| any(0)).collect())
            }
        };
        let (outputs, inputs) = (distinct(outputs), distinct(inputs));
        if outputs == inputs {
            continue;
        }
        if let (Kind::Equations, [output, ..]) = (kind, outputs.as_slice()) {
            let inputs: Vec<&str> =
                inputs.iter().map(String::as_str).filter(|input| input != output).collect();
            if !inputs.is_empty() {
                writeln!(text, "  r{at}: {output} = {}", inputs.join(" + ")).unwrap();
            }
        } else {
            writeln!(
                text,
                "  r{at}: {{ outputs: [{}], inputs: [{}] }}",
                outputs.join(", "),
                inputs.join(", ")
            )
            .unwrap();
        }
    }
    text += "signals:\n  first: { variable: v1 }\n";
    for at in (2..size).filter(|_| random.below(2) == 0).collect::<Vec<_>>() {
        writeln!(text, "  \"/s/{at}\": {{ variable: v{at} }}").unwrap();
    }
    if random.below(3) == 0 { text + "  own: { variable: v0 }\n" } else { text }
}

#[test]
fn random_models_have_the_substitutions_that_prolog_finds() {
    let mut random = Random(7);
    let kinds = [Kind::Tree, Kind::Shared, Kind::Cyclic, Kind::Equations, Kind::Mixed];
    let models: Vec<(String, String)> = (0..200)
        .map(|at| {
            let (kind, size) = (kinds[at % kinds.len()], 3 + random.below(6));
            (format!("{kind:?} {at}"), model(&mut random, kind, size))
        })
        .collect();
    let Some((variables, found)) = check("random", &models) else { return };
    assert!(variables > 800 && found > 1_000, "{variables} variables, {found} substitutions");
}

/// The recorded answers of the public programs; `None`, with a loud message, where they are missing.
fn reference(file: &str) -> Option<Value> {
    let path = format!("{}/../../../shared/reference/{file}", env!("CARGO_MANIFEST_DIR"));
    match fs::read_to_string(&path) {
        Ok(text) => Some(serde_json::from_str(&text).unwrap()),
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "SKIPPED: {path}: {error}");
            None
        }
    }
}

fn words(list: &Value) -> Vec<String> {
    list.as_array().unwrap().iter().map(|word| word.as_str().unwrap().to_owned()).collect()
}

/// The facts of a recorded knowledge base.
fn facts(base: &Value) -> String {
    let quoted =
        |names: Vec<String>| names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    let mut text = String::new();
    for function in base["functions"].as_array().unwrap() {
        let (output, relation) = (function["out"].as_str().unwrap(), function["relation"].as_str().unwrap());
        writeln!(text, "function('{output}', '{relation}', [{}]).", quoted(words(&function["in"]))).unwrap();
    }
    for (variable, itoms) in base["itoms"].as_object().unwrap() {
        writeln!(text, "itomsOf('{variable}', [{}]).", quoted(words(itoms))).unwrap();
    }
    text
}

/// The relations of a recorded tree by their outputs; `None` when a variable has two.
fn chosen(tree: &Value, choice: &mut BTreeMap<String, String>) -> Option<()> {
    let Some(relation) = tree["relation"].as_str() else { return Some(()) };
    let before = choice.insert(tree["out"].as_str().unwrap().to_owned(), relation.to_owned());
    if before.is_some_and(|before| before != relation) {
        return None;
    }
    tree["args"].as_array().unwrap().iter().try_for_each(|tree| chosen(tree, choice))
}

/// The recorded programs substitute provided variables further, and may take two relations for one variable.
#[test]
fn facts_of_the_thesis_give_its_substitutions() {
    let Some(golden) = reference("problog.json") else { return };
    let mut compared = 0;
    for case in golden["cases"].as_array().unwrap() {
        let trees: Vec<&Value> =
            case["results"].as_array().unwrap().iter().filter(|result| !result["tree"].is_null()).collect();
        let label = case["label"].as_str().unwrap();
        if trees.is_empty() || !label.contains("all substitutions") {
            continue;
        }
        let loaded = load(&facts(&case["kb"]), label);
        assert!(loaded.report.ok(), "{label}: {}", loaded.report.render(false));
        let root = loaded.knowledge.variable(trees[0]["root"].as_str().unwrap()).unwrap();
        let mut expected = Sets::new();
        for tree in trees {
            let mut choice = BTreeMap::new();
            if chosen(&tree["tree"], &mut choice).is_some() {
                let mut names: Vec<String> = choice.into_values().collect();
                names.sort();
                expected.insert(names);
            }
        }
        let options = Options { substitute_provided: true, ..Options::default() };
        assert_eq!(substitutions(&loaded.knowledge, root, &options).unwrap(), expected, "{label}");
        compared += 1;
    }
    assert!(compared > 40, "{compared}");
}

/// A recorded graph in the thesis's YAML.
fn yaml(graph: &Value) -> String {
    let mut text = "relations:\n".to_owned();
    for (name, facts) in graph["relations"].as_object().unwrap() {
        writeln!(text, "  {name}:").unwrap();
        for output in words(&facts["out"]) {
            let inputs: Vec<String> =
                words(&facts["in"]).into_iter().filter(|input| *input != output).collect();
            writeln!(text, "    {output}:\n      in: [{}]\n      fct: \"\"", inputs.join(", ")).unwrap();
        }
    }
    text += "properties:\n  provided:\n";
    for (name, facts) in graph["variables"].as_object().unwrap() {
        writeln!(text, "    {name}: {}", if facts["provided"] == true { "True" } else { "False" }).unwrap();
    }
    text
}

#[test]
fn yaml_of_the_thesis_gives_its_substitutions() {
    let Some(golden) = reference("search.json") else { return };
    let mut roots = 0;
    for (file, recordings) in golden["models"].as_object().unwrap() {
        let text = yaml(&recordings["graph"]);
        let loaded = load(&text, file);
        assert!(loaded.report.ok(), "{file}: {}\n{text}", loaded.report.render(false));
        for (root, recording) in recordings["roots"].as_object().unwrap() {
            // a name that formulas keep for themselves is another one here
            let renamed = || loaded.knowledge.variable(&format!("{root}_"));
            let root = loaded.knowledge.variable(root).or_else(renamed).unwrap();
            let recorded = recording["dfs"].as_array().unwrap().iter();
            let expected: Sets = recorded.map(|answer| words(&answer["relations"])).collect();
            let found = substitutions(&loaded.knowledge, root, &Options::default()).unwrap();
            assert_eq!(found, expected, "{file}\n{text}");
            roots += 1;
        }
    }
    assert_eq!(roots, 161);
}
