//! Contact problems given as matrices: comparison with closed forms, with each other and with the
//! steps that they come from. Invalid problems are refused.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use std::sync::atomic::AtomicBool;
use tumble::problem::{
    ContactProblem, Form, Law, ProblemError, RowLaw, Selection, SolveOptions, SparseMatrix, dat,
};
use tumble_core::contact::Plane;
use tumble_core::mechanics::{RigidBody, Rotation, State};
use tumble_core::simulation::random::Draws;
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::step::StepStatus;
use tumble_core::world::{Integrator, Parameters, World};

fn dense(matrix: &DMatrix<f64>) -> SparseMatrix {
    let (rows, columns) = matrix.shape();
    let entries = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
    SparseMatrix::from_triplets(rows, columns, entries.map(|(i, j)| (i, j, matrix[(i, j)])))
        .unwrap()
}

fn local(w: &DMatrix<f64>, q: &[f64], laws: Vec<Law>) -> ContactProblem {
    ContactProblem::local(dense(w), q.to_vec(), laws).unwrap()
}

fn contacts(friction: &[f64]) -> Vec<Law> {
    Law::contacts(3, friction).unwrap()
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

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

/// Bodies with contacts at random points, with each other and with the world.
struct Random {
    mass: DMatrix<f64>,
    directions: DMatrix<f64>,
    momentum: Vec<f64>,
    offset: Vec<f64>,
    friction: Vec<f64>,
}

fn random(seed: u32, bodies: usize, count: usize) -> Random {
    let mut draws = Draws::new(seed);
    let mut signed = |size: f64| size * (2.0 * draws.unit() - 1.0);
    let size = 6 * bodies;
    let (mut mass, mut directions) = (DMatrix::zeros(size, size), DMatrix::zeros(size, 3 * count));
    for body in 0..bodies {
        let root = Matrix3::from_fn(|_, _| signed(0.3)) + Matrix3::identity() * 0.5;
        let m = 1.5 + signed(1.0);
        mass.fixed_view_mut::<3, 3>(6 * body, 6 * body).fill_with_identity();
        let mut linear = mass.fixed_view_mut::<3, 3>(6 * body, 6 * body);
        linear *= m;
        let inertia = root * root.transpose() * m;
        mass.fixed_view_mut::<3, 3>(6 * body + 3, 6 * body + 3).copy_from(&inertia);
    }
    for contact in 0..count {
        let normal = Vector3::new(signed(1.0), signed(1.0), 1.0 + signed(0.5)).normalize();
        let across = normal.cross(&Vector3::x()).normalize();
        let frame = Matrix3::from_columns(&[normal, across, normal.cross(&across)]);
        let a = contact % bodies;
        let other = (signed(0.5).abs() * 2.0 * (bodies + 1) as f64) as usize;
        for (body, sign) in [(a, 1.0), (other, -1.0)] {
            if body >= bodies || (sign < 0.0 && body == a) {
                continue;
            }
            let arm = Vector3::new(signed(0.7), signed(0.7), signed(0.7));
            let mut linear = directions.fixed_view_mut::<3, 3>(6 * body, 3 * contact);
            linear += sign * frame;
            let mut angular = directions.fixed_view_mut::<3, 3>(6 * body + 3, 3 * contact);
            angular += sign * arm.cross_matrix() * frame;
        }
    }
    let velocity = DVector::from_fn(size, |_, _| signed(3.0));
    let momentum = (&mass * velocity).as_slice().to_vec();
    let offset = vec![0.0; 3 * count];
    let friction = (0..count).map(|_| 0.35 + signed(0.35)).collect();
    Random { mass, directions, momentum, offset, friction }
}

impl Random {
    fn problem(&self) -> ContactProblem {
        let (mass, directions) = (dense(&self.mass), dense(&self.directions));
        let (f, w) = (self.momentum.clone(), self.offset.clone());
        ContactProblem::global(mass, directions, f, w, contacts(&self.friction)).unwrap()
    }

    /// Largest violation of the contact law, computed from the matrices alone. It covers gaps that
    /// close, tension, impulses at opening contacts, friction outside its cone and friction not
    /// opposed to the slip.
    fn missed(&self, impulses: &[f64]) -> f64 {
        let p = DVector::from_column_slice(impulses);
        let momentum = DVector::from_column_slice(&self.momentum) + &self.directions * &p;
        let velocity = self.mass.clone().lu().solve(&momentum).unwrap();
        let u = self.directions.transpose() * velocity;
        let mut missed = 0.0_f64;
        for (contact, friction) in self.friction.iter().enumerate() {
            let (p, u) = (p.fixed_rows::<3>(3 * contact), u.fixed_rows::<3>(3 * contact));
            let (slip, along) = (u.fixed_rows::<2>(1), p.fixed_rows::<2>(1));
            missed = missed.max(-p[0]).max(-u[0]).max(p[0].min(u[0]));
            missed = missed.max(along.norm() - friction * p[0].max(0.0));
            // Maximum dissipation: the friction force has its full size and opposes the slip.
            let power = (along.dot(&slip) + friction * p[0] * slip.norm()).abs();
            missed = missed.max(power);
        }
        missed
    }
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

fn plate() -> ContactProblem {
    // A plate of 4 kg that falls at 1 m/s on its four corners.
    let mut directions = DMatrix::zeros(6, 12);
    for (contact, (x, y)) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].iter().enumerate()
    {
        let arm = Vector3::new(*x, *y, -0.1);
        let frame = Matrix3::from_columns(&[Vector3::z(), Vector3::x(), Vector3::y()]);
        directions.fixed_view_mut::<3, 3>(0, 3 * contact).copy_from(&frame);
        directions.fixed_view_mut::<3, 3>(3, 3 * contact).copy_from(&(arm.cross_matrix() * frame));
    }
    let mass = DMatrix::from_diagonal(&DVector::from_vec(vec![4.0, 4.0, 4.0, 1.4, 1.4, 2.7]));
    let f = vec![0.4, 0.0, -4.0, 0.0, 0.0, 0.0];
    let laws = contacts(&[0.5; 4]);
    ContactProblem::global(dense(&mass), dense(&directions), f, vec![0.0; 12], laws).unwrap()
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
    let world = World::new(Parameters {
        bodies: vec![cube],
        ground: Some(Plane::level()),
        friction: 0.3,
        gravity: Vector3::new(0.0, 0.0, -9.81),
        time_step: 0.002,
        rotation: Rotation::Momentum,
    })
    .unwrap()
    .with_integrator(Integrator::Euler);
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

#[test]
fn text_keeps_every_bit_of_a_problem() {
    let random = random(3, 3, 5);
    let global = random.problem();
    for problem in [&global, &global.to_local().unwrap(), &plate()] {
        let text = dat::write(problem).unwrap();
        let again = dat::read(&text).unwrap();
        assert_eq!(again.laws(), problem.laws());
        match (problem.form(), again.form()) {
            (Form::Local { response, free }, Form::Local { response: r, free: f }) => {
                assert!(response == r && free == f);
            }
            (Form::Global(a), Form::Global(b)) => {
                assert!(a.mass == b.mass && a.directions == b.directions);
                assert!(a.momentum == b.momentum && a.offset == b.offset);
            }
            _ => panic!("another form"),
        }
        // A text that ends early or has a wrong word is refused.
        let words: Vec<&str> = text.split_whitespace().collect();
        for k in (0..words.len()).step_by(7) {
            assert!(dat::read(&words[..k].join(" ")).is_err(), "{k}");
            let mut wrong = words.clone();
            wrong[k] = "nothing";
            let _ = dat::read(&wrong.join(" "));
            wrong[k] = "99999999999";
            let _ = dat::read(&wrong.join(" "));
        }
        assert!(dat::read(&format!("{text} 1 2 3")).is_err());
    }
    let rows = vec![Law::rows_of(vec![RowLaw::Locked]).unwrap()];
    let refused = dat::write(&local(&DMatrix::identity(1, 1), &[0.0], rows)).unwrap_err();
    assert!(refused.to_string().contains("group 0 is not such a contact"), "{refused}");
    let plane = [contacts(&[0.5]), Law::contacts(2, &[0.5]).unwrap()].concat();
    let refused = dat::write(&local(&DMatrix::identity(5, 5), &[0.0; 5], plane)).unwrap_err();
    assert!(refused.to_string().contains("group 1"), "{refused}");
}

/// Checks problems without contacts. They are valid and have nothing to solve.
#[test]
fn the_empty_problem_is_written_and_read() {
    let none = SparseMatrix::from_triplets(0, 0, []).unwrap();
    let empty = ContactProblem::local(none, vec![], vec![]).unwrap();
    let (mass, directions) =
        (dense(&DMatrix::identity(3, 3)), SparseMatrix::from_triplets(3, 0, []).unwrap());
    let falling = ContactProblem::global(mass, directions, vec![0.0, 0.0, -1.0], vec![], vec![]);
    for (problem, v) in [(empty, vec![]), (falling.unwrap(), vec![0.0, 0.0, -1.0])] {
        let again = dat::read(&dat::write(&problem).unwrap()).unwrap();
        assert_eq!((again.row_count(), again.velocity_count()), (0, v.len()));
        let found = again.solve(&SolveOptions::default()).unwrap();
        assert!(found.is_solved() && found.body_velocities == v, "{found:?}");
    }
}

/// Reads the three storages of Siconos: two masses on the ground, written by hand.
#[test]
fn all_storages_are_read() {
    let dense: String = (0..6)
        .map(|i| (0..6).map(|j| if i == j { "2 " } else { "0 " }).collect::<String>() + "\n")
        .collect();
    let block = "2\n0\n0\n0\n2\n0\n0\n0\n2\n";
    let sparse: String = (0..6).map(|k| format!("    {k} {k} : 2.0\n")).collect();
    let columns: String =
        (0..6).map(|k| format!("    col {k} : locations {k} to {k}\n      {k} : 2\n")).collect();
    let head = "3\n2\n";
    let tail = "-1 1 0 -1 -0.1 0\n0.5 0.5\n1\n";
    let texts = [
        format!("{head}0\n6\n6\n6\t6\n{dense}{tail}"),
        format!("{head}1\n6\n6\n2\n2\n2\n3 6\n3 6\n3\n2\n0 1 2\n0 1\n0\n{block}1\n{block}{tail}"),
        format!(
            "{head}2\n6\n6\n0\nCSparse Version 3.1.1, May 20, 2012.  Copyright (c) somebody\ntriplet: \
             6-by-6, nzmax: 6 nnz: 6\n{sparse}{tail}"
        ),
        format!(
            "{head}2\n6\n6\n1\nCSparse Version 3.1.1\n6-by-6, nzmax: 6 nnz: 6, 1-norm: 2\n{columns}{tail}"
        ),
    ];
    for text in texts {
        let found = dat::read(&text).unwrap().solve(&SolveOptions::default()).unwrap();
        assert!(found.is_solved() && found.parts == 2, "{text}");
        assert!(apart(&found.impulses, &[0.5, -0.25, 0.0, 0.5, 0.05, 0.0]) < 1e-12, "{text}");
    }
    let refused = dat::read("3\n1\n7\n3\n3\n").unwrap_err().to_string();
    assert!(refused.contains("line 3") && refused.contains("storage of M"), "{refused}");
}

/// Checks that inconsistent texts are refused: wrong numbers of entries or columns, wrong sizes,
/// wrong words, and numbers that are not finite.
#[test]
fn texts_with_wrong_counts_are_rejected() {
    let head = "3\n1\n2\n3\n3\n";
    let triplets = "1\nCSparse Version 3.2.0\ntriplet: 3-by-3, nzmax: 3 nnz: 3\n";
    let entries = "0 0 : 1\n1 1 : 1\n2 2 : 1\n";
    let columns = "0\nCSparse Version 3.2.0\n3-by-3, nzmax: 3 nnz: 3, 1-norm: 1\n";
    let each = [0, 1, 2].map(|k| format!("col {k} : locations {k} to {k}\n  {k} : 1\n"));
    let tail = "-1 0.2 0\n0.5\n";
    let (by_entries, by_columns) = (
        format!("{head}{triplets}{entries}{tail}"),
        format!("{head}{columns}{}{tail}", each.concat()),
    );
    for text in [&by_entries, &by_columns] {
        let found = dat::read(text).unwrap().solve(&SolveOptions::default()).unwrap();
        // W is the identity, so the impulses are as accurate as the requested residual.
        assert!(apart(&found.impulses, &[1.0, -0.2, 0.0]) < 1e-9, "{text}");
    }
    // C prints a count with six digits like this.
    assert!(dat::read(&by_entries.replace("nzmax: 3", "nzmax: 1e+06")).is_ok());
    for (text, old, new, words) in [
        (&by_entries, "2 2 : 1\n", "", "line 8: the header has 3 entries, but 2 follow"),
        (&by_entries, "nnz: 3", "nnz: 2", "line 8: the header has 2 entries, but 3 follow"),
        (&by_entries, "3-by-3", "7-by-9", "line 8: found \"7-by-9,\""),
        (&by_columns, "  2 : 1\n", "", "line 13: the header has 1 entries, but 0 follow"),
        (&by_columns, "nnz: 3", "nnz: 4", "line 8: the header has 4 entries, but 3 follow"),
        (&by_columns, "3-by-3", "3-by-4", "line 8: found \"3-by-4,\""),
        (&by_columns, each[1].as_str(), "", "line 11: found \"2\"; expected the next column"),
        (&by_columns, each[2].as_str(), "", "found \"-1\"; expected col"),
        (&by_columns, "col 2", "col 0", "found \"0\"; expected the next column"),
        (&by_entries, "0.5\n", "", "it ends too early; expected a coefficient of friction"),
        (&by_entries, "0.5\n", "0.5 0.5\n0.5", "line 13: found \"0.5\" after the last"),
        (&by_entries, "0.2", "nan", "line 12: found \"nan\"; expected a number of q"),
        (&by_entries, "1 1 : 1", "1 1 : -inf", "line 10: found \"-inf\"; expected an entry"),
        (&by_entries, "0.5\n", "1e999", "line 13: found \"1e999\"; expected a coefficient"),
    ] {
        assert!(text.contains(old), "{old}");
        let changed = text.replacen(old, new, 1);
        let refused = dat::read(&changed).map(|_| ()).unwrap_err().to_string();
        assert!(refused.contains(words), "{old:?} {new:?}: {refused}");
    }
}
