//! The memory for loading a large model, a ratchet that may only go down.

use shsa_model::load;
use std::fmt::Write;

/// Relations that are structure only, half as many variables, a sixth as many signals: what large models are made of.
fn model(relations: usize) -> String {
    let variables = relations / 2 + 40;
    let mut text = String::from("{\"shsa\": 1, \"variables\": {\"v0\": {}");
    for at in 1..variables {
        write!(text, ", \"v{at}\": {{}}").unwrap();
    }
    text += "}, \"relations\": {";
    for at in 0..relations {
        let (comma, output) = (if at == 0 { "" } else { ", " }, at / 2);
        let (first, second) = (output + 1 + at % 7, output + 9 + at % 29);
        write!(text, "{comma}\"r{at}\": {{\"output\": \"v{output}\", \"inputs\": [\"v{first}\", \"v{second}\"], \"properties\": {{\"cost\": 2}}}}").unwrap();
    }
    text += "}, \"signals\": {";
    for at in 0..relations / 6 {
        let (comma, variable) = (if at == 0 { "" } else { ", " }, variables - 1 - 3 * at);
        write!(
            text,
            "{comma}\"/s/{at}\": {{\"variable\": \"v{variable}\", \"properties\": {{\"accuracy\": 0.9}}}}"
        )
        .unwrap();
    }
    text + "}}"
}

#[test]
fn a_relation_takes_little_memory() {
    const RELATIONS: usize = 8_192;
    let text = model(RELATIONS);
    let mut loaded = None;
    let counted = allocation_counter::measure(|| loaded = Some(load(&text, "m.json")));
    let loaded = loaded.unwrap();
    assert!(loaded.report.ok(), "{}", loaded.report.render(false));
    assert_eq!(loaded.knowledge.relations().len(), RELATIONS);
    let a_relation = |bytes: u64| bytes / RELATIONS as u64;
    let (kept, peak) = (a_relation(counted.bytes_current.unsigned_abs()), a_relation(counted.bytes_max));
    let allocations = a_relation(counted.count_total);
    assert!(kept <= 640, "{kept} bytes a relation are kept");
    assert!(peak <= 720, "{peak} bytes a relation are taken at the peak");
    assert!(allocations <= 18, "{allocations} allocations a relation");
}
