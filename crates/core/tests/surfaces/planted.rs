//! Contacts that are not there are found by (18g), whatever the solver says.

use crate::common::draw::WideDraw;
use crate::common::prelude::*;
use crate::floors::{block, on_terrain, world};
use crate::shapes::standing;
use tumble_core::contact::{ContactKey, ContactLaw, Features, PairFeatures};
use tumble_core::geometry::terrain::HeightField;
use tumble_core::geometry::{Feature, PieceSide, Terrain};

/// Error (18g) of one loaded contact of the body 0 with the fixed collider `index` (m). The body's
/// `point` touches a plane with the `normal` (world).
fn error(
    world: &World,
    state: &State,
    index: usize,
    piece: usize,
    point: Vector3<f64>,
    normal: Vector3<f64>,
) -> f64 {
    let feature = Feature::Vertex(PieceSide::A, 0);
    let pair = Some(PairFeatures { pieces: (0, piece), feature, plane: 0 });
    let key = ContactKey { body: 0, point: 0, partner: Partner::Fixed(index), pair };
    let pose = state.pose();
    let frame = *Plane::new(normal, 0.0).unwrap().frame();
    let offset = normal.dot(&(pose.position + pose.rotation * point));
    let features = Features::from_plane(point, 0.0, frame, offset);
    let law = ContactLaw::plastic(0.0);
    let contact = Contact::new(key, features, law, (&world.bodies()[0], &pose), None);
    let mut candidates = Candidates::from(vec![contact]);
    candidates.placement_error(world, &[*state], &[*state], [Vector3::z()])
}

#[test]
fn ghost_contact_at_a_flush_joint_has_an_error_and_the_true_one_has_none() {
    let body = standing("cube", &mut WideDraw::wide(1));
    let tiles =
        vec![block([-1.0, -1.0, -0.2], [0.0, 1.0, 0.0]), block([0.0, -1.0, -0.2], [1.0, 1.0, 0.0])];
    let world = world(&body.body, false, 0.5).with_fixed(tiles);
    let half = body.height;
    let state = body.at([-half, 0.0], 0.0, [0.0; 3]);
    let corner = Vector3::new(half, half, -half);
    assert_eq!(error(&world, &state, 0, 0, corner, Vector3::z()), 0.0);
    assert_eq!(error(&world, &state, 1, 0, corner, Vector3::z()), 0.0);
    assert!(error(&world, &state, 1, 0, corner, -Vector3::x()) > 0.01);
    let oblique = Vector3::new(-0.6, 0.0, 0.8);
    assert!(error(&world, &state, 1, 0, corner, oblique) > 0.01);
}

#[test]
fn contact_beyond_the_end_of_a_face_has_an_error() {
    let body = standing("cube", &mut WideDraw::wide(1));
    let world =
        world(&body.body, false, 0.5).with_fixed(vec![block([-1.0, -1.0, -0.2], [0.0, 1.0, 0.0])]);
    let half = body.height;
    // The corner is 5 cm beyond the face in its plane.
    let state = body.at([0.05 - half, 0.0], 0.0, [0.0; 3]);
    let corner = Vector3::new(half, half, -half);
    let found = error(&world, &state, 0, 0, corner, Vector3::z());
    assert!((found - 0.05).abs() < 1e-6, "{found}");
}

#[test]
fn wrong_side_of_a_facet_has_an_error() {
    let body = standing("cube", &mut WideDraw::wide(1));
    let field = HeightField::new(vec![0.0; 25], 5, [0.5, 0.5]).unwrap();
    let (triangle, place) = (9, Vector3::zeros());
    let terrain = Terrain::from(field);
    let [a, b, c] = terrain.corners(triangle);
    let middle = (a + b + c) / 3.0 + place;
    let world = on_terrain(world(&body.body, false, 0.5), terrain);
    let half = body.height;
    let state = body.at([middle.x - half, middle.y - half], 0.0, [0.0; 3]);
    let corner = Vector3::new(half, half, -half);
    assert_eq!(error(&world, &state, 0, triangle, corner, Vector3::z()), 0.0);
    assert!(error(&world, &state, 0, triangle, corner, -Vector3::z()) > 0.01);
}

/// A contact is found where the bodies are within the step. At its end the point is a little beyond the tile,
/// over the next one. The next tile hides the body's face from the first tile there, and not at the border.
#[test]
fn contact_of_a_body_that_crosses_a_joint_of_tiles_has_no_error() {
    let body = standing("cube", &mut WideDraw::wide(1));
    let tile = Piece::cuboid(Vector3::new(1.0, 1.0, 0.1)).unwrap();
    let (tile, _) = RigidBody::solid(20.0, &[tile]).unwrap();
    let world = euler(Parameters {
        ground: None,
        gravity: Vector3::zeros(),
        friction: 0.0,
        ..Parameters::new(vec![body.body.clone(), tile.clone(), tile])
    });
    let half = body.height;
    let lies = |x: f64| State {
        position: Vector3::new(x, 0.0, -0.1),
        ..body.at([0.0, 0.0], 0.0, [0.0; 3])
    };
    let at = |x: f64| [body.at([x - half, 0.0], 0.0, [0.0; 3]), lies(-1.0), lies(1.0)];
    let beyond = |by: f64, normal: Vector3<f64>| {
        let states = at(by - 0.003);
        let next = at(by);
        let feature = Feature::Vertex(PieceSide::A, 0);
        let pair = PairFeatures { pieces: (0, 0), feature, plane: 0 };
        let key = ContactKey { body: 0, point: 0, partner: Partner::Body(1), pair: Some(pair) };
        let frame = *Plane::new(normal, 0.0).unwrap().frame();
        // The middle of a lower edge of the cube, and the top or the side of the tile.
        let point = Vector3::new(half, 0.0, -half);
        let offset = normal.dot(&Vector3::new(1.0, 0.0, 0.1));
        let features = Features::from_plane(point, 0.0, frame, offset);
        let (a, b) = (states[0].pose(), states[1].pose());
        let bodies = world.bodies();
        let law = ContactLaw::plastic(0.0);
        let contact = Contact::new(key, features, law, (&bodies[0], &a), Some((&bodies[1], &b)));
        let mut candidates = Candidates::from(vec![contact]);
        candidates.placement_error(&world, &states, &next, [Vector3::z()])
    };
    assert_eq!(beyond(6e-6, Vector3::z()), 0.0);
    assert_eq!(beyond(1e-3, Vector3::z()), 0.0);
    assert!(beyond(6e-6, Vector3::x()) > 1e-3);
}

/// A cube that ends deeper in a tile than it began has lost a contact, and one that stays deep or is lifted has not.
#[test]
fn a_cube_that_sinks_into_a_tile_is_found() {
    let body = standing("cube", &mut WideDraw::wide(1));
    let tile = block([-1.0, -1.0, -0.2], [1.0, 1.0, 0.0]);
    let world = world(&body.body, false, 0.5).with_fixed(vec![tile]);
    let at = |depth: f64| {
        let state = body.at([0.0, 0.0], 0.0, [0.0; 3]);
        [State { position: state.position - Vector3::z() * depth, ..state }]
    };
    let mut candidates = Candidates::new();
    let mut sinks = |from: f64, to: f64| candidates.sunk_pair(&world, &at(from), &at(to));
    let pair = [Partner::Body(0), Partner::Fixed(0)];
    assert_eq!(sinks(0.0, 1e-4), Some(pair));
    assert_eq!(sinks(-1e-4, 1e-4), Some(pair));
    assert_eq!(sinks(1e-3, 1.1e-3), Some(pair));
    // 10⁻⁴ of the cube's reach of at least 0.14 m is allowed.
    assert_eq!(sinks(0.0, 1.3e-5), None);
    assert_eq!(sinks(1e-3, 1e-3), None);
    assert_eq!(sinks(1e-3, 5e-4), None);
    assert_eq!(sinks(0.0, -1e-3), None);
}
