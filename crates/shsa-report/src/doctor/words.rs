//! Findings in words.

use super::Report;
use shsa_lab::doctor::{Finding, Kind, Known, Witness};
use shsa_lab::naming::number;

/// The time between two sessions in the columns, in seconds: a session begins half of it after its joint.
const BETWEEN_S: f64 = 10.0;

impl Report<'_> {
    /// Who is wrong, and how.
    pub(super) fn headline(&self, finding: &Finding) -> String {
        let names = self.names(&finding.signals);
        match (finding.is_named(), &names[..]) {
            (true, [.., last]) if names.len() > 1 && matches!(finding.kind, Kind::Silent) => {
                format!("{} and {last} are silent", names[..names.len() - 1].join(", "))
            }
            (true, [one, ..]) => format!("{one} {}", self.how(finding)),
            // In no simple way, the amount is that of the whole relation.
            (false, [all @ .., last]) if matches!(finding.kind, Kind::Off(_)) => {
                format!(
                    "one of {} and {last} is wrong: together they are {}",
                    all.join(", "),
                    self.how(finding)
                )
            }
            (false, [one, .., last]) => {
                let but_last = names[..names.len() - 1].join(", ");
                format!("one of {but_last} and {last} is wrong: if {one}, it {}", self.how(finding))
            }
            _ => String::new(),
        }
    }

    fn how(&self, finding: &Finding) -> String {
        let unit = self.unit(finding.in_unit_of);
        let of = if finding.signals.first() == Some(&finding.in_unit_of) {
            String::new()
        } else {
            format!(" of {}", self.name(finding.in_unit_of))
        };
        match &finding.kind {
            Kind::Offset(by) if *by >= 0.0 => format!("reads {}{unit} too much", number(*by)),
            Kind::Offset(by) => format!("reads {}{unit} too little", number(-by)),
            Kind::Scale(factor) => format!("reads {} times what it should", number(*factor)),
            Kind::Drift(rate) => format!("drifts by {}{unit} a second", number(*rate)),
            Kind::Frozen(value) => format!("stands still at {}{unit}", number(*value)),
            Kind::Noisy(deviation) => format!("scatters by {}{unit}", number(*deviation)),
            Kind::Spikes { share, size } => {
                format!("has spikes of {}{unit}, {} % of its values", number(*size), number(100.0 * share))
            }
            Kind::Delayed(by) => format!("is {} s late", number(*by)),
            Kind::Swapped(with) => format!("and {} are swapped", self.name(*with)),
            Kind::Unit(_, _, words) => format!("is in another unit: {words}"),
            Kind::Silent => "is silent".to_owned(),
            Kind::Impossible(1, value) => {
                format!("has a value far outside of all others: {}{unit}", number(*value))
            }
            Kind::Impossible(count, value) => {
                format!("has {count} values far outside of all others, such as {}{unit}", number(*value))
            }
            Kind::Off(by) if finding.is_named() => format!("is off by {}{unit}{of}", number(*by)),
            Kind::Off(by) => format!("off by {}{unit}{of}", number(*by)),
        }
    }

    /// When, as people read it.
    pub(super) fn when(&self, finding: &Finding) -> String {
        let (from, to) = finding.stretches.first().copied().unwrap_or_default();
        let more = match finding.stretches.len() {
            0 | 1 => String::new(),
            2 => ", and once more".to_owned(),
            count => format!(", and {} times more", count - 1),
        };
        format!("{} to {}{}{more}", self.time(from), self.time(to), self.session(from))
    }

    /// A moment in its session.
    pub(super) fn time(&self, at: f64) -> String {
        clock(self.in_session(at).1)
    }

    pub(super) fn in_session(&self, at: f64) -> (usize, f64) {
        let session = self.columns.joints.partition_point(|joint| *joint <= at);
        let begin = session.checked_sub(1).map_or(0.0, |it| self.columns.joints[it] + 0.5 * BETWEEN_S);
        (session, at - begin)
    }

    fn session(&self, at: f64) -> String {
        if self.columns.joints.is_empty() {
            return String::new();
        }
        format!(" of session {}", self.in_session(at).0 + 1)
    }

    /// What speaks against it.
    pub(super) fn evidence(&self, finding: &Finding) -> Vec<String> {
        let mut lines: Vec<String> = finding.witnesses.iter().take(3).map(|it| self.witness(it)).collect();
        if finding.witnesses.len() > 3 {
            lines.push(format!("and {} more relations", finding.witnesses.len() - 3));
        }
        if !finding.cleared.is_empty() {
            let names: Vec<&str> = self.names(&finding.cleared).into_iter().take(4).collect();
            lines.push(format!("meanwhile these agree among each other: {}", names.join(", ")));
        }
        if !finding.is_named() {
            lines.push("no third one says which".to_owned());
        }
        lines
    }

    fn witness(&self, witness: &Witness) -> String {
        let unit = self.unit(witness.target);
        format!(
            "{} is off by {}{unit}, else by {}{unit}",
            witness.formula,
            number(witness.off),
            number(witness.usual)
        )
    }

    /// A relation with its error.
    pub(super) fn relation(&self, known: &Known) -> String {
        format!(
            "{}   within {} ({} % of its spread)",
            known.formula,
            number(known.deviation),
            number(100.0 * known.share)
        )
    }

    /// What one sensor more would bring.
    pub(super) fn more(&self) -> Vec<String> {
        let open = &self.diagnosis.open;
        let pair = |(one, other): &(usize, usize)| format!("{} and {}", self.name(*one), self.name(*other));
        let pairs: Vec<String> = open.iter().take(4).map(pair).collect();
        let more =
            if open.len() > 4 { format!(", and {} more pairs", open.len() - 4) } else { String::new() };
        let mut lines = Vec::new();
        if !pairs.is_empty() {
            lines.push(format!(
                "A third sensor would tell which of two is wrong, where two now only contradict each other: {}{more}.",
                pairs.join("; ")
            ));
        }
        let lonely: Vec<&str> = self.alone().into_iter().take(4).collect();
        if !lonely.is_empty() {
            lines.push(format!(
                "A second one would show that anything is wrong at all: {}.",
                lonely.join(", ")
            ));
        }
        lines
    }

    /// Signals that move, and that nothing implies.
    fn alone(&self) -> Vec<&str> {
        let implied = "nothing else here implies it";
        self.diagnosis.unchecked.iter().filter(|it| it.1 == implied).map(|it| self.name(it.0)).collect()
    }
}

/// Seconds as people read them: `4 min 12.5 s`, `2 h 4 min`.
pub(super) fn clock(seconds: f64) -> String {
    let sign = if seconds < -0.05 { "-" } else { "" };
    let seconds = seconds.abs();
    let (days, hours, minutes) =
        ((seconds / 86_400.0).floor(), (seconds / 3_600.0).floor(), (seconds / 60.0).floor());
    let text = match seconds {
        it if it < 1.0 => format!("{} s", number(it)),
        it if it < 60.0 => format!("{} s", tenths(it)),
        it if it < 3_600.0 => format!("{minutes} min {} s", tenths(it - 60.0 * minutes)),
        it if it < 86_400.0 => {
            format!("{hours} h {} min {} s", minutes - 60.0 * hours, (it - 60.0 * minutes).round())
        }
        _ => format!("{days} d {} h {} min", hours - 24.0 * days, minutes - 60.0 * hours),
    };
    format!("{sign}{text}")
}

fn tenths(value: f64) -> String {
    let text = format!("{value:.1}");
    text.strip_suffix(".0").map_or(text.clone(), ToOwned::to_owned)
}
