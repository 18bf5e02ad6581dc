//! Stands in for the crate `stabby`, which lays types out alike for all compilers. Zenoh passes such types to plugins that were
//! compiled apart; it is compiled without plugins here, and only holds the type of this crate.

/// Text.
pub mod str {
    use std::fmt;
    use std::ops::Deref;

    /// A text that is borrowed.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct Str<'a>(&'a str);

    impl<'a> From<&'a str> for Str<'a> {
        fn from(text: &'a str) -> Str<'a> {
            Str(text)
        }
    }

    impl Deref for Str<'_> {
        type Target = str;

        fn deref(&self) -> &str {
            self.0
        }
    }

    impl fmt::Display for Str<'_> {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str(self.0)
        }
    }
}
