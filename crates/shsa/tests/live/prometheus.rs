//! Figures as read by a real Prometheus, and the alerts and the dashboard made of them.

use crate::real::free_port;
use crate::running::{Folder, Running, TOKEN};
use serde_json::Value;
use std::collections::BTreeSet;
use std::io::Write;
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const DEPLOY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../deploy");

/// A Prometheus that is killed when this is dropped.
struct Prometheus(Child);

impl Drop for Prometheus {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Whether Prometheus and its tool are installed; prints SKIPPED if they are not.
fn is_there() -> bool {
    let is_there = Command::new("promtool").arg("--version").output().is_ok();
    if !is_there {
        eprintln!("SKIPPED: Prometheus is not installed; `cargo xtask test` installs it");
    }
    is_there
}

/// Checks that `promtool` has no complaint about an input.
#[track_caller]
fn nothing_is_wrong(arguments: &[&str], input: &str) {
    let tool = Command::new("promtool").args(arguments).stdin(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let mut tool = tool.unwrap();
    tool.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    let ended = tool.wait_with_output().unwrap();
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
}

/// The names of figures in a text.
fn names(text: &str) -> BTreeSet<&str> {
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.split(|c| !is_name(c)).filter(|word| word.starts_with("shsa_")).collect()
}

#[test]
fn the_tool_of_prometheus_finds_nothing_wrong() {
    if !is_there() {
        return;
    }
    let run = Running::start([]);
    run.until("the need is served", |state| {
        state["models"]["rover"]["needs"]["v_dmin"]["published"].as_u64() > Some(3)
    });
    let (_, metrics) = run.get("/metrics");
    nothing_is_wrong(&["check", "metrics"], metrics.as_str().unwrap());
    nothing_is_wrong(&["check", "rules", &format!("{DEPLOY}/prometheus-alerts.yaml")], "");
}

#[test]
fn alerts_and_dashboard_are_made_of_figures_that_are_there() {
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/../shsa-runtime/src/metrics.rs");
    let source = std::fs::read_to_string(source).unwrap();
    for file in ["prometheus-alerts.yaml", "grafana-dashboard.json"] {
        let text = std::fs::read_to_string(format!("{DEPLOY}/{file}")).unwrap();
        let names = names(&text);
        assert!(names.len() > 5, "{file}: {names:?}");
        for name in names {
            let plain = name.trim_start_matches("shsa_").trim_end_matches("_total");
            assert!(source.contains(&format!("\"{plain}\"")), "{file}: there is no figure {name}");
        }
    }
    let dashboard = std::fs::read_to_string(format!("{DEPLOY}/grafana-dashboard.json")).unwrap();
    assert!(serde_json::from_str::<Value>(&dashboard).unwrap()["panels"].as_array().unwrap().len() > 5);
}

#[test]
fn a_real_prometheus_reads_them() {
    if !is_there() {
        return;
    }
    let run = Running::start([]);
    let folder = Folder::new();
    let config = folder.path("prometheus.yaml");
    let target = run.address();
    let text = format!(
        "global: {{ scrape_interval: 200ms, scrape_timeout: 200ms, evaluation_interval: 200ms }}\n\
         rule_files: [ {DEPLOY}/prometheus-alerts.yaml ]\n\
         scrape_configs: [ {{ job_name: shsa, static_configs: [ {{ targets: [ \"{target}\" ] }} ] }} ]\n"
    );
    std::fs::write(&config, text).unwrap();
    let address = format!("127.0.0.1:{}", free_port());
    let _prometheus = Prometheus(
        Command::new("prometheus")
            .arg(format!("--config.file={}", config.display()))
            .arg(format!("--storage.tsdb.path={}", folder.path("data").display()))
            .arg(format!("--web.listen-address={address}"))
            .stderr(Stdio::null())
            .spawn()
            .unwrap(),
    );
    let ask = |path: &str| -> Option<Value> {
        let mut stream = TcpStream::connect(&address).ok()?;
        let request = format!("GET {path} HTTP/1.0\r\nHost: {address}\r\n\r\n");
        let (_, text) = Running::answer(&mut stream, &request);
        serde_json::from_str(&text).ok()
    };
    let until = |what: &str, path: &str, is_so: &dyn Fn(&Value) -> bool| {
        let end = Instant::now() + Duration::from_secs(60);
        while !ask(path).is_some_and(|answer| is_so(&answer["data"])) {
            assert!(Instant::now() < end, "not so: {what}: {:?}", ask(path));
            std::thread::sleep(Duration::from_millis(50));
        }
    };
    until("it has read the values", "/api/v1/query?query=shsa_need_published_total", &|data| {
        let value = data["result"][0]["value"][1].as_str().and_then(|value| value.parse::<f64>().ok());
        data["result"][0]["metric"]["need"] == "v_dmin" && value > Some(3.0)
    });
    let order = r#"{"order": "forbid", "signal": "/lidar/scan"}"#;
    assert_eq!(run.order(Some(TOKEN), order).0, 200);
    until("the alert is there", "/api/v1/alerts", &|data| {
        let is_reported = |alert: &Value| alert["labels"]["alertname"] == "ShsaNeedSubstituted";
        data["alerts"].as_array().is_some_and(|alerts| alerts.iter().any(is_reported))
    });
}
