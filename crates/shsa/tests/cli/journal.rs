//! Sealed journals of runs, and what `shsa journal verify` says of them.

use crate::folder::Folder;

/// A pair that openssl has made for this test, and the public key of another one.
const PRIVATE: &str = "MC4CAQAwBQYDK2VwBCIEIDSFeDzv2z9n/o7K4eOkuUtZ49B62zSzYLl597Av+Q0r";
const PUBLIC: &str = "MCowBQYDK2VwAyEA70osIIlOUnS4EqRhfN86vBHQluc57tA9IdvTz6iAGTg=";
const OTHER: &str = "MCowBQYDK2VwAyEAIM2RoUpDyG6Xq4vH1APhTATMUEbihpxQtyUV8LyIWlI=";

/// A folder with keys, and with the signed journal of two runs of the robot.
pub(crate) fn signed() -> Folder {
    use std::os::unix::fs::PermissionsExt;
    let pem =
        |kind: &str, key: &str| format!("-----BEGIN {kind} KEY-----\n{key}\n-----END {kind} KEY-----\n");
    let folder = Folder::new();
    folder.write("key.pem", pem("PRIVATE", PRIVATE));
    folder.write("public.pem", pem("PUBLIC", PUBLIC));
    folder.write("other.pem", pem("PUBLIC", OTHER));
    let refused = folder.run("run --http off --for 1s --journal j --journal-key key.pem");
    assert!(
        refused.status == 2 && refused.stderr.contains("everyone on this machine can read"),
        "{}",
        refused.stderr
    );
    std::fs::set_permissions(folder.path("key.pem"), std::fs::Permissions::from_mode(0o600)).unwrap();
    for _ in 0..2 {
        let ended = folder.run("run --http off --for 1s --journal j --journal-key key.pem");
        assert!(ended.status <= 1, "{}", ended.stderr);
    }
    folder
}

/// Both files, the newer one first.
pub(crate) const FILES: &str = "j/rover.jsonl j/rover.1.jsonl";

#[test]
fn a_signed_journal_is_verified_over_its_files() {
    let folder = signed();
    let verify = |options: &str| format!("journal verify {FILES} {options}");
    let told = folder.ends(&verify("--key public.pem"), 0).stdout;
    assert!(told.contains("files 1 to 2") && told.contains("all of it is signed"), "{told}");
    folder.ends(&verify(""), 0);
    folder.ends(&verify("--key other.pem --key public.pem"), 0);
    let told = folder.ends(&verify("--key other.pem"), 1).stdout;
    assert!(told.starts_with("j/rover.1.jsonl:") && told.contains("of no given key"), "{told}");
    folder.refuses(&verify("--key key.pem"), &["holds no public Ed25519 key", "-pubout"]);
    folder.refuses("journal verify none.jsonl", &["cannot open none.jsonl"]);
}

#[test]
fn what_was_changed_or_cut_off_has_its_place() {
    let folder = signed();
    let (older, newer) = (folder.read("j/rover.1.jsonl"), folder.read("j/rover.jsonl"));
    let third: usize = older.split_inclusive('\n').take(2).map(str::len).sum();
    let mut bytes = older.clone().into_bytes();
    bytes[third + 9] ^= 1;
    folder.write("j/rover.1.jsonl", bytes);
    let found = folder.json(&format!("journal verify {FILES}"), 1);
    assert_eq!((&found["ok"], &found["records"]), (&false.into(), &2.into()), "{found}");
    assert_eq!(found["finding"]["file"], "j/rover.1.jsonl");
    assert_eq!((&found["finding"]["line"], &found["finding"]["offset"]), (&3.into(), &third.into()));
    folder.write("j/rover.1.jsonl", &older);
    // The end of the signature is lost in a power cut, and then all of it on purpose.
    folder.write("j/rover.jsonl", &newer[..newer.len() - 20]);
    let found = folder.json(&format!("journal verify {FILES} --key public.pem"), 3);
    let lines = newer.lines().count();
    assert_eq!((&found["cut_off"][0]["line"], &found["finding"]), (&lines.into(), &().into()), "{found}");
    let whole = newer.split_inclusive('\n').take(lines - 1).collect::<String>();
    folder.write("j/rover.jsonl", &whole);
    folder.ends(&format!("journal verify {FILES}"), 0);
    let told = folder.ends(&format!("journal verify {FILES} --key public.pem"), 3).stdout;
    assert!(told.contains(&format!("the last {} of them are not signed", lines - 1)), "{told}");
}

#[test]
fn a_journal_without_seals_is_not_verified() {
    let folder = Folder::new();
    let ended = folder.run("run --http off --for 1s --journal j");
    assert!(ended.status <= 1, "{}", ended.stderr);
    let told = folder.ends("journal verify j/rover.jsonl", 1).stdout;
    assert!(
        told.starts_with("j/rover.jsonl:1, byte 0: no sealed record") && told.contains("--journal-seal"),
        "{told}"
    );
    folder.refuses("run --journal-seal", &["--journal"]);
}
