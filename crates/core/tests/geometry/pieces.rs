//! Pieces and poses for the geometry tests, and slow independent reference methods.

// Every test program compiles this file separately and uses only a part of it.
#![allow(dead_code)]

pub use crate::common::draw::WideDraw;
use crate::common::prelude::*;
use tumble_core::geometry::{
    Hint, ManifoldPoint, PairScratch, PieceSide, Separation, manifold, signed_distance,
};

pub type V = Vector3<f64>;

pub fn v(x: f64, y: f64, z: f64) -> V {
    V::new(x, y, z)
}

pub fn turn(x: f64, y: f64, z: f64) -> Matrix3<f64> {
    *Rotation3::new(v(x, y, z)).matrix()
}

pub fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose { position: v(x, y, z), rotation: Matrix3::identity() }
}

impl WideDraw {
    pub fn pose(&mut self, size: f64) -> Pose {
        let angle = self.within(0.0, 3.1);
        let rotation = *Rotation3::new(self.direction() * angle).matrix();
        Pose { position: self.vector(size), rotation }
    }

    /// Random box, hull, sphere, capsule or rounded hull, moved within its body.
    pub fn piece(&mut self) -> Piece {
        let piece = self.centred_piece();
        let place = self.pose(0.3);
        piece.moved_by(&place.rotation, &place.position).unwrap()
    }

    pub fn centred_piece(&mut self) -> Piece {
        match self.index(5) {
            0 => Piece::cuboid(self.half_sides()),
            1 => self.cloud(0.0),
            2 => Piece::sphere(self.within(0.1, 0.6)),
            3 => Piece::capsule(self.within(0.1, 0.8), self.within(0.05, 0.4)),
            _ => {
                let radius = self.within(0.01, 0.2);
                self.cloud(radius)
            }
        }
        .unwrap()
    }

    pub fn half_sides(&mut self) -> V {
        V::from_fn(|_, _| self.within(0.1, 0.6))
    }

    fn cloud(&mut self, radius: f64) -> Result<Piece, Error> {
        let count = 5 + self.index(20);
        let points: Vec<V> = (0..count).map(|_| self.vector(0.6)).collect();
        Piece::hull(&points, radius)
    }
}

/// Separation with new memory, without hints.
pub fn separate(a: (&Piece, &Pose), b: (&Piece, &Pose)) -> Separation {
    signed_distance(a, b, &mut Hint::default(), &mut PairScratch::default())
}

pub fn touches(a: (&Piece, &Pose), b: (&Piece, &Pose), reach: f64) -> (f64, Vec<ManifoldPoint>) {
    let mut out = Vec::new();
    let gap = manifold(
        a,
        b,
        reach,
        PieceSide::B,
        &mut Hint::default(),
        &mut PairScratch::default(),
        &mut out,
    );
    (gap, out)
}

/// Support point of a piece along a direction [world frame], and its height.
pub fn support(piece: &Piece, pose: &Pose, axis: &V) -> (V, f64) {
    let placed = piece.core().vertices().iter().map(|x| pose.rotation * x + pose.position);
    let best = placed.max_by(|x, y| axis.dot(x).total_cmp(&axis.dot(y))).unwrap();
    let point = best + axis * piece.radius();
    (point, axis.dot(&point))
}

/// Distance of two pieces along an axis. It is at most their separation.
pub fn gap_along(a: (&Piece, &Pose), b: (&Piece, &Pose), axis: &V) -> f64 {
    -support(b.0, b.1, &-axis).1 - support(a.0, a.1, axis).1
}

/// Lower and upper bound of the distance. The method of Frank and Wolfe finds the shortest vector
/// of the difference of the cores, minus the radii. It is slow (the error decreases like 1/k). It
/// shares only the vertices with the library.
pub fn distance_bounds(a: (&Piece, &Pose), b: (&Piece, &Pose), steps: usize) -> (f64, f64) {
    let core = |(piece, pose): (&Piece, &Pose), axis: &V| {
        support(piece, pose, axis).0 - axis * piece.radius()
    };
    let mut x = core(b, &V::x()) - core(a, &V::x());
    let mut below = 0.0f64;
    for _ in 0..steps {
        let axis = x.try_normalize(0.0).unwrap_or_else(V::x);
        let corner = core(b, &-axis) - core(a, &axis);
        below = below.max(axis.dot(&corner));
        let towards = corner - x;
        let length = towards.norm_squared();
        if length == 0.0 {
            break;
        }
        x += towards * (-x.dot(&towards) / length).clamp(0.0, 1.0);
    }
    let radii = a.0.radius() + b.0.radius();
    (below - radii, x.norm() - radii)
}

/// Point of a touch on its owner's surface, its projection on the plane, and the plane's normal
/// [world frame].
pub fn in_world(touch: &ManifoldPoint, a: &Pose, b: &Pose) -> (V, V, V) {
    let (own, other) = if touch.point_of == PieceSide::A { (a, b) } else { (b, a) };
    let normal = other.rotation * touch.normal;
    let point = own.rotation * touch.point + own.position - normal * touch.point_radius;
    let height = normal.dot(&(point - other.position)) - touch.offset;
    (point, point - normal * height, normal)
}

/// Checks the definition of a touch. The gap is the height of the point over the plane, and the
/// normal is a unit vector. The point is in its core, and the plane's owner is below the plane.
pub fn check_touch(touch: &ManifoldPoint, a: (&Piece, &Pose), b: (&Piece, &Pose)) {
    let (own, other) = if touch.point_of == PieceSide::A { (a, b) } else { (b, a) };
    let world = own.1.rotation * touch.point + own.1.position;
    let w = other.1.rotation.tr_mul(&(world - other.1.position));
    let gap = touch.normal.dot(&w) - touch.offset - touch.point_radius;
    assert!((gap - touch.gap).abs() < 1e-12, "{gap} {}", touch.gap);
    assert!((touch.normal.norm() - 1.0).abs() < 1e-12);
    assert_eq!(touch.point_radius, own.0.radius());
    for face in own.0.core().faces() {
        assert!(face.normal.dot(&touch.point) - face.offset < 1e-9, "a point outside its core");
    }
    for vertex in other.0.core().vertices() {
        let height = touch.normal.dot(vertex) + other.0.radius() - touch.offset;
        assert!(height < 1e-8, "the plane's owner is {height:e} m above it");
    }
}
