"""What an engine is to the comparison."""

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
    """What an engine made of a scene, in the ground frame."""

    states: np.ndarray  # n+1×13; of several boxes n+1×boxes×13
    forces: np.ndarray | None  # n×8×3, ground on corner during each step, N; None: not to be had
    unsolved: int | None  # steps whose problem was not solved; None: not reported
    remarks: str = ""  # what the engine itself says of the run


class Engine(ABC):
    """An engine with its settings."""

    name: str
    settings: str
    # Whether a run takes seconds: on a busy machine such a run shares its processor, which one
    # of milliseconds may escape, so that the two kinds are not compared.
    slow = False
    # The kinds of scenes that it takes part in.
    kinds: list[str]

    def runs(self, scene: Scene) -> bool:
        """Whether the engine takes part in the scene."""
        return scene.kind in self.kinds

    @abstractmethod
    def time(self, scene: Scene) -> float:
        """Simulates the scene; the seconds that the stepping alone took."""

    @abstractmethod
    def record(self, scene: Scene) -> Motion:
        """Simulates the scene again and keeps everything; not timed."""

    def memory(self, scene: Scene) -> int:
        """What memory grows by to its peak when the scene is simulated, KiB: here of this
        process, in a fork of it."""
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
    """The engine cannot be run here, and why."""


def ask(program: str, request: dict) -> dict:
    """The answer of a program that reads and writes JSON."""
    done = subprocess.run(
        [program], input=json.dumps(request), capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise RuntimeError(f"{program} ended with exit code {done.returncode}: {done.stderr}")
    return json.loads(done.stdout)


def one_or_all(states: list) -> np.ndarray:
    """States n+1×boxes×13 as a motion has them: without the middle axis if there is one box."""
    array = np.array(states)
    return array[:, 0] if array.shape[1] == 1 else array


def resident(name: str) -> int:
    """A line of Linux's /proc/self/status in KiB: `VmRSS:` is what is resident, `VmHWM:` its
    peak."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(name))


def nearest_corner(scene: Scene, point: np.ndarray) -> int:
    """The corner nearest to a point in the body frame."""
    return int(np.argmin(np.sum((scene.box.corners - point) ** 2, axis=1)))
