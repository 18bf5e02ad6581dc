//! Formulas of models go to Prolog and come back.

use shsa_core::expression::Symbol;
use shsa_core::knowledge::{Id, KnowledgeBase, VariableId};
use shsa_foreign::load;
use shsa_foreign::thesis::prolog;

/// A model with every kind of element.
const EVERYTHING: &str = include_str!("../../../shsa-model/tests/all/everything.yaml");

/// The formulas of a knowledge base, by output.
fn formulas(knowledge: &KnowledgeBase) -> Vec<(String, String)> {
    let name = |symbol: Symbol| knowledge.variables()[VariableId::from_index(symbol.0 as usize)].name.clone();
    let mut formulas = Vec::new();
    for relation in knowledge.relations() {
        for (output, formula) in relation.outputs.iter().zip(&relation.formulas) {
            formulas.push((name(output.symbol()), formula.to_text(&name)));
        }
    }
    formulas.sort();
    formulas
}

#[test]
fn formulas_come_back_from_prolog() {
    let equations = [
        "y = 2 * a - b / (a + 1)",
        "y = -a^2 * b^-3 + (a * b)^0.5",
        "y = sqrt(abs(a)) + exp(b) + ln(abs(a) + 1)",
        "y = if(a > b and not (a < 1 or b == 2), a, b)",
        "y = min(xs) + max(a, b) + mean(xs[1..3]) + xs[2]",
        "y = hypot(a, b) + atan2(a, b) / 1 rad + sin(a * 1 rad)",
        "y = floor(a) + root(b, 3) + norm(a, b) + median(a, b, 1)",
        "y = a + interval(-0.5, 0.25) + plusminus(0.1) + 1e-9 + 3",
        "y = if(true, a - (b - 1), b)",
    ];
    for equation in equations {
        let text = format!(
            "shsa: 1\nvariables: {{ y:, a:, b:, xs: {{ shape: vector }} }}\nrelations: {{ r: {{ equation: \"{equation}\", for: [y] }} }}\nsignals: {{ a: {{ variable: a }}, b: {{ variable: b }}, xs: {{ variable: xs }} }}\n"
        );
        let loaded = load(&text, "m");
        assert!(loaded.report.ok(), "{}", loaded.report.render(false));
        let written = prolog::write(&loaded.knowledge);
        assert_eq!(written.losses, Vec::<String>::new(), "{equation}");
        let again = load(&written.text, "m.pl");
        assert!(again.report.diagnostics.is_empty(), "{}\n{}", again.report.render(false), written.text);
        assert_eq!(formulas(&again.knowledge), formulas(&loaded.knowledge), "{}", written.text);
    }
}

#[test]
fn what_prolog_cannot_say_is_reported() {
    let loaded = load(EVERYTHING, "m");
    let losses = prolog::write(&loaded.knowledge).losses.join("\n");
    for expected in [
        "the formula of relation turn: it holds under a condition, which a fact cannot say",
        "the formula of relations travelled, follows, rests: values of other times has no like in it",
        "the unit of variables distances, dmin, speed and 2 more",
        "the range of variables speed, humidity, calm and 2 more",
        "the largest rate of change of variable speed",
        "the properties of variable heavy",
        "the bounds of constant slip",
        "the properties of relations turn, calm is required, follows is required and 2 more",
        "the source of signal /scan",
        "the errors, rate and delays of signals /scan, /odom/speed, null",
        "the limits of signal /odom/speed",
        "the origin of signals /odom/speed, null",
        "the properties of signal /scan",
        "the name and demands of needs dmin, speed",
        "how substitutions are rated",
    ] {
        assert!(losses.lines().any(|line| line == expected), "no `{expected}` in:\n{losses}");
    }
}
