//! `shsa model convert`: conversions between forms, and the losses that are reported.

use crate::folder::Folder;
use crate::tank;

const FACTS: &str = "% a tank\nfunction(level, by_weight, [weight, area]).\nimplementation(by_weight, \"level.v = weight.v / (area.v * 9810)\").\nitomsOf(weight, [\"/scale\"]).\nitomsOf(area, [2.5]).\n";

#[test]
fn a_model_comes_back_from_every_form() {
    let folder = tank::folder();
    let first = folder.ends("model convert tank.yaml", 0).stdout;
    let json = folder.ends("model convert tank.yaml --to json", 0).stdout;
    let folder = Folder::with(&[("a.yaml", first.as_bytes()), ("a.json", json.as_bytes())]);
    assert_eq!(folder.ends("model convert a.yaml", 0).stdout, first);
    assert_eq!(folder.ends("model convert a.json", 0).stdout, first);
    assert_eq!(folder.ends("model convert a.yaml -o - --to json", 0).stdout, json);
    assert!(
        folder
            .ends("check a.json", 0)
            .stdout
            .contains("a.json: ok: 3 variables, 2 relations, 3 signals, 1 need")
    );
}

#[test]
fn what_a_form_cannot_say_is_reported() {
    let output = tank::folder().ends("model convert tank.yaml --to prolog", 3);
    assert!(
        output.stdout.starts_with("% Relations")
            && output.stderr.contains("warning: lost: the unit of variable"),
        "{}",
        output.stderr
    );
}

#[test]
fn facts_are_a_model_for_every_command() {
    let folder = Folder::with(&[
        ("tank.pl", FACTS.as_bytes()),
        ("broken.pl", b"function(level, r, [X])."),
        ("not.txt", b"hello"),
    ]);
    assert_eq!(folder.ends("model convert tank.pl -o tank.yaml", 0).stdout, "");
    let yaml = folder.ends("model convert tank.yaml", 0).stdout;
    assert!(yaml.contains("by_weight: { equation: level = weight / (area * 9810), for: [level] }"), "{yaml}");
    let plan = folder.json("plan tank.pl level", 0);
    assert_eq!(plan["substitutions"][0]["relations"][0], "by_weight");
    let output = folder.ends("model convert broken.pl", 2).stderr;
    assert!(output.contains("broken.pl:1:21") && output.contains("write it small, or in quotes"), "{output}");
    let output = folder.ends("model convert not.txt --from prolog", 2).stderr;
    assert!(output.contains("this clause does not end"), "{output}");
}

#[test]
fn wrong_usage_is_reported() {
    let folder = tank::folder();
    assert!(
        folder
            .ends("model convert tank.yaml -o tank.yaml", 2)
            .stderr
            .contains("is in use by this run already")
    );
    assert!(folder.ends("model convert tank.yaml -o tank.doc", 2).stderr.contains("say it with --to"));
    assert!(folder.ends("model convert none.yaml", 2).stderr.contains("none.yaml"));
    assert!(
        folder
            .ends("model convert tank.yaml -o none/a.json", 2)
            .stderr
            .contains("none/a.json cannot be written")
    );
}

#[test]
fn drawings_mark_what_is_chosen_and_lost() {
    let folder = tank::folder();
    let drawn = folder.ends("model convert tank.yaml -o tank.svg --mark level --lost /level", 0);
    assert_eq!((drawn.stdout.as_str(), drawn.stderr.as_str()), ("", ""));
    let (marked, plain) =
        (folder.read("tank.svg"), folder.ends("model convert tank.yaml --to svg", 0).stdout);
    assert!(plain.starts_with("<svg") && plain.ends_with("</svg>\n") && marked != plain);
    assert!(folder.ends("model convert tank.yaml --to dot --mark level", 0).stdout.starts_with("digraph"));
    assert!(folder.ends("model convert tank.yaml --mark level", 2).stderr.contains("add --to svg"));
    assert!(
        folder
            .ends("model convert tank.yaml --to svg --mark levle", 2)
            .stderr
            .contains("did you mean 'level'?")
    );
    assert!(
        folder
            .ends("model convert tank.yaml --to svg --lost /levl", 2)
            .stderr
            .contains("did you mean '/level'?")
    );
}
