//! Level terrain: bodies move as on one slab.

use super::*;

/// Largest difference of places from those on the slab (m).
const PLACE: f64 = 1e-9;
/// Largest difference of attitudes. Steps are solved to 1e-9 m/s, which is 1e-8 rad/s at an arm of
/// 0.1 m.
const ATTITUDE: f64 = 1e-8;

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
        case(
            "sliding capsule",
            turned(&Piece::capsule(0.2, 0.08).unwrap(), quarter),
            0.08,
            [0.0, 0.0, 1.0],
            0.05,
        ),
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
    assert_same(&name, &wanted, &found, PLACE, ATTITUDE);
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
fn bodies_cross_irregular_seams_as_one_slab() {
    for case in cases(2.0) {
        for seed in 0..3 {
            compare(&case, "an odd surface", odd_surface(40, 0.2, seed, |_, _| 0.0), 200);
        }
    }
}

/// Bodies fall on a vertex, an edge, and beside them, flat and tilted.
#[test]
fn bodies_fall_on_seams_as_on_one_slab() {
    // Points of the field are at multiples of 0.1 m, and diagonals at x − y = 0.
    let places =
        [[0.0, 0.0], [0.05, 0.0], [0.1, 0.05], [0.05, 0.05], [0.05 + 1e-7, 0.05], [3e-6, 1e-6]];
    let tilted = Vector4::new(0.99, 0.08, -0.05, 0.1).normalize();
    let pieces = [
        ("box", Piece::cuboid(V::new(0.2, 0.1, 0.05)).unwrap(), 0.05),
        ("ball", Piece::sphere(0.1).unwrap(), 0.1),
        ("cylinder", Piece::cylinder(0.1, 0.15, 24).unwrap(), 0.1),
    ];
    for (name, piece, height) in &pieces {
        let world = empty(body(piece.clone()), 0.5);
        for [x, y] in places {
            for (attitude, above) in [(Vector4::new(1.0, 0.0, 0.0, 0.0), 0.03), (tilted, 0.1)] {
                // The forces of 24 points that land one after the other are not unique.
                if *name == "cylinder" && above > 0.05 {
                    continue;
                }
                let start = at([x, y, height + above], [0.2, -0.1, -1.0], [0.0; 3]);
                let start = State { attitude, ..start };
                let name = format!("{name} at {x}, {y}, tilt {above}");
                let wanted = run(&name, &slab(&world), start, 60);
                let found = run(&name, &on_terrain(&world, level_field(20, 0.1)), start, 60);
                assert_same(&name, &wanted, &found, PLACE, ATTITUDE);
            }
        }
    }
}

/// Boxes that slid to a place near the border of a field lie still there when another body moves. Its motion
/// starts a new search for all of them, in which triangles replace a plane or a plane triangles.
#[test]
fn boxes_near_a_border_lie_still_beside_one_that_moves() {
    const COUNT: usize = 24;
    let piece = Piece::cuboid(V::new(0.03, 0.03, 0.03)).unwrap();
    let bodies = vec![body(piece); COUNT + 1];
    let world =
        Parameters { ground: None, friction: 0.2, time_step: 0.005, ..Parameters::new(bodies) };
    let world = on_terrain(&euler(world), level_field(20, 0.1));
    let mut start: Vec<_> = (0..COUNT)
        .map(|k| {
            at([0.8 + 0.004 * k as f64, 0.07 * k as f64 - 0.85, 0.03], [0.3, 0.0, 0.0], [0.0; 3])
        })
        .collect();
    start.push(at([-0.9, 0.9, 0.03], [0.0; 3], [0.0; 3]));
    let mut run = Simulation::new(world.clone(), start, Motion::native(&world)).unwrap();
    let mut record = StepRecord::new();
    for step in 0..150 {
        if step == 60 {
            let push = Wrench { force: V::new(8.0, 0.0, 0.0), torque: V::zeros() };
            run.set_wrench(COUNT, push).unwrap();
        }
        run.step(&mut record).unwrap();
        for (index, state) in record.next_states()[..COUNT].iter().enumerate() {
            let off = (state.position.z - 0.03).abs();
            assert!(off <= 1e-9, "step {step}, box {index}: {off:e} m");
        }
    }
    assert!(record.next_states()[COUNT].position.x > -0.4);
}

/// Ten thousand seams: a ball, a box and a capsule on 5000 cells of 0.1 m.
#[test]
#[ignore = "campaign: some minutes"]
fn bodies_cross_ten_thousand_seams_as_one_slab() {
    for case in cases(10.0) {
        let mut heights = Vec::new();
        heights.resize(5001 * 41, 0.0);
        let field = HeightField::new(heights, 5001, [0.1; 2]).unwrap();
        let field = field.moved_by(&Matrix3::identity(), &V::new(-2.0, -2.0, 0.0)).unwrap();
        let start = State { velocity: V::new(10.0, 0.0, 0.0), ..case.start };
        let case = Case { friction: 0.0, start, ..case };
        let name = format!("{} over ten thousand seams", case.name);
        let world = empty(body(case.piece.clone()), case.friction);
        let long = V::new(1000.0, 10.0, 1.0);
        let slab = on_boxes(&world, &[(long, 0.0, V::new(0.0, 0.0, -1.0))]);
        let wanted = run(&name, &slab, case.start, 9900);
        let found = run(&name, &on_terrain(&world, field), case.start, 9900);
        assert_same(&name, &wanted, &found, PLACE, ATTITUDE);
    }
}
