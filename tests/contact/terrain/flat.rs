//! Level terrain: bodies move as on one slab.

use super::*;

/// Largest difference from the slab: 1e-9 m, m/s and rad/s.
const EQUAL: f64 = 1e-9;

struct Case {
    name: &'static str,
    piece: Piece,
    start: State,
    friction: f64,
}

fn turned(piece: &Piece, about_x: f64) -> Piece {
    let (s, c) = about_x.sin_cos();
    let turn = Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c);
    piece.moved_by(&turn, &V::zeros()).unwrap()
}

fn cases(speed: f64) -> Vec<Case> {
    let quarter = std::f64::consts::FRAC_PI_2;
    let case = |name, piece, height, spin, friction| Case {
        name,
        piece,
        start: at([-1.53, 0.311, height], [speed, 0.37, 0.0], spin),
        friction,
    };
    let cylinder = Piece::cylinder(0.1, 0.15, 24).unwrap();
    vec![
        case("box", Piece::cuboid(V::new(0.2, 0.15, 0.1)).unwrap(), 0.1, [0.0, 0.0, 0.7], 0.1),
        case("ball", Piece::sphere(0.12).unwrap(), 0.12, [0.0, 0.0, 2.0], 0.3),
        case("capsule", turned(&Piece::capsule(0.2, 0.08).unwrap(), quarter), 0.08, [0.0; 3], 0.3),
        case("sliding capsule", turned(&Piece::capsule(0.2, 0.08).unwrap(), quarter), 0.08, [0.0, 0.0, 1.0], 0.05),
        case("standing cylinder", cylinder.clone(), 0.1, [0.0, 0.0, 1.0], 0.1),
        case("wheel", turned(&cylinder, quarter), 0.15, [0.0; 3], 0.3),
    ]
}

fn slab(world: &World) -> World {
    on_boxes(world, &[(V::new(100.0, 100.0, 1.0), 0.0, V::new(0.0, 0.0, -1.0))])
}

fn compare(case: &Case, kind: &str, terrain: impl Into<Terrain>, steps: usize) {
    let name = format!("{} on {kind}", case.name);
    let world = empty(body(case.piece.clone()), case.friction);
    let wanted = run(&name, &slab(&world), case.start, steps);
    let found = run(&name, &on_terrain(&world, terrain), case.start, steps);
    if std::env::var("SHOW").is_ok() {
        let two = run(&name, &on_terrain(&world, level_field(1, 200.0)), case.start, steps);
        let mut most = (0.0_f64, 0.0_f64);
        for (step, ((a, b), c)) in wanted.iter().zip(&found).zip(&two).enumerate() {
            most = (most.0.max(apart(a, b)), most.1.max(apart(b, c)));
            if step % 20 == 0 { println!("{name} {step} {:e} {:e}", apart(a, b), apart(b, c)); }
        }
        println!("{name} most {most:?}");
        return;
    }
    for (step, (a, b)) in wanted.iter().zip(&found).enumerate() {
        assert!(apart(a, b) <= EQUAL, "{name}, step {step}: {:e}\n{a:?}\n{b:?}", apart(a, b));
    }
}

/// Bodies slide and roll over some hundred seams.
#[test]
fn bodies_cross_the_seams_of_a_field_as_one_slab() {
    for case in cases(2.0) {
        compare(&case, "a field", level_field(80, 0.1), 300);
    }
}

/// The same with points moved aside and random diagonals.
#[test]
fn bodies_cross_odd_seams_as_one_slab() {
    for case in cases(2.0) {
        if std::env::var("ONLY").is_ok_and(|only| only != case.name) { continue; }
        for seed in 0..3 {
            compare(&case, "an odd surface", odd_surface(40, 0.2, seed, |_, _| 0.0), 200);
        }
    }
}
