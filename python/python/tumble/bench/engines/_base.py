"""Interface of an engine's adapter."""

from __future__ import annotations

import multiprocessing
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..._types import Floats
from .._scene import Scene
from .._solids import matrix_of


class Unsupported(Exception):
    """Reason why an engine cannot pose a scene: a shape or a law that it does not have."""


@dataclass(frozen=True)
class Motion:
    """Motion of a scene."""

    states: Floats
    """States of the free bodies, (T + 1, N, 13): position, attitude, velocity, spin in the body's frame."""
    seconds: float
    """Processor time of the steps alone, s."""
    note: str = ""
    """Remark of the engine, such as steps that did not converge."""
    slowest: float = 0.0
    """Processor time of the slowest step, s."""
    facts: Mapping[str, float] = field(default_factory=dict)
    """Numbers of the engine about its steps, for the section on speed."""


class Stopwatch:
    """Processor time of steps: ``with stopwatch: step()``."""

    def __init__(self) -> None:
        self.seconds, self.slowest = 0.0, 0.0

    def __enter__(self) -> None:
        self._begin = time.process_time()

    def __exit__(self, *_: Any) -> None:
        taken = time.process_time() - self._begin
        self.seconds += taken
        self.slowest = max(self.slowest, taken)


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of a component of an end state. A field that is None is not known to the engine."""

    position: Floats | None = None
    """With respect to initial positions, (N, 3)."""
    velocity: Floats | None = None
    """With respect to initial velocities, (N, 3)."""
    friction: float | None = None
    gravity: Floats | None = None
    """With respect to gravity, (3,)."""
    mass: Floats | None = None
    """With respect to masses with fixed inertia, (N,)."""
    force: Floats | None = None
    """With respect to the force on each body in each step, (T, N, 3)."""


class Engine(ABC):
    """Engine with its settings."""

    name: str
    settings: str
    """Settings in one line."""
    compliant: bool
    """True if contacts yield by design, so that rest and stiction hold only nearly."""
    most_bodies: int | None = None
    """Largest number of bodies in the section on speed, for engines that take long."""

    @abstractmethod
    def version(self) -> str:
        """Version of the engine."""

    @abstractmethod
    def run(self, scene: Scene) -> Motion:
        """Simulates a scene.

        :raises Unsupported: if the engine cannot pose the scene.
        """

    def time(self, scene: Scene, before: int) -> float:
        """Processor time of the steps after the first ``before``, s, in a loop of the engine itself if it has one."""
        if before > 0:
            raise Unsupported("no loop of its own, so the first steps are timed too")
        return self.run(scene).seconds

    def memory(self, scene: Scene, before: int) -> int:
        """Growth of the memory to its peak, KiB, in a forked process."""
        ours, theirs = multiprocessing.Pipe(duplex=False)

        def work() -> None:
            resident = _status("VmRSS:")
            self.time(scene, before)
            theirs.send(_status("VmHWM:") - resident)

        child = multiprocessing.get_context("fork").Process(target=work)
        child.start()
        child.join()
        if not ours.poll():
            raise RuntimeError(f"the process that measures memory ended with exit code {child.exitcode}")
        return int(ours.recv())

    def sensitivities(self, scene: Scene, body: int, component: int) -> Sensitivities | None:
        """Derivatives of ``component`` of the end state of ``body``, the velocity's components being 7 to 9.

        None if the engine has no derivatives. Differences of runs are then measured instead.
        """
        return None


def _status(name: str) -> int:
    """Value in Linux's /proc/self/status, KiB: ``VmRSS:`` is the resident memory, ``VmHWM:`` its peak."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(name))


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
