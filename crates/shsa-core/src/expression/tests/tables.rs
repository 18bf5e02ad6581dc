//! Tests of tables: their notation, their units, the order of their points.

use super::checking::{check_problems, check_text};

#[test]
fn a_table_has_points_of_its_units_that_ascend() {
    check_text("table(dmin, [0 cm, 1 kg], [50 cm, 2 kg])", "table(dmin, [0, 1], [0.5, 2])");
    check_text("table(load, [0, 1], [1, 1], [1, 3])", "table(load, [0, 1], [1, 1], [1, 3])");
    check_problems(
        "table(dmin, [0 m, 1], [2, 3])",
        "[table(dmin, [0 m, 1], [2, 3])] `table` of m and a plain number -- both sides must have the same unit",
    );
    check_problems(
        "table(load, [0, 1], [2, 3], [1, 4], [1, 4])",
        "[[1, 4]] the points of a table ascend -- two points of one argument are a jump between their values\n\
         [[1, 4]] this point of a table stands here twice -- two points of one argument are a jump between their values",
    );
    let notation = "write `table(x, [0, 1], [2, 5])`: each point is an argument and its value";
    check_problems(
        "table(load, 1, 2)",
        &std::format!(
            "[1] this is no point of a table -- {notation}\n[2] this is no point of a table -- {notation}"
        ),
    );
    check_problems(
        "load + [1, 2]",
        &std::format!("[[1, 2]] a point `[x, y]` stands outside of a table -- {notation}"),
    );
    check_problems(
        "table(load, [0, slip], [2, plusminus(3)])",
        "[slip] a point of a table takes a constant -- variables are not allowed here\n\
         [plusminus(3)] a point of a table is exact -- state the `error` of the relation for what the table leaves open",
    );
    check_problems("table(load, [0 1], [1, 2])", "[1] a `,` is missing before `1`");
    check_text("table(outside, [0 degC, 1], [20 degC, 2])", "table(outside, [273.15, 1], [293.15, 2])");
}
