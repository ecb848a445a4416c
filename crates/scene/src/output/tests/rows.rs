//! Unit tests of `rows.rs`.

use super::*;

fn written(cells: impl FnOnce(&mut RowWriter<Vec<u8>>)) -> String {
    let mut rows = RowWriter::after(Vec::new());
    cells(&mut rows);
    rows.end_row().unwrap();
    String::from_utf8(rows.finish().unwrap()).unwrap()
}

/// The csv crate's writer, with another algorithm for the digits, writes the same bytes.
#[test]
fn cells_equal_those_of_the_csv_crate() {
    let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = || {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        seed
    };
    let edges = [
        0.0,
        -0.0,
        1.0,
        -2.5,
        1e-5,
        1e-4,
        1e15,
        1e16,
        1e17,
        1e21,
        1e22,
        1e23,
        0.1,
        5e-324,
        f64::MAX,
        f64::MIN_POSITIVE,
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ];
    let mut numbers = edges.to_vec();
    for _ in 0..100_000 {
        numbers.push(f64::from_bits(next()));
        numbers.push((next() >> 11) as f64 / 9007199254740992.0 - 0.5);
        numbers.push((next() % 1_000_000) as f64 / 1000.0);
    }
    let texts = ["", "free", "a,b", "a \"word\"", "two\nlines", "cr\r", "schön"];
    let ours = written(|rows| {
        rows.numbers(&numbers);
        texts.iter().for_each(|text| rows.text(text));
        [0, 1, 10, u64::MAX].into_iter().for_each(|whole| rows.whole(whole));
        rows.word(&"4.0.1.A3.0");
    });
    let mut theirs = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    theirs.serialize((numbers, texts, [0, 1, 10, u64::MAX], "4.0.1.A3.0")).unwrap();
    assert!(ours.as_bytes() == theirs.into_inner().unwrap());
}

#[test]
fn every_tenth_step_and_the_last_state_have_rows() {
    let kept = RowChoice::new(10, 7);
    let has = |index| kept.has(index, StepStatus::Free);
    assert!((7..60).all(|index| has(index) == (index % 10 == 7)));
    assert!(kept.has(8, StepStatus::End));
    assert!((0..20).all(|index| RowChoice::ALL.has(index, StepStatus::Free)));
}
