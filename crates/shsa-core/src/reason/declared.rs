//! The macro that makes the enum of reasons, with their codes and arguments, of one table.

/// The enum of reasons, and its conversion to and from codes and arguments, from one table.
macro_rules! reasons {
    ($(#[doc = $doc:literal] $code:literal $name:ident $({
        $($field:ident: $type:ty = $about:literal),+
    })?;)+) => {
        /// A reason of a decision, from a closed list.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Reason {
            $(#[doc = $doc] $name $({ $(#[doc = $about] $field: $type),+ })?,)+
        }

        impl Reason {
            /// The descriptions of all reasons, in the order of the reference.
            pub const ALL: &'static [Described] = &[$(Described {
                code: $code,
                arguments: &[$($((stringify!($field), <$type as Value>::KIND)),+)?],
            }),+];

            /// The reason's code in files.
            #[must_use]
            pub fn code(&self) -> &'static str {
                match self {
                    $(Reason::$name $({ $($field: _),+ })? => $code,)+
                }
            }

            /// The arguments with their names.
            #[must_use]
            pub fn arguments(&self) -> Vec<(&'static str, Argument)> {
                match self {
                    $(Reason::$name $({ $($field),+ })? => {
                        Vec::from([$($((stringify!($field), $field.argument())),+)?])
                    })+
                }
            }

            /// The reason of a code, with the arguments that `argument` gives; `None` for an unknown code, or where an argument
            /// is missing or of another kind.
            pub fn read(
                code: &str,
                mut argument: impl FnMut(&'static str, Kind) -> Option<Argument>,
            ) -> Option<Reason> {
                match code {
                    $($code => Some(Reason::$name $({
                        $($field: Value::read(argument(stringify!($field), <$type as Value>::KIND)?)?),+
                    })?),)+
                    _ => None,
                }
            }
        }
    };
}

pub(super) use reasons;
