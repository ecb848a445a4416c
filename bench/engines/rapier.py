"""Rapier in double precision, by the program in bench/rapier."""

import os
from pathlib import Path

import numpy as np
from engines.base import Engine, Motion, Unavailable, ask, one_or_all
from scene import Scene

BINARY = os.environ.get("BENCH_RAPIER", "target/bench-rapier/release/bench-rapier")

DEFAULT = {"coulomb": False, "iterations": 4, "sweeps": 1, "softness": [60.0, 10.0]}


class Rapier(Engine):
    """Rapier with its default parameters or with more accurate ones."""

    def __init__(self, mode: str, kinds: str, parameters: dict, settings: str) -> None:
        self.name = f"Rapier {mode}"
        self.kinds = kinds.split()
        self.parameters = DEFAULT | parameters
        timed = "the loop over `step` in Rust, processor time"
        self.settings = f"{settings}; no sleeping; timed: {timed}"

    def time(self, scene: Scene) -> float:
        return self.simulate(scene, record=False)["seconds"]

    def record(self, scene: Scene) -> Motion:
        motion = self.simulate(scene, record=True)
        forces = np.array(motion["forces"]) if motion["forces"] else None
        return Motion(one_or_all(motion["states"]), forces, None)

    def memory(self, scene: Scene) -> int:
        return self.simulate(scene, record=False)["memory_kib"]

    def simulate(self, scene: Scene, record: bool) -> dict:
        """Runs the program on the scene."""
        asked = {"parameters": self.parameters, "untimed": scene.untimed, "record": record}
        return ask(BINARY, scene.request() | asked)


def engines() -> list[Engine]:
    if not Path(BINARY).is_file():
        raise Unavailable(f"there is no program {BINARY}")
    stiff = {"iterations": 12, "softness": [2000.0, 10.0]}
    return [
        Rapier(
            "default",
            "one several growth",
            {},
            "0.36.1, f64: 4 iterations, friction per manifold",
        ),
        Rapier(
            "stiff",
            "one several",
            stiff,
            "12 iterations, friction per manifold, `static_contact_softness` 2000 Hz and 10 "
            "instead of 60 Hz and 10",
        ),
        Rapier("stiff, Coulomb", "one", stiff | {"coulomb": True}, "the same, friction per point"),
    ]
