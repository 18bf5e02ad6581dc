//! The assurance case over time, on the page of a replay or a story.

use crate::folder::Folder;

const STORIES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../stories");
const STORY: &[u8] = include_bytes!("../../../../stories/28-a-running-substitute-is-demoted.yaml");

/// The text between the first `before` and the next `after`.
#[track_caller]
fn between<'t>(text: &'t str, before: &str, after: &str) -> &'t str {
    let (_, rest) = text.split_once(before).unwrap_or_else(|| panic!("no {before} in {text}"));
    rest.split_once(after).unwrap_or_else(|| panic!("no {after} after {before}")).0
}

fn page() -> String {
    let folder = Folder::with(&[("story.yaml", STORY)]);
    folder.ends("test story.yaml --report out.html", 0);
    folder.read("out.html")
}

/// The stretches of the strip in a row: what, from and to in seconds.
fn stretches(row: &str) -> Vec<(String, f64, f64)> {
    let titles = row.split("<title>").skip(1).map(|rest| rest.split_once("</title>").unwrap().0);
    titles
        .map(|title| {
            let (what, times) = title.rsplit_once(": ").unwrap();
            let (from, to) = times.split_once(" to ").unwrap();
            let seconds = |text: &str| text.strip_suffix(" s").unwrap().parse().unwrap();
            (what.to_owned(), seconds(from), seconds(to))
        })
        .collect()
}

/// The stretches of one verdict, rounded to whole seconds.
fn of(row: &str, verdict: &str) -> Vec<(i64, i64)> {
    let all = stretches(row).into_iter().filter(|(what, ..)| what == verdict);
    all.map(|(_, from, to)| (from.round() as i64, to.round() as i64)).collect()
}

#[test]
fn each_claim_tells_how_it_stood() {
    let page = page();
    let assurance = between(&page, "<h2>Assurance</h2>", "</section>");
    // The camera gets too hot after 15 s, and is cool again from 36 s on.
    let case =
        between(assurance, "<h4>/camera by by_camera</h4>", "</tbody>").split_once("<tbody>").unwrap().1;
    let evidence = between(case, "cool of /camera: value of /heat at most 60", "</tr>");
    assert_eq!(of(evidence, "refused"), [(15, 36)], "{evidence}");
    assert_eq!(of(evidence, "given").len(), 2, "{evidence}");
    let claim = between(case, "near is given what it asks, by /camera by by_camera", "</tr>");
    assert_eq!(of(claim, "refused"), [(15, 36)], "{claim}");
    // Every node is accounted for all the time.
    for row in case.split("<tr>").skip(1) {
        let all = stretches(row);
        let sum_s: f64 = all.iter().map(|(_, from, to)| to - from).sum();
        assert!((sum_s - 60.0).abs() < 0.5, "{sum_s} s of 60 s: {row}");
    }
    assert!(assurance.contains("<svg") && !page.contains("<script"));
}

#[test]
fn the_ground_and_level_of_what_goes_out_are_reported() {
    let page = page();
    let assurance = between(&page, "<h2>Assurance</h2>", "</section>");
    let strip = between(assurance, "<svg class=\"strip\"", "</svg>");
    assert_eq!(of(strip, "degraded, SIL 1"), [(15, 36)], "{strip}");
    assert_eq!(of(strip, "met, SIL 2").first().map(|it| it.0), Some(0), "{strip}");
    let ways = between(assurance, "<th class=\"name\">way</th>", "</tbody>");
    let has_served = |way: &str| between(ways, &format!(">{way}</th><td>"), "</td>").to_owned();
    assert_eq!(["/lidar", "/camera by by_camera", "/sonar by by_sonar"].map(has_served), ["yes"; 3]);
}

/// The page of a story under contract has its assurance case.
#[test]
fn stories_are_reported_with_their_cases() {
    let folder = Folder::new();
    for (name, words) in [
        ("28-a-car-loses-its-speed", "full"),
        ("28-sonar-and-camera-together", "/sonar/nearest, /camera/nearest by together"),
        ("28-a-platoon-over-a-bad-link", "asil_b of /leader/speed"),
    ] {
        let output = folder.ends(&format!("test {STORIES}/{name}.yaml --report {name}.html"), 0).stdout;
        assert!(!output.contains("NO ") && output.contains("refused"), "{output}");
        let page = folder.read(&format!("{name}.html"));
        assert!(between(&page, "<h2>Assurance</h2>", "</section>").contains(words), "{name}: no {words}");
    }
}

/// The level's sensor falls silent after 40 s, and its evidence does not hold any more.
#[test]
fn a_case_over_a_recording_is_reported_as_json_gsn_and_text() {
    let folder = crate::tank::folder();
    let contracts = "contracts: { level: { asks: { right: { level: SIL 1 } } }, /level: { evidence: { fresh: age at most 2 s }, \
        gives: { right: { level: SIL 2, when: fresh } } } }\n";
    folder.write("certified.yaml", crate::tank::MODEL.to_owned() + contracts);
    let over = "assure certified.yaml --over run.csv --inject drop:/level@20s..";
    let case = folder.json(over, 1);
    let need = &case["needs"][0];
    assert_eq!((&case["given"], &need["admissions"][0]["level"]), (&false.into(), &"SIL 2".into()), "{case}");
    let way = need["ways"].as_array().unwrap().iter().find(|way| way["way"] == "/level").unwrap();
    assert_eq!(way["served"], true, "{case}");
    let nodes = way["case"].as_array().unwrap();
    // Evidence that does not hold at the end is a claim without support.
    let evidence = nodes.iter().find(|node| node["supported_by"].as_array().unwrap().is_empty()).unwrap();
    assert!(evidence["text"].as_str().unwrap().starts_with("fresh of /level"), "{evidence}");
    for node in [&nodes[0], evidence] {
        let stretches = node["over_time"].as_array().unwrap();
        let number = |value: &serde_json::Value| value.as_f64().unwrap();
        let ends: Vec<f64> = stretches.iter().map(|it| number(&it["to_s"])).collect();
        let begins: Vec<f64> = stretches.iter().skip(1).map(|it| number(&it["from_s"])).collect();
        assert_eq!(begins, ends[..ends.len() - 1], "a gap: {node}");
        let lost = stretches.iter().find(|it| it["verdict"] == "refused").unwrap();
        assert!((21.0..23.0).contains(&number(&lost["from_s"])), "{node}");
        assert_eq!(lost["to_s"], case["duration_s"], "{node}");
    }
    let module = folder.ends(&format!("{over} --format gsn"), 1).stdout;
    let case = crate::gsn::check(&module);
    assert!(
        case.values().all(|node| node.contains_key("challenges") || node.contains_key("over_time")),
        "{module}"
    );
    folder.ends(&format!("{over} --format gsn -o case"), 1);
    crate::gsn::passes(&folder, "case");
    let text = folder.ends(over, 1).stdout;
    assert!(text.contains("met, SIL 2") && text.contains("refused 2"), "{text}");
    folder.refuses(&format!("{over} --format svg"), &["text, json and gsn"]);
    folder.refuses("assure certified.yaml --inject drop:/level@20s..", &["--over"]);
}

/// Without contracts there is no case.
#[test]
fn a_need_without_a_contract_has_no_case() {
    let folder = crate::tank::folder();
    folder.ends("replay tank.yaml run.csv --report out.html", 0);
    assert!(!folder.read("out.html").contains("<h2>Assurance</h2>"));
}
