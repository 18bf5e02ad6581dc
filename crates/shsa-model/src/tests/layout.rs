//! The layout keeps the model and its comments, and a second layout changes nothing.

use crate::layout::laid_out;
use crate::live::Written;
use proptest::prelude::*;
use std::path::Path;

fn text(text: &str) -> String {
    laid_out(Written { name: "model", text }).unwrap_or_else(|report| panic!("{}", report.render(false)))
}

const UNTIDY: &str = "


shsa: 1
variables:
    # What is known.
    x: {unit: m,range: [ 0,9 ] ,}   


    y :  { unit: m }
    # Nothing else.
relations:
   same:
         formula: >
            y =
              x

         # Exact.
signals:
  /a:  { variable: x, rate: 10 Hz,
      value_error: 0.1 }  # the old one
  \"/b\":   { variable: y }
needs:
  x: [ {signal: /one,max_age: 1 s} ]
  y:
  -   signal: /two
      max_age: 2 s
  - signal: '/three'
    properties: {}";

const TIDY: &str = "\
shsa: 1
variables:
  # What is known.
  x: { unit: m, range: [0, 9] }

  y: { unit: m }
  # Nothing else.
relations:
  same:
    formula: >
       y =
         x

    # Exact.
signals:
  /a:  { variable: x, rate: 10 Hz,
      value_error: 0.1 }  # the old one
  \"/b\":   { variable: y }
needs:
  x: [{ signal: /one, max_age: 1 s }]
  y:
    -   signal: /two
        max_age: 2 s
    - signal: '/three'
      properties: {}
";

#[test]
fn levels_blanks_and_brackets_are_alike_and_comments_stay() {
    assert_eq!(text(UNTIDY), TIDY);
    assert_eq!(text(TIDY), TIDY);
}

#[test]
fn json_is_laid_out_too() {
    assert_eq!(text("{\"shsa\":1 ,\n \"variables\":{ }}"), "{ \"shsa\": 1,\n \"variables\": {} }\n");
}

#[test]
fn what_is_no_model_is_reported() {
    for wrong in ["", "shsa: [", "just a text"] {
        assert!(laid_out(Written { name: "model", text: wrong }).is_err(), "{wrong}");
    }
}

#[test]
fn the_shipped_models_are_laid_out() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut count = 0;
    for folder in ["models", "examples"] {
        for entry in std::fs::read_dir(root.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|extension| extension == "yaml") {
                let model = std::fs::read_to_string(&path).unwrap();
                assert_eq!(text(&model), model, "`shsa model fmt {}` lays it out", path.display());
                count += 1;
            }
        }
    }
    assert!(count > 5, "{count} models");
}

proptest! {
    /// With any blanks, breaks and comments added, a second layout changes nothing, or the text is reported as no model.
    #[test]
    fn laid_out_again_it_stays(places in proptest::collection::vec((0..TIDY.len(), 0..6_usize), 0..6)) {
        let mut changed = TIDY.to_owned();
        for (at, what) in places {
            if changed.is_char_boundary(at) {
                changed.insert_str(at, [" ", "\n", "  ", " # note\n", "\t", "\r\n"][what]);
            }
        }
        if let Ok(once) = laid_out(Written { name: "model", text: &changed }) {
            prop_assert_eq!(&text(&once), &once);
            prop_assert!(once.ends_with('\n') && !once.contains("\n\n\n\n\n\n\n\n"));
            prop_assert_eq!(once.matches('#').count(), changed.matches('#').count());
        }
    }
}
