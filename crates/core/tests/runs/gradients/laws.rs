//! Derivatives by ratios and offsets of gears, and by rest positions, forces and limits of axes.
//! They are compared with closed forms, and with central differences of random mechanisms.

use super::draw::Draw;
use super::own::seen_from;
use super::{Direction, apart, difference, size, step};
use crate::common::prelude::*;
use rand_mt::Mt;
use tumble_core::solver::native::StepGradient;

pub const H: f64 = 0.005;

pub fn world(bodies: Vec<RigidBody>, gravity: Vector3<f64>) -> World {
    let parameters = Parameters {
        ground: None,
        gravity,
        friction: 0.0,
        time_step: H,
        ..Parameters::new(bodies)
    };
    euler(parameters)
}

/// Checks two carriages on slides along z with x₁⁺ = r x₂⁺ + q₀ at the end of the step:
///
/// ```text
/// v₁⁺ = r v₂⁺ + c,   c = (r x₂ + q₀ − x₁)/h
/// v₂⁺ = N/D,   N = m₂ v₂ + m₁ r (v₁ − c),   D = m₂ + m₁ r²
/// ```
#[test]
fn two_carriages_by_their_gear() {
    let (ratio, masses, x2, speeds) = (-1.5, [2.0, 3.0], 0.4, [0.3, 0.7]);
    let offset = 0.1;
    let bodies = masses.map(|mass| RigidBody::solid_box(mass, Vector3::repeat(0.1)).unwrap());
    let frame = JointFrame::at(Vector3::zeros());
    let slides = [0, 1].map(|body| Joint::prismatic(body, None, [frame, frame], Drive::NONE));
    let axis = |joint| GearAxis { joint, axis: JointAxis::Linear(2) };
    let world = world(bodies.to_vec(), Vector3::zeros()).with_joints(slides.to_vec()).unwrap();
    let world = world.with_gears(vec![Gear::new(axis(0), axis(1), ratio, offset)]).unwrap();
    let state =
        |x, speed| State { velocity: Vector3::z() * speed, ..State::at_rest(Vector3::z() * x) };
    let states = [state(ratio * x2 + offset, speeds[0]), state(x2, speeds[1])];
    let (m1, m2) = (masses[0], masses[1]);
    let below = m2 + m1 * ratio * ratio;
    let above = m2 * speeds[1] + m1 * ratio * speeds[0];
    let by_ratio =
        (m1 * speeds[0] - m1 * ratio * x2 / H) / below - above / below * 2.0 * m1 * ratio / below;
    let by_offset = -m1 * ratio / H / below;
    let (simulation, record) = step(&world, &states, &[]).unwrap();
    assert!((record.next_states()[1].velocity[2] - above / below).abs() < 1e-12);
    let mut derivative = StepDerivative::new();
    simulation.linearise(&record, &mut derivative).unwrap();
    let (mut end, mut gradient) = (Vec::new(), StepGradient::default());
    let by_end = StateChange { velocity: Vector3::z(), ..StateChange::zero() };
    let asked = [Constant::GearRatio, Constant::GearOffset];
    derivative.vjp(&[StateChange::zero(), by_end], &asked, &mut gradient).unwrap();
    for ((constant, expected), pulled) in
        asked.into_iter().zip([by_ratio, by_offset]).zip(&gradient.constants)
    {
        let constants = [(constant, &[1.0][..])];
        let change = StepChange { constants: &constants, ..StepChange::default() };
        derivative.jvp(&change, &mut end).unwrap();
        for found in [end[1].velocity[2], pulled[0]] {
            let off = (found - expected).abs();
            assert!(off < 1e-10 * expected.abs(), "{constant:?} {found} {expected}");
        }
    }
}

/// Checks the derivative by a limit: v⁺ = (x* − x)/h at the limit, and no influence before it.
#[test]
fn a_stop_by_where_it_is() {
    let frame = JointFrame::at(Vector3::zeros());
    let drive = Drive { limits: Some([-0.2, 0.302]), stiffness: 20.0, ..Drive::NONE };
    let body = RigidBody::solid_box(2.0, Vector3::repeat(0.1)).unwrap();
    let joint = Joint::prismatic(0, None, [frame, frame], drive);
    let world = world(vec![body], Vector3::zeros()).with_joints(vec![joint]).unwrap();
    for (x, speed, expected) in
        [(0.3, 0.7, [0.0, 1.0 / H]), (-0.2, -0.7, [1.0 / H, 0.0]), (0.0, 0.7, [0.0, 0.0])]
    {
        let state = State { velocity: Vector3::z() * speed, ..State::at_rest(Vector3::z() * x) };
        let (simulation, record) = step(&world, &[state], &[]).unwrap();
        let mut derivative = StepDerivative::new();
        simulation.linearise(&record, &mut derivative).unwrap();
        let by_end = [StateChange { velocity: Vector3::z(), ..StateChange::zero() }];
        let mut gradient = StepGradient::default();
        derivative.vjp(&by_end, &[Constant::JointLimits], &mut gradient).unwrap();
        for (found, expected) in gradient.constants[0].iter().zip(expected) {
            assert!((found - expected).abs() < 1e-8, "at {x}: {found} {expected}");
        }
    }
}

/// Frame `at`, moved along its own z and rotated by a quaternion in its own axes.
fn shifted(at: &JointFrame, along: f64, turn: Vector4<f64>) -> JointFrame {
    JointFrame {
        anchor: at.anchor + at.rotation() * Vector3::z() * along,
        attitude: left(&at.attitude) * turn.normalize(),
    }
}

/// Two bodies on joints with the world: one of six pairs of joints, and the gears between them.
pub fn mechanism(kind: usize, draw: &mut Draw) -> (World, Vec<State>) {
    let mut state = || State {
        position: draw.vector(0.5),
        attitude: draw.attitude(),
        velocity: draw.vector(1.0),
        spin: draw.vector(3.0),
    };
    let mut states = vec![state(), state()];
    states[1].position += Vector3::x() * 2.0;
    let at = [0; 2].map(|_| JointFrame { anchor: draw.vector(0.7), attitude: draw.attitude() });
    let half = [0; 2].map(|_| Vector3::repeat(0.1) + draw.vector(0.05));
    let bodies = half.map(|half| RigidBody::solid_box(1.5 + draw.unit(), half).unwrap());
    let (turned, along): (f64, f64) = (0.5 * draw.unit(), 0.3 * draw.unit());
    let hinged = Vector4::new((0.5 * turned).cos(), 0.0, 0.0, (0.5 * turned).sin());
    let skew = Vector4::new(1.0, 0.15, 0.2, -0.1);
    let straight = Vector4::new(1.0, 0.0, 0.0, 0.0);
    let frames = |body: usize, along: f64, turn: Vector4<f64>| {
        [seen_from(&states[body], &shifted(&at[body], along, turn)), at[body]]
    };
    let spring = Drive { stiffness: 20.0, rest: 0.7, damping: 0.5, force: 0.3, ..Drive::NONE };
    // At speeds of up to 3 rad/s and 1 m/s a step moves 15 mrad and 5 mm.
    let around = |at: f64| Drive { limits: Some([at - 1e-3, at + 1e-3]), ..spring };
    let axis = |joint, axis| GearAxis { joint, axis };
    let hinge = |body, drive| Joint::revolute(body, None, frames(body, 0.0, hinged), drive);
    let about = JointAxis::Angular(2);
    let (joints, geared) = match kind {
        0 | 3 => (vec![hinge(0, spring), hinge(1, Drive::NONE)], Some([about; 2])),
        1 => {
            let slide = Joint::prismatic(0, None, frames(0, along, straight), spring);
            (vec![slide, hinge(1, spring)], Some([JointAxis::Linear(2), about]))
        }
        2 => {
            let gimbal = Joint::gimbal(0, None, frames(0, 0.0, skew), [spring; 3]);
            (vec![gimbal, hinge(1, spring)], Some([JointAxis::Angular(0), about]))
        }
        4 => {
            let frames = frames(0, along, straight);
            (vec![Joint::prismatic(0, None, frames, around(along)), hinge(1, around(turned))], None)
        }
        _ => {
            // Swung by 0.5 rad in a cone slightly larger than that, and turned about z.
            let swung = Vector4::new(0.25_f64.cos(), 0.25_f64.sin(), 0.0, 0.0);
            let twist = Drive { limits: Some([-1e-3, 1e-3]), ..spring };
            let ball = Joint::ball(0, None, frames(0, 0.0, swung), 0.5005, twist);
            let gimbal = Joint::gimbal(1, None, frames(1, 0.0, straight), [around(0.0); 3]);
            (vec![ball, gimbal], None)
        }
    };
    let world = world(bodies.to_vec(), draw.vector(10.0)).with_joints(joints).unwrap();
    let Some([first, second]) = geared else { return (world, states) };
    let ratio = if draw.unit() < 0.0 { -1.5 } else { 0.6 };
    let gear = Gear::new(axis(0, first), axis(1, second), ratio, 0.0);
    let offset = gear.coordinate(world.joints(), &states, &[]);
    let gear = Gear::new(axis(0, first), axis(1, second), ratio, offset);
    // Two equal gears: the selection rule determines the distribution of their force.
    let gears = vec![gear; if kind == 3 { 2 } else { 1 }];
    (world.with_gears(gears).unwrap(), states)
}

/// Checks random mechanisms by all these constants. The ratio changes together with the offset, so
/// that the gears hold at the start of the step.
#[test]
fn drawn_mechanisms_by_gears_rests_and_limits() {
    let mut draw = Draw(Mt::new(11));
    let (mut compared, mut left_out, mut worst) = ([0; 6], 0, 0.0_f64);
    let (mut moved, mut sharp, mut replaced) = (0, 0, 0);
    for number in 0..84 {
        let kind = number % 6;
        let (world, states) = mechanism(kind, &mut draw);
        let still = || vec![StateChange::zero(); 2];
        let mut all = Vec::new();
        let mut add = |states: Vec<StateChange>, constants: Vec<(Constant, Vec<f64>)>| {
            let name = format!("{:?}", constants[0].0);
            all.push(Direction { name, states, wrenches: vec![], constants });
        };
        for constant in [Constant::JointRest, Constant::JointForce, Constant::JointLimits] {
            let own = constant.values(&world);
            // The lower limit of a cone stays fixed.
            let draw = |own: &f64| if *own == 0.0 { 0.0 } else { 1.0 + 0.5 * draw.unit() };
            add(still(), vec![(constant, own.iter().map(draw).collect())]);
        }
        if let Some(gear) = world.gears().first() {
            let [_, second] = gear.axes();
            let count = world.gears().len();
            let at = second.coordinate(world.joints(), &states, &Vector3::zeros());
            let offset = (Constant::GearOffset, vec![-at; count]);
            add(still(), vec![(Constant::GearRatio, vec![1.0; count]), offset]);
            if let Axis::Free(_) = world.joints()[0].linear()[2] {
                // The carriage moves with the offset.
                let mut states = still();
                states[0].position = world.joints()[0].frames()[1].rotation() * Vector3::z();
                add(states, vec![(Constant::GearOffset, vec![1.0])]);
            }
        }
        // A step that makes energy is replaced by shorter ones, which have no derivative.
        let Some((simulation, base)) = step(&world, &states, &[]) else {
            replaced += 1;
            continue;
        };
        let mut derivative = StepDerivative::new();
        simulation.linearise(&base, &mut derivative).unwrap();
        for along in all {
            let constants: Vec<_> = along.constants.iter().map(|(c, n)| (*c, &n[..])).collect();
            let mut found = Vec::new();
            let change = StepChange {
                states: &along.states,
                constants: &constants,
                ..StepChange::default()
            };
            derivative.jvp(&change, &mut found).unwrap();
            for by in [1e-5, 1e-6, 1e-7] {
                // A change of a limit or a gear acts within one step.
                if derivative.margin() < 10.0 * by * (1.0 / H + size(&found)) {
                    left_out += 1;
                    continue;
                }
                let ends = (&states[..], base.next_states());
                let (expected, _) = difference(&world, ends, &along, by).unwrap();
                let (scale, off) = (size(&expected), apart(&found, &expected));
                // Solutions have an error of at most 1e-13 m/s here.
                let rounding = 2e-13 / by;
                assert!(
                    off < 1e-6 * scale + rounding,
                    "{number}, {}: {off:.1e} of {scale}",
                    along.name
                );
                if rounding < 1e-7 * scale {
                    worst = worst.max(off / scale);
                    sharp += 1;
                }
                compared[kind] += 1;
            }
            moved += usize::from(along.name == "JointLimits" && size(&found) > 1.0);
        }
    }
    println!("{compared:?} compared, {left_out} left out, {moved} stops, {sharp} to {worst:.1e}");
    assert!(compared.iter().all(|count| *count > 60) && moved > 15 && sharp > 100);
    assert!(replaced <= 8, "{replaced} of 84");
}
