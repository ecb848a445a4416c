//! Linearised contact: change of its impulse with the initial states of the bodies and with
//! constants.
//!
//! Equation numbers refer to `docs/gradients.md`.

use super::constants::{ConstantChanges, ConstantsBase, side_places, unit};
use super::friction_tensor::LinearTensor;
use super::slopes::{LinearisedSlopes, RowsChange};
use crate::contact::{Contact, Partner};
use crate::derivative::{
    ContactTangent, PlacedFeatures, PredictedStep, RateSlopes, RowChange, RowSlopes,
    SideChangeInput,
};
use crate::mechanics::State;
use crate::solver::native::law::MapPiece;
use crate::step::Step;
use crate::world::{Coefficient, Constant, LawSlopes, World};
use nalgebra::{Matrix3, Matrix3x6, Vector3};

/// Linearised contact.
#[derive(Debug, Clone)]
pub(super) struct LinearCoupling {
    /// Index among the couplings of the island.
    pub(super) index: usize,
    pub(super) slopes: LinearisedSlopes,
    pub(super) rotations: [Matrix3<f64>; 2],
    pub(super) tangent: ContactTangent,
    /// Rows F along which the gain D of (N5) measures motions.
    from: Matrix3<f64>,
    /// p̂ (m/s, world).
    pub(super) impulse: Vector3<f64>,
    /// γ (m/s): normal impulse with the adhesion.
    pub(super) pressed: f64,
    /// Derivative with respect to μ at fixed u.
    by_friction: RowsChange<1>,
    /// Adhesion, if it has any.
    pub(super) adhesion: Option<Box<LinearAdhesion>>,
    /// Tensor of a sliding contact whose friction depends on the direction.
    tensor: Option<Box<LinearTensor>>,
    /// Derivatives of μ, by kinetic and static coefficients, and of e with respect to world constants.
    law: [LawSlopes; 3],
    /// Change of μ with the slip at the start of the step, if it has any.
    curve: Option<Box<FrictionSlope>>,
    is_ground: bool,
}

/// Adhesion of a contact (eq. 48).
#[derive(Debug, Clone)]
pub(super) struct LinearAdhesion {
    /// Index of F in its constant, and ∂â/∂F and ∂â/∂h.
    pub(super) place: usize,
    pub(super) slope: f64,
    pub(super) slope_by_time_step: f64,
    /// Derivative with respect to â at fixed u.
    by: RowsChange<1>,
}

/// Contact to linearise, coupling `index` of its island.
pub(super) struct ContactPlace<'a> {
    pub(super) contact: &'a Contact,
    pub(super) placed: &'a PlacedFeatures,
    pub(super) index: usize,
    /// Step that the start predicts.
    pub(super) predicted: &'a PredictedStep,
}

/// Contact on the piece of its law where it is linearised.
pub(super) struct ContactOnPiece<'a> {
    pub(super) piece: MapPiece,
    /// δp̂ by δμ. Present on the central path only.
    pub(super) by_friction: Option<Vector3<f64>>,
    /// Rows that the gain acts on, an orthonormal frame.
    pub(super) from: &'a Matrix3<f64>,
    /// p̂ (m/s, world).
    pub(super) impulse: Vector3<f64>,
    /// â (m/s).
    pub(super) adhesion: f64,
}

impl LinearCoupling {
    /// Linearises a contact on a piece of its law.
    ///
    /// `limit` is the ε whose limit is taken, or 0. With a limit, the law's own part of the impulse
    /// has no compliance (G14).
    pub(super) fn new(
        step: &Step<'_>,
        place: &ContactPlace<'_>,
        next: &[State],
        on: ContactOnPiece<'_>,
        limit: f64,
    ) -> Self {
        let ContactPlace { contact, placed, index, predicted } = *place;
        let ContactOnPiece { piece, by_friction, from, impulse, adhesion } = on;
        let (world, key) = (step.world, &contact.key);
        let bodies = [Some(key.body), key.partner.body()];
        let tangent = ContactTangent::new(world, contact, placed, step.states, next, predicted);
        let n = contact.normal();
        let pressed = n.dot(&impulse) + adhesion;
        let is_central = by_friction.is_some();
        let across = |v: &Vector3<f64>| v - n * n.dot(v);
        // On the central path every contact slides.
        let slides = piece == MapPiece::Slip || is_central;
        // Friction axis (46), which matters for slip only.
        let tensor = slides
            .then(|| LinearTensor::new(step, contact, from, tangent.motion(), &impulse))
            .flatten();
        let friction = contact.law.friction;
        // Along the friction impulse. Without friction: against the slip.
        // γ t of (G6): change of the impulse by the coefficient of friction
        let by_friction = by_friction.unwrap_or_else(|| match piece {
            MapPiece::Slip if tensor.is_some() && friction > 0.0 => across(&impulse) / friction,
            MapPiece::Slip => {
                if let Some(tensor) = &tensor {
                    return tensor.along_slip(pressed);
                }
                let along =
                    if friction > 0.0 { across(&impulse) } else { -across(tangent.motion()) };
                along.try_normalize(0.0).unwrap_or_default() * pressed
            }
            _ => Vector3::zeros(),
        });
        let rotation = |body: Option<usize>| {
            body.map_or(Matrix3::identity(), |body| step.states[body].pose().rotation)
        };
        let by_friction = RowsChange {
            motion: from.tr_mul(&by_friction) * -limit,
            impulse: by_friction,
            ..RowsChange::zero()
        };
        // An open contact keeps its pull, and one that slips has friction by it.
        let by = match piece {
            _ if is_central => RowsChange { impulse: -n, ..RowsChange::zero() },
            MapPiece::Open => RowsChange { impulse: -n, ..RowsChange::zero() },
            MapPiece::Slip if pressed > 0.0 => {
                RowsChange::zero().plus(friction / pressed, &by_friction)
            }
            _ => RowsChange::zero(),
        };
        // Adhesion (G6d): â is proportional to the pull and to h.
        let pull = world.larger_between(Coefficient::Adhesion, key.body, key.partner);
        let adhesion = pull.filter(|_| adhesion > 0.0).map(|(place, pull)| {
            let slope_by_time_step = adhesion / world.time_step();
            Box::new(LinearAdhesion { place, slope: adhesion / pull, slope_by_time_step, by })
        });
        let mut coupling = Self {
            index,
            slopes: LinearisedSlopes::new(bodies),
            rotations: bodies.map(rotation),
            tangent,
            from: *from,
            impulse,
            pressed,
            by_friction,
            adhesion,
            tensor: tensor.map(Box::new),
            law: world.law_slopes(key.body, key.partner, contact.static_share(world)),
            curve: FrictionSlope::new(world, contact, step.states).map(Box::new),
            is_ground: key.partner == Partner::Ground,
        };
        coupling.set_slopes(contact);
        let third = coupling.tensor.as_ref().and_then(|tensor| {
            let body = tensor.body?;
            Some(Box::new((body, tensor.by_third_body(&rotation(Some(body)))?)))
        });
        coupling.slopes.by_third = third;
        coupling
    }

    /// True if the contact carries an impulse.
    pub(super) fn presses(&self) -> bool {
        self.impulse != Vector3::zeros()
    }

    /// Computes the derivatives with respect to poses and velocities.
    fn set_slopes(&mut self, contact: &Contact) {
        match self.tangent.rigid_slopes() {
            Some(slopes) if self.tensor.is_none() && self.curve.is_none() => {
                self.set_rigid_slopes(&slopes);
            }
            _ => self.set_columns(contact),
        }
    }

    /// Computes the pose columns from closed forms (G6): position of A, rotation of A, rotation of
    /// B.
    fn set_rigid_slopes(&mut self, [place, turn, of_b]: &[RowSlopes; 3]) {
        let (p, arms) = (self.impulse.cross_matrix(), self.tangent.arms());
        let u = self.tangent.motion().cross_matrix();
        let columns = |of: &Self, slopes: &RowSlopes, side: Option<usize>| {
            let mut columns = RowsChange::<3>::zero();
            columns.motion = of.from.tr_mul(&slopes.motion);
            if slopes.turn != Matrix3::zeros() {
                // δp̂ = D(δu − φ×u) + φ×p̂ with the rotation φ of the normal (G6)
                columns.motion += of.from.tr_mul(&(u * slopes.turn));
                columns.impulse = -p * slopes.turn;
            }
            // δτ = Aᵀ(δy×p̂ − δθ×(y×p̂)) (G6)
            for (at, arm) in arms.iter().enumerate() {
                if of.slopes.bodies[at].is_none() {
                    continue;
                }
                let mut torque = -p * slopes.arms[at];
                if side == Some(at) {
                    torque += arm.cross(&of.impulse).cross_matrix();
                }
                let torque = of.rotations[at].tr_mul(&torque);
                columns.torques.fixed_rows_mut::<3>(3 * at).copy_from(&torque);
            }
            if let Some(side) = side {
                let rotation = &of.rotations[side];
                columns.motion *= rotation;
                columns.impulse *= rotation;
                columns.torques *= rotation;
            }
            columns
        };
        let by_place = columns(self, place, None);
        let by_turn = columns(self, turn, Some(0));
        let of_b = self.slopes.bodies[1].map(|_| columns(self, of_b, Some(1)));
        let slopes = &mut self.slopes.by_pose;
        slopes.set(0, &by_place);
        slopes.set(3, &by_turn);
        if let Some(of_b) = of_b {
            // The position of B has the opposite effect of that of A.
            slopes.set(6, &by_place.negated());
            slopes.set(9, &of_b);
        }
        // Offset of the slip (G22), by the velocities w and V.
        let Some(rates) = self.tangent.rate_slopes() else { return };
        let columns = |of: fn(&RateSlopes) -> &Matrix3x6<f64>| {
            let mut columns = Box::new(RowsChange::<12>::zero());
            for (side, rates) in rates.iter().enumerate() {
                if self.slopes.bodies[side].is_some() {
                    let motion = self.from.tr_mul(of(rates));
                    columns.set(6 * side, &RowsChange { motion, ..RowsChange::zero() });
                }
            }
            columns
        };
        let by_velocity = columns(|rates| &rates.by_velocity);
        let by_instant = columns(|rates| &rates.by_instant);
        self.slopes.by_velocity = Some(by_velocity);
        self.slopes.by_instant = Some(by_instant);
    }

    /// Computes the pose and velocity columns one by one.
    fn set_columns(&mut self, contact: &Contact) {
        let has_offset = self.tangent.follows_instants();
        let follows =
            contact.bounces() || self.tangent.follows_spin() || self.curve.is_some() || has_offset;
        let mut by_velocity = follows.then(|| Box::new(RowsChange::zero()));
        let mut by_instant = has_offset.then(|| Box::new(RowsChange::zero()));
        for side in (0..2).filter(|&side| self.slopes.bodies[side].is_some()) {
            for k in 0..6 {
                let unit = Vector3::ith(k % 3, 1.0);
                let nothing = SideChangeInput::nothing();
                let column = match (k, side) {
                    // A common translation of both bodies changes nothing.
                    (0..3, 1) => self.slopes.by_pose.columns(k).negated(),
                    (0..3, _) => self.changed(side, &SideChangeInput { position: unit, ..nothing }),
                    _ => {
                        let turn = self.rotations[side] * unit;
                        self.changed(side, &SideChangeInput { turn, ..nothing })
                    }
                };
                self.slopes.by_pose.set(6 * side + k, &column);
                if let Some(slopes) = &mut by_velocity {
                    let faster = match k {
                        0..3 => SideChangeInput { velocity: unit, ..nothing },
                        _ => SideChangeInput { spin: unit, ..nothing },
                    };
                    slopes.set(6 * side + k, &self.changed(side, &faster));
                }
                if let Some(slopes) = &mut by_instant {
                    let faster = match k {
                        0..3 => SideChangeInput { instant_velocity: unit, ..nothing },
                        _ => SideChangeInput { instant_spin: unit, ..nothing },
                    };
                    slopes.set(6 * side + k, &self.changed(side, &faster));
                }
            }
        }
        (self.slopes.by_velocity, self.slopes.by_instant) = (by_velocity, by_instant);
    }

    fn changed(&self, side: usize, given: &SideChangeInput) -> RowsChange<1> {
        let nothing = SideChangeInput::nothing();
        let sides = if side == 0 { [given, &nothing] } else { [&nothing, given] };
        self.change(sides, 0.0, 0.0)
    }

    /// Change of the rows at fixed V⁺, of the impulse and of its torques, for changes of both
    /// sides, of h and of e.
    ///
    /// The frame turns with the normal, δn = φ × n:
    ///
    /// ```text
    /// δp̂ = D (δu − φ × u) + φ × p̂,   δτ = A_Bᵀ (δarm × p̂ − δθ × (arm × p̂))           (G6)
    /// ```
    pub(super) fn change(
        &self,
        sides: [&SideChangeInput; 2],
        time_step: f64,
        restitution: f64,
    ) -> RowsChange<1> {
        let rows = self.tangent.change(sides[0], sides[1], time_step, restitution);
        let (p, u) = (&self.impulse, self.tangent.motion());
        let mut change = RowsChange::zero();
        change.motion = self.from.tr_mul(&(rows.motion - rows.turn.cross(u)));
        change.impulse = rows.turn.cross(p);
        let arms = self.tangent.arms();
        for (side, given) in sides.into_iter().enumerate() {
            let torque = rows.arms[side].cross(p) - given.turn.cross(&arms[side].cross(p));
            let torque = self.rotations[side].tr_mul(&torque);
            change.torques.fixed_rows_mut::<3>(3 * side).copy_from(&torque);
        }
        if let Some(adhesion) = &self.adhesion {
            change = change.plus(adhesion.slope_by_time_step * time_step, &adhesion.by);
        }
        if let Some(curve) = &self.curve {
            let friction = curve.change(self, sides, &rows);
            change = change.plus(friction, &self.by_friction);
        }
        match &self.tensor {
            Some(tensor) => {
                change.plus(1.0, &tensor.turned(sides.map(|given| &given.turn), &rows.turn))
            }
            None => change,
        }
    }

    pub(super) fn jvp_wrt_constants<F: Fn(Constant, usize) -> f64>(
        &self,
        constants: &ConstantChanges<'_, F>,
    ) -> RowsChange<1> {
        let of = constants.numbers;
        let [a, b] = self.sides(constants);
        let [kinetic, of_static, restitution] = self.law.map(|slopes| {
            slopes.iter().map(|(constant, place, slope)| of(*constant, *place) * slope).sum::<f64>()
        });
        let change = self.change([&a, &b], of(Constant::TimeStep, 0), restitution);
        let mut change = change.plus(kinetic + of_static, &self.by_friction);
        if let Some(LinearAdhesion { place, slope, by, .. }) = self.adhesion.as_deref() {
            let pull = of(Constant::Coefficient(Coefficient::Adhesion), *place);
            change = change.plus(slope * pull, by);
        }
        match &self.tensor {
            Some(tensor) => {
                change.plus(of(Constant::FrictionFactor, tensor.index), &tensor.by_factor())
            }
            None => change,
        }
    }

    /// Changes of both sides for changes of constants.
    fn sides<F: Fn(Constant, usize) -> f64>(
        &self,
        constants: &ConstantChanges<'_, F>,
    ) -> [SideChangeInput; 2] {
        let mut sides = self
            .slopes
            .bodies
            .map(|body| body.map_or(SideChangeInput::nothing(), |body| constants.side(body)));
        if self.is_ground {
            sides[1].position = self.tangent.normal() * (constants.numbers)(Constant::Ground, 0);
        }
        sides
    }

    /// Rotation φ of the normal for changes of constants (rad, world).
    pub(super) fn turn_wrt_constants<F: Fn(Constant, usize) -> f64>(
        &self,
        constants: &ConstantChanges<'_, F>,
    ) -> Vector3<f64> {
        let [a, b] = self.sides(constants);
        self.tangent.change(&a, &b, (constants.numbers)(Constant::TimeStep, 0), 0.0).turn
    }

    /// True if the contact bounces.
    pub(super) fn bounces(&self) -> bool {
        self.tangent.bounces()
    }

    /// Adds the transposed product: derivatives with respect to `constants`.
    pub(super) fn pull_constants(
        &self,
        by: &RowsChange<1>,
        shapes: &[ConstantsBase],
        constants: &[Constant],
        sums: &mut [Vec<f64>],
    ) {
        let nothing = SideChangeInput::nothing();
        let [kinetic, of_static, restitutions] = &self.law;
        for (&constant, sums) in constants.iter().zip(sums) {
            // Coefficients of the contact law, by their place among the numbers of the constant
            let of_constant = |slopes: &LawSlopes| {
                slopes.map(|(of, place, slope)| (of == constant).then_some((place, slope)))
            };
            let frictions = of_constant(kinetic).into_iter().chain(of_constant(of_static));
            for (place, slope) in frictions.flatten() {
                sums[place] += by.dot(&self.by_friction) * slope;
            }
            if self.tangent.bounces() {
                for (place, slope) in of_constant(restitutions).into_iter().flatten() {
                    sums[place] += by.dot(&self.change([&nothing; 2], 0.0, 1.0)) * slope;
                }
            }
            // Constants of the world
            match constant {
                Constant::TimeStep => {
                    sums[0] += by.dot(&self.change([&nothing; 2], 1.0, 0.0));
                }
                Constant::Coefficient(Coefficient::Adhesion) => {
                    if let Some(adhesion) = &self.adhesion {
                        sums[adhesion.place] += by.dot(&adhesion.by) * adhesion.slope;
                    }
                }
                Constant::FrictionFactor => {
                    if let Some(tensor) = &self.tensor {
                        sums[tensor.index] += by.dot(&tensor.by_factor());
                    }
                }
                Constant::Ground if self.is_ground => {
                    let raised = SideChangeInput { position: self.tangent.normal(), ..nothing };
                    sums[0] += by.dot(&self.change([&nothing, &raised], 0.0, 0.0));
                }
                _ => {}
            }
            // Constants of the bodies
            for (side, body) in self.slopes.bodies.into_iter().enumerate() {
                let Some(body) = body else { continue };
                for place in side_places(constant, body, self.tangent.bounces()) {
                    let numbers = unit(constant, place);
                    let given = ConstantChanges { shapes, numbers: &numbers }.side(body);
                    sums[place] += by.dot(&self.changed(side, &given));
                }
            }
        }
    }
}

/// Change of a contact's μ with the slip v_t of its touching points at the start of the step (eq. 42).
#[derive(Debug, Clone)]
struct FrictionSlope {
    /// ∂μ/∂v_t (s/m, world).
    slope: Vector3<f64>,
    /// Speed of A's surface away from B's at the touching point (m/s).
    parting: f64,
    /// Angular velocities of A and B (rad/s, world).
    spins: [Vector3<f64>; 2],
}

impl FrictionSlope {
    fn new(world: &World, contact: &Contact, states: &[State]) -> Option<Self> {
        let most = contact.law.static_friction?;
        let velocity = contact.point_velocity(world, states);
        let n = contact.normal();
        let slip = velocity - n * n.dot(&velocity);
        let (_, slope) = world.stick_speed().share(slip.norm(), 0.0);
        if slope == 0.0 {
            return None;
        }
        let owners = [Partner::Body(contact.key.body), contact.key.partner];
        let of = |owner: Partner, local: Vector3<f64>| match owner.body() {
            Some(body) => states[body].pose().rotation * local,
            None => local,
        };
        let spin = |owner: Partner| owner.body().map_or(Vector3::zeros(), |body| states[body].spin);
        let range = most - world.friction_between(contact.key.body, contact.key.partner);
        let surfaces = contact.surface_velocities(world, states, 0.0);
        Some(Self {
            slope: slip.normalize() * (slope * range),
            parting: n.dot(&(velocity + surfaces[0] - surfaces[1])),
            spins: owners.map(|owner| of(owner, spin(owner))),
        })
    }

    /// δμ for changes of both sides. With the velocity v of A's surface relative to B's,
    ///
    /// ```text
    /// δμ = ∂μ/∂v_t · (δv − δn n·v)                                                  (G6c)
    /// ```
    fn change(&self, of: &LinearCoupling, sides: [&SideChangeInput; 2], rows: &RowChange) -> f64 {
        let mut change = -rows.turn.cross(&of.tangent.normal()) * self.parting;
        let arms = of.tangent.arms();
        let surfaces = of.tangent.surface_change(sides, rows, false, 0.0);
        for (side, (given, sign)) in sides.into_iter().zip([1.0, -1.0]).enumerate() {
            let spin = of.rotations[side] * given.spin + given.turn.cross(&self.spins[side]);
            let moved = given.velocity + surfaces[side];
            let turning = spin.cross(&arms[side]) + self.spins[side].cross(&rows.arms[side]);
            change += (moved + turning) * sign;
        }
        self.slope.dot(&change)
    }
}
