//! What protects the messages of a connection.

/// What a bridge has found of its connection; what it cannot tell is not there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Channel {
    /// Nobody between this side and the other can read or change messages.
    pub encrypted: bool,
    /// This side shows who it is: by a user and a password, or by a certificate.
    pub authenticated: bool,
}

impl Channel {
    /// That of messages that do not leave the process.
    pub const WITHIN: Channel = Channel { encrypted: true, authenticated: true };

    /// The names of the properties of contracts that are measured so, and whether each is there.
    #[must_use]
    pub fn properties(self) -> [(&'static str, bool); 2] {
        [("encrypted", self.encrypted), ("authenticated", self.authenticated)]
    }
}
