//! Cones of normals and level directions at a point of several pieces.

use nalgebra::Vector3;
use std::f64::consts::TAU;

/// Distance within which surfaces are one, as a fraction of the smaller piece. A larger step between
/// two faces is real.
pub(super) const FLUSH: f64 = 1e-6;
/// Sine below which a direction is level, and of angles that are equal.
pub(super) const LEVEL: f64 = 1e-6;

/// Normals of one piece at a point (world).
#[derive(Debug, Clone, Default)]
pub(super) struct LocalSurface {
    pub(super) normals: Vec<Vector3<f64>>,
    /// True if the piece cannot move against the one that is examined.
    pub(super) is_rigid: bool,
}

/// True unless all facets among the `surfaces` at a point have the outward normal `n` of a contact on
/// one side and the other piece's centre on the other side. `toward` is the vector to the centre (m).
pub(super) fn is_on_its_side<'a>(
    surfaces: impl Iterator<Item = &'a LocalSurface>,
    n: &Vector3<f64>,
    toward: &Vector3<f64>,
) -> bool {
    let mut facets = surfaces.filter_map(|of| match of.normals[..] {
        [up, down, ..] if up == -down => Some(up),
        _ => None,
    });
    let is_on_side = |up: Vector3<f64>| up.dot(n) * up.dot(toward) >= 0.0;
    facets.next().is_none_or(|first| is_on_side(first) || facets.any(is_on_side))
}

/// Projection of the unit vector `n` on the tangent cone of the `normals`. It is zero if n is a
/// combination of normals with positive weights.
///
/// It is n itself, or lies in the plane across one normal, or on the line across two. Of those in the
/// cone it is the longest.
pub(super) fn rise(normals: &[Vector3<f64>], n: &Vector3<f64>) -> Vector3<f64> {
    if normals.iter().any(|m| (m - n).norm_squared() <= LEVEL * LEVEL) {
        return Vector3::zeros();
    }
    let is_allowed = |w: &Vector3<f64>| normals.iter().all(|m| m.dot(w) <= LEVEL * w.norm());
    if is_allowed(n) {
        return *n;
    }
    let mut longest = Vector3::zeros();
    let mut keep = |w: Vector3<f64>| {
        if w.norm_squared() > longest.norm_squared() && is_allowed(&w) {
            longest = w;
        }
    };
    for (index, m) in normals.iter().enumerate() {
        keep(n - m * m.dot(n));
        for other in &normals[index + 1..] {
            if let Some(line) = m.cross(other).try_normalize(LEVEL) {
                keep(line * line.dot(n));
            }
        }
    }
    longest
}

/// True if the unit vector `n` is a combination of the `normals` with positive weights, to
/// [`LEVEL`].
pub(super) fn is_in_cone(normals: &[Vector3<f64>], n: &Vector3<f64>) -> bool {
    rise(normals, n).norm_squared() <= LEVEL * LEVEL
}

/// True if the level directions (eq. 4e) of the surfaces leave an arc of the circle about `n` free
/// that is longer than `free` (rad). `ends` is a workspace.
pub(super) fn leaves_free<'a>(
    surfaces: impl Iterator<Item = &'a LocalSurface> + Clone,
    n: &Vector3<f64>,
    free: f64,
    ends: &mut Vec<f64>,
) -> bool {
    // Two directions across n, from the world axis that is most perpendicular to it.
    let axis = Vector3::ith(n.iamin(), 1.0);
    let first = (axis - n * n.dot(&axis)).normalize();
    let second = n.cross(&first);
    let direction = |angle: f64| {
        let (sine, cosine) = libm::sincos(angle);
        first * cosine + second * sine
    };
    let has = |of: &LocalSurface, w: &Vector3<f64>| {
        of.normals.iter().all(|m| {
            let across = m - n * n.dot(m);
            across.norm() <= LEVEL || across.dot(w) <= LEVEL * across.norm()
        })
    };
    let is_level = |angle: f64| {
        let w = direction(angle);
        surfaces.clone().any(|of| has(of, &w))
    };
    // Ends of the level directions of each surface.
    ends.clear();
    for of in surfaces.clone() {
        let lines = of.normals.iter().filter_map(|m| n.cross(m).try_normalize(LEVEL));
        let ways = lines.flat_map(|line| [line, -line]).filter(|w| has(of, w));
        ends.extend(ways.map(|w| libm::atan2(second.dot(&w), first.dot(&w))));
    }
    // Angle from one end to the next one.
    let after = |from: f64| {
        // Angles differ by less than a turn.
        let positive = |turn: f64| if turn < 0.0 { turn + TAU } else { turn };
        let turns = ends.iter().map(|angle| positive(angle - from));
        turns.filter(|turn| (LEVEL..TAU - LEVEL).contains(turn)).fold(TAU, f64::min)
    };
    if ends.is_empty() {
        return !is_level(0.0);
    }
    ends.iter().any(|from| {
        let arc = after(*from);
        arc > free && !is_level(from + 0.5 * arc)
    })
}

#[cfg(test)]
#[path = "tests/cones.rs"]
mod tests;
