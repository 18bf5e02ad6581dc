//! Formulas of planted variables: arithmetic over the variables before, as Python and NumPy write it.

use anyhow::{Context, bail};

/// What a formula is made of.
#[derive(Debug)]
pub(super) enum Formula {
    Number(f64),
    /// The variable with this place in the list of inputs.
    Input(usize),
    Call(Function, Vec<Formula>),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Function {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Less,
    AtMost,
    Greater,
    AtLeast,
    Sin,
    Cos,
    Tan,
    Sqrt,
    Exp,
    Log,
    Abs,
    Sign,
    Where,
    Minimum,
    Maximum,
}

use Function::{
    Abs, Add, AtLeast, AtMost, Cos, Divide, Exp, Greater, Less, Log, Maximum, Minimum, Multiply, Power, Sign,
    Sin, Sqrt, Subtract, Tan, Where,
};

/// Functions with their names and the numbers of their arguments.
const FUNCTIONS: [(&str, Function, usize); 11] = [
    ("sin", Sin, 1),
    ("cos", Cos, 1),
    ("tan", Tan, 1),
    ("sqrt", Sqrt, 1),
    ("exp", Exp, 1),
    ("log", Log, 1),
    ("abs", Abs, 1),
    ("sign", Sign, 1),
    ("where", Where, 3),
    ("minimum", Minimum, 2),
    ("maximum", Maximum, 2),
];

/// Operators of two operands by their precedence, the weakest first; of those that begin alike, the longer one first.
const OPERATORS: [&[(&str, Function)]; 3] = [
    &[("<=", AtMost), (">=", AtLeast), ("<", Less), (">", Greater)],
    &[("+", Add), ("-", Subtract)],
    &[("*", Multiply), ("/", Divide)],
];

impl Formula {
    /// Reads a formula over these inputs.
    pub(super) fn parse(text: &str, inputs: &[String]) -> anyhow::Result<Formula> {
        let mut reader = Reader { rest: text.trim_start(), inputs };
        let formula = reader.operation(0).with_context(|| format!("`{text}`"))?;
        anyhow::ensure!(reader.rest.is_empty(), "`{text}`: `{}` is left over", reader.rest);
        Ok(formula)
    }

    /// The value for these values of the inputs.
    pub(super) fn value(&self, inputs: &[f64]) -> f64 {
        match self {
            Formula::Number(number) => *number,
            Formula::Input(place) => inputs[*place],
            Formula::Call(function, arguments) => {
                let of = |place: usize| arguments[place].value(inputs);
                let holds = |it: bool| f64::from(u8::from(it));
                match function {
                    Add => of(0) + of(1),
                    Subtract => of(0) - of(1),
                    Multiply => of(0) * of(1),
                    Divide => of(0) / of(1),
                    Power => of(0).powf(of(1)),
                    Less => holds(of(0) < of(1)),
                    AtMost => holds(of(0) <= of(1)),
                    Greater => holds(of(0) > of(1)),
                    AtLeast => holds(of(0) >= of(1)),
                    Sin => of(0).sin(),
                    Cos => of(0).cos(),
                    Tan => of(0).tan(),
                    Sqrt => of(0).sqrt(),
                    Exp => of(0).exp(),
                    Log => of(0).ln(),
                    Abs => of(0).abs(),
                    Sign => of(0).partial_cmp(&0.0).map_or(f64::NAN, |it| f64::from(it as i8)),
                    Where if of(0) != 0.0 => of(1),
                    Where => of(2),
                    Minimum => of(0).min(of(1)),
                    Maximum => of(0).max(of(1)),
                }
            }
        }
    }
}

struct Reader<'t> {
    rest: &'t str,
    inputs: &'t [String],
}

impl Reader<'_> {
    fn takes(&mut self, sign: &str) -> bool {
        let rest = self.rest.strip_prefix(sign);
        self.rest = rest.map_or(self.rest, str::trim_start);
        rest.is_some()
    }

    fn operation(&mut self, precedence: usize) -> anyhow::Result<Formula> {
        let Some(operators) = OPERATORS.get(precedence) else { return self.signed() };
        let mut left = self.operation(precedence + 1)?;
        while let Some((_, function)) = operators.iter().find(|(sign, _)| self.takes(sign)) {
            left = Formula::Call(*function, vec![left, self.operation(precedence + 1)?]);
        }
        Ok(left)
    }

    fn signed(&mut self) -> anyhow::Result<Formula> {
        if self.takes("-") {
            return Ok(Formula::Call(Subtract, vec![Formula::Number(0.0), self.signed()?]));
        }
        let base = self.operand()?;
        let is_raised = self.takes("**");
        Ok(if is_raised { Formula::Call(Power, vec![base, self.signed()?]) } else { base })
    }

    fn operand(&mut self) -> anyhow::Result<Formula> {
        if self.takes("(") {
            let inner = self.operation(0)?;
            anyhow::ensure!(self.takes(")"), "no `)` before `{}`", self.rest);
            return Ok(inner);
        }
        let word = self.word();
        if let Ok(number) = word.parse() {
            return Ok(Formula::Number(number));
        }
        if let Some(place) = self.inputs.iter().position(|it| *it == word) {
            return Ok(Formula::Input(place));
        }
        let Some((_, function, count)) = FUNCTIONS.into_iter().find(|(name, ..)| *name == word) else {
            bail!("`{word}` before `{}` is no number, input or function", self.rest);
        };
        let mut arguments = Vec::new();
        while self.takes(if arguments.is_empty() { "(" } else { "," }) {
            arguments.push(self.operation(0)?);
        }
        anyhow::ensure!(self.takes(")") && arguments.len() == count, "`{word}` has {count} arguments");
        Ok(Formula::Call(function, arguments))
    }

    /// A name or a number, such as `x1`, `2.5e-3`.
    fn word(&mut self) -> String {
        let mut before = ' ';
        let is_end = |it: char| {
            let is_sign_of_exponent = matches!(it, '+' | '-') && matches!(before, 'e' | 'E');
            let is_number = self.rest.starts_with(|first: char| first.is_ascii_digit() || first == '.');
            let is_in = it.is_alphanumeric() || matches!(it, '.' | '_') || is_sign_of_exponent && is_number;
            before = it;
            !is_in
        };
        let end = self.rest.find(is_end).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest.trim_start();
        word.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, expected: f64) {
        let inputs = ["x1".to_owned(), "x2".to_owned()];
        assert_eq!(Formula::parse(text, &inputs).unwrap().value(&[3.0, 4.0]), expected);
    }

    #[test]
    fn formulas_are_computed_as_python_does() {
        check("2 * x1 + x2 / 2", 8.0);
        check("-x1 ** 2 - 1", -10.0);
        check("sqrt(x1 * x1 + x2**2)", 5.0);
        check("where(x1 > 3, 1, where(x1 >= 3, 2.5e-1, 7))", 0.25);
        check("minimum(x1, x2) - maximum(abs(-x2), 1e1) * sign(-2)", 13.0);
        check("2 - 1 - 1", 0.0);
    }

    #[test]
    fn what_is_no_formula_is_refused() {
        for text in ["", "x3", "2 +", "sin(1, 2)", "(1", "1 1"] {
            assert!(Formula::parse(text, &[]).is_err(), "{text}");
        }
    }
}
