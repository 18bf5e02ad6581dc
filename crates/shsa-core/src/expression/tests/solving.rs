//! Tests of solving equations for their variables.

use super::*;

fn plane() -> Model {
    Model::new()
        .variable("x", "", None)
        .variable("y", "", None)
        .variable("z", "", None)
        .variable("p", "", Some((0.0, 100.0)))
        .variable("n", "", Some((-100.0, 0.0)))
        .variable("r", "", Some((-2.0, 5.0)))
        .variable("tilt", "deg", Some((-90.0, 90.0)))
        .variable("bearing", "deg", Some((0.0, 180.0)))
        .variable("turn", "deg", Some((-180.0, 180.0)))
        .vector("v", "")
        .vector("w", "")
        .define("twice(a)", "a * 2")
}

#[track_caller]
fn check(equation: &str, wanted: &str, expected: &str) {
    assert_eq!(plane().solved(equation, wanted), expected, "{equation} for {wanted}");
}

#[test]
fn arithmetic_is_turned_round() {
    check("y = x + z", "y", "x + z");
    check("y = x + z", "x", "y - z");
    check("y = x - z", "z", "x - y");
    check("y = 3 * x + 1", "x", "(y - 1) / 3");
    check("y = z / x", "x", "z / y");
    check("y = x / z", "x", "y * z");
    check("-x = y", "x", "-y");
    check("y = mean(x, z, 4)", "x", "y * 3 - 4 - z");
    check("y = sum(x, z) - 1", "z", "y + 1 - x");
    check("y = twice(x)", "x", "y / 2");
    check("exp(x) = ln(z) * y", "x", "ln(ln(z) * y)");
    check("exp(x) = ln(z) * y", "z", "exp(exp(x) / y)");
    check("y = 2^x", "x", "ln(y) / 0.6931471805599453");
    check("y = log10(x)", "x", "exp(y * 2.302585092994046)");
}

#[test]
fn a_table_is_turned_round_where_it_only_rises_or_only_falls() {
    check("y = table(x, [0, 1], [2, 5], [4, 6])", "x", "table(y, [1, 0], [5, 2], [6, 4])");
    check("y = table(x, [0, 6], [2, 5], [4, 1])", "x", "table(y, [1, 4], [5, 2], [6, 0])");
    check("y = table(x, [0, 1], [2, 1], [4, 6])", "x", "table(y, [1, 0], [1, 2], [6, 4])");
    check("y = table(2 * x, [0, 1], [2, 5])", "x", "table(y, [1, 0], [5, 2]) / 2");
    check(
        "y = table(x, [-9, 3], [0, 0], [4, 8])",
        "x",
        "either(table(y, [0, 0], [3, -9]), table(y, [0, 0], [8, 4]))",
    );
    check("y = table(p, [-9, 3], [-1, 0], [4, 8])", "p", "within(table(y, [0, -1], [8, 4]), 0, 100)");
    check(
        "y = table(x, [0, 3], [4, 3])",
        "x",
        "[x] this cannot be solved for it: it cancels out -- the table has one value wherever it may be",
    );
}

#[test]
fn one_of_several_is_solved_for_each_of_them() {
    check("y = one_of(2, 3, 5) * x", "y", "one_of(2 * x, 3 * x, 5 * x)");
    check("y = one_of(2, 3, 5) * x", "x", "one_of(y / 2, y / 3, y / 5)");
    check("y = one_of(x, z + 1) - one_of(0, 1)", "y", "one_of(x, x - 1, z + 1, z)");
    check("one_of(x, x^2) = y", "x", "one_of(y, sqrt(y), -sqrt(y))");
    check("y = delay(one_of(x, z), 1 s)", "y", "delay(one_of(x, z), 1 s)");
    check(
        "y = one_of(x, z)",
        "x",
        "[x] this cannot be solved for it: one of the alternatives does not need it -- it may have every value where that one holds",
    );
    check(
        "y = one_of(1, 2, 3) * one_of(1, 2, 3) * one_of(1, 2) * x",
        "x",
        "[x] this cannot be solved for it: `one_of` leaves 18 alternatives, more than 16 -- give what is chosen a variable of its own",
    );
}

#[test]
fn powers_have_the_branches_that_the_range_allows() {
    check("p^2 = y", "p", "sqrt(y)");
    check("n^2 = y", "n", "-sqrt(y)");
    check("x^2 = y", "x", "either(sqrt(y), -sqrt(y))");
    check("r^2 = y", "r", "either(within(sqrt(y), -2, 5), within(-sqrt(y), -2, 5))");
    check("y = (p + 1)^2", "p", "sqrt(y) - 1");
    check("y = x * x", "x", "either(sqrt(y), -sqrt(y))");
    check("y = p * p / z", "p", "sqrt(y * z)");
    check("y = x^3", "x", "root(y, 3)");
    check("y = p^4", "p", "root(y, 4)");
    check("y = x^-1", "x", "1 / y");
    check("y = p^1.5", "p", "within(y, 0, inf)^0.6666666666666666");
    check("y = root(x, 3)", "x", "y^3");
    check("y = sqrt(x)", "x", "within(y, 0, inf)^2");
    check("abs(p) = y", "p", "within(y, 0, inf)");
    check("abs(x) = y", "x", "either(within(y, 0, inf), -within(y, 0, inf))");
    check("hypot(p, z) = y", "p", "sqrt(within(y, 0, inf)^2 - z^2)");
    check("norm(p, z) = y", "p", "sqrt(within(y, 0, inf)^2 - z^2)");
}

#[test]
fn angles_have_the_branches_that_the_range_allows() {
    check("y = sin(tilt)", "tilt", "asin(y)");
    check("y = cos(bearing)", "bearing", "acos(y)");
    check("y = tan(tilt)", "tilt", "atan(y)");
    check(
        "y = cos(tilt)",
        "tilt",
        "either(within(-acos(y), -1.5707963267948972, 1.5707963267948972), within(acos(y), -1.5707963267948972, 1.5707963267948972))",
    );
    assert_eq!(plane().solved("y = sin(turn)", "turn").matches("within").count(), 3);
    check(
        "y = sin(x)",
        "x",
        "[x] this cannot be solved for it: infinitely many angles give the same result -- declare a range, such as `range: [-90 deg, 90 deg]`, for the variables inside",
    );
    check("turn = asin(x)", "x", "sin(within(turn, -1.5707963277948966, 1.5707963277948966))");
    check("turn = atan(x)", "x", "tan(within(turn, -1.5707963277948966, 1.5707963277948966))");
}

#[test]
fn what_occurs_several_times_is_collected_or_refused() {
    check("x + x = y", "x", "y / 2");
    check("x = 3 * y - x", "x", "1.5 * y");
    check(
        "x * y = x + 1",
        "x",
        "[x] this cannot be solved for it: it occurs 2 times -- write the equation so that it occurs once, or give a relation for each direction",
    );
    check(
        "y = z",
        "x",
        "[y = z] this cannot be solved for it: it does not occur -- only `previous(..)` of it, or nothing, is in this equation",
    );
    check("x - x = y", "x", "[x] this cannot be solved for it: it cancels out -- it may have every value");
    check("x / x = y", "x", "[x] this cannot be solved for it: it cancels out -- it may have every value");
}

#[test]
fn what_has_no_inverse_is_refused() {
    let no = |why: &str| std::format!("[x] this cannot be solved for it: {why}");
    check("y = min(x, z)", "x", &no("min has no inverse -- the other argument may be the result"));
    check("y = floor(x)", "x", &no("floor has no inverse -- many values give the same result"));
    check("y = if(z > 1, x, 2)", "x", &no("if has no inverse -- each branch has its own inverse"));
    check(
        "y = median(x, z, 1)",
        "x",
        &no("a function of a vector has no inverse -- many vectors give the same result"),
    );
    check(
        "y = derivative(x, 1 s)",
        "x",
        &no("a time operator has no inverse -- its value at other times counts too"),
    );
    check("turn = atan2(x, z)", "x", &no("atan2 has no inverse -- it is not unique"));
    check(
        "y = v[x]",
        "v",
        "[v] this cannot be solved for it: `[..]` has no inverse -- the other elements stay unknown",
    );
    check(
        "y = min(v)",
        "v",
        "[v] this cannot be solved for it: a function of a vector has no inverse -- many vectors give the same result",
    );
    check(
        "w = x * v",
        "x",
        "[x] this cannot be solved for it: a vector of values would follow for one number",
    );
    check(
        "w = v^2",
        "v",
        "[v] this cannot be solved for it: several vectors give the same result -- declare a range that allows one of them",
    );
}

#[test]
fn vectors_are_solved_element_by_element() {
    check("w = 2 * v + x", "v", "(w - x) / 2");
    check("w = exp(v)", "v", "ln(w)");
}

#[test]
fn state_does_not_count() {
    check("x = previous(x) - y * dt", "x", "previous(x) - y * dt");
    check("x = previous(x) - y * dt", "y", "(previous(x) - x) / dt");
    let formula =
        solve(&parse_equation("x = previous(x + z) - y * dt").unwrap(), Symbol(0), &plane()).unwrap();
    assert_eq!(formula.symbols(), [Symbol(1)]);
    assert_eq!(formula.previous_symbols(), [Symbol(0), Symbol(2)]);
    assert!(formula.is_stateful());
}

#[test]
fn a_substitution_is_written_as_one_formula() {
    let model = plane();
    let (x, y) = (model.symbol("x").unwrap(), model.symbol("y").unwrap());
    let (of_x, of_y) = (model.formula("z + 1"), model.formula("x * x + previous(x)"));
    let whole = model.formula("y / x").inline(&[(x, &of_x), (y, &of_y)]);
    assert_eq!(model.text(&whole), "((z + 1)^2 + previous(x)) / (z + 1)");
    let mut large = model.formula("x + z");
    for _ in 0..40 {
        large = large.inline(&[(x, &large)]);
    }
    assert!(large.is_bounded());
}

/// The last formula with all earlier ones inlined one after the other, as a plain reference.
fn put_in_one_by_one(last: &Formula, definitions: &[(Symbol, &Formula)]) -> Formula {
    fn replaced(formula: &Formula, known: &[(Symbol, Formula)], room: &mut usize) -> Formula {
        if let Operation::Symbol(symbol) = formula.operation() {
            let known = known.iter().rev().find(|(defined, _)| *defined == symbol);
            return match known {
                Some((_, known)) if known.size() <= *room => {
                    *room -= known.size();
                    known.clone()
                }
                _ => formula.clone(),
            };
        }
        formula.with_arguments(formula.arguments().iter().map(|it| replaced(it, known, room)).collect())
    }
    let bounded = |formula: &Formula, known: &[(Symbol, Formula)]| {
        let new = replaced(formula, known, &mut (MAX_NODES - formula.size()));
        if new.is_bounded() { new } else { formula.clone() }
    };
    let mut known = Vec::new();
    for (symbol, formula) in definitions {
        let formula = bounded(formula, &known);
        known.push((*symbol, formula));
    }
    bounded(last, &known)
}

#[test]
fn long_chains_are_put_in_as_one_by_one() {
    let symbol = |at: u32| Formula::symbol(Symbol(at), Shape::Scalar);
    let chain = |length: u32, kind: u32| -> Vec<(Symbol, Formula)> {
        let link = |at: u32| match (at * 7 + kind) % 5 {
            0 => Formula::unary(Unary::Neg, symbol(at - 1)),
            // A second name, and a symbol that is used twice.
            1 => symbol(at - 1),
            2 if at.is_multiple_of(40) => Formula::binary(Binary::Add, symbol(at - 1), symbol(at - 1)),
            3 => Formula::binary(Binary::Mul, symbol(at - 1), symbol(at.saturating_sub(9))),
            _ => Formula::binary(Binary::Add, symbol(at - 1), symbol(1_000_000)),
        };
        // Some symbols are defined again.
        (1..length).map(|at| (Symbol(if at.is_multiple_of(23) { at - 1 } else { at }), link(at))).collect()
    };
    for (length, kind) in [(1, 0), (2, 0), (3, 1), (30, 2), (150, 0), (260, 3), (700, 4), (900, 1)] {
        let chain = chain(length, kind);
        let definitions: Vec<(Symbol, &Formula)> = chain.iter().map(|(symbol, it)| (*symbol, it)).collect();
        let last = Formula::unary(Unary::Sqr, symbol(length.saturating_sub(1)));
        assert_eq!(last.inline(&definitions), put_in_one_by_one(&last, &definitions), "{length} {kind}");
    }
    // A chain of names that is deeper than any stack.
    let names: Vec<(Symbol, Formula)> = (1..300_000).map(|at| (Symbol(at), symbol(at - 1))).collect();
    let definitions: Vec<(Symbol, &Formula)> = names.iter().map(|(symbol, it)| (*symbol, it)).collect();
    assert_eq!(symbol(299_999).inline(&definitions), symbol(0));
}
