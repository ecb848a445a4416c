//! Derivatives of a contact's motion over a step, and of the point where its impulse acts. They are
//! taken with respect to both bodies at the start of the step, at fixed final velocities V⁺.
//!
//! All derivatives are of world-frame vectors. The contact law rotates with its normal, and it is
//! evaluated in the frame that rotates with it: δn = φ × n.

mod curved;
mod offset;
mod surface;

pub(crate) use offset::PredictedStep;

use self::offset::OffsetTangent;
use self::surface::TurningSurfaces;
use super::placement::{FeatureChange, Placement, across};
use super::side::{SideChangeInput, StepSide};
use crate::contact::{Contact, Curved, Partner};
use crate::mechanics::State;
use crate::world::World;
use nalgebra::{Matrix3, Matrix3x6, Vector3};

/// Differentials of the rows of a contact at fixed V⁺.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowChange {
    /// Differential δu (m/s), world frame.
    pub(crate) motion: Vector3<f64>,
    /// Rotation φ of the normal (rad), world frame: δn = φ × n.
    pub(crate) turn: Vector3<f64>,
    /// Differentials of the lever arms from the centres of A and B to the impulse (m), world frame.
    pub(crate) arms: [Vector3<f64>; 2],
}

/// Derivatives of the rows of a contact with respect to a position (m) or a rotation (rad) of one
/// side, world frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowSlopes {
    pub(crate) motion: Matrix3<f64>,
    pub(crate) turn: Matrix3<f64>,
    pub(crate) arms: [Matrix3<f64>; 2],
}

/// Derivatives of the motion of a contact with respect to the velocities of one side.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RateSlopes {
    /// With respect to the velocities w of the step.
    pub(crate) by_velocity: Matrix3x6<f64>,
    /// With respect to the velocities at the instant where the step starts.
    pub(crate) by_instant: Matrix3x6<f64>,
}

/// Placement of a contact's features as functions of the body poses, independent of the step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlacedFeatures {
    placement: Placement,
    /// Distance of the contact from the end of its features (m).
    room: f64,
}

impl PlacedFeatures {
    /// Features of `contact` for bodies at `states`.
    pub(crate) fn new(world: &World, contact: &Contact, states: &[State]) -> Self {
        let (placement, room) = match &contact.features.curved {
            Some(curved) => {
                let pose = |body: usize| states[body].pose();
                let other = contact.key.partner.body().map(pose);
                let a = pose(contact.key.body);
                let room = curved::room(curved, contact, &a, other.as_ref());
                let (placement, inside) = match curved {
                    Curved::Ellipsoid(_) => {
                        Placement::from_ellipsoid_contact(world, contact, &a, other.as_ref())
                    }
                    Curved::Cores(_) => (Placement::Fixed, f64::INFINITY),
                };
                (placement, room.min(inside))
            }
            None if contact.key.pair.is_none() => (Placement::Fixed, f64::INFINITY),
            None => {
                let pose = |body: usize| states[body].pose();
                let other = contact.key.partner.body().map(pose);
                Placement::from_contact(world, contact, &pose(contact.key.body), other.as_ref())
            }
        };
        Self { placement, room }
    }
}

/// Contact over a step, prepared for differentiation.
#[derive(Debug, Clone)]
pub(crate) struct ContactTangent {
    contact: Contact,
    time_step: f64,
    placed: PlacedFeatures,
    a: StepSide,
    b: StepSide,
    /// Precomputed terms of the motion of a point against a plane.
    travel: PointTravel,
    /// Motion u of the contact law (m/s), world frame.
    motion: Vector3<f64>,
    /// Rebound row, if the contact bounces and this row is active.
    rebound: Option<ReboundRow>,
    /// Difference between the gap row and the rebound row (m/s), if the contact has both; the
    /// smaller row is active. A struck contact may have a rebound speed of zero.
    pub(crate) between: f64,
    /// Surfaces, if one turns.
    turning: Option<Box<TurningSurfaces>>,
    /// Offset of the slip (eq. 38), if the contact has one.
    offset: Option<Box<OffsetTangent>>,
}

/// Motion of a contact point over a step (m), world frame.
#[derive(Debug, Clone, Copy)]
struct PointTravel {
    /// Lever arm A_A a at k; `arm_end` is the one at k+1.
    arm: Vector3<f64>,
    arm_end: Vector3<f64>,
    /// Position s relative to B at k; `back` is A_B A_B⁺ᵀ.
    relative: Vector3<f64>,
    back: Matrix3<f64>,
    /// Position s⁺ relative to B at k+1; `travelled` is the displacement seen from B, and `length`
    /// the same plus the gap.
    end: Vector3<f64>,
    travelled: Vector3<f64>,
    length: Vector3<f64>,
    /// Relative angular velocity A_A ω_A − A_B ω_B (rad/s).
    spin: Vector3<f64>,
}

impl PointTravel {
    fn new(contact: &Contact, a: &StepSide, b: &StepSide, h: f64) -> Self {
        let point = contact.features.point;
        let (arm, arm_end) = (a.rotation * point, a.turned * point);
        let relative = a.origin + arm - b.origin;
        let end = relative + (a.linear - b.linear) * h + arm_end - arm;
        let back = b.rotation * b.turned.transpose();
        let travelled = back * end - relative;
        let length = travelled + contact.normal() * contact.gap;
        let spin = a.spin_world - b.spin_world;
        Self { arm, arm_end, relative, back, end, travelled, length, spin }
    }
}

#[derive(Debug, Clone, Copy)]
struct ReboundRow {
    /// Motion u without the rebound (m/s), world frame.
    plain: Vector3<f64>,
    /// Share of c_n⁻ that the rebound requires.
    share: f64,
    /// Approach speed c_n⁻ (m/s).
    coming: f64,
    /// Residual rebound n·ċ⁺ − e c_n⁻ (m/s).
    left: f64,
}

impl ContactTangent {
    /// Prepares `contact`, with the features `placed`, for a step from `states` that ends with the
    /// velocities of `next`. The offset of its slip follows from the step `predicted`.
    pub(crate) fn new(
        world: &World,
        contact: &Contact,
        placed: &PlacedFeatures,
        states: &[State],
        next: &[State],
        predicted: &PredictedStep,
    ) -> Self {
        let side = |body: Option<usize>, radius| {
            body.map_or(StepSide::fixed(radius), |body| {
                StepSide::from_body(world, body, states, next, radius)
            })
        };
        let (key, map) = (&contact.key, world.step_map());
        let h = map.time_step;
        let other = key.partner.body();
        // Radius of the feature of B. Cores have their own, and planes that of their piece.
        let radius_b = match (contact.features.curved, key.partner, key.pair) {
            (Some(Curved::Cores(pair)), ..) => pair.radius,
            (_, Partner::Fixed(index), _) => {
                // Terrains have no radius.
                world.fixed_piece(index, 0).map_or(0.0, |piece| piece.radius())
            }
            (_, Partner::Body(index), Some(pair)) => world.bodies()[index]
                .pieces()
                .get(pair.pieces.1)
                .map_or(0.0, |piece| piece.radius()),
            _ => 0.0,
        };
        let mut a = side(Some(key.body), radius_a(world, contact));
        let mut b = side(other, radius_b);
        [a.surface, b.surface] = contact.surface_velocities(world, states, 0.5 * h);
        // Motion with the law's rows, and without rebound and offset
        let ends = |body: usize| (states[body].pose(), next[body].pose());
        let (of_a, of_b) = (ends(key.body), other.map(ends));
        let gap = contact.motion([&of_a.0, &of_a.1], of_b.as_ref().map(|b| [&b.0, &b.1]), &map);
        let motion = contact.law_motion(gap, world, states, next);
        let plain = gap + contact.law_offset(world, states);
        let coming = contact.coming_speed(world, states);
        let counts = contact.bounces() && motion != plain;
        let left = contact.normal().dot(&motion);
        let share = contact.rebound / coming;
        let rebound = counts.then_some(ReboundRow { plain, share, coming, left });
        let travel = PointTravel::new(contact, &a, &b, h);
        // Distance of the rows of gap and rebound (29), at which the piece changes
        let between = if contact.struck || contact.bounces() {
            let parting = contact.departing_velocity(world, states, next);
            (contact.normal().dot(&(parting - plain)) - contact.rebound).abs()
        } else {
            f64::INFINITY
        };
        Self {
            contact: *contact,
            time_step: h,
            placed: *placed,
            a,
            b,
            travel,
            motion,
            rebound,
            between,
            turning: TurningSurfaces::new(world, contact, states),
            offset: OffsetTangent::new(world, contact, placed, states, predicted),
        }
    }

    /// Motion u of the contact law (m/s), world frame.
    pub(crate) fn motion(&self) -> &Vector3<f64> {
        &self.motion
    }

    /// Distance from the end of its features (m), where another contact replaces it.
    pub(crate) fn room(&self) -> f64 {
        self.placed.room
    }

    /// Unit normal n, world frame.
    pub(crate) fn normal(&self) -> Vector3<f64> {
        self.contact.normal()
    }

    /// True if the rebound row is active.
    pub(crate) fn bounces(&self) -> bool {
        self.rebound.is_some()
    }

    /// True if the rows depend on the velocities of A and B at k.
    pub(crate) fn follows_spin(&self) -> bool {
        if self.turning.is_some() {
            return true;
        }
        match &self.contact.features.curved {
            Some(Curved::Ellipsoid(one)) => self.is_predicted(one),
            _ => false,
        }
    }

    /// Lever arms from the centres of A and of B to the impulse (m), world frame.
    pub(crate) fn arms(&self) -> [Vector3<f64>; 2] {
        let arm = self.contact.arm;
        [arm, self.a.origin + arm - self.b.origin]
    }

    /// True if the rows depend on the velocities of the instant at k.
    pub(crate) fn follows_instants(&self) -> bool {
        self.offset.is_some()
    }

    /// True if the contact has the offset (38a).
    fn rolls(&self) -> bool {
        self.offset.as_ref().is_some_and(|offset| offset.rolls())
    }

    /// Derivatives of u with respect to the velocities w of A and B at k, and to those of the instant, if these
    /// enter through the offset (38) alone: δv (world) and δω (body) as six columns.
    pub(crate) fn rate_slopes(&self) -> Option<[RateSlopes; 2]> {
        self.offset.as_ref()?.rate_slopes()
    }

    /// True if the derivatives of its features with respect to the poses are known.
    pub(crate) fn is_known(&self) -> bool {
        let exact = || match &self.contact.features.curved {
            None => true,
            Some(Curved::Cores(pair)) => self.end(pair).1.is_exact,
            Some(Curved::Ellipsoid(one)) => self.is_nearest(one),
        };
        let follows = self.offset.is_some() || self.contact.slip_offset == Vector3::zeros();
        self.placed.placement != Placement::Unknown && exact() && follows
    }

    /// Differentials of the rows for the differentials `of_a` and `of_b` of both sides, of h (s)
    /// and of e.
    pub(crate) fn change(
        &self,
        of_a: &SideChangeInput,
        of_b: &SideChangeInput,
        time_step: f64,
        restitution: f64,
    ) -> RowChange {
        let of_a = &of_a.grown(self.contact.features.radius);
        let of_b = &of_b.grown(self.b.radius);
        let mut change = match &self.contact.features.curved {
            None => self.plane_change(of_a, of_b, time_step),
            Some(Curved::Cores(pair)) => self.round_change(pair, of_a, of_b, time_step),
            Some(Curved::Ellipsoid(one)) => self.ellipsoid_change(one, of_a, of_b, time_step),
        };
        let n = self.contact.normal();
        let turned = change.turn.cross(&n);
        let carried = self.a.surface - self.b.surface;
        if carried != Vector3::zeros() || self.turning.is_some() {
            let [a, b] = self.surface_change([of_a, of_b], &change, true, time_step);
            let moved = a - b;
            change.motion +=
                across(&n, &moved) - turned * n.dot(&carried) - n * turned.dot(&carried);
        }
        if let Some(offset) = &self.offset {
            change.motion += offset.change([of_a, of_b], time_step);
        }
        if let Some(rebound) = self.rebound {
            self.exchange(rebound, &mut change, [of_a, of_b], time_step, restitution);
        }
        change
    }

    /// Differentials of the velocities of both surfaces at the start or in the `middle` of the step (m/s, world).
    pub(crate) fn surface_change(
        &self,
        given: [&SideChangeInput; 2],
        rows: &RowChange,
        middle: bool,
        time_step: f64,
    ) -> [Vector3<f64>; 2] {
        match &self.turning {
            Some(turning) => [0, 1].map(|k| turning.change(k, given, rows, middle, time_step)),
            None => [given[0].turn.cross(&self.a.surface), given[1].turn.cross(&self.b.surface)],
        }
    }

    /// Derivatives of the rows with respect to the position of A, the rotation of A and the
    /// rotation of B. The derivative with respect to the position of B is minus the first.
    ///
    /// They exist for features fixed in their bodies, without rebound and surface velocities, and
    /// agree with [`change`](Self::change). (G4) by columns, with K = A_B A_B⁺ᵀ/h and N = (n nᵀ −
    /// E)/h:
    ///
    /// ```text
    /// ∂u/∂r_A = K + N,   ∂u/∂θ_A = −K [A_A⁺ a]× − N [A_A a]× − ρ [n]× [A_A ω_A]×
    /// ∂u/∂θ_B = K [s⁺]× + N [s]× − ([K h s⁺ − s]× + φ [n]×)/h + ρ ([n]× [A_B ω_B]× + [Δω]× [n]×)
    /// ```
    pub(crate) fn rigid_slopes(&self) -> Option<[RowSlopes; 3]> {
        let stays = matches!(self.placed.placement, Placement::Fixed | Placement::Unknown);
        let carried = self.a.surface != self.b.surface || self.turning.is_some();
        let is_plain = self.rebound.is_none() && !self.rolls();
        if !stays || carried || !is_plain || self.contact.features.curved.is_some() {
            return None;
        }
        let h = self.time_step;
        let PointTravel { arm, arm_end, relative, back, end, travelled, spin, .. } = &self.travel;
        let n = self.contact.normal();
        let rho = self.contact.features.radius;
        let (zero, unit) = (Matrix3::zeros(), Matrix3::identity());
        let (carry, press) = (back / h, (n * n.transpose() - unit) / h);
        let (lever, upright) = (arm.cross_matrix(), n.cross_matrix());
        // ∂u/∂θ_A
        let mut by_turn = -carry * arm_end.cross_matrix() - press * lever;
        if rho > 0.0 {
            by_turn -= upright * self.a.spin_world.cross_matrix() * rho;
        }
        let place = RowSlopes { motion: carry + press, turn: zero, arms: [zero, unit] };
        let turn = RowSlopes { motion: by_turn, turn: zero, arms: [-lever, -lever] };
        let with_offset = |mut all: [RowSlopes; 3]| {
            if let Some(added) = self.offset.as_ref().and_then(|offset| offset.pose_slopes()) {
                let each = all.iter_mut().zip(added);
                each.for_each(|(slopes, added)| slopes.motion += added);
            }
            Some(all)
        };
        if self.contact.key.partner.body().is_none() {
            let of_b = RowSlopes { motion: zero, turn: zero, arms: [zero, zero] };
            return with_offset([place, turn, of_b]);
        }
        // ∂u/∂θ_B
        let mut motion = carry * end.cross_matrix() + press * relative.cross_matrix()
            - (travelled.cross_matrix() + upright * self.contact.gap) / h;
        if rho > 0.0 {
            let rolling = upright * self.b.spin_world.cross_matrix();
            motion += (rolling + spin.cross_matrix() * upright) * rho;
        }
        let beyond = upright * rho;
        let of_b = RowSlopes { motion, turn: -press * h, arms: [beyond, beyond] };
        with_offset([place, turn, of_b])
    }

    /// Differential of u (m/s) for changes of the final velocities (m/s, world), given the rotations of
    /// the ends (rad, world) and the spins of the rolling features (rad/s, world), up to its part along
    /// the normal:
    ///
    /// ```text
    /// plane: A_B A_B⁺ᵀ (h (δv_A − δv_B) + δψ_A × A_A⁺ a − δψ_B × s⁺)/h − ρ (δω_A − δω_B) × n
    /// cores: δv_A + δψ_A × A_A⁺ a/h − δv_B − δψ_B × A_B⁺ b/h − (ρ_A δω_A + ρ_B δω_B) × n
    /// ellipsoid: δv_A + δψ_A × A_A⁺ c/h − δv_B − δψ_B × A_B⁺ b/h + δω_A × y
    /// ```
    fn end_change(
        &self,
        linear: [Vector3<f64>; 2],
        turns: [Vector3<f64>; 2],
        spins: [Vector3<f64>; 2],
    ) -> Vector3<f64> {
        let (a, b, h) = (&self.a, &self.b, self.time_step);
        let features = &self.contact.features;
        let (n, rho) = (self.contact.normal(), features.radius);
        let apart = linear[0] - linear[1];
        let swept = |place: &Vector3<f64>, foot: &Vector3<f64>| {
            let way = turns[0].cross(&(a.turned * place)) - turns[1].cross(&(b.turned * foot));
            apart + way / h
        };
        match &features.curved {
            None => {
                let PointTravel { arm_end, back, end, .. } = &self.travel;
                let way = turns[0].cross(arm_end) - turns[1].cross(end);
                back * (apart + way / h) - (rho * (spins[0] - spins[1])).cross(&n)
            }
            Some(Curved::Cores(pair)) => {
                let rolling = spins[0] * rho + spins[1] * pair.radius;
                swept(&pair.point(), &pair.foot()) - rolling.cross(&n)
            }
            Some(Curved::Ellipsoid(one)) => {
                let arm = a.rotation * one.shape.centre;
                let foot = a.origin + self.contact.arm - b.origin;
                swept(&one.shape.centre, &b.rotation.tr_mul(&foot))
                    + spins[0].cross(&(self.contact.arm - arm))
            }
        }
    }

    /// Replaces the gap speed by the residual rebound `left` = n·ċ⁺ − e c_n⁻ (eq. 29). For u' = u +
    /// n (left − n·u),
    ///
    /// ```text
    /// δu' = δu + δn (left − n·u) + n (δleft − δn·u − n·δu)
    /// ```
    fn exchange(
        &self,
        ReboundRow { plain, share, coming, left }: ReboundRow,
        change: &mut RowChange,
        given: [&SideChangeInput; 2],
        time_step: f64,
        restitution: f64,
    ) {
        let n = self.contact.normal();
        let turned = change.turn.cross(&n);
        let parting = |departs| self.parting(&change.arms, given[0], given[1], time_step, departs);
        let ((apart, parted), (met, meeting)) = (parting(true), parting(false));
        let faster = -(turned.dot(&met) + n.dot(&meeting));
        let law = self.contact.law.restitution;
        let more = share * faster + restitution * share / law * coming;
        let left_change = turned.dot(&apart) + n.dot(&parted) - more;
        let along = turned.dot(&plain) + n.dot(&change.motion);
        change.motion += turned * (left - n.dot(&plain)) + n * (left_change - along);
    }

    /// Velocity ċ after or before the impulses (eq. 29) (m/s), world frame, and its differential.
    fn parting(
        &self,
        arms: &[Vector3<f64>; 2],
        of_a: &SideChangeInput,
        of_b: &SideChangeInput,
        time_step: f64,
        departs: bool,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let [arm_a, arm_b] = self.arms();
        let of = |side: &StepSide,
                  given: &SideChangeInput,
                  (arm, moved): (&Vector3<f64>, &Vector3<f64>)| {
            let Some(impact) = &side.impact else { return (Vector3::zeros(), Vector3::zeros()) };
            let (linear, linear_change) = if departs {
                (side.linear, Vector3::zeros())
            } else {
                (impact.arriving, given.velocity)
            };
            let (spin, spin_change) = impact.spin(given, time_step, departs);
            let velocity = linear + spin.cross(arm);
            (velocity, linear_change + spin_change.cross(arm) + spin.cross(moved))
        };
        let (a, of_a) = of(&self.a, of_a, (&arm_a, &arms[0]));
        let (b, of_b) = of(&self.b, of_b, (&arm_b, &arms[1]));
        (a - b, of_a - of_b)
    }

    /// Differentials of a point against a plane. With s = r_A + A_A a − r_B at k and s⁺ at k+1,
    ///
    /// ```text
    /// u = (A_B (A_B⁺ᵀ s⁺ − A_Bᵀ s) + n φ)/h − ρ (A_A ω_A − A_B ω_B) × n            (G4)
    /// ```
    fn plane_change(
        &self,
        of_a: &SideChangeInput,
        of_b: &SideChangeInput,
        time_step: f64,
    ) -> RowChange {
        let (a, b, h) = (&self.a, &self.b, self.time_step);
        let sides = (a.change(of_a), b.change(of_b));
        let features = self.placed.placement.change(&self.contact, &sides.0, &sides.1);
        let FeatureChange { point: moved, radius: wider, normal, offset } = features;
        let Contact { gap, features: own, .. } = &self.contact;
        let (n, rho) = (self.contact.normal(), own.radius);
        let PointTravel { arm, arm_end, relative, back, end, travelled, length, spin } =
            &self.travel;
        let normal = b.rotation * normal;
        let turned = of_b.turn.cross(&n) + normal;
        let apart = of_a.position - of_b.position;
        let arm_change = of_a.turn.cross(arm) + a.rotation * moved;
        let s_change = apart + arm_change;
        let (turn_a, turn_b) = (of_a.turn + a.rate * time_step, of_b.turn + b.rate * time_step);
        let s_end_change =
            apart + (a.linear - b.linear) * time_step + turn_a.cross(arm_end) + a.turned * moved;
        // Seen from B: A_B w and A_B w⁺.
        let relative_change = s_change - of_b.turn.cross(relative);
        let seen_end_change = back * (s_end_change - turn_b.cross(end));
        let gap_change = normal.dot(relative) + n.dot(&relative_change) - offset - wider;
        let length_change = of_b.turn.cross(travelled) + seen_end_change - relative_change
            + turned * *gap
            + n * gap_change;
        let spin_change = of_a.turn.cross(&a.spin_world) - of_b.turn.cross(&b.spin_world);
        let motion = (length_change - length * (time_step / h)) / h
            - (spin_change * rho + spin * wider).cross(&n)
            - (spin * rho).cross(&turned);
        let beyond = arm_change - turned * rho - n * wider;
        RowChange { motion, turn: n.cross(&turned), arms: [beyond, apart + beyond] }
    }
}

/// Radius ρ of A's piece, also if the contact point has none because the plane is A's.
fn radius_a(world: &World, contact: &Contact) -> f64 {
    let own = contact.features.radius;
    let piece = contact
        .key
        .pair
        .and_then(|pair| world.bodies()[contact.key.body].pieces().get(pair.pieces.0));
    piece.map_or(own, |piece| piece.radius())
}
