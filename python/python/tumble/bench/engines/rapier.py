"""Rapier in double precision, by the program in bench/rapier: boxes on level ground."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any, Dict, List

import numpy as np

from .._scene import Body, Scene
from ._base import Engine, Motion, Unsupported, no_restitution

BINARY = os.environ.get("BENCH_RAPIER", "")
if not Path(BINARY).is_file():
    raise ImportError("BENCH_RAPIER is not the absolute path of a program; build bench/rapier with cargo and set it")

PARAMETERS = {"coulomb": True, "iterations": 12, "sweeps": 1, "softness": [2000.0, 10.0]}


class Rapier(Engine):
    """Rapier with stiff contacts and friction at each point."""

    name = "rapier"
    settings = "f64, 12 iterations, friction per point, static_contact_softness 2000 Hz and 10"
    compliant = True

    def version(self) -> str:
        return "0.36.1"

    def run(self, scene: Scene) -> Motion:
        no_restitution(scene)
        if not scene.ground or scene.forces or any(body.kind != "box" or body.fixed for body in scene.bodies):
            raise Unsupported("bench/rapier poses free boxes on level ground, without forces")
        request: Dict[str, Any] = {
            "untimed": 0,
            "steps": scene.steps,
            "step_seconds": scene.time_step,
            "friction": scene.friction,
            "gravity": scene.gravity.tolist(),
            "boxes": [_cuboid(body) for body in scene.bodies],
            "parameters": PARAMETERS,
        }
        recorded = _asked({**request, "record": True})
        # A run that is timed does not record.
        seconds = float(_asked({**request, "record": False})["seconds"])
        return Motion(np.array(recorded["states"]), seconds)


def _cuboid(body: Body) -> Dict[str, Any]:
    numbers = {"half_sides": body.size, "inertia": body.inertia.tolist(), "start": body.state.tolist()}
    return {**numbers, "mass": body.mass}


def _asked(request: Dict[str, Any]) -> Dict[str, Any]:
    done = subprocess.run(
        [BINARY], input=json.dumps(request), capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise RuntimeError(f"{BINARY} ended with exit code {done.returncode}: {done.stderr[-200:]}")
    answer: Dict[str, Any] = json.loads(done.stdout)
    return answer


ENGINES: List[Engine] = [Rapier()]
