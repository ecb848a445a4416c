//! Invalid input for every public function that takes lists over bodies: lists of the wrong length,
//! indices out of range, and NaN. Each function returns an error or its documented result. None
//! panics.

mod solvers;

use crate::common::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};
use tumble::step_nlp::ProgramPoint;
use tumble_core::contact::certificate::certify_rk4_step;
use tumble_core::contact::detection::{admit_missed, all_contacts};
use tumble_core::contact::restitution::set_rebounds;
use tumble_core::contact::{KeyIndex, rounding};
use tumble_core::geometry::mesh::{Mesh, parse_obj, parse_stl};
use tumble_core::geometry::{
    Aabb, Hint, Hull, PairScratch, PieceSide, Sweep, distance_lower_bound, manifold, overlap,
    signed_distance,
};
use tumble_core::simulation::unphysical::EnergyCheck;

/// World with `bodies` cubes of 1 m with restitution.
fn world_of(bodies: usize) -> World {
    let parameters = Parameters {
        time_step: 0.01,
        ..Parameters::new(vec![RigidBody::solid_box(1.0, Vector3::repeat(0.5)).unwrap(); bodies])
    };
    World::new(parameters).unwrap().with_coefficient(Coefficient::Restitution, 0.5).unwrap()
}

/// Stacked cubes that fall.
fn tower(bodies: usize) -> Vec<State> {
    let state = |index: usize| State {
        velocity: Vector3::new(0.1, 0.0, -1.0),
        ..State::at_rest(Vector3::new(0.0, 0.0, 0.5 + index as f64))
    };
    (0..bodies).map(state).collect()
}

/// Lists of states: empty, too short, of length `bodies`, too long, and with NaN.
fn lists(bodies: usize) -> Vec<Vec<State>> {
    let mut none = tower(bodies);
    none[0].position.z = f64::NAN;
    none[0].spin.x = f64::INFINITY;
    vec![vec![], tower(bodies - 1), tower(bodies), tower(bodies + 1), none]
}

fn contacts_of(world: &World, states: &[State]) -> Vec<Contact> {
    let mut candidates = Candidates::new();
    candidates.find(Detection::default(), world, states, states);
    candidates.contacts().to_vec()
}

/// Contacts of a step, and variants with bodies and points that do not exist.
fn contact_lists(world: &World, bodies: usize) -> Vec<Vec<Contact>> {
    let found = contacts_of(world, &tower(bodies));
    assert!(!found.is_empty());
    let changed = |change: fn(&mut Contact)| {
        let mut contacts = found.clone();
        contacts.iter_mut().for_each(change);
        contacts
    };
    vec![
        changed(|contact| contact.key.body = 7),
        changed(|contact| contact.key.partner = Partner::Body(9)),
        changed(|contact| contact.key.point = 99),
        changed(|contact| contact.frame.fill(f64::NAN)),
        vec![],
        found,
    ]
}

/// Names of the functions that panicked.
#[derive(Default)]
struct Panics(Vec<String>);

impl Panics {
    fn look<T>(&mut self, name: &str, call: impl FnOnce() -> T) {
        if catch_unwind(AssertUnwindSafe(call)).is_err() && !self.0.iter().any(|n| n == name) {
            self.0.push(name.to_owned());
        }
    }
}

impl Drop for Panics {
    fn drop(&mut self) {
        assert!(std::thread::panicking() || self.0.is_empty(), "panicked: {:?}", self.0);
    }
}

#[test]
fn lists_of_any_length_do_not_panic_the_contact_search() {
    let mut panics = Panics::default();
    for bodies in [1, 2] {
        let world = world_of(bodies);
        for (states, next) in pairs(bodies) {
            panics.look("Detection::find", || {
                Detection::default().find(&world, &states, &next, &mut Vec::new())
            });
            panics.look("all_contacts", || all_contacts(&world, &states, &mut Vec::new()));
            panics.look("admit_missed", || {
                let mut memory = (Vec::new(), KeyIndex::new());
                admit_missed(&world, &states, &next, 0.0, &[], &mut memory.0, &mut memory.1)
            });
            panics.look("Candidates::find", || {
                Candidates::new().find(Detection::default(), &world, &states, &next)
            });
            panics.look("Candidates::admit_missed", || {
                let mut candidates = Candidates::new();
                candidates.find(Detection::default(), &world, &tower(bodies), &tower(bodies));
                candidates.admit_missed(&world, &states, &next, 0.0)
            });
            panics.look("Candidates::deepest_overlap", || {
                let mut candidates = Candidates::new();
                candidates.deepest_overlap(&world, &states);
                candidates.deepest_overlap(&world, &next)
            });
            panics.look("World::lowest_height", || world.lowest_height(&next));
            panics.look("rounding::residual", || rounding::residual(&world, &states, &next));
            for wrenches in 0..4 {
                let wrenches = vec![Wrench::zero(); wrenches];
                for contacts in contact_lists(&world, bodies) {
                    let claim = Claim {
                        states: &states,
                        next: &next,
                        wrenches: &wrenches,
                        contacts: &contacts,
                        joints: &[],
                        gears: &[],
                    };
                    panics.look("certify_rk4_step", || certify_rk4_step(&world, &claim));
                    for forces in [0, contacts.len(), contacts.len() + 1] {
                        let forces = vec![Vector3::zeros(); forces];
                        panics.look("Judge::is_unphysical", || {
                            EnergyCheck::new().is_unphysical(
                                &world,
                                &claim,
                                forces.iter().copied(),
                                1.0,
                            )
                        });
                        panics.look("Certifier::contact_step", || {
                            Certifier::new().contact_step(&world, &claim, forces)
                        });
                    }
                }
            }
        }
    }
}

/// Checks that incomplete input counts as bad: the residual is NaN and the step unphysical.
#[test]
fn step_with_missing_states_is_unphysical() {
    let world = world_of(2);
    let (good, wrenches) = (tower(2), vec![Wrench::zero(); 2]);
    let contacts = contact_lists(&world, 2);
    let found = contacts.last().unwrap();
    let residual = |claim: &Claim<'_>| {
        let forces = vec![Vector3::zeros(); claim.contacts.len()];
        Certifier::new().contact_step(&world, claim, forces).residual()
    };
    let whole = Claim {
        states: &good,
        next: &good,
        wrenches: &wrenches,
        contacts: found,
        joints: &[],
        gears: &[],
    };
    assert!(
        residual(&whole).is_finite() && certify_rk4_step(&world, &whole).residual().is_finite()
    );
    let is_unphysical = |claim: &Claim<'_>| {
        let forces = vec![Vector3::zeros(); claim.contacts.len()];
        EnergyCheck::new().is_unphysical(&world, claim, forces, 1e-9)
    };
    assert!(!is_unphysical(&whole));
    for claim in [
        Claim { states: &good[..1], ..whole },
        Claim { next: &good[..1], ..whole },
        Claim { wrenches: &wrenches[..1], ..whole },
        Claim { contacts: &contacts[0], ..whole },
        Claim { contacts: &contacts[1], ..whole },
    ] {
        assert!(residual(&claim).is_nan(), "{claim:?}");
        assert!(certify_rk4_step(&world, &claim).residual().is_nan(), "{claim:?}");
        assert!(is_unphysical(&claim), "{claim:?}");
    }
    let mut candidates = Candidates::new();
    candidates.find(Detection::default(), &world, &good[..1], &good);
    let ground = candidates.contacts().iter().all(|contact| contact.key.body == 0);
    assert!(ground && !candidates.contacts().is_empty(), "the lower cube meets the ground");
    let sunk = [good[0], State { position: 0.9 * good[1].position, ..good[1] }];
    assert!(candidates.deepest_overlap(&world, &sunk).is_some());
    assert_eq!(candidates.deepest_overlap(&world, &sunk[..1]), None);
}

fn pairs(bodies: usize) -> Vec<(Vec<State>, Vec<State>)> {
    let each =
        |states: Vec<State>| lists(bodies).into_iter().map(move |next| (states.clone(), next));
    lists(bodies).into_iter().flat_map(each).collect()
}

#[test]
fn shares_of_any_length_do_not_panic_restitution() {
    let mut panics = Panics::default();
    for bodies in [1, 2] {
        let world = world_of(bodies);
        for (states, next) in pairs(bodies) {
            for shares in 0..4 {
                let shares = vec![0.5; shares];
                panics.look("Candidates::share_restitution", || {
                    let mut candidates = Candidates::new();
                    candidates.find(Detection::default(), &world, &states, &next);
                    candidates.extend(contacts_of(&world, &tower(bodies)));
                    candidates.share_restitution(&world, &next, &shares);
                });
                for mut contacts in contact_lists(&world, bodies) {
                    panics.look("set_rebounds", || {
                        set_rebounds(&world, &states, &next, &shares, &mut contacts);
                    });
                    panics.look("Contact::impact_work", || {
                        let force = Vector3::zeros();
                        contacts.iter().for_each(|contact| {
                            let work = contact.impact_work(&world, &force, &states, &next);
                            assert!(work == 0.0 || work.is_nan());
                        });
                    });
                }
            }
        }
    }
}

/// Checks that a contact has the smaller share of its two bodies. A missing share counts as 1.
#[test]
fn missing_share_means_full_restitution() {
    let world = world_of(2);
    let states = tower(2);
    let mut free = states.clone();
    free.iter_mut().for_each(|state| state.position.z -= 0.01);
    free[1].position.z -= 0.01;
    let rebounds = |shares: &[f64]| {
        let mut candidates = Candidates::new();
        candidates.find(Detection::default(), &world, &states, &free);
        candidates.share_restitution(&world, &states, shares);
        candidates.contacts().iter().map(|contact| contact.rebound).collect::<Vec<_>>()
    };
    assert!(rebounds(&[1.0, 1.0]).iter().any(|rebound| *rebound > 0.0));
    assert_ne!(rebounds(&[0.5, 1.0]), rebounds(&[1.0, 1.0]));
    assert_eq!(rebounds(&[]), rebounds(&[1.0, 1.0]));
    assert_eq!(rebounds(&[0.5]), rebounds(&[0.5, 1.0]));
    assert_eq!(rebounds(&[0.5, 1.0, 0.1]), rebounds(&[0.5, 1.0]));
}

/// Checks that tables of one body, read with a wrong number of bodies, return an error. The number
/// may be larger than memory.
#[test]
fn wrong_body_count_is_an_error_not_a_panic() {
    use tumble_core::simulation::{Motion, Simulation, StepRecord};
    use tumble_scene::output::tables::{Streams, TableShape, TablesReader, TablesWriter};
    let world = world_of(1);
    let (mut record, motion) = (StepRecord::new(), Motion::native(&world));
    Simulation::new(world.clone(), tower(1), motion).unwrap().step(&mut record).unwrap();
    let streams = Streams {
        states: vec![],
        contacts: Some(vec![]),
        steps: vec![],
        joints: None,
        gears: None,
        ends: None,
    };
    let mut writer = TablesWriter::new(streams, &world).unwrap();
    writer.write(&record).unwrap();
    let Streams { states, contacts, steps, .. } = writer.finish().unwrap();
    let read = |bodies: usize| {
        let streams = Streams {
            states: &*states,
            contacts: contacts.as_deref(),
            steps: &*steps,
            joints: None,
            gears: None,
            ends: None,
        };
        let shape = TableShape { bodies, ..TableShape::new(&world) };
        TablesReader::new(streams, shape).unwrap().next_interval()
    };
    assert!(read(1).is_ok());
    assert!(read(usize::MAX).is_err());
}

#[test]
fn records_of_another_world_do_not_panic_writers() {
    use tumble_core::simulation::StepRecord;
    use tumble_core::step::ContactForce;
    use tumble_scene::output::tables::{IntervalRows, Streams, TablesWriter};
    use tumble_scene::output::trajectory::TrajectoryWriter;
    let mut panics = Panics::default();
    for bodies in [1, 2] {
        let world = world_of(bodies);
        for (states, next) in pairs(bodies) {
            for contacts in contact_lists(&world, bodies) {
                let mut record = StepRecord::new();
                record.first_mut().states = states.clone();
                record.first_mut().solution.states = next.clone();
                let forces = contacts.iter().map(|contact| ContactForce::none(contact.key));
                record.first_mut().solution.contacts = forces.collect();
                record.first_mut().contacts = contacts;
                panics.look("TrajectoryWriter::write", || {
                    TrajectoryWriter::new(Vec::new(), &world).write(&record)
                });
                panics.look("IntervalRows::new", || IntervalRows::from_step(&world, &record));
                panics.look("TablesWriter::write", || {
                    let streams = Streams {
                        states: vec![],
                        contacts: Some(vec![]),
                        steps: vec![],
                        joints: None,
                        gears: None,
                        ends: None,
                    };
                    TablesWriter::new(streams, &world).unwrap().write(&record)
                });
            }
        }
    }
}

/// Checks invalid poses, and hints of other pairs.
#[test]
fn invalid_hints_and_poses_do_not_panic_geometry() {
    let mut panics = Panics::default();
    let tetrahedron = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let pieces = [
        Piece::cuboid(Vector3::repeat(0.5)).unwrap(),
        Piece::sphere(0.5).unwrap(),
        Piece::capsule(0.5, 0.2).unwrap(),
        Piece::hull(&tetrahedron.map(Vector3::from), 0.1).unwrap(),
    ];
    let pose = |z: f64, turn: f64| Pose {
        position: Vector3::new(0.1, 0.2, z),
        rotation: *Rotation3::new(Vector3::new(turn, 0.5 * turn, 0.1)).matrix(),
    };
    let poses = [
        pose(0.9, 0.0),
        pose(0.9, 0.7),
        pose(0.3, 2.0),
        pose(f64::NAN, 0.0),
        pose(f64::INFINITY, 0.0),
        pose(0.9, f64::NAN),
        pose(1e300, 0.0),
    ];
    let (mut scratch, mut touches) = (PairScratch::default(), Vec::new());
    for of in &pieces {
        for other in &pieces {
            for at in &poses {
                // Hands the hint of one pair to another pair.
                for (a, b) in pieces.iter().flat_map(|a| pieces.iter().map(move |b| (a, b))) {
                    let mut hint = Hint::default();
                    manifold(
                        (of, &poses[0]),
                        (other, &poses[1]),
                        0.1,
                        PieceSide::B,
                        &mut hint,
                        &mut scratch,
                        &mut touches,
                    );
                    let (a, b) = ((a, at), (b, &poses[0]));
                    panics.look("distance_lower_bound", || distance_lower_bound(a, b, &hint));
                    let (mut one, mut two, mut three) = (hint, hint, hint);
                    panics
                        .look("signed_distance", || signed_distance(a, b, &mut one, &mut scratch));
                    panics.look("overlap", || overlap(a, b, &mut two, &mut scratch));
                    panics.look("manifold", || {
                        manifold(b, a, 0.1, PieceSide::A, &mut three, &mut scratch, &mut touches)
                    });
                }
            }
        }
    }
    let boxes = poses.map(|pose| Aabb::from_piece(&pieces[0], &pose));
    panics.look("Sweep::pairs", || Sweep::new().pairs(&boxes, |_, _| ()));
}

/// Checks memory that was used for one world and then for another.
#[test]
fn a_search_in_another_world_does_not_panic() {
    let body = |pieces: usize| {
        let ball = |index: usize| {
            let ball = Piece::sphere(0.1).unwrap();
            ball.moved_by(&Matrix3::identity(), &Vector3::new(index as f64, 0.0, 0.0)).unwrap()
        };
        let pieces: Vec<_> = (0..pieces).map(ball).collect();
        RigidBody::solid(1.0, &pieces).unwrap().0
    };
    let world = |bodies: [usize; 2]| {
        let bodies = bodies.map(body).to_vec();
        World::new(Parameters { bodies, ..world_of(2).parameters().clone() }).unwrap()
    };
    let (first, second) = (world([1, 3]), world([3, 1]));
    let mut panics = Panics::default();
    for (before, after) in [(&first, &second), (&second, &first), (&first, &world_of(2))] {
        let mut candidates = Candidates::new();
        let states = tower(2);
        candidates.find(Detection::default(), before, &states, &states);
        let mut asked = candidates.clone();
        panics.look("overlap at once", || asked.deepest_overlap(after, &states));
        panics.look("find", || candidates.find(Detection::default(), after, &states, &states));
        panics.look("overlap", || candidates.deepest_overlap(after, &states));
    }
}

/// Checks that empty lists and missing parts are refused, or have their documented result.
#[test]
fn empty_lists_and_missing_parts_are_refused() {
    let unit = Matrix3::identity();
    let none: [Vector3<f64>; 0] = [];
    for (name, refused) in [
        ("a body without points", RigidBody::new(1.0, unit, &none).is_err()),
        ("a body without pieces", RigidBody::from_pieces(1.0, unit, vec![]).is_err()),
        ("a solid of nothing", RigidBody::solid(1.0, &[]).is_err()),
        ("a hull of nothing", Hull::from_points(&none).is_err()),
        ("a mesh of nothing", Mesh::new(vec![], vec![]).is_err()),
        ("a mesh without its vertices", Mesh::new(vec![], vec![[0, 1, 2]; 4]).is_err()),
        ("a mesh from no text", parse_obj("").is_err()),
        ("a mesh from no bytes", parse_stl(&[]).is_err()),
        ("a world of nothing", {
            let parameters = Parameters { bodies: vec![], ..world_of(1).parameters().clone() };
            World::new(parameters).is_err()
        }),
        ("a pair of nothing", {
            world_of(2)
                .with_coefficient_between(Coefficient::Friction, 2, Partner::Body(0), 0.1)
                .is_err()
        }),
    ] {
        assert!(refused, "{name}");
    }
    assert_eq!(Polyline::new(vec![]).unwrap().mean(0.0, 1.0), Vector3::zeros());
    let mut point = ProgramPoint::zeros(8);
    let nothing = StepSolution::default();
    point.set_solution(&nothing, &Plane::level(), |_| 0.0, 0.5, 1e-6);
    assert_eq!(point, ProgramPoint::zeros(8));
}
