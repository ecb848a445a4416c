"""Interface of an engine's adapter."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Optional

import numpy as np

from .._scene import Floats, Scene
from .._solids import matrix_of


class Unsupported(Exception):
    """Reason why an engine cannot pose a scene: a shape or a law that it does not have."""


@dataclass(frozen=True)
class Motion:
    """Motion of a scene."""

    states: Floats
    """States of the free bodies, (T + 1, N, 13): position, attitude, velocity, spin in the body's frame."""
    seconds: float
    """Time of the steps alone, s."""
    note: str = ""
    """Remark of the engine, such as steps that did not converge."""


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of a component of an end state. A field that is None is not known to the engine."""

    position: Optional[Floats] = None
    """By initial positions, (N, 3)."""
    velocity: Optional[Floats] = None
    """By initial velocities, (N, 3)."""
    friction: Optional[float] = None
    gravity: Optional[Floats] = None
    """By gravity, (3,)."""
    mass: Optional[Floats] = None
    """By masses with fixed inertia, (N,)."""
    force: Optional[Floats] = None
    """By the force on each body in each step, (T, N, 3)."""


class Engine(ABC):
    """Engine with its settings."""

    name: str
    settings: str
    """Settings in one line."""
    compliant: bool
    """True if contacts yield by design, so that rest and stiction hold only nearly."""

    @abstractmethod
    def version(self) -> str:
        """Version of the engine."""

    @abstractmethod
    def run(self, scene: Scene) -> Motion:
        """Simulates a scene.

        :raises Unsupported: if the engine cannot pose the scene.
        """

    def sensitivities(self, scene: Scene, body: int, component: int) -> Optional[Sensitivities]:
        """Derivatives of ``component`` of the end state of ``body``, the velocity's components being 7 to 9.

        None if the engine has no derivatives. Differences of runs are then measured instead.
        """
        return None


def world_spin(states: Floats) -> Floats:
    """Spins in the world's frame (N, 3) of states (N, 13)."""
    spins: Floats = np.einsum("nij,nj->ni", matrix_of(states[:, 3:7]), states[:, 10:13])
    return spins


def rows(positions: Floats, attitudes: Floats, velocities: Floats, world_spins: Floats) -> Floats:
    """States (N, 13) from arrays with spins in the world's frame and quaternions w, x, y, z."""
    units = attitudes / np.linalg.norm(attitudes, axis=1, keepdims=True)
    spins = np.einsum("nji,nj->ni", matrix_of(units), world_spins)
    states: Floats = np.concatenate([positions, units, velocities, spins], axis=1)
    return states


def no_restitution(scene: Scene, elastic: bool = False) -> None:
    """Refuses scenes with restitution, or with restitution other than 1 if ``elastic``."""
    if scene.restitution > 0.0 and not (elastic and scene.restitution == 1.0):
        raise Unsupported(f"no coefficient of restitution ({scene.restitution:g} is needed)")
