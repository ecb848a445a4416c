//! Time of the narrow phase for one pair in each regime, and of the broad phase.
//!
//! `cargo bench --bench geometry`.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Matrix3, Rotation3, Vector3};
use std::hint::black_box;
use tumble_core::geometry::{
    Aabb, Hint, PairScratch, Piece, PieceSide, Sweep, manifold, signed_distance,
};
use tumble_core::mechanics::Pose;

type V = Vector3<f64>;

fn pose(position: [f64; 3], angle: [f64; 3]) -> Pose {
    let rotation = *Rotation3::new(V::from(angle)).matrix();
    Pose { position: V::from(position), rotation }
}

fn pairs(criterion: &mut Criterion) {
    let cube = &Piece::cuboid(V::repeat(0.5)).expect("a box");
    let ball = &Piece::sphere(0.5).expect("a sphere");
    let rod = &Piece::capsule(0.5, 0.2).expect("a capsule");
    let ring = (0..32).map(|k| (f64::from(k / 2) * std::f64::consts::TAU / 16.0).sin_cos());
    let points: Vec<V> = ring
        .enumerate()
        .map(|(k, (sin, cos))| V::new(0.5 * cos, 0.5 * sin, if k % 2 == 0 { 0.5 } else { -0.5 }))
        .collect();
    let drum = &Piece::hull(&points, 0.0).expect("a hull");
    let half = std::f64::consts::FRAC_PI_4;
    let wheel = &Piece::cylinder(0.5, 0.5, 24).expect("a cylinder");
    let cone = &Piece::cone(0.5, 0.5, 24).expect("a cone");
    let egg = &Piece::ellipsoid(V::new(0.4, 0.4, 0.5), 24).expect("an ellipsoid");
    let cases = [
        ("box on box, aligned", cube, cube, pose([0.0, 0.0, 1.0], [0.0; 3])),
        ("box in box by 1e-9, turned", cube, cube, pose([0.1, 0.2, 1.0 - 1e-9], [1e-9, 0.0, 0.4])),
        ("box on box, on an edge", cube, cube, pose([0.1, 0.2, 1.2071], [half, 0.0, 0.0])),
        ("box on box, crossed edges", cube, cube, pose([1.05, 0.0, 1.0], [0.6, half, 0.3])),
        ("box apart from box", cube, cube, pose([0.3, 0.2, 1.1], [0.0, 0.0, 0.4])),
        ("sphere on box", cube, ball, pose([0.1, 0.2, 1.0], [0.1; 3])),
        ("sphere on box's edge", cube, ball, pose([0.8535, 0.2, 0.8535], [0.1; 3])),
        ("capsule on box", cube, rod, pose([0.1, 0.2, 0.7], [half * 2.0, 0.0, 0.0])),
        ("capsule on capsule", rod, rod, pose([0.4, 0.0, 0.1], [0.0; 3])),
        ("sphere on sphere", ball, ball, pose([0.6, 0.8, 0.0], [0.0; 3])),
        ("drum of 16 sides on box", cube, drum, pose([0.1, 0.2, 1.0], [0.0; 3])),
        ("cylinder on box, on its end", cube, wheel, pose([0.1, 0.2, 1.0], [0.0; 3])),
        (
            "cylinder on box, on its side",
            cube,
            wheel,
            pose([0.1, 0.2, 1.0], [half * 2.0, 0.0, 0.0]),
        ),
        ("cylinder on cylinder, parallel", wheel, wheel, pose([0.8, 0.6, 0.1], [0.0; 3])),
        ("cone on box", cube, cone, pose([0.1, 0.2, 1.0], [0.0; 3])),
        ("ellipsoid on box", cube, egg, pose([0.1, 0.2, 1.0], [0.0; 3])),
        ("ellipsoid on ellipsoid", egg, egg, pose([0.48, 0.64, 0.0], [0.0; 3])),
    ];
    let ground = Pose { position: V::zeros(), rotation: Matrix3::identity() };
    let mut scratch = PairScratch::default();
    for (name, a, b, pose) in &cases {
        let (mut hint, mut out) = (Hint::default(), Vec::new());
        criterion.bench_function(&format!("manifold/{name}"), |bencher| {
            bencher.iter(|| {
                let (a, b) = ((*a, black_box(&ground)), (*b, black_box(pose)));
                black_box(manifold(a, b, 1e-3, PieceSide::B, &mut hint, &mut scratch, &mut out))
            });
        });
        criterion.bench_function(&format!("separation/{name}"), |bencher| {
            bencher.iter(|| {
                let (a, b) = ((*a, black_box(&ground)), (*b, black_box(pose)));
                black_box(signed_distance(a, b, &mut hint, &mut scratch))
            });
        });
    }
}

/// Unit cubes, one in two units of length, in rows of a cube.
fn sweep(criterion: &mut Criterion) {
    let cube = Piece::cuboid(V::repeat(0.5)).expect("a box");
    for side in [5, 10, 20] {
        let place = |k: i32| {
            let at = [k % side, k / side % side, k / side / side].map(f64::from);
            Aabb::from_piece(&cube, &pose(at.map(|x| 1.3 * x), [0.1 * f64::from(k); 3]))
        };
        let boxes: Vec<Aabb> = (0..side.pow(3)).map(place).collect();
        let mut sweep = Sweep::new();
        criterion.bench_function(&format!("sweep/{} boxes", boxes.len()), |bencher| {
            bencher.iter(|| {
                let mut count = 0;
                sweep.pairs(black_box(&boxes), |_, _| count += 1);
                count
            });
        });
    }
}

criterion_group!(geometry, pairs, sweep);
criterion_main!(geometry);
