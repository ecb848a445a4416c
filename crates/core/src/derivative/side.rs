//! One side of a contact over a step: a body or a fixed piece, and its differentials.

use crate::mechanics::{Pose, RigidBody, Rotation, State};
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

/// A body at both ends of a step, or a fixed piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepSide {
    /// Position r at k; `rotation` is A(q) at k. Zero and E for fixed pieces.
    pub(super) origin: Vector3<f64>,
    pub(super) rotation: Matrix3<f64>,
    /// Rotation A(q) at k+1.
    pub(super) turned: Matrix3<f64>,
    /// Velocity v⁺; `spin_world` is A ω⁺.
    pub(super) linear: Vector3<f64>,
    pub(super) spin_world: Vector3<f64>,
    /// Derivative of the rotation with respect to h, A ω⁺/(1 + h²ω²/4) (rad/s), world frame.
    pub(super) rate: Vector3<f64>,
    /// Radius ρ of its feature (m).
    pub(super) radius: f64,
    /// Surface velocity (m/s), world frame.
    pub(super) surface: Vector3<f64>,
    /// Angular motion before and after an impact.
    pub(super) impact: Option<ImpactMotion>,
}

impl StepSide {
    pub(super) fn fixed(radius: f64) -> Self {
        let (zero, unit) = (Vector3::zeros(), Matrix3::identity());
        Self {
            origin: zero,
            rotation: unit,
            turned: unit,
            linear: zero,
            spin_world: zero,
            rate: zero,
            radius,
            surface: zero,
            impact: None,
        }
    }

    pub(super) fn from_body(
        world: &World,
        index: usize,
        states: &[State],
        next: &[State],
        radius: f64,
    ) -> Self {
        let state = &states[index];
        let end = &next[index];
        let h = world.time_step();
        let (start, body): (Pose, &RigidBody) = (state.pose(), &world.bodies()[index]);
        let spin_world = start.rotation * end.spin;
        let impact = ImpactMotion {
            form: world.rotation(),
            time_step: h,
            inertia: *body.inertia(),
            inverse: *body.inertia_inverse(),
            rotation: start.rotation,
            arriving: state.velocity + world.missing_fall(index),
            before: world.before().get(index).map_or(1.0, |before| before / h),
            old: state.spin,
            new: end.spin,
        };
        Self {
            origin: start.position,
            rotation: start.rotation,
            turned: end.pose().rotation,
            linear: end.velocity,
            spin_world,
            rate: spin_world * world.step_map().rate(&end.spin),
            radius,
            surface: Vector3::zeros(),
            impact: Some(impact),
        }
    }

    pub(super) fn change(&self, given: &SideChangeInput) -> SideChange {
        SideChange {
            origin: self.origin,
            rotation: self.rotation,
            own_radius: self.radius,
            position: given.position,
            turn: given.turn,
            stretch: given.stretch,
            radius: given.radius,
        }
    }
}

/// Angular velocities A ω̃ before and after an impact (eq. 29), with the quantities they depend on.
#[derive(Debug, Clone, Copy)]
pub(super) struct ImpactMotion {
    pub(super) form: Rotation,
    pub(super) time_step: f64,
    /// Length of the interval before, in lengths of the step.
    pub(super) before: f64,
    pub(super) inertia: Matrix3<f64>,
    pub(super) inverse: Matrix3<f64>,
    pub(super) rotation: Matrix3<f64>,
    /// Velocity v at k; `old` is ω at k, and `new` is ω⁺.
    pub(super) arriving: Vector3<f64>,
    pub(super) old: Vector3<f64>,
    pub(super) new: Vector3<f64>,
}

impl ImpactMotion {
    /// Angular velocity A ω̃ after or before the impulses (rad/s), world frame, and its
    /// differential. With I ω̃ = P,
    ///
    /// ```text
    /// δω̃ = I⁻¹ (δP − δI ω̃)
    /// ```
    pub(super) fn spin(
        &self,
        given: &SideChangeInput,
        time_step: f64,
        departs: bool,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let Self { form, inertia, inverse, old, new, time_step: h, .. } = self;
        let zero = Vector3::zeros();
        let (spin, change) = if *form == Rotation::Tutorial {
            if departs { (*new, zero) } else { (*old, given.spin) }
        } else if departs {
            let by_inertia = form.start_momentum(&given.inertia, new, *h);
            let spin = form.departing_spin(inertia, inverse, new, *h);
            let longer = form.momentum_rate(inertia, new, *h, 1.0) * time_step;
            (spin, inverse * (by_inertia - given.inertia * spin + longer))
        } else {
            let h = h * self.before;
            let spin = form.arriving_spin(inertia, inverse, old, h);
            let longer = form.momentum_rate(inertia, old, h, -1.0) * (time_step * self.before);
            let by_inertia = form.momentum(&given.inertia, old, h);
            let by_spin = form.momentum_slope(inertia, old, h) * given.spin;
            (spin, inverse * (by_inertia - given.inertia * spin + by_spin + longer))
        };
        let (spin, change) = (self.rotation * spin, self.rotation * change);
        (spin, change + given.turn.cross(&spin))
    }
}

/// Differentials of one side of a contact.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SideChangeInput {
    /// Position δr (m) and `turn` δθ (rad), both world frame.
    pub(crate) position: Vector3<f64>,
    pub(crate) turn: Vector3<f64>,
    /// Velocity δv (m/s), world frame, and spin δω (rad/s), body frame, at k.
    pub(crate) velocity: Vector3<f64>,
    pub(crate) spin: Vector3<f64>,
    /// Velocity δV (m/s), world frame, and spin δΩ (rad/s), body frame, of the instant at k.
    pub(crate) instant_velocity: Vector3<f64>,
    pub(crate) instant_spin: Vector3<f64>,
    /// Stretch σ: a coordinate x_k of the shape becomes (1 + σ_k) x_k, body frame.
    pub(crate) stretch: Vector3<f64>,
    /// Radius δρ (m).
    pub(crate) radius: f64,
    /// Relative change of the radius of the feature, in addition to `radius`.
    pub(crate) growth: f64,
    /// Inertia δI (kg m²), body frame.
    pub(crate) inertia: Matrix3<f64>,
}

impl SideChangeInput {
    /// These differentials with the growth of a feature of `radius` (m) as part of δρ.
    pub(super) fn grown(&self, radius: f64) -> Self {
        Self { radius: self.radius + self.growth * radius, growth: 0.0, ..*self }
    }

    /// Zero differentials.
    pub(crate) fn nothing() -> Self {
        let zero = Vector3::zeros();
        Self {
            position: zero,
            turn: zero,
            velocity: zero,
            spin: zero,
            instant_velocity: zero,
            instant_spin: zero,
            stretch: zero,
            radius: 0.0,
            growth: 0.0,
            inertia: Matrix3::zeros(),
        }
    }
}

/// Position of a side, and the differentials on which the features depend.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SideChange {
    pub(super) origin: Vector3<f64>,
    pub(super) rotation: Matrix3<f64>,
    pub(super) own_radius: f64,
    pub(super) position: Vector3<f64>,
    pub(super) turn: Vector3<f64>,
    pub(super) stretch: Vector3<f64>,
    pub(super) radius: f64,
}

impl SideChange {
    /// World position of a point in the side's frame (m).
    pub(super) fn place(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.origin + self.rotation * point
    }

    /// Linear map of a vector of the shape to its differential: rotation and stretch.
    pub(super) fn linear(&self) -> Matrix3<f64> {
        let stretch = Matrix3::from_diagonal(&self.stretch);
        self.turn.cross_matrix() + self.rotation * stretch * self.rotation.transpose()
    }

    /// Displacement of the point of the shape at `x` (m), world frame.
    pub(super) fn carried(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.position + self.linear() * (x - self.origin)
    }
}
