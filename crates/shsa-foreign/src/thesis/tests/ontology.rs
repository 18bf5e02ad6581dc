//! Ontologies in Turtle, as others write them and as we do.

use super::{check_taken, taken};
use crate::thesis::ontology::write;
use crate::{Form, load, load_file, read};
use proptest::prelude::*;
use shsa_core::knowledge::KnowledgeBase;
use std::path::Path;

const BOILER: &str = r#"@prefix sosa: <http://www.w3.org/ns/sosa/> .
@prefix ssn: <http://www.w3.org/ns/ssn/> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix schema: <http://schema.org/> .
@base <http://example.org/boiler/> .

<water/temperature> a sosa:ObservableProperty ; rdfs:label "flow temperature"@en ; schema:unitText "degC" .
<water/pressure> a ssn:Property ; schema:unitText "kPa" ; sosa:isObservedBy <gauge> .
<gravity> a sosa:ObservableProperty ; schema:unitText "m/s^2" ; schema:value 9.81 .
<thermometer> a sosa:Sensor ; sosa:observes <water/temperature> ; sosa:isHostedBy <board> .
<water/temperature> sosa:isObservedBy <thermometer> .
<gauge> sosa:isHostedBy <board> .
<board> a sosa:Platform ; rdfs:label "board 1" ; rdfs:comment "in the cellar" .
<steam-table> a sosa:Procedure ; ssn:hasInput <water/temperature> ; ssn:hasOutput <water/pressure> .
"#;

#[test]
fn what_others_write_is_a_model() {
    check_taken(
        BOILER,
        r#"
shsa: 1

variables:
  pressure: { unit: kPa }
  flow_temperature: { unit: degC }

constants:
  gravity: 9.81 m/s^2

relations:
  steam-table: { output: pressure, inputs: [flow_temperature] }

signals:
  gauge: { variable: pressure, shares: [board 1] }
  thermometer: { variable: flow_temperature, shares: [board 1] }
"#,
        "1:1 warning: not taken over: 1 statement with http://www.w3.org/2000/01/rdf-schema#comment\n\
         7:8 warning: `flow temperature` becomes `flow_temperature`\n\
         9:2 warning: nothing uses `gravity`",
    );
}

#[test]
fn errors_have_a_place() {
    let (_, problems) = taken(
        "@prefix sosa: <http://www.w3.org/ns/sosa/> .\n<http://a> a sosa:Sensor ;; .\n<http://b> sosa:observes .\n",
    );
    assert!(problems.contains("3:26 error:"), "{problems}");
    let (_, problems) = taken("@prefix a: <http://a/> .\na:b a:c a:d .\n");
    assert!(problems.contains("no sensor, property or procedure"), "{problems}");
}

/// Names of elements, and how they hang together.
fn structure(knowledge: &KnowledgeBase) -> Vec<String> {
    let name = |id| knowledge.variables()[id].name.clone();
    let names = |ids: &mut dyn Iterator<Item = shsa_core::knowledge::VariableId>| {
        let mut names: Vec<String> = ids.map(name).collect();
        names.sort();
        names.join(" ")
    };
    let variables = knowledge.variables().iter().map(|it| {
        let unit = it.unit.as_ref().map(ToString::to_string).filter(|unit| unit != "1");
        // Bounds of constants are lost.
        format!("{} {unit:?} {:?}", it.name, it.constant.map(|value| value.midpoint() as f32))
    });
    let relations = knowledge.relations().iter().flat_map(|relation| {
        relation.outputs.iter().map(|&output| {
            format!("{} {} {}", relation.name, name(output), names(&mut relation.needs(output)))
        })
    });
    let measured = knowledge.signals().enumerate().filter(|(id, _)| !knowledge.is_computed(*id));
    let signals = measured.map(|(_, it)| format!("{} {}", it.name, name(it.variable)));
    let causes = knowledge.causes().iter().filter(|it| it.signals.len() > 1).map(|it| {
        let mut names: Vec<&str> =
            it.signals.iter().map(|&it| knowledge.signals()[it].name.as_str()).collect();
        names.sort_unstable();
        format!("{} {names:?}", it.name)
    });
    let mut all: Vec<String> = variables.chain(relations).chain(signals).chain(causes).collect();
    all.sort();
    all
}

#[test]
fn the_structure_of_each_model_survives() {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
    let mut count = 0;
    for file in std::fs::read_dir(models).unwrap() {
        let file = file.unwrap().path();
        if file.extension().is_none_or(|it| it != "yaml") {
            continue;
        }
        let knowledge = load_file(&file).knowledge;
        let written = write(&knowledge).unwrap().text;
        assert_eq!(read(&written, "m", None).unwrap().form, Form::Turtle);
        let again = load(&written, "m");
        assert!(again.report.ok(), "{}:\n{}", file.display(), again.report.render(false));
        assert_eq!(structure(&again.knowledge), structure(&knowledge), "{}", file.display());
        count += 1;
    }
    assert!(count > 5);
}

proptest! {
    #[test]
    fn any_text_is_read(parts in prop::collection::vec(prop_oneof![
        Just("@prefix sosa: <http://www.w3.org/ns/sosa/> ."), Just("<a>"), Just("a sosa:Sensor"), Just(";"), Just("."), Just("["), Just("]"),
        Just("sosa:observes"), Just("\"x"), Just("( 1 2.5e3 )"), Just("_:b"), Just("\u{feff}"), Just("@base <http://ä/> ."),
    ], 0..30)) {
        let _ = read(&parts.join(" "), "m", Some(Form::Turtle)).map(|source| source.build("", "m"));
    }
}
