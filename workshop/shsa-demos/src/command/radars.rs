//! The radars along a road: each fault as a trial of its own, with shsa and without, and a table of the errors.

use super::{OnBus, stop_on_signals};
use crate::Outcome;
use shsa_bridge::{Outgoing, Payload};
use shsa_core::engine::EventKind;
use shsa_core::time::Span;
use shsa_demo::terminal::{Ink, Terminal};
use shsa_demo::{Decision, Happening, Provision};
use shsa_demos::radars::{Errors, Fault, Road, Score, Trial};
use shsa_format::text;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// How long the road is as it is before the next fault, when it is on a bus.
const SPELL: Span = Span::from_millis(150_000);
/// The most moments of a trial that are shown.
const MOST_SHOWN: usize = 2;

/// Shows every fault.
///
/// The answer is no if a radar was named wrongly or not at all.
///
/// # Errors
/// When standard output is closed.
pub(super) fn run(seed: u64) -> anyhow::Result<Outcome> {
    let mut terminal = Terminal::new(false, false);
    terminal.print_line(
        "Four radars along a road with two lanes, 100 m apart. Each sees a vehicle for some time together with the next one, and four\n\
         of ten vehicles tell where they are. Tracks are associated at each border. After 2.5 minutes something happens.\n",
    )?;
    let mut rows = Vec::new();
    let (mut is_good, mut pairs, mut wrong_pairs) = (true, 0, 0);
    for fault in Fault::ALL {
        terminal.print_line(&format!("\n{}\n", fault.describe()))?;
        let healed = watch(&mut terminal, seed, fault, Provision::Healed)?;
        let radars = watch(&mut terminal, seed, fault, Provision::SensorsAlone)?;
        is_good &= healed.is_good(fault);
        (pairs, wrong_pairs) = (pairs + healed.pairs, wrong_pairs + healed.wrong_pairs);
        rows.extend(rows_of(fault, &healed, &radars));
    }
    let head = ["what happens", "positions", "error, rms", "worst", "unknown", "wrongly named"];
    terminal.print_line(&format!("\n{}\n", text::table(&head, rows).trim_end()))?;
    terminal.print_line(&format!(
        "\nunknown: the share of the time with a vehicle at a border in which its position was older than 0.5 s\n\
         {pairs} pairs of tracks associated, {wrong_pairs} of them of two vehicles\n"
    ))?;
    Ok(if is_good { Outcome::Done } else { Outcome::No })
}

/// Publishes what the radars and the vehicles say, until it is interrupted: 2.5 minutes without a fault, then as long with each in turn.
///
/// # Errors
/// When the bus cannot be used, or standard output is closed.
pub(super) fn publish(args: &OnBus) -> anyhow::Result<Outcome> {
    let mut bus = args.open("road")?;
    let inbox = bus.inbox().clone();
    let clock = inbox.clock().clone();
    let stop = stop_on_signals(inbox.clone())?;
    let mut terminal = Terminal::new(false, args.json);
    let mut road = Road::new(args.seed);
    // The road is full when it begins.
    while road.now() < Road::FILLED {
        road.step();
    }
    let (began, mut faults) = (clock.now(), Fault::ALL.into_iter().cycle());
    let mut next = road.now();
    while !stop.load(Ordering::Acquire) {
        if road.now() >= next {
            let Some(fault) = faults.next() else { break };
            road.set_fault(fault);
            terminal.event(road.now(), "now", Ink::Strong, fault.describe())?;
            next = next + SPELL;
        }
        road.step();
        let due = began + (road.now() - Road::FILLED);
        while clock.now() < due && !stop.load(Ordering::Acquire) {
            inbox.wait(Duration::from_nanos(u64::try_from((due - clock.now()).0).unwrap_or(0)));
        }
        let stamp = clock.by_wall(due);
        for (topic, text) in road.messages(stamp.seconds() - road.now().seconds()) {
            bus.publish(Outgoing::new(&topic, stamp, Payload::Bytes(text.into_bytes().into())))?;
        }
    }
    Ok(Outcome::Done)
}

/// One trial, with the first moments at which somebody is named.
fn watch(terminal: &mut Terminal, seed: u64, fault: Fault, provision: Provision) -> anyhow::Result<Score> {
    let mut trial = Trial::new(seed, fault, provision, Trial::END_S)?;
    let mut moments = 0;
    while !trial.is_over() {
        let Some(decision) = clearest(trial.step()) else { continue };
        moments += 1;
        if moments <= MOST_SHOWN {
            terminal.decided(&decision)?;
        }
    }
    if moments > MOST_SHOWN {
        let more = format!("moments at which a signal is named: {moments}");
        terminal.event(trial.now(), "and", Ink::Faint, &more)?;
    }
    Ok(trial.finish())
}

/// Of all signals of a radar that are named at a moment, the one with the most disagreements.
fn clearest(happened: Vec<Happening<Fault>>) -> Option<Decision> {
    let named = happened.into_iter().filter_map(|happening| match happening {
        Happening::Decided(it) if matches!(it.kind, EventKind::Failed | EventKind::Silent) => Some(it),
        _ => None,
    });
    let decision = named.max_by_key(|decision| decision.because.matches(" says ").count())?;
    Some(Decision { because: without_names(&decision.because), ..decision })
}

/// The reason without the names of all signals that share a radar.
fn without_names(because: &str) -> String {
    match because.split_once(", which ").zip(because.split_once(" share,")) {
        Some(((before, _), (_, after))) => format!("{before}{after}"),
        None => because.to_owned(),
    }
}

/// The rows of the table for a fault.
fn rows_of(fault: Fault, healed: &Score, radars: &Score) -> Vec<Vec<String>> {
    let wrongly = healed.wrongly_named.len().to_string();
    let mut rows = Vec::new();
    match healed.named_after.map(Span::seconds) {
        Some(after) => {
            rows.push(row(&format!("until named, {after:.1} s"), &healed.until_named, ""));
            rows.push(row("then", &healed.after, &wrongly));
        }
        None => rows.push(row("with shsa", healed.since(), &wrongly)),
    }
    rows.push(row("without shsa", radars.since(), ""));
    for (index, row) in rows.iter_mut().enumerate() {
        row.insert(0, if index == 0 { fault.describe().to_owned() } else { String::new() });
    }
    rows
}

fn row(name: &str, errors: &Errors, wrongly: &str) -> Vec<String> {
    let unknown = 100.0 * errors.unknown_s / errors.there_s.max(0.1);
    vec![
        name.to_owned(),
        format!("{:.2} m", errors.rms_m()),
        format!("{:.1} m", errors.worst_m),
        format!("{unknown:.0} %"),
        wrongly.to_owned(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_of_what_shares_a_radar_are_left_out() {
        let because = "a says 1; radar_2, which /a, /b share, explains it best";
        assert_eq!(without_names(because), "a says 1; radar_2 explains it best");
    }
}
