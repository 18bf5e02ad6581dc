//! Moments as people write them, and what is none.

use super::*;
use proptest::prelude::*;

#[track_caller]
fn check(text: &str, order: DateOrder, expected: Option<(i64, bool)>) {
    let found = moment(text, order, &Zone::default());
    assert_eq!(found.map(|it| (it.time.0, it.has_zone)), expected, "{text}");
}

/// 2018-04-08 10:31:37 UTC.
const THEN: i64 = 1_523_183_497 * SECOND;

#[test]
fn moments_are_written_in_many_ways() {
    use DateOrder::{DayMonthYear, MonthDayYear, YearMonthDay};
    check("2018-04-08T10:31:37Z", YearMonthDay, Some((THEN, true)));
    check("2018-04-08 10:31:37.097", YearMonthDay, Some((THEN + 97_000_000, false)));
    check("2018-04-08 12:31:37+02:00", YearMonthDay, Some((THEN, true)));
    check("2018-04-08 12:31:37 +0200", YearMonthDay, Some((THEN, true)));
    check("2018-04-08T05:01:37-05:30", YearMonthDay, Some((THEN, true)));
    check("2018/4/8 10:31:37", YearMonthDay, Some((THEN, false)));
    check("20180408 10:31:37,5 UTC", YearMonthDay, Some((THEN + 500_000_000, true)));
    check("20180408T103137Z", YearMonthDay, Some((THEN, true)));
    check("20180408T123137.5+0200", YearMonthDay, Some((THEN + 500_000_000, true)));
    check("20180408T1031", YearMonthDay, Some((THEN - 37 * SECOND, false)));
    check("20180408103137", YearMonthDay, Some((THEN, false)));
    check("20180408103137.25", YearMonthDay, Some((THEN + 250_000_000, false)));
    check("08/04/2018 10.31.37", DayMonthYear, Some((THEN, false)));
    check("8.4.18 10:31:37", DayMonthYear, Some((THEN, false)));
    check("04/08/2018 10:31:37 AM", MonthDayYear, Some((THEN, false)));
    check("4/8/2018 12:00:00 pm", MonthDayYear, Some((THEN + 5_303 * SECOND, false)));
    check("08-Apr-2018 10:31:37", DayMonthYear, Some((THEN, false)));
    check("8.april.2018 10:31:37", DayMonthYear, Some((THEN, false)));
    check("2018-Apr-08T10:31:37Z", YearMonthDay, Some((THEN, true)));
    check("08-Oct-2018 10:31:37", DayMonthYear, Some((THEN + 183 * 24 * HOUR, false)));
    check("2018-04-08", YearMonthDay, Some((THEN - 37_897 * SECOND, false)));
    check("2018-04", YearMonthDay, Some((THEN - 37_897 * SECOND - 7 * 24 * HOUR, false)));
    check("2018/4", YearMonthDay, Some((THEN - 37_897 * SECOND - 7 * 24 * HOUR, false)));
    check("2018-04-07 24:00", YearMonthDay, Some((THEN - 37_897 * SECOND, false)));
    let zone: Zone = "+02:00".parse().unwrap();
    let of_place = moment("2018-04-08 12:31:37", YearMonthDay, &zone).unwrap();
    assert_eq!((of_place.time.0, of_place.has_zone), (THEN, false));
    let apart = moment_of("08/04/2018", "10.31.37", DayMonthYear, &Zone::default()).unwrap();
    assert_eq!(apart.time.0, THEN);
}

#[test]
fn what_is_no_moment_is_none() {
    for wrong in [
        "",
        "5",
        "1.5",
        "2018",
        "2018.04",
        "2018-13",
        "18-04",
        "2018-02-30",
        "2018-13-01 10:00",
        "2018-04-08 25:00",
        "2018-04-08 10:60",
        "2018-04-08 10",
        "2018-04-08 10:31:37+2",
        "2018-04-08 13:00 PM",
        "10:31:37",
        "2018-04-08x10:31",
        "é",
    ] {
        check(wrong, DateOrder::YearMonthDay, None);
    }
    check("31/02/2018", DateOrder::DayMonthYear, None);
    assert!(is_date("2018-04-08") && is_date("13/04/2018") && !is_date("1.5") && !is_date("10:31"));
    assert!(is_compact("20180408103137") && is_compact("20180408103137.5"));
    assert!(!is_compact("20181308103137") && !is_compact("1523183497") && !is_compact("15231834970000"));
    assert!(is_time_of_day("10:31") && is_time_of_day("18.00.00") && !is_time_of_day("18.5"));
}

proptest! {
    #[test]
    fn the_usual_form_is_read_as_any(
        text in "[0-2][0-9]{3}-[01][0-9]-[0-3][0-9][ T][0-2][0-9]:[0-6][0-9]:[0-6][0-9]([.][0-9]{0,11})?(Z|[+-][0-2][0-9]:[0-6][0-9])?",
    ) {
        let (order, zone) = (DateOrder::YearMonthDay, Zone::default());
        if let Some(found) = usual(&text, &zone) {
            prop_assert_eq!(Some(found), written(&text, order, &zone));
        }
    }

    #[test]
    fn any_text_is_survived(garbage in "\\PC{0,40}") {
        for order in DateOrder::ALL {
            let _moment = moment(&garbage, order, &Zone::default());
            let _moment = moment_of(&garbage, &garbage, order, &Zone::default());
        }
    }
}
