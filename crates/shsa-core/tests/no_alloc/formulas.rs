//! Evaluating a formula allocates nothing, for any formula.

use shsa_core::expression::{
    Assignment, Function, Input, Kind, Number, Program, Scope, Shape, Symbol, Value, check, parse_expression,
};
use shsa_core::interval::Interval;
use shsa_core::time::{Time, Validity};

/// `a`, `b` are numbers, `v`, `w` vectors, all without units.
struct Letters;

impl Scope for Letters {
    fn symbol(&self, name: &str) -> Option<Symbol> {
        let place = ["a", "b", "v", "w"].iter().position(|known| *known == name)?;
        u32::try_from(place).ok().map(Symbol)
    }

    fn kind(&self, symbol: Symbol) -> Kind {
        let shape = if symbol.0 < 2 { Shape::Scalar } else { Shape::Vector };
        Kind { shape, unit: None, range: None, constant: None }
    }

    fn function(&self, _: &str) -> Option<&Function> {
        None
    }

    fn names(&self) -> Vec<&str> {
        Vec::new()
    }

    fn function_names(&self) -> Vec<&str> {
        Vec::new()
    }
}

/// Allocations during a thousand evaluations after the state was made; `None` when the last one gave no value.
fn allocations<N: Number>(text: &str, scalar: fn(f64) -> N) -> Option<u64> {
    let expression = parse_expression(text).ok()?;
    let formula = check(&expression, &Letters).formula?;
    let assignment = Assignment { symbol: Symbol(9), formula: &formula, condition: None };
    let program = Program::compile(&[assignment]).ok()?;
    let mut state = program.new_state(32, 100.0);
    let v: Vec<N> = (0..32).map(|place| scalar(f64::from(place * 7 % 32))).collect();
    let inputs = |input: &Input| match input.symbol.0 {
        0 => Value::Scalar(scalar(2.0)),
        1 => Value::Scalar(scalar(3.5)),
        _ => Value::Vector(&v),
    };
    let inputs: Vec<Value<'_, N>> = program.inputs().iter().map(inputs).collect();
    let mut has_value = false;
    let counted = allocation_counter::measure(|| {
        for step in 0..1000 {
            let at = Validity::at(Time(step * 10_000_000));
            has_value = !program.evaluate(&mut state, &inputs, at, None).value.is_missing();
        }
    });
    has_value.then_some(counted.count_total)
}

#[test]
fn evaluation_allocates_nothing() {
    let texts = [
        "sqrt(a^2 + b^2) / 3 + a^b + min(a, b) + atan2(a, b) + if(a > b, 1, 2)",
        "min(v) + max(v) + mean(v) + sum(v) + norm(v) + median(v) + count(v) + median(a, b, 1) + v[a] + either(a, a)",
        "(2 * v + w)[3..9]",
        "v - previous(v)",
        "a + interval(0, 1) * (b - a) - a * a + a * b * b + sin(a * 1 rad) * a",
        "mean(sqrt(a - 2.05), b) + median(sqrt(a - 2.05), ln(b - 3.55), b, 1) + mean(sqrt(v - 3)) + median(ln(v))",
        "a - previous(a) + dt + derivative(a, 0.5 s) + integral(b) + delay(a, 1 s)",
    ];
    for text in texts {
        assert_eq!(allocations(text, |number| number), Some(0), "{text} over numbers");
        assert_eq!(
            allocations(text, |number| Interval::new(number, number + 0.1)),
            Some(0),
            "{text} over intervals"
        );
    }
}

#[test]
fn allocations_are_counted() {
    let counted = allocation_counter::measure(|| drop(core::hint::black_box(vec![1_u8; 100])));
    assert_eq!(counted.count_total, 1);
}
