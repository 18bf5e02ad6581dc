//! Whether a formula is linear in its symbols, so that its derivatives depend on `dt` alone.

use shsa_core::expression::{Binary, Formula, Operation, Symbol, Unary};

/// Whether a formula is a sum of its symbols, each times what depends on `dt` alone, which may be a symbol, too. May be false for one
/// that is.
pub(crate) fn is_linear(formula: &Formula, dt: Symbol) -> bool {
    degree(formula, dt).is_some()
}

/// 0 for a formula without symbols, 1 for a linear one; `None` for any other.
fn degree(formula: &Formula, dt: Symbol) -> Option<u8> {
    let arguments: Vec<Option<u8>> = formula.arguments().iter().map(|it| degree(it, dt)).collect();
    match (formula.operation(), arguments.as_slice()) {
        (Operation::Symbol(symbol), []) => Some(u8::from(symbol != dt)),
        (Operation::Binary(Binary::Add | Binary::Sub), [Some(one), Some(other)]) => Some(*one.max(other)),
        (Operation::Binary(Binary::Mul), [Some(one), Some(other)]) => Some(one + other).filter(|it| *it <= 1),
        (Operation::Binary(Binary::Div), [Some(one), Some(0)]) => Some(*one),
        (Operation::Unary(Unary::Neg), [Some(one)]) => Some(*one),
        (Operation::Previous(_), _) => None,
        (_, all) => all.iter().all(|it| *it == Some(0)).then_some(0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formulas::Vocabulary;

    #[test]
    fn what_is_linear() {
        let mut words = Vocabulary::default();
        ["x", "v"].into_iter().for_each(|name| _ = words.add_number(name));
        let is_linear = |text: &str| {
            is_linear(&words.formula("a test", text).unwrap().with_elapsed(Symbol(2)), Symbol(2))
        };
        for text in ["x", "3", "x + v*dt", "x*exp(-dt/(20 s)) - (1 - exp(-dt/(20 s)))*v/2", "-x/dt"] {
            assert!(is_linear(text), "{text}");
        }
        for text in ["x*v", "x^2", "dt/x", "exp(x)", "max(x, 0)", "x + v*(x - 1)", "if(x > 1, v, x)"] {
            assert!(!is_linear(text), "{text}");
        }
    }
}
