//! Queries of a world at given states: rays, distances and overlaps.
//!
//! Queries use the convex pieces and the triangles that make contacts. They see every body, fixed piece and the
//! ground, also those whose contacts are excluded; a filter selects among them. Answers do not
//! depend on the order of bodies, except for the indices in them.
//!
//! ```
//! # use tumble_core::geometry::Piece;
//! # use tumble_core::mechanics::{RigidBody, Rotation, State};
//! # use tumble_core::query::{Query, Ray};
//! # use tumble_core::world::{Parameters, Partner, Plane, World};
//! # use nalgebra::{Matrix3, Vector3, Vector4};
//! # fn main() -> Result<(), tumble_core::error::Error> {
//! # let inertia = Matrix3::from_diagonal_element(0.004);
//! # let body = RigidBody::from_pieces(1.0, inertia, vec![Piece::sphere(0.1)?])?;
//! # let world = World::new(Parameters {
//! #     bodies: vec![body],
//! #     ground: Some(Plane::level()),
//! #     gravity: Vector3::new(0.0, 0.0, -9.81),
//! #     friction: 0.5,
//! #     time_step: 0.002,
//! #     rotation: Rotation::Momentum,
//! # })?;
//! # let states = [State {
//! #     position: Vector3::new(0.0, 0.0, 0.5),
//! #     attitude: Vector4::new(1.0, 0.0, 0.0, 0.0),
//! #     velocity: Vector3::zeros(),
//! #     spin: Vector3::zeros(),
//! # }];
//! let query = Query::new(&world, &states)?;
//! let down = Ray::new(Vector3::new(0.0, 0.0, 2.0), Vector3::new(0.0, 0.0, -1.0))?;
//! let hit = query.cast_ray(&down, |_| true).unwrap();
//! assert_eq!(hit.owner, Partner::Body(0));
//! assert!((hit.distance - 1.4).abs() < 1e-15);
//! let gap = query.distance(Partner::Body(0), Partner::Ground)?;
//! assert!((gap.distance - 0.4).abs() < 1e-15);
//! # Ok(())
//! # }
//! ```

mod distance;
mod ray;

pub use distance::{Distance, Nearby, PairDistance};
pub use ray::{Ray, RayHit};

use crate::contact::Partner;
use crate::contact::collider::{Collider, colliders_of, placed};
use crate::error::Error;
use crate::geometry::{Aabb, Piece, RayCaster, Terrain, Tree};
use crate::mechanics::{Pose, State};
use crate::world::World;
use nalgebra::Vector3;

/// A world at given states, prepared for queries.
///
/// The bounding boxes and their tree are made once, for n pieces in a time of n log² n. States that
/// change need a new query.
#[derive(Debug, Clone)]
pub struct Query<'a> {
    world: &'a World,
    poses: Vec<Pose>,
    colliders: Vec<Collider>,
    boxes: Vec<Aabb>,
    tree: Tree,
    caster: RayCaster,
}

impl<'a> Query<'a> {
    /// Prepares queries of `world` at `states`. Velocities are not used.
    ///
    /// # Errors
    /// [`Error::Count`] unless there is one state for each body; [`Error::OutOfRange`] for a
    /// position beyond ±1e6 m or an attitude that is not a unit quaternion to 1e-5.
    pub fn new(world: &'a World, states: &[State]) -> Result<Self, Error> {
        let count = states.len();
        if count != world.bodies().len() {
            return Err(Error::Count { field: "states", count, allowed: "one for each body" });
        }
        let still = Vector3::zeros();
        let pose = |state: &State| {
            let state = State { velocity: still, spin: still, ..*state };
            Ok(state.checked()?.pose())
        };
        let poses = states.iter().map(pose).collect::<Result<Vec<_>, Error>>()?;
        let colliders: Vec<_> = colliders_of(world).collect();
        let around = |collider: &Collider| {
            let (piece, pose) = placed(world, &poses, *collider);
            Aabb::from_piece(piece, pose)
        };
        let boxes: Vec<_> = colliders.iter().map(around).collect();
        let tree = Tree::new(&boxes);
        Ok(Self { world, poses, colliders, boxes, tree, caster: RayCaster::new()? })
    }

    /// Terrains and their owners.
    fn terrains(&self) -> impl Iterator<Item = (Partner, &'a Terrain)> {
        let first = self.world.fixed().len();
        let terrains = self.world.terrains().iter().enumerate();
        terrains.map(move |(index, terrain)| (Partner::Fixed(first + index), &**terrain))
    }

    /// Owner of the collider `index`.
    fn owner(&self, index: usize) -> Partner {
        self.colliders[index].owner.partner()
    }

    /// Piece and pose of the collider `index`.
    fn placed(&self, index: usize) -> (&Piece, &Pose) {
        placed(self.world, &self.poses, self.colliders[index])
    }
}
