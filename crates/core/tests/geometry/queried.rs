//! Random worlds for the tests of queries.

use crate::common::prelude::*;
use crate::pieces::*;

/// World and states of the bodies.
pub struct Queried {
    pub world: World,
    pub states: Vec<State>,
}

pub fn body(pieces: Vec<Piece>) -> RigidBody {
    RigidBody::from_pieces(1.0, Matrix3::identity(), pieces).unwrap()
}

pub fn world(bodies: Vec<RigidBody>, ground: Option<Plane>, fixed: Vec<Piece>) -> World {
    World::new(Parameters { ground, gravity: v(0.0, 0.0, -9.81), ..Parameters::new(bodies) })
        .unwrap()
        .with_fixed(fixed)
}

pub fn state_at(pose: &Pose) -> State {
    let turned = UnitQuaternion::from_matrix(&pose.rotation);
    let attitude = Vector4::new(turned.w, turned.i, turned.j, turned.k);
    State { attitude, ..State::at_rest(pose.position) }
}

/// Bodies of one to three pieces and fixed pieces in a cube of side 2 `size`.
pub fn random(draw: &mut WideDraw, bodies: usize, fixed: usize, size: f64) -> Queried {
    let several = |draw: &mut WideDraw| {
        let count = 1 + draw.index(3);
        body((0..count).map(|_| draw.piece()).collect())
    };
    let bodies: Vec<_> = (0..bodies).map(|_| several(draw)).collect();
    let placed = |draw: &mut WideDraw| {
        let (piece, pose) = (draw.piece(), draw.pose(size));
        piece.moved_by(&pose.rotation, &pose.position).unwrap()
    };
    let fixed = (0..fixed).map(|_| placed(draw)).collect();
    let states = bodies.iter().map(|_| state_at(&draw.pose(size))).collect();
    let ground = Plane::new(draw.direction(), -1.5 * size).unwrap();
    Queried { world: world(bodies, Some(ground), fixed), states }
}

impl Queried {
    /// Pieces of an object with their poses; none for the ground.
    pub fn pieces(&self, of: Partner) -> Vec<(&Piece, Pose)> {
        match of {
            Partner::Ground => Vec::new(),
            Partner::Fixed(index) => vec![(&self.world.fixed()[index], at(0.0, 0.0, 0.0))],
            Partner::Body(index) => {
                let pose = self.states[index].pose();
                self.world.bodies()[index].pieces().iter().map(|piece| (piece, pose)).collect()
            }
        }
    }

    /// All objects except the ground.
    pub fn solids(&self) -> Vec<Partner> {
        let bodies = (0..self.states.len()).map(Partner::Body);
        bodies.chain((0..self.world.fixed().len()).map(Partner::Fixed)).collect()
    }

    /// Signed distance of a piece from an object, over all pairs of pieces.
    pub fn distance(&self, piece: &Piece, pose: &Pose, of: Partner) -> f64 {
        if of == Partner::Ground {
            let plane = self.world.ground().unwrap();
            return -support(piece, pose, &-plane.normal()).1 - plane.offset();
        }
        let pieces = self.pieces(of);
        let each = pieces.iter().map(|(other, there)| separate((piece, pose), (other, there)));
        each.map(|apart| apart.distance).fold(f64::INFINITY, f64::min)
    }

    /// Signed distance of a point from an object.
    pub fn height(&self, point: &V, of: Partner) -> f64 {
        const RADIUS: f64 = 1e-6;
        let ball = Piece::sphere(RADIUS).unwrap();
        self.distance(&ball, &at(point.x, point.y, point.z), of) + RADIUS
    }

    /// Same world with all bodies, fixed pieces and the ground moved by `motion`.
    pub fn moved(&self, motion: &Pose) -> Self {
        let pose = |pose: Pose| Pose {
            position: motion.rotation * pose.position + motion.position,
            rotation: motion.rotation * pose.rotation,
        };
        let states = self.states.iter().map(|state| state_at(&pose(state.pose()))).collect();
        let moved = |piece: &Piece| piece.moved_by(&motion.rotation, &motion.position);
        let fixed = self.world.fixed().iter().map(|fixed| moved(fixed).unwrap()).collect();
        let plane = self.world.ground().unwrap();
        let normal = motion.rotation * plane.normal();
        let ground = Plane::new(normal, plane.offset() + normal.dot(&motion.position)).unwrap();
        Self { world: world(self.world.bodies().to_vec(), Some(ground), fixed), states }
    }

    /// Same world with the bodies in the reverse order.
    pub fn reversed(&self) -> Self {
        let bodies = self.world.bodies().iter().rev().cloned().collect();
        let fixed = self.world.fixed().to_vec();
        let world = world(bodies, self.world.ground().cloned(), fixed);
        Self { world, states: self.states.iter().rev().copied().collect() }
    }

    /// Object of the reversed world.
    pub fn reverse(&self, of: Partner) -> Partner {
        match of {
            Partner::Body(index) => Partner::Body(self.states.len() - 1 - index),
            still => still,
        }
    }
}
