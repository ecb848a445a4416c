"""Figures of a motion of several boxes, computed equally for every engine."""

import numpy as np
from engines.base import Motion
from scene import ATTITUDE, POSITION, SPIN, VELOCITY, Scene, rotations

# Number of states in which overlaps are computed, including the last.
SAMPLES = 100


def measure_several(scene: Scene, motion: Motion) -> dict[str, float | int | str | None]:
    """All figures of one motion: lengths in m, energies in J."""
    states = motion.states
    if states.ndim == 2:
        states = states[:, None, :]
    if not np.isfinite(states).all():
        raise RuntimeError(f"the motion of {scene.name} is not finite")
    samples = np.unique(np.linspace(0, len(states) - 1, SAMPLES).round().astype(int))
    overlaps = [deepest_overlap(scene, states[k]) for k in samples]
    moved = np.linalg.norm((states[-1] - states[0])[:, POSITION], axis=1)
    kinetic, total = energies(scene, states)
    return {
        "overlap_m": max(overlaps),
        "last_overlap_m": overlaps[-1],
        "moved_m": float(moved.max()),
        "kinetic_energy_J": float(kinetic[-1]),
        "energy_rise_J": float((total - np.minimum.accumulate(total)).max()),
        "unsolved": motion.unsolved,
        "remarks": motion.remarks,
    }


def energies(scene: Scene, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Kinetic and total energy of all boxes in every state (J)."""
    mass = np.array([box.mass for box in scene.boxes])
    inertia = np.array([box.inertia for box in scene.boxes])
    kinetic = mass * (states[..., VELOCITY] ** 2).sum(axis=2)
    kinetic += (inertia * states[..., SPIN] ** 2).sum(axis=2)
    height = mass * (states[..., POSITION] @ -scene.gravity)
    return kinetic.sum(axis=1) / 2, (kinetic / 2 + height).sum(axis=1)


def deepest_overlap(scene: Scene, states: np.ndarray) -> float:
    """Largest overlap of two boxes, or of a box and the ground (m).

    Two boxes are tested along their separating axes: 3 + 3 face normals and 9 products of edges.
    Along a unit axis the overlap is the sum of both half widths Σ |a·e_i| s_i minus the distance
    of the centres. The depth is the minimum over the axes.
    """
    turns, centres = rotations(states[:, ATTITUDE]), states[:, POSITION]
    halves = np.array([box.sides / 2 for box in scene.boxes])
    # Half width of a box along z: Σ |A_zi| s_i.
    lowest = centres[:, 2] - np.einsum("ni,ni->n", np.abs(turns[:, 2]), halves)
    deepest = max(0.0, -float(lowest.min()))
    first, second = near_pairs(centres, halves)
    if len(first) == 0:
        return deepest
    a, b = turns[first], turns[second]
    # The columns are the axes of a box. Products of parallel edges are not valid axes.
    edges = np.cross(a[:, :, :, None], b[:, :, None, :], axis=1).reshape(len(first), 3, 9)
    axes = np.concatenate((a, b, edges), axis=2)
    lengths = np.linalg.norm(axes, axis=1)
    usable = lengths > 1e-6
    axes = axes / np.where(usable, lengths, 1.0)[:, None, :]
    widths = sum(
        np.einsum("pij,pi->pj", np.abs(np.einsum("pki,pkj->pij", turn, axes)), half)
        for turn, half in ((a, halves[first]), (b, halves[second]))
    )
    apart = np.abs(np.einsum("pi,pij->pj", centres[second] - centres[first], axes))
    depths = np.where(usable, widths - apart, np.inf).min(axis=1)
    return max(deepest, float(depths.max()))


def near_pairs(centres: np.ndarray, halves: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of boxes whose circumscribed spheres intersect."""
    reach = np.linalg.norm(halves, axis=1)
    first, second = np.triu_indices(len(centres), k=1)
    distance = np.linalg.norm(centres[second] - centres[first], axis=1)
    near = distance < reach[first] + reach[second]
    return first[near], second[near]
