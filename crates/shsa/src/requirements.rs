//! The requirements on a planned substitution, from the command line, and the table of candidates that fail them.

use crate::plan::{find_relation, find_signal};
use crate::show;
use anyhow::{Context, bail};
use shsa_core::knowledge::{KnowledgeBase, Need, VariableId, integrity_level};
use shsa_core::plan::{Options, Requirements};
use shsa_core::time::Span;
use shsa_message::span::parse_span;
use shsa_report::shortfall::Refused;

/// Requirements on the command line.
#[derive(clap::Args)]
#[command(next_help_heading = "Requirements")]
pub(crate) struct RequirementArguments {
    /// Meet what the need of the variable demands: age, width, integrity, rate. Of several needs, NEED is the name under which
    /// one is published.
    #[arg(long, value_name = "NEED", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    for_need: Option<String>,
    /// The largest age of what a substitution rests on, such as 300ms.
    #[arg(long, value_name = "SPAN", value_parser = parse_span)]
    max_latency: Option<Span>,
    /// The largest width of its values, in the unit of the variable.
    #[arg(long, value_name = "WIDTH")]
    max_width: Option<f64>,
    /// The least rate of its signals, in observations a second.
    #[arg(long, value_name = "HZ")]
    min_rate: Option<f64>,
    /// The least integrity level of its signals and relations (their property `integrity`), A to D.
    #[arg(long, value_name = "LEVEL")]
    integrity: Option<String>,
    /// A suspect: no signal that shares an origin with it is used; may be given several times.
    #[arg(long, value_name = "SIGNAL")]
    independent_of: Vec<String>,
    /// A relation that must not be used; may be given several times.
    #[arg(long, value_name = "RELATION")]
    exclude_relation: Vec<String>,
    /// List also what falls short, and why.
    #[arg(long)]
    why: bool,
}

impl RequirementArguments {
    /// The requirements on substitutions of a variable; excluded relations are added to the options.
    ///
    /// # Errors
    /// When the model lacks a name, a number is invalid, or the variable has no such need.
    pub(crate) fn read(
        &self,
        knowledge: &KnowledgeBase,
        variable: VariableId,
        options: &mut Options,
    ) -> anyhow::Result<Requirements> {
        for name in &self.exclude_relation {
            options.forbidden_relations.push(find_relation(knowledge, name)?);
        }
        let need = self.for_need.as_ref().map(|name| of_need(knowledge, variable, name)).transpose()?;
        let mut requirements = need.unwrap_or_default();
        let unit = knowledge.variables()[variable].unit.clone();
        let in_si = |width: f64| unit.as_ref().map_or(width, |unit| unit.to_si_difference(width));
        requirements.max_latency = self.max_latency.or(requirements.max_latency);
        requirements.max_width =
            positive("--max-width", self.max_width)?.map(in_si).or(requirements.max_width);
        requirements.min_rate_hz = positive("--min-rate", self.min_rate)?.or(requirements.min_rate_hz);
        if let Some(name) = &self.integrity {
            let level = integrity_level(name)
                .with_context(|| format!("'{name}' is no integrity level; write A, B, C or D"))?;
            requirements.integrity = Some(level);
        }
        let suspects = self.independent_of.iter().map(|name| find_signal(knowledge, name));
        requirements.independent_of = suspects.collect::<anyhow::Result<_>>()?;
        Ok(requirements)
    }

    /// Whether to list candidates that fail.
    pub(crate) fn asks_why(&self) -> bool {
        self.why
    }
}

/// The requirements of the variable's need: of the only one, or of the one with this name.
fn of_need(knowledge: &KnowledgeBase, variable: VariableId, name: &str) -> anyhow::Result<Requirements> {
    let of_variable: Vec<&Need> = knowledge.needs().iter().filter(|need| need.variable == variable).collect();
    let published = || of_variable.iter().map(|need| need.signal.as_str()).collect::<Vec<_>>().join(", ");
    let variable = &knowledge.variables()[variable].name;
    match (name, of_variable.as_slice()) {
        (_, []) => bail!("the model has no need of '{variable}'"),
        ("", [need]) => Ok(Requirements::of(need)),
        ("", several) => {
            bail!("'{variable}' has {} needs; name one: --for-need={}", several.len(), published())
        }
        (name, needs) => {
            let found = needs.iter().find(|need| need.signal == name);
            let help = || format!("no need of '{variable}' is published as '{name}', but {}", published());
            found.map(|need| Requirements::of(need)).with_context(help)
        }
    }
}

fn positive(flag: &str, value: Option<f64>) -> anyhow::Result<Option<f64>> {
    match value {
        Some(value) if value.is_nan() || value < 0.0 => {
            bail!("{flag} {value} makes no sense: give a number from 0 on")
        }
        value => Ok(value),
    }
}

/// A table of the failing candidates.
pub(crate) fn table(knowledge: &KnowledgeBase, refused: &[Refused]) -> String {
    let row = |refused: &Refused| {
        let relations = refused.relations(knowledge);
        let relations =
            if relations.is_empty() { "(its own signal)".to_owned() } else { relations.join(", ") };
        vec![relations, refused.reasons.join("; ")]
    };
    show::style().table(&["falls short", "because"], refused.iter().map(row).collect())
}
