//! Which files form one recording, and which form two.

use super::bag_writer::{Packing, TWIST, bag, chunk, connection, message, twist};
use super::*;

/// Rows of these columns, one a second.
fn rows(columns: &str, seconds: impl IntoIterator<Item = i64>) -> String {
    let count = columns.split(',').count();
    let row = |second: i64| format!("{second}{}\n", format!(",{second}").repeat(count));
    format!("t [s],{columns}\n{}", seconds.into_iter().map(row).collect::<String>())
}

/// Checks each session: its files, its start and end in seconds, the number of its samples, and why it is separate.
#[track_caller]
fn check(files: &[(&str, String)], paths: &[&str], sources: &[&str], expected: &[&str]) {
    let folder = Folder::new();
    for (name, text) in files {
        let path = folder.0.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    let paths: Vec<PathBuf> = paths.iter().map(|path| folder.0.join(path)).collect();
    let recording = read(&paths, &wanted(sources), &ReadOptions::default()).unwrap();
    compare_with_stream(&Ok(recording.clone()), &paths, &wanted(sources), &ReadOptions::default());
    assert_eq!(recording.by_session().map(|(_, own)| own.len()).sum::<usize>(), recording.samples.len());
    let shown = |(session, own): (&Session, &[Sample])| {
        assert!(own.is_sorted_by_key(|sample| sample.received));
        let name = |path: &PathBuf| path.strip_prefix(&folder.0).unwrap().display().to_string();
        let names: Vec<String> = session.files.iter().map(name).collect();
        let because = session.because.as_ref().map_or(String::new(), |because| format!(" ({because})"));
        let because = because.replace(&format!("{}/", folder.0.display()), "");
        let (from, to) = (session.span.0.seconds(), session.span.1.seconds());
        format!("{} {from}..{to} {}{because}", names.join("+"), own.len())
    };
    let sessions: Vec<String> = recording.by_session().map(shown).collect();
    assert_eq!(sessions, expected);
    let count = recording.warnings.iter().filter(|it| it.message.contains("a session of its own")).count();
    assert_eq!(count, sessions.len() - 1, "{:?}", recording.warnings);
}

#[test]
fn recordings_of_one_time_are_sessions() {
    let day = || rows("a,b", 0..100);
    let files = [("1/r.csv", day()), ("2/r.csv", day()), ("3/r.csv", rows("a,b", 50..70))];
    let second = "2/r.csv 0..99 200 (it overlaps in time with 1/r.csv, and both have r#a)";
    check(&files, &["1", "2"], &["r#a", "r#b"], &["1/r.csv 0..99 200", second]);
    let third = "3/r.csv 50..69 40 (it overlaps in time with 2/r.csv, and both have r#a)";
    check(&files, &["1/r.csv", "2", "3"], &["r#a", "r#b"], &["1/r.csv 0..99 200", second, third]);
    // The same file twice.
    let again = "1/r.csv 0..99 200 (it overlaps in time with 1/r.csv, and both have r#a)";
    check(&files, &["1", "1/r.csv"], &["r#a", "r#b"], &["1/r.csv 0..99 200", again]);
    // Two files that overlap by one second.
    let files = [("x/r.csv", rows("a", 0..=100)), ("y/r.csv", rows("a", 99..200))];
    let next = "y/r.csv 99..199 101 (it overlaps in time with x/r.csv, and both have r#a)";
    check(&files, &["x", "y"], &["r#a"], &["x/r.csv 0..100 101", next]);
}

#[test]
fn files_of_different_signals_are_of_one_recording() {
    let files = [("d/a.csv", rows("a", 0..100)), ("d/b.csv", rows("b", (5..95).step_by(5)))];
    check(&files, &["d"], &["a", "b"], &["d/a.csv+d/b.csv 0..99 118"]);
    check(&files, &["d/b.csv", "d/a.csv"], &["a", "b"], &["d/b.csv+d/a.csv 0..99 118"]);
    // One file is silent for hours, while the other goes on: no clock was set.
    let silent = rows("a", (0..100).chain(20_000..20_100));
    let files = [("d/a.csv", silent), ("d/b.csv", rows("b", 0..20_100))];
    check(&files, &["d"], &["a", "b"], &["d/a.csv+d/b.csv 0..20099 20300"]);
}

/// Checks the statement about the files that form one recording.
#[track_caller]
fn check_joined(files: &[(&str, String)], sources: &[&str], expected: &[&str]) {
    let folder = Folder::new();
    files.iter().for_each(|(name, text)| fs::write(folder.0.join(name), text).unwrap());
    let recording = read(std::slice::from_ref(&folder.0), &wanted(sources), &ReadOptions::default()).unwrap();
    let joined: Vec<String> =
        recording.joined.iter().map(|it| it.replace(&format!("{}/", folder.0.display()), "")).collect();
    assert_eq!(joined, expected);
}

#[test]
fn which_files_are_one_recording_is_said() {
    let [first, second, third] = [0..100, 100..200, 200..300].map(|seconds| rows("a", seconds));
    let beside = || rows("b", 0..300);
    let later = rows("a", 900..910);
    check_joined(
        &[("r_0.csv", first.clone()), ("r_1.csv", second.clone()), ("r_2.csv", third)],
        &["a"],
        &["3 files (r_0.csv .. r_2.csv) are one recording: each goes on where another one ends"],
    );
    check_joined(
        &[("a.csv", first.clone()), ("b.csv", beside())],
        &["a", "b"],
        &[
            "2 files (a.csv and b.csv) are one recording: they are of one time, and no signal is in two of them",
        ],
    );
    check_joined(
        &[("a_0.csv", first.clone()), ("a_1.csv", second), ("b.csv", beside()), ("c.csv", later.clone())],
        &["a", "b"],
        &[
            "3 files (a_0.csv .. b.csv) are one recording: each goes on where another one ends, or has other signals of the same time",
        ],
    );
    check_joined(&[("a.csv", first), ("c.csv", later)], &["a"], &[]);
}

#[test]
fn each_file_goes_to_the_recording_of_its_folder() {
    let day = |day: &str| {
        [(format!("{day}/a.csv"), rows("a", 0..100)), (format!("{day}/b.csv"), rows("b", 0..100))]
    };
    let files: Vec<(String, String)> = ["1", "2"].into_iter().flat_map(day).collect();
    let files: Vec<(&str, String)> = files.iter().map(|(name, text)| (name.as_str(), text.clone())).collect();
    let second = "2/a.csv+2/b.csv 0..99 200 (it overlaps in time with 1/a.csv, and both have a)";
    let expected = ["1/a.csv+1/b.csv 0..99 200", second];
    check(&files, &["1", "2"], &["a", "b"], &expected);
    check(&files, &["1/a.csv", "2/a.csv", "1/b.csv", "2/b.csv"], &["a", "b"], &expected);
}

#[test]
fn parts_that_follow_at_once_are_one_recording_and_others_are_not() {
    let part = |from: i64, to: i64| rows("a", from..to);
    let files = [("r.csv", part(0, 60)), ("s/r.csv", part(60, 90)), ("t/r.csv", part(200, 220))];
    check(&files, &["r.csv", "s"], &["r#a"], &["r.csv+s/r.csv 0..89 90"]);
    check(&files, &["s", "r.csv"], &["r#a"], &["s/r.csv+r.csv 0..89 90"]);
    let later = "t/r.csv 200..219 20 (it begins 111.000 s after the end of the recording before)";
    check(&files, &["r.csv", "s", "t"], &["r#a"], &["r.csv+s/r.csv 0..89 90", later]);
}

#[test]
fn a_clock_that_is_set_begins_a_session_in_all_files() {
    let epoch = 1_760_000_000;
    let times = || (0..12).chain(epoch..epoch + 40);
    let set = "its clock was set forward by 20370.4 d";
    let alone = ["r.csv 0..11 12".to_owned(), format!("r.csv {epoch}..{} 40 ({set})", epoch + 39)];
    let alone: Vec<&str> = alone.iter().map(String::as_str).collect();
    check(&[("r.csv", rows("a", times()))], &["r.csv"], &["r#a"], &alone);
    let files = [("d/a.csv", rows("a", times())), ("d/b.csv", rows("b", times()))];
    let both = format!("d/a.csv+d/b.csv {epoch}..{} 80 ({set})", epoch + 39);
    check(&files, &["d"], &["a", "b"], &["d/a.csv+d/b.csv 0..11 24", &both]);
    let back = "r.csv 3600..7199 3600 (its clock was set back by 60.0 min)";
    let times = (0..7_200).chain(3_600..7_200);
    check(&[("r.csv", rows("a", times))], &["r.csv"], &["r#a"], &["r.csv 0..7199 7200", back]);
}

#[test]
fn bags_of_one_drive_are_one_session_and_a_bag_twice_is_two() {
    let part = |from: u32, to: u32| {
        let odom = connection(0, "/odom", "test/Twist", TWIST);
        let messages: Vec<u8> =
            (from..to).flat_map(|at| message(0, 100 * at, &twist(100 * at, 1.0, &[]))).collect();
        bag(&[chunk(Packing::None, &[odom.clone(), messages].concat())], &[odom])
    };
    let folder = Folder::with(&[("0.bag", &part(0, 50)), ("1.bag", &part(50, 100))]);
    let count = |paths: &[PathBuf]| {
        let recording = read(paths, &wanted(&["odom#linear.x"]), &ReadOptions::default()).unwrap();
        let counts: Vec<usize> = recording.by_session().map(|(_, own)| own.len()).collect();
        counts
    };
    assert_eq!(count(std::slice::from_ref(&folder.0)), [100]);
    let first = folder.0.join("0.bag");
    assert_eq!(count(&[first.clone(), first]), [50, 50]);
}

#[test]
fn what_is_left_out_parts_a_recording() {
    let folder = Folder::with(&[("r.csv", rows("a", 0..100).as_bytes())]);
    let paths = [folder.0.join("r.csv")];
    let check = |cuts: &Cuts, expected: &[(f64, f64)]| {
        let mut recording = read(&paths, &wanted(&["r#a"]), &ReadOptions::default()).unwrap();
        let beyond = recording.cut(cuts);
        let span = |session: &Session| (session.span.0.seconds(), session.span.1.seconds());
        assert_eq!(recording.sessions.iter().map(span).collect::<Vec<_>>(), expected);
        assert!(recording.sessions.iter().all(|session| session.origin == Time(0)));
        beyond.len()
    };
    let skip = |texts: &[&str]| texts.iter().map(|text| text.parse().unwrap()).collect();
    assert_eq!(check(&Cuts::default(), &[(0.0, 99.0)]), 0);
    let cuts = Cuts { skip: skip(&["20s..30s", "50s..60s", "500s.."]), ..Cuts::default() };
    assert_eq!(check(&cuts, &[(0.0, 19.0), (30.0, 49.0), (60.0, 99.0)]), 1);
    let second = |it: i64| Some(Span::from_millis(1_000 * it));
    let cuts = Cuts { from: second(25), until: second(55), skip: skip(&["20s..30s"]) };
    assert_eq!(check(&cuts, &[(30.0, 54.0)]), 0);
}
