//! `shsa replay --report`: the page about a whole replay.

use crate::tank;

/// The text between the first `before` and the next `after`.
#[track_caller]
fn between<'t>(text: &'t str, before: &str, after: &str) -> &'t str {
    let (_, rest) = text.split_once(before).unwrap_or_else(|| panic!("no {before}"));
    rest.split_once(after).unwrap_or_else(|| panic!("no {after} after {before}")).0
}

#[test]
fn a_page_tells_needs_decisions_signals_model_and_command() {
    let folder = tank::folder();
    let command = "replay tank.yaml run.csv --inject bias=1:/level@10s..20s --report out.html";
    let report = folder.json(command, 0);
    let page = folder.read("out.html");
    assert!(page.contains(&format!("<dd>{}</dd>", report["needs"]["level"]["published"])));
    let events = report["events"].as_array().unwrap();
    assert!(events.len() > 2);
    for (number, event) in events.iter().enumerate() {
        let decision = between(&page, &format!("id=\"decision-{}\">", number + 1), "</li>");
        let time = format!("{:.3} s", event["time_s"].as_f64().unwrap());
        assert!(decision.contains(&time) && decision.contains(event["kind"].as_str().unwrap()), "{decision}");
    }
    let first = between(&page, "id=\"decision-1\">", "</details>");
    assert!(first.contains("Evidence against it") && first.contains("/level said"), "{first}");
    let explained = folder.ends("explain tank.yaml run.csv /level --inject bias=1:/level@10s..20s", 0).stdout;
    let spoken = between(first, "In plain words</h4>\n<ul>\n<li>", "</li>");
    // Page and command show the same, but the terminal's lines are wrapped.
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words(&explained).contains(&words(spoken)), "{explained}\n{spoken}");
    for (signal, found) in report["signals"].as_object().unwrap() {
        let row = between(&page, &format!("scope=\"row\">{signal}</th>"), "</tr>");
        assert!(row.contains(&format!(">{}</td>", found["accepted"])), "{row}");
        assert_eq!(row.contains("class=\"bad\""), signal == "/level", "{row}");
    }
    assert!(page.contains(&format!("shsa {command} --json")));
    assert!(page.contains("the model as it was"));
}

#[test]
fn a_page_needs_no_host_and_no_script() {
    let folder = tank::folder();
    folder.ends("replay tank.yaml run.csv --inject bias=1:/level@10s..20s --report out.html", 0);
    let page = folder.read("out.html").replace("http://www.w3.org/2000/svg", "");
    for forbidden in ["<script", "<link", "src=", "http:", "https:", "@import", "url(//"] {
        assert!(!page.contains(forbidden), "{forbidden}");
    }
}

#[test]
fn the_time_without_a_value_is_reported() {
    let folder = tank::folder();
    let faults = "--inject drop:/level@20s.. --inject drop:/pressure@20s.. --inject drop:/volume@20s..";
    folder.ends(&format!("replay tank.yaml run.csv {faults} --report out.html"), 1);
    let page = folder.read("out.html");
    assert!(page.contains("✗ not met"), "{page}");
    let available: f64 = between(&page, "<dt>available</dt><dd>", " %").parse().unwrap();
    let strip = between(&page, "<svg class=\"strip\"", "</svg>");
    let gone: f64 = strip
        .split("not served: ")
        .skip(1)
        .map(|piece| {
            let (from, to) = piece.split_once(" s to ").unwrap();
            to.split(' ').next().unwrap().parse::<f64>().unwrap() - from.parse::<f64>().unwrap()
        })
        .sum();
    let length = folder.json("replay tank.yaml run.csv", 0)["duration_s"].as_f64().unwrap();
    assert!(
        gone > 1.0 && (available - 100.0 * (1.0 - gone / length)).abs() < 0.1,
        "{available} % and {gone} s"
    );
}

#[test]
fn a_streamed_recording_gives_the_same_page() {
    let folder = tank::folder();
    folder.ends("replay tank.yaml run.csv --report a.html", 0);
    folder.ends("replay tank.yaml run.csv --stream --report b.html", 0);
    let [a, b] = ["a.html", "b.html"].map(|name| folder.read(name));
    let until = |page: &str| page.split("made by").next().unwrap().to_owned();
    assert!(a.len() > 10_000);
    assert_eq!(until(&a), until(&b));
}

#[test]
fn a_longer_recording_makes_no_larger_page() {
    let folder = tank::folder();
    let rows = |seconds: u32| -> String {
        let row = |second: u32| {
            let level = 2.0 + 0.5 * (f64::from(second) / 50.0).sin();
            format!("{second},{level},{}\n", level * 9_810.0)
        };
        let head = "time,/level,/pressure\n".to_owned();
        (0..seconds).map(row).fold(head, |all, row| all + &row)
    };
    folder.write("short.csv", rows(1_500));
    folder.write("long.csv", rows(15_000));
    let size = |name: &str| {
        folder.run(&format!("replay tank.yaml {name}.csv --report {name}.html"));
        folder.read(&format!("{name}.html")).len()
    };
    let (short, long) = (size("short"), size("long"));
    assert!(long < short * 3 / 2, "{short} and {long} bytes");
}
