//! Names of earlier versions: they do what they did, and a note names the new form. They work for one version.

use crate::show;
use clap::Command;

/// The old names of commands, each with its new form.
const COMMANDS: [(&str, &str); 9] = [
    ("story", "test"),
    ("init", "draft"),
    ("monitor", "replay --compare VARIABLE"),
    ("convert", "model convert"),
    ("join", "model join"),
    ("part", "model part"),
    ("fmt", "model fmt"),
    ("patch", "model patch"),
    ("schema", "model schema"),
];

/// Hides the old names in lists of commands; their help names the new form.
pub(crate) fn hidden(all: Command) -> Command {
    COMMANDS.iter().fold(all, |all, (old, new)| {
        all.mut_subcommand(old, |command| command.hide(true).before_help(replaced("shsa", old, new)))
    })
}

/// Writes a note to standard error if a command is called by its old name.
pub(crate) fn note_command(name: &str) {
    if let Some((old, new)) = COMMANDS.iter().find(|(old, _)| *old == name) {
        note("shsa", old, new);
    }
}

/// Writes a note to standard error: something of `command` has a new form.
pub(crate) fn note(command: &str, old: &str, new: &str) {
    show::write(&format!("note: {}", replaced(command, old, new)));
}

fn replaced(command: &str, old: &str, new: &str) -> String {
    format!("`{command} {old}` is now `shsa {new}`; the old form works in this version only")
}
