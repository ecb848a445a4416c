"""What an engine is to the comparison."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from scene import Scene


@dataclass(frozen=True)
class Motion:
    """What an engine made of a scene, in the ground frame."""

    states: np.ndarray  # n+1×13
    forces: np.ndarray | None  # n×8×3, ground on corner during each step, N; None: not to be had
    unsolved: int | None  # steps whose problem was not solved; None: not reported


class Engine(ABC):
    """An engine with its settings."""

    name: str
    settings: str
    # Whether a run takes seconds: on a busy machine such a run shares its processor, which one
    # of milliseconds may escape, so that the two kinds are not compared.
    slow = False

    def runs(self, scene: Scene) -> bool:
        """Whether the engine takes part in the scene."""
        return True

    @abstractmethod
    def time(self, scene: Scene) -> float:
        """Simulates the scene; the seconds that the stepping alone took."""

    @abstractmethod
    def record(self, scene: Scene) -> Motion:
        """Simulates the scene again and keeps everything; not timed."""


class Unavailable(Exception):
    """The engine cannot be run here, and why."""


def nearest_corner(scene: Scene, point: np.ndarray) -> int:
    """The corner nearest to a point in the body frame."""
    return int(np.argmin(np.sum((scene.corners - point) ** 2, axis=1)))
