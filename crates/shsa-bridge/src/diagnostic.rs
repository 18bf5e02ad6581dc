//! The states of parts for the tools that a middleware has for them: `diagnostic_msgs/msg/DiagnosticArray` in ROS.

/// How well a part is, from best to worst.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// All is well.
    Ok,
    /// It works, but worse than it should.
    Warn,
    /// It does not work.
    Error,
    /// Nothing is heard of it.
    Stale,
}

/// The state of a part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// How well it is.
    pub level: Level,
    /// Its name, unique among all that the instance reports.
    pub name: String,
    /// Its state in a few words.
    pub message: String,
    /// Who reports.
    pub reporter: String,
    /// Details by name.
    pub details: Vec<(&'static str, String)>,
}
