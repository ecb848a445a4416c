//! Contact problems given as matrices: comparison with closed forms, with each other and with the
//! steps that they come from. Invalid problems are refused.

use crate::common::prelude::*;
use crate::contact_problem::{apart, contacts, dense, local, plate, random};
use nalgebra::DVector;
use std::sync::atomic::AtomicBool;
use tumble_core::problem::{
    ContactProblem, Form, Law, ProblemError, RowLaw, Selection, SolveOptions,
};

/// Checks a mass of 2 kg with one contact that opens, sticks or slips, in three dimensions and in
/// two. The tolerance is a tenth of the default residual.
#[test]
fn one_contact_has_its_closed_form() {
    let options = SolveOptions::default();
    // Free velocity q, and the expected p and u for μ = 0.5.
    let cases = [
        ([1.0, 3.0, -2.0], [0.0; 3], [1.0, 3.0, -2.0]),
        ([-1.0, 0.3, -0.2], [2.0, -0.6, 0.4], [0.0; 3]),
        ([-1.0, 3.0, 4.0], [2.0, -0.6, -0.8], [0.0, 2.7, 3.6]),
    ];
    for (q, p, u) in cases {
        let w = DMatrix::identity(3, 3) * 0.5;
        let found = local(&w, &q, contacts(&[0.5])).solve(&options).unwrap();
        assert!(found.is_solved() && found.residual < 1e-10, "{q:?}: {found:?}");
        assert!(
            apart(&found.impulses, &p) < 1e-10 && apart(&found.velocities, &u) < 1e-10,
            "{q:?}"
        );
        assert!(found.selected && found.parts == 1);
        // The same problem in global form, with the body velocity v.
        let (mass, unit) = (DMatrix::identity(3, 3) * 2.0, DMatrix::identity(3, 3));
        let f: Vec<f64> = q.iter().map(|q| 2.0 * q).collect();
        let global =
            ContactProblem::global(dense(&mass), dense(&unit), f, vec![0.0; 3], contacts(&[0.5]));
        let found = global.unwrap().solve(&options).unwrap();
        assert!(apart(&found.impulses, &p) < 1e-10 && apart(&found.body_velocities, &u) < 1e-10);
    }
    let w = DMatrix::identity(2, 2) * 0.5;
    let laws = Law::contacts(2, &[0.5]).unwrap();
    let found = local(&w, &[-1.0, -3.0], laws).solve(&options).unwrap();
    assert!(apart(&found.impulses, &[2.0, 1.0]) < 1e-10, "{found:?}");
    assert!(apart(&found.velocities, &[0.0, -2.5]) < 1e-10);
}

/// Checks rows of joints: a free, a locked, a limited and a braked row of a mass of 4 kg.
#[test]
fn rows_by_themselves_have_their_closed_form() {
    let solve = |law: RowLaw, q: f64| {
        let laws = vec![Law::rows_of(vec![law]).unwrap()];
        let found = local(&DMatrix::from_element(1, 1, 0.25), &[q], laws)
            .solve(&SolveOptions::default())
            .unwrap();
        assert!(found.is_solved(), "{law:?} {q}");
        (found.impulses[0], found.velocities[0])
    };
    let near = |(p, u): (f64, f64), expected: (f64, f64)| {
        assert!((p - expected.0).abs() < 1e-11 && (u - expected.1).abs() < 1e-11, "{p} {u}");
    };
    near(solve(RowLaw::Free, 3.0), (0.0, 3.0));
    near(solve(RowLaw::Locked, 3.0), (-12.0, 0.0));
    near(solve(RowLaw::Limit, 3.0), (0.0, 3.0));
    near(solve(RowLaw::Limit, -3.0), (12.0, 0.0));
    let brake = RowLaw::Box { least: -4.0, most: 8.0 };
    near(solve(brake, 0.5), (-2.0, 0.0));
    near(solve(brake, 3.0), (-4.0, 2.0));
    near(solve(brake, -3.0), (8.0, -1.0));
    // Two coupled rows: the second is locked, and the first slides against its brake.
    let w = DMatrix::from_row_slice(2, 2, &[1.0, -0.5, -0.5, 1.0]);
    let rows = vec![RowLaw::Box { least: -1.0, most: 1.0 }, RowLaw::Locked];
    let found = local(&w, &[4.0, 0.0], vec![Law::rows_of(rows).unwrap()])
        .solve(&SolveOptions::default())
        .unwrap();
    assert!(apart(&found.impulses, &[-1.0, -0.5]) < 1e-11, "{found:?}");
    assert!(apart(&found.velocities, &[3.25, 0.0]) < 1e-11);
}

/// Solves random heaps in both forms and checks the solutions with an independent evaluation of the
/// law.
#[test]
fn random_problems_are_solved_in_both_forms() {
    let mut unsolved = 0;
    for seed in 0..60 {
        let (bodies, count) = (1 + seed as usize % 7, 1 + seed as usize % 23);
        let random = random(seed, bodies, count);
        let global = random.problem();
        let condensed = global.to_local().unwrap();
        assert!(matches!(condensed.form(), Form::Local { .. }));
        for problem in [&global, &condensed] {
            let found = problem.solve(&SolveOptions::default()).unwrap();
            unsolved += usize::from(!found.is_solved());
            if found.is_solved() {
                // Impulses reach some 10 N s, responses some 10/kg.
                assert!(random.missed(&found.impulses) < 1e-7, "seed {seed}");
            }
        }
        // Both forms assign the same motion and the same residual to the same impulses.
        let impulses: Vec<f64> = (0..3 * count).map(|k| (k % 5) as f64 - 1.0).collect();
        let (a, b) = (global.evaluate(&impulses), condensed.evaluate(&impulses));
        assert!(apart(&a.velocities, &b.velocities) < 1e-10, "seed {seed}");
        assert!((a.residual - b.residual).abs() < 1e-10 * a.residual.max(1.0));
        assert!((a.relative_error - b.relative_error).abs() < 1e-10 * a.relative_error.max(1.0));
    }
    assert_eq!(unsolved, 0);
}

/// Checks a body with many degrees of freedom and few contacts, as in a finite element model. The
/// global form must agree with the local form.
#[test]
fn condensed_global_solve_agrees_with_local_form() {
    for size in [20, 90] {
        // A chain of springs with mass, implicit in time: the matrix is tridiagonal.
        let mass = DMatrix::from_fn(3 * size, 3 * size, |i, j| match i.abs_diff(j) {
            0 => 3.0,
            3 => -1.0,
            _ => 0.0,
        });
        let mut directions = DMatrix::zeros(3 * size, 6);
        for k in 0..3 {
            directions[(k, k)] = 1.0;
            directions[(3 * (size - 1) + k, 3 + k)] = 1.0;
        }
        let f: Vec<f64> = (0..3 * size).map(|k| [-1.0, 0.8, 0.1][k % 3]).collect();
        let laws = contacts(&[0.3, 0.9]);
        let problem =
            ContactProblem::global(dense(&mass), dense(&directions), f, vec![0.0; 6], laws)
                .unwrap();
        let found = problem.solve(&SolveOptions::default()).unwrap();
        assert!(found.is_solved(), "{found:?}");
        let condensed = problem.to_local().unwrap().solve(&SolveOptions::default()).unwrap();
        assert!(apart(&found.impulses, &condensed.impulses) < 1e-9);
        assert!(apart(&found.velocities, &condensed.velocities) < 1e-9);
        // M v = H p + f.
        let v = DVector::from_vec(found.body_velocities.clone());
        let p = DVector::from_vec(found.impulses.clone());
        let missed = &mass * v - &directions * p;
        assert!(
            missed.iter().enumerate().all(|(k, x)| (x - [-1.0, 0.8, 0.1][k % 3]).abs() < 1e-12)
        );
    }
}

/// Checks four corners that stick. The selection rule returns the impulses of least norm. A solve
/// from a given start keeps that start.
#[test]
fn the_rule_gives_the_least_norm_and_a_start_is_kept() {
    let problem = plate();
    let options = SolveOptions { selection: Selection::Compliance, ..SolveOptions::default() };
    let found = problem.solve(&options).unwrap();
    assert!(found.is_solved() && found.selected);
    // Least norm: p = −W⁺ q.
    let condensed = problem.to_local().unwrap();
    let Form::Local { response, free } = condensed.form() else { panic!("it is local") };
    let w = DMatrix::from_fn(12, 12, |i, j| response.at(i, j));
    let least = -w.pseudo_inverse(1e-9).unwrap() * DVector::from_column_slice(free);
    assert!(apart(&found.impulses, least.as_slice()) < 1e-6, "{:?}\n{least}", found.impulses);
    // A solution with self-stress is also a solution, so the solver may keep it.
    let mut start = found.impulses.clone();
    for (contact, sign) in [(0, 1.0), (1, -1.0), (2, -1.0), (3, 1.0)] {
        start[3 * contact] += 0.2 * sign;
    }
    let any = SolveOptions { start: Some(&start), ..SolveOptions::default() };
    let kept = problem.solve(&any).unwrap();
    assert!(kept.is_solved(), "{kept:?}");
    let again = SolveOptions { start: Some(&found.impulses), ..SolveOptions::default() };
    let again = problem.solve(&again).unwrap();
    assert!(again.is_solved() && again.iterations <= found.iterations);
    assert!(apart(&again.impulses, &found.impulses) < 1e-6);
}

/// Checks the contact problems of a tumbling cube. The impulses of every step solve its problem.
/// With a single contact point the solution is unique, and the solver must return the same
/// impulses.
#[test]
fn the_problem_of_a_step_has_its_impulses() {
    let cube = RigidBody::solid_box(2.0, Vector3::new(0.5, 0.4, 0.3)).unwrap();
    let world = euler(Parameters { friction: 0.3, ..Parameters::new(vec![cube]) });
    let (mut unique, mut others) = (0, 0);
    for seed in 0..6 {
        let start = State {
            position: Vector3::new(0.0, 0.0, 1.0),
            attitude: Draws::new(seed).attitude(),
            velocity: Vector3::new(2.0, 0.5, 0.0),
            spin: Vector3::new(3.0, -4.0, 1.0),
        };
        let mut simulation =
            Simulation::new(world.clone(), vec![start], Motion::native(&world)).unwrap();
        let mut record = StepRecord::new();
        for _ in 0..800 {
            simulation.step(&mut record).unwrap();
            if record.first().contacts.is_empty() || record.status() == StepStatus::Wild {
                continue;
            }
            let (problem, impulses) =
                ContactProblem::from_interval(&world, record.first()).unwrap();
            let found = problem.evaluate(&impulses);
            assert!(found.residual < 1e-9, "step {}: {}", record.index, found.residual);
            let next = &record.next_states()[0];
            let v = [next.velocity, next.spin].map(|v| [v[0], v[1], v[2]]).concat();
            assert!(apart(&found.body_velocities, &v) < 1e-11);
            if record.first().contacts.len() == 1 {
                let solved = problem.solve(&SolveOptions::default()).unwrap();
                assert!(solved.is_solved());
                let size = impulses.iter().fold(1e-3, |most: f64, p| most.max(p.abs()));
                assert!(apart(&solved.impulses, &impulses) < 1e-7 * size, "step {}", record.index);
                unique += 1;
            } else if record.index.is_multiple_of(20) {
                assert!(problem.solve(&SolveOptions::default()).unwrap().is_solved());
                others += 1;
            }
        }
    }
    assert!(unique > 50 && others > 20, "{unique} {others}");
}

#[test]
fn invalid_contact_problems_are_rejected() {
    let one = || contacts(&[0.5]);
    let unit = DMatrix::<f64>::identity(3, 3);
    let posed = |w: &DMatrix<f64>, q: &[f64]| ContactProblem::local(dense(w), q.to_vec(), one());
    assert!(matches!(posed(&unit, &[0.0; 2]), Err(ProblemError::Length { what: "q", .. })));
    assert!(matches!(posed(&unit, &[0.0, f64::NAN, 0.0]), Err(ProblemError::NotFinite { .. })));
    let square = DMatrix::identity(6, 6);
    assert!(matches!(posed(&square, &[0.0; 3]), Err(ProblemError::Shape { .. })));
    let mut skew = unit.clone();
    skew[(0, 1)] = 0.5;
    assert!(matches!(posed(&skew, &[0.0; 3]), Err(ProblemError::Asymmetric { .. })));
    let mut negative = unit.clone();
    negative[(1, 1)] = -1.0;
    assert!(matches!(posed(&negative, &[0.0; 3]), Err(ProblemError::Indefinite { .. })));
    let mut wide = unit.clone();
    (wide[(0, 1)], wide[(1, 0)]) = (2.0, 2.0);
    assert!(matches!(posed(&wide, &[0.0; 3]), Err(ProblemError::Indefinite { .. })));
    assert!(Law::contact(3, -0.1).is_err() && Law::contact(3, f64::NAN).is_err());
    assert!(Law::contact(4, 0.1).is_err() && Law::rows_of(vec![]).is_err());
    assert!(Law::rows_of(vec![RowLaw::Box { least: 1.0, most: 0.0 }]).is_err());
    let singular = DMatrix::<f64>::zeros(3, 3);
    let global = |m: &DMatrix<f64>, h: &DMatrix<f64>| {
        ContactProblem::global(dense(m), dense(h), vec![0.0; 3], vec![0.0; 3], one())
    };
    assert!(matches!(global(&singular, &unit), Err(ProblemError::Mass { .. })));
    assert!(global(&unit, &DMatrix::zeros(3, 6)).is_err());
    let problem = posed(&unit, &[0.0; 3]).unwrap();
    let solve = |options: SolveOptions<'_>| problem.solve(&options);
    assert!(solve(SolveOptions { residual: 0.0, ..SolveOptions::default() }).is_err());
    assert!(solve(SolveOptions { start: Some(&[0.0]), ..SolveOptions::default() }).is_err());
    let raised = AtomicBool::new(true);
    let options = SolveOptions { interrupt: Some(&raised), ..SolveOptions::default() };
    assert_eq!(plate().solve(&options), Err(ProblemError::Interrupted));
}

/// Checks a contact that closes although no impulse can move it. The result is not converged, and
/// there is no error.
#[test]
fn a_problem_without_a_solution_is_unsolved() {
    let problem = local(&DMatrix::zeros(3, 3), &[-1.0, 0.0, 0.0], contacts(&[0.5]));
    let found = problem.solve(&SolveOptions::default()).unwrap();
    assert!(!found.is_solved() && !found.selected && found.residual == 1.0, "{found:?}");
    assert!(found.impulses.iter().all(|p| p.is_finite()));
}
