"""Figures of a motion, computed equally for every engine."""

import numpy as np
from certificate import certify
from engines.base import Motion
from scene import POSITION, SPIN, VELOCITY, Scene, corner_positions


def measure(scene: Scene, motion: Motion) -> dict[str, float | int | None]:
    """All figures of one motion: lengths in m, energies in J, certificates in m/s."""
    states = motion.states
    if not np.isfinite(states).all():
        raise RuntimeError(f"the motion of {scene.name} is not finite")
    lowest = corner_positions(scene, states)[..., 2].min(axis=1)
    figures = {
        "penetration_m": max(0.0, -float(lowest.min())),
        "unsolved": motion.unsolved,
        "certificate_m_s": None,
        "certificate_contact_m_s": None,
    }
    if motion.forces is not None:
        certificate = certify(scene, states, motion.forces)
        figures["certificate_m_s"] = float(certificate.whole.max())
        figures["certificate_contact_m_s"] = float(certificate.contact.max())
    figures.update(SPECIAL.get(scene.name, lambda *_: {})(scene, states, lowest))
    return figures


def rest(scene: Scene, states: np.ndarray, _lowest: np.ndarray) -> dict[str, float]:
    """Displacement of the centre, and the largest kinetic energy after the first second."""
    moved = np.abs(states[-1] - states[0])[POSITION]
    settled = states[round(1.0 / scene.step_seconds) :]
    energy = scene.box.mass * settled[:, VELOCITY] ** 2 + scene.box.inertia * settled[:, SPIN] ** 2
    return {
        "drift_m": float(np.hypot(moved[0], moved[1])),
        "sink_m": float(moved[2]),
        "kinetic_energy_J": float(energy.sum(axis=1).max() / 2),
    }


def slide(scene: Scene, states: np.ndarray, lowest: np.ndarray) -> dict[str, float]:
    """Largest height of the lowest corner, and distance compared with v² / (2 μ g)."""
    speed, g = np.linalg.norm(scene.box.start[VELOCITY]), -scene.gravity[2]
    exact = speed**2 / (2 * scene.friction * g)
    distance = np.linalg.norm((states[-1] - states[0])[:2])
    return {
        "lift_off_m": max(0.0, float(lowest.max())),
        "distance_m": float(distance),
        "distance_error_m": float(distance - exact),
        "final_speed_m_s": float(np.linalg.norm(states[-1, VELOCITY])),
    }


def incline(_scene: Scene, states: np.ndarray, _lowest: np.ndarray) -> dict[str, float]:
    """Creep of the centre along the slope, in total and in the second half. It should be zero."""
    half = states[len(states) // 2]
    moved, late = (states[-1] - start for start in (states[0], half))
    return {
        "creep_m": float(np.hypot(moved[0], moved[1])),
        "late_creep_m": float(np.hypot(late[0], late[1])),
    }


SPECIAL = {"rest": rest, "slide": slide, "incline": incline}
