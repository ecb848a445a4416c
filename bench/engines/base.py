"""Interface of an engine in the comparison."""

import json
import multiprocessing
import subprocess
from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scene import Scene


@dataclass(frozen=True)
class Motion:
    """Motion of a scene in the ground frame."""

    states: np.ndarray  # n+1×13; n+1×boxes×13 for several boxes
    forces: np.ndarray | None  # n×8×3, ground on corner during each step, N; None: not available
    unsolved: int | None  # number of unsolved steps; None: not reported
    remarks: str = ""  # remarks of the engine about the run


class Engine(ABC):
    """Engine with its settings."""

    name: str
    settings: str
    # True if a run takes seconds. A busy machine disturbs such runs differently from runs of
    # milliseconds, so the two kinds are not compared.
    slow = False
    # Kinds of scenes that the engine runs.
    kinds: list[str]

    def runs(self, scene: Scene) -> bool:
        """True if the engine runs the scene."""
        return scene.kind in self.kinds

    @abstractmethod
    def time(self, scene: Scene) -> float:
        """Simulates the scene and returns the time of the steps only (s)."""

    @abstractmethod
    def record(self, scene: Scene) -> Motion:
        """Simulates the scene without timing and records everything."""

    def memory(self, scene: Scene) -> int:
        """Growth of memory to its peak during a simulation (KiB), measured in a forked process."""
        ours, theirs = multiprocessing.Pipe(duplex=False)

        def work() -> None:
            before = resident("VmRSS:")
            self.time(scene)
            theirs.send(resident("VmHWM:") - before)

        child = multiprocessing.get_context("fork").Process(target=work)
        child.start()
        child.join()
        if not ours.poll():
            raise RuntimeError(f"the process that measures memory ended with {child.exitcode}")
        return ours.recv()


class Unavailable(Exception):
    """Reason why the engine cannot run here."""


def ask(program: str, request: dict) -> dict:
    """Sends `request` as JSON to a program and returns its JSON output."""
    done = subprocess.run(
        [program], input=json.dumps(request), capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise RuntimeError(f"{program} ended with exit code {done.returncode}: {done.stderr}")
    return json.loads(done.stdout)


def one_or_all(states: list) -> np.ndarray:
    """States n+1×boxes×13 in the form of a motion, without the middle axis for a single box."""
    array = np.array(states)
    return array[:, 0] if array.shape[1] == 1 else array


def resident(name: str) -> int:
    """Value in Linux's /proc/self/status (KiB): `VmRSS:` is resident memory, `VmHWM:` its peak."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(name))


def nearest_corner(scene: Scene, point: np.ndarray) -> int:
    """Index of the corner nearest to a point in the body frame."""
    return int(np.argmin(np.sum((scene.box.corners - point) ** 2, axis=1)))
