//! Reader of trajectories with random and edited input.

use super::each;
use super::rows::{Run, TIME_STEP, one_row, runs, world};
use crate::common::state;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use tumble::step_nlp::SMOOTHING;
use tumble::step_nlp::point::products;
use tumble_core::simulation::StepRecord;
use tumble_core::step::StepStatus;
use tumble_scene::output::RowsError;
use tumble_scene::output::trajectory::{TrajectoryReader, TrajectoryRow, TrajectoryWriter};

/// Reads all rows up to `end` and asserts that an error is one short line.
fn read(bytes: &[u8]) -> Result<Vec<TrajectoryRow>, RowsError> {
    let rows = read_rows(bytes);
    if let Err(error) = &rows {
        let text = error.to_string();
        assert!(!text.contains('\n') && text.len() < 300, "{text:?}");
    }
    rows
}

fn read_rows(bytes: &[u8]) -> Result<Vec<TrajectoryRow>, RowsError> {
    let mut reader = TrajectoryReader::new(bytes)?;
    let mut rows = Vec::new();
    while let Some(row) = reader.next_row()? {
        rows.push(row);
    }
    Ok(rows)
}

fn write(run: &Run) -> Vec<u8> {
    let mut writer = TrajectoryWriter::new(Vec::new(), &world(run.points)).unwrap();
    for record in &run.records {
        writer.write(record).unwrap();
    }
    writer.finish().unwrap()
}

fn bits<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> Vec<u64> {
    numbers.into_iter().map(|number| number.to_bits()).collect()
}

/// Columns of a step in a row: force, slacks and λ of each point, zero without contact. The
/// friction product may be written as zero if the step's slip is within 10⁻¹³ of the position. It
/// is then rounding.
fn step_columns(points: usize, record: &StepRecord, written: &[f64]) -> Vec<f64> {
    let mut columns = vec![0.0; 6 * points];
    let height = record.next().position[2];
    for (contact, found) in record.contacts.iter().zip(&record.solution.contacts) {
        let (force, slip) = (found.force, found.slip.norm());
        let products = products(&force, slip, height, contact.law.friction, SMOOTHING);
        let sticks = slip * TIME_STEP <= 1e-13 * (10.0 + height.abs());
        let is_zero = written[4 * points + contact.key.point] == 0.0;
        let friction = if sticks && is_zero { 0.0 } else { products.friction };
        let of_step = [products.normal, friction, products.slip_speed];
        for (block, value) in force.iter().chain(&of_step).enumerate() {
            columns[block * points + contact.key.point] = *value;
        }
    }
    columns
}

#[test]
fn what_is_written_is_read_back_bit_for_bit() {
    each(2000, runs(), |run| {
        let rows = read(&write(&run)).unwrap();
        prop_assert_eq!(rows.len(), run.records.len());
        for (row, record) in rows.iter().zip(&run.records) {
            let states = [&row.state, record.state()].map(|state| bits(&state.to_vector()));
            prop_assert_eq!(&states[0], &states[1]);
            prop_assert_eq!(bits(&row.step), bits(&step_columns(run.points, record, &row.step)));
            let contacts = record.solution.contacts.iter();
            let carrying = contacts.filter(|contact| contact.normal_force > 0.0);
            let mut flags = vec![false; run.points];
            carrying.for_each(|contact| flags[contact.key.point] = true);
            prop_assert_eq!(&row.carrying, &flags);
            let report = (row.index, row.status, row.iterations);
            let written = (record.index, record.report.status, record.report.iterations);
            prop_assert_eq!(report, written);
            let (residual, time) = (record.certificate.residual(), record.index as f64 * TIME_STEP);
            prop_assert_eq!(bits(&[row.residual, row.time]), bits(&[residual, time]));
        }
        Ok(())
    });
}

#[test]
#[ignore = "slow"]
fn no_arbitrary_bytes_are_a_trajectory() {
    each(10_000, vec(any::<u8>(), 0..600), |bytes| {
        prop_assert!(read(&bytes).is_err());
        Ok(())
    });
    // Characters of a CSV file.
    let alphabet = b"0123456789.,,,,\n\n\"\rek-_sN";
    each(10_000, vec(select(alphabet.to_vec()), 0..600), |bytes| {
        prop_assert!(read(&bytes).is_err());
        Ok(())
    });
    // Random characters after a valid header.
    let header = write(&one_row(1));
    let header = header[..=header.iter().position(|&byte| byte == b'\n').unwrap()].to_vec();
    each(10_000, vec(select(alphabet.to_vec()), 0..600), |bytes| {
        prop_assert!(read(&[header.as_slice(), &bytes].concat()).is_err());
        Ok(())
    });
}

/// A cut file is refused unless only the end of the last "0.0" is missing, which changes no number.
#[test]
fn a_file_that_is_cut_off_anywhere_is_refused() {
    each(4000, (runs(), any::<Index>()), |(run, cut)| {
        let bytes = write(&run);
        let length = cut.index(bytes.len());
        match read(&bytes[..length]) {
            Err(_) => {}
            Ok(rows) => {
                prop_assert!(length + 3 >= bytes.len(), "{length} of {}", bytes.len());
                prop_assert_eq!(rows, read(&bytes).unwrap());
            }
        }
        Ok(())
    });
}

/// Replacement of `removed` bytes at one place by `put_in`.
#[derive(Debug, Clone)]
struct Edit {
    at: Index,
    removed: usize,
    put_in: Vec<u8>,
}

fn edits() -> impl Strategy<Value = Vec<Edit>> {
    let bytes = prop_oneof![
        2 => vec(select(b"0123456789.,\n\"\rek-+".to_vec()), 0..4),
        1 => vec(any::<u8>(), 0..4),
        1 => (1000..20_000_usize).prop_map(|length| vec![b'7'; length]),
    ];
    let edit = (any::<Index>(), 0..4_usize, bytes).prop_map(|(at, removed, put_in)| Edit {
        at,
        removed,
        put_in,
    });
    vec(edit, 1..4)
}

/// An edited file is refused or read completely. Its rows are in order and finite.
#[test]
#[ignore = "slow"]
fn an_edited_file_is_refused_or_read_as_a_whole() {
    each(20_000, (runs(), edits()), |(run, edits)| {
        let mut bytes = write(&run);
        for Edit { at, removed, put_in } in edits {
            let at = at.index(bytes.len());
            let end = (at + removed).min(bytes.len());
            bytes.splice(at..end, put_in);
        }
        let Ok(rows) = read(&bytes) else { return Ok(()) };
        prop_assert!(std::str::from_utf8(&bytes).is_ok());
        prop_assert_eq!(rows.len(), run.records.len());
        for (k, row) in rows.iter().enumerate() {
            prop_assert_eq!((row.index, row.carrying.len()), (k as u64, run.points));
            prop_assert_eq!(row.step.len(), 6 * run.points);
            let numbers = row.step.iter().chain([&row.time, &row.residual]);
            let state = row.state.to_vector();
            prop_assert!(numbers.chain(&state).all(|number| number.is_finite()));
            prop_assert_eq!(row.status == StepStatus::End, k + 1 == rows.len());
        }
        Ok(())
    });
}

#[test]
fn swapped_lines_or_columns_are_refused() {
    each(4000, (runs(), any::<[Index; 2]>(), 0..3_u8), |(run, places, what)| {
        let text = String::from_utf8(write(&run)).unwrap();
        let mut table: Vec<Vec<&str>> =
            text.lines().map(|line| line.split(',').collect()).collect();
        let count = if what == 0 { table.len() } else { table[0].len() };
        let [one, other] = places.map(|place| place.index(count));
        if one == other {
            return Ok(());
        }
        match what {
            0 => table.swap(one, other),
            // Columns swapped in the whole file or only in the header.
            1 => table.iter_mut().for_each(|row| row.swap(one, other)),
            _ => table[0].swap(one, other),
        }
        let lines: Vec<String> = table.iter().map(|row| row.join(",") + "\n").collect();
        prop_assert!(read(lines.concat().as_bytes()).is_err());
        Ok(())
    });
}

#[test]
fn a_field_of_a_megabyte_is_refused_in_one_short_line() {
    let text = String::from_utf8(write(&one_row(2))).unwrap();
    for field in ["0.5", "x_m", "end", "alpha1"] {
        for huge in ["x".repeat(1 << 20), "9".repeat(1 << 20), "\u{1F4A5}".repeat(1 << 18)] {
            assert!(read(text.replacen(field, &huge, 1).as_bytes()).is_err(), "{field}");
        }
    }
    // A number may have a million digits.
    let long = format!("0.5{}", "0".repeat(1 << 20));
    assert_eq!(
        read(text.replacen("0.5", &long, 1).as_bytes()).unwrap()[0].state,
        state(&[0.5; 13])
    );
}
