//! What a step lacks, and how much of it is an excuse.

/// What a step lacks of one that obeys its equations, each a speed, m/s. It is counted only
/// as far as it is an excuse: a solver that misses its equations by more is wrong, and must
/// not widen what it is judged by.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Residual {
    /// Of (8a) and (8b): positions and attitudes that do not follow the velocities.
    pub kinematics: f64,
    /// Of (8c) and (8d): velocities that do not follow the forces.
    pub momentum: f64,
    /// Of the normal law (18c), penetration (18b) included.
    pub normal: f64,
    /// Of the friction law (18d).
    pub friction: f64,
    /// Of what joints hold and drive.
    pub joint: f64,
}

/// The most that is excused, m/s. Of all steps that Ipopt solves in the problems with their
/// usual inputs the largest residuals are 9e-7 of momentum, 3e-6 of friction, 1e-6 of
/// kinematics (and 9e-5 in a box that stands on the brink), and 1e-4 of the normal law, which
/// is as much as its path accepts. The native solver's are 1e-10 and less, of joints too.
const EXCUSED: Residual =
    Residual { kinematics: 1e-5, momentum: 2e-6, normal: 1e-4, friction: 1e-5, joint: 1e-10 };

impl Residual {
    /// As far as it is excused. Ipopt's program smooths the norm of friction, which costs
    /// h ε/m (formulation.md, section 8): `smoothing`, m/s, is excused beside the rest.
    pub(super) fn excused(self, smoothing: f64) -> Self {
        Self {
            kinematics: self.kinematics.min(EXCUSED.kinematics),
            momentum: self.momentum.min(EXCUSED.momentum),
            normal: self.normal.min(EXCUSED.normal),
            friction: self.friction.min(EXCUSED.friction + 2.0 * smoothing),
            joint: self.joint.min(EXCUSED.joint),
        }
    }
}
