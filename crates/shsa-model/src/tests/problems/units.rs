//! Errors in the units, scales and amounts of a model.

use super::super::check;

#[test]
fn units_are_known_and_fit() {
    check(
        "variables:\n  x: { unit: m/sek, range: [0 s, 1] }\n  y: { unit: m, range: [2, 1], max_rate: 1 m, properties: { cost: 2 m } }
  z: {}\n  w: { unit: m, range: [1 V, 2], max_rate: -1, shape: matrix }
signals:\n  a: { variable: y, unit: V }\n  b: { variable: z, unit: V }\n  c: { variable: w }\n  d: { variable: x }",
        "3:14 error: `sek` is no unit known here (write it like `m/s^2`, `km/h`, `deg`, `degC`, `%`)
         4:25 error: the lowest value is above the highest (write `[lowest, highest]`)
         4:42 error: `1 m` does not count in `m/s` (write a number, which counts in `m/s`, or a unit like it)
         4:67 error: `2 m` is no plain number (leave the unit away)
         6:25 error: `1 V` does not count in `m` (write a number, which counts in `m`, or a unit like it)
         6:44 error: a largest rate of change is above 0 (leave `max_rate` away when it is not known)
         6:55 error: `matrix` is no shape (write `scalar` (one number) or `vector` (a list of them))
         8:27 error: `V` cannot be converted to `m`, the unit of `y` (give the unit in which the values come)
         9:27 warning: `z` has no unit, so `V` cannot be checked (write `z: { unit: V }` under `variables`)",
    );
}

#[test]
fn scales_are_numbers_that_leave_something() {
    check(
        "variables: { x: { unit: m/s } }
signals:
  a: { variable: x, scale: 0 }
  b: { variable: x, unit: 9.81 m/s, scale: 2 }
  c: { variable: x, unit: -1 m/s, offset: 3 s }
  d: { variable: x, scale: 2 m }
  e: { variable: x, unit: 0 m/s }
  f: { variable: x, unit: 2 s }
  g: { variable: x, unit: -1 m/s, offset: 1 km/h }",
        "4:28 error: a scale of 0 makes all readings the same (write what one of the reading counts)
         5:44 error: the unit of this signal holds a number already (write the number once: before the unit, or as `scale`)
         6:43 error: `3 s` does not count in `m/s` (write a number, which counts in `m/s`, or a unit like it)
         7:28 error: `2 m` is no plain number (leave the unit away)
         8:27 error: a scale of 0 makes all readings the same (write what one of the reading counts)
         9:27 error: `s` cannot be converted to `m/s`, the unit of `x` (give the unit in which the values come)",
    );
}

#[test]
fn what_wraps_and_gives_what_does_not_is_noted() {
    check(
        "variables:
  a: { unit: deg, wraps: 360 deg }
  b: { unit: deg, wraps: 360 }
  c: { unit: deg, wraps: -1 }
  d: { unit: deg }
  e: { unit: deg, shape: vector, wraps: 360 }
  n: {}
  w: { unit: deg/s }
relations:
  difference: { equation: d = a - b, for: [d] }
  same: { equation: d = a, for: [d] }
  fine: { equation: n = cos(a - b), for: [n] }
  rate: { equation: 'w = derivative(a, 1 s)', for: [w] }
  back: { equation: a = b + d, for: [a] }
  asked: { equation: 'n = if(a < 90 deg, 1, 2)', for: [n] }
signals: { s: { variable: a }, t: { variable: b }, u: { variable: c }, v: { variable: e } }",
        "5:26 error: a turn is above 0 (write what its values wrap at, such as `360 deg`)
         7:41 error: `wraps` has no meaning for a vector (leave it away)
         11:27 note: `d` does not wrap, and is computed from `a` and `b`, which do: their difference is taken the shorter way round (declare `wraps: 360 deg` for `d` too; without it, it is right within half a turn to either side of 0)
         12:21 note: `d` does not wrap, and is computed from `a`, which does: it steps by whole turns (declare `wraps: 360 deg` for `d` too, or use `sin` and `cos` of `a`)",
    );
}

#[test]
fn temperatures_are_points() {
    check(
        "variables: { t: { unit: degC }, u: { unit: degC }, d: { unit: K }, x: { unit: W } }
constants: { b: 243.12 degC }
functions: { double(t): t + t }
relations:
  a: t = b + u
  b: { equation: d = t - u, when: t - u < 2 degC, error: 0.5 degC }
  c: t = double(u)
  d: { equation: t = 0.3 * u + 0.7 * b, error: 2 % }
  e: x = 300 W/K * t
  f: { equation: \"x = 300 W/K * (t - 5 degC)\", when: u > 0, error: 2 % }
signals: { s: { variable: u }, r: { variable: x } }",
        "6:10 error: this is no temperature: the zero of the scale is in it 2 times (subtract `0 degC` from a temperature for a temperature difference (`t - 0 degC`), or write a constant that is a difference in K; the weights of a mean sum to 1)
         7:35 error: `<` of a temperature and a difference of temperatures (for a difference write `2 K` instead of `2 degC`)
         8:10 error: this is no temperature: the zero of the scale is in it 2 times (subtract `0 degC` from a temperature for a temperature difference (`t - 0 degC`), or write a constant that is a difference in K; the weights of a mean sum to 1)
         9:48 warning: a share of a temperature counts from absolute zero: 2 % of 20 degC are 5.9 K (write the error in K, such as `0.5 K`)
         10:20 error: `*` takes a difference of temperatures, not a temperature in degC or degF (subtract `0 degC` for the difference from the zero of the scale, or `0 K` for the absolute temperature; or declare it in K)
         11:58 warning: `0` without a unit is 0 K here (write `0 degC` or `0 K`)",
    );
}
