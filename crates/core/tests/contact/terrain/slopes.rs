//! Slopes, ridges, valleys and plateaus.

use super::*;

/// Field about the origin whose heights depend on the grid point.
fn field(cells: usize, spacing: f64, height: impl Fn(f64, f64) -> f64) -> HeightField {
    let side = cells + 1;
    let corner = -0.5 * cells as f64 * spacing;
    let place = |index: usize| corner + index as f64 * spacing;
    let heights = (0..side * side).map(|at| height(place(at % side), place(at / side))).collect();
    HeightField::new(heights, side, [spacing; 2])
        .unwrap()
        .moved_by(&Matrix3::identity(), &V::new(corner, corner, 0.0))
        .unwrap()
}

/// Attitude of a rotation by `angle` about y.
fn about_y(angle: f64) -> Vector4<f64> {
    Vector4::new((angle / 2.0).cos(), 0.0, (angle / 2.0).sin(), 0.0)
}

/// A box slides down a slope with the acceleration g (sin α − μ cos α). The steps are exact for a
/// constant force.
#[test]
fn a_box_slides_down_a_slope() {
    let (angle, friction, steps) = (0.5_f64, 0.2, 150);
    let (s, c) = angle.sin_cos();
    let turn = Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c);
    let side = 121;
    let centred = V::new(-6.0, -6.0, 0.0);
    let slope = HeightField::new(vec![0.0; side * side], side, [0.1; 2]).unwrap();
    let slope = slope.moved_by(&Matrix3::identity(), &centred).unwrap();
    let slope = slope.moved_by(&turn, &V::zeros()).unwrap();
    let world = empty(body(Piece::cuboid(V::new(0.2, 0.15, 0.1)).unwrap()), friction);
    let begin = turn * V::new(-4.013, 0.027, 0.1);
    let start = State { attitude: about_y(angle), ..at(begin.into(), [0.0; 3], [0.0; 3]) };
    let last = *run("slope", &on_terrain(&world, slope), start, steps).last().unwrap();
    let speed = steps as f64 * 0.005 * 9.81 * (s - friction * c);
    let wanted = turn * V::new(speed, 0.0, 0.0);
    assert!((last.velocity - wanted).amax() < 1e-9, "{last:?}");
    assert!(last.spin.amax() < 1e-9, "{last:?}");
    let height = turn.tr_mul(&last.position).z;
    assert!((height - 0.1).abs() < 1e-9, "{height}");
}

/// A fast ball leaves a crest and flies freely; a slow one follows the slope.
#[test]
fn a_fast_ball_leaves_a_crest_and_a_slow_one_follows_it() {
    let slope = 0.3;
    let hill = || field(160, 0.1, |x, _| if x > 0.0 { -slope * x } else { 0.0 });
    let radius = 0.1;
    let world = empty(body(Piece::sphere(radius).unwrap()), 0.5);
    for (speed, flies) in [(6.0, true), (0.3, false)] {
        let spin = [0.0, speed / radius, 0.0];
        let start = at([-0.5, 0.033, radius], [speed, 0.0, 0.0], spin);
        let steps = if flies { 60 } else { 500 };
        let states = run("crest", &on_terrain(&world, hill()), start, steps);
        // Distance of the centre from the surface.
        let inner = slope.atan().sin();
        let distance = |p: &V| match p.x {
            x if x <= 0.0 => p.z,
            // Over the crest itself.
            x if x < inner * radius => (p.z * p.z + x * x).sqrt(),
            _ => (p.z + slope * p.x) / (1.0 + slope * slope).sqrt(),
        };
        let gaps: Vec<f64> =
            states.iter().map(|state| distance(&state.position) - radius).collect();
        let deepest = gaps.iter().copied().fold(0.0, f64::min);
        // Rolling from the crest onto the slope within a step: (v h)²/2r at 0.5 m/s.
        let passed = if flies { 1e-9 } else { (0.5 * 0.005_f64).powi(2) / (2.0 * radius) };
        assert!(deepest > -passed, "{speed} m/s: {deepest:e} m");
        let highest = gaps.iter().copied().fold(0.0, f64::max);
        if flies {
            let pairs = states.iter().zip(&states[1..]).filter(|(a, _)| a.position.x > 0.05);
            let mut in_flight = 0;
            for (a, b) in pairs
                .take_while(|(_, b)| distance(&b.position) - radius > 1e-3 || b.position.x < 0.4)
            {
                let change = b.velocity - a.velocity;
                assert!((change - V::new(0.0, 0.0, -9.81 * 0.005)).amax() < 1e-12, "{a:?} {b:?}");
                in_flight += 1;
            }
            assert!(in_flight > 20, "{in_flight} steps in flight");
        } else {
            // A step of free fall along the tangent of the crest: v h slope.
            assert!(highest < speed * 4.0 * 0.005 * slope, "{highest:e} m");
            assert!(states.last().unwrap().position.x > 0.5);
        }
    }
}

/// A ball and a box slide into a valley like between two boxes.
#[test]
fn bodies_slide_into_a_valley_as_between_two_boxes() {
    let angle = 0.4_f64;
    let valley = || field(80, 0.1, |x, _| x.abs() * angle.tan());
    let (s, c) = angle.sin_cos();
    // Boxes whose upper faces are the planes through the y axis.
    let half = V::new(10.0, 10.0, 1.0);
    let boxes = [(half, angle, -V::new(s, 0.0, c)), (half, -angle, -V::new(-s, 0.0, c))];
    let piece = Piece::sphere(0.12).unwrap();
    let world = empty(body(piece), 0.3);
    let x = 1.4;
    let height = x * angle.tan() + 0.12 / c;
    let start = at([x, 0.018, height], [0.0, 0.2, 0.0], [0.0; 3]);
    let wanted = run("valley", &on_boxes(&world, &boxes), start, 300);
    let found = run("valley", &on_terrain(&world, valley()), start, 300);
    assert_same("valley", &wanted, &found, 1e-9, 1e-8);
}

/// A box that is larger than a plateau stands on its corners.
#[test]
fn a_box_stands_on_the_corners_of_a_plateau() {
    let raised = |at: f64| at > -0.15 && at < 0.25;
    let height = |x: f64, y: f64| if raised(x) && raised(y) { 0.2 } else { 0.0 };
    let world = empty(body(Piece::cuboid(V::new(0.4, 0.5, 0.1)).unwrap()), 0.3);
    let world = on_terrain(&world, field(20, 0.1, height));
    let start = at([0.03, 0.02, 0.3], [0.0; 3], [0.0; 3]);
    let mut run = Simulation::new(world.clone(), [start], Motion::native(&world)).unwrap();
    let mut record = StepRecord::new();
    for _ in 0..100 {
        run.step(&mut record).unwrap();
        assert_eq!(record.first().solution.contacts.len(), 4);
    }
    let last = &record.next_states()[0];
    assert!((last.position - start.position).amax() < 1e-10, "{last:?}");
}

/// A box that slides against a steep slope stops there and does not climb it.
#[test]
fn a_box_that_slides_against_a_step_stops_there() {
    // The step is a cell wide, so it is a steep slope: its foot is at x = 1, its top at x = 1.1.
    let steep = || field(40, 0.1, |x, _| if x > 1.05 { 1.0 } else { 0.0 });
    let world = empty(body(Piece::cuboid(V::new(0.2, 0.15, 0.1)).unwrap()), 0.1);
    let start = at([0.0, 0.013, 0.1], [3.0, 0.0, 0.0], [0.0; 3]);
    let states = run("step", &on_terrain(&world, steep()), start, 200);
    let inertia = world.bodies()[0].inertia();
    let energy = |state: &State| {
        let speed = state.velocity.norm_squared() + state.spin.dot(&(inertia * state.spin));
        0.5 * speed + 9.81 * state.position.z
    };
    for (a, b) in states.iter().zip(&states[1..]) {
        assert!(energy(b) <= energy(a) + 1e-9, "{a:?} {b:?}");
    }
    let last = states.last().unwrap();
    assert!(last.position.x < 0.9 && last.position.z < 0.2, "{last:?}");
}
