//! Starts that do not fit their joints, and the least change that makes them fit.

use crate::common::prelude::*;

fn bar(mass: f64, half: Vector3<f64>) -> RigidBody {
    RigidBody::solid_box(mass, half).unwrap()
}

fn world(bodies: Vec<RigidBody>, joints: Vec<Joint>) -> World {
    let parameters = Parameters { ground: None, time_step: 1e-3, ..Parameters::new(bodies) };
    World::new(parameters).unwrap().with_joints(joints).unwrap()
}

fn at(position: Vector3<f64>, velocity: Vector3<f64>) -> State {
    let attitude = Vector4::new(1.0, 0.0, 0.0, 0.0);
    State { position, attitude, velocity, spin: Vector3::zeros() }
}

/// Largest joint error [m, rad].
fn error(world: &World, states: &[State]) -> f64 {
    let errors = world.joints().iter().map(|joint| joint.error(states).unwrap());
    errors.map(|(place, turn)| place.max(turn)).fold(0.0, f64::max)
}

/// Checks two bodies pinned at their centres. They meet at the common centre of mass and take its
/// velocity.
#[test]
fn two_bodies_meet_at_their_common_centre() {
    let half = Vector3::repeat(0.1);
    let frames = [JointFrame::at(Vector3::zeros()); 2];
    let world =
        world(vec![bar(1.0, half), bar(3.0, half)], vec![Joint::spherical(0, Some(1), frames)]);
    let gap = Vector3::new(0.04, -0.02, 0.01);
    let states = [at(gap, Vector3::x() * 2.0), at(Vector3::zeros(), Vector3::y())];
    let (found, assembly) = world.assemble(&states).unwrap();
    for state in &found {
        assert!((state.position - gap * 0.25).norm() < 1e-13, "{}", state.position);
        let velocity = Vector3::new(0.5, 0.75, 0.0);
        assert!((state.velocity - velocity).norm() < 1e-9, "{}", state.velocity);
        assert!(state.spin.norm() < 1e-12);
    }
    assert!((assembly.place - 0.75 * gap.norm()).abs() < 1e-12, "{assembly:?}");
    assert!(assembly.to_string().contains("bodies were moved by up to 3.437e-2 m"), "{assembly}");
}

/// Checks that the change is the least one: half its square, weighted by mass, is stationary along
/// all motions that the joints allow. A hinged rod has its anchor displaced by δ. To first order it
/// moves by the fraction I/(I + m a²) of δ across itself.
#[test]
fn a_rod_is_moved_and_turned_as_its_mass_asks() {
    let rod = bar(2.0, Vector3::new(0.5, 0.02, 0.02));
    let inertia = rod.inertia()[(1, 1)];
    let anchor = Vector3::new(-0.5, 0.0, 0.0);
    let frames = [
        JointFrame::along(anchor, Vector3::y()).unwrap(),
        JointFrame::along(Vector3::zeros(), Vector3::y()).unwrap(),
    ];
    let world = world(vec![rod], vec![Joint::revolute(0, None, frames, Drive::NONE)]);
    let gap = 1e-4;
    let state = at(Vector3::new(0.5, 0.0, gap), Vector3::zeros());
    let (found, assembly) = world.assemble(&[state]).unwrap();
    let moved = found[0].position[2] - gap;
    let expected = -gap * inertia / (inertia + 2.0 * 0.25);
    assert!((moved - expected).abs() < 1e-3 * expected.abs(), "{moved} {expected}");
    assert!(error(&world, &found) < 1e-13);
    assert!((assembly.turn - (gap + expected) / 0.5).abs() < 1e-3 * gap, "{assembly:?}");
}

/// Checks a chain with roughly placed links. It is assembled to rounding, keeps its momenta, and
/// its first step is not an impact.
#[test]
fn a_scattered_chain_is_assembled() {
    let ends = [-Vector3::x() * 0.15, Vector3::x() * 0.15];
    let body = bar(1.0, Vector3::new(0.15, 0.04, 0.02));
    let count = 8;
    let joints: Vec<_> = (1..count)
        .map(|k| {
            let frames =
                ends.map(|end| JointFrame::along(end, Vector3::new(0.0, 1.0, 0.3)).unwrap());
            Joint::revolute(k, Some(k - 1), frames, Drive::NONE)
        })
        .collect();
    let world = world(vec![body; count], joints);
    let wave = |k: usize, n: f64| (n * (k as f64 + 0.7)).sin();
    let states: Vec<_> = (0..count)
        .map(|k| {
            let turn =
                Vector4::new(1.0, 0.05 * wave(k, 2.0), 0.05 * wave(k, 3.0), 0.05 * wave(k, 5.0));
            let off = Vector3::new(wave(k, 7.0), wave(k, 11.0), wave(k, 13.0)) * 0.03;
            State {
                position: Vector3::x() * (0.3 * k as f64) + off,
                attitude: turn.normalize(),
                velocity: Vector3::new(wave(k, 1.0), wave(k, 1.5), 0.0),
                spin: Vector3::new(0.0, wave(k, 2.5), wave(k, 4.0)) * 3.0,
            }
        })
        .collect();
    assert!(Simulation::new(world.clone(), states.clone(), Motion::native(&world)).is_err());
    let (found, assembly) = world.assemble(&states).unwrap();
    println!("{assembly}");
    assert!(error(&world, &found) < 1e-12, "{}", error(&world, &found));
    let sum = |states: &[State], of: &dyn Fn(&State) -> Vector3<f64>| -> Vector3<f64> {
        states.iter().map(of).sum()
    };
    let moved = sum(&found, &|x| x.position) - sum(&states, &|x| x.position);
    assert!(moved.norm() < 1e-12, "{moved}");
    let pushed = sum(&found, &|x| x.velocity) - sum(&states, &|x| x.velocity);
    assert!(pushed.norm() < 1e-9, "{pushed}");
    // The anchors of a joint have equal velocities.
    for joint in world.joints() {
        let point = |body: usize, anchor: &Vector3<f64>| {
            let state = &found[body];
            let turning: Matrix3<f64> = rotation(&state.attitude);
            state.velocity + turning * state.spin.cross(anchor)
        };
        let [a, b] = joint.frames();
        let apart = point(joint.body(), &a.anchor) - point(joint.other().unwrap(), &b.anchor);
        assert!(apart.norm() < 1e-8, "{apart}");
    }
    // A second assembly changes nothing.
    let (again, unchanged) = world.assemble(&found).unwrap();
    assert!(unchanged.place < 1e-12 && unchanged.velocity < 1e-8, "{unchanged}");
    let mut simulation = Simulation::new(world.clone(), again, Motion::native(&world)).unwrap();
    let mut record = StepRecord::new();
    simulation.step(&mut record).unwrap();
    assert!(record.residual() < 1e-9);
    let jumped = record.next_states().iter().zip(&found);
    let jumped = jumped.map(|(next, at)| (next.velocity - at.velocity).norm());
    assert!(jumped.fold(0.0, f64::max) < 0.2);
}

/// Checks that a violated limit is satisfied after assembly. A loop that cannot close is refused
/// with the name of its joint.
#[test]
fn infeasible_assemblies_are_rejected() {
    let rod = bar(1.0, Vector3::new(0.5, 0.02, 0.02));
    let pin = |x: f64, end: f64| {
        let frame = |anchor| JointFrame::along(anchor, Vector3::y()).unwrap();
        let frames = [frame(Vector3::new(end, 0.0, 0.0)), frame(Vector3::new(x, 0.0, 0.0))];
        Joint::revolute(0, None, frames, Drive { limits: Some([-0.1, 0.1]), ..Drive::NONE })
    };
    let hung = world(vec![rod.clone()], vec![pin(0.0, -0.5)]);
    let mut state = at(Vector3::new(0.5, 0.0, 0.0), Vector3::zeros());
    state.attitude = Vector4::new(0.1_f64.cos(), 0.0, 0.1_f64.sin(), 0.0);
    state.position = rotation(&state.attitude) * Vector3::new(0.5, 0.0, 0.0);
    let (found, _) = hung.assemble(&[state]).unwrap();
    let joint = &hung.joints()[0];
    let angle = joint.turns(&joint.coordinates(&found).unwrap(), &Vector3::zeros())[2];
    assert!((angle - 0.1).abs() < 1e-12, "{angle}");
    let torn = world(vec![rod], vec![pin(0.0, -0.5), pin(1.5, 0.5)]);
    let state = at(Vector3::new(0.75, 0.0, 0.0), Vector3::zeros());
    let refused = torn.assemble(&[state]).unwrap_err().to_string();
    assert!(refused.contains("apart; choose initial states that fit"), "{refused}");
    assert!(torn.assemble(&[]).is_err());
}
