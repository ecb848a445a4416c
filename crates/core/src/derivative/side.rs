//! A side of a contact over a step: a body, or what is fixed, and what may change of it.

use crate::mechanics::{Pose, RigidBody, Rotation, State};
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

/// A body at both ends of a step, or what is fixed.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepSide {
    /// r and A(q) at k; zero and E of what is fixed.
    pub(super) origin: Vector3<f64>,
    pub(super) rotation: Matrix3<f64>,
    /// A(q) at k+1.
    pub(super) turned: Matrix3<f64>,
    /// v⁺ and A ω⁺.
    pub(super) linear: Vector3<f64>,
    pub(super) spin_world: Vector3<f64>,
    /// A ω⁺/(1 + h²ω²/4): how it turns for a longer step, rad/s, world.
    pub(super) rate: Vector3<f64>,
    /// ρ of its feature, m.
    pub(super) radius: f64,
    /// What carries things along, m/s, world.
    pub(super) surface: Vector3<f64>,
    /// How it turns before and after an impact.
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

    pub(super) fn of_body(
        world: &World,
        index: usize,
        states: &[State],
        next: &[State],
        radius: f64,
    ) -> Self {
        let (state, end, h) = (&states[index], &next[index], world.time_step());
        let (start, body): (Pose, &RigidBody) = (state.pose(), &world.bodies()[index]);
        let spin_world = start.rotation * end.spin;
        let impact = ImpactMotion {
            form: world.rotation(),
            time_step: h,
            inertia: *body.inertia(),
            inverse: *body.inertia_inverse(),
            rotation: start.rotation,
            arriving: state.velocity,
            old: state.spin,
            new: end.spin,
        };
        Self {
            origin: start.position,
            rotation: start.rotation,
            turned: end.pose().rotation,
            linear: end.velocity,
            spin_world,
            rate: spin_world / (1.0 + 0.25 * h * h * end.spin.norm_squared()),
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

/// A ω̃ of both sides of an impact (eq. 29), and what changes it.
#[derive(Debug, Clone, Copy)]
pub(super) struct ImpactMotion {
    pub(super) form: Rotation,
    pub(super) time_step: f64,
    pub(super) inertia: Matrix3<f64>,
    pub(super) inverse: Matrix3<f64>,
    pub(super) rotation: Matrix3<f64>,
    /// v and ω at k, ω⁺.
    pub(super) arriving: Vector3<f64>,
    pub(super) old: Vector3<f64>,
    pub(super) new: Vector3<f64>,
}

impl ImpactMotion {
    /// A ω̃ after the impulses, or before them, rad/s, world, and what it changes by: with I ω̃ = P,
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
            let momentum = |inertia: &Matrix3<f64>| {
                inertia * new + form.gyroscopic(inertia, &zero, new, *h) * *h
            };
            let spin = form.departing_spin(inertia, inverse, new, *h);
            let longer = form.momentum_rate(inertia, new, *h, 1.0) * time_step;
            (spin, inverse * (momentum(&given.inertia) - given.inertia * spin + longer))
        } else {
            let spin = form.arriving_spin(inertia, inverse, old, *h);
            let longer = form.momentum_rate(inertia, old, *h, -1.0) * time_step;
            let by_inertia = form.momentum(&given.inertia, old, *h);
            let by_spin = form.momentum_slope(inertia, old, *h) * given.spin;
            (spin, inverse * (by_inertia - given.inertia * spin + by_spin + longer))
        };
        let (spin, change) = (self.rotation * spin, self.rotation * change);
        (spin, change + given.turn.cross(&spin))
    }
}

/// What changes of one side of a contact.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SideChangeInput {
    /// δr, m, and δθ, rad, both world.
    pub(crate) position: Vector3<f64>,
    pub(crate) turn: Vector3<f64>,
    /// δv, m/s, world, and δω, rad/s, body, at k.
    pub(crate) velocity: Vector3<f64>,
    pub(crate) spin: Vector3<f64>,
    /// σ: a coordinate x_k of its shape becomes (1 + σ_k) x_k, body frame.
    pub(crate) stretch: Vector3<f64>,
    /// δρ, m.
    pub(crate) radius: f64,
    /// δI, kg m², body.
    pub(crate) inertia: Matrix3<f64>,
}

impl SideChangeInput {
    /// Nothing.
    pub(crate) fn nothing() -> Self {
        let zero = Vector3::zeros();
        Self {
            position: zero,
            turn: zero,
            velocity: zero,
            spin: zero,
            stretch: zero,
            radius: 0.0,
            inertia: Matrix3::zeros(),
        }
    }
}

/// What of that the features of a contact depend on, and where the side is.
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
    /// Where a point of its frame is, m, world.
    pub(super) fn place(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.origin + self.rotation * point
    }

    /// What a vector of its shape changes by: turned and stretched.
    pub(super) fn linear(&self) -> Matrix3<f64> {
        let stretch = Matrix3::from_diagonal(&self.stretch);
        self.turn.cross_matrix() + self.rotation * stretch * self.rotation.transpose()
    }

    /// How the point of its shape that is at `x` (m, world) moves.
    pub(super) fn carried(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.position + self.linear() * (x - self.origin)
    }
}
