//! Queries of a scene at given states, shared by scenes and simulations.

use crate::arrays::{Array, Numbers, list, numbers, shaped};
use crate::errors::refused;
use crate::scene::{in_python, read};
use nalgebra::{Matrix3, Vector3};
use pyo3::prelude::*;
use std::collections::BTreeSet;
use std::path::Path;
use tumble_core::contact::Partner;
use tumble_core::mechanics::{Pose, State};
use tumble_core::query::{Distance, Query, Ray, RayHit};
use tumble_core::world::World;
use tumble_scene::scene::Scene as Content;

/// A scene at given states.
pub struct Placed<'a> {
    pub content: &'a Content,
    pub world: &'a World,
    pub states: &'a [State],
}

/// Hits of rays: owners, distances (R,), points (R, 3), normals (R, 3), and inside flags (R,).
pub type Hits<'py> = (Vec<Option<String>>, Array<'py>, Array<'py>, Array<'py>, Array<'py, bool>);

/// A distance (m), two points (2, 3) and a normal (3,).
pub type Between<'py> = (f64, Array<'py>, Array<'py>);

impl Placed<'_> {
    fn query(&self) -> PyResult<Query<'_>> {
        Query::new(self.world, self.states).map_err(refused)
    }

    fn name(&self, of: Partner) -> String {
        if of == Partner::Ground {
            "ground".to_owned()
        } else {
            self.content.partner(of).to_owned()
        }
    }

    /// Objects with this name. Pieces of one fixed object share it.
    fn named(&self, name: &str) -> PyResult<Vec<Partner>> {
        if name == "ground" {
            return Ok(vec![Partner::Ground]);
        }
        let places = |names: &[String]| -> Vec<usize> {
            let same = names.iter().enumerate().filter(|(_, known)| *known == name);
            same.map(|(index, _)| index).collect()
        };
        let bodies = places(&self.content.bodies).into_iter().map(Partner::Body);
        let fixed = places(&self.content.fixed).into_iter().map(Partner::Fixed);
        let found: Vec<_> = bodies.chain(fixed).collect();
        match found[..] {
            [] => Err(refused(format!(
                "{name:?} is unknown; the name of a body or fixed piece, or \"ground\", is needed"
            ))),
            _ => Ok(found),
        }
    }

    fn all_named(&self, names: &[String]) -> PyResult<Vec<Partner>> {
        let mut all = Vec::new();
        for name in names {
            all.extend(self.named(name)?);
        }
        all.sort_unstable();
        Ok(all)
    }

    /// Casts rays (R, 3) of at most the length `most` (m), which ignore some objects. Without `all`
    /// there is one row for each ray; with it, one for each object that the only ray hits.
    pub fn cast<'py>(
        &self,
        py: Python<'py>,
        rays: [&Numbers<'_>; 2],
        most: f64,
        ignored: &[String],
        all: bool,
    ) -> PyResult<Hits<'py>> {
        let ignored = self.all_named(ignored)?;
        let keep = |of: Partner| ignored.binary_search(&of).is_err();
        let query = self.query()?;
        let [origins, directions] = [numbers("origins", rays[0])?, numbers("directions", rays[1])?];
        let mut rows: Vec<Option<RayHit>> = Vec::new();
        let rays = origins.chunks_exact(3).zip(directions.chunks_exact(3));
        for (index, (origin, direction)) in rays.enumerate() {
            let vector = |of: &[f64]| Vector3::new(of[0], of[1], of[2]);
            let ray = Ray::new(vector(origin), vector(direction)).and_then(|ray| ray.up_to(most));
            let ray = ray.map_err(|why| match origins.len() {
                3 => refused(why),
                _ => refused(format!("ray {index}: {why}")),
            })?;
            if all {
                let mut names = BTreeSet::new();
                let mut hits = query.cast_ray_all(&ray, keep);
                hits.retain(|hit| names.insert(self.name(hit.owner)));
                rows.extend(hits.into_iter().map(Some));
            } else {
                rows.push(query.cast_ray(&ray, keep));
            }
        }
        let count = rows.len();
        let nowhere = Vector3::repeat(f64::NAN);
        let column = |part: fn(&RayHit) -> Vector3<f64>| -> Vec<f64> {
            let each = rows.iter().map(|hit| hit.as_ref().map_or(nowhere, part));
            each.flat_map(<[f64; 3]>::from).collect()
        };
        let distances =
            rows.iter().map(|hit| hit.as_ref().map_or(f64::INFINITY, |hit| hit.distance)).collect();
        let inside = rows.iter().map(|hit| hit.as_ref().is_some_and(|hit| hit.inside)).collect();
        let owners = rows.iter().map(|hit| hit.as_ref().map(|hit| self.name(hit.owner))).collect();
        Ok((
            owners,
            list(py, distances)?,
            shaped(py, column(|hit| hit.point), &[count, 3])?,
            shaped(py, column(|hit| hit.normal), &[count, 3])?,
            list(py, inside)?,
        ))
    }

    /// Distance of two objects by name.
    pub fn distance<'py>(
        &self,
        py: Python<'py>,
        first: &str,
        second: &str,
    ) -> PyResult<Between<'py>> {
        let query = self.query()?;
        let mut nearest: Option<Distance> = None;
        for one in self.named(first)? {
            for other in self.named(second)? {
                let found = query.distance(one, other).map_err(refused)?;
                if nearest.is_none_or(|nearest| found.distance < nearest.distance) {
                    nearest = Some(found);
                }
            }
        }
        let Some(Distance { distance, points, normal }) = nearest else {
            return Err(refused("distance: two objects are needed"));
        };
        let points = points.into_iter().flat_map(<[f64; 3]>::from).collect();
        let normal = <[f64; 3]>::from(normal).to_vec();
        Ok((distance, shaped(py, points, &[2, 3])?, list(py, normal)?))
    }

    /// Names of the objects within a distance (m) of a piece, each with its signed distance (m).
    /// `text` has the fields of the piece, and its mesh is relative to `path`.
    pub fn near(
        &self,
        text: &str,
        path: &Path,
        within: f64,
        ignored: &[String],
    ) -> PyResult<Vec<(String, f64)>> {
        let piece = Content::piece_from_text(text, path, &read).map_err(in_python)?;
        let ignored = self.all_named(ignored)?;
        let pose = Pose { position: Vector3::zeros(), rotation: Matrix3::identity() };
        let keep = |of: Partner| ignored.binary_search(&of).is_err();
        let found = self.query()?.near(&piece, &pose, within, keep).map_err(refused)?;
        let mut near: Vec<(String, f64)> = Vec::new();
        for found in found {
            let name = self.name(found.owner);
            match near.iter_mut().find(|(known, _)| *known == name) {
                Some((_, distance)) => *distance = distance.min(found.distance),
                None => near.push((name, found.distance)),
            }
        }
        Ok(near)
    }

    /// Pairs within a distance (m): names of a body and another object, and their signed distance
    /// (m). Pairs whose contacts are excluded are left out unless `excluded`.
    pub fn pairs(&self, within: f64, excluded: bool) -> PyResult<Vec<(String, String, f64)>> {
        let keep = |body: usize, of: Partner| excluded || self.world.may_touch(body, of);
        let found = self.query()?.pairs_within(within, keep).map_err(refused)?;
        let mut pairs: Vec<(String, String, f64)> = Vec::new();
        for pair in found {
            let names = (self.name(Partner::Body(pair.body)), self.name(pair.partner));
            // Pieces of one fixed object are consecutive.
            match pairs.last_mut().filter(|last| (&last.0, &last.1) == (&names.0, &names.1)) {
                Some(last) => last.2 = last.2.min(pair.distance),
                None => pairs.push((names.0, names.1, pair.distance)),
            }
        }
        Ok(pairs)
    }
}
