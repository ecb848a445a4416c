//! `tumble verify` on changed trajectories.

use super::support::{Table, contact_run};
use super::verify::{changed, verify, with_text};

/// Step and contact with the largest normal force.
fn a_contact_step() -> (usize, usize) {
    let table = Table::parse(&contact_run().0);
    let forces: Vec<_> = (0..8).map(|contact| table.numbers(&format!("fz{contact}_N"))).collect();
    let all = (0..table.rows.len()).flat_map(|k| (0..8).map(move |contact| (k, contact)));
    all.max_by(|a, b| forces[a.1][a.0].total_cmp(&forces[b.1][b.0])).unwrap()
}

/// Text of a number with its second significant digit changed by one.
fn second_digit_off(field: &str) -> String {
    let mut seen = 0;
    let off = |digit: char| if digit == '9' { '8' } else { (digit as u8 + 1) as char };
    let changed: String = field
        .chars()
        .map(|c| {
            seen += usize::from(c.is_ascii_digit() && (seen > 0 || c != '0'));
            if seen == 2 && c.is_ascii_digit() {
                seen = 3;
                off(c)
            } else {
                c
            }
        })
        .collect();
    assert_ne!(changed, field);
    changed
}

/// `verify` finds a changed digit of a force, a state or a residual. The change must exceed the
/// step's own residual, because the certificate is the largest of five residuals. The second
/// significant digit suffices.
#[test]
fn one_digit_of_a_force_or_state_that_is_changed_is_found_and_named() {
    let (k, contact) = a_contact_step();
    let force = |axis: &str| format!("f{axis}{contact}_N");
    for name in [
        force("x"),
        force("z"),
        "vy_m_s".to_owned(),
        "vz_m_s".to_owned(),
        "wy_rad_s".to_owned(),
        "y_m".to_owned(),
        "z_m".to_owned(),
        "qw".to_owned(),
        "qz".to_owned(),
        "certificate_m_s".to_owned(),
    ] {
        let directory = changed(|table| {
            let column = table.column(&name);
            table.rows[k][column] = second_digit_off(&table.rows[k][column]);
        });
        let end = verify(directory.path(), &[]);
        assert_eq!((end.code, end.stderr.as_str()), (Some(1), ""), "{name}: {end:?}");
        // A state belongs to two steps, as final and as initial state.
        let state = !name.starts_with(['f', 'c']);
        let steps = if state { 2 } else { 1 };
        assert!(
            end.stdout.contains(&format!("steps that differ from their rows: {steps}\n")),
            "{name}: {end:?}"
        );
        let named = |k: usize| end.stdout.contains(&format!("k = {k:<7} "));
        assert!(named(k) && (!state || named(k - 1)), "{name}: {end:?}");
    }
}

#[test]
fn a_changed_free_flight_row_is_found() {
    let directory = changed(|table| {
        let column = table.column("vz_m_s");
        table.rows[100][column] = second_digit_off(&table.rows[100][column]);
    });
    let end = verify(directory.path(), &[]);
    assert_eq!(end.code, Some(1), "{end:?}");
    assert!(end.stdout.contains("k = 99 ") && end.stdout.contains("k = 100 "), "{end:?}");
}

#[test]
fn numbers_that_overflow_the_certificate_are_a_mismatch_and_no_crash() {
    for value in ["1e308", "-1e308", "1e200"] {
        for name in ["z_m", "vx_m_s", "qw", "wx_rad_s", "fx0_N", "certificate_m_s"] {
            let directory = changed(|table| {
                let column = table.column(name);
                table.rows[230][column] = value.to_owned();
            });
            let end = verify(directory.path(), &[]);
            assert_eq!((end.code, end.stderr.as_str()), (Some(1), ""), "{name} {value}");
            assert!(end.stdout.contains("k = 230"), "{name} {value}: {end:?}");
        }
    }
}

#[test]
fn a_file_that_is_cut_off_is_refused() {
    let csv = &contact_run().0;
    let end_row = csv.trim_end().rfind('\n').unwrap();
    for length in [csv.len() - 4, end_row + 1, end_row, end_row - 40, csv.len() / 2, 3000, 5] {
        let directory = with_text(&csv.as_bytes()[..length]);
        verify(directory.path(), &[]).assert_refused(2, &["trajectory.csv"]);
    }
}

#[test]
fn rows_out_of_order_doubled_or_missing_are_refused_with_their_line() {
    type Change = fn(&mut Table);
    let table: [(Change, &[&str]); 6] = [
        (|table| table.rows.swap(10, 11), &["line 12", "k is 11; expected 10"]),
        (|table| table.rows.insert(5, table.rows[5].clone()), &["line 8", "k is 5; expected 6"]),
        (|table| drop(table.rows.remove(7)), &["line 9", "k is 8; expected 7"]),
        (|table| drop(table.rows.remove(0)), &["line 2", "k is 1; expected 0"]),
        (|table| table.rows.push(table.rows[239].clone()), &["after", "`end`"]),
        (|table| table.rows[100][71] = "end".to_owned(), &["after", "`end`"]),
    ];
    for (change, words) in table {
        verify(changed(change).path(), &[]).assert_refused(2, words);
    }
}

#[test]
fn columns_missing_renamed_swapped_or_added_are_refused_by_name() {
    type Change = fn(&mut Vec<String>, bool);
    let table: [(Change, &[&str]); 6] = [
        (|fields, _| drop(fields.remove(10)), &["vy_m_s", "column 11"]),
        (|fields, _| drop(fields.pop()), &["column"]),
        (|fields, _| fields.push("1".to_owned()), &["column 75"]),
        (|fields, _| fields.swap(2, 3), &["x_m", "y_m", "column 3"]),
        (
            |fields, header| {
                if header {
                    fields[5] = "q0".to_owned()
                }
            },
            &["q0", "qw"],
        ),
        (
            |fields, header| {
                if header {
                    fields[0].insert(0, ' ')
                }
            },
            &["column 1"],
        ),
    ];
    for (change, words) in table {
        let directory = changed(|table| {
            change(&mut table.header, true);
            table.rows.iter_mut().for_each(|row| change(row, false));
        });
        verify(directory.path(), &[]).assert_refused(2, words);
    }
}

#[test]
fn fields_that_cannot_be_read_are_refused_with_line_and_column() {
    for (name, text) in [
        ("x_m", "abc"),
        ("x_m", ""),
        ("x_m", "nan"),
        ("vz_m_s", "inf"),
        ("vz_m_s", "1e999"),
        ("wz_rad_s", "0x10"),
        ("fx3_N", "1.0.0"),
        ("s1_0", "--1"),
        ("lam7", " "),
        ("k", "-1"),
        ("k", "12.0"),
        ("k", "99999999999999999999"),
        ("t_s", "soon"),
        ("alpha0", "2"),
        ("alpha0", "true"),
        ("alpha0", "0.5"),
        ("status", "done"),
        ("status", "Converged"),
        ("status", ""),
        ("iterations", "-1"),
        ("iterations", "1.5"),
        ("iterations", "5000000000"),
        ("certificate_m_s", "NaN"),
    ] {
        let directory = changed(|table| {
            let column = table.column(name);
            table.rows[12][column] = text.to_owned();
        });
        verify(directory.path(), &[]).assert_refused(2, &["line 14", name]);
    }
}

#[test]
fn a_row_with_too_few_or_too_many_fields_is_refused() {
    type Change = fn(&mut Vec<String>);
    let changes: [Change; 2] = [|row| drop(row.pop()), |row| row.push("0".to_owned())];
    for change in changes {
        let directory = changed(|table| change(&mut table.rows[12]));
        verify(directory.path(), &[]).assert_refused(2, &["line: 14"]);
    }
}

#[test]
fn times_that_do_not_fit_the_time_step_are_refused() {
    let directory = changed(|table| table.rows[12][1] = "0.0241".to_owned());
    verify(directory.path(), &[]).assert_refused(2, &["row 12", "0.0241"]);
}
