"""Residual of a step, eq. 18 of docs/formulation.md, in numpy for whole motions.

It only needs states and contact forces, so it applies to any engine that reports its forces.
Every run of the comparison checks it against tumble's own column.
"""

from dataclasses import dataclass

import numpy as np
from scene import ATTITUDE, POSITION, SPIN, VELOCITY, Scene
from scene import corner_positions, quaternion_product, rotations


@dataclass(frozen=True)
class Certificate:
    """Parts of eq. 18 for each step (m/s)."""

    dynamics: np.ndarray  # 18a
    contact: np.ndarray  # the largest of 18b to 18e: penetration, normal law, friction law, cone

    @property
    def whole(self) -> np.ndarray:
        """Residual of eq. 18 for each step (m/s)."""
        return np.maximum(self.dynamics, self.contact)


def certify(scene: Scene, states: np.ndarray, forces: np.ndarray) -> Certificate:
    """Certificates of the steps between rows of `states` (n+1×13) under `forces` (n×8×3)."""
    before, after = states[:-1], states[1:]
    return Certificate(
        dynamics=dynamics_residual(scene, before, after, forces),
        contact=contact_residual(scene, before, after, forces),
    )


def dynamics_residual(
    scene: Scene, before: np.ndarray, after: np.ndarray, forces: np.ndarray
) -> np.ndarray:
    """Residual of the dynamics, eq. 18a: the semi-implicit step (8a–8d) as velocities (m/s)."""
    h, reach = scene.step_seconds, scene.box.corners.max()
    q, spin = before[:, ATTITUDE], after[:, SPIN]

    body_forces = np.einsum("nji,ncj->nci", rotations(q), forces)
    torque = np.cross(scene.box.corners, body_forces).sum(axis=1)
    gyroscopic = np.cross(spin, scene.box.inertia * spin)
    half_turn = np.concatenate((np.zeros((len(q), 1)), h / 2 * spin), axis=1)
    turned = q + quaternion_product(q, half_turn)
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    # q and −q are the same attitude, and an engine may return either.
    sign = np.sign(np.sum(turned * after[:, ATTITUDE], axis=1, keepdims=True))

    acceleration = forces.sum(axis=1) / scene.box.mass + scene.gravity
    residuals = (
        (after[:, POSITION] - before[:, POSITION] - h * after[:, VELOCITY]) / h,
        (sign * after[:, ATTITUDE] - turned) * reach / h,
        after[:, VELOCITY] - before[:, VELOCITY] - h * acceleration,
        (spin - before[:, SPIN] - h * (torque - gyroscopic) / scene.box.inertia) * reach,
    )
    return np.abs(np.concatenate(residuals, axis=1)).max(axis=1)


def contact_residual(
    scene: Scene, before: np.ndarray, after: np.ndarray, forces: np.ndarray
) -> np.ndarray:
    """Maximum of eq. 18b to 18e over the corners (m/s).

    Each corner has its own scale. W = E/m + Gᵀ I⁻¹ G is the response of its velocity to an
    impulse, with G = [c]× Aᵀ, w_n = W_zz and w_t = (W_xx + W_yy)/2. The impulses are expressed as
    the speeds n = w_n h f_z and p = w_t h f_xy. c_xy is the mean slip over the step, and Π the
    projection onto the disc of radius μ w_t h max(f_z, 0). The parts are max(0, −z⁺/h),
    |min(n, z⁺/h)|, ‖p − Π(p − c_xy)‖ and max(0, ‖p‖ − μ w_t h f_z).
    """
    h, mu = scene.step_seconds, scene.friction
    old, new = corner_positions(scene, before), corner_positions(scene, after)
    slip, rise = (new - old)[..., :2] / h, new[..., 2] / h
    w_n, w_t = responses(scene, before)
    friction, limit = w_t[..., None] * h * forces[..., :2], mu * w_t * h * forces[..., 2]

    target = friction - slip
    reach = np.maximum(np.linalg.norm(target, axis=2), np.finfo(float).tiny)
    shrink = np.minimum(1.0, np.maximum(limit, 0.0) / reach)
    friction_law = np.linalg.norm(friction - target * shrink[..., None], axis=2)
    cone = np.maximum(0.0, np.linalg.norm(friction, axis=2) - limit)
    normal_law = np.abs(np.minimum(w_n * h * forces[..., 2], rise))
    penetration = np.maximum(0.0, -rise)
    return np.maximum.reduce([penetration, normal_law, friction_law, cone]).max(axis=1)


def responses(scene: Scene, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Responses w_n and w_t of every corner in every state (1/kg).

    W_dd = 1/m + τ·I⁻¹τ for a direction d, with τ = c × Aᵀ d.
    """
    axes = rotations(states[:, ATTITUDE])  # rows: Aᵀ d in the body's frame
    torques = np.cross(scene.box.corners[None, :, None, :], axes[:, None, :, :])
    diagonal = 1 / scene.box.mass + (torques * torques / scene.box.inertia).sum(axis=3)
    return diagonal[..., 2], diagonal[..., :2].mean(axis=2)
