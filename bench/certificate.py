"""The certificate of a step, eq. 18 of docs/formulation.md, in numpy, for whole motions at once.

It is computed from states and contact forces alone, so it can be asked of any engine that says
what its forces are. Every run of the comparison checks it against tumble's own column.
"""

from dataclasses import dataclass

import numpy as np
from scene import ATTITUDE, POSITION, SPIN, VELOCITY, Scene
from scene import corner_positions, quaternion_product, rotations


@dataclass(frozen=True)
class Certificate:
    """The parts of eq. 18 step by step, m/s."""

    dynamics: np.ndarray  # 18a
    contact: np.ndarray  # the largest of 18b to 18e: penetration, normal law, friction law, cone

    @property
    def whole(self) -> np.ndarray:
        """Eq. 18."""
        return np.maximum(self.dynamics, self.contact)


def certify(scene: Scene, states: np.ndarray, forces: np.ndarray) -> Certificate:
    """Certifies the steps between the rows of `states` (n+1×13) under `forces` (n×8×3)."""
    before, after = states[:-1], states[1:]
    return Certificate(
        dynamics=dynamics_residual(scene, before, after, forces),
        contact=contact_residual(scene, before, after, forces),
    )


def dynamics_residual(
    scene: Scene, before: np.ndarray, after: np.ndarray, forces: np.ndarray
) -> np.ndarray:
    """Eq. 18a: the residuals of the semi-implicit step (8a–8d) as velocities."""
    h, reach = scene.step_seconds, scene.corners.max()
    q, spin = before[:, ATTITUDE], after[:, SPIN]

    body_forces = np.einsum("nji,ncj->nci", rotations(q), forces)
    torque = np.cross(scene.corners, body_forces).sum(axis=1)
    gyroscopic = np.cross(spin, scene.inertia * spin)
    half_turn = np.concatenate((np.zeros((len(q), 1)), h / 2 * spin), axis=1)
    turned = q + quaternion_product(q, half_turn)
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    # q and −q are the same attitude; an engine may return either.
    sign = np.sign(np.sum(turned * after[:, ATTITUDE], axis=1, keepdims=True))

    acceleration = forces.sum(axis=1) / scene.mass + scene.gravity
    residuals = (
        (after[:, POSITION] - before[:, POSITION] - h * after[:, VELOCITY]) / h,
        (sign * after[:, ATTITUDE] - turned) * reach / h,
        after[:, VELOCITY] - before[:, VELOCITY] - h * acceleration,
        (spin - before[:, SPIN] - h * (torque - gyroscopic) / scene.inertia) * reach,
    )
    return np.abs(np.concatenate(residuals, axis=1)).max(axis=1)


def contact_residual(
    scene: Scene, before: np.ndarray, after: np.ndarray, forces: np.ndarray
) -> np.ndarray:
    """The largest of eq. 18b to 18e over the corners.

    With p = h f_xy, c_xy the mean slip over the step and Π the projection on the disc of radius
    μ h max(f_z, 0): max(0, −z⁺/h), |min(h f_z/m, z⁺/h)|, ‖p − Π(p − m c_xy)‖/m and
    max(0, ‖p‖ − μ h f_z)/m.
    """
    h, mass, mu = scene.step_seconds, scene.mass, scene.friction
    old, new = corner_positions(scene, before), corner_positions(scene, after)
    slip, rise = (new - old)[..., :2] / h, new[..., 2] / h
    friction, normal = h * forces[..., :2], h * forces[..., 2]

    target = friction - mass * slip
    reach = np.maximum(np.linalg.norm(target, axis=2), np.finfo(float).tiny)
    shrink = np.minimum(1.0, mu * np.maximum(normal, 0.0) / reach)
    friction_law = np.linalg.norm(friction - target * shrink[..., None], axis=2) / mass
    cone = np.maximum(0.0, np.linalg.norm(friction, axis=2) - mu * normal) / mass
    normal_law = np.abs(np.minimum(normal / mass, rise))
    penetration = np.maximum(0.0, -rise)
    return np.maximum.reduce([penetration, normal_law, friction_law, cone]).max(axis=1)
