"""Programs that simulate boxes on level ground: a scene as JSON on standard input, its motion as JSON on standard output."""

from __future__ import annotations

import json
import subprocess
from typing import Any

from .._scene import Scene
from ._base import Unsupported


def asked(program: str, scene: Scene, before: int = 0, **options: Any) -> dict[str, Any]:
    """Answer of a program about the steps of a scene after the first ``before``.

    :raises Unsupported: for a scene that is not of boxes on level ground.
    """
    upright = all(list(body.attitude) == [1.0, 0.0, 0.0, 0.0] for body in scene.bodies if body.fixed)
    if not scene.ground or scene.forces or not upright or any(body.kind != "box" for body in scene.bodies):
        raise Unsupported("its program poses boxes on level ground, without forces")
    request: dict[str, Any] = {
        "untimed": before,
        "steps": scene.steps - before,
        "step_seconds": scene.time_step,
        **boxes(scene),
        **options,
    }
    done = subprocess.run([program], input=json.dumps(request), capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{program} ended with exit code {done.returncode}: {done.stderr[-200:]}")
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


def boxes(scene: Scene) -> dict[str, Any]:
    """Friction, gravity and boxes of a scene as JSON data."""
    return {
        "friction": scene.friction,
        "gravity": scene.gravity.tolist(),
        "boxes": [
            {
                "half_sides": [float(half) for half in body.size],
                "mass": body.mass,
                "inertia": body.inertia.tolist(),
                "start": body.state.tolist(),
            }
            for body in scene.free
        ],
        "walls": [
            {"half_sides": [float(half) for half in body.size], "centre": body.position.tolist()}
            for body in scene.bodies
            if body.fixed
        ],
    }
