"""Jolt Physics in WebAssembly, by the program in bench/jolt."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from ..._types import Floats
from .._scene import Scene
from ._base import Engine, Motion, rows, world_spin

PROGRAM = os.environ.get("BENCH_JOLT", "")
if not Path(PROGRAM).is_file():
    raise ImportError("BENCH_JOLT is not the path of bench/jolt/jolt.js; run npm install there and set it")


class Jolt(Engine):
    """Jolt with its settings by name."""

    compliant = True
    """Overlaps up to the penetration slop stay."""

    def __init__(self, name: str, parameters: dict[str, Any], settings: str) -> None:
        self.name, self.parameters, self.settings = name, parameters, settings

    def version(self) -> str:
        package = Path(PROGRAM).parent / "node_modules" / "jolt-physics" / "package.json"
        return str(json.loads(package.read_text())["version"])

    def run(self, scene: Scene) -> Motion:
        # Only wrenches of forces off the centres depend on the states: the program then waits for those of each step.
        waits = any(force.at.any() for force in scene.forces)
        spins = iter(world_spin(scene.states).tolist())
        request = {
            "time_step": scene.time_step,
            "gravity": scene.gravity.tolist(),
            "friction": scene.friction,
            "restitution": scene.restitution,
            "ground": scene.ground,
            # Slower approaches do not bounce; tumble's threshold is 2 g h.
            "bounce_from": 2.0 * float(np.linalg.norm(scene.gravity)) * scene.time_step,
            "settings": self.parameters,
            "wrenches": [] if waits else [_wrenches(scene, step, scene.states) for step in range(scene.steps)],
            "bodies": [
                {
                    "kind": body.kind,
                    "size": [float(size) for size in body.size],
                    "points": body.points.tolist(),
                    "fixed": body.fixed,
                    "mass": body.mass,
                    "inertia": body.inertia.tolist(),
                    "position": body.position.tolist(),
                    "attitude": body.attitude.tolist(),
                    "velocity": body.velocity.tolist(),
                    "world_spin": [0.0] * 3 if body.fixed else next(spins),
                }
                for body in scene.bodies
            ],
        }
        states = np.empty((scene.steps + 1, len(scene.free), 13))
        states[0] = scene.states
        pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        with subprocess.Popen(["node", PROGRAM], **pipes) as program:
            assert program.stdin is not None and program.stdout is not None
            program.stdin.write(json.dumps(request) + "\n")
            program.stdin.flush()
            for step in range(scene.steps):
                if waits:
                    program.stdin.write(json.dumps(_wrenches(scene, step, states[step])) + "\n")
                    program.stdin.flush()
                line = program.stdout.readline()
                if not line:
                    raise RuntimeError(f"{PROGRAM} ended in step {step}")
                found = np.array(json.loads(line))
                states[step + 1] = rows(found[:, :3], found[:, 3:7], found[:, 7:10], found[:, 10:])
            program.stdin.close()
            seconds = float(program.stdout.readline())
        return Motion(states, seconds)


def _wrenches(scene: Scene, step: int, states: Floats) -> Any:
    return scene.wrenches(step, states).tolist() if scene.forces else []


ENGINES: list[Engine] = [
    Jolt("jolt", {"mNumVelocitySteps": 100, "mNumPositionSteps": 20}, "single precision, 100 velocity and 20 position steps"),
    Jolt("jolt-default", {}, "single precision, defaults: 10 velocity and 2 position steps"),
]
