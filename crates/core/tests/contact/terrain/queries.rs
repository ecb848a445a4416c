//! Rays and distances of terrain, compared with a test of every triangle.

use super::*;
use tumble_core::query::{Query, Ray};
use tumble_core::world::Partner;

fn world_of(terrain: impl Into<Terrain>) -> World {
    on_terrain(&empty(body(Piece::sphere(0.1).unwrap()), 0.5), terrain)
}

fn height(x: f64, y: f64) -> f64 {
    0.3 * (2.0 * x).sin() * (1.5 * y).cos()
}

/// Terrains with the same numbers of triangles: a turned field and an odd surface.
fn terrains() -> Vec<(&'static str, Arc<Terrain>)> {
    let side = 31;
    let place = |index: usize| 0.2 * index as f64;
    let heights = (0..side * side).map(|at| height(place(at % side), place(at / side))).collect();
    let turn = Rotation3::from_euler_angles(0.2, -0.3, 0.5);
    let field = HeightField::new(heights, side, [0.2; 2]).unwrap();
    let field = field.moved_by(turn.matrix(), &V::new(-2.0, -3.0, 0.4)).unwrap();
    let surface = odd_surface(30, 0.2, 3, height);
    vec![("field", Arc::new(field.into())), ("surface", Arc::new(surface.into()))]
}

/// Distance along a ray to a triangle, from the barycentric coordinates of its crossing.
fn crossing([a, b, c]: [V; 3], origin: &V, direction: &V) -> Option<f64> {
    let matrix = Matrix3::from_columns(&[b - a, c - a, -direction]);
    let [u, v, t]: [f64; 3] = (matrix.try_inverse()? * (origin - a)).into();
    (u >= -1e-9 && v >= -1e-9 && u + v <= 1.0 + 1e-9 && t >= 0.0).then_some(t)
}

#[test]
fn rays_meet_the_nearest_triangle() {
    for (name, terrain) in terrains() {
        let fixed = Arc::clone(&terrain);
        let world = empty(body(Piece::sphere(0.1).unwrap()), 0.5);
        let world = world.with_terrains(vec![fixed]);
        let far = at([0.0, 0.0, 500.0], [0.0; 3], [0.0; 3]);
        let query = Query::new(&world, &[far]).unwrap();
        let mut random = Mt64::new(5);
        let mut any = |size: f64| size * (2.0 * uniform(&mut random) - 1.0);
        let mut hits = 0;
        for _ in 0..2000 {
            let origin = V::new(any(4.0), any(4.0), any(2.0));
            let direction = V::new(any(1.0), any(1.0), any(1.0)).normalize();
            let ray = Ray::new(origin, direction).unwrap();
            let found = query.cast_ray(&ray, |owner| owner != Partner::Body(0));
            let all = (0..terrain.count()).map(|triangle| terrain.corners(triangle));
            let wanted = all
                .filter_map(|corners| crossing(corners, &origin, &ray.direction().clone_owned()))
                .min_by(f64::total_cmp);
            match (found, wanted) {
                (Some(found), Some(wanted)) => {
                    assert!((found.distance - wanted).abs() < 1e-9, "{name}: {found:?} {wanted}");
                    assert_eq!(found.owner, Partner::Fixed(0));
                    assert!(found.normal.dot(&direction) <= 0.0);
                    hits += 1;
                }
                (None, None) => {}
                (found, wanted) => panic!("{name}: {found:?} {wanted:?}"),
            }
        }
        assert!(hits > 300, "{name}: {hits}");
    }
}

#[test]
fn distances_are_those_of_the_nearest_triangle() {
    for (name, terrain) in terrains() {
        let fixed = Arc::clone(&terrain);
        let ball = Piece::sphere(0.1).unwrap();
        let world = empty(body(ball.clone()), 0.5).with_terrains(vec![fixed]);
        let mut random = Mt64::new(6);
        let mut any = |size: f64| size * (2.0 * uniform(&mut random) - 1.0);
        for _ in 0..100 {
            let centre = V::new(any(4.0), any(4.0), any(3.0));
            let query = Query::new(&world, &[at(centre.into(), [0.0; 3], [0.0; 3])]).unwrap();
            let found = query.distance(Partner::Body(0), Partner::Fixed(0)).unwrap();
            let all =
                (0..terrain.count()).map(|triangle| nearest(terrain.corners(triangle), &centre));
            let wanted = all.min_by(f64::total_cmp).unwrap() - 0.1;
            assert!((found.distance - wanted).abs() < 1e-9, "{name}: {found:?} {wanted}");
            let back = query.distance(Partner::Fixed(0), Partner::Body(0)).unwrap();
            assert_eq!(back.distance, found.distance);
            let near = query.pairs_within(0.5, |_, _| true).unwrap();
            assert_eq!(near.len(), usize::from(wanted <= 0.5), "{name}: {near:?} {wanted}");
        }
    }
}

/// Distance of a point from a triangle, from its projection and the three sides.
fn nearest([a, b, c]: [V; 3], point: &V) -> f64 {
    let normal = (b - a).cross(&(c - a)).normalize();
    let foot = point - normal * normal.dot(&(point - a));
    let sides = [(a, b), (b, c), (c, a)];
    let inside = sides.iter().all(|(p, q)| normal.cross(&(q - p)).dot(&(foot - p)) >= 0.0);
    let to_side = |(p, q): &(V, V)| {
        let share = (q - p).dot(&(point - p)) / (q - p).norm_squared();
        (p + (q - p) * share.clamp(0.0, 1.0) - point).norm()
    };
    let least = sides.iter().map(to_side).fold(f64::INFINITY, f64::min);
    if inside { (foot - point).norm() } else { least }
}

#[test]
fn terrains_without_a_volume_have_no_distance_from_the_ground() {
    let world = world_of(level_field(2, 1.0));
    let query = Query::new(&world, &[at([0.0, 0.0, 5.0], [0.0; 3], [0.0; 3])]).unwrap();
    assert!(query.distance(Partner::Fixed(0), Partner::Ground).is_err());
    assert!(query.distance(Partner::Fixed(1), Partner::Body(0)).is_err());
}
