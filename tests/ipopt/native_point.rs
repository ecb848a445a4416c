//! The native solver's point in the tutorial's nonlinear program. In every step it is feasible with
//! the objective 0, hence a global minimum.

use crate::common::prelude::*;
use crate::common::{heights, points};
use crate::toss::*;
use std::ops::Range;
use tumble::step_nlp::{ProgramPoint, SMOOTHING, StepNlp, layout};

/// Solution of a step as a point of the program, with the smallest slacks that the rows allow.
fn point_of(nlp: &StepNlp, step: &StepRecord) -> ProgramPoint {
    let (world, heights) = (nlp.world(), heights(nlp.world(), step.next()));
    let mut point = ProgramPoint::zeros(points(world));
    let (ground, friction) = (world.ground().unwrap(), world.friction());
    point.set_solution(&step.first().solution, ground, |i| heights[i], friction, nlp.smoothing());
    point
}

/// True for each point that carries a force. With these flags the solution is a point of the
/// program.
fn carrying(nlp: &StepNlp, step: &StepRecord) -> Vec<bool> {
    let mut carrying = vec![false; points(nlp.world())];
    for contact in &step.first().solution.contacts {
        carrying[contact.key.point] = contact.carries_force();
    }
    carrying
}

/// Rows of a step at its solution with zero slacks, where the objective is zero too.
fn rows_at_zero(nlp: &mut StepNlp, step: &StepRecord) -> (ProgramPoint, Vec<f64>) {
    let mut point = point_of(nlp, step);
    let (s1, s2) = (nlp.layout().slack_1(), nlp.layout().slack_2());
    point.as_mut_slice()[s1.start..s2.end].fill(0.0);
    assert_eq!(nlp.objective(point.as_slice()), 0.0);
    let mut rows = vec![0.0; nlp.layout().constraints()];
    let alpha = carrying(nlp, step).into_iter().map(|carries| f64::from(u8::from(carries)));
    nlp.set_step(step.state(), &Wrench::zero(), alpha);
    nlp.constraints(point.as_slice(), &mut rows);
    (point, rows)
}

/// Checks every step of some runs.
fn each_step(mut check: impl FnMut(&mut StepNlp, &StepRecord)) {
    for body in cubes() {
        let world = World::new(parameters(body)).unwrap();
        let mut nlp = StepNlp::new(world.clone(), SMOOTHING).unwrap();
        for seed in [0, 1, 2, 3, 6, 42] {
            for step in thrown_run(&world, seed) {
                check(&mut nlp, &step);
            }
        }
    }
}

fn sizes(rows: &[f64], range: Range<usize>) -> f64 {
    rows[range].iter().map(|row| row.abs()).fold(0.0, largest)
}

/// Largest violation of inequalities ≥ 0.
fn shortfall(rows: &[f64], range: Range<usize>) -> f64 {
    rows[range].iter().map(|row| -row).fold(0.0, largest)
}

/// Checks the equations to rounding.
///
/// The rows themselves define positions and attitudes from the velocities: 1e-15. Velocities come
/// from a linear system of 6 equations: 1e-13 m/s. So do spins. There the impulses of a corner over
/// the light cube's inertia amplify a rounding of 4e-16 m/s a thousand times: 1e-11 rad/s. Slips
/// have the accuracy of the certificate, 1e-10 m/s.
#[test]
fn all_thirty_equations_hold_in_every_step() {
    each_step(|nlp, step| {
        let (_, rows) = rows_at_zero(nlp, step);
        let checks = [
            (layout::POSITION_ROWS, 1e-15),
            (layout::ATTITUDE_ROWS, 1e-15),
            (layout::VELOCITY_ROWS, 1e-13),
            (layout::SPIN_ROWS, 1e-11),
            (layout::UNIT_NORM_ROW..layout::UNIT_NORM_ROW + 1, 2e-15),
            (nlp.layout().dissipation_rows(), 1e-10),
        ];
        assert_eq!(checks.last().unwrap().0.end, nlp.layout().equalities());
        for (range, most) in checks {
            let size = sizes(&rows, range.clone());
            assert!(size < most, "step {}, rows {range:?}: {size:e}", step.index);
        }
    });
}

/// Checks the inequalities.
///
/// Heights hold to the certificate, 1e-10 m/s, times h: 2e-13 m. Normal complementarity is that
/// height times a force of up to 18 kN: 4e-9 N m. The cone has ε to spare, because the smoothed
/// norm is smaller than the norm.
///
/// The friction complementarity s2 − λ(μf_z − ‖f_xy‖_ε) cannot hold with s2 = 0 where a point
/// slides. The exact friction is |f_xy| = μf_z, and the smoothed norm is smaller by up to ε. The
/// row is below 0 by up to λε, 1.4e-5 W for 14 m/s. Two more errors add 1e-6 W. One is λ times the
/// error of the force, 1e-10 m/s times m/h. The other is the slip's error, 1e-10 m/s, times μf_z.
#[test]
fn all_thirty_two_inequalities_hold_in_every_step() {
    each_step(|nlp, step| {
        let (point, rows) = rows_at_zero(nlp, step);
        let (rows_of, x) = (nlp.layout(), point.as_slice());
        let checks = [
            (rows_of.height_rows(), 2e-13),
            (rows_of.cone_rows(), 0.0),
            (rows_of.normal_complementarity_rows(), 4e-9),
        ];
        for (range, most) in checks {
            let short = shortfall(&rows, range.clone());
            assert!(short <= most, "step {}, rows {range:?}: −{short:e}", step.index);
        }
        let friction_rows = rows_of.friction_complementarity_rows();
        assert_eq!(friction_rows.end, rows_of.constraints());
        for (row, slip_speed) in friction_rows.zip(rows_of.slip_speed()) {
            let most = x[slip_speed] * nlp.smoothing();
            let short = -rows[row];
            assert!(short <= most + 1e-6, "step {}, row {row}: −{short:e}", step.index);
        }
    });
}

/// Checks the bounds exactly: forces, slacks and slip speeds are not negative. All variables of a
/// corner without a force are 0. The smallest slacks that the rows allow are products of the laws'
/// errors with forces of up to 18 kN: 1e-10 m/s times h, and 1e-10 m/s times μ f_z. These are 4e-9
/// N m and 6e-7 W. So the objective is 0 to 8 · 4e-13.
#[test]
fn all_bounds_hold_and_the_objective_is_zero_in_every_step() {
    each_step(|nlp, step| {
        let point = point_of(nlp, step);
        let x = point.as_slice();
        let objective = nlp.objective(x);
        assert!(objective < 3e-12, "step {}: {objective:e}", step.index);
        for (i, carries) in carrying(nlp, step).into_iter().enumerate() {
            let [fx, fy, fz, s1, s2, slip] = nlp.layout().contact_variables(i).map(|k| x[k]);
            let bounded = if carries {
                fz > 0.0 && s1 >= 0.0 && s2 >= 0.0 && slip >= 0.0
            } else {
                [fx, fy, fz, s1, s2, slip] == [0.0; 6]
            };
            assert!(bounded, "step {}, corner {i}: {fz:e}, {slip:e}", step.index);
        }
    });
}

/// Checks the same for a brick with other sides, mass, friction and time step, and rotated axes.
/// Gravity or the ground is inclined, and the program has its forces in the ground's frame. No row
/// has an error above 1e-9, beyond the λε of the friction complementarity. Forces reach 3.2 kN and
/// slips 4.5 m/s.
#[test]
fn a_brick_on_an_incline_is_a_point_of_its_program_too() {
    let half_sides = Vector3::new(0.3, 0.1, 0.05);
    let inertia = Matrix3::new(0.02, 0.004, 0.0, 0.004, 0.05, 0.002, 0.0, 0.002, 0.06);
    let body = RigidBody::with_box_corners(1.5, inertia, half_sides).unwrap();
    let usual = Parameters { friction: 0.5, time_step: 1e-3, ..parameters(body) };
    let leaning = Parameters { gravity: Vector3::new(2.5, -1.0, -9.4), ..usual.clone() };
    let ground = Plane::new(Vector3::new(0.25, -0.1, 0.94), -0.2).unwrap();
    let sloping = Parameters { ground: Some(ground), ..usual };
    for (constants, seed) in (0..6).flat_map(|seed| [(&leaning, seed), (&sloping, seed)]) {
        let world = World::new(constants.clone()).unwrap();
        let mut nlp = StepNlp::new(world.clone(), SMOOTHING).unwrap();
        let mut start = thrown(seed);
        start.position[2] = 0.5;
        for step in native_run(&world, start, 999) {
            let (point, mut rows) = rows_at_zero(&mut nlp, &step);
            let x = point.as_slice();
            let friction_rows = nlp.layout().friction_complementarity_rows();
            for (row, slip_speed) in friction_rows.zip(nlp.layout().slip_speed()) {
                rows[row] += x[slip_speed] * nlp.smoothing();
            }
            let equations = nlp.layout().equalities();
            let worst = sizes(&rows, 0..equations).max(shortfall(&rows, equations..rows.len()));
            assert!(worst < 1e-9, "seed {seed}, step {}: {worst:e}", step.index);
        }
    }
}
