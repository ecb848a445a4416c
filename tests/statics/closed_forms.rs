//! Limits with closed forms.

use super::{GRAVITY, Scene, assert_close, stands};
use nalgebra::Vector3;
use tumble::statics::{Limit, LoadCase, Structure};
use tumble::{Piece, RigidBody, State};

#[test]
fn a_block_slides_or_tips_on_a_slope() {
    for (half, friction, expected) in
        [([0.1, 0.2, 0.1], 0.5, 0.5), ([0.1, 0.2, 0.4], 0.5, 0.25), ([0.3, 0.2, 0.2], 0.0, 0.0)]
    {
        let mut scene = Scene::new(friction);
        scene.add_box(3.0, half, [0.0, 0.0, half[2]]);
        let structure = scene.structure();
        let case = LoadCase::tilt(&structure, Vector3::y()).unwrap();
        let factor = structure.largest_factor(&case).factor().unwrap();
        assert!((factor - expected).abs() <= 1e-6, "{half:?}: {factor}");
    }
}

#[test]
fn a_block_slides_or_tips_under_a_push_at_any_height() {
    let (mass, half, friction) = (2.0, [0.15, 0.1, 0.3], 0.6);
    for height in [0.02, 0.1, 0.2, 0.25, 0.3, 0.45, 0.6] {
        let mut scene = Scene::new(friction);
        scene.add_box(mass, half, [0.0, 0.0, half[2]]);
        let factor = scene.largest_push(0, [1.0, 0.0, 0.0], [0.0, 0.0, height - half[2]]);
        let expected = mass * GRAVITY * f64::min(friction, half[0] / height);
        assert_close(factor, expected, 1e-6);
    }
}

#[test]
fn a_block_lifted_by_its_weight_leaves_the_ground() {
    let mut scene = Scene::new(0.5);
    scene.add_box(2.0, [0.1; 3], [0.0, 0.0, 0.1]);
    assert_close(scene.largest_push(0, [0.0, 0.0, 1.0], [0.0; 3]), 2.0 * GRAVITY, 1e-6);
    // Pressed down, nothing limits the push.
    let structure = scene.structure();
    let case = LoadCase::push(&structure, 0, -Vector3::z(), Vector3::zeros()).unwrap();
    assert!(matches!(structure.largest_factor(&case), Limit::Unlimited(_)));
}

#[test]
fn a_climber_on_a_ladder() {
    // The ladder is a capsule: it touches below the lower end's centre and beside the upper one's.
    let (half, radius, angle, friction, mass) = (2.0, 0.05, 1.0_f64, 0.3, 12.0);
    let mut scene = Scene::new(friction);
    let body = RigidBody::solid(mass, &[Piece::capsule(half, radius).unwrap()]).unwrap().0;
    let (run, rise) = (2.0 * half * angle.cos(), 2.0 * half * angle.sin());
    // The capsule's axis is z; it leans towards −x at the wall x = 0.
    let turn = 0.5 * (std::f64::consts::FRAC_PI_2 - angle);
    let mut state = State::at_rest([radius + 0.5 * run, 0.0, radius + 0.5 * rise]);
    state.attitude = [turn.cos(), 0.0, -turn.sin(), 0.0].into();
    scene.bodies.push(body);
    scene.states.push(state);
    let wall = Piece::cuboid(Vector3::new(0.5, 2.0, 4.0)).unwrap();
    scene.fixed.push(
        wall.moved_by(&nalgebra::Matrix3::identity(), &Vector3::new(-0.5, 0.0, 4.0)).unwrap(),
    );
    let structure = scene.structure();
    assert!(stands(&structure));
    let share = 0.9;
    let place = Vector3::new(-(share - 0.5) * run, 0.0, (share - 0.5) * rise);
    let case = LoadCase::mass(&structure, 0, place).unwrap();
    let climber = structure.largest_factor(&case).factor().unwrap();
    // Both ends are at their limits: N₂ = μ N₁, N₁ + μ N₂ = W. Moments about the foot.
    let (foot_to_wall, up) = (run + radius, rise + radius);
    let lever = (friction * up + friction * friction * foot_to_wall) / (1.0 + friction * friction);
    let expected = mass * (lever - 0.5 * run) / (share * run - lever);
    assert_close(climber, expected, 1e-6);
}

/// Books of length 2 m at the edge x = 0 of a table, each with `share` of the largest overhang.
fn books(count: usize, share: f64) -> Scene {
    let mut scene = Scene::new(0.5);
    scene.has_ground = false;
    let table = Piece::cuboid(Vector3::new(2.0, 1.0, 0.5)).unwrap();
    scene.fixed.push(
        table.moved_by(&nalgebra::Matrix3::identity(), &Vector3::new(-2.0, 0.0, -0.5)).unwrap(),
    );
    let mut edge = 0.0;
    for place in 0..count {
        edge += share / (count - place) as f64;
        scene.add_box(1.0, [1.0, 0.5, 0.1], [edge - 1.0, 0.0, 0.1 + 0.2 * place as f64]);
    }
    scene
}

#[test]
fn books_overhang_by_the_harmonic_series() {
    for count in [1, 2, 5, 10] {
        assert!(stands(&books(count, 1.0 - 1e-4).structure()), "{count}");
        assert!(!stands(&books(count, 1.0 + 1e-4).structure()), "{count}");
    }
}

#[test]
fn a_pyramid_of_four_balls_needs_friction() {
    let mut scene = Scene::new(0.5);
    let ball = RigidBody::solid(1.0, &[Piece::sphere(0.5).unwrap()]).unwrap().0;
    let side = 1.0 / 3.0_f64.sqrt();
    for k in 0..3 {
        let angle = f64::from(k) * std::f64::consts::TAU / 3.0;
        scene.add(ball.clone(), [side * angle.cos(), side * angle.sin(), 0.5]);
    }
    scene.add(ball, [0.0, 0.0, 0.5 + (2.0_f64 / 3.0).sqrt()]);
    let factor = scene.structure().smallest_friction().factor().unwrap();
    // Lines from the lower centres to the upper one lean by α: tan (α/2) where balls touch.
    let lean = side.asin();
    assert_close(0.5 * factor, (0.5 * lean).tan(), 3e-6);
}

#[test]
fn a_wedge_hangs_up_to_the_friction_angle() {
    // A slot that widens downwards. Forces grow without bound towards the friction angle.
    let lean = 0.2_f64;
    let hangs = |friction: f64| {
        let mut scene = Scene::new(friction);
        scene.has_ground = false;
        let (low, high) = (0.5 + 0.5 * lean.tan(), 0.5 - 0.5 * lean.tan());
        let quad = |points: [[f64; 2]; 4]| -> Vec<Vector3<f64>> {
            let ends = [-0.3, 0.3].into_iter();
            ends.flat_map(|y| points.map(|[x, z]| Vector3::new(x, y, z))).collect()
        };
        scene.add_hull(1.0, &quad([[-low, -0.5], [low, -0.5], [high, 0.5], [-high, 0.5]]));
        for side in [-1.0, 1.0] {
            let wall = [[low, -0.5], [high, 0.5], [2.0, 0.5], [2.0, -0.5]];
            let wall = quad(wall.map(|[x, z]| [side * x, z]));
            scene.fixed.push(Piece::hull(&wall, 0.0).unwrap());
        }
        stands(&scene.structure())
    };
    assert!(hangs(1.01 * lean.tan()));
    assert!(!hangs(0.99 * lean.tan()));
}

#[test]
fn boards_lean_against_each_other() {
    let (half, radius, lean) = (1.0, 0.02, 0.4_f64);
    let mut scene = Scene::new(0.5);
    let body = RigidBody::solid(1.0, &[Piece::capsule(half, radius).unwrap()]).unwrap().0;
    for side in [-1.0, 1.0] {
        let x = side * (radius + half * lean.sin());
        let mut state = State::at_rest([x, 0.0, radius + half * lean.cos()]);
        state.attitude = [(0.5 * lean).cos(), 0.0, -side * (0.5 * lean).sin(), 0.0].into();
        scene.bodies.push(body.clone());
        scene.states.push(state);
    }
    let factor = scene.structure().smallest_friction().factor().unwrap();
    // The tops push with H: moments about a foot's touching point, W half sin = H (2 half cos + r).
    let push = half * lean.sin() / (2.0 * half * lean.cos() + radius);
    assert_close(0.5 * factor, push, 3e-6);
}

#[test]
fn what_two_and_three_fingers_can_hold() {
    // Fingers on slides press with 30 N each; the held cylinder hangs by friction.
    for count in [2, 3] {
        let (friction, press) = (0.4, 30.0);
        let mut scene = Scene::new(friction);
        scene.has_ground = false;
        let held = RigidBody::solid(1.0, &[Piece::sphere(0.1).unwrap()]).unwrap().0;
        scene.add(held, [0.0; 3]);
        let finger = RigidBody::solid(0.1, &[Piece::sphere(0.02).unwrap()]).unwrap().0;
        let mut joints = Vec::new();
        for k in 0..count {
            let angle = f64::from(k) * std::f64::consts::TAU / f64::from(count);
            let out = Vector3::new(angle.cos(), angle.sin(), 0.0);
            let place = out * 0.12;
            scene.add(finger.clone(), place.into());
            joints.push(super::joints::slide(scene.bodies.len() - 1, &place, &-out, press));
        }
        let world = scene.world().with_joints(joints).unwrap();
        let structure = Structure::at_rest(&world, &scene.states, &[]).unwrap().0;
        let case = LoadCase::mass(&structure, 0, Vector3::zeros()).unwrap();
        let more = structure.largest_factor(&case).factor().unwrap();
        assert_close(1.0 + more, f64::from(count) * friction * press / GRAVITY, 1e-6);
    }
}
