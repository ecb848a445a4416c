//! The columns of the derivative against products with it.

use super::scenario;
use tumble::derivative::StateChange;
use tumble::simulation::StepRecord;
use tumble::solver::native::{StepChange, StepDerivative};

/// In every kind of island: of one body and of none else, of stacks, of joints and of a closed chain of them, of many bodies that are
/// eliminated in fronts, and where all rests and the columns are those of the step before.
#[test]
fn columns_are_products_with_units() {
    let mut again = 0;
    for name in ["drop", "stack", "billiard", "pyramid", "double-pendulum", "four-bar", "chain"] {
        let scene = scenario(&format!("{name}.toml"));
        let mut run = scene.simulation(&Default::default()).unwrap();
        let (mut record, mut derivative) = (StepRecord::new(), StepDerivative::new());
        let (mut columns, mut known) = (Vec::new(), Vec::new());
        let bodies = run.states().len();
        for k in 0..scene.rows.min(300) - 1 {
            run.step(&mut record).unwrap();
            if k % 37 != 20 {
                continue;
            }
            run.linearise(&record, &mut derivative).unwrap();
            for body in [0, bodies / 2, bodies - 1] {
                derivative.by_state(body, &mut columns).unwrap();
                run.linearise(&record, &mut derivative).unwrap();
                derivative.by_state(body, &mut known).unwrap();
                assert_eq!(columns, known);
                again += usize::from(record.states == record.solution.states);
                for column in 0..StateChange::LEN {
                    let mut states = vec![StateChange::zero(); bodies];
                    let unit = std::array::from_fn(|k| if k == column { 1.0 } else { 0.0 });
                    states[body] = StateChange::from_array(&unit);
                    let mut end = Vec::new();
                    let change = StepChange { states: &states, ..StepChange::default() };
                    derivative.push(&change, &mut end).unwrap();
                    for (of, end) in end.iter().enumerate() {
                        let found = columns[of].column(column);
                        let expected = end.to_array();
                        let scale = found.amax().max(1.0);
                        let apart = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
                        let apart = apart.fold(0.0, f64::max);
                        // Both to the rounding of a sum of as large numbers.
                        assert!(
                            apart <= 1e-12 * scale,
                            "{name}, step {k}: {apart} of {scale}, of body {of} by number {column} of {body}"
                        );
                    }
                }
            }
        }
    }
    assert!(again > 0);
}
