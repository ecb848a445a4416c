//! Writer of the tutorial's export with random records.

use super::each;
use super::rows::{Run, TIME_STEP, runs, world};
use proptest::prelude::*;
use tumble::step_nlp::SMOOTHING;
use tumble::step_nlp::point::products;
use tumble_core::simulation::StepRecord;
use tumble_scene::output::trajectory::TrajectoryWriter;

fn write(run: &Run) -> Vec<u8> {
    let mut writer = TrajectoryWriter::new(Vec::new(), &world(run.points));
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
    for (contact, found) in record.first().contacts.iter().zip(&record.first().solution.contacts) {
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
fn written_tables_read_back_bit_for_bit() {
    each(2000, runs(), |run| {
        let bytes = write(&run);
        let rows: Vec<_> = csv::Reader::from_reader(&bytes[..]).into_records().collect();
        prop_assert_eq!(rows.len(), run.records.len());
        for (row, record) in rows.into_iter().zip(&run.records) {
            let row = row.unwrap();
            let number = |column: usize| row[column].parse::<f64>().unwrap();
            let (step, flags) = (15..15 + 6 * run.points, 15 + 6 * run.points..15 + 7 * run.points);
            let report = flags.end;
            let state: Vec<_> = (2..15).map(number).collect();
            prop_assert_eq!(bits(&state), bits(&record.state().to_vector()));
            let step: Vec<_> = step.map(number).collect();
            prop_assert_eq!(bits(&step), bits(&step_columns(run.points, record, &step)));
            let carrying =
                record.first().solution.contacts.iter().filter(|of| of.normal_force > 0.0);
            let mut expected = vec!["0"; run.points];
            carrying.for_each(|contact| expected[contact.key.point] = "1");
            prop_assert_eq!(flags.map(|column| &row[column]).collect::<Vec<_>>(), expected);
            prop_assert_eq!(&row[0], record.index.to_string());
            prop_assert_eq!(&row[report], record.status().name());
            prop_assert_eq!(&row[report + 1], record.report().message.unwrap_or_default());
            prop_assert_eq!(&row[report + 2], record.report().iterations.to_string());
            let ends = [number(1), number(report + 3)];
            let expected = [record.index as f64 * TIME_STEP, record.residual()];
            prop_assert_eq!(bits(&ends), bits(&expected));
        }
        Ok(())
    });
}
