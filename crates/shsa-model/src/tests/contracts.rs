//! Contracts: reading, errors, and the guarantees for each flow.

use super::brief;
use crate::{load, read, write};
use shsa_core::assurance::{Assessment, Assurance, Composition, Evaluation, Reading, Verdict};
use shsa_core::interval::{Interval, Truth};
use shsa_core::knowledge::{EvidenceSource, KnowledgeBase, Measure, NeedId, RelationSet, SignalSet};
use shsa_core::plan::{Limits, Options, exhaustive};
use shsa_core::substitution::Way;

/// A robot that stops by its distance to the nearest obstacle: from the lidar, or from sonar and camera together.
pub(super) const ROBOT: &str = "shsa: 1
variables:
  dmin: { unit: m }
  sonar: { unit: m }
  camera: { unit: m }
  idle: {}
signals:
  /lidar: { variable: dmin, rate: 10 Hz, value_error: 0.1 }
  /sonar: { variable: sonar, rate: 10 Hz, value_error: 0.2 }
  /camera: { variable: camera, rate: 10 Hz, value_error: 0.2 }
  /computer/idle: { variable: idle, rate: 1 Hz }
relations:
  both: { equation: 'dmin = min(sonar, camera)', for: dmin, when: abs(sonar - camera) < 0.5 m }
  sonar_alone: { equation: dmin = sonar, for: dmin }
  camera_alone: { equation: dmin = camera, for: dmin }
needs:
  dmin: { signal: /stop/dmin, max_age: 500 ms }
platform:
  computer:
    evidence: { spare: value of /computer/idle at least 20 % }
    gives: { time: { time: at least 5 ms, level: SIL 2, when: spare } }
contracts:
  /lidar:
    evidence: { fresh: age at most 300 ms, sound: verdict healthy }
    gives:
      near: { error: at most 0.2 m, level: SIL 2, when: fresh and sound }
      rough: { error: at most 0.5 m, level: SIL 1, when: fresh }
  /sonar: { evidence: { fresh: age at most 300 ms }, gives: { near: { error: at most 0.3 m, level: SIL 1 } } }
  /camera: { evidence: { fresh: age at most 300 ms }, gives: { near: { error: at most 300 mm, level: SIL 1 } } }
  both:
    asks:
      one: { of: sonar, error: at most 0.3 m, level: SIL 1 }
      other: { of: camera, error: at most 0.3 m, level: SIL 1 }
    gives: { near: { error: at most 0.3 m, level: SIL 2, redundant: [one, other] } }
  sonar_alone:
    asks: { far: { of: sonar, error: at most 0.3 m, level: SIL 1 } }
    gives: { near: { error: at most 0.3 m, level: SIL 1 } }
  camera_alone:
    asks: { far: { of: camera, error: at most 0.3 m, level: SIL 1 } }
    gives: { near: { error: at most 0.3 m, level: SIL 1 } }
  dmin:
    runs_on: computer
    asks:
      stop: { of: dmin, error: at most 0.3 m, level: SIL 2 }
      time: { of: platform, time: at least 2 ms, level: SIL 2 }
";

/// A plan for one need, and the measured evidence.
struct Scene {
    knowledge: KnowledgeBase,
    assurance: Assurance,
}

impl Scene {
    #[track_caller]
    fn new(text: &str) -> Scene {
        let loaded = load(text, "m.yaml");
        assert!(loaded.report.ok(), "{}", loaded.report.render(false));
        let assurance = Assurance::new(&loaded.knowledge).expect("something is demanded");
        Scene { knowledge: loaded.knowledge, assurance }
    }

    fn need(&self) -> NeedId {
        self.knowledge.needs().ids().next().unwrap()
    }

    /// Every way of serving the need, by its name.
    fn ways(&self) -> Vec<(String, Way)> {
        let variable = self.knowledge.needs()[self.need()].variable;
        let found = exhaustive(&self.knowledge, variable, &Options::default(), Limits::default());
        let ways = found.substitutions.iter();
        let ways = ways.flat_map(|(found, _)| Way::choices(&self.knowledge, found, |_| true, 9));
        ways.map(|way| (way.describe(&self.knowledge), way)).collect()
    }

    fn composed(&self, way: &str) -> Composition {
        let ways = self.ways();
        let (_, way) =
            ways.iter().find(|(name, _)| name == way).unwrap_or_else(|| panic!("{way} of {ways:?}"));
        self.assurance.compose(&self.knowledge, self.need(), way)
    }

    /// Evaluates with all evidence as demanded, except for the evidence that `but` gives.
    fn evaluated(
        &self,
        composition: &Composition,
        but: &dyn Fn(EvidenceSource) -> Option<Interval>,
    ) -> Evaluation {
        let mut evaluation = composition.evaluation();
        for (id, _, watched) in composition.evidence(&self.knowledge) {
            match (but(watched.source), watched.within) {
                (Some(measured), Some(_)) => {
                    evaluation.observe(composition.system(), id, measured, Default::default());
                }
                _ => evaluation.set(composition.system(), id, Truth::True),
            }
        }
        evaluation
    }

    fn assess(&self, way: &str, but: &dyn Fn(EvidenceSource) -> Option<Interval>) -> Assessment {
        let composition = self.composed(way);
        composition.assess(&self.evaluated(&composition, but))
    }

    /// The verdict and the level, in words.
    #[track_caller]
    fn check(&self, way: &str, but: &dyn Fn(EvidenceSource) -> Option<Interval>, expected: &str) {
        let Assessment { verdict, level, .. } = self.assess(way, but);
        let scales = self.knowledge.contracts().scales();
        let level = level.map_or("no level".to_owned(), |level| scales.written(level));
        assert_eq!(format!("{verdict:?}, {level}"), expected, "{way}");
    }
}

/// Compares errors and warnings of a whole model, one per line.
#[track_caller]
fn check(text: &str, expected: &str) {
    let found = brief(&load(text, "m.yaml"));
    let found: Vec<&str> = found.lines().filter(|line| !line.contains(" note: ")).collect();
    assert_eq!(found.join("\n"), expected);
}

fn nothing(_: EvidenceSource) -> Option<Interval> {
    None
}

#[test]
fn lidar_or_both_others_reach_the_level_and_neither_alone() {
    let scene = Scene::new(ROBOT);
    scene.check("/lidar", &nothing, "Holds, SIL 2");
    scene.check("/sonar, /camera by both", &nothing, "Holds, SIL 2");
    scene.check("/sonar by sonar_alone", &nothing, "Refused, SIL 1");
    scene.check("/camera by camera_alone", &nothing, "Refused, SIL 1");
}

#[test]
fn the_platform_and_age_count() {
    let scene = Scene::new(ROBOT);
    let id = scene.knowledge.signal("/computer/idle").unwrap();
    let busy =
        move |source| (source == EvidenceSource::Signal(id, Measure::Value)).then_some(Interval::point(0.1));
    scene.check("/lidar", &busy, "Refused, SIL 2");
    let unclear = move |source| {
        (source == EvidenceSource::Signal(id, Measure::Value)).then_some(Interval::new(0.1, 0.3))
    };
    scene.check("/lidar", &unclear, "Open, SIL 2");
    let lidar = scene.knowledge.signal("/lidar").unwrap();
    let old =
        move |source| (source == EvidenceSource::Signal(lidar, Measure::Age)).then_some(Interval::point(0.4));
    scene.check("/lidar", &old, "Refused, no level");
    let composition = scene.composed("/lidar");
    let why = composition.why(&scene.evaluated(&composition, &old), 100);
    let names: Vec<Vec<_>> = why
        .iter()
        .map(|set| set.iter().map(|leaf| format!("{} of {}", leaf.name, leaf.subject)).collect())
        .collect();
    assert_eq!(names, [["fresh of /lidar"]]);
}

#[test]
fn unknown_satisfies_nothing_and_is_told_apart() {
    let scene = Scene::new(ROBOT);
    let composition = scene.composed("/lidar");
    assert_eq!(composition.assess(&composition.evaluation()).verdict, Verdict::Open);
}

#[test]
fn what_cannot_be_admissible_is_barred() {
    let scene = Scene::new(ROBOT);
    let named = |(signals, relations): &(SignalSet, RelationSet)| {
        let signals = signals.iter().map(|id| scene.knowledge.signals()[id].name.clone());
        let relations = relations.iter().map(|id| scene.knowledge.relations()[id].name.clone());
        signals.chain(relations).collect::<Vec<_>>().join(" ")
    };
    let mut bounds = scene.assurance.bounds(&scene.knowledge, scene.need());
    let mut barred = |truth: Truth| {
        bounds.read(&scene.knowledge, &|_, _, _| Reading::lasting(truth));
        named(bounds.barred())
    };
    assert_eq!(barred(Truth::True), "sonar_alone camera_alone");
    assert_eq!(barred(Truth::False), "/lidar /sonar /camera both sonar_alone camera_alone");
}

#[test]
fn sources_that_share_something_are_no_decomposition() {
    let shared = ROBOT.replace("value_error: 0.2 }", "value_error: 0.2, shares: [mast] }");
    check(
        &shared,
        "34:70 error: this decomposition does not stand: both rest on mast (take sources that share nothing)",
    );
    let platform = ROBOT.replace("/sonar: { evidence", "/sonar: { runs_on: computer, evidence");
    let platform = platform.replace("/camera: { evidence", "/camera: { runs_on: computer, evidence");
    check(
        &platform,
        "34:70 error: this decomposition does not stand: both rest on computer (take sources that share nothing)",
    );
    let mean = ROBOT.replace("min(sonar, camera)", "mean(sonar, camera)");
    check(
        &mean,
        "34:70 error: this decomposition does not stand: one of the two is not enough on its own (ask of each what is given, and compute `min` or `max` of the two: a mean is no decomposition)",
    );
    let apart = ROBOT.replace(", when: abs(sonar - camera) < 0.5 m", "");
    check(
        &apart,
        "34:70 error: this decomposition does not stand: the two are not compared (give the relation a `when` such as `abs(one - other) < 0.3 m`)",
    );
    let higher = ROBOT.replace("level: SIL 2, redundant", "level: SIL 3, redundant");
    check(
        &higher,
        "34:70 error: this decomposition does not stand: SIL 1 and SIL 1 together reach SIL 2 (ask more of the two, or give SIL 2 at most)",
    );
}

#[test]
fn no_relation_gives_more_than_this_program() {
    let with = |level: &str| format!("{ROBOT}  shsa: {{ gives: {{ computing: {{ level: {level} }} }} }}\n");
    let check =
        |level: &str, way: &str, expected: &str| Scene::new(&with(level)).check(way, &nothing, expected);
    check("SIL 2", "/sonar, /camera by both", "Holds, SIL 2");
    check("SIL 1", "/sonar, /camera by both", "Refused, no level");
    check("SIL 1", "/lidar", "Holds, SIL 2");
}

#[test]
fn integrity_is_the_shorthand_of_a_contract() {
    let text = "shsa: 1
variables: { v: { unit: m/s }, w: { unit: m/s } }
signals:
  /v: { variable: v, properties: { integrity: C } }
  /w: { variable: w, properties: { integrity: B } }
  /x: { variable: v }
relations:
  same: { equation: v = w, for: v, properties: { integrity: B } }
needs: { v: { max_age: 1 s, integrity: B } }
";
    let scene = Scene::new(text);
    scene.check("/v", &nothing, "Holds, ASIL C");
    scene.check("/w by same", &nothing, "Holds, ASIL B");
    scene.check("/x", &nothing, "Refused, no level");
    let higher = Scene::new(&text.replace("1 s, integrity: B", "1 s, integrity: C"));
    // The demanded level is not guaranteed; the guaranteed level is reported.
    higher.check("/w by same", &nothing, "Refused, ASIL B");
}

#[test]
fn contracts_are_written_as_they_are_read() {
    let source = read(ROBOT, "m.yaml").unwrap();
    for text in [write::yaml(&source.draft), write::json(&source.draft)] {
        let again = load(&text, "again");
        assert!(again.report.ok(), "{}", again.report.render(false));
        assert_eq!(again.knowledge.contracts(), load(ROBOT, "m.yaml").knowledge.contracts());
    }
}

#[test]
fn what_is_wrong_is_reported_with_its_place() {
    let head = "shsa: 1\nvariables: { x: { unit: m } }\nsignals: { wheel: { variable: x, rate: 1 Hz } }\nneeds: { x: { max_age: 1 s } }\n";
    let check = |contracts: &str, expected: &str| check(&format!("{head}contracts:\n{contracts}"), expected);
    check(
        "  weel: { gives: {} }\n",
        "6:3 error: there is no signal, relation or need `weel` (did you mean `wheel`?)",
    );
    check(
        "  wheel: { gives: { a: { error: below 3 m } } }\n",
        "6:33 error: `below 3 m` is no bound of `error` (write `at most 0.5 m`, `at least 64 MiB`, `between 5 V and 6 V`, `one of slow or stop`, `covers day and night` or `yes`)",
    );
    check(
        "  wheel: { gives: { a: { levle: SIL 2 } } }\n",
        "6:33 error: `SIL 2` is no bound of `levle` (did you mean the key `level`? Else write `at most 0.5 m`, `at least 64 MiB`, `between 5 V and 6 V`, `one of slow or stop`, `covers day and night` or `yes`)",
    );
    check(
        "  wheel: { gives: { a: { level: SIL 5 } } }\n",
        "6:33 error: `SIL 5` is no level (the levels of SIL are 1, 2, 3, 4, the lowest first)",
    );
    check(
        "  wheel: { gives: { a: { error: at most 3 s } } }\n",
        "6:33 error: `3 s` does not count in `m` (write a number, which counts in `m`, or a unit like it)",
    );
}

/// Two computers that power each other: told once, where the circle begins, and not where it can be left.
#[test]
fn demands_in_a_circle_are_told() {
    let model = |two: &str| {
        format!(
            "shsa: 1\nvariables: {{ x: {{ unit: m }} }}\nsignals: {{ /x: {{ variable: x, rate: 1 Hz }} }}\nneeds: {{ x: {{ signal: /out }} }}\n\
             platform:\n  one: {{ asks: {{ p: {{ of: two, power: yes }} }}, gives: {{ power: {{ power: yes }} }} }}\n  two: {two}\n\
             contracts:\n  /x: {{ runs_on: one, asks: {{ q: {{ power: yes }} }}, gives: {{ right: {{ level: SIL 1 }} }} }}\n\
             \x20 x: {{ asks: {{ right: {{ level: SIL 1 }} }} }}\n"
        )
    };
    check(
        &model("{ asks: { p: { of: one, power: yes } }, gives: { power: { power: yes } } }"),
        "6:18 warning: nothing can ever meet `p`: whoever gives it asks for it, in a circle (nothing rests on itself: let one of the circle ask for less)",
    );
    let left = "{ asks: { p: { of: one, power: yes } }, evidence: { on: value of /x at least 1 m }, gives: { power: { power: yes, when: p or on } } }";
    check(&model(left), "");
    check(&model("{ gives: { power: { power: yes } } }"), "");
}
