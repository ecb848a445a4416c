//! Contacts reconstructed from rows, and checked against the shapes of the bodies.
//!
//! Point and plane of a contact follow from its row. With the touching point p, the normal n, the
//! gap φ and the radius ρ,
//!
//! ```text
//! a = A_Aᵀ (p − r_A + ρ n),   n_B = A_Bᵀ n,   d = n_B·A_Bᵀ (p + ρ n − r_B) − ρ − φ
//! ```
//!
//! A row could contain any point and plane. So the point must lie on its piece, and the plane must touch
//! its piece. Between two polyhedra both must belong to the features in the key ([`super::named`]).
//! Points and planes of cylinders, cones and ellipsoids are judged after the step only. Contacts with a
//! force are also judged from the shapes
//! ([`Candidates::placement_error`](tumble_core::contact::Candidates::placement_error)).

use super::ContactRow;
use super::named::{self, BAND, EXACT, Misplaced, NamedContact, size};
use nalgebra::{Matrix3, Vector3};
use tumble_core::contact::{
    Contact, Curved, Features, PairFeatures, Partner, Plane, ellipsoid, round,
};
use tumble_core::geometry::{Ellipsoid, Feature, Piece};
use tumble_core::mechanics::{Pose, State};
use tumble_core::world::World;

/// Maximum sine of the angle between two touching faces whose edges or corners make contact.
const LEAN: f64 = 0.1;
/// Tolerance of a normal's length, and relative tolerance of recorded vectors.
const UNIT: f64 = 1e-9;

/// Pose of fixed pieces.
const FIXED: Pose = Pose { position: Vector3::new(0.0, 0.0, 0.0), rotation: IDENTITY };
const IDENTITY: Matrix3<f64> = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);

impl ContactRow {
    /// True if `world` has the body and the partner of this row.
    pub fn is_in(&self, world: &World) -> bool {
        let bodies = world.bodies().len();
        let has_partner = match self.partner {
            Partner::Ground => world.ground().is_some(),
            Partner::Fixed(index) => index < world.fixed_count(),
            Partner::Body(index) => index < bodies && index != self.body,
        };
        self.body < bodies && has_partner
    }

    /// Contact of this row between bodies at `states`.
    ///
    /// # Errors
    /// A body, piece or point that does not exist; a point off its piece; a plane that does not
    /// touch its piece; a normal that is not a unit vector.
    pub fn contact(&self, world: &World, states: &[State]) -> Result<Contact, Misplaced> {
        let bodies = world.bodies();
        let body = bodies.get(self.body).ok_or("refers to a body that does not exist")?;
        if !self.is_in(world) || states.len() != bodies.len() {
            return Err("refers to a partner that does not exist");
        }
        if (self.normal.norm() - 1.0).abs() > UNIT {
            return Err("has a normal that is not a unit vector");
        }
        let pose = states[self.body].pose();
        let other = match self.partner {
            Partner::Body(index) => Some((&bodies[index], states[index].pose())),
            Partner::Ground | Partner::Fixed(_) => None,
        };
        let features = match self.partner {
            Partner::Ground => self.on_ground(world, states)?,
            _ => self.on_piece(world, states, &pose, other.as_ref().map(|(_, pose)| pose))?,
        };
        let key = self.key.between(self.body, self.partner);
        let law = world.law_between(self.body, self.partner);
        let placed = other.as_ref().map(|(body, pose)| (*body, pose));
        let mut contact = Contact::new(key, features, law, (body, &pose), placed);
        contact.rebound = self.rebound;
        contact.set_friction(world, states);
        let size = body.reach() + pose.position.amax();
        if (pose.position + contact.arm - self.point).amax() > UNIT * size
            || (contact.normal() - self.normal).amax() > UNIT
            || (contact.gap - self.gap).abs() > UNIT * size
        {
            return Err("has a point, normal or gap that does not match its bodies");
        }
        contact.hold_back(world);
        Ok(contact)
    }

    /// Checks that the features of the `contact` are opposite each other at the start of the step.
    ///
    /// `moved` is the largest motion of the bodies at `states` in the step (m). Contacts with the
    /// ground and of round pieces always pass.
    ///
    /// # Errors
    /// Features at another place.
    pub fn is_there(
        &self,
        contact: &Contact,
        world: &World,
        states: &[State],
        moved: f64,
    ) -> Result<(), Misplaced> {
        let (Some(pair), None) = (self.key.pair, contact.features.curved) else { return Ok(()) };
        let (pose, other) = (states[self.body].pose(), self.partner.body());
        let other = other.map_or(FIXED, |index| states[index].pose());
        let pieces = self.pieces(world, &pair)?;
        if !named::is_sharp(pieces.0) || !named::is_sharp(pieces.1) {
            return Ok(());
        }
        let local = |point: Vector3<f64>| other.rotation.tr_mul(&(point - other.position));
        let point = local(pose.position + contact.arm);
        let named = NamedContact { key: contact.key, pair, pieces };
        named.check_start(&contact.features, &point, moved)
    }

    /// Contact point of the key, in contact with the ground, with the bodies at `states`.
    fn on_ground(&self, world: &World, states: &[State]) -> Result<Features, Misplaced> {
        let points = world.bodies()[self.body].contact_points();
        let point = points.get(self.key.point).ok_or("refers to a point that does not exist")?;
        if self.key.pair.is_some() {
            return Err("has a key with two pieces, but is with the ground");
        }
        if point.radius != self.radius {
            return Err("has a radius that its point does not have");
        }
        let ground = world.ground().ok_or("refers to a ground that does not exist")?;
        let (frame, offset) = (*ground.frame(), ground.offset());
        let features = Features::from_plane(point.position, point.radius, frame, offset);
        let Some(one) = point.smooth() else { return Ok(features) };
        let pose = states[self.body].pose();
        let is_flat = one.is_across(&pose.rotation.tr_mul(ground.normal()));
        self.on_ellipsoid(features, one, point.is_second || is_flat, (world, states))
    }

    /// `features` with the ellipsoid `one` of the body. With `anywhere`, the recorded point may be
    /// any point of the ellipsoid's surface.
    fn on_ellipsoid(
        &self,
        mut features: Features,
        one: Ellipsoid,
        anywhere: bool,
        (world, states): (&World, &[State]),
    ) -> Result<Features, Misplaced> {
        let at = (&states[self.body], self.partner.body().map(|index| &states[index]));
        let pose = at.0.pose();
        let map = world.lever_step();
        let core = self.point + self.normal * self.radius;
        let core = pose.rotation.tr_mul(&(core - pose.position));
        features.roll(one, Vector3::zeros(), at, &map);
        // In a short interval, other points are close to the nearest one.
        if !anywhere || (features.point - core).amax() <= 0.01 * UNIT * one.size() {
            return Ok(features);
        }
        let mut toward = -one.coordinates(&core);
        let off_span = (one.axes * toward + core - one.centre).norm() > EXACT * one.size();
        let length = toward.norm();
        if off_span || (length - 1.0).abs() > EXACT && length > EXACT {
            return Err("has a point that its ellipsoid does not have");
        }
        if length > 0.5 {
            toward /= length;
        }
        features.roll(one, toward, at, &map);
        Ok(features)
    }

    /// Pieces of the key.
    fn pieces<'a>(
        &self,
        world: &'a World,
        pair: &PairFeatures,
    ) -> Result<named::ContactPieces<'a>, Misplaced> {
        let own = world.bodies()[self.body].pieces().get(pair.pieces.0);
        let own = own.ok_or("refers to a piece that does not exist")?;
        let theirs = match self.partner {
            Partner::Body(index) => world.bodies()[index].pieces().get(pair.pieces.1),
            Partner::Fixed(index) => world.fixed_piece(index, pair.pieces.1),
            Partner::Ground => None,
        };
        Ok((own, theirs.ok_or("refers to a partner piece that does not exist")?))
    }

    /// Point and plane of the row, checked against the pieces of the key.
    fn on_piece(
        &self,
        world: &World,
        states: &[State],
        pose: &Pose,
        other: Option<&Pose>,
    ) -> Result<Features, Misplaced> {
        let pair = self.key.pair.ok_or("has a key without pieces")?;
        let (own, theirs) = self.pieces(world, &pair)?;
        let key = self.key.between(self.body, self.partner);
        let named = NamedContact { key, pair, pieces: (own, theirs) };
        let (other_pose, body) = (other.unwrap_or(&FIXED), &world.bodies()[self.body]);
        if let Feature::Round(part, other) = pair.feature
            && pair.plane == 0
        {
            let normal = other_pose.rotation.tr_mul(&self.normal);
            if let Some(features) = round([own, theirs], [part, other], &normal) {
                return if features.radius == self.radius {
                    named.check(&features, body).map(|()| features)
                } else {
                    Err("refers to features that its pieces do not have")
                };
            }
        }
        // Rounded features can also have planes, starting with the first that separates them.
        let is_round = matches!(pair.feature, Feature::Round(..));
        let has_faces =
            |piece: &Piece| !piece.core().faces().is_empty() || piece.smooth().is_some();
        if !is_round && !has_faces(own) && !has_faces(theirs) {
            return Err("has a key with faces, which its pieces do not have");
        }
        let other = other_pose;
        let centre = self.point + self.normal * self.radius;
        let point = pose.rotation.tr_mul(&(centre - pose.position));
        let normal = other.rotation.tr_mul(&self.normal);
        let turned = named.may_be_turned();
        let one = ellipsoid(own, pair.feature).filter(|_| !turned);
        // The gap of an ellipsoid is that of its nearest point, where the force need not act.
        let lowest = one.map_or(centre, |one| {
            let nearest = one.centre - one.farthest(&pose.rotation.tr_mul(&self.normal));
            pose.position + pose.rotation * nearest
        });
        let local = other.rotation.tr_mul(&(lowest - other.position));
        let offset = normal.dot(&local) - self.radius - self.gap;
        if matches!(pair.feature, Feature::Ellipsoid(..)) && one.is_none() && !turned {
            return Err("refers to features that its pieces do not have");
        }
        let plane =
            Plane::new(normal, 0.0).map_err(|_| "has a normal that is not a unit vector")?;
        let mut features = Features::from_plane(point, self.radius, *plane.frame(), offset);
        if let Some(one) = one {
            features = self.on_ellipsoid(features, one, true, (world, states))?;
            if let Some(Curved::Ellipsoid(found)) = &features.curved {
                // The force may act beside the nearest point, so the plane follows from the gap.
                let centre = pose.position + pose.rotation * one.centre - other.position;
                let width = found.width(&pose.rotation.tr_mul(&self.normal)).length;
                features.offset =
                    normal.dot(&other.rotation.tr_mul(&centre)) - width - self.radius - self.gap;
            }
            return named.check(&features, body).map(|()| features);
        }
        let is_sharp = named::is_sharp(own) && named::is_sharp(theirs);
        let near = BAND * size(theirs).min(size(own));
        let (least, band) = match (turned, is_sharp) {
            // A plane of the body may tilt, so the projected corner is off the body by tilt times
            // gap.
            (true, _) => (LEAN * (near + self.gap.abs()), near + LEAN * 2.0 * size(theirs)),
            (false, true) => (0.0, EXACT * size(theirs)),
            (false, false) => (0.0, near),
        };
        let beyond = outside(own, &point) - (own.radius() - self.radius);
        if own.smooth().is_none() && beyond > least + EXACT * size(own) {
            return Err("has a point that its body does not have");
        }
        if theirs.smooth().is_none() && (support(theirs, &normal) - offset).abs() > band {
            return Err("has a plane that its partner does not have");
        }
        let checked = if is_sharp {
            named.check(&features, body)
        } else {
            named.check_round(&features, body)
        };
        checked.map(|()| features)
    }
}

/// Lower bound of the distance of a point outside a piece's core (m); 0 or less inside.
fn outside(piece: &Piece, point: &Vector3<f64>) -> f64 {
    let core = piece.core();
    match *core.vertices() {
        [at] => (point - at).norm(),
        [from, to] => {
            let along: Vector3<f64> = to - from;
            let share = (point - from).dot(&along) / along.norm_squared();
            (point - from - along * share.clamp(0.0, 1.0)).norm()
        }
        _ => {
            let heights = core.faces().iter().map(|face| face.normal.dot(point) - face.offset);
            heights.fold(f64::NEG_INFINITY, f64::max)
        }
    }
}

/// Support function: extent of a hull, with its radius, along a unit vector (m).
fn support(piece: &Piece, normal: &Vector3<f64>) -> f64 {
    let heights = piece.core().vertices().iter().map(|vertex| normal.dot(vertex));
    heights.fold(f64::NEG_INFINITY, f64::max) + piece.radius()
}
