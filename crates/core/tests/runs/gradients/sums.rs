//! Derivatives of drives that act on sums of coordinates: springs, dry friction, motors and limits
//! on q₁ − r q₂ − q₀ of random mechanisms. They are compared with central differences, and
//! transposed products with forward ones. A spring between two slides has a closed form.

use super::draw::Draw;
use super::laws::{self, mechanism};
use super::{Direction, apart, difference, size, step, transposed};
use crate::common::prelude::*;
use rand_mt::Mt;
use tumble_core::solver::native::StepGradient;

/// Drives in different regimes, for the value `s` of the sum.
fn drives(s: f64) -> [(&'static str, Drive); 9] {
    let none = Drive::NONE;
    let motor = |motor| Drive { motor: Some(motor), ..none };
    let position = |most| {
        motor(Motor::Position { target: s + 0.2, stiffness: 30.0, damping: 0.4, max_force: most })
    };
    [
        ("spring", Drive { stiffness: 20.0, damping: 0.5, rest: 0.3, force: 0.4, ..none }),
        ("slip", Drive { friction: 0.5, damping: 0.2, ..none }),
        ("stick", Drive { friction: 1e4, ..none }),
        ("held place", position(1e4)),
        ("weak place", position(0.2)),
        ("held speed", motor(Motor::Speed { target: 0.7, max_force: 1e4 })),
        ("weak speed", motor(Motor::Speed { target: 20.0, max_force: 0.3 })),
        ("damper", motor(Motor::Damper { target: 0.4, damping: 0.8, max_force: 1e3 })),
        ("stop", Drive { limits: Some([s - 1e-3, s + 1e-3]), stiffness: 5.0, ..none }),
    ]
}

/// Change that moves each body along its joint with the world: a translation along a slide's axis,
/// or a rotation about a hinge's axis.
fn along_joints(world: &World, states: &[State], draw: &mut Draw) -> Vec<StateChange> {
    let each = world.joints().iter().zip(states).map(|(joint, state)| {
        let frame = &joint.frames()[1];
        let (axis, by) = (frame.rotation() * Vector3::z(), draw.unit());
        let mut change = StateChange::zero();
        match joint.linear()[2] {
            Axis::Free(_) => change.position = axis * by,
            Axis::Locked => {
                change.position = axis.cross(&(state.position - frame.anchor)) * by;
                change.turn = state.pose().rotation.tr_mul(&axis) * by;
            }
        }
        change
    });
    each.collect()
}

fn directions(world: &World, states: &[State], draw: &mut Draw) -> Vec<Direction> {
    let still = || vec![StateChange::zero(); 2];
    let mut all = Vec::new();
    let mut add = |name: &str, states, wrenches, constants| {
        all.push(Direction { name: name.into(), states, wrenches, constants });
    };
    add("place", along_joints(world, states, draw), vec![], vec![]);
    let faster = |draw: &mut Draw| StateChange {
        velocity: draw.vector(1.0),
        spin: draw.vector(1.0),
        ..StateChange::zero()
    };
    let moving = vec![faster(draw), faster(draw)];
    add("speed", moving, vec![], vec![]);
    let push = |draw: &mut Draw| Wrench { force: draw.vector(10.0), torque: draw.vector(3.0) };
    let pushes = vec![push(draw), push(draw)];
    add("push", still(), pushes, vec![]);
    for constant in [Constant::GearRatio, Constant::GearOffset] {
        add(constant.name(), still(), vec![], vec![(constant, vec![1.0])]);
    }
    for constant in [Constant::TimeStep, Constant::Mass, Constant::JointDamping] {
        let own = constant.values(world);
        let numbers = own.iter().map(|own| 0.3 * own).collect();
        add(constant.name(), still(), vec![], vec![(constant, numbers)]);
    }
    all
}

/// Checks the derivatives by all arguments that influence such a drive.
#[test]
fn drawn_mechanisms_under_drives_of_sums() {
    let mut draw = Draw(Mt::new(23));
    let (mut compared, mut left_out, mut worst, mut replaced) = ([0; 9], 0, 0.0_f64, 0);
    for number in 0..54 {
        let (held, states) = mechanism(number % 3, &mut draw);
        let own = held.gears()[0];
        let [first, second] = *own.axes();
        let free = Gear::new(first, second, own.ratio(), own.offset() - 0.1);
        let sum = free.coordinate(held.joints(), &states, &[]);
        let which = number / 3 % 9;
        let (regime, drive) = drives(sum)[which];
        let world = held.with_gears(vec![free.with_drive(drive)]).unwrap();
        // A step that makes energy is replaced by shorter ones, which have no derivative.
        let Some((simulation, base)) = step(&world, &states, &[]) else {
            replaced += 1;
            continue;
        };
        let mut derivative = StepDerivative::new();
        simulation.linearise(&base, &mut derivative).unwrap();
        let h = world.time_step();
        let all = directions(&world, &states, &mut draw);
        transposed(
            &mut derivative,
            &all,
            &mut || draw.unit(),
            &format!("{number}, {regime}"),
            1e-9,
        );
        for along in all {
            let constants: Vec<_> = along.constants.iter().map(|(c, n)| (*c, &n[..])).collect();
            let (changes, wrenches) = (&along.states, &along.wrenches);
            let change = StepChange { states: changes, wrenches, constants: &constants };
            let mut found = Vec::new();
            derivative.jvp(&change, &mut found).unwrap();
            let at = format!("{number}, {regime}, {}", along.name);
            for by in [1e-4, 1e-5] {
                if derivative.margin() < 10.0 * by * (1.0 / h + size(&found)) {
                    left_out += 1;
                    continue;
                }
                let ends = (&states[..], base.next_states());
                let Some((expected, _)) = difference(&world, ends, &along, by) else { continue };
                let (scale, off) = (size(&expected).max(1e-3), apart(&found, &expected));
                // Where dry friction holds three axes, solutions scatter by 5e-12 m/s.
                let rounding = 1e-11 / by;
                assert!(off < 1e-6 * scale + rounding, "{at}: {off:.1e} of {scale}");
                worst = worst.max(off / scale);
                compared[which] += 1;
            }
        }
    }
    println!("{compared:?} compared, {left_out} left out, worst {worst:.1e}");
    assert!(compared.iter().all(|count| *count > 30), "{compared:?}");
    assert!(replaced <= 5, "{replaced} of 54");
}

/// Checks a spring of stiffness k on s = x₁ − r x₂ − q₀ between two slides. The force F = k (x* −
/// s⁺) acts on x₁, and −r F on x₂. With the sum σ = s + h (v₁ − r v₂) without the spring
///
/// ```text
/// F = k (x* − σ)/(1 + h² k w),   w = 1/m₁ + r²/m₂,   v₁⁺ = v₁ + h F/m₁
/// ```
#[test]
fn a_spring_between_two_slides() {
    const H: f64 = laws::H;
    let (ratio, offset, masses) = (-1.5, 0.1, [2.0, 3.0]);
    let (x, v, k, rest) = ([0.3, 0.4], [0.3, 0.7], 200.0, 0.6);
    let bodies = masses.map(|mass| RigidBody::solid_box(mass, Vector3::repeat(0.1)).unwrap());
    let frame = JointFrame::at(Vector3::zeros());
    // The slides are one metre apart.
    let place = |body: usize| JointFrame::at(Vector3::x() * body as f64);
    let slides = [0, 1].map(|body| Joint::prismatic(body, None, [frame, place(body)], Drive::NONE));
    let axis = |joint| GearAxis { joint, axis: JointAxis::Linear(2) };
    let drive = Drive { stiffness: k, rest, ..Drive::NONE };
    let gear = Gear::new(axis(0), axis(1), ratio, offset).with_drive(drive);
    let world = laws::world(bodies.to_vec(), Vector3::zeros());
    let world = world.with_joints(slides.to_vec()).unwrap().with_gears(vec![gear]).unwrap();
    let state = |x: f64, speed: f64| State {
        velocity: Vector3::z() * speed,
        ..State::at_rest(Vector3::z() * x)
    };
    let mut states = [state(x[0], v[0]), state(x[1], v[1])];
    states[1].position.x = 1.0;
    let (simulation, record) = step(&world, &states, &[]).unwrap();
    let speed = |ratio: f64, offset: f64, x: [f64; 2]| {
        let sum = x[0] - ratio * x[1] - offset + H * (v[0] - ratio * v[1]);
        let w = 1.0 / masses[0] + ratio * ratio / masses[1];
        v[0] + H / masses[0] * k * (rest - sum) / (1.0 + H * H * k * w)
    };
    let end = record.next_states()[0].velocity[2];
    assert!((end - speed(ratio, offset, x)).abs() < 1e-12);
    let slope = |of: &dyn Fn(f64) -> f64| (of(1e-4) - of(-1e-4)) / 2e-4;
    let mut derivative = StepDerivative::new();
    simulation.linearise(&record, &mut derivative).unwrap();
    let mut gradient = StepGradient::default();
    let mut by_end = vec![StateChange::zero(); 2];
    by_end[0].velocity = Vector3::z();
    derivative.vjp(&by_end, &[Constant::GearRatio, Constant::GearOffset], &mut gradient).unwrap();
    let found = [
        gradient.constants[0][0],
        gradient.constants[1][0],
        gradient.states[0].position[2],
        gradient.states[1].position[2],
    ];
    let expected = [
        slope(&|by| speed(ratio + by, offset, x)),
        slope(&|by| speed(ratio, offset + by, x)),
        slope(&|by| speed(ratio, offset, [x[0] + by, x[1]])),
        slope(&|by| speed(ratio, offset, [x[0], x[1] + by])),
    ];
    for (found, expected) in found.into_iter().zip(expected) {
        assert!((found - expected).abs() < 1e-7 * expected.abs(), "{found} {expected}");
    }
}
