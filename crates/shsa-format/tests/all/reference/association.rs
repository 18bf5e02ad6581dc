//! `docs/association.md` against the tables of the keys.

use super::document::{Document, code};
use shsa_format::association::{ASSOCIATION, Associations, Key, SENSOR};

#[test]
fn every_key_is_described_with_what_it_holds() {
    let page = Document::read("association.md");
    let tables: [(&str, &[Key]); 2] = [("key", &ASSOCIATION), ("key of a sensor", &SENSOR)];
    for (head, keys) in tables {
        page.names_exactly(head, keys.iter().map(|key| key.0));
        for (row, key) in page.rows(head).iter().zip(keys) {
            assert_eq!((code(&row[0]), row[1].as_str(), row[2].as_str()), (vec![key.0.into()], key.1, key.2));
        }
    }
}

#[test]
fn the_example_has_every_key_and_is_read() {
    let blocks = Document::read("association.md").blocks("yaml");
    let [example] = blocks.as_slice() else { panic!("{} examples", blocks.len()) };
    let read = Associations::read(example, "docs/association.md")
        .unwrap_or_else(|it| panic!("{}", it.render(false)));
    assert_eq!(read.associations[0].sensors.len(), 3);
    for key in ASSOCIATION.iter().chain(&SENSOR) {
        assert!(example.contains(&format!("{}:", key.0)), "no example of `{}`", key.0);
    }
}
