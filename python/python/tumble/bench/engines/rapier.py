"""Rapier in double precision, by the program in bench/rapier: free boxes on level ground."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from .._scene import Scene
from ._base import Engine, Motion, Unsupported, no_restitution
from ._program import asked

BINARY = os.environ.get("BENCH_RAPIER", "")
if not Path(BINARY).is_file():
    raise ImportError("BENCH_RAPIER is not the absolute path of a program; build bench/rapier with cargo and set it")


class Rapier(Engine):
    """Rapier with the given parameters."""

    compliant = True

    def __init__(self, name: str, parameters: dict[str, Any], settings: str) -> None:
        self.name, self.parameters, self.settings = name, parameters, settings

    def version(self) -> str:
        return "0.36.1"

    def run(self, scene: Scene) -> Motion:
        # A run that is timed does not record.
        return Motion(np.array(self._asked(scene, 0, True)["states"]), self.time(scene, 0))

    def time(self, scene: Scene, before: int) -> float:
        return float(self._asked(scene, before, False)["seconds"])

    def memory(self, scene: Scene, before: int) -> int:
        return int(self._asked(scene, before, False)["memory_kib"])

    def _asked(self, scene: Scene, before: int, record: bool) -> dict[str, Any]:
        no_restitution(scene)
        if any(body.fixed for body in scene.bodies):
            raise Unsupported("bench/rapier has no fixed bodies")
        return asked(BINARY, scene, before, parameters=self.parameters, record=record)


ENGINES: list[Engine] = [
    Rapier(
        "rapier",
        {"coulomb": True, "iterations": 12, "sweeps": 1, "softness": [2000.0, 10.0]},
        "f64, 12 iterations, friction per point, static_contact_softness 2000 Hz and 10",
    ),
    Rapier(
        "rapier-default",
        {"coulomb": False, "iterations": 4, "sweeps": 1, "softness": [60.0, 10.0]},
        "f64, defaults: 4 iterations, friction per manifold",
    ),
]
