//! Derivatives in extreme cases: random shapes that meet each other or fixed pieces. They are thin,
//! small, heavy, light and spinning, with rebounds and on belts. Also the same bodies in another
//! order.

use super::draw::Draw;
use super::{Tally, apart, compare, directions, size, step, transposed};
use crate::common::prelude::*;
use rand_mt::Mt;
use tumble_core::world::{StickSpeed, SurfaceMotion};

impl Draw {
    /// Box, rounded box, capsule or ball of about `size` [m]. It may be as thin as a thirtieth of
    /// it.
    fn piece(&mut self, size: f64) -> Piece {
        let half = Vector3::from_fn(|_, _| size * self.within(0.03, 0.6));
        let corner =
            |k: u32| half.map_with_location(|i, _, a| if k >> i & 1 == 0 { a } else { -a });
        let corners: Vec<_> = (0..8).map(corner).collect();
        let shape = match self.within(0.0, 4.0) as u32 {
            0 => Piece::hull(&corners, 0.0),
            1 => Piece::hull(&corners, 0.1 * size),
            2 => Piece::capsule(half[0], 0.3 * size),
            _ => Piece::sphere(0.5 * size),
        };
        shape.unwrap()
    }

    /// Random body of 0.2 to 5 kg.
    fn body(&mut self, size: f64) -> RigidBody {
        let mass = 5.0_f64.powf(self.within(-1.0, 1.0));
        RigidBody::solid(mass, &[self.piece(size)]).unwrap().0
    }
}

/// Two shapes that fly at each other, with their starts. The second one may be fixed.
struct Pair {
    world: World,
    states: Vec<State>,
}

impl Pair {
    fn new(draw: &mut Draw, is_fixed: bool) -> Self {
        let sizes = [0; 2].map(|_| 0.2 * 4.0_f64.powf(draw.within(-1.0, 1.0)));
        let way = draw.vector(1.0).normalize();
        let apart = 0.6 * (sizes[0] + sizes[1]);
        let mut bodies = Vec::new();
        let mut states = Vec::new();
        for (side, size) in [1.0, -1.0].into_iter().zip(sizes) {
            bodies.push(draw.body(size));
            states.push(State {
                position: way * (apart * side) + draw.vector(0.2 * size),
                attitude: Vector4::from_fn(|_, _| draw.within(-1.0, 1.0)).normalize(),
                velocity: draw.vector(0.3) - way * side,
                spin: draw.vector(6.0 / size.sqrt()),
            });
        }
        let mut fixed = Vec::new();
        if is_fixed {
            bodies.truncate(1);
            let place = states.remove(1).pose();
            let shape = draw.piece(2.0 * sizes[1]).moved_by(&place.rotation, &place.position);
            fixed.push(shape.unwrap());
        }
        let parameters = Parameters {
            bodies,
            ground: None,
            gravity: draw.vector(10.0),
            friction: draw.within(0.0, 1.0),
            time_step: 0.001,
            rotation: if draw.within(0.0, 1.0) < 0.5 {
                Rotation::Momentum
            } else {
                Rotation::Tutorial
            },
        };
        let world = euler(parameters).with_fixed(fixed);
        let restitution = if draw.within(0.0, 1.0) < 0.3 { 0.5 } else { 0.0 };
        Self {
            world: world.with_coefficient(Coefficient::Restitution, restitution).unwrap(),
            states,
        }
    }

    /// The same pair with its own coefficients, either of the pair or of one body.
    fn with_coefficients(self, number: usize) -> Self {
        let other = if self.states.len() == 1 { Partner::Fixed(0) } else { Partner::Body(1) };
        if number.is_multiple_of(2) {
            let world =
                self.world.with_coefficient_between(Coefficient::Friction, 0, other, 0.4).unwrap();
            let world =
                world.with_coefficient_between(Coefficient::Restitution, 0, other, 0.6).unwrap();
            return Self { world, ..self };
        }
        let restitution = self.world.restitution().max(0.1);
        let mut world = self.world.with_coefficient(Coefficient::Restitution, restitution).unwrap();
        for (of, owner, own) in [
            (Coefficient::Friction, Partner::Body(0), 0.2),
            (Coefficient::Restitution, Partner::Body(0), 0.7),
            (Coefficient::Friction, Partner::Fixed(0), 0.5),
        ] {
            if owner == Partner::Body(0) || other == Partner::Fixed(0) {
                world = world.with_coefficient_of(of, owner, own).unwrap();
            }
        }
        Self { world, ..self }
    }

    /// The same pair with a moving surface of the second shape.
    fn on_a_belt(self, velocity: Vector3<f64>) -> Self {
        let of = if self.states.len() == 1 { Partner::Fixed(0) } else { Partner::Body(1) };
        Self { world: self.world.with_surface(of, velocity).unwrap(), ..self }
    }
}

/// States before the first three steps in which a contact carries a force. A share of the restitution is found by
/// bisection, and has no derivative.
fn touching(Pair { world, states }: &Pair) -> Vec<Vec<State>> {
    let (mut now, mut found) = (states.clone(), Vec::new());
    for _ in 0..400 {
        let Some((_, record)) = step(world, &now, &[]) else { break };
        let is_loaded =
            record.first().solution.contacts.iter().any(|contact| contact.carries_force());
        if is_loaded && record.restitution_share() == 1.0 {
            found.push(now);
        }
        now = record.next_states().to_vec();
        if found.len() == 3 {
            break;
        }
    }
    found
}

/// Number of pairs.
const PAIRS: usize = 60;

#[test]
fn shapes_that_meet_in_every_way() {
    assert_eq!(meet(7, |pair, _| pair), 0);
}

/// The same with rolling and torsional resistance, of the world or of the pair.
#[test]
fn shapes_that_meet_with_turning_friction() {
    let scattered = meet(11, |Pair { world, states }, draw| {
        let turning =
            [(Coefficient::RollingFriction, 0.02), (Coefficient::TorsionalFriction, 0.05)];
        let other = if states.len() == 1 { Partner::Fixed(0) } else { Partner::Body(1) };
        let world = turning.into_iter().fold(world, |world, (turning, most)| {
            let friction = draw.within(-0.3 * most, most).max(0.0);
            if draw.within(0.0, 1.0) < 0.5 {
                world.with_coefficient(turning, friction).unwrap()
            } else {
                world.with_coefficient_between(turning, 0, other, friction).unwrap()
            }
        });
        for states in touching(&Pair { world: world.clone(), states: states.clone() }) {
            let Some((simulation, record)) = step(&world, &states, &[]) else { continue };
            let mut derivative = StepDerivative::new();
            simulation.linearise(&record, &mut derivative).unwrap();
            let all = directions(&world, &mut || draw.within(-1.0, 1.0));
            transposed(&mut derivative, &all, &mut || draw.within(-1.0, 1.0), "moments", 1e-7);
        }
        Pair { world, states }
    });
    assert_eq!(scattered, 0);
}

/// The same with friction that depends on the direction, of one of both shapes.
#[test]
fn shapes_that_meet_with_friction_axes() {
    let scattered = meet(17, |Pair { world, states }, draw| {
        let other = if states.len() == 1 { Partner::Fixed(0) } else { Partner::Body(1) };
        let of = if draw.within(0.0, 1.0) < 0.5 { Partner::Body(0) } else { other };
        let factor = 10.0_f64.powf(draw.within(-1.0, 0.5));
        let world = world.with_friction_axis(of, draw.vector(1.0), factor).unwrap();
        for states in touching(&Pair { world: world.clone(), states: states.clone() }) {
            let Some((simulation, record)) = step(&world, &states, &[]) else { continue };
            let mut derivative = StepDerivative::new();
            simulation.linearise(&record, &mut derivative).unwrap();
            let all = directions(&world, &mut || draw.within(-1.0, 1.0));
            transposed(&mut derivative, &all, &mut || draw.within(-1.0, 1.0), "axes", 1e-7);
        }
        Pair { world, states }
    });
    assert_eq!(scattered, 0);
}

/// The same with a surface that turns.
#[test]
fn shapes_that_meet_on_surfaces_that_turn() {
    let scattered = meet(31, |Pair { world, states }, draw| {
        let other = if states.len() == 1 { Partner::Fixed(0) } else { Partner::Body(1) };
        let of = if draw.within(0.0, 1.0) < 0.3 { Partner::Body(0) } else { other };
        let [velocity, spin, centre] = [0.5, 5.0, 0.3].map(|size| draw.vector(size));
        let motion = SurfaceMotion { velocity, spin, centre };
        let world = world.with_surface_motion(of, motion).unwrap();
        let world = if draw.within(0.0, 1.0) < 0.3 {
            let rows = vec![[0.0, 1.0], [1.0, 0.5], [8.0, 0.0]];
            let world = world.with_coefficient(Coefficient::StaticFriction, 2.0).unwrap();
            world.with_stick_speed(StickSpeed::Table(rows)).unwrap()
        } else {
            world
        };
        for states in touching(&Pair { world: world.clone(), states: states.clone() }) {
            let Some((simulation, record)) = step(&world, &states, &[]) else { continue };
            let mut derivative = StepDerivative::new();
            simulation.linearise(&record, &mut derivative).unwrap();
            let all = directions(&world, &mut || draw.within(-1.0, 1.0));
            transposed(&mut derivative, &all, &mut || draw.within(-1.0, 1.0), "turns", 1e-7);
        }
        Pair { world, states }
    });
    assert_eq!(scattered, 0);
}

/// The same with friction over the slip, between a kinetic and a static coefficient.
#[test]
fn shapes_that_meet_with_friction_over_the_slip() {
    let scattered = meet(23, |Pair { world, states }, draw| {
        let rows = vec![[0.0, 1.0], [draw.within(0.5, 2.0), draw.within(0.3, 0.6)], [8.0, 0.0]];
        let world = world.with_coefficient(Coefficient::StaticFriction, 2.0).unwrap();
        let world = world.with_stick_speed(StickSpeed::Table(rows)).unwrap();
        for states in touching(&Pair { world: world.clone(), states: states.clone() }) {
            let Some((simulation, record)) = step(&world, &states, &[]) else { continue };
            let mut derivative = StepDerivative::new();
            simulation.linearise(&record, &mut derivative).unwrap();
            let all = directions(&world, &mut || draw.within(-1.0, 1.0));
            transposed(&mut derivative, &all, &mut || draw.within(-1.0, 1.0), "slips", 1e-7);
        }
        Pair { world, states }
    });
    assert_eq!(scattered, 0);
}

/// Pairs with adhesion that touch, overlap by 0.1 mm, and press on each other, slide or come off. Changes of a start that
/// just touches would change the adhesion by jumps.
#[test]
fn shapes_that_pull_at_each_other() {
    let (mut draw, mut tally) = (Draw(Mt::new(29)), Tally::default());
    let (mut pulled, mut opened) = (0, 0);
    for number in 0..2 * PAIRS {
        let Pair { world, states } = Pair::new(&mut draw, number % 3 == 0);
        let parameters = world.parameters().clone();
        let world = euler(parameters).with_fixed(world.fixed().to_vec());
        let other = if states.len() == 1 { Partner::Fixed(0) } else { Partner::Body(1) };
        let pull = 10.0_f64.powf(draw.within(0.0, 3.5));
        let world = match number % 2 {
            0 => world.with_coefficient_between(Coefficient::Adhesion, 0, other, pull),
            _ => world.with_coefficient_of(Coefficient::Adhesion, Partner::Body(0), pull),
        };
        let world = world.unwrap();
        let world = match number % 5 {
            0 => world.with_coefficient(Coefficient::RollingFriction, 0.02).unwrap(),
            1 => world.with_friction_axis(Partner::Body(0), draw.vector(1.0), 0.4).unwrap(),
            _ => world,
        };
        for (place, mut states) in
            touching(&Pair { world: world.clone(), states }).into_iter().enumerate()
        {
            let Some((_, record)) = step(&world, &states, &[]) else { continue };
            let Some(contact) = record.first().contacts.first() else { continue };
            states[0].position -= contact.normal() * (contact.gap + 1e-4);
            states[0].velocity += draw.vector(2.0);
            let Some((simulation, record)) = step(&world, &states, &[]) else { continue };
            let taken = record.first();
            pulled += usize::from(taken.solution.contacts.iter().any(|of| of.adhesion > 0.0));
            opened += usize::from(taken.contacts.iter().zip(&taken.solution.contacts).any(
                |(contact, of)| of.adhesion > 0.0 && contact.gap_in(&taken.solution.states) > 1e-6,
            ));
            let mut derivative = StepDerivative::new();
            simulation.linearise(&record, &mut derivative).unwrap();
            let all = directions(&world, &mut || draw.within(-1.0, 1.0));
            let at = format!("pair {number}, touch {place}");
            transposed(&mut derivative, &all, &mut || draw.within(-1.0, 1.0), &at, 1e-7);
            compare(&world, &states, &mut || draw.within(-1.0, 1.0), &at, &mut tally);
        }
    }
    println!(
        "{pulled} pulled, {opened} opened, {} compared, {} left out, {} kinks, worst {:.1e}",
        tally.compared, tally.left_out, tally.kinks, tally.worst
    );
    assert!(tally.missed.is_empty(), "{}", tally.missed.join("\n"));
    assert!(tally.compared > 8 * PAIRS && 20 * tally.kinks < tally.compared);
    assert!(pulled > PAIRS && opened > PAIRS / 4 && tally.scattered < 4);
}

/// Compares the derivatives of random pairs with differences. Returns the number of scattered solutions.
fn meet(seed: u32, changed: impl Fn(Pair, &mut Draw) -> Pair) -> usize {
    let mut draw = Draw(Mt::new(seed));
    let mut tally = Tally::default();
    for number in 0..PAIRS {
        let mut pair = Pair::new(&mut draw, number % 3 == 0);
        if number % 5 < 2 {
            pair = pair.with_coefficients(number);
        }
        if number % 4 == 0 {
            pair = pair.on_a_belt(draw.vector(1.0));
        }
        pair = changed(pair, &mut draw);
        for (place, states) in touching(&pair).iter().enumerate() {
            let at = format!("pair {number}, touch {place}");
            compare(&pair.world, states, &mut || draw.within(-1.0, 1.0), &at, &mut tally);
        }
    }
    println!(
        "{} compared, {} left out, {} kinks, worst {:.1e}",
        tally.compared, tally.left_out, tally.kinks, tally.worst
    );
    assert!(tally.missed.is_empty(), "{}", tally.missed.join("\n"));
    assert!(tally.compared > 8 * PAIRS && 20 * tally.kinks < tally.compared);
    tally.scattered
}

/// Derivative δX⁺ of a step, or `None` near a kink or with unknown features.
fn pushed(world: &World, states: &[State], change: &[StateChange]) -> Option<Vec<StateChange>> {
    let (simulation, record) = step(world, states, &[])?;
    let mut derivative = StepDerivative::new();
    simulation.linearise(&record, &mut derivative).unwrap();
    let mut end = Vec::new();
    let change = StepChange { states: change, ..StepChange::default() };
    derivative.jvp(&change, &mut end).unwrap();
    (derivative.margin() > 1e-6 && derivative.unknown() == 0).then_some(end)
}

/// Checks two free bodies: the derivative in an image of the world is the image of the derivative.
/// The solutions agree to 1e-9, and so do the points of the derivatives.
fn agrees_with_its_image(
    seed: u32,
    world_of: impl Fn(&World) -> World,
    there: impl Fn(&[State]) -> Vec<State>,
    image: impl Fn(&[StateChange], bool) -> Vec<StateChange>,
) {
    let (mut draw, mut compared) = (Draw(Mt::new(seed)), 0);
    for number in 0..PAIRS {
        let pair = Pair::new(&mut draw, false);
        let other = world_of(&pair.world);
        for states in touching(&pair) {
            for along in directions(&pair.world, &mut || draw.within(-1.0, 1.0)).iter().take(4) {
                let one = pushed(&pair.world, &states, &along.states);
                let two = pushed(&other, &there(&states), &image(&along.states, false));
                let (Some(one), Some(two)) = (one, two) else { continue };
                compared += 1;
                let far = apart(&one, &image(&two, true));
                assert!(
                    far <= 1e-6 * size(&one).max(1.0),
                    "pair {number}, {}: {far:.1e}",
                    along.name
                );
            }
        }
    }
    assert!(compared > PAIRS, "{compared}");
}

#[test]
fn the_order_of_the_bodies_plays_no_part() {
    let world_of = |world: &World| {
        let mut parameters = world.parameters().clone();
        parameters.bodies.reverse();
        euler(parameters).with_coefficient(Coefficient::Restitution, world.restitution()).unwrap()
    };
    let back = |states: &[State]| states.iter().rev().copied().collect();
    let image = |changes: &[StateChange], _| changes.iter().rev().copied().collect();
    agrees_with_its_image(11, world_of, back, image);
}

#[test]
fn a_world_turned_as_a_whole_turns_its_derivatives() {
    let q = Vector4::new(0.4, -0.7, 0.3, 0.5).normalize();
    let (turn, left) = (rotation(&q), left(&q));
    let world_of = |world: &World| {
        let mut parameters = world.parameters().clone();
        parameters.gravity = turn * parameters.gravity;
        euler(parameters).with_coefficient(Coefficient::Restitution, world.restitution()).unwrap()
    };
    let there = |states: &[State]| {
        let turned = |state: &State| State {
            position: turn * state.position,
            attitude: left * state.attitude,
            velocity: turn * state.velocity,
            ..*state
        };
        states.iter().map(turned).collect()
    };
    let image = |changes: &[StateChange], back: bool| {
        let turn = if back { turn.transpose() } else { turn };
        let turned = |change: &StateChange| StateChange {
            position: turn * change.position,
            velocity: turn * change.velocity,
            ..*change
        };
        changes.iter().map(turned).collect()
    };
    agrees_with_its_image(13, world_of, there, image);
}
