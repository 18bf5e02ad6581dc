//! Claims of this client and of others.

use super::*;
use crate::Clock;

fn claims() -> Arc<Claims> {
    Claims::new(Some("me".to_owned()), Inbox::new(4, Clock::running()))
}

fn changes_text(attendance: &mut Attendance) -> String {
    let changes_text = std::iter::from_fn(attendance).map(|presence| match presence {
        Presence::Alive(name) => format!("+{name}"),
        Presence::Gone(name) => format!("-{name}"),
    });
    changes_text.collect::<Vec<_>>().join(" ")
}

#[test]
fn own_names_are_reported_when_the_others_are_known_and_said_until_they_are_dropped() {
    for is_echoed in [true, false] {
        let claims = claims();
        let mut attendance = claims.attendance("a/**").unwrap();
        let _held = claims.attend("a/one").unwrap();
        assert_eq!(changes_text(&mut attendance), "");
        claims.own_message();
        claims.own_message();
        assert_eq!(changes_text(&mut attendance), "");
        match is_echoed {
            true => assert!(claims.receive("shsa/me/claims", b"", false)),
            false => claims.renew(),
        }
        assert_eq!(changes_text(&mut attendance), "+a/one");
    }
    let claims = claims();
    assert_eq!(claims.own_message(), None);
    let mut attendance = claims.attendance("a/**").unwrap();
    claims.receive("shsa/me/claims", b"", false);
    let held = (claims.attend("a/one").unwrap(), claims.attend("b/two").unwrap());
    assert_eq!(changes_text(&mut attendance), "+a/one");
    assert_eq!(claims.own_message(), Some(("shsa/me/claims".to_owned(), "a/one\nb/two".to_owned())));
    drop(held);
    assert_eq!(changes_text(&mut attendance), "-a/one");
    assert_eq!(claims.own_message(), Some(("shsa/me/claims".to_owned(), String::new())));
    assert!(claims.attend("a\nb").is_err());
}

#[test]
fn others_are_there_while_they_say_so() {
    let claims = claims();
    assert!(!claims.receive("shsa/one/claims", b"a/x", false), "nobody wants to know");
    let mut attendance = claims.attendance("a/**").unwrap();
    assert!(!claims.receive("shsa/one/need/x", b"a/x", false));
    assert!(claims.receive("shsa/me/claims", b"a/echo", false));
    for (topic, words, is_retained, expected) in [
        ("shsa/one/claims", "a/x\nb/y\na/z", false, "+a/x +a/z"),
        ("shsa/one/claims", "a/x\nb/y\na/z", false, ""),
        ("shsa/one/claims", "a/z", false, "-a/x"),
        ("shsa/one/status", "offline", false, "-a/z"),
        ("shsa/one/claims", "a/z", true, ""),
        ("shsa/one/claims", "a/z", false, "+a/z"),
        ("shsa/one/status", "online", false, ""),
        ("shsa/one/claims", "", false, "-a/z"),
    ] {
        assert!(claims.receive(topic, words.as_bytes(), is_retained));
        assert_eq!(changes_text(&mut attendance), expected, "{topic} {words}");
    }
}

#[test]
fn claims_that_nobody_renews_are_over_unless_nobody_has_looked() {
    let claims = claims();
    let mut attendance = claims.attendance("a/*").unwrap();
    claims.receive("shsa/one/claims", b"a/x", false);
    assert_eq!(changes_text(&mut attendance), "+a/x");
    let began = Uptime::now();
    // A pause: after an absence, claims do not expire at once.
    let mut at = began + 3 * EXPIRES;
    claims.lock().look(at);
    for _ in 0..4 {
        assert_eq!(claims.lock().others.len(), 1);
        at = at + RENEWED;
        claims.lock().look(at);
    }
    claims.lock().look(at + RENEWED);
    assert_eq!(changes_text(&mut attendance), "-a/x");
}

#[test]
fn claims_of_this_client_are_forged_if_it_has_not_published_them() {
    let claims = claims();
    let _attendance = claims.attendance("a/**").unwrap();
    let is_forged = |words: &str| claims.is_forged("shsa/me/claims", words.as_bytes());
    assert!(!is_forged("a/kept"), "the broker has kept them since an earlier run");
    let held = claims.attend("a/one").unwrap();
    claims.own_message();
    assert!(!is_forged("a/kept") && !is_forged("a/one") && is_forged("a/kept") && is_forged(""));
    drop(held);
    claims.own_message();
    assert!(!is_forged("a/one") && !is_forged(""), "both may be on their way");
    assert!(!claims.is_forged("shsa/other/claims", b"a/two"));
}

#[test]
fn patterns_have_levels() {
    for (pattern, name, is) in
        [("a/**", "a/b/c", true), ("a/*", "a/b/c", false), ("a/*/c", "a/b/c", true), ("a", "b", false)]
    {
        assert_eq!(matches(pattern, name), is, "{pattern} {name}");
    }
}
