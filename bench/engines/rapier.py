"""Rapier in double precision, by the small program in bench/rapier."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
from engines.base import Engine, Motion, Unavailable
from scene import Scene

BINARY = os.environ.get("BENCH_RAPIER", "target/bench-rapier/release/bench-rapier")

DEFAULT = {"coulomb": False, "iterations": 4, "sweeps": 1, "softness": [60.0, 10.0]}


class Rapier(Engine):
    """Rapier with its default or with more accurate parameters."""

    def __init__(self, mode: str, parameters: dict, settings: str) -> None:
        self.name = f"Rapier {mode}"
        self.parameters = DEFAULT | parameters
        self.settings = f"{settings}; no sleeping; timed: the loop over `step` in Rust"

    def time(self, scene: Scene) -> float:
        return self.simulate(scene, record=False)["seconds"]

    def record(self, scene: Scene) -> Motion:
        motion = self.simulate(scene, record=True)
        forces = np.array(motion["forces"]) if motion["forces"] else None
        return Motion(np.array(motion["states"]), forces, None)

    def simulate(self, scene: Scene, record: bool) -> dict:
        """Runs the program on the scene."""
        request = {
            "steps": scene.steps,
            "step_seconds": scene.step_seconds,
            "half_sides": (scene.sides / 2).tolist(),
            "mass": scene.mass,
            "inertia": scene.inertia.tolist(),
            "friction": scene.friction,
            "gravity": scene.gravity.tolist(),
            "start": scene.start.tolist(),
            "parameters": self.parameters,
            "record": record,
        }
        done = subprocess.run(
            [BINARY], input=json.dumps(request), capture_output=True, text=True, check=False
        )
        if done.returncode != 0:
            raise RuntimeError(f"{BINARY} ended with exit code {done.returncode}: {done.stderr}")
        return json.loads(done.stdout)


def engines() -> list[Engine]:
    if not Path(BINARY).is_file():
        raise Unavailable(f"there is no program {BINARY}")
    stiff = {"iterations": 12, "softness": [2000.0, 10.0]}
    return [
        Rapier("default", {}, "0.36.1, f64: 4 iterations, friction per manifold"),
        Rapier(
            "stiff",
            stiff,
            "12 iterations, friction per manifold, `static_contact_softness` 2000 Hz and 10 "
            "instead of 60 Hz and 10",
        ),
        Rapier("stiff, Coulomb", stiff | {"coulomb": True}, "the same, friction per point"),
    ]
