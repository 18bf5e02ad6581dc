//! The first page of the help: the commands in groups, as a newcomer needs them.

use crate::old;
use clap::builder::Styles;
use clap::{Command, CommandFactory};
use std::fmt::Write as _;

/// The commands of the first page. The others are named below it.
const GROUPS: [(&str, &[&str]); 4] = [
    ("Start", &["demo", "doctor", "studio", "draft", "check", "analyze"]),
    ("Recordings", &["info", "replay", "explain", "calibrate", "learn", "campaign"]),
    ("Live", &["run", "top", "scan", "journal", "maintenance", "service"]),
    ("Models", &["model", "test", "plan", "assure"]),
];

/// Opens the first page.
const OPENING: &str = "\
A model says once how the variables of a robot, a vehicle, a building or a plant
relate. From it shsa detects a signal that is wrong or silent, names it, and
provides the needed values from the other signals.";

/// The arguments of the program, with the help in groups and the old names hidden.
pub(crate) fn command() -> Command {
    let all = old::hidden(crate::Arguments::command());
    let styles = Styles::styled();
    let (header, literal) = (styles.get_header(), styles.get_literal());
    let mut page = format!("{{about-with-newline}}\n{OPENING}\n\n{{usage-heading}} {{usage}}\n");
    let widest = GROUPS.iter().flat_map(|(_, names)| *names).map(|name| name.len()).max().unwrap_or(0);
    for (group, names) in GROUPS {
        let _cannot_fail = writeln!(page, "\n{header}{group}:{header:#}");
        for command in names.iter().filter_map(|name| all.find_subcommand(name)) {
            let name = command.get_name();
            let about = command.get_about().map(ToString::to_string).unwrap_or_default();
            let gap = " ".repeat(widest - name.len());
            let _cannot_fail = writeln!(page, "  {literal}{name}{literal:#}{gap}  {about}");
        }
    }
    let _cannot_fail = write!(page, "\n{header}Options:{header:#}\n{{options}}{{after-help}}");
    all.help_template(page)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the first page names below the groups.
    const BELOW: [&str; 3] = ["completions", "help", "man"];

    #[test]
    fn every_command_is_in_one_group_or_named_below() {
        let all = command();
        let mut shown: Vec<&str> =
            all.get_subcommands().filter(|it| !it.is_hide_set()).map(Command::get_name).collect();
        let mut named: Vec<&str> =
            GROUPS.iter().flat_map(|(_, names)| *names).copied().chain(BELOW).collect();
        shown.sort_unstable();
        named.sort_unstable();
        assert_eq!(named, shown);
    }
}
