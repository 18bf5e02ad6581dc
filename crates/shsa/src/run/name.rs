//! The name of an instance on the bus.

/// Reads the name of an instance, which is one step of the addresses under which it is heard.
///
/// # Errors
/// When it is empty, or has a character with a meaning in addresses.
pub(crate) fn instance_name(text: &str) -> Result<String, String> {
    let has_meaning = |sign: char| "/+#*?$".contains(sign) || sign.is_whitespace() || sign.is_control();
    match text.chars().find(|sign| has_meaning(*sign)) {
        Some(sign) => {
            Err(format!("{sign:?} has a meaning in addresses on the bus; write a name as cellar-1"))
        }
        None if text.is_empty() => Err("a name has at least one character".to_owned()),
        None => Ok(text.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::instance_name;

    #[test]
    fn a_name_is_one_step_of_an_address() {
        for name in ["shsa", "cellar-1", "truck.1", "Küche"] {
            assert_eq!(instance_name(name).as_deref(), Ok(name));
        }
        for name in ["", "cellar/1", "a b", "+", "#", "a*", "$SYS", "a\n"] {
            assert!(instance_name(name).is_err(), "{name}");
        }
    }
}
