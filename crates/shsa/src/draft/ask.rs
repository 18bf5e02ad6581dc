//! The questions of `shsa draft`: what no recording says.

use anyhow::bail;
use shsa_core::unit::{Unit, nearest};
use shsa_lab::drafting::{Because, Columns, Drafted, Needed, variable_names};
use shsa_message::span::parse_span;
use std::io::{BufRead, Write, stderr, stdin};

/// The most units that are asked for one by one; the others stay open in the file.
const MOST_UNITS: usize = 12;

/// The most variables that are listed.
const MOST_NAMES: usize = 20;

/// Questions on standard error, answers on standard input.
pub(super) struct Asking {
    /// Whether every further question takes its proposal.
    is_over: bool,
}

impl Asking {
    /// Asks, or takes every proposal without a question.
    pub(super) fn new(takes_all: bool) -> Asking {
        Asking { is_over: takes_all }
    }

    /// The answer, or the proposal where it is empty.
    fn ask(&mut self, question: &str, proposal: &str) -> anyhow::Result<String> {
        if self.is_over {
            return Ok(proposal.to_owned());
        }
        write!(stderr(), "{question} [{proposal}] ")?;
        stderr().flush()?;
        let mut answer = String::new();
        if stdin().lock().read_line(&mut answer)? == 0 {
            self.is_over = true;
            writeln!(stderr())?;
        }
        Ok(match answer.trim() {
            "" => proposal.to_owned(),
            answer => answer.to_owned(),
        })
    }

    /// The answer, once `read` accepts it; what is wrong with others is said.
    fn ask_until<T>(
        &mut self,
        question: &str,
        proposal: &str,
        read: impl Fn(&str) -> Result<T, String>,
    ) -> anyhow::Result<T> {
        loop {
            match read(&self.ask(question, proposal)?) {
                Ok(answer) => return Ok(answer),
                // The end of the input leaves the proposal, which is always accepted.
                Err(why) if !self.is_over => writeln!(stderr(), "{why}")?,
                Err(why) => bail!(why),
            }
        }
    }

    fn ask_yes(&mut self, question: &str) -> anyhow::Result<bool> {
        self.ask_until(question, "yes", |answer| match answer.to_lowercase().as_str() {
            "y" | "yes" => Ok(true),
            "n" | "no" => Ok(false),
            _ => Err("answer yes or no".to_owned()),
        })
    }
}

/// Units: those that names suggest all together, the others one by one.
pub(super) fn units(read: &mut Columns, asking: &mut Asking) -> anyhow::Result<()> {
    let open: Vec<usize> = (0..read.about.len())
        .filter(|at| read.columns[*at].signal.unit.is_none() && read.columns[*at].moves())
        .collect();
    let guesses: Vec<(usize, &'static str)> =
        open.iter().filter_map(|at| Some((*at, read.about[*at].guessed_unit?))).collect();
    if !guesses.is_empty() {
        let listed: Vec<String> =
            guesses.iter().map(|(at, unit)| format!("{} in {unit}", read.about[*at].signal)).collect();
        let question = format!("By their names: {}. Are these the units?", listed.join(", "));
        if asking.ask_yes(&question)? {
            guesses.iter().for_each(|(at, unit)| read.set_unit(*at, unit));
        }
    }
    let unknown: Vec<usize> = open.into_iter().filter(|at| read.columns[*at].signal.unit.is_none()).collect();
    for at in unknown.into_iter().take(MOST_UNITS) {
        let question = format!("In which unit is {}? (`none` leaves it unchecked)", read.about[at].signal);
        let unit = asking.ask_until(&question, "none", |answer| match answer {
            "none" => Ok(None),
            text => Unit::parse(text).map(|_| Some(text.to_owned())).map_err(|error| error.to_string()),
        })?;
        unit.into_iter().for_each(|unit| read.set_unit(at, &unit));
    }
    Ok(())
}

/// Groups that names suggest: do they measure the same?
pub(super) fn groups(read: &Columns, drafted: &mut Drafted, asking: &mut Asking) -> anyhow::Result<()> {
    for at in 0..drafted.groups.len() {
        let members = &drafted.groups[at].members;
        let named = members.iter().filter(|it| it.because == Because::Named);
        let columns: Vec<usize> = named.map(|it| it.column).collect();
        if columns.is_empty() {
            continue;
        }
        let name = |column: usize| read.about[column].signal.as_str();
        let others: Vec<&str> = columns.iter().map(|column| name(*column)).collect();
        let question = format!(
            "Names and values suggest that {} measures the same as {}. Is it so?",
            others.join(", "),
            name(members[0].column)
        );
        if !asking.ask_yes(&question)? {
            columns.into_iter().for_each(|column| drafted.part(at, column));
        }
    }
    Ok(())
}

/// What must stay available, and how fresh.
pub(super) fn needs(read: &Columns, drafted: &mut Drafted, asking: &mut Asking) -> anyhow::Result<()> {
    let names = variable_names(read, drafted);
    let Some(first) = drafted.most_measured() else { return Ok(()) };
    let place = |name: &str| match names.iter().position(|known| known == name) {
        Some(at) => Ok(at),
        None => Err(match nearest(name, names.iter().map(String::as_str)) {
            Some(near) => format!("there is no variable {name}: {near}?"),
            None => format!("there is no variable {name}; there are {}", names.join(", ")),
        }),
    };
    let listed = names.iter().take(MOST_NAMES).cloned().collect::<Vec<_>>().join(", ");
    let more = if names.len() > MOST_NAMES { ", ..." } else { "" };
    let question = format!(
        "Which variables must stay available, of {listed}{more}? (names with commas between, or `none`)"
    );
    let wanted = asking.ask_until(&question, &names[first], |answer| match answer {
        "none" => Ok(Vec::new()),
        listed => listed.split(',').map(|name| place(name.trim())).collect::<Result<Vec<usize>, String>>(),
    })?;
    for group in wanted {
        let question = format!("How old may a value of {} be at most?", names[group]);
        let max_age = asking.ask_until(&question, &drafted.usual_age(group), |answer| {
            parse_span(answer).map(|_| answer.to_owned())
        })?;
        drafted.needs.push(Needed { group, max_age });
    }
    Ok(())
}
