//! Python code becomes formulas, or the reason is reported.

use super::super::python::{Names, translate};

/// Translates the code of a relation that computes `y` from `a`, `b`, `xs` and `min_`, which the code calls `min`.
pub(super) fn translated(code: &str) -> String {
    let inputs = vec![("a", "a"), ("b", "b"), ("xs", "xs"), ("dt", "dt_")];
    let names = Names { output: Some("y"), inputs, plain_angles: false };
    match translate(code, &names) {
        Ok(translated) => translated.formula,
        Err(trouble) => format!("{}: {}", code.get(trouble.span).unwrap_or("?"), trouble.message),
    }
}

#[track_caller]
fn check(code: &str, expected: &str) {
    assert_eq!(translated(code), expected, "{code}");
}

#[test]
fn expressions_become_formulas() {
    check("9*a", "9 * a");
    check("a - (b - 1_000.) - .5e-3", "a - (b - 1000) - 0.5e-3");
    check("-a**2 ** -b", "-a^2^-b");
    check("(a ** 2) ** b", "(a^2)^b");
    check("(-a)**2 / (b*2)", "(-a)^2 / (b * 2)");
    check("a // b + a % b", "floor(a / b) + (a - b * floor(a / b))");
    check("--a + +b", "a + b");
    check("dt * 2", "dt_ * 2");
    check("# why\n  a + \\\n b ; # end", "a + b");
    check("(a +\n b)", "a + b");
}

#[test]
fn truths_become_conditions() {
    check("a < b <= 3 and not (a == 1 or b != 2)", "a < b and b <= 3 and not (a == 1 or b != 2)");
    check("a if a > b else b if b > 0 else 0", "if(a > b, a, if(b > 0, b, 0))");
    check("(a if True else b) * 2", "if(true, a, b) * 2");
    check("not not a > 1", "a > 1");
}

#[test]
fn functions_of_python_become_ours() {
    check("math.sqrt(abs(a)) + np.arctan2(a, b)", "sqrt(abs(a)) + atan2(a, b)");
    check("min(xs) + max(a, b) + sum([a, b, 1])", "min(xs) + max(a, b) + sum(a, b, 1)");
    check("xs[0] + xs[1:4][0] + len(xs) + xs.min()", "xs[0] + xs[1..4][0] + count(xs) + min(xs)");
    check("np.mean(xs[2:]) - statistics.median(xs[:3])", "mean(xs[2..]) - median(xs[..3])");
    check("math.log(a, 2) + math.log(b) + pow(a + 1, 2)", "ln(a) / ln(2) + ln(b) + (a + 1)^2");
    check("math.degrees(a + b) + math.ceil(a) + math.pi", "(a + b) * 180 / pi + -floor(-a) + pi");
    check(
        "a + interval([-0.1, 0.1]) + interval[1, 2] + interval(0, 1)",
        "a + interval(-0.1, 0.1) + interval(1, 2) + interval(0, 1)",
    );
    check("max((a, b))", "max(a, b)");
    check("min([a])", "a");
    check("math.cbrt(a) + float(b)", "root(a, 3) + b");
}

#[test]
fn statements_in_a_row_become_one_formula() {
    check("y = 2 * a", "2 * a");
    check("\nk = a.v * 2\ny.v = k + b.v\ny.t = a.t\n", "a * 2 + b");
    check("k = a + 1\nk = k * 2\ny = k", "(a + 1) * 2");
    check("lambda u, v: u * v + 1", "a * b + 1");
    check("lambda b, a: a - b", "a - b");
    check("def f(u, v):\n    w = u - v\n    return w / 2", "(a - b) / 2");
}

#[test]
fn what_is_no_formula_is_named() {
    check("a ^ b", "^: `^` is an exclusive or in Python: a power is written `**`");
    check("r = a", "r: this assigns to `r`, not to the output `y`");
    check("b.v = 2 * a", "b: this assigns to `b`, not to the output `y`");
    check("a * c", "c: `c` is no input of this relation");
    check("y + a", "y: `y` is the output itself");
    check("lookup(a)", "lookup: the function `lookup` is not known here");
    check("a(b)", "a: `a` is a variable and is called like a function");
    check("math.sin(a, b)", "math: `sin` with 2 arguments can not be taken over");
    check("sum(x for x in xs)", "x: `x` is no input of this relation");
    check("sum(a for a in xs)", "for: a loop can not be taken over");
    check("[a, b]", "[: a list is no number here");
    check("xs[-1]", "-: a place counted from the end can not be taken over");
    check("xs[0:4:2]", ":: only one place, or a range without a step, can be taken out of a list");
    check("a + 'b'", "'b': a text is no number");
    check("if a > 0: y = 1", "if: `if` is a statement: only formulas can be taken over");
    check("a.t - b.t", "t: the time of `a` can not be computed with");
    check("y += a", "+=: `+=` changes a value: only plain assignments can be taken over");
    check("a & b", "&: `&` works on bits or matrices: no formula here does");
    check("0x1F", "0: only decimal numbers can be taken over");
    check("1e999", "1e999: only decimal numbers can be taken over");
    check("'open", "'open: a string is not closed");
    check("a +", ": a number or a name is missing at the end");
    check("(a + b", ": an operator is missing at the end");
    check("a b", "b: an operator is missing before `b`");
    check("", ": nothing computes the output");
    check("# only words", ": nothing computes the output");
    check("__import__('os').system('x')", "'os': a text is no number");
}

#[test]
fn hostile_code_ends_at_a_limit() {
    for code in [
        "(".repeat(19_000),
        "-(".repeat(9_000),
        "2 ** ".repeat(3_000) + "a",
        "not ".repeat(4_000) + "a",
        "a if b else ".repeat(1_000) + "a",
    ] {
        assert!(translated(&code).len() < 25_000);
    }
    // each chain and each remainder writes its parts twice
    let mut chain = "a".to_owned();
    for _ in 0..40 {
        chain = format!("a % ({chain} % b)");
    }
    check(&chain, translated(&chain).as_str());
    assert!(translated(&chain).contains("more than 20000 bytes"), "{}", translated(&chain));
    let doubled = "k = a + a\n".to_owned() + &"k = k + k\n".repeat(60) + "y = k";
    assert!(translated(&doubled).contains("more than 20000 bytes"));
    assert!(translated(&"a".repeat(30_000)).contains("more than 20000 bytes"));
}
