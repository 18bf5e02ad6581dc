//! The figures of a run for Prometheus: in OpenMetrics, and in the older text format.

use super::control::Guard;
use super::control::bus::Tally;
use super::event_log::EventLog;
use super::figures::Figures;
use super::healer::Healer;
use crate::error::{RuntimeError, unfit};
use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::registry::Registry;
use shsa_bridge::{Bridge, Link};
use shsa_core::engine::EventKind;
use shsa_core::time::Time;
use shsa_format::event;
use std::collections::BTreeSet;
use std::sync::atomic::AtomicU64;

type Labels = Vec<(&'static str, String)>;
type Counters = Family<Labels, Counter>;
type Gauges = Family<Labels, Gauge<f64, AtomicU64>>;

/// The quantiles of a histogram, as in the state: the median, the 99th percentile, and the worst.
const STATISTICS: [(&str, f64); 3] = [("p50", 0.5), ("p99", 0.99), ("worst", 1.0)];

/// All figures in OpenMetrics.
///
/// # Errors
/// Never: it writes to memory.
pub(super) fn text(
    figures: &Figures,
    tally: &Tally,
    guard: &Guard,
    log: &EventLog,
    healers: &[Healer],
    bridge: &dyn Bridge,
    now: Time,
) -> Result<String, RuntimeError> {
    let mut registry = Registry::with_prefix("shsa");
    of_run(&mut registry, figures, bridge);
    of_requests(&mut registry, tally, guard);
    of_reporting(&mut registry, log);
    of_disk(&mut registry, healers);
    of_signals(&mut registry, healers);
    of_needs(&mut registry, healers, now);
    of_services(&mut registry, healers);
    of_takeovers(&mut registry, healers, now);
    let mut text = String::new();
    encode(&mut text, &registry).map_err(unfit)?;
    Ok(text)
}

/// Converts OpenMetrics to the older text format: there, type and help of a counter bear the name of its samples, and there is no
/// end mark.
pub(super) fn text_format(open_metrics: &str) -> String {
    let named = |line: &str| line.split(' ').nth(2).unwrap_or_default().to_owned();
    let is_counter = |line: &&str| line.starts_with("# TYPE ") && line.ends_with(" counter");
    let counters: BTreeSet<String> = open_metrics.lines().filter(is_counter).map(named).collect();
    let mut text = String::with_capacity(open_metrics.len());
    for line in open_metrics.lines().filter(|line| *line != "# EOF") {
        let mut words = line.splitn(4, ' ');
        match (words.next(), words.next(), words.next(), words.next()) {
            (Some("#"), Some(what), Some(name), Some(rest)) if counters.contains(name) => {
                text += &format!("# {what} {name}_total {rest}\n");
            }
            _ => {
                text += line;
                text.push('\n');
            }
        }
    }
    text
}

fn of_run(registry: &mut Registry, figures: &Figures, bridge: &dyn Bridge) {
    let count = |registry: &mut Registry, name: &str, help: &str, value: u64| {
        let counter: Counter = Counter::default();
        counter.inc_by(value);
        registry.register(name, help, counter);
    };
    count(registry, "messages", "Messages heard", figures.messages);
    count(registry, "publications", "Values published", figures.publications);
    count(registry, "dropped", "Messages that had to make room for newer ones", bridge.inbox().dropped());
    count(registry, "disconnections", "How often the connection was lost", figures.disconnections);
    let away: Counter<f64, AtomicU64> = Counter::default();
    away.inc_by(figures.disconnected.seconds());
    registry.register("disconnected_seconds", "How long the connection was lost, altogether", away);
    let events = Counters::default();
    for (kind, number) in EventKind::ALL.iter().zip(figures.events) {
        events.get_or_create(&vec![("kind", kind.name().to_owned())]).inc_by(number);
    }
    registry.register("events", "Decisions", events);
    let times = Gauges::default();
    for (what, histogram) in [("latency", &figures.latency), ("work", &figures.work)] {
        for (name, quantile) in STATISTICS {
            let labels = vec![("time", what.to_owned()), ("statistic", name.to_owned())];
            times.get_or_create(&labels).set(histogram.value_at_quantile(quantile) as f64 / 1e9);
        }
    }
    registry.register(
        "seconds",
        "From reception to publication (latency), and to hear a message (work)",
        times,
    );
    let up: Gauge = Gauge::default();
    up.set(i64::from(bridge.link() == Link::Up));
    registry.register("connected", "Whether the bus is connected", up);
}

fn of_requests(registry: &mut Registry, tally: &Tally, guard: &Guard) {
    let requests = Counters::default();
    for (outcome, number) in tally.counts() {
        requests.get_or_create(&vec![("outcome", outcome.to_owned())]).inc_by(number);
    }
    registry.register("bus_requests", "Requests over the bus", requests);
    let wrong: Counter = Counter::default();
    wrong.inc_by(guard.wrong());
    registry.register("wrong_tokens", "Wrong tokens that were shown", wrong);
}

fn of_reporting(registry: &mut Registry, log: &EventLog) {
    let messages = Counters::default();
    for (name, cause, count) in log.not_taken().counts() {
        let labels = vec![("name", name.to_owned()), ("cause", cause.to_owned())];
        messages.get_or_create(&labels).inc_by(count);
    }
    registry.register("undelivered", "Messages that the bus has not taken", messages);
    let lines: Counter = Counter::default();
    lines.inc_by(log.unwritten());
    registry.register("unwritten_lines", "Lines that standard output has not taken", lines);
}

fn of_disk(registry: &mut Registry, healers: &[Healer]) {
    let unsaved = Counters::default();
    for healer in healers {
        let labels = vec![("model", healer.name().to_owned())];
        unsaved.get_or_create(&labels).inc_by(healer.files().missing().map(|(_, it)| it.inputs).sum());
    }
    registry.register(
        "unsaved",
        "Inputs that the journal or the record lacks, and states that were not written",
        unsaved,
    );
}

fn of_signals(registry: &mut Registry, healers: &[Healer]) {
    let (verdicts, accepted, invalid) = (Gauges::default(), Counters::default(), Counters::default());
    for healer in healers {
        let engine = healer.engine();
        for (id, signal) in engine.knowledge().signals().enumerate() {
            let labels = vec![("model", healer.name().to_owned()), ("signal", signal.name.clone())];
            let counts = engine.monitor().ports()[id].counts();
            accepted.get_or_create(&labels).inc_by(counts.accepted);
            invalid.get_or_create(&labels).inc_by(counts.invalid);
            let verdict = event::verdict(engine.absence(id), engine.verdict(id));
            let labels = [labels, vec![("verdict", verdict.to_owned())]].concat();
            verdicts.get_or_create(&labels).set(1.0);
        }
    }
    registry.register("signal_verdict", "What is thought of a signal", verdicts);
    registry.register("signal_accepted", "Values taken", accepted);
    registry.register("signal_invalid", "Values that were none, or could not be read", invalid);
}

fn of_takeovers(registry: &mut Registry, healers: &[Healer], now: Time) {
    let (stages, events) = (Gauges::default(), Counters::default());
    for healer in healers {
        for (takeover, quality) in healer.takeovers(now) {
            let labels = vec![("model", healer.name().to_owned()), ("name", takeover.topic().to_owned())];
            let counts = takeover.counts();
            for (kind, count) in
                [("silenced", counts.silenced), ("refused", counts.refused), ("returned", counts.returned)]
            {
                let labels = [labels.clone(), vec![("kind", kind.to_owned())]].concat();
                events.get_or_create(&labels).inc_by(count);
            }
            let now = [("stage", takeover.stage().to_owned()), ("quality", quality.name().to_owned())];
            stages.get_or_create(&[labels, now.to_vec()].concat()).set(1.0);
        }
    }
    registry.register("takeover", "How it stands with names that are taken over", stages);
    registry.register("takeover_events", "Sources silenced, refused, returned", events);
}

fn of_needs(registry: &mut Registry, healers: &[Healer], now: Time) {
    let (quality, published) = (Gauges::default(), Counters::default());
    for healer in healers {
        for (id, outlet) in healer.outlets() {
            let labels = vec![("model", healer.name().to_owned()), ("need", outlet.key().to_owned())];
            published.get_or_create(&labels).inc_by(healer.engine().need_status(id).published);
            let labels = [labels, vec![("quality", outlet.quality(now).name().to_owned())]].concat();
            quality.get_or_create(&labels).set(1.0);
        }
    }
    registry.register("need_quality", "How a need is served", quality);
    registry.register("need_published", "Values published for a need", published);
}

fn of_services(registry: &mut Registry, healers: &[Healer]) {
    let (seconds, replaced) = (Gauges::default(), Counters::default());
    for healer in healers {
        for (id, outlet) in healer.outlets() {
            let labels = vec![("model", healer.name().to_owned()), ("need", outlet.key().to_owned())];
            let process = healer.workers().and_then(|workers| workers.figures(id));
            let engine = ("engine", healer.execution(id).times());
            let places = [Some(engine), process.map(|(_, times)| ("process", times))];
            for (place, times) in places.into_iter().flatten() {
                for (name, quantile) in STATISTICS {
                    let own = vec![("place", place.to_owned()), ("statistic", name.to_owned())];
                    let time = times.value_at_quantile(quantile) as f64 / 1e9;
                    seconds.get_or_create(&[labels.clone(), own].concat()).set(time);
                }
            }
            if let Some((count, _)) = process {
                replaced.get_or_create(&labels).inc_by(count);
            }
        }
    }
    let help =
        "Execution time of what computes a need's values: the engine's step, or the round trip to a process";
    registry.register("service_seconds", help, seconds);
    registry.register("process_replaced", "Processes that had to be replaced", replaced);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_format_names_counters_as_their_samples() {
        let open = "# HELP shsa_x How many.\n# TYPE shsa_x counter\nshsa_x_total{a=\"b c\"} 3\n\
                    # HELP shsa_y Now.\n# TYPE shsa_y gauge\nshsa_y 1\n# EOF\n";
        let text = "# HELP shsa_x_total How many.\n# TYPE shsa_x_total counter\nshsa_x_total{a=\"b c\"} 3\n\
                    # HELP shsa_y Now.\n# TYPE shsa_y gauge\nshsa_y 1\n";
        assert_eq!(text_format(open), text);
    }
}
