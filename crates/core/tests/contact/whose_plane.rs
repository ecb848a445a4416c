//! Geometry decides which body owns the plane of a contact. Reordering the bodies permutes the
//! motion, also through impacts.

use crate::common::prelude::*;

type V = Vector3<f64>;

/// Body with its initial state.
type Placed = (RigidBody, State);

/// Records of a run of `placed` in the order `order`, above a ground far below. `gravity` acts
/// downwards [m/s²].
fn run(placed: &[Placed], order: &[usize], gravity: f64, count: usize) -> Vec<StepRecord> {
    let bodies = order.iter().map(|&index| placed[index].0.clone()).collect();
    let gravity = V::new(0.0, 0.0, -gravity);
    let world = euler(Parameters { gravity, friction: 0.4, ..Parameters::new(bodies) });
    let states: Vec<_> = order.iter().map(|&index| placed[index].1).collect();
    steps(&mut simulate(&world, &states), count, |_| true)
}

/// Random box, cube, capsule, ball or hull of 3 to 12 cm.
fn body(draws: &mut Draws) -> RigidBody {
    let kind = (5.0 * draws.unit()) as u32;
    let mut size = || 0.03 + 0.09 * draws.unit();
    let piece = match kind {
        0 => Piece::cuboid(V::new(size(), size(), size())),
        1 => Piece::cuboid(V::repeat(size())),
        2 => Piece::capsule(size(), 0.5 * size()),
        3 => Piece::sphere(size()),
        _ => {
            let size = size();
            let corner = |_| rotation(&draws.attitude()) * V::z() * size;
            Piece::hull(&(0..10).map(corner).collect::<Vec<_>>(), 0.0)
        }
    };
    let mass = if draws.unit() < 0.5 { 1.0 } else { 0.5 + draws.unit() };
    RigidBody::solid(mass, &[piece.unwrap()]).unwrap().0
}

fn vector(draws: &mut Draws, size: f64) -> V {
    V::from_fn(|_, _| size * (2.0 * draws.unit() - 1.0))
}

/// Largest difference of two motions [m/s], with spins times 0.1 m. `found` has the order `order`.
fn apart(usual: &[State], found: &[State], order: &[usize]) -> f64 {
    let of = |(place, &index): (usize, &usize)| {
        let (a, b) = (&usual[index], &found[place]);
        (a.velocity - b.velocity).amax().max(0.1 * (a.spin - b.spin).amax())
    };
    order.iter().enumerate().map(of).fold(0.0, f64::max)
}

fn is_solved(record: &StepRecord) -> bool {
    record.status().is_solved()
}

/// Compares runs in other orders with the usual one, up to `after` steps beyond the first contact,
/// while the steps are solved. The solver leaves velocity errors of 1e-9 m/s, which later impacts
/// amplify. Returns the number of compared steps with contacts, and the largest difference [m/s].
fn compare(
    placed: &[Placed],
    orders: &[Vec<usize>],
    gravity: f64,
    (steps, after): (usize, usize),
) -> (u32, f64) {
    let count = placed.len();
    let usual = run(placed, &(0..count).collect::<Vec<_>>(), gravity, steps);
    let Some(first) = usual.iter().position(|record| !record.first().contacts.is_empty()) else {
        return (0, 0.0);
    };
    let (mut compared, mut most) = (0, 0.0_f64);
    for order in orders {
        let found = run(placed, order, gravity, steps);
        for (a, b) in usual.iter().zip(&found).take(first + after) {
            if !is_solved(a) || !is_solved(b) {
                break;
            }
            assert_eq!(
                a.first().contacts.len(),
                b.first().contacts.len(),
                "{order:?}, k = {}",
                a.index
            );
            most = most.max(apart(a.next_states(), b.next_states(), order));
            compared += u32::from(!a.first().contacts.is_empty());
        }
    }
    (compared, most)
}

/// Checks two bodies that collide in free space, with and without spin.
#[test]
fn swapping_two_bodies_swaps_their_motion() {
    let mut draws = Draws::new(11);
    let (mut compared, mut different) = (0, Vec::new());
    for number in 0..300 {
        let spinning = if draws.unit() < 0.3 { 0.0 } else { 20.0 };
        let bodies = [body(&mut draws), body(&mut draws)];
        let bodies =
            if draws.unit() < 0.2 { [bodies[0].clone(), bodies[0].clone()] } else { bodies };
        let mut placed = bodies.map(|body| {
            let state = State {
                position: V::new(0.0, 0.0, 20.0) + vector(&mut draws, 0.02),
                attitude: draws.attitude().normalize(),
                velocity: vector(&mut draws, 0.5),
                spin: vector(&mut draws, spinning),
            };
            (body, state)
        });
        placed[0].1.position[0] -= 0.35;
        placed[0].1.velocity[0] += 3.0;
        let (count, most) = compare(&placed, &[vec![1, 0]], 0.0, (150, 6));
        compared += count;
        if most > 1e-7 {
            different.push(format!("{number}: {most:e}"));
        }
    }
    assert!(compared > 300, "{compared}");
    assert!(different.is_empty(), "of {compared} steps: {different:#?}");
}

/// Checks two equal cubes without spin that meet edge to edge, face to face and corner to corner.
/// Neither spin nor mass distinguishes them.
#[test]
fn swapping_twins_swaps_their_motion() {
    let cube = RigidBody::solid_box(1.0, V::repeat(0.1)).unwrap();
    let quarter = |axis: V| {
        let half = std::f64::consts::FRAC_PI_8;
        let axis = axis.normalize() * half.sin();
        Vector4::new(half.cos(), axis[0], axis[1], axis[2])
    };
    let straight = Vector4::new(1.0, 0.0, 0.0, 0.0);
    let turns = [straight, quarter(V::z()), quarter(V::y()), quarter(V::new(1.0, 1.0, 0.3))];
    for (i, first) in turns.iter().enumerate() {
        for (j, second) in turns.iter().enumerate() {
            for aside in [V::zeros(), V::new(0.0, 0.05, 0.0), V::new(0.0, 0.03, -0.04)] {
                let state = |x: f64, q: &Vector4<f64>, speed: f64| State {
                    position: V::new(x, 0.0, 20.0),
                    attitude: *q,
                    velocity: V::new(speed, 0.0, 0.0),
                    spin: V::zeros(),
                };
                let (a, mut b) = (state(-0.4, first, 2.0), state(0.0, second, 0.0));
                b.position += aside;
                let placed = [(cube.clone(), a), (cube.clone(), b)];
                let (_, most) = compare(&placed, &[vec![1, 0]], 0.0, (120, 6));
                assert!(most < 1e-7, "{i} {j} {aside:?}: {most:e}");
            }
        }
    }
}

/// Checks four bodies that fall on each other, in other orders.
#[test]
fn renumbering_four_bodies_permutes_their_motion() {
    let mut draws = Draws::new(12);
    let (mut compared, mut different) = (0, Vec::new());
    for number in 0..60 {
        let placed: Vec<Placed> = (0..4)
            .map(|index| {
                let state = State {
                    position: V::new(0.0, 0.0, 0.3 + 0.36 * f64::from(index))
                        + vector(&mut draws, 0.03),
                    attitude: draws.attitude().normalize(),
                    velocity: V::new(0.0, 0.0, -0.5 * f64::from(index)),
                    spin: vector(&mut draws, 4.0),
                };
                (body(&mut draws), state)
            })
            .collect();
        let orders = [vec![3, 2, 1, 0], vec![1, 3, 0, 2], vec![2, 0, 3, 1]];
        let (count, most) = compare(&placed, &orders, 9.81, (140, 40));
        compared += count;
        if most > 1e-6 {
            different.push(format!("{number}: {most:e}"));
        }
    }
    assert!(compared > 1000, "{compared}");
    assert!(different.is_empty(), "of {compared} steps: {different:#?}");
}
