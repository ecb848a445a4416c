//! The residuals of a step, and how much of them is excused.

/// The residuals of a step in its equations and laws, each a speed, m/s. A residual counts up to
/// a bound: a solver with a larger one is wrong, and must not widen its own tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ResidualCheck {
    /// Positions and attitudes against velocities, (8a) and (8b).
    pub kinematics: f64,
    /// Velocities against forces, (8c) and (8d).
    pub momentum: f64,
    /// The normal law (18c) and penetration (18b).
    pub normal: f64,
    /// The friction law (18d).
    pub friction: f64,
    /// The constraints and drives of joints.
    pub joint: f64,
}

/// The largest excused residuals, m/s. They are above the residuals of Ipopt's steps, up to the
/// accepted residual of its solver in the normal law.
const EXCUSED: ResidualCheck =
    ResidualCheck { kinematics: 1e-5, momentum: 2e-6, normal: 1e-4, friction: 1e-5, joint: 1e-10 };

impl ResidualCheck {
    /// The excused part. `smoothing` (m/s) is h ε/m of a solver that smooths the norm of friction
    /// by ε (formulation.md, section 8). It raises the bound of friction.
    pub(crate) fn excused(self, smoothing: f64) -> Self {
        Self {
            kinematics: self.kinematics.min(EXCUSED.kinematics),
            momentum: self.momentum.min(EXCUSED.momentum),
            normal: self.normal.min(EXCUSED.normal),
            friction: self.friction.min(EXCUSED.friction + 2.0 * smoothing),
            joint: self.joint.min(EXCUSED.joint),
        }
    }
}
