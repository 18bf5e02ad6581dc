//! Tables of all kinds, intact and damaged.

use super::*;

#[track_caller]
fn check(text: &str, sources: &[&str], expected: &str) {
    let said = shown(&[("log.csv", text.as_bytes())], sources, &ReadOptions::default());
    assert_eq!(said, expected);
}

#[test]
fn words_for_truths_are_numbers() {
    let table = b"t [s],on\n1,true\n2,False\n3,TRUE\n4,1\n";
    let said = shown(&[("a.csv", table)], &["a#on"], &ReadOptions::default());
    assert_eq!(said, "0@1000=1\n0@2000=0\n0@3000=1\n0@4000=1");
}

#[test]
fn columns_by_name_and_times_by_header() {
    check("t [s],v [m/s],w\n0.5,1,2\n1.5,3,4\n", &["log#v", "log#w"], "0@500=1\n1@500=2\n0@1500=3\n1@1500=4");
    check("time(millisecond), xSpeed(m/s)\n100, -1.5\n", &["log#xSpeed"], "0@100=-1.5");
    check("\u{feff}time_us;v\r\n1500;2\r\n", &["log#v"], "0@1.5=2");
    check("v\ttime_ns\n7\t1000000\n", &["v"], "0@1=7");
    check("t [s],/wheel/1\n1,2\n", &["/wheel/1"], "0@1000=2");
    check("t [s],v\n1,2", &["log#v"], "0@1000=2");
    check("t [s],v\r1,2\r2,3\r", &["log#v"], "0@1000=2\n0@2000=3");
    check("t [s],v\n\n \n1,2\n", &["log#v"], "0@1000=2");
    check(
        "t [s],v\n",
        &["log#v"],
        "! log.csv: signal log#v: found in log.csv: v, but without a sample (0 without a value)",
    );
}

#[test]
fn rows_are_filtered_and_timed_by_the_source() {
    let motes = "reading,mote_id,temperature\n1,1,20\n2,1,21\n1,2,30\n2,2,31\n";
    check(
        motes,
        &["log#temperature[mote_id=1]@reading*5s", "log#temperature[mote_id=2.0]@reading*5s"],
        "0@5000=20\n1@5000=30\n0@10000=21\n1@10000=31",
    );
    check(motes, &["log#temperature[mote_id=2][reading=1]@row*100ms"], "0@200=30");
    check("s,v\n1,2\n", &["log#v@s*ms"], "0@1=2");
}

#[test]
fn the_command_line_can_say_the_time() {
    let options = ReadOptions {
        time_column: Some("reading".into()),
        time_scale: Some(Span(5_000_000_000)),
        ..ReadOptions::default()
    };
    let said =
        shown(&[("m.csv", b"reading,x\n1,2\n"), ("n.csv", b"t [s],y\n1,2\n")], &["m#x", "n#y"], &options);
    assert_eq!(said, "0@5000=2\n1@5000=2", "a scale that is said wins over the header's");
}

#[test]
fn the_clock_is_what_behaves_as_one() {
    let rows = |header: &str, row: &dyn Fn(i32) -> String| {
        format!("{header}\n{}", (0..40).map(|at| row(at) + "\n").collect::<String>())
    };
    // The time of the last of 40 rows tells which column the clock is.
    let check = |text: &str, last: &str| {
        let said = shown(&[("log.csv", text.as_bytes())], &["log#v"], &ReadOptions::default());
        let of_last = said.lines().rfind(|line| !line.starts_with('!')).unwrap_or_default().to_owned();
        assert_eq!(of_last, last, "{said}");
    };
    check(&rows("T,RH,time,v", &|at| format!("{},40,{at},1", 20 + at)), "0@39000=1");
    check(&rows("time,t,v", &|at| format!("{at},{},1", 2 * at)), "0@39000=1");
    check(&rows("t [degC],ts,v", &|at| format!("{},{at},1", 20 + at)), "0@39000=1");
    check(&rows("t,when,v", &|at| format!("{},1970-01-01 00:00:{at:02},1", 20 + at)), "0@39000=1");
    check(&rows("time,__time,v", &|at| format!("{},{at},1", 7 * at % 10)), "0@39000=1");
    check(&rows("time,ts,v", &|at| format!("0,{at},1")), "0@39000=1");
    check(&rows("time,ts,v", &|at| format!("late,{at},1")), "0@39000=1");
    // Rows of several sources, and no other clock.
    check(&rows("time,v", &|at| format!("{},1", at % 8)), "0@7000=1");
}

#[test]
fn times_of_day_count_from_the_first_day_and_go_on_behind_midnight() {
    let said = shown(
        &[("log.csv", b"time,v\n23:59:59,1\n00:00:01.5,2\n23:59:59,3\n00:00:02,4\n")],
        &["log#v"],
        &ReadOptions::default(),
    );
    let times: Vec<&str> = said.lines().filter(|line| !line.starts_with('!')).collect();
    assert_eq!(times, ["0@86399000=1", "0@86399000=3", "0@86401500=2", "0@86402000=4"], "{said}");
    assert!(said.contains("times of day without a date: they count from 1970-01-01"), "{said}");
}

#[test]
fn one_file_tells_the_order_of_the_dates_of_all() {
    let (clear, open) = (b"time,a\n1/25/1970 0:00,1\n1/26/1970 0:00,2\n", b"time,b\n1/2/1970 0:00,1\n");
    let files: [(&str, &[u8]); 2] = [("1.csv", clear), ("2.csv", open)];
    let told = |options: &ReadOptions, files: &[(&str, &[u8])]| {
        let said = shown(files, &["2#b"], options);
        said.lines().next().unwrap_or_default().to_owned()
    };
    let default = ReadOptions::default();
    assert_eq!(told(&default, &files), "0@86400000=1", "the second of January");
    assert_eq!(told(&default, &files[1..]), format!("0@{}=1", 31 * 86_400_000_i64), "the first of February");
    let given = ReadOptions { date_order: Some("mdy".parse().unwrap()), ..ReadOptions::default() };
    assert_eq!(told(&given, &files[1..]), "0@86400000=1");
}

#[test]
fn dates_are_times_whatever_their_column_is_called() {
    let forms: [fn(u32) -> String; 4] = [
        |day| format!("1970-01-{day:02}"),
        |day| format!("{day}.1.1970"),
        |day| format!("1/{day}/70"),
        |day| format!("{day:02}-Jan-1970"),
    ];
    for form in forms {
        for name in ["Date", "Order day", "DATE", "x"] {
            for is_first in [true, false] {
                let row = |day: u32| match is_first {
                    true => format!("{},{}.5\n", form(day), day % 7),
                    false => format!("{}.5,{}\n", day % 7, form(day)),
                };
                let header = if is_first { format!("{name},v\n") } else { format!("v,{name}\n") };
                let log = header + &(11..30).map(row).collect::<String>();
                let said = shown(&[("log.csv", log.as_bytes())], &["log#v"], &ReadOptions::default());
                let last = format!("0@{}=1.5", 28 * 86_400_000_i64);
                assert!(said.lines().any(|line| line == last), "{log}{said}");
            }
        }
    }
}

#[test]
fn dates_and_times_of_digits_alone_are_no_seconds() {
    let log = b"time,v\n20180408103137,1\n20180408103138.5,2\n";
    let said = shown(&[("log.csv", log)], &["log#v"], &ReadOptions::default());
    let note = "! log.csv: its times name no zone and are taken for UTC; --time-zone says another";
    assert_eq!(said, format!("0@1523183497000=1\n0@1523183498500=2\n{note}"));
    let microseconds = b"time [us],v\n20180408103137,1\n";
    let said = shown(&[("log.csv", microseconds)], &["log#v"], &ReadOptions::default());
    assert_eq!(said, "0@20180408103.137=1", "a unit in the header");
}

#[test]
fn an_hour_that_a_clock_shows_twice_is_told_apart_by_the_order_of_rows() {
    let options = ReadOptions { zone: "Europe/Vienna".parse().unwrap(), ..ReadOptions::default() };
    let at = |minutes: i64| format!("0@{}=1", (1_540_684_800 + 60 * minutes) * 1_000);
    // 02:30 in summer time is 00:30 UTC; 02:10 after that is in winter time, 01:10 UTC.
    let autumn = "time,v\n2018-10-28 02:00,1\n2018-10-28 02:30,1\n2018-10-28 02:10,1\n2018-10-28 03:00,1\n";
    let said = shown(&[("log.csv", autumn.as_bytes())], &["log#v"], &options);
    let note = "! log.csv: 3 rows were written in an hour that the clock showed twice, as it was put back; \
                they are taken for the first, and for the second once they go back";
    assert_eq!(said, [at(0), at(30), at(70), at(120), note.to_owned()].join("\n"));
    let spring = "time,v\n2018-03-25 02:30,1\n";
    let said = shown(&[("log.csv", spring.as_bytes())], &["log#v"], &options);
    assert_eq!(
        said,
        "0@1521941400000=1\n! log.csv: 1 rows have times that the clock never showed, as it was put forward; they are taken as before that"
    );
}

#[test]
fn what_is_to_be_converted_says_how() {
    let said = shown(&[("log.mdf", b"MDF     3.30    TGT 15.0")], &["v"], &ReadOptions::default());
    assert_eq!(
        said,
        "error: log.mdf: MDF 3 and before is not read here: convert it to MDF 4 with Python's asammdf: \
         MDF('old.mdf').convert('4.10').save('new.mf4')"
    );
}

#[test]
fn only_changes_when_asked() {
    check(
        "t [s],v,u\n1,5,1\n2,5,1\n3,,1\n4,5,1\n5,6,1\n6,NaN,1\n7,NaN,1\n8,6,1\n",
        &["log#v!changed"],
        "0@1000=5\n0@5000=6\n0@6000=NaN\n0@8000=6\n\
         ! log.csv: column 'v': 1 cells are empty and 0 are no numbers; taken as missing",
    );
}

#[test]
fn cells_may_be_quoted() {
    check("t [s],\"v, fast\",note\n1,\"2\",\"a \"\"b\"\", c\"\n", &["log#v, fast"], "0@1000=2");
    check("t [s],note,v\n1,\"two\nlines\",2\n3,x,4\n", &["log#v"], "0@1000=2\n0@3000=4");
    check(
        "t [s],note,v\n1,\"never closed,2\n3,x,4\n5,\"y\",6\n",
        &["log#v"],
        "0@3000=4\n0@5000=6\n! log.csv:2: the row has not 3 cells as the header; row left out\ndegraded",
    );
}

#[test]
fn numbers_that_are_none_are_delivered_or_missing() {
    check(
        "t [s],v\n1,nan\n2,inf\n3,-Infinity\n4,\n5,low\n6,1e400\n",
        &["log#v"],
        "0@1000=NaN\n0@2000=inf\n0@3000=-inf\n0@6000=inf\n\
         ! log.csv: column 'v': 1 cells are empty and 1 are no numbers (the first: 'low'); taken as missing",
    );
}

#[test]
fn rows_without_a_time_are_listed_without_one() {
    let folder =
        Folder::with(&[("log.csv", b"time,v\n,1\n2024-05-01T12:00:00Z,2\n,3\n2024-05-01T12:00:01Z,4\n")]);
    let topic = topics(&folder.0.join("log.csv")).remove(0);
    let span = topic.span.map(|(from, to)| to - from);
    let second = Span::from_millis(1_000);
    assert_eq!(
        (topic.count, span, topic.rate_hz, topic.longest_gap),
        (4, Some(second), Some(1.0), Some(second))
    );
}

#[test]
fn damaged_rows_are_left_out() {
    check(
        "t [s],v\n1,10\n2\n3,30,9\n4,40,\nx,50\n,60\n7,70\n",
        &["log#v"],
        "0@1000=10\n0@4000=40\n0@7000=70\n\
         ! log.csv:3: the row has not 2 cells as the header; row left out\n\
         ! log.csv:4: the row has not 2 cells as the header; row left out\n\
         ! log.csv:6: 'x' is no time; row left out\n\
         ! log.csv:7: '' is no time; row left out\n\
         ! log.csv: 4 places in all are damaged\ndegraded",
    );
    check(
        "t [s],v\n1,10\n2",
        &["log#v"],
        "0@1000=10\n! log.csv:3: the file ends within this row; row left out\ndegraded",
    );
    check(
        "",
        &["log#v"],
        "! log.csv: the file is empty\n\
         ! log.csv: signal log#v: no 'log' in the recording\ndegraded",
    );
    let binary = b"t [s],v\n1,\xff\xfe\n2,3\n";
    let said = shown(&[("log.csv", binary)], &["log#v"], &ReadOptions::default());
    assert!(
        said.starts_with("0@2000=3\n! log.csv: column 'v': 0 cells are empty and 1 are no numbers"),
        "{said}"
    );
}

#[test]
fn lines_and_tables_are_bounded() {
    let wide: String = (0..20_000).map(|column| format!("c{column},")).collect();
    let said = shown(&[("log.csv", wide.as_bytes())], &["log#c1"], &ReadOptions::default());
    assert!(said.contains("a table of more than 16384 columns cannot be read"), "{said}");
    let long = ["t [s],v\n1,10\n", &"x".repeat(17 << 20), "\n3,30\n"].concat();
    let said = shown(&[("log.csv", long.as_bytes())], &["log#v"], &ReadOptions::default());
    assert!(
        said.starts_with("0@1000=10\n0@3000=30\n! log.csv:3: the line is longer than 16 MiB; line left out"),
        "{said}"
    );
}

#[test]
fn times_may_be_huge_backward_and_equal() {
    check(
        "time_ns,v\n9223372036854775807,1\n-9223372036854775807,2\n9223372036854775808,3\n0,4\n0,5\n",
        &["log#v"],
        "0@-9223372036854.775=2\n0@0=4\n0@0=5\n0@9223372036854.775=1\n\
         ! log.csv:4: '9223372036854775808' is no time; row left out\n\
         ! log.csv: signal log#v: 1 time stamps are before the one ahead of them in the file\ndegraded",
    );
}

#[test]
fn a_time_without_unit_is_guessed_and_said() {
    check(
        "timestamp,v\n1533226488299,1\n",
        &["log#v"],
        "0@1533226488299=1\n! log.csv: column 'timestamp' names no unit of time; one step is taken as 0.001 s \
         (to say it: @timestamp*SPAN)",
    );
    check(
        "time,v\n2.5,1\n",
        &["log#v"],
        "0@2500=1\n! log.csv: column 'time' names no unit of time; one step is taken as 1 s (to say it: @time*SPAN)",
    );
}

#[test]
fn what_is_not_in_the_table_is_said() {
    check(
        "t [s],speed [m/s]\n1,2\n",
        &["log#sped", "lag#speed", "zzz"],
        "! log.csv: signal log#sped: no column 'sped'; did you mean 'speed [m/s]'? (there is: t [s], speed [m/s])\n\
         ! log.csv: signal lag#speed: no 'lag' in the recording; did you mean 'log'? \
         (there is: log, speed [m/s], t [s])\n\
         ! log.csv: signal zzz: no 'zzz' in the recording (there is: log, speed [m/s], t [s])",
    );
    check(
        "t [s],v [m/s],v [km/h]\n1,2,7.2\n",
        &["log#v"],
        "error: log.csv: signal log#v: 'v' fits several columns: v [m/s], v [km/h]; write one in full",
    );
    check(
        "reading,v\n1,2\n",
        &["log#v"],
        "error: log.csv: no column looks like the time; columns: reading, v; say which holds the time, with \
         --time-column NAME --time-unit 5s, or in the model as source: file#column@NAME*5s (@row*5s counts the rows)",
    );
    check(
        "t [s],v\n1,2\n",
        &["log#v@tt"],
        "error: log.csv: signal log#v@tt: no time column 'tt'; columns: t [s], v; say which holds the time, with \
         --time-column NAME --time-unit 5s, or in the model as source: file#column@NAME*5s (@row*5s counts the rows)",
    );
    check(
        "1,2\n3,4\n",
        &["log#v"],
        "error: log.csv: the first line holds numbers where the names of the columns \
         belong; add a line such as 't [s],speed [m/s]'",
    );
    check(
        "5.1,3.5,setosa\n4.9,3.0,setosa\n",
        &["log#setosa"],
        "error: log.csv: the first line holds numbers where the names of the columns \
         belong; add a line such as 't [s],speed [m/s]'",
    );
}

#[test]
fn a_lone_table_of_another_name_is_the_one_meant() {
    let said = shown(&[("copy-2.csv", b"t [s],v\n1,2\n")], &["wheel_speed#v"], &ReadOptions::default());
    assert_eq!(
        said,
        "0@1000=2\n! copy-2.csv: no source names this file; as it is the only one, it is read for all of them"
    );
}

#[test]
fn a_table_is_a_topic() {
    let folder = Folder::with(&[("log.csv", b"t [s],v\n1,2\n2,3\n3,4\n")]);
    let topics = topics(&folder.0.join("log.csv"));
    let [TopicInfo { name, kind, count: 3, rate_hz: Some(1.0), .. }] = &topics[..] else {
        panic!("{topics:?}")
    };
    assert_eq!((name.as_str(), kind.as_str()), ("log", "t [s], v"));
}

#[test]
fn lines_before_the_names_are_left_out() {
    let note = "! log.csv: the lines before the names are left out: ";
    check("sep=;\nt [s];a\n1;5\n", &["log#a"], &format!("0@1000=5\n{note}1"));
    let text =
        "Logger: ABC 123\nStart: 2024-01-01\n\nTime (s),Voltage (V),x\n0.0,12.1,1\n0.1,12.0,2\n0.2,12.2,3\n";
    check(text, &["log#Voltage"], &format!("0@0=12.1\n0@100=12\n0@200=12.2\n{note}2"));
}

#[test]
fn a_text_in_utf_16_is_read() {
    let text = "\u{feff}time [s]\ta [\u{b0}C]\n1\t5\n";
    let units: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert_eq!(shown(&[("log.csv", &units)], &["log#a"], &ReadOptions::default()), "0@1000=5");
}

#[test]
fn a_text_in_latin_1_is_read() {
    let table = b"t [s];T [\xb0C]\n1;2,5\n";
    let said = shown(&[("log.csv", table)], &["log#T [\u{b0}C]"], &ReadOptions::default());
    assert_eq!(said, "0@1000=2.5");
}

#[test]
fn columns_may_be_between_upright_lines() {
    check("t [s]|a|b\n1|2|3\n", &["log#b"], "0@1000=3");
}

#[test]
fn a_date_that_is_none_costs_only_its_row() {
    check(
        "time,v\n2024-02-30T00:00:00Z,1\n2024-03-01T00:00:00Z,2\n2024-03-01T00:00:01Z,3\n",
        &["log#v"],
        "0@1709251200000=2\n0@1709251201000=3\n\
         ! log.csv:2: '2024-02-30T00:00:00Z' is no time; row left out\ndegraded",
    );
}

#[test]
fn months_may_be_names() {
    let table = b"Time,v\n25-Mar-2024 13:05:00Z,1\n25-Oct-2024 13:05:00Z,2\n";
    let said = shown(&[("log.csv", table)], &["log#v"], &ReadOptions::default());
    assert_eq!(said, "0@1711371900000=1\n0@1729861500000=2");
}

#[test]
fn what_a_column_of_times_holds_instead_is_said() {
    check(
        "time,v\nsoon,1\nlater,2\n",
        &["log#v"],
        "error: log.csv: column 'time' holds neither numbers nor dates in a known form ('soon'); columns: time, v; \
         say which holds the time, with --time-column NAME --time-unit 5s, or in the model as source: \
         file#column@NAME*5s (@row*5s counts the rows)",
    );
}
