//! Rays against the pieces and the ground of a world.

use super::Query;
use crate::contact::Partner;
use crate::error::{Error, all_in_range, in_range};
use nalgebra::Vector3;

/// A ray: a point, a direction, and a largest distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    pub(super) origin: Vector3<f64>,
    pub(super) direction: Vector3<f64>,
    pub(super) length: f64,
}

impl Ray {
    /// Ray from `origin` (m, world) along `direction`, of any length except 0.
    ///
    /// # Errors
    /// An origin beyond ±1e6 m; a direction that is zero or not finite.
    pub fn new(origin: Vector3<f64>, direction: Vector3<f64>) -> Result<Self, Error> {
        all_in_range("origin of the ray (m)", &origin, -1e6, 1e6, "-1e6 to 1e6")?;
        let largest = direction.amax();
        let allowed = "finite numbers that are not all 0";
        // amax() ignores NaN.
        let sum = direction.sum();
        let invalid = if sum.is_nan() { sum } else { largest };
        in_range("direction of the ray", invalid, f64::MIN_POSITIVE, f64::MAX, allowed)?;
        // The division first keeps the squares of the norm in range.
        let direction = (direction / largest).normalize();
        Ok(Self { origin, direction, length: f64::INFINITY })
    }

    /// Returns this ray with the largest distance `length` (m).
    ///
    /// # Errors
    /// A negative length or NaN.
    pub fn up_to(self, length: f64) -> Result<Self, Error> {
        let length = in_range("length of the ray (m)", length, 0.0, f64::INFINITY, "0 or more")?;
        Ok(Self { length, ..self })
    }

    /// Starting point (m, world).
    pub fn origin(&self) -> &Vector3<f64> {
        &self.origin
    }

    /// Unit direction (world).
    pub fn direction(&self) -> &Vector3<f64> {
        &self.direction
    }

    /// Largest distance (m).
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Point at `distance` (m) along the ray (m, world).
    pub fn at(&self, distance: f64) -> Vector3<f64> {
        self.origin + self.direction * distance
    }
}

/// First point of an object on a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayHit {
    /// Object that the ray hits.
    pub owner: Partner,
    /// Distance from the origin of the ray (m).
    pub distance: f64,
    /// Point of the hit (m, world).
    pub point: Vector3<f64>,
    /// Outward unit normal of the surface (world). For a ray that starts inside, it is opposite to
    /// the ray.
    pub normal: Vector3<f64>,
    /// True if the ray starts inside the object.
    pub inside: bool,
}

impl Query<'_> {
    /// Nearest hit of a ray with the objects that `keep` accepts.
    ///
    /// Objects are solid, but a terrain is a surface. A ray that starts inside one hits it at distance 0, with `inside` set.
    /// Pass a `keep` that leaves out this object to look through it. The ground is solid below its
    /// plane. Bodies of bare points have no volume and are never hit. Of two objects at the same
    /// distance, the first in the order of [`Partner`] counts.
    ///
    /// The time grows with the logarithm of the number of pieces, unless many lie along the ray.
    pub fn cast_ray(&self, ray: &Ray, keep: impl Fn(Partner) -> bool) -> Option<RayHit> {
        let mut nearest: Option<RayHit> = None;
        self.each_hit(ray, keep, &mut |hit| {
            if nearest.is_none_or(|known| hit.is_before(&known)) {
                nearest = Some(hit);
            }
            nearest.map_or(ray.length, |nearest| nearest.distance)
        });
        nearest
    }

    /// Hits of a ray with all objects that `keep` accepts, one for each object, by distance.
    ///
    /// See [`Query::cast_ray`].
    pub fn cast_ray_all(&self, ray: &Ray, keep: impl Fn(Partner) -> bool) -> Vec<RayHit> {
        let mut hits = Vec::new();
        self.each_hit(ray, keep, &mut |hit| {
            hits.push(hit);
            ray.length
        });
        hits.sort_unstable_by(|a, b| a.owner.cmp(&b.owner).then(a.distance.total_cmp(&b.distance)));
        hits.dedup_by_key(|hit| hit.owner);
        hits.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        hits
    }

    /// Calls `found` on the hits. It returns the distance beyond which hits no longer matter (m).
    fn each_hit(
        &self,
        ray: &Ray,
        keep: impl Fn(Partner) -> bool,
        found: &mut dyn FnMut(RayHit) -> f64,
    ) {
        let mut limit = ray.length;
        if let Some(hit) = self.ground_hit(ray).filter(|hit| keep(hit.owner)) {
            limit = found(hit);
        }
        for (owner, terrain) in self.terrains() {
            if keep(owner)
                && let Some((distance, normal)) = terrain.enter(&ray.origin, &ray.direction, limit)
            {
                limit = found(ray.hit(owner, distance, Some(normal)));
            }
        }
        // Rounding error of the boxes' sides seen from the origin.
        let margin = 16.0 * f64::EPSILON * (self.tree.reach() + ray.origin.amax());
        self.tree.visit(
            &mut (limit, self.caster.clone()),
            |(limit, _), around| {
                let entry = around.entry(&ray.origin, &ray.direction, ray.length, margin);
                entry.is_some_and(|(from, _)| from <= limit + margin)
            },
            |(limit, caster), index| {
                let owner = self.owner(index);
                if !keep(owner) {
                    return;
                }
                let (piece, pose) = self.placed(index);
                let entry = caster.enter(piece, pose, &ray.origin, &ray.direction);
                if let Some(entry) = entry.filter(|entry| entry.distance <= ray.length) {
                    *limit = found(ray.hit(owner, entry.distance, entry.normal));
                }
            },
        );
    }

    fn ground_hit(&self, ray: &Ray) -> Option<RayHit> {
        let ground = self.world.ground()?;
        let height = ground.normal().dot(&ray.origin) - ground.offset();
        if height <= 0.0 {
            return Some(ray.hit(Partner::Ground, 0.0, None));
        }
        let sinks = -ground.normal().dot(&ray.direction);
        let distance = height / sinks;
        let hits = sinks > 0.0 && distance <= ray.length;
        hits.then(|| ray.hit(Partner::Ground, distance, Some(*ground.normal())))
    }
}

impl Ray {
    fn hit(&self, owner: Partner, distance: f64, normal: Option<Vector3<f64>>) -> RayHit {
        let (point, inside) = (self.at(distance), normal.is_none());
        RayHit { owner, distance, point, normal: normal.unwrap_or(-self.direction), inside }
    }
}

impl RayHit {
    fn is_before(&self, other: &Self) -> bool {
        let order = self.distance.total_cmp(&other.distance);
        order.then(self.owner.cmp(&other.owner)).is_lt()
    }
}
